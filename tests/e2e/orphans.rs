//! Fleets that outlive their daemon and their world.

use crate::service::{Service, states};
use crate::support::{assert_clean, is_gone, is_stopped, process_of, processes_of, run, shoal, signal, stop, wait_for};
use rustix::process::Signal;
use serde_json::Value;

fn time_s(service: &Service) -> f64 {
    service.json(&["ps"])["fleets"][0]["time_s"].as_f64().unwrap()
}

fn report(service: &Service) -> Value {
    serde_json::from_str(&std::fs::read_to_string(service.state().join("report.json")).unwrap()).unwrap()
}

#[test]
fn a_fleet_goes_on_without_its_daemon_until_another_one_adopts_it() {
    let mut service = Service::up(4);
    let (first, world) = (service.daemon(), service.world());
    let agents: Vec<Option<u32>> = ["a", "b", "c", "d"].map(|robot| service.agent(robot)).to_vec();
    for (robot, goal, id) in [("a", "1,0", "one"), ("b", "0,2", "two"), ("b", "1.5,2", "three")] {
        service.json(&["task", "send", robot, goal, "--id", id]);
    }
    // A robot that is stopped on purpose when the daemon dies, and one that dies while there is none.
    service.json(&["inject", "pause", "c"]);
    wait_for("the pause", || is_stopped(agents[2].unwrap()).then_some(()));
    signal(first, Signal::KILL);
    wait_for("its end", || is_gone(first).then_some(()));
    signal(agents[3].unwrap(), Signal::KILL);

    // The fleet is there, it moves, and what to do is said.
    let before = time_s(&service);
    wait_for("time to pass", || (time_s(&service) > before + 0.2).then_some(()));
    let seen = service.ask(&["ps", "--format", "json"]).expect(0);
    assert_eq!(
        (&seen.report["fleets"][0]["orphaned"], &seen.report["fleets"][0]["daemon_pid"]),
        (&true.into(), &0.into())
    );
    assert!(seen.stderr.contains("its daemon has ended") && seen.stderr.contains("shoal up --adopt --name"), "{seen}");
    run(service.command()).expect_failure(2, &["runs without a daemon", "--adopt"]);
    service.ask(&["task", "send", "a", "0,0"]).expect(3);
    assert!(processes_of(&service.root).iter().all(|process| process.verb() != "daemon"));

    service.adopt();
    assert_ne!(service.daemon(), first);
    assert_eq!(service.world(), world, "the same world");
    for (robot, pid) in ["a", "b", "c"].iter().zip(&agents) {
        assert_eq!(service.agent(robot), *pid, "{robot} is the same process");
    }
    assert_eq!(process_of(world).map(|process| process.parent), Some(1));
    // The robot that died comes back, the one that is paused stays so, until it is resumed.
    wait_for("the restart", || service.agent("d").filter(|pid| Some(*pid) != agents[3]));
    assert!(is_stopped(agents[2].unwrap()));
    service.json(&["inject", "resume", "c"]);
    wait_for("the resume", || (!is_stopped(agents[2].unwrap())).then_some(()));
    // A second daemon is refused: there is one.
    shoal(&["up", "--adopt", "--name", &service.name]).expect_failure(3, &["runs without a daemon"]);

    // No task is lost, and none is done twice; new ones are taken, and a death of an adopted process is noticed.
    service.json(&["task", "send", "c", "0,4", "--id", "four"]);
    service.ask(&["task", "wait", "--all", "--timeout", "60s"]).expect(0);
    assert_eq!(states(&service.json(&["task", "list"])), ["done"; 4]);
    signal(agents[0].unwrap(), Signal::KILL);
    wait_for("the restart", || service.agent("a").filter(|pid| Some(*pid) != agents[0]));
    let log = service.ask(&["logs"]).expect(0).stdout;
    assert!(log.contains("has a new daemon"), "{log}");
    assert_eq!(service.json(&["down"])["forced"], false);
    assert_clean(&service.root);
    assert_eq!(report(&service)["per_robot"].as_array().unwrap().len(), 4);
    if let Some(done) = service.sql("SELECT task, count(*) FROM task_step WHERE state = 'done' GROUP BY task") {
        assert_eq!(done, "0|1\n1|1\n2|1\n3|1");
        assert_eq!(service.sql("SELECT ending FROM run").unwrap(), "stopped", "it was one run");
    }
}

