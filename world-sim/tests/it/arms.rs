//! Arms in the world: how they move, whom their links touch, and who sees them.

use crate::driver::{Driver, HZ, at, instance, robot, scenario};
use geometry::{ArmGeometry, Capsule, Polygon, segment_distance};
use model::{
    ArmSetup, BodyKind, Drive, EventKind, EventName, Motion, Obstacle, Partner, Robot, RobotIndex, Scenario, Shape,
    TimelineAction,
};
use nalgebra::{Point2, Vector2};
use proptest::prelude::*;
use protocol::world_to_observer::FrameBody;
use shoal_world_sim::World;
use std::f64::consts::{PI, TAU};

/// An arm of 1.5 m and 1 m whose tip has the whole of its reach as its goal, or none of it.
fn arm(slot: usize, base: [f64; 2], joints_rad: [f64; 2]) -> Robot {
    let geometry = ArmGeometry {
        base: base.into(),
        links_m: [1.5, 1.0],
        link_radius_m: 0.1,
        joint_min_rad: [-TAU, -3.0],
        joint_max_rad: [TAU, 3.0],
    };
    let setup = ArmSetup { geometry, start_joints_rad: joints_rad };
    let mut robot = robot(slot, setup.start().tip().into(), [99.0, 99.0]);
    (robot.kind, robot.arm, robot.radius_m) = (BodyKind::TwoLinkArm, Some(setup), 0.1);
    robot.limits.speed_mps_max = 100.0;
    robot.start_yaw_rad = joints_rad[0] + joints_rad[1];
    robot
}

fn turn(first: f64, second: f64) -> Option<Drive> {
    Some(Drive::Joints { rate_radps: [first, second] })
}

fn disc(x: f64, y: f64, radius: f64) -> Obstacle {
    Obstacle { shape: Shape::Capsule(Capsule::disc(Point2::new(x, y), radius)), motion: None }
}

/// Runs a world in which everybody does the same in every tick, by slot.
fn run(scenario: &Scenario, ticks: u64, drives: &[Option<Drive>]) -> World {
    let mut world = World::new(scenario);
    for _ in 0..ticks {
        world.open(&mut |_| true);
        world.close(&mut |instance| drives[instance.index.at()]);
    }
    world
}

#[test]
fn the_tip_is_where_the_joints_say() {
    let scenario = scenario(vec![arm(0, [1.0, 2.0], [0.3, -0.8])]);
    let geometry = scenario.robots[0].arm.unwrap().geometry;
    let world = run(&scenario, 7, &[turn(0.5, -1.2)]);
    let odometry = world.odometry(0);
    let expected = [0.3 + 0.5 * 7.0 / HZ, -0.8 - 1.2 * 7.0 / HZ];
    assert!((0..2).all(|i| (odometry.joints_rad[i] - expected[i]).abs() < 1e-12), "{:?}", odometry.joints_rad);
    let tip = Point2::new(odometry.x_m, odometry.y_m);
    assert_eq!(tip, geometry.tip(odometry.joints_rad));
    assert!((odometry.yaw_rad - (expected[0] + expected[1])).abs() < 1e-12);
    assert!((odometry.turn_radps + 0.7).abs() < 1e-12);
    // The velocity is that of the tip at the end of the tick.
    let step = 1e-6;
    let later = geometry.tip([expected[0] + 0.5 * step, expected[1] - 1.2 * step]);
    assert!(((later - tip) / step - Vector2::new(odometry.vx_mps, odometry.vy_mps)).norm() < 1e-5);
}

