//! Boards: the cost of reading the poses of N robots and the odometry, and of writing a pose, odometry and lists.
//! *Warm* is reading again what has not been written since. *Cold* is nearer to how a robot finds them: another processor has written everything again, and this one
//! has done other work and slept since.

use crate::home::{Home, Other, Period};
use bus::{Node, Poses, RobotReader, RobotWriter, Services, Sizes, WorldReader, WorldWriter};
use divan::Bencher;
use model::{RobotIndex, RobotInstance};
use protocol::robot_to_robot::SharedPose;
use protocol::world_to_robot::{NeighborRef, Odometry};
use std::cell::RefCell;
use std::hint::black_box;

const BOARDS: [u32; 3] = [1, 16, 64];

fn instance(slot: u32) -> RobotInstance {
    RobotInstance { index: RobotIndex(slot), incarnation: 0 }
}

fn pose(slot: u32, tick: u64) -> SharedPose {
    let (slot, time_s) = (f64::from(slot), tick as f64 * 0.02);
    SharedPose {
        tick,
        stamp_ns: 20_000_000 * tick + 1,
        x_m: slot + time_s.cos(),
        y_m: 0.5 * slot + time_s.sin(),
        yaw_rad: time_s,
        vx_mps: -time_s.sin(),
        vy_mps: time_s.cos(),
        radius_m: 0.2,
        remaining_m: 9.0,
        flags: SharedPose::FLAG_SPOKEN,
        ..SharedPose::default()
    }
}

/// Robots whose boards another thread writes, and the readers of them here.
struct Robots {
    readers: Vec<RobotReader>,
    writer: Other,
    tick: u64,
    period: Period,
    _home: Home,
}

impl Robots {
    fn new(count: u32, poses: Poses) -> Robots {
        let home = Home::new();
        let address = home.address.clone();
        let writer = Other::new(move || {
            let node = Node::new(&address, "writer").unwrap();
            let sizes = Sizes { max_robots: count, shape_pieces: 0 };
            let boards = (0..count).map(|slot| RobotWriter::create(&node, instance(slot), sizes, poses));
            let mut boards: Vec<RobotWriter> = boards.collect::<Result<_, _>>().unwrap();
            move |tick| boards.iter_mut().zip(0..).for_each(|(board, slot)| board.pose(|told| *told = pose(slot, tick)))
        });
        let node = home.node("reader");
        let readers = (0..count).map(|slot| RobotReader::open(&node, instance(slot)));
        let readers = readers.collect::<Result<_, _>>().unwrap();
        let mut robots = Robots { readers, writer, tick: 0, period: Period::new(), _home: home };
        robots.speak();
        robots.speak();
        robots
    }

    /// Everybody tells a pose.
    fn speak(&mut self) {
        self.tick += 1;
        self.writer.work(self.tick);
    }

    /// Everybody tells a pose, and this processor forgets.
    fn turn_cold(&mut self) {
        self.speak();
        self.period.pass();
    }

    fn newest(&mut self) {
        self.readers.iter_mut().for_each(|reader| _ = black_box(reader.pose()));
    }

    fn before_this_tick(&mut self) {
        let tick = self.tick + 1;
        self.readers.iter_mut().for_each(|reader| _ = black_box(reader.pose_before(tick)));
    }
}

/// The newest poses, as in `realtime`.
#[divan::bench(args = BOARDS)]
fn pose_warm(bencher: Bencher<'_, '_>, boards: u32) {
    let mut robots = Robots::new(boards, Poses::Newest);
    bencher.bench_local(|| robots.newest());
}

#[divan::bench(args = BOARDS, sample_size = 1, sample_count = 300)]
fn pose_cold(bencher: Bencher<'_, '_>, boards: u32) {
    cold(bencher, Robots::new(boards, Poses::Newest), Robots::newest);
}

/// The newest poses of boards that hold two.
#[divan::bench(args = BOARDS, sample_size = 1, sample_count = 300)]
fn pose_of_two_cold(bencher: Bencher<'_, '_>, boards: u32) {
    cold(bencher, Robots::new(boards, Poses::LastTwo), Robots::newest);
}

/// The poses of the tick before, as in `lockstep`.
#[divan::bench(args = BOARDS, sample_size = 1, sample_count = 300)]
fn pose_before_cold(bencher: Bencher<'_, '_>, boards: u32) {
    cold(bencher, Robots::new(boards, Poses::LastTwo), Robots::before_this_tick);
}

fn cold(bencher: Bencher<'_, '_>, robots: Robots, read: fn(&mut Robots)) {
    let robots = RefCell::new(robots);
    bencher.with_inputs(|| robots.borrow_mut().turn_cold()).bench_local_values(|()| read(&mut robots.borrow_mut()));
}