#[test]
fn a_world_that_dies_is_replaced_and_goes_on() {
    let service = Service::up(3);
    let first = service.world();
    let agents: Vec<Option<u32>> = ["a", "b", "c"].map(|robot| service.agent(robot)).to_vec();
    for (robot, goal) in [("a", "1,0"), ("b", "0,2"), ("c", "1,4"), ("c", "0.5,4")] {
        service.json(&["task", "send", robot, goal]);
    }
    signal(first, Signal::KILL);
    let second = wait_for("another world", || Some(service.world()).filter(|pid| *pid != first && *pid != 0));
    let before = time_s(&service);
    wait_for("time to pass", || (time_s(&service) > before + 0.1).then_some(()));
    // It dies once more, and hears operators.
    signal(second, Signal::KILL);
    wait_for("another world", || Some(service.world()).filter(|pid| ![first, second, 0].contains(pid)));
    service.json(&["task", "send", "a", "0.5,0"]);
    service.ask(&["task", "wait", "--all", "--timeout", "60s"]).expect(0);
    for (robot, pid) in ["a", "b", "c"].iter().zip(&agents) {
        assert_eq!(service.agent(robot), *pid, "{robot} is the same process");
    }
    service.json(&["down"]);
    assert_clean(&service.root);
    let report = report(&service);
    let kinds = report["events"].as_array().unwrap().iter().filter(|event| event["kind"] == "world-restarted");
    assert_eq!(kinds.count(), 2, "{report:#}");
    assert_eq!(
        (&report["outcome"]["robot_contacts"], &report["per_robot"][2]["tasks_done"]),
        (&0.into(), &2.into()),
        "{report:#}"
    );
    if let Some(twice) = service.sql("SELECT count(*) FROM task_step WHERE state = 'done'") {
        assert_eq!(twice, "5", "none twice");
    }
}

#[test]
fn neither_daemon_nor_world_is_needed_to_begin_again() {
    let mut service = Service::up(2);
    service.json(&["task", "send", "a", "1,0", "--id", "left"]);
    // Stopped first, so that the daemon does not replace it.
    let world = service.world();
    stop(service.daemon());
    signal(world, Signal::KILL);
    signal(service.daemon(), Signal::KILL);
    wait_for("their end", || (is_gone(world) && is_gone(service.daemon())).then_some(()));
    service.adopt();
    service.ask(&["task", "wait", "left", "--timeout", "60s"]).expect(0);
    service.json(&["down"]);
    assert_clean(&service.root);
}

#[test]
fn a_fleet_ends_when_it_has_been_without_a_daemon_for_as_long_as_it_may() {
    let mut service = Service::up(2);
    service.json(&["down"]);
    let mut command = service.command();
    command.args(["--detach", "--orphan-limit", "0.5s"]);
    service.start_by(command);
    let all = processes_of(&service.root);
    assert!(all.len() > 3, "{all:?}");
    signal(service.daemon(), Signal::KILL);
    wait_for("the end of the fleet", || (!service.root.exists()).then_some(()));
    wait_for("the end of its processes", || all.iter().all(|process| is_gone(process.pid)).then_some(()));
    assert_clean(&service.root);
}

#[test]
fn robots_end_when_nobody_looks_after_their_fleet() {
    let service = Service::up(2);
    let all = processes_of(&service.root);
    let agents: Vec<u32> = all.iter().filter(|process| process.slot().is_some()).map(|process| process.pid).collect();
    assert_eq!(agents.len(), 2);
    stop(service.daemon());
    for process in all.iter().filter(|process| process.slot().is_none()) {
        signal(process.pid, Signal::KILL);
    }
    signal(service.daemon(), Signal::KILL);
    wait_for("the end of the agents", || agents.iter().all(|pid| is_gone(*pid)).then_some(()));
    // What they leave in shared memory goes with the next command.
    shoal(&["ps"]).expect(0);
    assert_clean(&service.root);
}
