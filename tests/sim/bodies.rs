//! Every method gets out of a body what the body can: its speed, its slow turns, its reverse gear.

use planners::{Kind, METHODS, Method};
use scenarios::{Overrides, Scenario, parse};
use shoal_tests::Recording;

/// Two robots swap past a pillar, far from the origin.
const SWAP: &str = r#"
[world]
x_m = [388080, 388110]
y_m = [948980, 949010]
[[robot]]
id = "a"
start_m = [388086, 948996]
goal_m = [388106, 948996.3]
[[robot]]
id = "b"
start_m = [388106, 948995]
goal_m = [388086, 948995.2]
[[obstacle]]
shape = "disc"
center_m = [388096.1, 948995.6]
radius_m = 0.4
"#;

/// A unicycle that turns slowly has its goal beside it, another one behind it.
const TIGHT: &str = r#"
[clock]
duration_s = 60
[defaults]
kind = "unicycle"
turn_radps_max = 0.1
[[robot]]
id = "beside"
start_m = [0, 0]
start_yaw_rad = 0
goal_m = [0, 2]
[[robot]]
id = "behind"
start_m = [-5, -5]
start_yaw_rad = 0
goal_m = [-8, -5]
"#;

/// A unicycle that may reverse has its goal straight behind it.
const BEHIND: &str = r#"
[defaults]
kind = "unicycle"
reverse_mps_max = 1
turn_radps_max = 1
[[robot]]
id = "a"
start_m = [0, 0]
start_yaw_rad = 0
goal_m = [-2, 0]
"#;

fn with(text: &str, method: &Method, set: &[String]) -> Scenario {
    let overrides = Overrides { planner: Some(method.name.to_owned()), set: set.to_vec(), ..Overrides::default() };
    parse("bodies", text, &overrides).unwrap_or_else(|problems| panic!("{problems}"))
}

/// When the last robot arrived, s, and the hash of the run.
fn makespan(scenario: &Scenario) -> (f64, u64) {
    let outcome = Recording::of(scenario).outcome;
    let name = &scenario.robots[0].planner;
    let times = outcome.robots.iter().map(|robot| robot.time_s.unwrap_or_else(|| panic!("{name}: not all arrived")));
    (times.fold(0.0, f64::max), outcome.trajectory_hash)
}

fn drive(kind: Kind) -> impl Iterator<Item = &'static Method> {
    METHODS.iter().copied().filter(move |method| method.kinds.contains(&kind))
}

#[test]
fn a_faster_body_is_there_sooner_with_every_method_that_does_not_warn() {
    for method in drive(Kind::Point) {
        let mut before: Vec<(f64, u64)> = Vec::new();
        for speed in ["1", "1.5", "2", "5"] {
            let scenario = with(SWAP, method, &[format!("defaults.speed_mps_max={speed}")]);
            assert!(scenario.warnings.is_empty(), "{}: {:?}", method.name, scenario.warnings);
            let (time_s, hash) = makespan(&scenario);
            for (longer_s, other) in &before {
                assert!(time_s < *longer_s && hash != *other, "{} at {speed} m/s: {time_s} s", method.name);
            }
            before.push((time_s, hash));
        }
    }
}

#[test]
fn a_parameter_that_holds_a_method_back_is_warned_of() {
    for (method, param, most) in [
        ("decentralized-apf", "attract_cap=1", "1.000"),
        ("decentralized-apf", "xi=0.5", "0.500"),
        ("apf", "attract_cap_m=2", "2.000"),
        ("liquid-online", "step_m=0.02", "1.000"),
        ("rpoa", "step_radius=0.02", "1.000"),
    ] {
        let set = ["defaults.speed_mps_max=3".to_owned(), format!("planners.{method}.{param}")];
        let scenario = with(SWAP, planners::find(method).expect("it exists"), &set);
        let said: Vec<String> = scenario.warnings.iter().map(ToString::to_string).collect();
        let expected = format!("`{method}` with these parameters drives at most {most} m/s of the 3 m/s that it may");
        assert!(said.len() == 1 && said[0].contains(&expected), "{said:?}");
    }
}

#[test]
fn unicycles_that_turn_slowly_arrive_with_every_method() {
    for method in drive(Kind::Unicycle) {
        makespan(&with(TIGHT, method, &[]));
        // Lazy bodies take longer, and arrive.
        let set = ["defaults.accel_mps2_max=0.5".to_owned(), "defaults.turn_accel_radps2_max=0.1".to_owned()];
        makespan(&with(TIGHT, method, &set));
    }
}

#[test]
fn a_goal_behind_is_reached_backwards_with_every_method() {
    for method in drive(Kind::Unicycle) {
        let recording = Recording::of(&with(BEHIND, method, &[]));
        let robot = &recording.outcome.robots[0];
        assert!(robot.arrived && robot.path_length_m < 2.1, "{}: {robot:?}", method.name);
        assert!(robot.time_s.is_some_and(|time_s| time_s < 4.0), "{}: {robot:?}", method.name);
    }
}
