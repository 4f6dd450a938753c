//! Bodies that touch: what they keep, what stops them, what moves them.

use crate::scene::*;
use geometry::Capsule;
use model::{Drive, Dynamics, Wheels};
use nalgebra::{Point2, Vector2};
use proptest::prelude::*;
use shoal_dynamics::{Bodies, Chassis, With};

/// Sinks no deeper than this into what it leans on, m: a two-hundredth of the engine's size, and as much again.
const SINK_M: f64 = 5e-4;

fn momentum(world: &Bodies, masses: &[f64]) -> Vector2<f64> {
    masses.iter().enumerate().map(|(slot, mass)| state(world, slot).velocity * *mass).sum()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Two bodies run into each other on ice, head on or beside the middle.
    #[test]
    fn a_push_conserves_momentum(
        masses in (0.2..20.0f64, 0.2..20.0f64), speeds in (0.2..2.0f64, -2.0..-0.2f64), aside in -0.3..0.3f64
    ) {
        let masses = [masses.0, masses.1];
        let mut world = world();
        // On firm ground first, to come up to speed.
        for (slot, x) in [(0, -3.0), (1, 3.0)] {
            world.enter(slot, point(masses[slot]), Point2::new(x, aside * slot as f64), 0.0);
        }
        run(&mut world, &[velocity(speeds.0, 0.0), velocity(speeds.1, 0.0)], 20);
        let before = momentum(&world, &masses);
        let (states, mut slid) = ([0, 1].map(|slot| state(&world, slot)), Bodies::new(DT_S, std::iter::empty()));
        for (slot, state) in states.iter().enumerate() {
            slid.enter(slot, on_ice(point(masses[slot])), state.position, 0.0);
            slid.throw(slot, state.velocity, 0.0);
        }
        let mut touched = 0;
        for _ in 0..1500 {
            run(&mut slid, &[None, None], 1);
            touched += slid.touched().len();
        }
        prop_assert_eq!(touched, 1);
        let after = momentum(&slid, &masses);
        let most = masses[0] * speeds.0 + masses[1] * -speeds.1;
        prop_assert!((after - before).norm() < 0.01 * most, "{before} {after}");
        // And they do go on together, or apart, not through each other.
        let apart = state(&slid, 1).velocity.x - state(&slid, 0).velocity.x;
        prop_assert!(apart > -1e-3 || aside != 0.0, "{apart}");
    }

    /// A robot against a wall stops at the wall, at any speed and angle, on either kind of drive, and stays there.
    #[test]
    fn a_wall_stops(speed in 0.2..2.0f64, yaw in -1.4..1.4f64, wheels: bool, from in 0.3..1.2f64) {
        let chassis = if wheels { wheeled() } else { unicycle() };
        let mut world = world_among(&[wall_at(from)]);
        world.enter(0, chassis, Point2::origin(), yaw);
        let (mut deepest, mut at_wall) = (f64::INFINITY, 0);
        for _ in 0..600 {
            run(&mut world, &[twist(speed, 0.0)], 1);
            let gap = from - chassis.radius_m - state(&world, 0).position.x;
            deepest = deepest.min(gap);
            at_wall += u32::from(gap < 1e-3);
        }
        prop_assert!(deepest > -SINK_M, "{deepest}");
        let end = state(&world, 0);
        prop_assert!(end.position.x > from - chassis.radius_m - 0.01 || end.position.y.abs() > 1.0, "{end:?}");
        // One that reaches the wall at the very end has not been stopped yet.
        prop_assert!(end.velocity.x.abs() < 1e-3 || at_wall < 50, "{end:?}, at the wall for {at_wall} ticks");
    }
}

#[test]
fn a_body_thrown_at_a_thin_wall_does_not_come_through() {
    for speed in [0.5, 5.0, 30.0] {
        let mut world = world_among(&[wall_at(3.0)]);
        world.enter(0, point(1.0), Point2::origin(), 0.0);
        world.throw(0, Vector2::new(speed, 0.0), 0.0);
        for _ in 0..200 {
            run(&mut world, &[None], 1);
            assert!(state(&world, 0).position.x < 2.8 + 0.05, "{speed}: {:?}", state(&world, 0));
        }
    }
}

/// The one with more weight on the ground wins; the same weight is a draw.
#[test]
fn who_is_heavier_pushes_the_other_away() {
    let pushed_to = |mass: f64, answer| {
        let mut world = world();
        world.enter(0, point(mass), Point2::new(-0.3, 0.0), 0.0);
        world.enter(1, point(1.0), Point2::new(0.3, 0.0), 0.0);
        run(&mut world, &[velocity(1.0, 0.0), answer], 200);
        state(&world, 1).position.x
    };
    let back = velocity(-1.0, 0.0);
    assert!((pushed_to(1.0, back) - 0.2).abs() < SINK_M, "{}", pushed_to(1.0, back));
    assert!(pushed_to(3.0, back) > 0.8 && pushed_to(0.5, back) < -0.8);
    // One that brakes is held by the ground, but for the impact.
    assert!(pushed_to(3.0, None) > 0.8 && pushed_to(0.5, None) < 0.4, "{}", pushed_to(0.5, None));
}

