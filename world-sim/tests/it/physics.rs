//! Contacts and clearances against the plainest way to compute them, and the hash.

use crate::driver::{Driver, HZ, at, robot, scenario};
use geometry::{Capsule, segment_distance, swept_distance};
use model::{
    BodyKind, Bounds, Drive, EventName, Motion, Obstacle, RobotIndex, Scenario, Shape, TimelineAction, Wheels,
};
use nalgebra::{Point2, Vector2};
use proptest::prelude::*;
use shoal_world_sim::World;
use std::collections::BTreeSet;

const fn is_send<T: Send>() {}
const _: () = is_send::<World>();

fn wall(a: [f64; 2], b: [f64; 2], radius: f64) -> Obstacle {
    Obstacle { shape: Shape::Capsule(Capsule { a: a.into(), b: b.into(), radius }), motion: None }
}

#[test]
fn a_pair_that_passes_through_each_other_touches_once() {
    let ends = [[-2.0, 0.0], [2.0, 0.0]];
    let outcome = Driver::new(&scenario(vec![robot(0, ends[0], ends[1]), robot(1, ends[1], ends[0])])).run();
    assert_eq!((outcome.robot_contacts, outcome.min_clearance_m), (1, Some(-0.5)));
    assert_eq!((outcome.robots[0].contacts, outcome.robots[1].contacts), (1, 1));
    assert_eq!(outcome.events.iter().filter(|event| event.kind.name() == EventName::Contact).count(), 1);
    // In and out and in again are two.
    let mut twice = scenario(vec![robot(0, ends[0], ends[1]), robot(1, [0.0, 0.0], [0.0, 0.0])]);
    twice.robots[0].goals.push(ends[0].into());
    assert_eq!(Driver::new(&twice).run().robot_contacts, 2);
}

#[test]
fn nothing_is_missed_between_two_ticks() {
    // Two small fast bodies are apart at every tick, and cross in between.
    let mut scenario = scenario(vec![robot(0, [-1.5, 0.0], [1.5, 0.0]), robot(1, [1.5, 0.01], [-1.5, 0.01])]);
    for robot in &mut scenario.robots {
        (robot.radius_m, robot.limits.speed_mps_max) = (0.02, 10.0);
    }
    scenario.obstacles = vec![wall([-0.2, -1.0], [-0.2, 1.0], 0.0)];
    let outcome = Driver::new(&scenario).run();
    assert_eq!((outcome.robot_contacts, outcome.obstacle_contacts), (1, 2));
    assert!((outcome.min_clearance_m.unwrap() - (0.01 - 0.04)).abs() < 1e-12);
    assert_eq!(outcome.min_obstacle_clearance_m, Some(-0.02));
}

#[test]
fn contacts_say_where_and_when_the_surfaces_met() {
    // Through each other and through a wall, 30 m in a tick.
    let mut scenario = scenario(vec![
        robot(0, [-15.0, 0.0], [15.0, 0.0]),
        robot(1, [15.0, 0.0], [-15.0, 0.0]),
        robot(2, [-15.0, 5.0], [15.0, 5.0]),
        robot(3, [20.0, 5.0], [20.0, 5.0]),
        robot(4, [20.4, 5.0], [20.4, 5.0]),
    ]);
    for robot in &mut scenario.robots {
        robot.limits.speed_mps_max = 300.0;
    }
    scenario.obstacles = vec![wall([1.0, 4.0], [1.0, 6.0], 0.0)];
    let outcome = Driver::new(&scenario).run();
    let touches: Vec<_> =
        outcome.events.iter().filter_map(|event| Some((event.robot?.0, event.kind.touch()?))).collect();
    let expected =
        [(3, 0.0, [20.2, 5.0]), (0, (0.5 - 0.25 / 30.0) / HZ, [0.0, 0.0]), (2, (15.75 / 30.0) / HZ, [1.0, 5.0])];
    assert_eq!(touches.len(), expected.len(), "{touches:?}");
    for ((slot, touch), (who, when, [x, y])) in touches.into_iter().zip(expected) {
        assert_eq!(slot, who);
        assert!((touch.t_s - when).abs() < 1e-6, "{touch:?}");
        assert!((touch.at_m[0] - x).abs() < 1e-6 && (touch.at_m[1] - y).abs() < 1e-6, "{touch:?}");
    }
}

