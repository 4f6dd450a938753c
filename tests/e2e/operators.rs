//! A second terminal: `ps`, `add` and `task send` while the fleet runs.

use crate::support::{PrivateShm, Run, assert_clean, is_gone, lanes, run, shoal, signal, stop, wait_for};
use bus::{Node, OrderSender};
use model::{RobotIndex, RobotInstance};
use protocol::daemon_to_world::{Absence, Order};
use protocol::operator_to_daemon::PROTOCOL_VERSION;
use record::Record;
use rustix::process::Signal;
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::Duration;
use tempfile::TempDir;

#[test]
fn operators_see_a_fleet_add_to_it_and_send_it_on() {
    let scenario = format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(2, 1.0));
    let run = Run::scenario(&scenario).mode("realtime").set("world.y_m=[-4, 8]").set("fleet.max_robots=3");
    let mut fleet = run.set("fleet.command_timeout_s=30").start();
    let (root, id) = (fleet.root(), fleet.id());
    fleet.wait_tick(1);
    let ask = |args: &[&str]| shoal(&[args, &["--fleet", &id]].concat());
    let json = |args: &[&str]| ask(&[args, &["--format", "json"]].concat()).expect(0).report;
    let robots = || json(&["ps"])["fleets"][0]["robots"].as_array().unwrap().clone();
    let robot = |id: &str| robots().into_iter().find(|robot| robot["id"] == id).unwrap_or(Value::Null);

    // What runs.
    let ps = json(&["ps"]);
    assert_eq!((&ps["schema"], &ps["fleets"][0]["fleet"]), (&"shoal.ps/1".into(), &id.as_str().into()), "{ps:#}");
    assert_eq!(ps["fleets"][0]["daemon_pid"], fleet.daemon(), "{ps:#}");
    assert_eq!(ps["fleets"][0]["world_pid"], fleet.process("world"), "{ps:#}");
    for slot in 0..2 {
        assert_eq!(robots()[slot as usize]["pid"], fleet.agent(slot), "{ps:#}");
    }
    wait_for("a to arrive", || (robot("a")["arrived"] == true).then_some(()));
    assert!(ask(&["ps"]).expect(0).stdout.contains("arrived"));

    // What cannot be.
    let add = |id: &str, start: &str, goal: &str| ask(&["add", "--id", id, "--start", start, "--goal", goal]);
    add("a", "0,-2", "1,-2").expect_failure(2, &["the id `a` is taken"]);
    add("c", "1,0", "1,-2").expect_failure(2, &["start: robot `a` is in the way", "choose another start"]);
    add("c", "99,0", "1,-2").expect_failure(2, &["world"]);
    ask(&["add", "--start", "0,-2", "--goal", "1,-2", "--planner", "strait"])
        .expect_failure(2, &["strait", "straight"]);
    ask(&["task", "send", "nobody", "0,0"]).expect_failure(2, &["unknown robot `nobody`", "a, b"]);
    ask(&["task", "send", "a", "0,99"]).expect_failure(2, &["goal"]);
    shoal(&["ps", "--fleet", "nowhere"]).expect_failure(2, &["`nowhere`", &id]);

    // One more robot.
    let added = json(&["add", "--id", "c", "--start", "0,-2", "--goal", "1,-2"]);
    assert_eq!((&added["robot"], &added["slot"]), (&"c".into(), &2.into()), "{added:#}");
    assert!(added["joined_ms"].as_f64().is_some_and(|ms| ms > 1.0), "{added:#}");
    // It takes part, and hears the others, who hear it, when the command returns.
    let gate = fleet.gate();
    let hears = |slot, incarnation| gate.heard(RobotInstance { index: RobotIndex(slot), incarnation });
    assert_eq!((&added["neighbors"], hears(2, 0), hears(0, 0), hears(1, 0)), (&2.into(), 2, 2, 2), "{added:#}");
    let pid = fleet.agent(2);
    assert_eq!(robot("c")["pid"], pid);
    wait_for("c to arrive", || (robot("c")["arrived"] == true).then_some(()));
    add("d", "0,-3", "1,-3").expect_failure(2, &["the fleet is full: 3 robots", "fleet.max_robots"]);

    // Something to do, for a robot of the scenario and for the new one.
    json(&["task", "send", "a", "0,0"]);
    let task = json(&["task", "send", "c", "0,-2", "--now"]);
    assert_eq!((&task["robot"], &task["goal_m"]), (&"c".into(), &serde_json::json!([0.0, -2.0])), "{task:#}");
    for id in ["a", "c"] {
        wait_for("the task to be done", || (robot(id)["goals_done"] == 2).then_some(()));
    }

    // A new process takes over, also from one that is dead for good; the others go on.
    let before = [fleet.agent(0), fleet.agent(2)];
    let restarted = json(&["restart", "c"]);
    assert_eq!((&restarted["incarnation"], &restarted["neighbors"]), (&1.into(), &2.into()), "{restarted:#}");
    assert!(is_gone(before[1]) && fleet.agent(0) == before[0]);
    assert_eq!(robot("c")["restarts"], 1);
    signal(robot("c")["pid"].as_u64().unwrap() as u32, Signal::KILL);
    wait_for("c to be dead", || (robot("c")["state"] == "dead").then_some(()));
    let restarted = json(&["restart", "c"]);
    assert_eq!((&restarted["incarnation"], hears(0, 0)), (&2.into(), 2), "{restarted:#}");
    let pid = robot("c")["pid"].as_u64().unwrap() as u32;
    ask(&["restart", "nobody"]).expect_failure(2, &["unknown robot `nobody`"]);

    // It leaves, and its process ends by itself; then there is room for another one of its name.
    ask(&["remove", "nobody"]).expect_failure(2, &["unknown robot `nobody`"]);
    assert_eq!(json(&["remove", "c"])["robot"], "c");
    assert_eq!(robot("c")["state"], "left");
    ask(&["remove", "c"]).expect_failure(2, &["robot `c` has left already"]);
    ask(&["restart", "c"]).expect_failure(2, &["robot `c` has left", "add --id"]);
    ask(&["task", "send", "c", "0,-2"]).expect_failure(2, &["robot `c` has left"]);
    wait_for("the process of c to end", || is_gone(pid).then_some(()));
    add("d", "0,-3", "1,-3").expect_failure(2, &["names of robots that have left can be used again: c"]);
    let again = json(&["add", "--id", "c", "--start", "0,-3", "--goal", "1,-3"]);
    assert_eq!((&again["robot"], &again["slot"]), (&"c".into(), &2.into()), "{again:#}");
    wait_for("c to arrive again", || (robot("c")["arrived"] == true).then_some(()));
    assert_eq!((&robot("c")["incarnation"], &robot("c")["restarts"]), (&3.into(), &0.into()));
    let pid = robot("c")["pid"].clone();
    json(&["task", "send", "c", "0,-3"]);
    wait_for("its task to be done", || (robot("c")["goals_done"] == 2).then_some(()));

    signal(fleet.daemon(), Signal::INT);
    let ended = fleet.wait().expect(130);
    assert_eq!(ended.report["robots"], 3, "{ended}");
    assert_eq!((ended.robot("a")["tasks_done"].as_u64(), ended.robot("c")["tasks_done"].as_u64()), (Some(1), Some(1)));
    assert!(ended.arrived("c") && ended.robot("c")["pid"] == pid, "{ended}");
    assert_eq!(ended.robot("c")["incarnation"], 3, "{ended}");
    ended.event("left", "c");
    ended.event("joined", "c");
    ended.event("task", "a");
    assert_clean(&root);
}

