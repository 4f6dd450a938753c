//! Bodies that touch nothing.

use crate::scene::*;
use model::{BodyKind, Drive, Dynamics, Limits};
use nalgebra::Point2;
use proptest::prelude::*;
use shoal_dynamics::{Bodies, Chassis};

#[test]
fn a_body_comes_up_to_speed_as_fast_as_the_ground_holds() {
    let mut world = world();
    world.enter(0, point(3.0), Point2::origin(), 0.5);
    run(&mut world, &[velocity(2.0, 0.0)], 5);
    let held = 0.8 * 9.80665;
    assert!((state(&world, 0).velocity.x - held * 0.1).abs() < 1e-9, "{:?}", state(&world, 0));
    run(&mut world, &[velocity(2.0, 0.0)], 50);
    assert!((state(&world, 0).velocity.x - 2.0).abs() < 1e-9);
    assert_eq!(state(&world, 0).yaw_rad, 0.5, "a point keeps its heading");
    // Nothing asked is a brake.
    run(&mut world, &[None], 5);
    assert!((state(&world, 0).velocity.x - (2.0 - held * 0.1)).abs() < 1e-9);
    run(&mut world, &[], 50);
    assert!(state(&world, 0).velocity.norm() < 1e-9);
}

/// Each wheel has half of the weight: both together hold no more than the body's ground does.
#[test]
fn wheels_that_follow_at_once_start_as_fast_as_the_ground_holds() {
    let wheels = model::Wheels { accel_radps2_max: f64::INFINITY, ..WHEELS };
    let dynamics = Dynamics { grip: 0.1, ..DYNAMICS };
    let mut world = world();
    world.enter(0, Chassis { dynamics, wheels: Some(wheels), ..wheeled() }, Point2::origin(), 0.0);
    run(&mut world, &[twist(0.22, 0.0)], 5);
    let state = state(&world, 0);
    assert!((state.speed_mps - 0.1 * 9.80665 * 0.1).abs() < 1e-9, "{state:?}");
    assert!(state.wheels_radps.iter().all(|rate| (rate * WHEELS.radius_m - 0.22).abs() < 1e-9), "they slip: {state:?}");
}

#[test]
fn limits_of_acceleration_hold_where_they_are_less_than_the_ground_would() {
    let limits = Limits { accel_mps2_max: 0.5, turn_accel_radps2_max: 1.5, ..LIMITS };
    for kind in [BodyKind::Point, BodyKind::Unicycle] {
        let mut world = world();
        world.enter(0, Chassis { kind, limits, ..point(1.0) }, Point2::origin(), 0.0);
        let drive = if kind == BodyKind::Point { velocity(2.0, 0.0) } else { twist(2.0, 3.0) };
        run(&mut world, &[drive], 50);
        let state = state(&world, 0);
        assert!((state.velocity.norm() - 0.5).abs() < 2e-3, "{state:?}");
        assert!((state.turn_radps - if kind == BodyKind::Point { 0.0 } else { 1.5 }).abs() < 1e-9, "{state:?}");
    }
}

/// Once they are up to speed, all that drive on a circle keep to it as the kinematic ones do.
#[test]
fn a_circle_is_one() {
    for (chassis, speed, turn) in [(unicycle(), 0.5, 1.0), (wheeled(), 0.1, 0.9)] {
        let mut world = world();
        world.enter(0, chassis, Point2::origin(), 0.0);
        run(&mut world, &[twist(speed, turn)], 100);
        let at = |world: &Bodies| {
            let state = state(world, 0);
            let left = nalgebra::Vector2::new(-state.yaw_rad.sin(), state.yaw_rad.cos());
            state.position + left * (speed / turn)
        };
        let centre = at(&world);
        for _ in 0..20 {
            run(&mut world, &[twist(speed, turn)], 50);
            assert!((at(&world) - centre).norm() < 0.01 * speed / turn, "{:?}: {}", chassis.kind, at(&world) - centre);
            assert!((state(&world, 0).speed_mps - speed).abs() < 1e-3 * speed);
        }
    }
}

/// A car that is too fast for its bend slides out of it, on a circle as large as the ground can hold.
#[test]
fn a_bend_needs_grip() {
    let dynamics = Dynamics { grip: 0.1, ..DYNAMICS };
    let mut world = world();
    world.enter(0, Chassis { dynamics, ..unicycle() }, Point2::origin(), 0.0);
    run(&mut world, &[twist(2.0, 0.0)], 300);
    assert!((state(&world, 0).speed_mps - 2.0).abs() < 1e-6);
    run(&mut world, &[twist(2.0, 3.0)], 30);
    let state = state(&world, 0);
    let slip = (state.velocity.norm_squared() - state.speed_mps * state.speed_mps).sqrt();
    assert!(slip > 0.5, "it goes sideways at {slip} m/s: {state:?}");
}

#[test]
fn a_body_that_left_is_gone_and_its_place_is_free() {
    let mut world = world();
    world.enter(0, point(1.0), Point2::origin(), 0.0);
    world.enter(1, point(1.0), Point2::new(0.5, 0.0), 0.0);
    run(&mut world, &[], 1);
    world.leave(0);
    assert!(!world.has(0) && world.state(0).is_none() && world.has(1));
    run(&mut world, &[None, velocity(-1.0, 0.0)], 100);
    assert!(state(&world, 1).position.x < -1.0 && world.touched().is_empty());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Whatever is asked, whatever it pushes against: no wheel passes its greatest rate, or changes faster than it can.
    #[test]
    fn a_wheel_never_exceeds_its_limits(
        asks in prop::collection::vec((any::<bool>(), -30.0..30.0f64, -30.0..30.0f64), 1..60),
        torque in prop_oneof![Just(f64::INFINITY), 0.001..0.5f64], grip in 0.0..1.0f64, far in 0.11..0.4f64,
        accel in prop_oneof![Just(f64::INFINITY), 1.0..100.0f64]
    ) {
        let dynamics = Dynamics { grip, ..DYNAMICS };
        let wheels = model::Wheels { accel_radps2_max: accel, torque_nm_max: torque, ..WHEELS };
        let mut world = world_among(&[wall_at(far)]);
        world.enter(0, Chassis { dynamics, wheels: Some(wheels), ..wheeled() }, Point2::origin(), 0.0);
        // Beside it one that is heavier and as fast as it likes.
        world.enter(1, point(20.0), Point2::new(-0.6, 0.02), 0.0);
        let mut before = [0.0; 2];
        for (by_wheels, first, second) in asks {
            let drive = if by_wheels {
                Drive::Wheels { rate_radps: [first, second] }
            } else {
                Drive::Twist { speed_mps: first, turn_radps: second }
            };
            run(&mut world, &[Some(drive), velocity(1.5, 0.0)], 1);
            let rates = state(&world, 0).wheels_radps;
            for side in [0, 1] {
                prop_assert!(rates[side].abs() <= WHEELS.speed_radps_max + 1e-12, "{rates:?}");
                prop_assert!((rates[side] - before[side]).abs() <= accel * DT_S + 1e-9, "{before:?} {rates:?}");
            }
            before = rates;
        }
    }
}
