//! Unicycles that turn slowly, reverse, or steer like cars, driven by every method, and what wheels make of a plan.

use crate::inputs::{LIMITS, Scene, every_method};
use geometry::wrap;
use model::{BodyKind, Drive, Limits, Wheels};
use nalgebra::{Point2, Vector2};
use proptest::prelude::*;
use shoal_planners::{Chassis, Plan, PlanInput, Planner};

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

/// Answers the same in every tick.
struct Always(Drive);

impl Planner for Always {
    fn plan(&mut self, _: &PlanInput<'_>) -> Plan {
        Plan::only(self.0)
    }
}

/// A diff-drive at the origin that looks along +x, on its way with these rates of its wheels.
fn on_wheels(wheels: &Wheels, rate_radps: [f64; 2], limits: Limits) -> Scene {
    let (speed_mps, turn_radps) = wheels.twist_of(rate_radps);
    let velocity = Vector2::new(speed_mps, 0.0);
    let scene = Scene::new([0.0, 0.0], [5.0, 0.0]);
    Scene { kind: BodyKind::DiffDrive, velocity, turn_radps, limits, wheels: Some(*wheels), ..scene }
}

/// Each wheel can change by 1 rad/s in a tick. To stand, both have to brake; to turn as well, one of them would have to
/// speed up, and the body would not get slower at all.
#[test]
fn wheels_brake_before_they_turn() {
    let wheels = Wheels { accel_radps2_max: 1.0 / DT_S, ..Wheels::BURGER };
    let mut scene = on_wheels(&wheels, [5.0, 5.0], wheels.limits());
    let (_, turn_radps) = wheels.twist_of([-6.0, 6.0]);
    let mut planner = Always(Drive::Twist { speed_mps: 0.0, turn_radps });
    let mut rates = |scene: &Scene| {
        let plan = Chassis::default().plan(&mut planner, &scene.input(0, DT_S));
        wheels.rates_for(plan.drive, &scene.limits).unwrap()
    };
    let near = |found: [f64; 2], expected: [f64; 2]| {
        assert!(found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-9), "{found:?}");
    };
    near(rates(&scene), [4.0, 4.0]);
    // What the brakes do not need goes to the turn.
    scene = on_wheels(&wheels, [0.25, 0.25], wheels.limits());
    near(rates(&scene), [-0.75, 0.75]);
    // Nothing to brake: all that is asked for.
    scene = on_wheels(&wheels, [0.0, 0.0], wheels.limits());
    near(rates(&scene), [-6.0, 6.0]);
}

/// The speed of a body that turns where it stands is measured as next to nothing, backwards or forwards: it may start.
#[test]
fn wheels_that_stand_start_whatever_is_left_of_their_speed() {
    let wheels = Wheels { accel_radps2_max: 1.0 / DT_S, ..Wheels::BURGER };
    let ahead = Drive::Twist { speed_mps: 0.1, turn_radps: 0.5 };
    for left_over in [-1e-15, -1e-6, 0.0, 1e-6] {
        let scene = on_wheels(&wheels, [left_over - 1.0, left_over + 1.0], wheels.limits());
        let plan = Chassis::default().plan(&mut Always(ahead), &scene.input(0, DT_S));
        assert_eq!(plan.drive, ahead, "{left_over} rad/s");
    }
}

/// A body that drives backwards has its left wheel on the other side.
#[test]
fn wheels_that_a_method_commands_turn_round_with_the_gear() {
    let wheels = Wheels::BURGER;
    let mut scene = on_wheels(&wheels, [0.0; 2], wheels.limits());
    let mut planner = Always(Drive::Wheels { rate_radps: [1.0, 2.0] });
    let mut drive = |scene: &Scene| Chassis::default().plan(&mut planner, &scene.input(0, DT_S)).drive;
    assert_eq!(drive(&scene), Drive::Wheels { rate_radps: [1.0, 2.0] });
    scene.goal = [-0.5, 0.0].into();
    assert_eq!(drive(&scene), Drive::Wheels { rate_radps: [-2.0, -1.0] });
}

proptest! {
    #![proptest_config(crate::properties::config())]

    /// Methods count on the acceleration in the limits: a body that is to become slower does so with all of it, whatever
    /// its wheels are doing and however it is to turn. What comes to rest within a thousandth of a tick stands already.
    #[test]
    fn the_brakes_of_wheels_hold_whatever_the_turn(
        from in (-1.0..1.0f64, -1.0..1.0f64), asked in (-2.0..2.0f64, -2.0..2.0f64), accel in 0.5..400.0f64
    ) {
        let wheels = Wheels { accel_radps2_max: accel, ..Wheels::BURGER };
        let limits = wheels.limits();
        let rate_radps = [from.0, from.1].map(|share| share * wheels.speed_radps_max);
        let scene = on_wheels(&wheels, rate_radps, limits);
        let (before_mps, _) = wheels.twist_of(rate_radps);
        let drive = Drive::Twist { speed_mps: asked.0 * limits.speed_mps_max, turn_radps: asked.1 * limits.turn_radps_max };
        let wanted = wheels.rates_for(drive, &limits).unwrap();
        let (wanted_mps, _) = wheels.twist_of(wanted);

        let plan = Chassis::default().plan(&mut Always(drive), &scene.input(0, DT_S));
        let after = wheels.towards(rate_radps, wheels.rates_for(plan.drive, &limits).unwrap(), DT_S);
        let (after_mps, _) = wheels.twist_of(after);
        let slower_mps = if before_mps * wanted_mps < 0.0 { 0.0 } else { wanted_mps };
        let change_max = limits.accel_mps2_max * DT_S;
        if slower_mps.abs() < before_mps.abs() && before_mps.abs() > 1e-3 * change_max {
            let expected = before_mps + (slower_mps - before_mps).clamp(-change_max, change_max);
            prop_assert!((after_mps - expected).abs() < 1e-9, "from {before_mps} to {after_mps} instead of {expected}");
        } else {
            prop_assert_eq!(wheels.rates_for(plan.drive, &limits), Some(wanted));
        }
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
