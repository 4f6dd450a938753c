//! The registry, the null method and Khatib's field, by example; how a velocity becomes a twist.

use crate::inputs::{IDENTITY, LIMITS, Scene, build, disc, robot};
use geometry::wrap;
use model::{BodyKind, Drive};
use nalgebra::Vector2;
use shoal_planners::steering::steer;
use shoal_planners::{METHODS, find};
use std::f64::consts::PI;

#[test]
fn methods_are_found_by_their_names() {
    for (i, method) in METHODS.iter().enumerate() {
        assert!(std::ptr::eq(find(method.name).expect("found"), *method));
        assert!(METHODS[..i].iter().all(|other| other.name != method.name));
        assert!(!method.summary.is_empty());
    }
    assert!(find("apff").is_none());
}

#[test]
fn straight_goes_straight_and_stops_on_the_goal() {
    let mut planner = build("straight", "", IDENTITY);
    let mut drive = |scene: &Scene| planner.plan(&scene.input(0, 0.5)).drive;
    let mut scene = Scene::new([0.0, 0.0], [3.0, 4.0]);
    scene.obstacles = vec![disc(0, [0.5, 0.5], 0.3)];
    scene.neighbors = vec![robot(1, [0.1, 0.0])];
    assert_eq!(drive(&scene), Drive::Velocity(Vector2::new(0.6, 0.8)));
    scene.goal = [0.2, 0.0].into();
    assert_eq!(drive(&scene), Drive::Velocity(Vector2::new(0.4, 0.0)));
    scene.goal = [0.05, 0.0].into();
    assert_eq!(drive(&scene), Drive::Velocity(Vector2::zeros()));
    scene.goal = [3.0, 4.0].into();
    scene.arrived = true;
    assert_eq!(drive(&scene), Drive::Velocity(Vector2::zeros()));
    scene.kind = BodyKind::Unicycle;
    assert_eq!(drive(&scene), Drive::stop(BodyKind::Unicycle));
    scene.arrived = false;
    scene.goal = [3.0, 0.0].into();
    assert_eq!(drive(&scene), Drive::Twist { speed_mps: 1.0, turn_radps: 0.0 });
}

#[test]
fn khatib_pulls_and_pushes() {
    let params = "k_att = 1.0\nattract_cap_m = 1.0\nk_rep = 0.1\ninfluence_m = 1.0";
    let mut planner = build("apf", params, IDENTITY);
    // The worked example of the decentralised field: with these values and fresh poses the two laws agree.
    let mut scene = Scene::new([0.0, 0.0], [3.0, 4.0]);
    scene.obstacles = vec![disc(0, [0.9, 0.0], 0.3)];
    scene.neighbors = vec![robot(1, [0.0, -0.8])];
    let plan = planner.plan(&scene.input(0, 0.05));
    assert!((plan.attractive - Vector2::new(0.6, 0.8)).norm() < 1e-12);
    assert!((plan.repulsive - Vector2::new(-0.9375, 0.9375)).norm() < 1e-12);
    let Drive::Velocity(velocity) = plan.drive else { panic!("a point robot gets a velocity") };
    assert!((velocity - Vector2::new(-0.190681, 0.981652)).norm() < 1e-6);
}

#[test]
fn steering() {
    for (velocity, yaw_rad, speed, turn) in [
        ([1.0, 0.0], 0.0, 1.0, 0.0),
        ([0.0, 0.5], 0.0, 0.0, 3.0),
        ([0.5, 0.0], -0.1, 0.5 * 0.1f64.cos(), 0.3),
        ([-1.0, 0.0], PI - 0.1, 0.1f64.cos(), 0.3),
        ([-1.0, 0.0], -PI + 0.1, 0.1f64.cos(), -0.3),
        ([0.0, 0.0], 2.0, 0.0, 0.0),
    ] {
        let Drive::Twist { speed_mps, turn_radps } = steer(velocity.into(), yaw_rad, 3.0, &LIMITS) else {
            panic!("steering gives a twist")
        };
        assert!((speed_mps - speed).abs() < 1e-12 && (turn_radps - turn).abs() < 1e-9, "{velocity:?} {yaw_rad}");
    }
    assert_eq!(wrap(-PI), PI);
    assert_eq!(wrap(PI), PI);
    assert!((wrap(7.0) - (7.0 - 2.0 * PI)).abs() < 1e-12);
}
