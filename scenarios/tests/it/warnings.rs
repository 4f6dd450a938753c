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

/// Of every planner with a body of this size, kind and parameters: whether it warns, and of what.
#[test]
fn defaults_for_bodies_of_another_size() {
    let fleet = |planner: &str, radius: f64, more: &str| {
        format!(
            "[world]\nx_m = [-50, 50]\ny_m = [-50, 50]\n[defaults]\nradius_m = {radius}\nplanner = \"{planner}\"\n{more}\
             [layout]\nkind = \"circle-swap\"\nrobots = 8\nradius_m = 20\n"
        )
    };
    let measures_in_radii = ["straight", "orca", "power-law", "lanes"];
    let mut kinds = 0;
    for method in planners::METHODS.iter().filter(|method| method.kinds.contains(&model::BodyKind::Point)) {
        kinds += 1;
        for radius in [0.05, 0.09, 0.1, 0.2, 0.4, 0.41, 0.5] {
            let told = warnings_of(&fleet(method.name, radius, ""));
            let warns = !measures_in_radii.contains(&method.name) && !(0.1..=0.4).contains(&radius);
            assert_eq!(told.len(), usize::from(warns), "{} {radius}: {told:?}", method.name);
            if warns {
                let said = format!(
                    "`r00` and 7 others: defaults of `{}` are for bodies of 0.2 m, this one has {radius} m: ",
                    method.name
                );
                assert!(told[0].contains(&said), "{}", told[0]);
            }
        }
    }
    assert!(kinds >= 11, "{kinds}");

    let scenario = |text: &str| parse("test.toml", text, &Overrides::default()).unwrap();
    let told = scenario(&fleet("apf", 0.05, "")).warnings;
    assert_eq!(
        (told[0].message.as_str(), told[0].hint.as_deref().unwrap()),
        (
            "`r00` and 7 others: defaults of `apf` are for bodies of 0.2 m, this one has 0.05 m: influence_m 1 m, k_rep 0.2 m⁴/s",
            "in proportion: planners.apf.influence_m=0.25 planners.apf.k_rep=0.0031; or take a planner that measures in \
             radii: orca, power-law, lanes"
        )
    );
    // What is given is meant, one by one or as a preset.
    let given = "[planners.apf]\ninfluence_m = 1\n";
    let told = warnings_of(&fleet("apf", 0.5, given));
    assert!(told.len() == 1 && told[0].ends_with("0.5 m: k_rep 0.2 m⁴/s"), "{told:?}");
    assert_eq!(warnings_of(&fleet("apf", 0.5, &format!("{given}k_rep = 3\n"))), [""; 0]);
    assert_eq!(warnings_of(&fleet("amr-apf", 0.05, "[planners.amr-apf]\npreset = \"fleet\"\n")), [""; 0]);
    // One line for each planner, however many sizes.
    let many: String = (0..4)
        .map(|i| {
            let planner = ["apf", "rpoa"][i % 2];
            format!("[[robot]]\nid = \"a{i}\"\nstart_m = [{}, 0]\ngoal_m = [{}, 8]\nradius_m = 0.{}\nplanner = \"{planner}\"\n", 2 * i, 2 * i, i + 5)
        })
        .collect();
    let told = warnings_of(&format!("[world]\nx_m = [-50, 50]\n{many}"));
    assert!(told.len() == 2 && told.iter().all(|line| line.contains("and another one")), "{told:?}");
}
