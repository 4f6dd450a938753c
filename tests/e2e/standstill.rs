//! Time that stands still: for the world, or for everything (a frozen container, a paused virtual machine).

use crate::service::Service;
use crate::support::{Ended, Fleet, Run, assert_clean, lanes, shoal, signal, stop, wait_for};
use bus::clock;
use rustix::process::Signal;
use serde_json::Value;

/// Longer than a command lives in these runs.
const STANDSTILL_NS: u64 = 1_500_000_000;

/// Waits until the world has been silent for that long.
fn wait_silent(fleet: &mut Fleet) {
    let gate = fleet.gate();
    wait_for("the world to be silent", || {
        (clock::now_ns().saturating_sub(gate.progress().stamp_ns) > STANDSTILL_NS).then_some(())
    });
}

/// Stops processes, waits, and lets them go on, the last one first.
fn freeze(fleet: &mut Fleet, pids: &[u32]) {
    pids.iter().for_each(|pid| stop(*pid));
    wait_silent(fleet);
    pids.iter().rev().for_each(|pid| signal(*pid, Signal::CONT));
}

fn gaps(ended: &Ended) -> Vec<u64> {
    let events = ended.report["events"].as_array().unwrap();
    let gaps = events.iter().filter(|event| event["kind"] == "gap");
    gaps.map(|gap| gap["detail"].as_str().unwrap().strip_suffix(" ms").unwrap().parse().unwrap()).collect()
}

/// Time stood still once or more (others may load the machine), which is said, counted, and not made up for.
fn assert_noticed(ended: &Ended) {
    let (report, gaps) = (&ended.report, gaps(ended));
    assert!(gaps.iter().any(|ms| *ms >= 1400), "{ended}");
    let counted = (report["latency"]["gaps"].as_u64(), report["latency"]["gaps_ms"].as_u64());
    assert_eq!(counted, (Some(gaps.len() as u64), Some(gaps.iter().sum())), "{ended}");
    assert_eq!(report["verdict"], "starved", "{ended}");
    let reasons = report["starved_because"].as_array().unwrap();
    assert!(reasons.iter().any(|reason| reason.as_str().unwrap().starts_with("time stood still")), "{ended}");
    // The lost time is lost: as long as the run took, and no longer, the robots drove. A gap lacks less than two periods.
    let [simulated_s, wall_s] = ["sim_time_s", "wall_time_s"].map(|field| report[field].as_f64().unwrap());
    let lost_s = gaps.iter().sum::<u64>() as f64 * 1e-3;
    assert!(simulated_s <= wall_s - lost_s + 0.05 * (1 + gaps.len()) as f64, "{lost_s} s of {wall_s} s\n{ended}");
}

fn realtime() -> Run {
    // A pause of the whole machine is longer than this limit, those of a loaded one are hardly.
    Run::scenario(&lanes(2, 6.0)).mode("realtime").set("fleet.command_timeout_s=0.5").set("clock.duration_s=60")
}

#[test]
fn a_world_that_was_stopped_goes_on_from_now() {
    let mut fleet = realtime().start();
    let (root, id) = (fleet.root(), fleet.id());
    fleet.wait_tick(20);
    let world = fleet.process("world");
    stop(world);
    wait_silent(&mut fleet);

    // A second terminal is told what is the matter, and nothing is promised that the world has not done.
    let ps = shoal(&["ps", "--fleet", &id, "--format", "json"]).expect(0).report;
    let state = &ps["fleets"][0];
    assert_eq!(state["world_state"], "stopped", "{ps:#}");
    assert!(state["tick_age_s"].as_f64() > Some(1.0), "{ps:#}");
    let text = shoal(&["ps", "--fleet", &id]).expect(0).stdout;
    assert!(text.contains("(stopped), last tick"), "{text}");
    let words = ["task 0 for robot `a`: not confirmed", "shoal ps"];
    shoal(&["task", "send", "a", "5,0", "--fleet", &id]).expect_failure(3, &words);
    fleet.wait_said("the world's process was stopped");

    signal(world, Signal::CONT);
    fleet.wait_said("task: task 0");
    let ended = fleet.wait().expect(0);
    assert_noticed(&ended);
    ended.event("task", "a");
    assert_eq!(ended.robot("a")["tasks_done"], 1, "{ended}");
    assert_clean(&root);
}

