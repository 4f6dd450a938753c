//! Unicycles that turn slowly, reverse, or steer like cars, driven by every method.

use crate::inputs::{LIMITS, Scene, every_method};
use geometry::wrap;
use model::{BodyKind, Drive, Limits};
use nalgebra::{Point2, Vector2};
use proptest::prelude::*;
use shoal_planners::{Chassis, Planner};

const DT_S: f64 = 0.02;

/// A unicycle at the origin that looks along +x.
fn unicycle(goal: [f64; 2], limits: Limits) -> Scene {
    Scene { kind: BodyKind::Unicycle, limits, ..Scene::new([0.0, 0.0], goal) }
}

/// What the body does: where it is at every tick until it is at its goal (with its heading, if it is to have one), or the
/// time is up. Every command is held to the limits.
fn drive(
    planner: &mut dyn Planner,
    mut scene: Scene,
    goal_yaw_rad: Option<f64>,
    time_s: f64,
) -> Option<Vec<Point2<f64>>> {
    let (mut chassis, mut way) = (Chassis::default(), vec![scene.position]);
    for tick in 0..(time_s / DT_S) as u64 {
        let mut input = scene.input(tick, DT_S);
        input.goal_yaw_rad = goal_yaw_rad;
        let plan = chassis.plan(planner, &input);
        let Drive::Twist { speed_mps, turn_radps } = plan.drive.within(&scene.limits) else { panic!("{plan:?}") };
        assert!(turn_radps.abs() <= scene.limits.turn_at(speed_mps), "{plan:?}");
        scene.position += Vector2::new(scene.yaw_rad.cos(), scene.yaw_rad.sin()) * speed_mps * DT_S;
        scene.yaw_rad = wrap(scene.yaw_rad + turn_radps * DT_S);
        scene.velocity = Vector2::new(scene.yaw_rad.cos(), scene.yaw_rad.sin()) * speed_mps;
        way.push(scene.position);
        let turned = goal_yaw_rad.is_none_or(|yaw_rad| wrap(scene.yaw_rad - yaw_rad).abs() <= 0.1);
        if (scene.position - scene.goal).norm() <= 0.1 && turned {
            return Some(way);
        }
    }
    None
}

/// Every method gets there in this time.
fn check(scene: &Scene, goal_yaw_rad: Option<f64>, time_s: f64) {
    check_without(&[], scene, goal_yaw_rad, time_s);
}

/// Every method but these.
fn check_without(except: &[&str], scene: &Scene, goal_yaw_rad: Option<f64>, time_s: f64) {
    for (method, mut planner) in every_method().filter(|(method, _)| !except.contains(&method.name)) {
        let way = drive(&mut *planner, scene.clone(), goal_yaw_rad, time_s);
        assert!(way.is_some(), "{} does not get to {:?} with {:?}", method.name, scene.goal, scene.limits);
    }
}

#[test]
fn bodies_that_turn_slowly_get_to_goals_beside_and_behind_them() {
    for goal in [[0.0, 2.0], [-3.0, 0.0], [0.5, -0.5], [-0.2, -0.2]] {
        check(&unicycle(goal, Limits { turn_radps_max: 0.1, ..LIMITS }), None, 100.0);
    }
}

#[test]
fn bodies_that_may_reverse_do_so_where_it_is_sooner() {
    let limits = Limits { reverse_mps_max: 1.0, turn_radps_max: 1.0, ..LIMITS };
    let scene = unicycle([-2.0, 0.0], limits);
    check(&scene, None, 6.0);
    for (method, mut planner) in every_method() {
        let way = drive(&mut *planner, scene.clone(), None, 6.0).expect("it gets there");
        let aside = way.iter().map(|p| p.y.abs()).fold(0.0, f64::max);
        let ahead = way.iter().map(|p| p.x).fold(0.0, f64::max);
        assert!(aside < 0.2 && ahead < 0.1, "{} turned round: {aside} m aside, {ahead} m ahead", method.name);
    }
    // Ten times slower backwards, turning round is sooner.
    let slow = unicycle([-4.0, 0.0], Limits { reverse_mps_max: 0.1, turn_radps_max: 1.0, ..LIMITS });
    check(&slow, None, 12.0);
}

#[test]
fn car_like_bodies_get_round_in_the_open() {
    for reverse_mps_max in [0.0, 0.5] {
        let limits = Limits { turning_radius_m_min: 1.0, reverse_mps_max, ..LIMITS };
        for goal in [[0.0, 3.0], [-4.0, 0.1], [4.0, -4.0]] {
            check(&unicycle(goal, limits), None, 30.0);
        }
        // Goals inside the turning circle: legs that are shorter than a turn, and random ones, lead round them.
        for goal in [[0.0, 0.8], [-0.5, -0.5]] {
            check_without(&["liquid-online", "rpoa"], &unicycle(goal, limits), None, 60.0);
        }
    }
}

#[test]
fn a_robot_turns_to_its_heading_at_its_goal() {
    for yaw_rad in [1.57, -2.5] {
        check(&unicycle([2.0, 1.0], LIMITS), Some(yaw_rad), 20.0);
        check(
            &unicycle([-2.0, 0.0], Limits { reverse_mps_max: 1.0, turn_radps_max: 0.5, ..LIMITS }),
            Some(yaw_rad),
            20.0,
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..crate::properties::config() })]

    /// Finite and within what the body can do, the turning radius included, whatever is around.
    #[test]
    fn commands_fit_the_body(
        scene in crate::properties::scene(4.0, 4), radius_m in prop_oneof![Just(0.0), 0.1..5.0f64],
        goal_yaw_rad in proptest::option::of(-4.0..4.0f64)
    ) {
        let mut scene = Scene { kind: BodyKind::Unicycle, ..scene };
        scene.limits.turning_radius_m_min = radius_m;
        for (method, mut planner) in every_method() {
            let mut chassis = Chassis::default();
            for tick in 0..5 {
                let mut input = scene.input(tick, DT_S);
                input.goal_yaw_rad = goal_yaw_rad;
                let plan = chassis.plan(&mut *planner, &input);
                crate::properties::check_sane(method.name, &scene, &plan)?;
                let Drive::Twist { speed_mps, turn_radps } = plan.drive.within(&scene.limits) else { unreachable!() };
                prop_assert!(turn_radps.abs() * radius_m <= speed_mps.abs() * (1.0 + 1e-12), "{}: {plan:?}", method.name);
            }
        }
    }
}