#[test]
fn joints_and_the_tip_keep_their_limits() {
    let mut scenario = scenario(vec![arm(0, [0.0, 0.0], [0.0, 1.0]), arm(1, [5.0, 0.0], [0.0, 0.0])]);
    scenario.robots[1].limits.speed_mps_max = 0.25;
    // Joint rates are at most 2 rad/s and shrink together; the second arm is stretched: 0.25 m/s at 2.5 m.
    let world = run(&scenario, 1, &[turn(-1.0, 4.0), turn(5.0, 0.0)]);
    let joints = |slot| world.odometry(slot).joints_rad;
    assert!((joints(0)[0] + 0.5 / HZ).abs() < 1e-12 && (joints(0)[1] - 1.0 - 2.0 / HZ).abs() < 1e-12);
    assert!((joints(1)[0] - 0.1 / HZ).abs() < 1e-12);
    // At the end of its range a joint stands.
    let world = run(&scenario, 100, &[turn(0.0, 4.0), None]);
    assert_eq!(world.odometry(0).joints_rad, [0.0, 3.0]);
    assert_eq!((world.odometry(0).vx_mps, world.odometry(0).vy_mps), (0.0, 0.0));
}

#[test]
fn only_joint_rates_move_an_arm_and_only_arms() {
    let scenario = scenario(vec![arm(0, [0.0, 0.0], [0.5, 0.5]), robot(1, [5.0, 0.0], [9.0, 0.0])]);
    let world = run(&scenario, 3, &[Some(Drive::Velocity(Vector2::new(1.0, 0.0))), turn(1.0, 1.0)]);
    assert_eq!((world.odometry(0).joints_rad, world.odometry(1).x_m), ([0.5, 0.5], 5.0));
    let scolded = world.outcome().events.iter().filter(|event| event.kind.name() == EventName::BadCommand).count();
    assert_eq!(scolded, 2);
}

#[test]
fn the_referee_judges_the_tip() {
    let mut scenario = scenario(vec![arm(0, [0.0, 0.0], [0.0, 0.0])]);
    scenario.robots[0].goals = vec![Point2::new(0.0, 2.5)];
    scenario.robots[0].limits.turn_radps_max = PI / 4.0;
    let mut world = World::new(&scenario);
    while !world.finished() {
        world.open(&mut |_| true);
        world.close(&mut |_| turn(PI / 4.0, 0.0));
    }
    let outcome = world.outcome();
    // A quarter of a turn takes two seconds; the tolerance of 5 cm is reached a little earlier.
    assert_eq!((outcome.robots[0].arrived, outcome.robots[0].time_s), (true, Some(2.0)));
    let arc = 2.5 * PI / 2.0;
    assert!((outcome.robots[0].path_length_m - arc).abs() < 0.01, "{}", outcome.robots[0].path_length_m);
    assert_eq!(outcome.robots[0].path_ratio, None);
}

#[test]
fn the_hash_tells_poses_apart_that_hold_the_tip_in_one_place() {
    let hash = |joints_rad: [f64; 2]| {
        let mut scenario = scenario(vec![arm(0, [0.0, 0.0], joints_rad)]);
        let mut setup = scenario.robots[0].arm.unwrap();
        setup.geometry.links_m = [1.0, 1.0];
        scenario.robots[0].arm = Some(setup);
        run(&scenario, 2, &[None]).trajectory_hash()
    };
    // A whole turn of the first joint apart: the same picture, but not the same arm.
    assert_ne!(hash([0.0, 3.0]), hash([TAU, 3.0]));
    assert_eq!(hash([1.0, 0.5]), hash([1.0, 0.5]));
}

#[test]
fn links_sweep_what_they_pass() {
    // The tip passes both within one tick, 25 times as fast as it is thick; the third is out of reach by a little.
    let mut scenario = scenario(vec![
        arm(0, [0.0, 0.0], [0.0, 0.0]),
        robot(1, [2.0, 1.5], [2.0, 9.0]),
        robot(2, [0.0, 1.4], [0.0, 9.0]),
        robot(3, [-2.9, 0.3], [-9.0, 0.3]),
    ]);
    scenario.robots[0].limits.turn_radps_max = 30.0;
    scenario.obstacles = vec![disc(1.0, 1.0, 0.05), disc(-2.5, 1.0, 0.01), disc(0.0, -2.5, 0.3)];
    let world = run(&scenario, 1, &[turn(30.0, 0.0), None, None, None]);
    let outcome = world.outcome();
    assert_eq!((outcome.robot_contacts, outcome.obstacle_contacts), (2, 1), "{:?}", outcome.events);
    assert_eq!(outcome.robots.iter().map(|robot| robot.contacts).collect::<Vec<_>>(), [3, 1, 1, 0]);
    // It comes to stand at 3 rad: past robot 3, whose surface was nearest on the way.
    let nearest = 2.9f64.hypot(0.3) - 2.5 - 0.1 - 0.25;
    assert!(outcome.min_clearance_m.unwrap() < 0.0 && nearest > 0.0);
    // Nobody is in contact twice for staying in it.
    let world = run(&scenario, 5, &[turn(-1e-3, 0.0), None, None, None]);
    assert_eq!(world.contacts(), 0);
}

