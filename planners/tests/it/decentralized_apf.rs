//! What the specification of the decentralised potential field says about the law in words. Its numbers are rows of
//! `reproduce`.

use crate::inputs::{IDENTITY, Scene, build, disc, robot};
use geometry::Capsule;
use model::{BodyKind, Drive};
use nalgebra::{Point2, Vector2};
use proptest::prelude::*;
use shoal_planners::{Identity, Neighbor, Obstacle, Plan};

const LITERAL: &str = "eta = 1.0\nbracket_power = 2\ndistance = \"centre\"\nattract_cap = 0.0\n";

fn plan(params: &str, scene: &Scene) -> Plan {
    build("decentralized-apf", params, IDENTITY).plan(&scene.input(0, 0.05))
}

fn velocity(plan: &Plan) -> Vector2<f64> {
    match plan.drive {
        Drive::Velocity(velocity) => velocity,
        other => panic!("a point robot is asked for a velocity, not {other:?}"),
    }
}

/// Equal to six digits after the point, as printed.
fn assert_printed(found: Vector2<f64>, printed: [f64; 2]) {
    let error = (found - Vector2::from(printed)).amax();
    assert!(error <= 0.5e-6 + 1e-12, "{found:?} is not {printed:?}");
}

#[test]
fn a_unicycle_turns_towards_the_resultant() {
    let mut scene = Scene::new([0.0, 0.0], [5.0, 0.0]);
    scene.kind = BodyKind::Unicycle;
    // Facing away from the resultant by this angle: turn rate 3 a within 3 rad/s, speed max(0, cos a).
    for (yaw_rad, turn, speed) in [(0.0, 0.0, 1.0), (0.5, -1.5, 0.5f64.cos()), (-2.0, 3.0, 0.0), (2.0, -3.0, 0.0)] {
        scene.yaw_rad = yaw_rad;
        let Drive::Twist { speed_mps, turn_radps } = plan("", &scene).drive else { panic!("a unicycle gets a twist") };
        assert!((speed_mps - speed).abs() < 1e-12 && (turn_radps - turn).abs() < 1e-12, "{speed_mps} {turn_radps}");
    }
}

#[test]
fn outside_all_thresholds_the_way_is_straight() {
    let mut scene = Scene::new([0.0, 0.0], [6.0, 8.0]);
    scene.obstacles = vec![disc(0, [1.51, 0.0], 0.3)];
    scene.neighbors = vec![robot(1, [0.0, -1.41])];
    assert_printed(velocity(&plan("", &scene)), [0.6, 0.8]);
}

#[test]
fn a_polygon_pushes_once() {
    let corners = [[1.0, -1.0], [3.0, -1.0], [3.0, 1.0], [1.0, 1.0]].map(Point2::from);
    let edge = |i: usize| Capsule::segment(corners[i], corners[(i + 1) % 4]);
    let obstacle = |id: u32, shape: Capsule| Obstacle { id, shape, velocity: Vector2::zeros() };
    let mut scene = Scene::new([0.3, 0.9], [9.0, 0.9]);
    scene.obstacles = vec![obstacle(0, edge(3))];
    let alone = plan("", &scene).repulsive;
    assert!(alone.norm() > 0.1);
    scene.obstacles = (0..4).map(|i| obstacle(0, edge(i))).collect();
    assert_eq!(plan("", &scene).repulsive, alone);
}

#[test]
fn coinciding_centres_are_driven_apart() {
    let mut scene = Scene::new([0.0, 0.0], [0.0, 0.0]);
    scene.neighbors = vec![robot(1, [0.0, 0.0])];
    let lower = plan("", &scene).repulsive;
    scene.neighbors = vec![robot(0, [0.0, 0.0])];
    let mut planner = build("decentralized-apf", "", Identity { robot: 1, ..IDENTITY });
    let higher = planner.plan(&scene.input(0, 0.05)).repulsive;
    assert_eq!(lower.norm(), 1000.0);
    assert_eq!(lower, -higher);
}

#[test]
fn silent_robots_keep_their_course_then_grow_then_go() {
    let push = |params: &str, neighbor: Neighbor| {
        let mut scene = Scene::new([0.0, 0.0], [0.0, 9.0]);
        scene.neighbors = vec![neighbor];
        plan(params, &scene).repulsive
    };
    let fresh = |x: f64| robot(1, [x, 0.0]);
    let silent = |age_s: f64| Neighbor { age_s, velocity: Vector2::new(-1.0, 0.0), ..robot(1, [1.2, 0.0]) };
    assert_eq!(push("", silent(0.0)), push("", fresh(1.2)));
    assert_printed(push("", silent(0.2)), push("", fresh(1.0)).into());
    // An obstacle where it was last heard, with its radius grown by what it could have driven.
    let grown = Neighbor { radius_m: 0.2 + 0.4, ..fresh(1.2) };
    assert_printed(push("", silent(0.4)), push("", grown).into());
    assert_printed(push("stale_s = 0.5", silent(0.4)), push("", fresh(0.8)).into());
    assert_eq!(push("", silent(2.1)), Vector2::zeros());
    assert_ne!(push("drop_s = 3.0", silent(2.1)), Vector2::zeros());
}

proptest! {
    #![proptest_config(crate::properties::config())]

    #[test]
    fn robots_push_each_other_equally(x in -1.5f64..1.5, y in -1.5f64..1.5, literal: bool) {
        let params = if literal { LITERAL } else { "" };
        let push = |own: [f64; 2], other: [f64; 2]| {
            let mut scene = Scene::new(own, [5.0, 5.0]);
            scene.neighbors = vec![robot(1, other)];
            plan(params, &scene).repulsive
        };
        let (one, other) = (push([0.0, 0.0], [x, y]), push([x, y], [0.0, 0.0]));
        prop_assert!((one + other).norm() <= 1e-9 * (1.0 + one.norm()), "{one:?} {other:?}");
    }

    #[test]
    fn a_robot_that_leaves_takes_its_push_along(x in 0.7f64..1.3, y in 0.7f64..1.3) {
        let mut scene = Scene::new([0.0, 0.0], [5.0, 5.0]);
        scene.neighbors = vec![robot(1, [-x, 0.1]), robot(2, [0.1, y])];
        let both = plan("", &scene).repulsive;
        let second = scene.neighbors.pop();
        let first = plan("", &scene).repulsive;
        scene.neighbors = second.into_iter().collect();
        let second = plan("", &scene).repulsive;
        prop_assert!((both - first - second).norm() < 1e-12);
    }
}
