//! Every service, between two nodes as two processes have them, and several fleets at once.
#![expect(clippy::disallowed_methods, reason = "tests look at files and use threads")]

use crate::home::Home;
use model::{Event, EventKind, RobotIndex, RobotInstance, Task, TaskId};
use protocol::daemon_to_world::{Absence, Order};
use protocol::operator_to_daemon::{NewRobot, Reply, Request};
use protocol::robot_to_robot::{PosePair, SharedPose};
use protocol::robot_to_world::Command;
use protocol::world_to_daemon::Notice;
use protocol::world_to_observer::{FrameBody, FrameHeader};
use protocol::world_to_robot::{Impairment, NeighborRef, Odometry, Piece};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use shoal_bus::{
    FramePublisher, FrameSubscriber, Node, NoticeReceiver, NoticeSender, OperatorClient, OperatorServer, OrderReceiver,
    OrderSender, Poses, RobotReader, RobotWriter, Services, Sizes, WorldObserver, WorldReader, WorldWriter, clean,
};
use std::os::fd::AsFd;
use std::time::Duration;

const SIZES: Sizes = Sizes { max_robots: 6, shape_pieces: 3 };
const TIMEOUT: Duration = Duration::from_secs(10);

struct Fleet {
    daemon: Node,
    other: Node,
    _services: Services,
    _home: Home,
}

fn fleet() -> Fleet {
    let home = Home::new();
    let daemon = Node::new(&home.0, "daemon").unwrap();
    let services = Services::create(&daemon, SIZES).unwrap();
    let other = Node::new(&home.0, "other").unwrap();
    Fleet { daemon, other, _services: services, _home: home }
}

fn instance(slot: u32) -> RobotInstance {
    RobotInstance { index: RobotIndex(slot), incarnation: 0 }
}

/// Whom the robot hears, if the world wrote them again.
fn neighbors_of(robot: &mut WorldReader) -> Option<Vec<NeighborRef>> {
    let mut list = vec![NeighborRef { index: 77, incarnation: 7 }];
    robot.neighbors(&mut list, &mut Vec::new()).then_some(list)
}

/// Which pieces the robot sees, if the world wrote them again.
fn sensed_by(robot: &mut WorldReader) -> Option<Vec<u16>> {
    let mut list = vec![77];
    robot.sensed(&mut list).then_some(list)
}

fn is_readable(source: &impl AsFd) -> bool {
    poll(&mut [PollFd::new(source, PollFlags::IN)], Some(&Timespec { tv_sec: 0, tv_nsec: 0 })).unwrap() == 1
}

#[test]
fn a_robot_sees_what_the_world_writes() {
    let fleet = fleet();
    let mut world = WorldWriter::open(&fleet.daemon, SIZES, 0).unwrap();
    let mut robot = WorldReader::open(&fleet.other, RobotIndex(2), 0).unwrap();
    assert_eq!(robot.odometry(), Odometry::default());
    assert_eq!(neighbors_of(&mut robot), Some(vec![]), "the first look");
    assert_eq!(sensed_by(&mut robot), Some(vec![]), "the first look");
    assert_eq!(neighbors_of(&mut robot), None);
    assert_eq!(sensed_by(&mut robot), None);

    let odometry = Odometry { tick: 4, x_m: 1.5, ..Odometry::default() };
    world.odometry(RobotIndex(2), |told| *told = odometry);
    world.odometry(RobotIndex(1), |told| *told = Odometry { tick: 9, ..odometry });
    assert_eq!(robot.odometry(), odometry);
    assert_eq!(WorldObserver::open(&fleet.other, 0).unwrap().odometry(RobotIndex(1)).tick, 9);

    let neighbors = [NeighborRef { index: 0, incarnation: 2 }, NeighborRef { index: 5, incarnation: 0 }];
    world.neighbors(RobotIndex(2), &neighbors, &[]);
    world.neighbors(RobotIndex(3), &neighbors[..1], &[]);
    assert_eq!(neighbors_of(&mut robot), None, "the odometry has not told of it");
    let tell = |world: &mut WorldWriter, robot: &WorldReader| {
        world.odometry(RobotIndex(2), |told| *told = odometry);
        assert_eq!(robot.odometry(), odometry);
    };
    tell(&mut world, &robot);
    assert_eq!(neighbors_of(&mut robot), Some(neighbors.to_vec()));
    assert_eq!(neighbors_of(&mut robot), None, "it has not changed since");
    world.neighbors(RobotIndex(2), &[], &[]);
    tell(&mut world, &robot);
    assert_eq!(neighbors_of(&mut robot), Some(vec![]));

    assert_eq!(robot.impairment(), Impairment::default());
    let impairment = Impairment { drop: 0.25, noise_m: 0.5, delay_ticks: 3, slow_us: 1500 };
    world.impairment(RobotIndex(2), impairment);
    assert_eq!(neighbors_of(&mut robot), None, "the odometry has not told of it");
    tell(&mut world, &robot);
    assert_eq!((neighbors_of(&mut robot), robot.impairment()), (Some(vec![]), impairment));

    world.sensed(RobotIndex(2), &[1, 8]);
    tell(&mut world, &robot);
    assert_eq!(sensed_by(&mut robot), Some(vec![1, 8]));
    assert_eq!(sensed_by(&mut robot), None);

    for (index, ax_m) in [(8, 1.0), (8, 2.0), (0, 3.0)] {
        let piece = Piece { ax_m, obstacle: index, ..Piece::default() };
        world.piece(index, |told| *told = piece);
        assert_eq!(robot.piece(index as u16), piece);
        assert_eq!(robot.piece(index as u16), piece);
    }
    assert_eq!(robot.piece(9).radius_m, 0.0, "6 robots and 3 pieces make indices 0 to 8");
}