/// Ten thousand kilometres from the origin numbers are 1.9 nm apart: contacts and distances are as exact as that allows.
#[test]
fn far_from_the_origin_nothing_is_lost_but_nanometres() {
    const FAR: [f64; 2] = [1e7, -1e7];
    const NM: f64 = 1e-9;
    let place = |[x, y]: [f64; 2]| [FAR[0] + x, FAR[1] + y];
    // Two lanes that are `apart`: surfaces pass at apart - 0.5 m. And a wall beside the first one's way.
    let pass = |apart: f64| {
        let mut scenario = scenario(vec![
            robot(0, place([-2.0, 0.0]), place([2.0, 0.0])),
            robot(1, place([2.0, apart]), place([-2.0, apart])),
        ]);
        scenario.bounds = Bounds { x_m: [9e6, 11e6], y_m: [-11e6, -9e6] };
        scenario.obstacles = vec![wall(place([1.0, -5.0]), place([1.0, -0.25 - (apart - 0.5)]), 0.0)];
        Driver::new(&scenario).run()
    };
    for clearance_m in [0.3, 1e-3, 1e-7, -1e-7, -1e-3, -0.1] {
        let outcome = pass(0.5 + clearance_m);
        assert!(outcome.robots.iter().all(|robot| robot.arrived), "{clearance_m}: {outcome:?}");
        let contacts = u64::from(clearance_m < 0.0);
        assert_eq!((outcome.robot_contacts, outcome.obstacle_contacts), (contacts, contacts), "{clearance_m}");
        for found_m in [outcome.min_clearance_m, outcome.min_obstacle_clearance_m] {
            assert!((found_m.unwrap() - clearance_m).abs() < 10.0 * NM, "{clearance_m}: {found_m:?}");
        }
    }
    // Where and when: centres meet the other's lane half way, the surfaces before that, the wall's end later.
    let outcome = pass(0.4);
    let touches: Vec<_> = outcome.events.iter().filter_map(|event| event.kind.touch()).collect();
    let [robots, end] = &touches[..] else { panic!("{touches:?}") };
    let ahead_m = (0.25_f64 - 0.16).sqrt() / 2.0;
    assert!((robots.t_s - (2.0 - ahead_m)).abs() < 100.0 * NM, "{robots:?}");
    let wall_ahead_m = (0.25_f64.powi(2) - 0.15 * 0.15).sqrt();
    assert!((end.t_s - (3.0 - wall_ahead_m)).abs() < 100.0 * NM, "{end:?}");
    for (touch, expected) in [(robots, [0.0, 0.2]), (end, [1.0, -0.15])] {
        let off = Point2::from(touch.at_m) - Point2::from(place(expected));
        assert!(off.norm() < 100.0 * NM, "{touch:?}: {off}");
    }
}

#[test]
fn an_overlap_at_the_start_counts_once() {
    let mut scenario = scenario(vec![robot(0, [0.0, 0.0], [0.0, 0.0]), robot(1, [0.3, 0.0], [0.3, 0.0])]);
    scenario.robots.push(robot(2, [0.1, 0.1], [0.1, 0.1]));
    scenario.obstacles = vec![wall([-0.2, -1.0], [-0.2, 1.0], 0.0)];
    scenario.events = vec![at(5, TimelineAction::Join { robot: 2 })];
    let mut driver = Driver::new(&scenario);
    driver.until(3);
    let outcome = driver.world.outcome();
    assert_eq!((outcome.robot_contacts, outcome.obstacle_contacts), (1, 1));
    driver.until(9);
    assert_eq!(driver.world.outcome().robot_contacts, 3, "a late joiner touches both");
    assert_eq!(driver.world.outcome().robots.iter().map(|r| r.contacts).collect::<Vec<_>>(), [3, 2, 2]);
}

#[test]
fn robots_that_just_touch_are_not_in_contact() {
    let robots = (0..6).map(|i| robot(i, [0.1 + 0.5 * i as f64, 0.0], [0.1 + 0.5 * i as f64, 0.0])).collect();
    let outcome = Driver::new(&scenario(robots)).run();
    assert_eq!(outcome.robot_contacts, 0);
    assert!(outcome.min_clearance_m.unwrap().abs() < 1e-12);
}

