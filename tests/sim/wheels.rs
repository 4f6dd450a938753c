//! Fleets of diff-drives: TurtleBots of the published sizes, and what they share with unicycles.

use model::{BodyKind, Scenario};
use planners::METHODS;
use scenarios::{Overrides, parse};
use shoal_tests::recording::at;
use shoal_tests::{Recording, catalog};

/// Track, m, and greatest speed of a wheel, rad/s: a Burger drives 0.22 m/s, a Waffle 0.26 m/s.
const BURGER: [f64; 2] = [0.16, 6.67];
const WAFFLE: [f64; 2] = [0.287, 7.88];

/// The paper's fifteen robots among pillars, as TurtleBots whose wheels accelerate like this, rad/s². In the authors'
/// simulator it is 1 m/s² at the rim, 30 rad/s².
fn turtlebots(planner: &str, [track_m, wheel_radps_max]: [f64; 2], accel_radps2: f64) -> Scenario {
    let set = [
        "kind=\"diff-drive\"".to_owned(),
        format!("track_m={track_m}"),
        format!("wheel_radps_max={wheel_radps_max}"),
        format!("wheel_accel_radps2_max={accel_radps2}"),
    ];
    let set = set.iter().map(|key| format!("defaults.{key}")).collect();
    let mut scenario =
        catalog("amr-case1", &Overrides { planner: Some(planner.to_owned()), set, ..Overrides::default() });
    if planner == "amr-apf" {
        // Its default, which brakes; what the catalog has of it is the paper's, which does not.
        scenario.robots.iter_mut().for_each(|robot| robot.params.clear());
    }
    scenario
}

fn check(planner: &str, accels_radps2: &[f64]) {
    for (name, wheels) in [("burger", BURGER), ("waffle", WAFFLE)] {
        for accel_radps2 in accels_radps2 {
            let outcome = Recording::of(&turtlebots(planner, wheels, *accel_radps2)).outcome;
            let what = format!("{planner}, {name}, {accel_radps2} rad/s²");
            let contacts = outcome.robot_contacts + outcome.obstacle_contacts;
            let arrived = outcome.robots.iter().filter(|robot| robot.arrived).count();
            assert_eq!((arrived, contacts), (15, 0), "{what}");
        }
    }
}

/// Speed and turn share the wheels, and the brakes hold nevertheless: from wheels that follow at once to such as need more
/// than a second for their speed.
#[test]
fn turtlebots_arrive_without_contact_with_the_default_of_amr_apf() {
    check("amr-apf", &[f64::INFINITY, 30.0, 10.0, 5.0]);
}

#[test]
fn turtlebots_arrive_without_contact_with_dapf() {
    check("dapf", &[f64::INFINITY, 30.0, 10.0]);
}

/// Goals beside and behind robots that stand apart.
fn apart(keys: &str) -> Scenario {
    let text = format!(
        r#"
        [clock]
        duration_s = 120
        [defaults]
        {keys}
        goal_yaw_tolerance_rad = 0.05
        [[robot]]
        id = "beside"
        start_m = [0, 0]
        start_yaw_rad = 0
        goal_m = [0, 2, 1]
        [[robot]]
        id = "behind"
        start_m = [-5, -5]
        start_yaw_rad = 0
        goal_m = [-8, -5, -2]
        "#
    );
    parse("apart.toml", &text, &Overrides::default()).unwrap_or_else(|problems| panic!("{problems}"))
}

#[test]
fn every_method_that_drives_unicycles_drives_diff_drives() {
    for method in METHODS.iter().filter(|method| method.kinds.contains(&BodyKind::Unicycle)) {
        for keys in ["", "wheel_accel_radps2_max = 20", "wheel_accel_radps2_max = 4\nreverse_mps_max = 0.2"] {
            let keys = format!("kind = \"diff-drive\"\nplanner = \"{}\"\n{keys}", method.name);
            let outcome = Recording::of(&apart(&keys)).outcome;
            assert!(outcome.robots.iter().all(|robot| robot.arrived), "{keys}");
        }
    }
}

/// Wheels that can always do what is asked, at once, move a body as a unicycle moves.
#[test]
fn on_strong_wheels_a_fleet_moves_as_unicycles_do() {
    for planner in ["straight", "apf", "decentralized-apf", "dapf"] {
        let common = format!("planner = \"{planner}\"\nspeed_mps_max = 0.5\nturn_radps_max = 2");
        let unicycles = Recording::of(&apart(&format!("kind = \"unicycle\"\n{common}")));
        let on_wheels = Recording::of(&apart(&format!("kind = \"diff-drive\"\nwheel_radps_max = 40\n{common}")));
        assert_eq!(unicycles.frames.len(), on_wheels.frames.len(), "{planner}");
        for (a, b) in unicycles.frames.iter().zip(&on_wheels.frames) {
            for (a, b) in a.robots().zip(b.robots()) {
                assert!((at(a) - at(b)).norm() < 1e-9, "{planner}: {a:?} {b:?}");
            }
        }
    }
}