#[test]
fn there_is_one_world_and_no_slot_beyond_the_last() {
    let fleet = fleet();
    let _world = WorldWriter::open(&fleet.daemon, SIZES, 0).unwrap();
    let error = WorldWriter::open(&fleet.other, SIZES, 0).err().unwrap();
    assert!(error.to_string().starts_with("board `world`"), "{error}");
    let error = WorldReader::open(&fleet.other, RobotIndex(6), 0).err().unwrap();
    assert!(error.is_missing() && error.hint().is_some(), "{error}");
}

#[test]
fn robots_hear_each_other_and_lives_are_kept_apart() {
    let fleet = fleet();
    let mut first = RobotWriter::create(&fleet.other, instance(4), SIZES, Poses::LastTwo).unwrap();
    let mut reader = RobotReader::open(&fleet.daemon, instance(4)).unwrap();
    let mut pair = PosePair::default();
    for tick in 1..=3 {
        pair.push(SharedPose { tick, flags: SharedPose::FLAG_SPOKEN, ..SharedPose::default() });
        first.pose(|pose| *pose = pair.newest);
        first.command(|command| *command = Command { tick, ..Command::default() });
        assert_eq!(
            (reader.pose(), reader.pose_before(tick), reader.command().tick),
            (pair.newest, pair.previous, tick)
        );
    }

    let next = RobotInstance { incarnation: 1, ..instance(4) };
    assert!(RobotReader::open(&fleet.daemon, next).err().unwrap().is_missing());
    assert!(RobotWriter::create(&fleet.daemon, instance(4), SIZES, Poses::LastTwo).is_err());
    let _second = RobotWriter::create(&fleet.other, next, SIZES, Poses::LastTwo).unwrap();
    assert_eq!(RobotReader::open(&fleet.daemon, next).unwrap().pose(), SharedPose::default());
    drop(first);
    assert_eq!(
        (reader.pose(), reader.pose_before(3)),
        (pair.newest, pair.previous),
        "what a robot said stays readable"
    );
}

