//! What a fleet takes: the computed need against what is really used, with every page touched. Large fleets on demand:
//! `cargo test --release -p shoal-bus --test it -- --ignored --nocapture scale`.
#![expect(clippy::disallowed_methods, reason = "tests look at clocks")]
#![expect(clippy::print_stdout, reason = "the figures are what this is for")]

use crate::home::Home;
use model::{Metric, RobotIndex, RobotInstance};
use protocol::world_to_daemon::Notice;
use protocol::world_to_observer::{FrameBody, FrameHeader};
use protocol::world_to_robot::{NeighborRef, Odometry, Piece};
use shoal_bus::{
    FramePublisher, FrameSubscriber, Gate, Node, NoticeSender, Poses, RobotReader, RobotWriter, Services, Sizes,
    StatsWriter, Strips, WorldReader, WorldWriter, clean,
};
use std::time::Instant;

fn check(max_robots: u32, shape_pieces: u32) {
    let sizes = Sizes { max_robots, shape_pieces };
    let home = Home::new();
    let mut times = Vec::new();
    let mut start = Instant::now();
    let mut lap = |what: &'static str| {
        times.push((what, start.elapsed()));
        start = Instant::now();
    };
    let used = |what: &str| println!("  {:>9} KiB after {what}", clean::usage(&home.0) / 1024);

    println!("{max_robots} robots, {shape_pieces} pieces: {} KiB needed", sizes.bytes_needed() / 1024);
    let daemon = Node::new(&home.0, "daemon").unwrap();
    lap("node");
    let _services = Services::create(&daemon, sizes).unwrap();
    lap("services");
    let _gate = Gate::create(&home.0, max_robots).unwrap();
    used("services and gate");
    let mut world = WorldWriter::open(&daemon, sizes, 0).unwrap();
    lap("world writer");

    let nodes: Vec<Node> = (0..max_robots).map(|_| Node::new(&home.0, "agent").unwrap()).collect();
    lap("agents' nodes");
    used("agents' nodes");
    let mut robots = Vec::new();
    for (slot, node) in nodes.iter().enumerate() {
        let instance = RobotInstance { index: RobotIndex::of(slot), incarnation: 0 };
        robots.push((
            WorldReader::open(node, instance.index, 0).unwrap(),
            RobotWriter::create(node, instance, sizes, Poses::LastTwo).unwrap(),
        ));
    }
    lap("agents' boards");
    used("agents' boards");
    let readers: Vec<_> = (0..max_robots)
        .map(|slot| RobotReader::open(&daemon, RobotInstance { index: RobotIndex(slot), incarnation: 0 }).unwrap())
        .collect();
    lap("world reads boards");
    // Everybody hears everybody: the worst that radio ranges can do.
    let mut heard = Vec::new();
    if max_robots <= 32 {
        for node in &nodes {
            heard.extend((0..max_robots).map(|slot| {
                RobotReader::open(node, RobotInstance { index: RobotIndex(slot), incarnation: 0 }).unwrap()
            }));
        }
    }
    lap("robots open all boards");
    used("robots opened all boards");
    let stats: Vec<_> = (0..max_robots + 2)
        .map(|i| {
            StatsWriter::create(&home.0, &format!("agent-{i}"), &Metric::ALL, Strips::of_agent(max_robots)).unwrap()
        })
        .collect();
    lap("statistics");
    used("statistics");

    // Touch everything: both cells of every entry, every frame, every byte of the rings.
    let neighbors: Vec<NeighborRef> = (0..max_robots).map(|index| NeighborRef { index, incarnation: 0 }).collect();
    for _ in 0..2 {
        for robot in (0..max_robots).map(RobotIndex) {
            world.odometry(robot, |odometry| *odometry = Odometry::default());
            world.neighbors(robot, &neighbors, &[]);
            world.sensed(robot, &[0]);
        }
        (0..sizes.pieces()).for_each(|index| world.piece(index, |piece| *piece = Piece::default()));
    }
    lap("world writes all twice");
    for (reader, _) in &mut robots {
        reader.odometry();
        assert!(reader.neighbors(&mut Vec::new(), &mut Vec::new()) && reader.sensed(&mut Vec::new()));
    }
    lap("robots read all");
    let mut frames = FramePublisher::open(&daemon, sizes.frame_bodies_max(), 0).unwrap();
    let mut observers: Vec<_> = (0..8).map(|i| FrameSubscriber::open(&nodes[i % nodes.len()], 0).unwrap()).collect();
    let bodies = vec![FrameBody::default(); sizes.pieces() as usize];
    for tick in 0..300 {
        assert_eq!(frames.publish(FrameHeader { tick, ..FrameHeader::default() }, &bodies), 8);
        observers[tick as usize % 8].take().unwrap();
    }
    lap("300 frames to 8");
    let mut notices = NoticeSender::open(&daemon).unwrap();
    while notices.flush() == 0 {
        notices.send(&Notice::Left { instance: RobotInstance { index: RobotIndex(0), incarnation: 0 } });
    }
    used("everything was touched");
    let used = clean::usage(&home.0);
    for (what, time) in times {
        println!("  {:>9.3} ms {what}", time.as_secs_f64() * 1e3);
    }
    assert!(used <= sizes.bytes_needed(), "{used} used, {} computed", sizes.bytes_needed());
    drop((readers, heard, stats));
}

#[test]
fn small_fleets_fit_in_what_was_computed() {
    check(1, 0);
    check(15, 8);
}

#[test]
fn middling_fleets_fit_in_what_was_computed() {
    check(32, 100);
    check(64, 100);
    check(256, 1024);
}

#[test]
fn the_largest_fleet_fits_in_what_was_computed() {
    check(1024, 1024);
}
