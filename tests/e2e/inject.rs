//! `shoal inject`: faults on purpose, put on a fleet from a second terminal while it runs.

use crate::support::{Fleet, Run, assert_clean, is_gone, is_stopped, lanes, shoal, signal, wait_for};
use rustix::process::Signal;
use serde_json::{Value, json};

fn endless(robots: usize) -> Run {
    let scenario = format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(robots, 1.0));
    Run::scenario(&scenario).mode("realtime").set("fleet.command_timeout_s=30")
}

/// How many entries of this kind about this robot the log has, and the detail of the first.
fn events<'a>(report: &'a Value, kind: &str, robot: &str) -> Vec<&'a str> {
    let events = report["events"].as_array().unwrap().iter();
    let wanted = events.filter(|event| event["kind"] == kind && event["robot"] == robot);
    wanted.map(|event| event["detail"].as_str().unwrap()).collect()
}

fn lives(fleet: &mut Fleet, slot: u32, incarnation: u32) -> u32 {
    wait_for("a life of the robot", || {
        let mut agents = fleet.agents().into_iter();
        let found = agents.find(|agent| agent.slot() == Some(slot) && agent.incarnation() == Some(incarnation));
        found.map(|agent| agent.pid)
    })
}

#[test]
fn an_operator_kills_pauses_and_disturbs_the_robots_of_a_running_fleet() {
    let run = endless(3).set("robot[0].restart=\"on-failure\"").set("robot[0].restart_delay_s=0.1");
    let mut fleet = run.set("robot[0].restart_limit=1").start();
    let (root, id) = (fleet.root(), fleet.id());
    fleet.wait_tick(5);
    let inject = |args: &[&str]| shoal(&[&["inject"], args, &["--fleet", &id, "--format", "json"]].concat());

    // Killed, and back; killed for good.
    let first = fleet.agent(0);
    let killed = inject(&["kill", "a"]).expect(0).report;
    let expected = json!({
        "schema": "shoal.inject/1", "fleet": id, "robot": "a", "fault": "kill", "ticks": null,
    });
    assert_eq!(killed, expected);
    wait_for("the killed process to be gone", || is_gone(first).then_some(()));
    lives(&mut fleet, 0, 1);
    fleet.wait_said("a restarted: incarnation 1");
    inject(&["kill", "a"]).expect(0);
    inject(&["kill", "a"]).expect_failure(2, &["robot `a`: the robot is dead"]);
    inject(&["pause", "a"]).expect_failure(2, &["robot `a`: the robot is dead"]);

    // Stopped until it is resumed, or for a while.
    let b = fleet.agent(1);
    inject(&["pause", "b"]).expect(0);
    wait_for("the process to be stopped", || is_stopped(b).then_some(()));
    let state = |robot: usize| {
        let ps = shoal(&["ps", "--fleet", &id, "--format", "json"]).expect(0).report;
        ps["fleets"][0]["robots"][robot]["state"].clone()
    };
    assert_eq!(state(1), "paused");
    inject(&["resume", "b"]).expect(0);
    wait_for("the process to go on", || (!is_stopped(b) && state(1) == "running").then_some(()));
    assert_eq!(inject(&["pause", "b", "--for", "0.1"]).expect(0).report["ticks"], 5);
    let resumed = "b resumed";
    wait_for("the end of both pauses", || (fleet.stderr().matches(resumed).count() == 2).then_some(()));

    // What it says and what it hears.
    inject(&["mute", "c", "--for", "0.1"]).expect(0);
    assert_eq!(inject(&["delay", "c", "--ticks", "5"]).expect(0).report["delay_ticks"], 5);
    assert_eq!(inject(&["drop", "c", "--share", "0.5"]).expect(0).report["drop"], 0.5);
    assert_eq!(inject(&["noise", "c", "--sigma", "0.1"]).expect(0).report["noise_m"], 0.1);
    fleet.wait_said("c fault-over: mute");
    inject(&["resume", "c"]).expect(0);
    inject(&["resume", "c"]).expect_failure(2, &["robot `c`: it is not paused and has no fault"]);

    // What is wrong is said.
    inject(&["kill", "nobody"]).expect_failure(2, &["unknown robot `nobody`", "a, b, c"]);
    inject(&["drop", "c", "--share", "1.5"]).expect_failure(2, &["drop: 1.5 is not between 0 and 1"]);
    inject(&["delay", "c", "--ticks", "1000"]).expect_failure(2, &["delay: 1000 ticks is not between 0 and 255"]);
    inject(&["slow-cpu", "c", "--ms", "5000"]).expect_failure(2, &["slow-cpu: 5000 ms is not between 0 and 1000"]);

    signal(fleet.daemon(), Signal::INT);
    let ended = fleet.wait().expect(130);
    let report = &ended.report;
    assert_eq!(events(report, "killed", "a"), ["operator", "operator"], "{ended}");
    assert_eq!(events(report, "paused", "b")[0], "operator: until resumed", "{ended}");
    let faults = ["delay of 5 ticks", "drop of 0.5", "noise of 0.1 m"];
    assert_eq!(events(report, "fault", "c")[1..], faults.map(|fault| format!("operator: {fault}, until resumed")));
    assert_eq!(events(report, "fault-over", "c")[1..], faults, "{ended}");
    assert_eq!(events(report, "ignored", "a").len(), 2, "{ended}");
    assert_eq!(ended.robot("a")["gone"], "dead", "{ended}");
    assert_clean(&root);
}

/// The planner of one robot takes longer than its periods: it misses them, and it is the planner that is blamed.
#[test]
fn a_robot_with_a_slow_processor_misses_its_periods_because_of_its_planner() {
    let mut fleet = endless(2).start();
    let (root, id) = (fleet.root(), fleet.id());
    fleet.wait_tick(5);
    let planner = |robot: &str| {
        let latency = shoal(&["latency", "--fleet", &id, "--format", "json"]).expect(0).report;
        let mut robots = latency["per_robot"].as_array().into_iter().flatten();
        let row = robots.find(|row| row["id"] == robot).unwrap_or_else(|| panic!("{latency:#}"));
        row["blame"]["planner"].as_u64().unwrap_or_else(|| panic!("{latency:#}"))
    };
    let before = planner("b");
    shoal(&["inject", "slow-cpu", "b", "--ms", "30", "--fleet", &id]).expect(0);
    wait_for("periods that the planner made late", || (planner("b") >= before + 5).then_some(()));
    shoal(&["inject", "resume", "b", "--fleet", &id]).expect(0);
    signal(fleet.daemon(), Signal::INT);
    let ended = fleet.wait().expect(130);
    assert_eq!(events(&ended.report, "fault", "b"), ["operator: slow-cpu of 30 ms, until resumed"], "{ended}");
    assert_clean(&root);
}

/// In `lockstep` as well, where the fleet goes on without the paused robot, and waits for it when it is to come back.
#[test]
fn an_operator_pauses_a_robot_in_lockstep() {
    let run = Run::scenario(&lanes(2, 60.0)).mode("lockstep").set("clock.tick_hz=1000");
    let mut fleet = run.set("clock.duration_s=3600").start();
    let (root, id) = (fleet.root(), fleet.id());
    fleet.wait_tick(20);
    shoal(&["inject", "pause", "b", "--for", "0.2", "--fleet", &id]).expect(0);
    let ended = fleet.wait().expect(0);
    let tick = |kind: &str| ended.event(kind, "b")["tick"].as_u64().unwrap();
    assert_eq!(tick("resumed"), tick("paused") + 200, "{ended}");
    assert!(ended.arrived("a") && ended.arrived("b"), "{ended}");
    assert_clean(&root);
}
