//! Right of way in fleets: what the world counts of runs whose geometry is plain.

use scenarios::Overrides;
use shoal_tests::{Recording, build, scenario};

/// One drives to the east through the origin and one to the north, which is `late_m` farther away.
fn cross(late_m: f64, radio_range_m: f64) -> (u64, u64) {
    let text = format!(
        "[clock]\nduration_s = 20\n[defaults]\nplanner = \"straight\"\nradio_range_m = {radio_range_m}\nradius_m = 0.3\n\
         [[robot]]\nid = \"east\"\nstart_m = [-5, 0]\ngoal_m = [5, 0]\n\
         [[robot]]\nid = \"north\"\nstart_m = [0, {}]\ngoal_m = [0, 5]\n",
        -5.0 - late_m
    );
    let outcome = Recording::of(&scenario(&text)).report().outcome;
    (outcome.crossings, outcome.right_of_way_violations)
}

#[test]
fn who_drives_on_from_the_left_takes_the_right_of_way() {
    assert_eq!(cross(-0.3, 20.0), (1, 0), "the one from the right goes first");
    assert_eq!(cross(0.3, 20.0), (1, 1), "it goes second");
    assert_eq!(cross(3.0, 20.0), (0, 0), "they do not meet");
    assert_eq!(cross(0.6, 0.3), (0, 0), "they do not hear each other before they have passed");
}

/// Of planners that turn to the right, those from the right go first; of one that does not, not always.
#[test]
fn planners_differ_in_it() {
    let crossings = |planner: &str| {
        let overrides = Overrides { planner: Some(planner.to_owned()), ..Overrides::default() };
        let outcome = Recording::of(&build::catalog("demo-15", &overrides)).report().outcome;
        assert!(outcome.crossings > 5, "{planner}: {} crossings", outcome.crossings);
        outcome.right_of_way_violations
    };
    assert_eq!((crossings("lanes"), crossings("orca")), (0, 0));
    assert!(crossings("decentralized-apf") > 0);
}