#[test]
fn a_motor_pushes_as_hard_as_it_can_and_stalls() {
    // 0.002 Nm at a wheel of 33 mm is 0.06 N each: less than the 0.8 of the weight that holds a brake of 0.1 kg.
    let weak = Wheels { torque_nm_max: 0.002, ..WHEELS };
    for (grip, moves) in [(0.8, false), (0.05, true)] {
        let mut world = world();
        world.enter(0, Chassis { wheels: Some(weak), ..wheeled() }, Point2::origin(), 0.0);
        let sledge = Chassis { dynamics: Dynamics { mass_kg: 0.1, grip, ..DYNAMICS }, radius_m: 0.1, ..point(0.1) };
        world.enter(1, sledge, Point2::new(0.206, 0.0), 0.0);
        run(&mut world, &[twist(0.2, 0.0), None], 300);
        let (pusher, pushed) = (state(&world, 0), state(&world, 1));
        assert_eq!(pushed.position.x > 0.3, moves, "{grip}: {pushed:?}");
        if !moves {
            assert!(pusher.wheels_radps.iter().all(|rate| rate.abs() < 0.1), "{pusher:?}");
        }
    }
}

#[test]
fn an_obstacle_that_moves_takes_along_what_is_in_its_way() {
    let disc = Capsule::disc(Point2::new(-1.0, 0.0), 0.3);
    let mut world = Bodies::new(DT_S, [(std::slice::from_ref(&disc), Vector2::zeros(), true)].into_iter());
    world.enter(0, point(1.0), Point2::origin(), 0.0);
    let mut touched = Vec::new();
    for tick in 0..200 {
        let at = |tick: i32| Vector2::new(f64::from(tick) * 0.5 * DT_S, 0.0);
        world.tick(&[None], |_| [at(tick), at(tick + 1)]);
        touched.extend(world.touched().iter().copied());
    }
    let end = state(&world, 0);
    // Its surface is at 1.3 now, and the body's centre 0.2 before it, unless it went aside.
    assert!((end.position - Point2::new(-1.0 + 2.0, 0.0)).norm() > 0.5 - SINK_M, "{end:?}");
    assert!(end.position.x > 0.5, "{end:?}");
    assert_eq!(touched.len(), 1, "one touch that lasts: {touched:?}");
    assert_eq!((touched[0].slot, touched[0].with), (0, With::Obstacle(0)));
    assert!((touched[0].at - Point2::new(-0.2, 0.0)).norm() < 0.02, "{touched:?}");
}

#[test]
fn a_touch_is_told_when_it_begins_and_again_when_it_has_ended() {
    let mut world = world();
    world.enter(2, point(1.0), Point2::new(0.7, 0.0), 0.0);
    world.enter(0, point(1.0), Point2::origin(), 0.0);
    let mut touched = Vec::new();
    let go = |world: &mut Bodies, x: f64, ticks: usize, touched: &mut Vec<(usize, With)>| {
        for _ in 0..ticks {
            run(world, &[velocity(x, 0.0)], 1);
            touched.extend(world.touched().iter().map(|touch| (touch.slot, touch.with)));
        }
    };
    go(&mut world, 1.0, 100, &mut touched);
    assert_eq!(touched, [(0, With::Robot(2))], "it leans on the other for two seconds");
    go(&mut world, -0.5, 50, &mut touched);
    go(&mut world, 1.0, 100, &mut touched);
    assert_eq!(touched, [(0, With::Robot(2)); 2]);
    // An overlap from the beginning is reported by the caller that placed the body.
    world.leave(0);
    let there = state(&world, 2).position;
    world.enter(0, point(1.0), there + Vector2::new(-0.39, 0.0), 0.0);
    assert!(world.overlap(0, With::Robot(2)));
    touched.clear();
    go(&mut world, 0.0, 20, &mut touched);
    assert_eq!(touched, []);
    assert!((state(&world, 2).position - state(&world, 0).position).norm() > 0.4 - SINK_M, "they part");
}

/// A crowd that pushes into one corner: the same bits twice, and no two bodies in one place.
#[test]
fn a_crowd_is_the_same_twice_and_solid() {
    let crowd = || {
        let walls = [wall_at(2.0), Capsule::segment(Point2::new(-50.0, 2.0), Point2::new(50.0, 2.0))];
        let mut world = world_among(&walls);
        for slot in 0..25 {
            let at = Point2::new(0.45 * (slot % 5) as f64 - 1.0, 0.45 * (slot / 5) as f64 - 1.0);
            let chassis = match slot % 3 {
                0 => point(1.0 + slot as f64),
                1 => unicycle(),
                _ => Chassis { radius_m: 0.2, ..wheeled() },
            };
            world.enter(slot, chassis, at, 0.3 * slot as f64);
        }
        let drives: Vec<Option<Drive>> = (0..25)
            .map(|slot| if slot % 3 == 0 { velocity(1.0, 1.0) } else { twist(1.0, 0.2 * (slot % 4) as f64 - 0.3) })
            .collect();
        let mut hash = Vec::new();
        for _ in 0..300 {
            run(&mut world, &drives, 1);
            hash.extend((0..25).map(|slot| state(&world, slot)));
        }
        (hash, world)
    };
    let (first, world) = crowd();
    assert_eq!(first, crowd().0);
    for slot in 0..25 {
        let here = state(&world, slot).position;
        assert!(here.x < 1.8 + 1e-3 && here.y < 1.8 + 1e-3, "{slot}: {here}");
        for other in 0..slot {
            let apart = (state(&world, other).position - here).norm();
            assert!(apart > 0.4 - 1e-3, "{slot} and {other}: {apart}");
        }
    }
}