#[test]
fn orders_arrive_in_order_however_many_there_are() {
    let fleet = fleet();
    let mut sender = OrderSender::open(&fleet.daemon).unwrap();
    let mut receiver = OrderReceiver::open(&fleet.other).unwrap();
    assert_eq!(receiver.take(), None);
    let order =
        |task| Order::Task { id: TaskId(task), index: RobotIndex(task % 6), task: Task::to([f64::from(task), 0.5]) };
    let count = 40_000;
    (0..count).for_each(|task| sender.send(&order(task)).unwrap());
    let waiting = sender.flush();
    assert!(waiting > 0, "this is more than the ring holds");
    let fact = Order::Absent { instance: instance(2), cause: Absence::Stopped };
    (0..100).for_each(|_| sender.send(&fact).unwrap());
    assert_eq!(sender.flush(), waiting + 1, "a fact that comes again and again waits once");
    for task in 0..count {
        let found = receiver.take().or_else(|| {
            sender.flush();
            receiver.take()
        });
        assert_eq!(found, Some(order(task)));
    }
    assert_eq!((receiver.take(), sender.flush()), (Some(fact), 0));
    assert_eq!(receiver.take(), None);
    sender.send(&Order::Absent { instance: instance(1), cause: Absence::Overdue }).unwrap();
    // A daemon that takes over goes on where the other one stopped.
    OrderSender::open(&fleet.other).unwrap().send(&Order::Stop).unwrap();
    assert!(matches!(receiver.take(), Some(Order::Absent { .. })));
    assert_eq!(receiver.take(), Some(Order::Stop));
}

#[test]
fn notices_wake_the_daemon_once_per_batch() {
    let fleet = fleet();
    let mut receiver = NoticeReceiver::open(&fleet.daemon).unwrap();
    let mut sender = NoticeSender::open(&fleet.other).unwrap();
    for round in 0..3 {
        assert!(receiver.take().is_none() && !is_readable(&receiver), "round {round}");
        for tick in 0..5 {
            sender.send(&Notice::Expect { instance: instance(1), tick });
        }
        assert!(is_readable(&receiver));
        for tick in 0..5 {
            assert_eq!(receiver.take(), Some(Notice::Expect { instance: instance(1), tick }));
        }
        // One that comes after the last was taken is found, or rings.
        sender.send(&Notice::Left { instance: instance(2) });
        assert_eq!(receiver.take(), Some(Notice::Left { instance: instance(2) }));
    }
}

#[test]
fn notices_outlast_a_daemon_that_does_not_read() {
    let fleet = fleet();
    let mut sender = NoticeSender::open(&fleet.other).unwrap();
    let log =
        |tick| Notice::Log(Event { tick, robot: Some(RobotIndex(1)), kind: EventKind::Deaf { why: "x".repeat(90) } });
    for tick in 0..8192 {
        sender.send(&log(tick));
    }
    assert_eq!(sender.left_out(), 0, "8192 messages of some 110 bytes have room");
    for tick in 8192..20_000 {
        sender.send(&log(tick));
    }
    let lost = sender.left_out();
    assert!(lost > 0, "then entries of the log are dropped");
    for tick in 0..1000 {
        sender.send(&Notice::Kill { instance: RobotInstance { index: RobotIndex(0), incarnation: tick } });
    }
    assert!(sender.flush() > 0 && sender.left_out() == lost, "and everything else waits");

    let mut receiver = NoticeReceiver::open(&fleet.daemon).unwrap();
    assert!(is_readable(&receiver), "it was rung before anybody listened");
    let (mut logged, mut killed) = (0, 0);
    loop {
        while let Some(notice) = receiver.take() {
            match notice {
                Notice::Log(event) => {
                    assert_eq!((event.tick, killed), (logged, 0), "in order");
                    logged += 1;
                }
                Notice::Kill { instance } => {
                    assert_eq!(instance.incarnation, killed);
                    killed += 1;
                }
                other => panic!("{other:?}"),
            }
        }
        sender.flush();
        if !is_readable(&receiver) {
            break;
        }
    }
    assert_eq!((logged + lost, killed, receiver.left_out()), (20_000, 1000, lost));
}

#[test]
fn operators_are_answered_each_with_its_own() {
    let fleet = fleet();
    let mut server = OperatorServer::open(fleet.daemon.address()).unwrap();
    let address = fleet.daemon.address();
    let robots = |count: u32| -> Reply { Reply::Removed { robot: format!("robot-{count}") } };
    std::thread::scope(|scope| {
        for operator in 0..4_u32 {
            scope.spawn(move || {
                let client = OperatorClient::new(address);
                for i in 0..50 {
                    let number = operator * 100 + i;
                    let request = Request::Add(NewRobot { start_m: [f64::from(number), 0.0], ..NewRobot::default() });
                    assert_eq!(client.ask(&request, TIMEOUT), Ok(robots(number)));
                }
            });
        }
        let mut served = 0;
        while served < 4 * 50 {
            poll(&mut [PollFd::new(&server, PollFlags::IN)], Some(&Timespec { tv_sec: 10, tv_nsec: 0 })).unwrap();
            while let Some((request, responder)) = server.take() {
                let Request::Add(robot) = request else { panic!("{request:?}") };
                assert!(responder.is_awaited());
                responder.reply(&robots(robot.start_m[0] as u32));
                served += 1;
            }
        }
    });
    assert!(server.take().is_none() && !is_readable(&server));
}

