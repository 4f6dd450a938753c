//! What only real processes can show: futexes and histograms across address spaces, SIGKILL, and what is left behind.
#![expect(clippy::disallowed_methods, reason = "tests look at files and clocks")]

use crate::home::{Home, home_of_child};
use model::{Metric, RobotIndex, RobotInstance};
use protocol::operator_to_daemon::{Reply, Request};
use protocol::robot_to_world::Command;
use protocol::world_to_robot::Odometry;
use shoal_bus::{
    Counter, FrameSubscriber, Gate, Node, OperatorClient, OperatorServer, Poses, RobotReader, RobotWriter, Services,
    Sizes, StatsWriter, Strips, TickWait, WorldReader, WorldWriter, clean, clock, stats,
};
use std::time::{Duration, Instant};

const SIZES: Sizes = Sizes { max_robots: 6, shape_pieces: 2 };
const TIMEOUT: Duration = Duration::from_secs(20);

fn instance(slot: u32, incarnation: u32) -> RobotInstance {
    RobotInstance { index: RobotIndex(slot), incarnation }
}

fn wait_until(what: &str, mut condition: impl FnMut() -> bool) {
    let deadline = Instant::now() + TIMEOUT;
    while !condition() {
        assert!(Instant::now() < deadline, "{what} within {TIMEOUT:?}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Files and objects of a fleet that exist.
fn left_of(home: &Home) -> Vec<String> {
    let all = std::fs::read_dir("/dev/shm").unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    all.filter(|name| name.contains(home.0.id())).collect()
}

/// A child: finds a free slot, then answers every tick with a command that says which tick.
#[test]
fn role_agent() {
    let Some(address) = home_of_child() else { return };
    let gate = Gate::open(&address).unwrap();
    let node = Node::new(&address, "agent").unwrap();
    // The first slot whose board does not exist is ours.
    let claim = |instance| Some((instance, RobotWriter::create(&node, instance, SIZES, Poses::LastTwo).ok()?));
    let (instance, mut robot) = (0..3).map(|slot| instance(slot, 0)).find_map(claim).unwrap();
    let world = WorldReader::open(&node, instance.index, 0).unwrap();
    let mut stats = StatsWriter::create(
        &address,
        &format!("{}-{}", instance.index, instance.incarnation),
        &[Metric::Wake],
        Strips::NONE,
    )
    .unwrap();
    gate.announce_ready(instance);
    let mut last = None;
    loop {
        match gate.wait_tick(last, TIMEOUT) {
            TickWait::Open { tick, stamp_ns } => {
                last = Some(tick);
                stats.record(Metric::Wake, clock::now_ns() - stamp_ns);
                stats.add(Counter::Periods, 1);
                let odometry = world.odometry();
                assert_eq!(odometry.tick, tick);
                let (incarnation, first) = (instance.incarnation, odometry.x_m);
                robot.command(|command| *command = Command { tick, incarnation, first, ..Command::default() });
                gate.answer(instance, tick);
            }
            TickWait::Stopped => return,
            TickWait::TimedOut => panic!("no tick after {last:?}"),
        }
    }
}

#[test]
fn a_fleet_of_processes_survives_a_kill() {
    const TICKS: u64 = 600;
    const KILL_AT: u64 = 200;
    let home = Home::new();
    let daemon = Node::new(&home.0, "daemon").unwrap();
    let services = Services::create(&daemon, SIZES).unwrap();
    let gate = Gate::create(&home.0, SIZES.max_robots).unwrap();
    let mut world = WorldWriter::open(&daemon, SIZES, 0).unwrap();
    let mut agents: Vec<_> = (0..3).map(|_| home.spawn("role_agent")).collect();
    // Which process has which instance does not matter.
    let mut alive: Vec<RobotInstance> = (0..3).map(|slot| instance(slot, 0)).collect();
    wait_until("three agents are ready", || alive.iter().all(|&instance| gate.is_ready(instance)));
    let boards: Vec<_> = alive.iter().map(|&instance| RobotReader::open(&daemon, instance).unwrap()).collect();

    for tick in 0..TICKS {
        for slot in 0..4 {
            let new = Odometry { tick, x_m: tick as f64 * 0.5, ..Odometry::default() };
            world.odometry(RobotIndex(slot), |odometry| *odometry = new);
        }
        if tick == KILL_AT {
            agents[0].kill();
        }
        gate.open_tick(tick, alive.len() as u32, clock::now_ns());
        let start = Instant::now();
        loop {
            gate.wait_answers(tick, Duration::from_millis(100));
            if alive.iter().all(|&instance| gate.answered(instance, tick)) {
                break;
            }
            if tick == KILL_AT && alive.len() == 3 {
                // Which one the killed process was: the one that does not answer.
                if start.elapsed() > Duration::from_millis(300) {
                    alive.retain(|&instance| gate.answered(instance, tick));
                    assert_eq!(alive.len(), 2);
                }
            }
            assert!(start.elapsed() < TIMEOUT, "tick {tick}");
        }
        let answered =
            boards.iter().map(RobotReader::command).filter(|c| c.tick == tick && c.first == tick as f64 * 0.5);
        assert_eq!(answered.count(), alive.len());
    }
    gate.stop();
    for agent in &mut agents[1..] {
        assert!(agent.0.wait().unwrap().success());
    }
    // Nothing that the killed process counted is lost.
    let mut counts: Vec<u64> =
        stats::read_all(&home.0).unwrap().iter().map(|(_, snapshot)| snapshot.counter(Counter::Periods)).collect();
    counts.sort_unstable();
    assert_eq!(counts[1..], [TICKS, TICKS]);
    assert!(counts[0] == KILL_AT || counts[0] == KILL_AT + 1, "{counts:?}");

    wait_until("the janitor clears it", || daemon.clear_dead() == 1);
    assert_eq!(daemon.clear_dead(), 0);
    assert!(clean::usage(&home.0) > 0);
    drop((world, gate, services, boards, daemon));
    let report = clean::sweep(&home.0);
    assert!(report.root && report.left.is_empty());
    assert_eq!(left_of(&home), Vec::<String>::new());
}

/// A child: joins in every way, and stays until it is killed.
#[test]
fn role_idler() {
    let Some(address) = home_of_child() else { return };
    let node = Node::new(&address, "idler").unwrap();
    let _world = WorldReader::open(&node, RobotIndex(0), 0).unwrap();
    let _robot = RobotWriter::create(&node, instance(5, std::process::id()), SIZES, Poses::Newest).unwrap();
    let _frames = FrameSubscriber::open(&node, 0).unwrap();
    Gate::open(&address).unwrap().announce_ready(instance(5, 0));
    std::thread::sleep(TIMEOUT);
}

#[test]
fn places_of_killed_processes_are_cleared() {
    let home = Home::new();
    let daemon = Node::new(&home.0, "daemon").unwrap();
    let _services = Services::create(&daemon, SIZES).unwrap();
    let gate = Gate::create(&home.0, SIZES.max_robots).unwrap();
    // Observers have eight places, so without the janitor the ninth would fail.
    for round in 0..10 {
        gate.wait_call(Duration::ZERO);
        let mut idler = home.spawn("role_idler");
        gate.wait_call(TIMEOUT);
        assert!(idler.0.try_wait().unwrap().is_none(), "round {round}");
        idler.kill();
        wait_until("the janitor clears it", || daemon.clear_dead() == 1);
    }
}

/// A child: a command of an operator, killed while it waits.
#[test]
fn role_operator() {
    let Some(address) = home_of_child() else { return };
    OperatorClient::new(&address).ask(&Request::Status, TIMEOUT).unwrap();
}

#[test]
fn killed_operators_do_not_use_up_the_places() {
    let home = Home::new();
    let mut server = OperatorServer::open(&home.0).unwrap();
    for _ in 0..20 {
        let mut operator = home.spawn("role_operator");
        let mut asked = None;
        wait_until("the operator asks", || {
            asked = server.take();
            asked.is_some()
        });
        operator.kill();
        asked.unwrap().1.reply(&Reply::Refused { problem: "1".to_owned(), hint: None });
    }
    // A twenty-first finds a place, and an answer.
    let mut operator = home.spawn("role_operator");
    wait_until("the last operator is served", || {
        while let Some((_, responder)) = server.take() {
            responder.reply(&Reply::Refused { problem: "1".to_owned(), hint: None });
        }
        operator.0.try_wait().unwrap().is_some()
    });
    assert!(operator.0.wait().unwrap().success());
}

#[test]
fn an_abandoned_fleet_is_found_ended_and_removed() {
    let mut home = Home::new();
    let lease = home.1.take();
    let daemon = Node::new(&home.0, "daemon").unwrap();
    let services = Services::create(&daemon, SIZES).unwrap();
    // Something of the fleet that still runs: it has its mark. It forks nobody who would look the same for a moment, and
    // waits for a line that never comes. Beside it, something that only names the root.
    let mut orphan = crate::home::Process(
        std::process::Command::new("sh")
            .args(["-c", "read -r line"])
            .env(clean::MARK, home.0.root())
            .stdin(std::process::Stdio::piped())
            .spawn()
            .unwrap(),
    );
    let mut bystander =
        crate::home::Process(std::process::Command::new("tail").arg("-f").arg(home.0.file("sizes")).spawn().unwrap());
    let _silence = orphan.0.stdin.take();
    let entry = || clean::list_fleets().unwrap().into_iter().find(|entry| entry.address == home.0);
    wait_until("the orphan shows", || entry().unwrap().processes == [orphan.0.id()]);
    assert!(!entry().unwrap().abandoned);
    assert_eq!(clean::clean_if_abandoned(&home.0).unwrap(), None);
    assert!(home.0.root().is_dir());

    // As after a SIGKILL: the lease goes, what iceoryx2 made stays.
    std::mem::forget((services, daemon));
    drop(lease);
    // Whoever looks at a lease holds it for a moment, and any shoal command on this machine may look, or clean, first.
    wait_until("it is abandoned, or gone", || entry().is_none_or(|entry| entry.abandoned));
    let reaper = std::thread::spawn(move || orphan.0.wait().map(|status| (status.success(), orphan)));
    if let Some(report) = clean::clean_if_abandoned(&home.0).unwrap() {
        assert!(report.root && report.files > 0 && report.bytes > 0 && report.left.is_empty(), "{report:?}");
        assert_eq!(report.killed, 1);
    }
    assert!(!reaper.join().unwrap().unwrap().0);
    assert!(bystander.0.try_wait().unwrap().is_none());
    wait_until("nothing is left", || left_of(&home).is_empty());
    assert_eq!(entry(), None);
}

/// A file without a size is removed once no process has it open: its maker keeps it open until it has a size.
#[test]
fn what_is_half_made_is_removed_once_its_maker_is_gone() {
    let home = Home::new();
    let place = |name: &str| home.0.root().join(name);
    std::fs::write(place("whole"), "x").unwrap();
    std::fs::write(place("empty"), "").unwrap();
    let held = std::fs::File::create(place("being-made")).unwrap();
    assert_eq!(clean::unfinished(&home.0), 1);
    assert!(!place("empty").exists() && place("whole").exists() && place("being-made").exists());
    drop(held);
    assert_eq!(clean::unfinished(&home.0), 1);
    assert!(!place("being-made").exists());
}
