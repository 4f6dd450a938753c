//! Worlds of solid bodies in scenarios, and what cannot be in them.

use crate::support::mistakes;
use insta::assert_snapshot;
use model::{ParamValues, Physics};
use nalgebra::Point2;
use shoal_scenarios::*;

const GOOD: &str = r#"
[world]
physics = "rapier"

[[robot]]
id = "a"
start_m = [0, 0]
goal_m = [5, 0]
radius_m = 0.2
"#;

#[test]
fn physics_is_kinematic_unless_it_is_said() {
    let physics = |text: &str| parse("p.toml", text, &Overrides::default()).expect("it is valid").physics;
    assert_eq!(physics(GOOD), Physics::Rapier);
    assert_eq!(physics(&GOOD.replace("physics = \"rapier\"", "")), Physics::Kinematic);
}

#[test]
fn what_the_engine_does_not_have_is_refused() {
    let arm = "[[robot]]\nid = \"arm\"\nkind = \"two-link-arm\"\nplanner = \"pso-via-points\"\nbase_m = [5, 5]\n\
               links_m = [1, 1]\nstart_m = [6.5, 5]\ngoal_m = [5, 6.5]\n";
    let arm = format!("radius_m = 0.2\n{arm}");
    let rows = [("radius_m = 0.2", "radius_m = 0.005"), ("radius_m = 0.2\n", &arm), ("\"rapier\"", "\"bullet\"")];
    let told = |text: &str| parse("p.toml", text, &Overrides::default()).expect_err("it is wrong").to_string();
    assert_snapshot!(mistakes(GOOD, &rows, told));
}

#[test]
fn what_is_added_is_solid_too() {
    let scenario = parse("p.toml", GOOD, &Overrides::default()).expect("it is valid");
    let request = |radius_m| NewRobot {
        radius_m: Some(radius_m),
        start: Point2::new(0.0, 3.0),
        goals: vec![Point2::new(5.0, 3.0)],
        id: None,
        returns: false,
        kind: None,
        start_yaw_rad: None,
        goal_yaw_rad: None,
        planner: None,
        params: ParamValues::new(),
    };
    assert!(add_robot(&scenario, &request(0.2)).is_ok());
    assert!(add_robot(&scenario, &request(0.005)).is_err());
}