#[test]
fn an_operator_that_nobody_answers_is_told_so() {
    let fleet = fleet();
    let client = OperatorClient::new(fleet.other.address());
    let error = client.ask(&Request::Status, TIMEOUT).unwrap_err();
    assert!(error.to_string().contains("nothing answers") && error.hint().is_some(), "{error}");

    let mut server = OperatorServer::open(fleet.daemon.address()).unwrap();
    let client = OperatorClient::new(fleet.other.address());
    let error = client.ask(&Request::Status, Duration::from_millis(50)).unwrap_err();
    assert!(error.to_string().contains("no answer within 0.05 s"), "{error}");
    // The request of one who gave up may still be there, or not; a reply to it harms nobody.
    while let Some((_, responder)) = server.take() {
        responder.reply(&Reply::Refused { problem: "0".to_owned(), hint: None });
    }
    let error = client.ask(&Request::Status, Duration::from_millis(50)).unwrap_err();
    assert!(error.to_string().contains("no answer"), "{error}");
}

#[test]
fn a_reply_that_is_too_large_becomes_a_refusal() {
    let fleet = fleet();
    let mut server = OperatorServer::open(fleet.daemon.address()).unwrap();
    let address = fleet.daemon.address();
    std::thread::scope(|scope| {
        let operator = scope.spawn(|| OperatorClient::new(address).ask(&Request::Status, TIMEOUT));
        let responder = loop {
            poll(&mut [PollFd::new(&server, PollFlags::IN)], Some(&Timespec { tv_sec: 10, tv_nsec: 0 })).unwrap();
            if let Some((_, responder)) = server.take() {
                break responder;
            }
        };
        responder.reply(&Reply::Refused { problem: "x".repeat(5 << 20), hint: None });
        assert!(matches!(operator.join().unwrap(), Ok(Reply::Refused { problem, .. }) if problem.len() < 100));
    });
}

#[test]
fn frames_go_to_those_who_watch() {
    let fleet = fleet();
    let mut world = FramePublisher::open(&fleet.daemon, SIZES.frame_bodies_max(), 0).unwrap();
    let bodies: Vec<FrameBody> = (0..9).map(|index| FrameBody { index, ..FrameBody::default() }).collect();
    let frame = |tick| FrameHeader { tick, ..FrameHeader::default() };
    assert!(!world.is_watched() && world.publish(frame(1), &bodies) == 0);

    let mut observer = FrameSubscriber::open(&fleet.other, 0).unwrap();
    assert!(world.is_watched());
    assert_eq!((world.publish(frame(2), &bodies), world.publish(frame(3), &bodies[..2])), (1, 1));
    assert_eq!(observer.take().unwrap(), Some((frame(2), bodies.clone())));
    assert_eq!(observer.take().unwrap(), Some((frame(3), bodies[..2].to_vec())));
    assert_eq!(observer.take().unwrap(), None);

    // Who is slow misses the oldest; the world does not wait. All eight places at once, and no frame is refused.
    let mut others: Vec<_> = (0..7).map(|_| FrameSubscriber::open(&fleet.other, 0).unwrap()).collect();
    for tick in 4..300 {
        assert_eq!(world.publish(frame(tick), &bodies), 8);
        others[0].take().unwrap();
    }
    for subscriber in [&mut observer, &mut others[3]] {
        let ticks: Vec<u64> =
            std::iter::from_fn(|| subscriber.take().unwrap()).map(|(header, _)| header.tick).collect();
        assert_eq!(ticks, (236..300).collect::<Vec<_>>());
    }
    assert!(FrameSubscriber::open(&fleet.other, 0).is_err());
    drop((observer, others));
    assert!(!world.is_watched());
}