#[test]
fn one_contact_per_entry_however_many_links_take_part() {
    // Folded round the robot: both links touch it at once, part, and touch it again.
    let mut scenario = scenario(vec![arm(0, [0.0, 0.0], [0.0, 2.6]), robot(1, [1.1, 0.0], [9.0, 9.0])]);
    scenario.robots[1].start = Point2::new(1.0, 0.6);
    let mut world = World::new(&scenario);
    let mut contacts = Vec::new();
    for tick in 0..40 {
        world.open(&mut |_| true);
        world.close(&mut |_| turn(0.0, if tick / 10 % 2 == 0 { 1.0 } else { -1.0 }));
        contacts.push(world.contacts());
    }
    let outcome = world.outcome();
    let entries: Vec<u64> =
        outcome.events.iter().filter(|event| event.kind.name() == EventName::Contact).map(|e| e.tick).collect();
    assert_eq!(outcome.robot_contacts as usize, entries.len());
    assert!(entries.windows(2).all(|two| two[0] < two[1]), "{entries:?}");
}

#[test]
fn an_arm_that_enters_may_stand_in_others() {
    let mut scenario = scenario(vec![
        robot(0, [0.7, 0.0], [0.7, 0.0]),
        arm(1, [0.0, 0.0], [0.0, 1.0]),
        arm(2, [1.0, 1.0], [-1.6, 0.0]),
    ]);
    scenario.obstacles = vec![
        disc(1.4, 0.1, 0.1),
        Obstacle {
            shape: Shape::Polygon([[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]].map(Point2::from).to_vec()),
            motion: None,
        },
    ];
    scenario.events = vec![at(4, TimelineAction::Join { robot: 1 })];
    let mut driver = Driver::new(&scenario);
    driver.until(4);
    // Robot 0 and the arm of slot 2 stand inside the polygon from the beginning, and the arm reaches the disc.
    let before = driver.world.contacts();
    driver.open();
    let outcome = driver.world.outcome();
    let new: Vec<_> = outcome
        .events
        .iter()
        .filter(|e| e.kind.name() == EventName::Contact && e.tick == 4)
        .map(|e| match e.kind {
            EventKind::Contact { with, .. } => with,
            _ => unreachable!("it is a contact"),
        })
        .collect();
    let robots = [1, 2].map(|other| Partner::Robot(RobotIndex(other)));
    assert_eq!(new, [robots, [Partner::Obstacle(0), Partner::Obstacle(1)]].concat());
    assert_eq!(driver.world.contacts(), before + 4);
}

/// Pieces: one obstacle, robot 0, the links of arm 1, robot 2, the links of arm 3, robot 4.
fn seen(driver: &Driver, slot: usize) -> Vec<u16> {
    driver.world.sensed(slot).to_vec()
}