#[test]
fn clearances_are_absent_where_there_is_nothing_to_be_clear_of() {
    let mut alone = scenario(vec![robot(0, [0.0, 0.0], [3.0, 0.0]), robot(1, [0.0, 7.0], [0.0, 7.0])]);
    alone.events = vec![at(10, TimelineAction::Join { robot: 1 })];
    let mut driver = Driver::new(&alone);
    driver.until(10);
    assert_eq!(driver.world.outcome().min_clearance_m, None);
    driver.until(11);
    // The newcomer is far away, but there was no pair before: from (1, 0) to (0, 7), and one tick further.
    let expected = 50f64.sqrt() - 0.5;
    assert!((driver.world.outcome().min_clearance_m.unwrap() - expected).abs() < 1e-12);
    assert_eq!(driver.world.outcome().min_obstacle_clearance_m, None);
}

#[test]
fn inside_a_polygon_is_overlap() {
    let corners = [[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]].map(Point2::from).to_vec();
    let mut scenario = scenario(vec![robot(0, [-5.0, 0.0], [5.0, 0.0])]);
    scenario.obstacles = vec![Obstacle { shape: Shape::Polygon(corners), motion: None }];
    let outcome = Driver::new(&scenario).run();
    assert_eq!(outcome.obstacle_contacts, 1);
    assert!((outcome.min_obstacle_clearance_m.unwrap() + 3.25).abs() < 1e-9, "{:?}", outcome.min_obstacle_clearance_m);
}

/// Wheels that give a body 4 m/s.
const FAST_WHEELS: Wheels = Wheels {
    radius_m: 0.05,
    track_m: 0.3,
    speed_radps_max: 80.0,
    accel_radps2_max: 500.0,
    torque_nm_max: f64::INFINITY,
};

/// A world of robots and obstacles that move at random, in which everything is recorded.
#[derive(Debug)]
struct Chaos {
    scenario: Scenario,
    /// Per tick and slot.
    drives: Vec<Vec<Drive>>,
}

fn chaos() -> impl Strategy<Value = Chaos> {
    let place = || (-3.0..3.0f64, -3.0..3.0f64);
    let robots =
        prop::collection::vec((place(), 0.05..0.4f64, prop::sample::select(BodyKind::MOBILE), 0..12u64), 1..10);
    let obstacles = prop::collection::vec((place(), place(), 0.0..0.4f64, 0..4u8), 0..5);
    let drives = prop::collection::vec(prop::collection::vec((-4.0..4.0f64, -4.0..4.0f64), 10), 20);
    (robots, obstacles, drives).prop_map(|(robots, obstacles, drives)| {
        let mut scenario = scenario(Vec::new());
        for (slot, ((x, y), radius, kind, joins)) in robots.into_iter().enumerate() {
            let mut robot = robot(slot, [x, y], [99.0, 99.0]);
            robot.radius_m = radius;
            robot.limits.speed_mps_max = 4.0;
            (robot.kind, robot.wheels) = (kind, (kind == BodyKind::DiffDrive).then_some(FAST_WHEELS));
            scenario.robots.push(robot);
            if joins > 6 {
                scenario.events.push(at(joins, TimelineAction::Join { robot: slot }));
            }
        }
        scenario.events.sort_by_key(|event| event.tick);
        for ((x, y), (bx, by), radius, kind) in obstacles {
            let within = Bounds { x_m: [-3.0, 3.0], y_m: [-3.0, 3.0] };
            let motion = match kind {
                0 => None,
                1 => Some(Motion::Bounce { velocity_mps: [bx, by], within }),
                2 => Some(Motion::RandomWalk { speed_mps: 2.0, turn_every_s: 0.3, within }),
                _ => Some(Motion::Orbit { center: [x, y].into(), radius_m: 1.0, omega_radps: bx, phase_rad: by }),
            };
            let b = if kind == 2 { [x, y] } else { [bx, by] };
            scenario.obstacles.push(Obstacle { motion, ..wall([x, y], b, radius) });
        }
        let kinds: Vec<BodyKind> = scenario.robots.iter().map(|robot| robot.kind).collect();
        let drive = |kind: &BodyKind, (first, second): (f64, f64)| match kind {
            BodyKind::Point => Drive::Velocity(Vector2::new(first, second)),
            BodyKind::DiffDrive if first < second => Drive::Wheels { rate_radps: [40.0 * first, 40.0 * second] },
            BodyKind::Unicycle | BodyKind::DiffDrive => Drive::Twist { speed_mps: first, turn_radps: second },
            BodyKind::TwoLinkArm => Drive::Joints { rate_radps: [first, second] },
        };
        let drives =
            drives.into_iter().map(|tick| kinds.iter().zip(tick).map(|(k, d)| drive(k, d)).collect()).collect();
        Chaos { scenario, drives }
    })
}

