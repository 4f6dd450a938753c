//! What is copied on the way of a message, counted: where it is made, how much of it is written, and what traces reading
//! it leaves in the memory of the reader. ARCHITECTURE.md says the same, in a table that is read here.
#![expect(clippy::disallowed_methods, reason = "tests look at files and at their own memory")]

#[path = "it/home.rs"]
#[expect(dead_code, reason = "no other process joins")]
mod home;

#[path = "../../tests/memory.rs"]
mod memory;

use home::Home;
use memory::{Shared, copies_of, stack_used};
use model::{MAX_ROBOTS, RobotIndex, RobotInstance};
use protocol::robot_to_robot::SharedPose;
use protocol::robot_to_world::Command;
use protocol::world_to_observer::FrameBody;
use protocol::world_to_robot::{Impairment, MAX_SENSED, NeighborList, NeighborRef, Odometry, Piece, SensedList};
use shoal_bus::{Node, Poses, RobotWriter, Services, Sizes, WorldReader, WorldWriter};
use std::collections::BTreeSet;

const SIZES: Sizes = Sizes { max_robots: 3, shape_pieces: 2 };
const INSTANCE: RobotInstance = RobotInstance { index: RobotIndex(1), incarnation: 0 };
const ROBOT: RobotIndex = INSTANCE.index;

struct Fleet {
    node: Node,
    _services: Services,
    home: Home,
}

impl Fleet {
    fn new() -> Fleet {
        let home = Home::new();
        let node = Node::new(&home.0, "test").unwrap();
        let services = Services::create(&node, SIZES).unwrap();
        Fleet { node, _services: services, home }
    }

    fn world(&self) -> WorldWriter {
        WorldWriter::open(&self.node, SIZES, 0).unwrap()
    }

    fn robot(&self, poses: Poses) -> RobotWriter {
        RobotWriter::create(&self.node, INSTANCE, SIZES, poses).unwrap()
    }

    fn shared(&self) -> Shared {
        Shared::of(self.home.0.root())
    }
}

/// Every message of the loop is made in memory that the fleet shares: in the cells of its entry, in turn.
#[test]
fn messages_are_made_where_their_readers_find_them() {
    fn check<T>(fleet: &Fleet, what: &str, cells: usize, mut tell: impl FnMut(&mut dyn FnMut(&mut T))) {
        let made_at: Vec<usize> = (0..12)
            .map(|_| {
                let mut made_at = 0;
                tell(&mut |value| made_at = std::ptr::from_mut(value).addr());
                made_at
            })
            .collect();
        let shared = fleet.shared();
        for address in &made_at {
            assert!(shared.holds(*address, size_of::<T>()), "{what} is made at {address:#x}, which is not shared");
        }
        let (first, later) = made_at.split_at(cells);
        assert_eq!(first.iter().collect::<BTreeSet<_>>().len(), cells, "{what}: {made_at:x?}");
        assert!(later.chunks(cells).all(|turn| turn == first), "{what}: {made_at:x?}");
    }
    for (poses, cells) in [(Poses::Newest, 2), (Poses::LastTwo, 4)] {
        let fleet = Fleet::new();
        let mut robot = fleet.robot(poses);
        check::<SharedPose>(&fleet, "a pose", cells, |fill| robot.pose(fill));
        check::<Command>(&fleet, "a command", 2, |fill| robot.command(fill));
    }
    let fleet = Fleet::new();
    let mut world = fleet.world();
    check::<Odometry>(&fleet, "odometry", 2, |fill| world.odometry(ROBOT, fill));
    check::<Piece>(&fleet, "a piece", 2, |fill| world.piece(4, fill));
}