#[test]
fn links_are_seen_at_any_time_and_by_all_others() {
    let mut scenario = scenario(vec![
        robot(0, [0.0, -1.0], [0.0, -1.0]),
        arm(1, [0.0, 0.0], [0.5, 0.5]),
        robot(2, [9.0, 9.0], [9.0, 9.0]),
        arm(3, [2.7, 0.0], [2.0, 0.5]),
        robot(4, [1.0, -1.0], [1.0, -1.0]),
    ]);
    scenario.obstacles = vec![disc(-9.0, 0.0, 0.5)];
    for robot in &mut scenario.robots {
        robot.sensor_range_m = 3.0;
        robot.radio_range_m = 4.0;
    }
    scenario.events = vec![
        at(2, TimelineAction::pause(1, 3)),
        at(3, TimelineAction::kill(4)),
        at(7, TimelineAction::Leave { robot: 1 }),
    ];
    let mut driver = Driver::new(&scenario);
    driver.open();
    // Nobody is on the radio yet; robot 0 sees only the first link of arm 3.
    assert_eq!(seen(&driver, 0), [2, 3, 5, 7]);
    assert_eq!(seen(&driver, 1), [1, 5, 6, 7], "not its own links");
    assert_eq!(seen(&driver, 2), [0u16; 0]);
    assert_eq!(seen(&driver, 3), [1, 2, 3, 7], "from where its tip is");
    driver.close();
    for (tick, robot_0, arm_3) in [
        (1, vec![2, 3, 5], vec![2, 3]),
        (2, vec![2, 3, 5], vec![2, 3]),
        (3, vec![2, 3, 5, 7], vec![2, 3, 7]),
        (6, vec![2, 3, 5, 7], vec![2, 3, 7]),
        (7, vec![5, 7], vec![7]),
    ] {
        driver.until(tick);
        driver.open();
        assert_eq!((seen(&driver, 0), seen(&driver, 3)), (robot_0, arm_3), "tick {tick}");
        let heard: Vec<u32> = driver.world.neighbors(0).iter().map(|neighbor| neighbor.index).collect();
        assert_eq!(heard.contains(&1), matches!(tick, 1 | 6), "the tip is on the radio like anybody");
        driver.close();
    }
}

#[test]
fn pieces_of_links_say_where_they_are_and_whose() {
    let scenario = scenario(vec![
        robot(0, [4.0, 0.0], [9.0, 0.0]),
        arm(1, [0.0, 0.0], [0.2, 0.4]),
        robot(2, [6.0, 0.0], [9.0, 9.0]),
    ]);
    let geometry = scenario.robots[1].arm.unwrap().geometry;
    let mut world = run(&scenario, 3, &[None, turn(1.0, -0.5), None]);
    let changed = world.open(&mut |_| true).pieces.to_vec();
    assert_eq!(changed, [1, 2], "what moved");
    let joints_rad = world.odometry(1).joints_rad;
    for (index, link) in [1, 2].into_iter().zip(geometry.bodies(joints_rad)) {
        let piece = world.piece(index);
        assert_eq!((piece.ax_m, piece.ay_m, piece.bx_m, piece.by_m), (link.a.x, link.a.y, link.b.x, link.b.y));
        assert_eq!((piece.radius_m, piece.obstacle), (0.1, 1));
        assert!(piece.vx_mps.hypot(piece.vy_mps) > 0.5);
    }
    assert_eq!([0, 3].map(|index| world.piece(index).obstacle), [0, 2]);
    let mut frame: Vec<FrameBody> = Vec::new();
    world.frame(&mut frame);
    assert_eq!([0, 1, 2].map(|slot| frame[slot].joints_rad), [[0.0; 2], joints_rad, [0.0; 2]]);
    assert_eq!(Point2::new(frame[1].x_m, frame[1].y_m), geometry.tip(joints_rad));
}

#[test]
fn a_dead_arm_stays_a_body() {
    let mut scenario = scenario(vec![arm(0, [0.0, 0.0], [0.0, 0.3]), robot(1, [0.8, 2.0], [0.8, -2.0])]);
    scenario.events = vec![at(3, TimelineAction::kill(0))];
    let mut driver = Driver::new(&scenario);
    driver.until(3);
    for _ in 0..50 {
        driver.open();
        assert_eq!(driver.world.participants(), [instance(1, 0)]);
        driver.close();
    }
    let odometry = driver.world.odometry(0);
    assert_eq!((odometry.joints_rad, odometry.vx_mps), ([0.0, 0.3], 0.0));
    assert_eq!(driver.world.outcome().robot_contacts, 1);
}