/// Bodies, present or not, and obstacles at one tick.
type Snapshot = (Vec<Option<Point2<f64>>>, Vec<Capsule>);

fn snapshot(world: &World, chaos: &Chaos) -> Snapshot {
    let bodies = (0..chaos.scenario.robots.len())
        .map(|slot| {
            let odometry = world.odometry(slot);
            world
                .participants()
                .iter()
                .any(|instance| instance.index.at() == slot)
                .then(|| Point2::new(odometry.x_m, odometry.y_m))
        })
        .collect();
    let capsule = |index| {
        let piece = world.piece(index);
        let [a, b] = [[piece.ax_m, piece.ay_m], [piece.bx_m, piece.by_m]].map(Point2::from);
        Capsule { a, b, radius: piece.radius_m }
    };
    (bodies, (0..chaos.scenario.obstacles.len()).map(capsule).collect())
}

proptest! {
    #[test]
    fn contacts_and_clearances_are_what_all_pairs_say(chaos in chaos()) {
        let mut world = World::new(&chaos.scenario);
        let radius = |slot: usize| chaos.scenario.robots[slot].radius_m;
        let (mut least, mut least_obstacle) = (f64::INFINITY, f64::INFINITY);
        let (mut contacts, mut obstacle_contacts) = (0, 0);
        let count = chaos.scenario.robots.len();
        // Who overlaps whom at the end of a tick; obstacles come after the robots.
        let mut overlaps = BTreeSet::new();
        let mut enters = |pair: (usize, usize), swept: f64, at_end: f64| {
            let enters = swept < 0.0 && !overlaps.contains(&pair);
            if at_end < 0.0 { overlaps.insert(pair) } else { overlaps.remove(&pair) };
            u64::from(enters)
        };
        for drives in &chaos.drives {
            world.open(&mut |_| true);
            let before = snapshot(&world, &chaos);
            world.close(&mut |instance| Some(drives[instance.index.at()]));
            let after = snapshot(&world, &chaos);
            for i in 0..count {
                let (Some(p0), Some(p1)) = (before.0[i], after.0[i]) else { continue };
                for j in i + 1..count {
                    let (Some(q0), Some(q1)) = (before.0[j], after.0[j]) else { continue };
                    let radii = radius(i) + radius(j);
                    let swept = swept_distance(p0, p1, q0, q1) - radii;
                    least = least.min(swept);
                    contacts += enters((i, j), swept, (p1 - q1).norm() - radii);
                }
                for (index, (c0, c1)) in before.1.iter().zip(&after.1).enumerate() {
                    let swept = segment_distance(p0, p1 - (c1.a - c0.a), c0.a, c0.b) - c0.radius - radius(i);
                    least_obstacle = least_obstacle.min(swept);
                    obstacle_contacts += enters((i, count + index), swept, c1.distance(p1) - radius(i));
                }
            }
        }
        let outcome = world.outcome();
        let near = |found: Option<f64>, expected: f64| match found {
            Some(found) => (found - expected).abs() < 1e-9,
            None => expected.is_infinite(),
        };
        prop_assert!(near(outcome.min_clearance_m, least), "{:?}, not {least}", outcome.min_clearance_m);
        prop_assert!(near(outcome.min_obstacle_clearance_m, least_obstacle),
            "{:?}, not {least_obstacle}", outcome.min_obstacle_clearance_m);
        prop_assert_eq!((outcome.robot_contacts, outcome.obstacle_contacts), (contacts, obstacle_contacts));
    }

    #[test]
    fn equal_runs_have_equal_hashes_and_a_bit_makes_another(chaos in chaos()) {
        let hash = |scenario: &Scenario| {
            let mut world = World::new(scenario);
            for drives in &chaos.drives {
                world.open(&mut |_| true);
                world.close(&mut |instance| Some(drives[instance.index.at()]));
            }
            world.trajectory_hash()
        };
        let first = hash(&chaos.scenario);
        prop_assert_eq!(first, hash(&chaos.scenario));
        let mut other = chaos.scenario.clone();
        let x = &mut other.robots[0].start.x;
        *x = f64::from_bits(x.to_bits() ^ 1);
        // The last bit of the start survives as long as no sum rounds it away; the first tick always shows it.
        let mut worlds = [World::new(&chaos.scenario), World::new(&other)];
        for world in &mut worlds {
            (0..13).for_each(|_| {
                world.open(&mut |_| true);
                world.close(&mut |_| None);
            });
        }
        prop_assert_ne!(worlds[0].trajectory_hash(), worlds[1].trajectory_hash());
    }
}

