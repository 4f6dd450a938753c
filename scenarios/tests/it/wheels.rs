//! Diff-drives in scenarios: what follows from their wheels, and what is told of those that cannot be.

use crate::support::mistakes;
use insta::assert_snapshot;
use model::{BodyKind, Dynamics, Limits, Scenario, Wheels};
use shoal_scenarios::*;

/// A diff-drive beside a unicycle: a valid file for mistakes to be made in.
const GOOD: &str = r#"
[defaults]
accel_mps2_max = 2

[kinds.diff-drive]
wheel_radius_m = 0.033
track_m = 0.287
wheel_radps_max = 8

[[robot]]
id = "d"
kind = "diff-drive"
start_m = [0, 0]
goal_m = [5, 0, 1.57]
speed_mps_max = 0.26

[[robot]]
id = "u"
kind = "unicycle"
start_m = [0, 2]
goal_m = [5, 2]
"#;

fn scenario(text: &str) -> Scenario {
    parse("wheels.toml", text, &Overrides::default()).unwrap_or_else(|problems| panic!("{problems}"))
}

#[test]
fn limits_follow_from_the_wheels() {
    let robot = &scenario(GOOD).robots[0];
    let wheels = Wheels { track_m: 0.287, speed_radps_max: 8.0, ..Wheels::BURGER };
    assert_eq!((robot.kind, robot.wheels), (BodyKind::DiffDrive, Some(wheels)));
    // The speed is lowered, the acceleration is that of the wheels, and it does not reverse unless it is told that it may.
    assert_eq!(robot.limits, Limits { speed_mps_max: 0.26, reverse_mps_max: 0.0, ..wheels.limits() });
    assert_eq!(robot.limits.turn_radps_max, 2.0 * 0.033 * 8.0 / 0.287);
    assert_eq!(robot.goal_yaw_rad, Some(1.57));
    assert_eq!(robot.dynamics, Dynamics::DEFAULT);
    assert_eq!(scenario(GOOD).robots[1].wheels, None);

    let text = GOOD.replace("accel_mps2_max", "wheel_accel_radps2_max").replace("speed_mps_max = 0.26", "mass_kg = 3");
    let robot = &scenario(&text).robots[0];
    let wheels = Wheels { accel_radps2_max: 2.0, ..wheels };
    assert_eq!(robot.limits, Limits { reverse_mps_max: 0.0, ..wheels.limits() });
    assert_eq!(robot.limits.turn_accel_radps2_max, 2.0 * 0.033 * 2.0 / 0.287);
    assert_eq!(robot.dynamics.mass_kg, 3.0);
}

#[test]
fn a_layout_of_diff_drives() {
    let draft = |speed: f64| {
        Draft::new()
            .with("defaults.kind", "diff-drive")
            .with("defaults.speed_mps_max", speed)
            .with("layout.kind", "ring")
            .with("layout.robots", 12u64)
            .with("layout.radius_m", 4.0)
            .scenario("ring")
    };
    let ring = draft(0.22).unwrap();
    assert!(ring.robots.iter().all(|robot| robot.wheels == Some(Wheels::BURGER)));
    // A mistake of the defaults is told once, not by each robot.
    assert_snapshot!(draft(1.0).unwrap_err(), @"
    error: scenario `ring`: defaults.speed_mps_max: 1 m/s is more than the wheels of a diff-drive give it, 0.220 m/s
    hint: lower it, or change wheel_radps_max (6.67 rad/s) or wheel_radius_m (0.033 m)
    ");
}

#[test]
fn keys() {
    let told = |text: &str| match parse("wheels.toml", text, &Overrides::default()) {
        Ok(_) => "ok".to_string(),
        Err(problems) => problems.to_string(),
    };
    let defaults = "[defaults]\n";
    let rows = [
        ("speed_mps_max = 0.26", "speed_mps_max = 0.27"),
        ("speed_mps_max = 0.26", "turn_radps_max = 2"),
        ("speed_mps_max = 0.26", "reverse_mps_max = 0.3"),
        ("speed_mps_max = 0.26", "wheel_radps_max = 4\nspeed_mps_max = 0.2"),
        ("speed_mps_max = 0.26", "accel_mps2_max = 1"),
        ("speed_mps_max = 0.26", "turn_accel_radps2_max = 4"),
        ("speed_mps_max = 0.26", "turning_radius_m_min = 0.5"),
        ("speed_mps_max = 0.26", "wheel_radius_m = 0\nspeed_mps_max = 9"),
        ("speed_mps_max = 0.26", "links_m = [1, 1]"),
        ("track_m = 0.287", "accel_mps2_max = 1"),
        (defaults, "[defaults]\nkind = \"diff-drive\"\n"),
        (defaults, "[defaults]\nturn_radps_max = 3\n"),
        ("kind = \"unicycle\"", "kind = \"unicycle\"\ntrack_m = 0.3"),
        ("kind = \"unicycle\"", "kind = \"unicycle\"\nmass_kg = 0"),
    ];
    assert_snapshot!(mistakes(GOOD, &rows, told));
}

/// Each kind of robot that is added is what the defaults say of its kind.
#[test]
fn added_robots_have_the_wheels_of_their_kind() {
    let scenario = scenario(GOOD);
    let wish = |kind| NewRobot {
        returns: false,
        id: None,
        kind,
        radius_m: None,
        start: [0.0, -3.0].into(),
        start_yaw_rad: None,
        goals: vec![[5.0, -3.0].into()],
        goal_yaw_rad: None,
        planner: None,
        params: Default::default(),
    };
    let added = |kind| add_robot(&scenario, &wish(kind)).unwrap_or_else(|problems| panic!("{problems}"));
    let robot = added(Some(BodyKind::DiffDrive));
    let wheels = Wheels { track_m: 0.287, speed_radps_max: 8.0, ..Wheels::BURGER };
    assert_eq!((robot.kind, robot.wheels), (BodyKind::DiffDrive, Some(wheels)));
    assert_eq!(robot.limits, Limits { reverse_mps_max: 0.0, ..wheels.limits() });
    for kind in [None, Some(BodyKind::Point), Some(BodyKind::Unicycle)] {
        let robot = added(kind);
        assert_eq!((robot.kind, robot.wheels), (kind.unwrap_or(BodyKind::Point), None));
        assert_eq!((robot.limits.speed_mps_max, robot.limits.accel_mps2_max), (1.0, 2.0));
    }

    let fast = parse(
        "fast.toml",
        &GOOD.replace("[defaults]", "[defaults]\nturn_radps_max = 1.8\nspeed_mps_max = 1"),
        &Overrides::default(),
    );
    let problem = add_robot(&fast.unwrap(), &wish(Some(BodyKind::DiffDrive))).unwrap_err();
    assert_snapshot!(problem, @"
    error: robot `r00`: kind: the defaults of the scenario do not fit a diff-drive
    hint: give the scenario a [kinds.diff-drive] with what its robots can do
    ");
}