/// From the command line by way of the daemon, the world and the agent to the body.
#[test]
fn a_heading_that_is_sent_with_a_goal_is_the_heading_there() {
    let scenario = format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(1, 1.0));
    let directory = TempDir::with_prefix("shoal-e2e-").unwrap();
    let record = directory.path().join("headings.mcap");
    let run = Run::scenario(&scenario).mode("realtime").set("world.y_m=[-4, 8]").set("fleet.command_timeout_s=30");
    let mut fleet = run.set("defaults.kind=\"unicycle\"").arg("--record").arg(&record).start();
    let (root, id) = (fleet.root(), fleet.id());
    fleet.wait_tick(1);
    let json = |args: &[&str]| shoal(&[args, &["--fleet", &id, "--format", "json"]].concat()).expect(0).report;

    json(&["add", "--id", "new", "--start", "0,-2", "--yaw", "1", "--goal", "1,-2,-2.5"]);
    let task = json(&["task", "send", "a", "0,0,2"]);
    assert_eq!((&task["goal_m"], &task["goal_yaw_rad"]), (&json!([0.0, 0.0]), &json!(2.0)), "{task:#}");
    for (robot, goals) in [("a", 2), ("new", 1)] {
        wait_for("the robot to be at its goal", || {
            let ps = json(&["ps"]);
            let robots = ps["fleets"][0]["robots"].as_array().unwrap();
            let at_goal = |row: &Value| row["id"] == robot && row["goals_done"] == goals && row["arrived"] == true;
            robots.iter().any(at_goal).then_some(())
        });
    }
    signal(fleet.daemon(), Signal::INT);
    let ended = fleet.wait().expect(130);
    assert!(ended.arrived("a") && ended.arrived("new"), "{ended}");
    let said = format!("task {}: (0, 0, 2 rad), queued", task["task"]);
    assert_eq!(ended.event("task", "a")["detail"], said, "{ended}");

    let record = Record::open(&record).unwrap();
    let (mut frames, mut first, mut last) = (record.frames(), Vec::new(), Vec::new());
    while let Some(frame) = frames.next().unwrap() {
        first.extend(frame.bodies.iter().find(|body| first.is_empty() && body.index == 1).copied());
        last = frame.bodies.to_vec();
    }
    // Within what a heading may be off, 0.1 rad.
    assert!((first[0].yaw_rad - 1.0).abs() < 0.1, "{first:?}");
    for (index, yaw_rad) in [(0, 2.0), (1, -2.5)] {
        assert!((last[index].yaw_rad - yaw_rad).abs() <= 0.1, "{last:?}");
    }
    assert_clean(&root);
}