#[test]
fn an_arm_is_not_admitted_to_a_running_world() {
    use protocol::daemon_to_world::Order;
    let scenario = scenario(vec![robot(0, [0.0, 0.0], [9.0, 0.0])]);
    let mut world = World::new(&scenario);
    world.order(Order::Admit { instance: instance(1, 0), robot: Box::new(arm(1, [5.0, 5.0], [0.0, 0.0])) });
    world.open(&mut |_| true);
    assert_eq!(world.robot_count(), 1);
    assert!(world.outcome().events.iter().any(|event| event.kind.name() == EventName::Ignored));
}

/// Arms and robots that flail among obstacles.
#[derive(Debug)]
struct Chaos {
    scenario: Scenario,
    /// Per tick and slot.
    drives: Vec<Vec<Drive>>,
}

fn chaos() -> impl Strategy<Value = Chaos> {
    let place = || (-2.5..2.5f64, -2.5..2.5f64);
    let robots = prop::collection::vec((place(), (-3.0..3.0f64, -2.9..2.9f64), 0..3u8), 2..6);
    let obstacles = prop::collection::vec((place(), place(), 0.0..0.3f64, 0..3u8), 0..4);
    let drives = prop::collection::vec(prop::collection::vec((-3.0..3.0f64, -3.0..3.0f64), 6), 12);
    (robots, obstacles, drives).prop_map(|(robots, obstacles, drives)| {
        let mut scenario = scenario(Vec::new());
        for (slot, ((x, y), (first, second), kind)) in robots.into_iter().enumerate() {
            let mut body =
                if kind > 0 { arm(slot, [x, y], [first, second]) } else { robot(slot, [x, y], [99.0, 99.0]) };
            body.limits.speed_mps_max = 4.0;
            scenario.robots.push(body);
        }
        for ((x, y), (vx, vy), radius, kind) in obstacles {
            let shape = match kind {
                0 => Shape::Capsule(Capsule { a: Point2::new(x, y), b: Point2::new(x + 0.5, y), radius }),
                _ => Shape::Polygon(vec![Point2::new(x, y), Point2::new(x + 1.0, y), Point2::new(x, y + 1.2)]),
            };
            let points = vec![shape.reference(), shape.reference() + Vector2::new(vx, vy)];
            let motion = Motion::Waypoints { points, speed_mps: 0.7, then: model::AtEnd::PingPong };
            scenario.obstacles.push(Obstacle { shape, motion: (kind < 2).then_some(motion) });
        }
        let drive = |(robot, (first, second)): (&Robot, (f64, f64))| match robot.kind {
            BodyKind::TwoLinkArm => Drive::Joints { rate_radps: [first, second] },
            _ => Drive::Velocity(Vector2::new(first, second)),
        };
        let drives = drives.into_iter().map(|tick| scenario.robots.iter().zip(tick).map(drive).collect()).collect();
        Chaos { scenario, drives }
    })
}

/// Everything that tells where the bodies are: positions and joints, and offsets of the obstacles.
type Snapshot = (Vec<(Point2<f64>, [f64; 2])>, Vec<Vector2<f64>>);

fn snapshot(world: &World, scenario: &Scenario) -> Snapshot {
    let state = |slot| {
        let odometry = world.odometry(slot);
        (Point2::new(odometry.x_m, odometry.y_m), odometry.joints_rad)
    };
    let mut first = 0;
    let offset = |obstacle: &Obstacle| {
        let (piece, base) = (world.piece(first), obstacle.shape.pieces()[0]);
        first += obstacle.shape.piece_count();
        Point2::new(piece.ax_m, piece.ay_m) - base.a
    };
    ((0..scenario.robots.len()).map(state).collect(), scenario.obstacles.iter().map(offset).collect())
}

/// The bodies of a robot at an instant between two snapshots.
fn parts(robot: &Robot, from: (Point2<f64>, [f64; 2]), to: (Point2<f64>, [f64; 2]), t: f64) -> Vec<Capsule> {
    match &robot.arm {
        Some(arm) => arm.geometry.bodies([0, 1].map(|i| from.1[i] + (to.1[i] - from.1[i]) * t)).to_vec(),
        None => vec![Capsule::disc(from.0 + (to.0 - from.0) * t, robot.radius_m)],
    }
}

