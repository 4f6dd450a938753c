//! A `realtime` run of which anything may happen: what its record holds is computed again, and what could not be is said.

use crate::support::{Fleet, Run, assert_clean, example, lanes, shoal, signal, wait_for};
use rustix::process::Signal;
use serde_json::Value;
use std::path::Path;
use tempfile::TempDir;

/// Ends a fleet, and verifies its record: equal, with everything computed.
fn end_and_verify(mut fleet: Fleet, record: &Path) -> Value {
    let root = fleet.root();
    signal(fleet.daemon(), Signal::INT);
    fleet.wait().expect(130);
    assert_clean(&root);
    let verified = shoal(&["replay", &record.to_string_lossy(), "--verify", "--format", "json"]).expect(0);
    let document = verified.report;
    assert_eq!(document["verdict"]["is_whole"], true, "{document:#}");
    document
}

#[test]
fn kills_stops_tasks_and_robots_that_come_are_the_same_again() {
    let scenario = format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(3, 1000.0));
    let directory = TempDir::with_prefix("shoal-e2e-").unwrap();
    let record = directory.path().join("run.mcap");
    let run = Run::scenario(&scenario)
        .mode("realtime")
        .set("defaults.restart='on-failure'")
        .set("defaults.filter='shared-gap'");
    let mut fleet = run.set("defaults.restart_delay_s=0.02").arg("--record").arg(&record).start();
    let id = fleet.id();
    fleet.wait_ready(2, 0);
    fleet.wait_tick(30);
    // In the middle of whatever it does.
    for incarnation in 1..=3 {
        signal(fleet.agent(1), Signal::KILL);
        fleet.wait_ready(1, incarnation);
    }
    let tick = fleet.tick();
    fleet.wait_tick(tick + 20);
    let paused = fleet.agent(0);
    signal(paused, Signal::STOP);
    let tick = fleet.tick();
    fleet.wait_tick(tick + 60);
    signal(paused, Signal::CONT);
    shoal(&["add", "--fleet", &id, "--id", "new", "--start", "0,5.5", "--goal", "9,5.5"]).expect(0);
    shoal(&["task", "send", "--fleet", &id, "c", "3,3", "--now"]).expect(0);
    shoal(&["restart", "--fleet", &id, "c"]).expect(0);
    wait_for("the new robot to drive", || {
        let ps = shoal(&["ps", "--fleet", &id, "--format", "json"]).report;
        let robots = ps["fleets"][0]["robots"].as_array()?.clone();
        robots.iter().any(|robot| robot["id"] == "new").then_some(())
    });
    let tick = fleet.tick();
    fleet.wait_tick(tick + 40);
    let document = end_and_verify(fleet, &record);
    assert_eq!(document["verdict"]["unverified"], Value::Array(Vec::new()), "{document:#}");
}

/// A planner that this executable does not have: its commands are those of the record, and the others are told of.
#[test]
fn a_planner_of_ones_own_is_said() {
    let own = example("own_planner");
    let lanes = lanes(2, 1000.0).replace("id = \"a\"\n", &format!("id = \"a\"\nagent = {own:?}\n"));
    let scenario = format!("{lanes}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n");
    let directory = TempDir::with_prefix("shoal-e2e-").unwrap();
    let record = directory.path().join("run.mcap");
    let mut fleet = Run::scenario(&scenario).mode("realtime").arg("--record").arg(&record).start();
    fleet.wait_tick(30);
    let document = end_and_verify(fleet, &record);
    let unverified = document["verdict"]["unverified"].as_array().unwrap();
    assert!(
        unverified.iter().any(|robot| robot["robot"] == "a" && robot["commands"].as_u64() > Some(0)),
        "{document:#}"
    );
}