#[test]
fn a_task_is_acknowledged_if_the_robot_has_it_and_only_then() {
    let scenario = format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(1, 1000.0));
    let mut fleet = Run::scenario(&scenario).mode("realtime").set("fleet.command_timeout_s=30").start();
    let (root, id) = (fleet.root(), fleet.id());
    fleet.wait_tick(1);
    let (mut taken, mut refused) = (Vec::new(), 0);
    for _ in 0..72 {
        let sent = shoal(&["task", "send", "a", "1,0", "--fleet", &id, "--format", "json"]);
        match sent.code {
            Some(0) => taken.push(sent.report["task"].as_u64().unwrap()),
            _ => {
                sent.expect_failure(2, &["robot `a`: too many goals are waiting", "--now"]);
                refused += 1;
            }
        }
    }
    assert_eq!((taken.len(), refused), (64, 8), "as many as a robot keeps");
    let ps = shoal(&["ps", "--fleet", &id, "--format", "json"]).expect(0).report;
    assert_eq!(ps["fleets"][0]["robots"][0]["goals_left"], 65, "{ps:#}");
    signal(fleet.daemon(), Signal::INT);
    let ended = fleet.wait().expect(130);
    let logged = |kind: &str| -> Vec<u64> {
        let events = ended.report["events"].as_array().unwrap().iter().filter(|event| event["kind"] == kind);
        let number = |event: &Value| event["detail"].as_str()?.strip_prefix("task ")?.split(':').next()?.parse().ok();
        events.filter_map(number).collect()
    };
    assert_eq!(logged("task"), taken, "what was acknowledged is what the robot had\n{ended}");
    assert_eq!(logged("ignored").len(), refused, "{ended}");
    assert_clean(&root);
}