#[test]
fn bad_commands_stop_the_robot_and_are_logged_once() {
    let mut scenario = scenario((0..3).map(|i| robot(i, [0.0, i as f64], [9.0, i as f64])).collect());
    scenario.robots[1].kind = BodyKind::Unicycle;
    let mut world = World::new(&scenario);
    for _ in 0..5 {
        world.open(&mut |_| true);
        world.close(&mut |instance| {
            let x = if instance.index.0 == 0 { f64::NAN } else { 1.0 };
            Some(Drive::Velocity(Vector2::new(x, 0.0)))
        });
    }
    assert_eq!([0, 1, 2].map(|slot| world.odometry(slot).x_m > 0.0), [false, false, true]);
    let events = world.outcome().events;
    let scolded: Vec<_> =
        events.iter().filter(|e| e.kind.name() == EventName::BadCommand).map(|e| (e.tick, e.robot)).collect();
    assert_eq!(scolded, [(0, Some(RobotIndex(0))), (0, Some(RobotIndex(1)))]);
}

/// A diff-drive takes twists and rates of wheels, no other body takes the latter, and what is not a number stops it.
#[test]
fn only_wheels_take_rates_of_wheels() {
    let mut scenario = scenario((0..4).map(|i| robot(i, [0.0, i as f64], [9.0, i as f64])).collect());
    (scenario.robots[0].kind, scenario.robots[1].kind) = (BodyKind::Point, BodyKind::Unicycle);
    for robot in &mut scenario.robots[2..] {
        (robot.kind, robot.wheels) = (BodyKind::DiffDrive, Some(FAST_WHEELS));
    }
    let mut world = World::new(&scenario);
    let mut tick = |drive: [Drive; 2]| {
        world.open(&mut |_| true);
        world.close(&mut |instance| Some(drive[instance.index.at() / 3]));
        [0, 1, 2, 3].map(|slot| world.odometry(slot).x_m > 0.0)
    };
    let (ahead, twist) = ([10.0, 10.0], Drive::Twist { speed_mps: 0.5, turn_radps: 0.0 });
    assert_eq!(tick([Drive::Wheels { rate_radps: ahead }, twist]), [false, false, true, true]);
    tick([Drive::Wheels { rate_radps: [f64::NAN, 1.0] }, Drive::Wheels { rate_radps: ahead }]);
    let events = world.outcome().events;
    let refused: Vec<_> =
        events.iter().filter(|e| e.kind.name() == EventName::BadCommand).map(|e| (e.tick, e.robot)).collect();
    assert_eq!(refused, [(0, Some(RobotIndex(0))), (0, Some(RobotIndex(1))), (1, Some(RobotIndex(2)))]);
}

#[test]
fn frames_show_robots_and_moving_obstacles() {
    use protocol::world_to_observer::FrameBody;
    let mut scenario = scenario((0..3).map(|i| robot(i, [0.0, i as f64], [9.0, i as f64])).collect());
    let motion = Motion::Orbit { center: [5.0, 5.0].into(), radius_m: 1.0, omega_radps: 1.0, phase_rad: 0.0 };
    scenario.obstacles = vec![wall([0.0, 9.0], [1.0, 9.0], 0.0), wall([0.0, 9.0], [0.0, 9.0], 0.3)];
    scenario.obstacles[1].motion = Some(motion);
    scenario.events = vec![at(0, TimelineAction::Leave { robot: 1 }), at(1, TimelineAction::kill(2))];
    let mut driver = Driver::new(&scenario);
    driver.until(1);
    driver.open();
    let mut frame = Vec::new();
    driver.world.frame(&mut frame);
    let shown: Vec<_> = frame.iter().map(|body| (body.index, body.flags)).collect();
    assert_eq!(shown, [(0, 0), (2, FrameBody::FLAG_SILENT), (1, FrameBody::FLAG_OBSTACLE)]);
    assert!((frame[2].x_m - (5.0 + (1.0 / HZ).cos())).abs() < 1e-12 && frame[2].radius_m == 0.3);
    assert_eq!((driver.world.frame_header().tick, driver.world.frame_header().time_s), (1, 1.0 / HZ));
}