#[test]
fn fleets_at_once_do_not_meet() {
    let fleets = [fleet(), fleet(), fleet()];
    let mut ends: Vec<_> = fleets
        .iter()
        .map(|fleet| {
            let robot = RobotWriter::create(&fleet.other, instance(0), SIZES, Poses::LastTwo).unwrap();
            (OrderSender::open(&fleet.daemon).unwrap(), WorldWriter::open(&fleet.daemon, SIZES, 0).unwrap(), robot)
        })
        .collect();
    for (i, (orders, world, robot)) in ends.iter_mut().enumerate() {
        orders.send(&Order::Remove { index: RobotIndex::of(i) }).unwrap();
        world.odometry(RobotIndex(0), |odometry| odometry.tick = i as u64);
        robot.command(|command| command.tick = i as u64);
    }
    for (i, fleet) in fleets.iter().enumerate() {
        let mut orders = OrderReceiver::open(&fleet.other).unwrap();
        assert_eq!((orders.take(), orders.take()), (Some(Order::Remove { index: RobotIndex::of(i) }), None));
        assert_eq!(WorldReader::open(&fleet.other, RobotIndex(0), 0).unwrap().odometry().tick, i as u64);
        assert_eq!(RobotReader::open(&fleet.daemon, instance(0)).unwrap().command().tick, i as u64);
    }
    // One ends, and is swept; the others do not notice.
    let [first, second, _third] = fleets;
    let address = first.daemon.address().clone();
    drop(first);
    assert_eq!(clean::usage(&address), 0);
    assert!(WorldReader::open(&second.other, RobotIndex(1), 0).is_ok());
    assert!(clean::list_fleets().unwrap().iter().any(|entry| &entry.address == second.daemon.address()));
}

/// Other users of the machine can neither open what a fleet shares nor occupy a name before it is used: there is one
/// entry in `/dev/shm`, and only its owner may enter it.
#[test]
fn everything_that_a_fleet_shares_is_in_one_directory_of_its_owner() {
    use std::os::unix::fs::MetadataExt;
    let fleet = fleet();
    let _robot = RobotWriter::create(&fleet.other, instance(0), SIZES, Poses::LastTwo).unwrap();
    let mut frames = FramePublisher::open(&fleet.daemon, SIZES.frame_bodies_max(), 0).unwrap();
    let _observer = FrameSubscriber::open(&fleet.other, 0).unwrap();
    frames.publish(FrameHeader::default(), &[]);
    let id = fleet.daemon.address().id();
    let entries = std::fs::read_dir("/dev/shm").unwrap().map(|entry| entry.unwrap());
    let ours: Vec<_> = entries.filter(|entry| entry.file_name().to_string_lossy().contains(id)).collect();
    assert_eq!(ours.len(), 1, "{ours:?}");
    let meta = ours[0].metadata().unwrap();
    assert_eq!((meta.is_dir(), meta.mode() & 0o777), (true, 0o700));
}

/// A process that is killed between creating an object and giving it a size leaves it empty. Nothing waits for it.
#[test]
fn an_object_whose_maker_died_half_way_is_given_up() {
    let fleet = fleet();
    let _robot = RobotWriter::create(&fleet.other, instance(0), SIZES, Poses::LastTwo).unwrap();
    let root = fleet.daemon.address().root().to_path_buf();
    let files = std::fs::read_dir(&root).unwrap().map(|entry| entry.unwrap().path());
    let objects: Vec<_> = files.filter(|path| path.to_string_lossy().contains("/iox2.")).collect();
    assert!(objects.len() > 3, "{objects:?}");
    for object in &objects {
        std::fs::remove_file(object).unwrap();
        std::fs::write(object, "").unwrap();
    }
    let (done, opened) = std::sync::mpsc::channel();
    let address = fleet.daemon.address().clone();
    std::thread::spawn(move || {
        let node = Node::new(&address, "late").map(|node| RobotReader::open(&node, instance(0)).map(drop));
        let _ = done.send(matches!(node, Err(_) | Ok(Err(_))));
    });
    assert_eq!(opened.recv_timeout(TIMEOUT), Ok(true));
}