#[test]
fn a_robot_can_be_added_to_a_fleet_in_lockstep() {
    let run = Run::scenario(&lanes(1, 60.0)).mode("lockstep").set("clock.tick_hz=1000").set("world.y_m=[-4, 4]");
    let run = run.set("clock.duration_s=3600");
    let mut fleet = run.start();
    let id = fleet.id();
    fleet.wait_tick(20);
    shoal(&["add", "--fleet", &id, "--id", "late", "--start", "0,-2", "--goal", "1,-2"]).expect(0);
    let ended = fleet.wait().expect(0);
    assert!(ended.arrived("a") && ended.arrived("late"), "{ended}");
    assert!(ended.event("joined", "late")["tick"].as_u64().unwrap() > 20, "{ended}");
}

/// What the daemon says of a life that is over, or of a robot that is not there yet, comes late or too early. It must not
/// fall on the robot that has the place now, or later.
#[test]
fn an_order_about_nobody_silences_nobody() {
    let scenario = format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(2, 1.0));
    let run = Run::scenario(&scenario).mode("realtime").set("world.y_m=[-4, 8]").set("fleet.max_robots=3");
    let run = run.set("defaults.restart=\"on-failure\"").set("defaults.restart_delay_s=0.1");
    let mut fleet = run.set("fleet.command_timeout_s=30").start();
    let (root, id, daemon) = (fleet.root(), fleet.id(), fleet.daemon());
    fleet.wait_tick(1);
    // In the daemon's place, and with its voice.
    stop(daemon);
    let node = Node::new(&fleet.address(), "test").unwrap();
    let mut orders = OrderSender::open(&node).unwrap();
    for (slot, incarnation) in [(2, 0), (0, 7), (1, 1), (999, 0), (u32::MAX, u32::MAX)] {
        // The next life of `b` is among them, and the robot that is added below.
        let died = Absence::Died { signal: Some(9), code: None, words: String::new() };
        orders
            .send(&Order::Absent { instance: RobotInstance { index: RobotIndex(slot), incarnation }, cause: died })
            .unwrap();
    }
    fleet.gate().ring_world();
    drop((orders, node));
    let tick = fleet.tick();
    fleet.wait_tick(tick + 5);
    signal(daemon, Signal::CONT);

    shoal(&["add", "--fleet", &id, "--id", "late", "--start", "0,-2", "--goal", "1,-2"]).expect(0);
    signal(fleet.agent(1), Signal::KILL);
    fleet.wait_said("b restarted: incarnation 1");
    let gate = fleet.gate();
    wait_for("all to arrive", || (gate.progress().arrived == 3).then_some(()));
    signal(daemon, Signal::INT);
    let ended = fleet.wait().expect(130);
    assert!(["a", "b", "late"].iter().all(|id| ended.arrived(id)), "{ended}");
    let kinds = ended.report["events"].as_array().unwrap().iter().map(|event| event["kind"].as_str().unwrap());
    assert_eq!(kinds.clone().filter(|kind| *kind == "died").count(), 1, "{ended}");
    let mut kinds = kinds.filter(|kind| *kind != "died");
    assert!(kinds.all(|kind| ["joined", "restarted", "arrived"].contains(&kind)), "{ended}");
    assert_clean(&root);
}