fn between(a: &[Capsule], b: &[Capsule]) -> f64 {
    let pairs = a.iter().flat_map(|a| b.iter().map(move |b| (a, b)));
    pairs.map(|(a, b)| segment_distance(a.a, a.b, b.a, b.b) - a.radius - b.radius).fold(f64::INFINITY, f64::min)
}

/// Instants looked at in a tick.
const STEPS: u32 = 400;
/// Nothing comes nearer than this between two of them: the fastest points make 10 m/s together.
const MISSED_M: f64 = 10.0 / HZ / STEPS as f64;
/// What a sweep may miss.
const SWEEP_M: f64 = 1e-4;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    #[test]
    fn contacts_and_clearances_are_what_many_instants_show(chaos in chaos()) {
        let Chaos { scenario, drives } = &chaos;
        let mut world = World::new(scenario);
        let count = scenario.robots.len();
        let mut least = [f64::INFINITY; 2];
        // Contacts that there must be, and that there may be: those that hardly touch are for nobody to say.
        let mut contacts = [[0u64; 2]; 2];
        for (tick, drives) in drives.iter().enumerate() {
            world.open(&mut |_| true);
            let before = snapshot(&world, scenario);
            world.close(&mut |instance| Some(drives[instance.index.at()]));
            let after = snapshot(&world, scenario);
            let body = |slot: usize, t: f64| parts(&scenario.robots[slot], before.0[slot], after.0[slot], t);
            let gap = |i: usize, j: usize, t: f64| {
                let Some(index) = j.checked_sub(count) else { return between(&body(i, t), &body(j, t)) };
                let offset = before.1[index] + (after.1[index] - before.1[index]) * t;
                let shape = &scenario.obstacles[index].shape;
                let pieces: Vec<Capsule> = shape.pieces().iter().map(|piece| piece.moved(offset)).collect();
                let inside = |link: &Capsule| match shape {
                    Shape::Polygon(corners) => Polygon { corners: corners.clone() }.contains(link.a - offset),
                    Shape::Capsule(_) => false,
                };
                let links = body(i, t);
                let deep = links.iter().any(inside);
                let edge = between(&links, &pieces);
                if deep { edge.min(-1e-3) } else { edge }
            };
            for i in 0..count {
                for j in i + 1..count + scenario.obstacles.len() {
                    let kind = usize::from(j >= count);
                    let at: Vec<f64> = (0..=STEPS).map(|step| gap(i, j, f64::from(step) / f64::from(STEPS))).collect();
                    let sampled = at.iter().copied().fold(f64::INFINITY, f64::min);
                    least[kind] = least[kind].min(sampled);
                    for (which, limit) in [-SWEEP_M - 1e-9, MISSED_M].into_iter().enumerate() {
                        let entered = sampled < limit && (tick == 0 && at[0] < limit || at[0] >= -1e-9);
                        contacts[which][kind] += u64::from(entered);
                    }
                }
            }
        }
        let outcome = world.outcome();
        let found = [outcome.min_clearance_m, outcome.min_obstacle_clearance_m];
        for kind in 0..2 {
            let Some(found) = found[kind] else { prop_assert!(least[kind].is_infinite()); continue };
            // How deep something is inside a polygon is another matter.
            prop_assert!(found <= least[kind] + SWEEP_M + 1e-9 || least[kind] < 0.0, "{kind}: {found}, not {}", least[kind]);
            prop_assert!(found >= least[kind] - MISSED_M || least[kind] < 0.0, "{kind}: {found}, not {}", least[kind]);
            prop_assert!((found < 0.0) == (least[kind] < 0.0) || found.abs() < MISSED_M, "{kind}: {found}");
        }
        let counted = [outcome.robot_contacts, outcome.obstacle_contacts];
        for kind in 0..2 {
            let (must, may) = (contacts[0][kind], contacts[1][kind]);
            prop_assert!(must <= counted[kind] && counted[kind] <= may, "{kind}: {must} to {may}, not {}", counted[kind]);
        }
    }
}
