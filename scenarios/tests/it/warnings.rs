//! What is told of scenarios that can be run and are hardly meant.

use shoal_scenarios::{Overrides, catalog, parse};

fn warnings_of(text: &str) -> Vec<String> {
    let scenario = parse("test.toml", text, &Overrides::default()).unwrap_or_else(|problems| panic!("{problems}"));
    scenario.warnings.iter().map(ToString::to_string).collect()
}

fn check(text: &str, expected: &[&str]) {
    assert_eq!(warnings_of(text), expected, "{text}");
}

const PAIR: &str = r#"
[[robot]]
id = "a"
start_m = [-3, 0.1]
goal_m = [0, 0]
[[robot]]
id = "b"
start_m = [6, 0]
goal_m = [GOAL]
"#;

#[test]
fn goals_nearer_than_the_bodies() {
    let pair = |goal: &str, rest: &str| PAIR.replace("GOAL", goal) + rest;
    let said = |apart: &str| {
        format!("line 9: robot[1].goal_m: the goals of `b` and `a` are {apart} m apart, their bodies need 0.400 m")
    };
    check(&pair("0, 0", ""), &[&said("0.000")]);
    check(&pair("0.3, 0.1", ""), &[&said("0.316")]);
    check(&pair("0.4, 0", ""), &[]);
    check(&pair("0, 0", "[[event]]\nkind = \"leave\"\nat_s = 30\nrobot = \"a\"\n"), &[]);
    check(&pair("0, 0", "[[event]]\nkind = \"task\"\nat_s = 30\nrobot = \"b\"\ngoal_m = [4, 4]\n"), &[]);
}

#[test]
fn ticks_that_are_too_long_for_the_tolerance() {
    let robot = "[[robot]]\nid = \"a\"\nstart_m = [-3, 0]\ngoal_m = [3, 0]\n";
    let said = "line 4: robot[0]: `a`: drives up to 0.400 m in a tick, 4.0 times its goal tolerance of 0.1 m";
    check(&format!("[defaults]\nspeed_mps_max = 20\n{robot}"), &[said]);
    check(&format!("[defaults]\nspeed_mps_max = 9\n{robot}"), &[]);
}

#[test]
fn a_whole_fleet_is_told_once_and_many_of_a_kind_are_counted() {
    let fleet = "[world]\nx_m = [-50, 50]\ny_m = [-50, 50]\n[defaults]\nradius_m = 0.4\nspeed_mps_max = 20\nplanner = \"straight\"\n\
                 [layout]\nkind = \"circle-swap\"\nrobots = 40\nradius_m = 20\n";
    assert_eq!(warnings_of(fleet).len(), 1);
    assert!(warnings_of(fleet)[0].contains("`r00` and 39 others: drives"), "{:?}", warnings_of(fleet));

    let starts: Vec<String> = (0..30).map(|i| format!("[{i}, 0]")).collect();
    let goals: Vec<String> = (0..30).map(|i| format!("[{}, 5]", 0.1 * f64::from(i))).collect();
    let crowd = format!(
        "[world]\nx_m = [-50, 50]\n[layout]\nkind = \"list\"\nrobots = 30\nstarts_m = [{}]\ngoals_m = [{}]\n",
        starts.join(", "),
        goals.join(", ")
    );
    let told = warnings_of(&crowd);
    assert_eq!(told.len(), 6, "{told:?}");
    assert!(told[5].starts_with("and 24 more like `"), "{told:?}");
}

#[test]
fn the_catalog_means_what_it_says() {
    for entry in catalog() {
        check(entry.text, &[]);
    }
}

#[test]
fn robots_that_nobody_hears_before_they_touch() {
    let pair = |keys: &str| format!("[defaults]\n{keys}\n{}", PAIR.replace("GOAL", "9, 9"));
    let said = "line 6: robot[0]: `a` and another one: knows robots by radio alone, which reaches 0.3 m: their bodies \
                touch at up to 0.400 m";
    check(&pair("sees_robots = false\nradio_range_m = 0.3"), &[said]);
    check(&pair("sees_robots = false\nradio_range_m = 3"), &[]);
    check(&pair("radio_range_m = 0.3"), &[]);
}