/// One robot's odometry on the board of a world of N robots.
struct World {
    reader: WorldReader,
    writer: Other,
    tick: u64,
    period: Period,
    _services: Services,
    _home: Home,
}

impl World {
    fn new(count: u32) -> World {
        let home = Home::new();
        let node = home.node("daemon");
        let sizes = Sizes { max_robots: count, shape_pieces: 0 };
        let services = Services::create(&node, sizes).unwrap();
        let address = home.address.clone();
        let writer = Other::new(move || {
            let node = Node::new(&address, "world").unwrap();
            let mut board = WorldWriter::open(&node, sizes, 0).unwrap();
            move |tick| {
                (0..count).for_each(|slot| board.odometry(RobotIndex(slot), |told| *told = odometry(slot, tick)));
            }
        });
        let reader = WorldReader::open(&home.node("agent"), RobotIndex(count / 2), 0).unwrap();
        let mut world = World { reader, writer, tick: 0, period: Period::new(), _services: services, _home: home };
        world.turn_cold();
        world
    }

    fn turn_cold(&mut self) {
        self.tick += 1;
        self.writer.work(self.tick);
        self.period.pass();
    }
}

fn odometry(slot: u32, tick: u64) -> Odometry {
    let SharedPose { stamp_ns, x_m, y_m, yaw_rad, vx_mps, vy_mps, .. } = pose(slot, tick);
    let (goal_x_m, goal_y_m, flags) = (9.0, -9.0, Odometry::FLAG_PRESENT);
    Odometry { tick, stamp_ns, x_m, y_m, yaw_rad, vx_mps, vy_mps, goal_x_m, goal_y_m, flags, ..Odometry::default() }
}

#[divan::bench(args = BOARDS)]
fn odometry_warm(bencher: Bencher<'_, '_>, robots: u32) {
    let world = World::new(robots);
    bencher.bench_local(|| world.reader.odometry());
}

#[divan::bench(args = BOARDS, sample_size = 1, sample_count = 300)]
fn odometry_cold(bencher: Bencher<'_, '_>, robots: u32) {
    let world = RefCell::new(World::new(robots));
    bencher.with_inputs(|| world.borrow_mut().turn_cold()).bench_local_values(|()| world.borrow().reader.odometry());
}

/// A pose of a robot, as in `lockstep`.
#[divan::bench]
fn pose_write(bencher: Bencher<'_, '_>) {
    let home = Home::new();
    let node = home.node("robot");
    let sizes = Sizes { max_robots: 1, shape_pieces: 0 };
    let mut board = RobotWriter::create(&node, instance(0), sizes, Poses::LastTwo).unwrap();
    let mut tick = 0;
    let mut next = || {
        tick += 1;
        pose(0, tick)
    };
    bencher.with_inputs(&mut next).bench_local_refs(|made| board.pose(|told| *told = *made));
}

/// The lists of one robot: how many neighbours, with as many pieces in sight.
const LISTED: [u32; 3] = [0, 16, 200];

/// Writes both lists of a robot.
#[divan::bench(args = LISTED)]
fn lists_write(bencher: Bencher<'_, '_>, listed: u32) {
    let (_home, _services, mut world, _) = lists();
    let (neighbors, pieces) = listed_of(listed);
    bencher.bench_local(|| {
        world.neighbors(RobotIndex(0), black_box(&neighbors), &[]);
        world.sensed(RobotIndex(0), black_box(&pieces));
    });
}

/// Writes both, tells of it, and reads them.
#[divan::bench(args = LISTED)]
fn lists_write_and_read(bencher: Bencher<'_, '_>, listed: u32) {
    let (_home, _services, mut world, mut robot) = lists();
    let (neighbors, pieces) = listed_of(listed);
    let (mut heard, mut seen) = (Vec::with_capacity(256), Vec::with_capacity(256));
    bencher.bench_local(|| {
        world.neighbors(RobotIndex(0), black_box(&neighbors), &[]);
        world.sensed(RobotIndex(0), black_box(&pieces));
        world.odometry(RobotIndex(0), |odometry| odometry.tick += 1);
        robot.odometry();
        assert!(robot.neighbors(&mut heard, &mut Vec::new()) && robot.sensed(&mut seen));
    });
}

fn lists() -> (Home, Services, WorldWriter, WorldReader) {
    let home = Home::new();
    let node = home.node("daemon");
    let sizes = Sizes { max_robots: 256, shape_pieces: 0 };
    let services = Services::create(&node, sizes).unwrap();
    let world = WorldWriter::open(&home.node("world"), sizes, 0).unwrap();
    let robot = WorldReader::open(&home.node("agent"), RobotIndex(0), 0).unwrap();
    (home, services, world, robot)
}

fn listed_of(count: u32) -> (Vec<NeighborRef>, Vec<u16>) {
    ((0..count).map(|index| NeighborRef { index, incarnation: 0 }).collect(), (0..count as u16).collect())
}
