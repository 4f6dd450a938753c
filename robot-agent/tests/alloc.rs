//! A tick of an agent in which nothing special happens asks for no memory, and makes the pose where the neighbours find it:
//! the whole process, core, boards and gate, in one thread, with this test as the world and as the neighbours.

#[path = "../../tests/counting.rs"]
mod counting;

#[path = "../../tests/memory.rs"]
mod memory;

use bus::{Address, Gate, Lease, Node, Poses, RobotWriter, Services, Sizes, WorldWriter, clean, clock};
use memory::Shared;
use model::{RobotIndex, RobotInstance};
use protocol::codec;
use protocol::daemon_to_robot::AgentSpec;
use protocol::robot_to_robot::SharedPose;
use protocol::world_to_robot::{NeighborRef, Odometry, Piece};
use scenarios::Draft;
use shoal_robot_agent::agent::planner_of;
use shoal_robot_agent::shell::{self, Args};
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};
use std::time::Duration;

/// What the agent has asked for, as of its newest step.
static CALLS: AtomicUsize = AtomicUsize::new(0);
/// Where the agent made its pose in its newest step.
static MADE_AT: AtomicUsize = AtomicUsize::new(0);

const NEIGHBORS: u32 = 12;
const PIECES: u16 = 10;

#[test]
fn steady_ticks_do_not_allocate() {
    for planner in ["straight", "apf", "decentralized-apf"] {
        check(planner);
    }
}

fn check(planner: &str) {
    let disc = Draft::new().with("shape", "disc").with("center_m", [0.0, 9.0]).with("radius_m", 0.1);
    let scenario = Draft::new()
        .with("clock.mode", "lockstep")
        .with("fleet.max_robots", 64_usize)
        .with("layout.kind", "circle-swap")
        .with("layout.robots", 13_usize)
        .with("layout.radius_m", 5.0)
        .with("defaults.planner", planner)
        .with("obstacle", vec![disc; usize::from(PIECES)])
        .scenario("alloc")
        .unwrap();
    let instance = |slot| RobotInstance { index: RobotIndex(slot), incarnation: 0 };
    let address = Address::create().unwrap();
    let _lease = Lease::take(&address).unwrap();
    let sizes = Sizes { max_robots: 64, shape_pieces: scenario.shape_pieces() };
    let node = Node::new(&address, "test").unwrap();
    let _services = Services::create(&node, sizes).unwrap();
    let gate = Gate::create(&address, 64).unwrap();
    let mut world = WorldWriter::open(&node, sizes, 0).unwrap();
    let spec = codec::encode(&AgentSpec::new(&scenario, &scenario.robots[0], instance(0))).unwrap();
    #[expect(clippy::disallowed_methods, reason = "the daemon would leave the spec there")]
    std::fs::write(address.file(&shell::spec_file(instance(0))), spec).unwrap();
    let mut others: Vec<RobotWriter> = (1..=NEIGHBORS)
        .map(|slot| RobotWriter::create(&node, instance(slot), sizes, Poses::LastTwo).unwrap())
        .collect();

    let parent = std::os::unix::process::parent_id();
    let args = Args { root: address.root().to_path_buf(), instance: instance(0), parent };
    #[expect(clippy::disallowed_methods, reason = "the agent's process is a thread here")]
    let agent = std::thread::spawn(move || {
        // In the middle of every step: between two of them lies a whole tick.
        shell::run(&args, &mut planner_of, &mut |pose, _| {
            MADE_AT.store(std::ptr::from_mut(pose).addr(), SeqCst);
            CALLS.store(counting::calls(), SeqCst);
        })
    });
    let deadline_ns = clock::now_ns() + 30_000_000_000;
    while !gate.is_ready(instance(0)) {
        assert!(clock::now_ns() < deadline_ns && !agent.is_finished(), "the agent is not ready");
        gate.wait_call(Duration::from_millis(20));
    }

    let near: Vec<NeighborRef> = (1..=NEIGHBORS).map(|index| NeighborRef { index, incarnation: 0 }).collect();
    let pieces: Vec<u16> = (0..PIECES).collect();
    world.neighbors(RobotIndex(0), &near, &[]);
    world.sensed(RobotIndex(0), &pieces);
    let mut tick = |tick: u64| {
        let x_m = tick as f64 * 0.01;
        let piece = Piece { ax_m: x_m, bx_m: x_m, ay_m: 3.0, by_m: 3.0, radius_m: 0.2, ..Piece::default() };
        world.piece(3, |told| *told = piece);
        let odometry = Odometry { tick, stamp_ns: clock::now_ns(), x_m, goal_x_m: 9.0, ..Odometry::default() };
        world.odometry(RobotIndex(0), |told| *told = Odometry { flags: Odometry::FLAG_PRESENT, ..odometry });
        gate.open_tick(tick, 1, clock::now_ns());
        for (other, y_m) in others.iter_mut().zip(1..) {
            let flags = SharedPose::FLAG_SPOKEN;
            let stamp_ns = clock::now_ns();
            other.pose(|pose| *pose = SharedPose { tick, stamp_ns, y_m: y_m.into(), flags, ..SharedPose::default() });
        }
        while !gate.answered(instance(0), tick) {
            assert!(clock::now_ns() < deadline_ns && !agent.is_finished(), "the agent does not answer");
            gate.wait_answers(tick, Duration::from_millis(20));
        }
    };
    (0..100).for_each(&mut tick);
    let before = CALLS.load(SeqCst);
    assert_ne!(before, 0, "starting asks for memory, and it is counted");
    (100..500).for_each(&mut tick);
    let calls = CALLS.load(SeqCst) - before;
    let heard = gate.heard(instance(0));
    let shared = Shared::of(address.root());
    let cells: BTreeSet<usize> = (500..508)
        .map(|n| {
            tick(n);
            MADE_AT.load(SeqCst)
        })
        .collect();
    let in_place = cells.iter().all(|cell| shared.holds(*cell, size_of::<SharedPose>()));
    gate.stop();
    let ended = agent.join().unwrap();
    drop((world, others));
    clean::sweep(&address);
    ended.unwrap();
    assert_eq!(calls, 0, "{planner}");
    assert!(in_place && cells.len() == 4, "{planner}: two cells of two entries, {cells:x?}");
    assert_eq!(heard, NEIGHBORS as usize, "{planner}: it did hear its neighbours, of 64 places");
}