#[test]
fn a_fleet_that_was_frozen_goes_on_from_now() {
    let mut fleet = realtime().start();
    let root = fleet.root();
    fleet.wait_tick(20);
    let pids = [fleet.agent(0), fleet.agent(1), fleet.process("world"), fleet.daemon()];
    freeze(&mut fleet, &pids);
    let ended = fleet.wait().expect(0);
    assert_noticed(&ended);
    assert!(ended.arrived("a") && ended.arrived("b"), "{ended}");
    assert_clean(&root);
}

#[test]
fn a_frozen_fleet_in_lockstep_loses_no_robot_and_no_bit() {
    let run = |scenario: &str| {
        let run = Run::scenario(scenario).mode("lockstep").set("clock.tick_hz=1000").set("clock.duration_s=3600");
        run.set("fleet.straggler_limit_s=1")
    };
    let scenario = lanes(3, 60.0);
    let undisturbed = run(&scenario).finish().expect(0);
    let mut fleet = run(&scenario).start();
    let root = fleet.root();
    fleet.wait_tick(20);
    // The world waits for robots when it is stopped, and finds them still missing when it goes on.
    let agents = [0, 1, 2].map(|slot| fleet.agent(slot));
    let pids = [agents[0], agents[1], agents[2], fleet.daemon(), fleet.process("world")];
    freeze(&mut fleet, &pids);
    let ended = fleet.wait().expect(0);
    assert_eq!(ended.hash(), undisturbed.hash(), "{ended}");
    assert_eq!((&ended.report["verdict"], &ended.report["latency"]["stragglers"]), (&"valid".into(), &Value::from(0)));
    assert_clean(&root);
}

/// The agent of one robot is stopped and goes on: `ps` names the robot, the log says who waited for whom, and that it is over.
/// What `shows` says of the fleet meanwhile is waited for.
fn stop_b(mode: &'static str, shows: &dyn Fn(&Value) -> bool) -> (Service, Vec<Value>) {
    let more = "[fleet]\ncommand_timeout_s = 0.5\nstraggler_limit_s = 600\n";
    let service = Service::in_mode(mode, format!("{}{more}", lanes(3, 1.0)), &[]);
    let fleet = || service.json(&["ps"])["fleets"][0].clone();
    let state = || fleet()["robots"][1]["state"].as_str().unwrap().to_owned();
    wait_for("b to take part", || (state() == "running").then_some(()));
    let agent = service.agent("b").unwrap();
    let log = || -> Vec<Value> {
        let text = service.ask(&["logs", "--format", "json"]).expect(0).stdout;
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    };
    let is_logged = |words: &str| log().iter().any(|entry| entry["text"].as_str().unwrap().contains(words));
    stop(agent);
    wait_for("`ps` to name it", || (state() == "stopped" && shows(&fleet())).then_some(()));
    wait_for("the log to name it", || is_logged("robot `b`: its process was stopped by a signal").then_some(()));
    match mode {
        "lockstep" => {
            wait_for("who waits for whom", || {
                is_logged("waits for robot `b` (stopped), and 2 other robots").then_some(())
            });
        }
        _ => wait_for("the world to hold it", || is_logged("held: overdue").then_some(())),
    }
    signal(agent, Signal::CONT);
    wait_for("it to go on", || (state() == "running" && fleet()["waits_for"] == serde_json::json!([])).then_some(()));
    let over = if mode == "lockstep" { "it waited for robot `b`" } else { "answers again" };
    wait_for("the log to say so", || {
        (is_logged("robot `b`: its process goes on after") && is_logged(over)).then_some(())
    });
    let log = log();
    service.json(&["down"]);
    assert_clean(&service.root);
    (service, log)
}

#[test]
fn a_stopped_agent_is_named_and_no_robot_waits_for_it_in_realtime() {
    let (_service, log) = stop_b("realtime", &|fleet| fleet["waits_for"] == serde_json::json!([]));
    let of = |words: &str| log.iter().find(|entry| entry["text"].as_str().unwrap().contains(words)).unwrap();
    let stopped = of("its process was stopped");
    assert_eq!(
        (&stopped["robot"], &stopped["level"], &stopped["source"]),
        (&"b".into(), &"warn".into(), &"daemon".into())
    );
    assert!(stopped["text"].as_str().unwrap().contains("no robot waits for it"), "{stopped}");
    assert_eq!((&of("goes on after")["robot"], &of("goes on after")["level"]), (&"b".into(), &"info".into()));
}

#[test]
fn a_tick_that_waits_for_a_stopped_agent_says_so_in_lockstep() {
    let (_service, log) = stop_b("lockstep", &|fleet| fleet["waits_for"] == serde_json::json!(["b"]));
    assert!(log.iter().all(|entry| entry["event"] != "held"), "it is waited for: {log:#?}");
}