/// Clients that ask without a pause, send noise, or say nothing: the daemon goes on to start, to reap and to answer.
#[test]
fn a_flood_of_clients_keeps_the_daemon_from_nothing() {
    let scenario = format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(2, 1.0));
    let run = Run::scenario(&scenario).mode("realtime").set("defaults.restart=\"on-failure\"");
    let run = run.set("defaults.restart_delay_s=0.1").set("fleet.command_timeout_s=30");
    let mut fleet = run.start();
    let (root, id, daemon) = (fleet.root(), fleet.id(), fleet.daemon());
    fleet.wait_tick(1);
    let socket = root.join("operator");
    let flooding = AtomicBool::new(true);
    std::thread::scope(|scope| {
        let header = |version: u32| [&b"shOp"[..], &version.to_le_bytes(), &1_u32.to_le_bytes(), &[0]].concat();
        let frames = [header(PROTOCOL_VERSION), header(PROTOCOL_VERSION), b"GET / HTTP/1.1\r\n\r\n".to_vec(), vec![]];
        for frame in frames {
            let (socket, flooding) = (&socket, &flooding);
            scope.spawn(move || {
                while flooding.load(Relaxed) {
                    let Ok(mut stream) = UnixStream::connect(socket) else { continue };
                    let _ = stream.set_read_timeout(Some(Duration::from_millis(300)));
                    let _ = stream.write_all(&frame);
                    if !frame.is_empty() {
                        let _ = stream.read_to_end(&mut Vec::new());
                    }
                }
            });
        }
        // Whatever fails in here: the flood ends, and the scope with it.
        let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            fleet.wait_said("operators: refused");
            signal(fleet.agent(1), Signal::KILL);
            fleet.wait_said("b restarted: incarnation 1");
            shoal(&["inject", "mute", "a", "--fleet", &id]).expect(0);
            shoal(&["ps", "--fleet", &id]).expect(0);
        }));
        flooding.store(false, Relaxed);
        result.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    });
    signal(daemon, Signal::INT);
    let ended = fleet.wait().expect(130);
    ended.event("fault", "a");
    assert_clean(&root);
}

#[test]
fn a_daemon_that_does_not_answer_is_named() {
    let scenario = format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(1, 1.0));
    let mut fleet = Run::scenario(&scenario).mode("realtime").start();
    let id = fleet.id();
    fleet.wait_tick(1);
    stop(fleet.daemon());
    shoal(&["task", "send", "a", "0,0", "--fleet", &id]).expect_failure(3, &["daemon", "stopped or killed"]);
    // What can be seen without it is shown.
    let ps = shoal(&["ps", "--fleet", &id, "--format", "json"]).expect(0);
    assert!(ps.stderr.contains("shown is what can be seen without its daemon"), "{ps}");
    let seen = &ps.report["fleets"][0];
    assert_eq!((&seen["daemon_pid"], &seen["world_pid"]), (&fleet.daemon().into(), &fleet.process("world").into()));
    assert_eq!((&seen["robots"][0]["pid"], &seen["robots"][0]["state"]), (&fleet.agent(0).into(), &"running".into()));
    assert!(seen["tick"].as_u64() > Some(1) && seen["robots"][0]["goal_m"][0] == 1.0, "{ps}");
    signal(fleet.daemon(), Signal::CONT);
    shoal(&["ps", "--fleet", &id]).expect(0);
}

#[test]
fn the_fleet_of_another_user_is_not_taken_for_one_that_has_ended() {
    let Some(machine) = PrivateShm::new("-t tmpfs -o size=64m tmpfs") else { return };
    let root = machine.path().join("shoal-65534-abcd234");
    std::fs::create_dir(&root).unwrap();
    std::os::unix::fs::chown(&root, Some(65534), Some(65534)).unwrap();
    for verb in [["ps", "--fleet", "abcd234"], ["latency", "--fleet", "abcd234"]] {
        let mut command = machine.shoal();
        command.args(verb);
        run(command).expect_failure(2, &["fleet `abcd234`", "belongs to another user (uid 65534)"]);
    }
    // It is none that this user could remove, and nothing is said of it.
    let mut clean = machine.shoal();
    clean.arg("clean");
    assert_eq!(run(clean).expect(0).stdout, "nothing to clean\n");
    assert!(root.exists());
}

#[test]
fn with_no_fleet_running() {
    let Some(machine) = PrivateShm::new("-t tmpfs tmpfs") else { return };
    let ask = |args: &[&str]| {
        let mut command = machine.shoal();
        command.args(args);
        run(command)
    };
    ask(&["ps"]).expect(0);
    assert_eq!(ask(&["ps", "--format", "json"]).expect(0).report["fleets"], serde_json::json!([]));
    ask(&["task", "send", "a", "0,0"]).expect_failure(3, &["no fleet is running", "shoal run"]);
    ask(&["add", "--start", "0,0", "--goal", "1,1"]).expect_failure(3, &["no fleet is running"]);
    ask(&["latency"]).expect_failure(3, &["no fleet is running", "shoal run"]);
}