/// A list is kilobytes. Of one that is short, no more is written than what counts.
#[test]
fn of_a_list_only_what_counts_is_written() {
    let fleet = Fleet::new();
    let mut world = fleet.world();
    let robots: Vec<NeighborRef> = (1..=MAX_ROBOTS as u32).map(|n| NeighborRef { index: n, incarnation: n }).collect();
    let pieces: Vec<u16> = (1..=MAX_SENSED as u16).collect();
    // Both cells of each.
    for _ in 0..2 {
        world.neighbors(ROBOT, &robots, &[]);
        world.sensed(ROBOT, &pieces);
    }
    let shared = fleet.shared();
    // Eight bytes for the counter of the entry, and eight before the first element.
    let robots = [NeighborRef { index: u32::MAX, incarnation: u32::MAX }; 16];
    let bytes = shared.changed_by(|| world.neighbors(ROBOT, &robots, &[]));
    assert!((16 * 8..=16 + 16 * 8).contains(&bytes), "{bytes} bytes for 16 neighbours");
    let bytes = shared.changed_by(|| world.sensed(ROBOT, &[u16::MAX; 20]));
    assert!((20 * 2..=16 + 20 * 2).contains(&bytes), "{bytes} bytes for 20 pieces");
}

/// What is read is copied out of its entry, whole; what the agent keeps of it is what counts.
#[test]
fn a_list_is_copied_out_once() {
    const MARKS: usize = 4;
    fn mark(n: usize) -> u64 {
        (n as u64 + 3).wrapping_mul(0x9e37_79b9_7f4a_7c15)
    }
    let fleet = Fleet::new();
    let (mut world, mut reader) = (fleet.world(), WorldReader::open(&fleet.node, ROBOT, 0).unwrap());
    let mut found = Vec::with_capacity(MAX_ROBOTS);
    // At the end of a full list: every copy of it has them.
    let mut robots = vec![NeighborRef::default(); MAX_ROBOTS];
    for (robot, n) in robots[MAX_ROBOTS - MARKS..].iter_mut().zip(0..) {
        *robot = NeighborRef { index: mark(n) as u32, incarnation: (mark(n) >> 32) as u32 };
    }
    let shared = fleet.shared();
    assert_eq!(copies_of(MARKS, mark, &shared).len(), 1, "what is looked for is found");
    world.neighbors(ROBOT, &robots, &[]);
    robots.fill(NeighborRef::default());
    assert_eq!(copies_of(MARKS, mark, &shared), [], "writing has copied it into the entry, and to no other place");
    world.odometry(ROBOT, |odometry| odometry.tick = 1);
    let stack = stack_used(&mut || {
        reader.odometry();
        assert!(reader.neighbors(&mut found, &mut Vec::new()));
    });
    let list = size_of::<NeighborList>();
    assert!((list..2 * list).contains(&stack), "{stack} bytes of the stack for a list of {list}");
    let kept_at = std::ptr::from_ref(&found[MAX_ROBOTS - MARKS]).addr();
    assert_eq!(copies_of(MARKS, mark, &shared), [kept_at]);
    std::hint::black_box(robots);
}

/// The sizes in the table of ARCHITECTURE.md are those of the messages, and no message of the loop is missing there.
#[test]
fn the_table_of_copies_has_the_sizes_of_the_messages() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../ARCHITECTURE.md");
    let text = std::fs::read_to_string(path).unwrap();
    let (_, section) = text.split_once("### What is copied\n").expect("a section");
    let section = section.split("\n#").next().unwrap();
    let found: Vec<(&str, usize)> = section
        .lines()
        .filter_map(|line| {
            let mut cells = line.strip_prefix("| `")?.split('|').map(str::trim);
            let (message, bytes) = (cells.next()?, cells.next()?);
            Some((message.split('`').next()?, bytes.parse().unwrap_or_else(|_| panic!("{line}: {bytes}"))))
        })
        .collect();
    let expected = [
        // What stands beside it in its entry: how often each list was written.
        ("Odometry", size_of::<Odometry>() + 8),
        ("NeighborList", size_of::<NeighborList>()),
        ("SensedList", size_of::<SensedList>()),
        ("Impairment", size_of::<Impairment>()),
        ("Piece", size_of::<Piece>()),
        ("SharedPose", size_of::<SharedPose>()),
        ("Command", size_of::<Command>()),
        ("FrameBody", size_of::<FrameBody>()),
    ];
    assert_eq!(found, expected);
    assert!(section.contains(&format!("{} bytes per neighbour", size_of::<NeighborRef>())));
}
