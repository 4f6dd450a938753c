//! A day in the life of a fleet that is left running: what docs/tutorial.md tells, with everything dying once.

use crate::service::Service;
use crate::support::{assert_clean, lanes, signal, wait_for};
use rustix::process::Signal;
use serde_json::Value;
use std::collections::BTreeMap;

/// Robots on lanes of their own, 2 m apart, so that a contact can only come from what the fleet does to them.
fn scenario(robots: usize, lanes_in_all: usize) -> String {
    let more = format!(
        "[fleet]\nmax_robots = {lanes_in_all}\ncommand_timeout_s = 30\n[defaults]\nrestart = \"on-failure\"\n\
         restart_limit = 20\nrestart_delay_s = 0.2\n"
    );
    let bounds = |lanes: usize| format!("y_m = [-1, {}]", 2 * lanes);
    lanes(robots, 2.0).replacen("[defaults]\n", &more, 1).replacen(&bounds(robots), &bounds(lanes_in_all), 1)
}

fn task_ids(sent: &Value) -> Vec<u64> {
    match sent["tasks"].as_array() {
        Some(tasks) => tasks.iter().map(|task| task["task"].as_u64().unwrap()).collect(),
        None => vec![sent["task"].as_u64().unwrap()],
    }
}

#[test]
fn every_task_is_done_or_reported_whatever_dies() {
    let mut service = Service::of(scenario(15, 20), &[]);
    let names: Vec<String> = ('a'..='o').map(String::from).collect();
    for lane in 15..20 {
        let (start, goal) = (format!("0,{}", 2 * lane), format!("2,{}", 2 * lane));
        let added = service.json(&["add", "--id", &format!("guest-{lane}"), "--start", &start, "--goal", &goal]);
        assert_eq!(added["robot"], format!("guest-{lane}"), "{added:#}");
    }

    // Thirty tasks: by name, by the nearest robot, and in one batch.
    let mut sent = Vec::new();
    for (lane, name) in names.iter().enumerate().take(10) {
        sent.extend(task_ids(&service.json(&["task", "send", name, &format!("1,{}", 2 * lane)])));
    }
    for lane in 5..15 {
        let goal = format!("0.5,{}", 2 * lane);
        sent.extend(task_ids(&service.json(&["task", "send", "--assign", "nearest", &goal])));
    }
    let goals: Vec<String> = (0..10).map(|lane| format!("1.5,{}", 2 * lane)).collect();
    let goals: Vec<&str> = goals.iter().map(String::as_str).collect();
    sent.extend(task_ids(&service.json(&[&["task", "send", "--assign", "optimal"], &goals[..]].concat())));
    assert_eq!(sent, (0..30).collect::<Vec<u64>>());

    for victim in ["b", "g", "n"] {
        signal(service.agent(victim).expect("it runs"), Signal::KILL);
    }
    signal(service.daemon(), Signal::KILL);
    service.adopt();
    for leaver in ["d", "guest-19"] {
        assert_eq!(service.json(&["remove", leaver])["robot"], leaver);
    }
    let world = service.world();
    signal(world, Signal::KILL);
    wait_for("another world", || Some(service.world()).filter(|pid| ![world, 0].contains(pid)));

    // Exit code 1: some are not done, because their robot left.
    let waited = service.ask(&["task", "wait", "--all", "--timeout", "100s", "--format", "json"]);
    assert!(matches!(waited.code, Some(0 | 1)), "{waited}");
    let robots: BTreeMap<String, String> = (service.json(&["ps"])["fleets"][0]["robots"].as_array().unwrap().iter())
        .map(|robot| (robot["id"].as_str().unwrap().to_owned(), robot["state"].as_str().unwrap().to_owned()))
        .collect();
    assert_eq!(robots.len(), 20);
    for (id, state) in &robots {
        let expected = if ["d", "guest-19"].contains(&id.as_str()) { "left" } else { "running" };
        assert_eq!(state, expected, "{id}: {robots:?}");
    }
    assert_eq!(service.json(&["down"])["forced"], false);
    assert_clean(&service.root);

    let report: Value =
        serde_json::from_str(&std::fs::read_to_string(service.state().join("report.json")).unwrap()).unwrap();
    assert_eq!(report["outcome"]["robot_contacts"], 0, "{report:#}");
    let Some(states) = service.sql("SELECT id, state, robot FROM task ORDER BY id") else { return };
    let states: Vec<Vec<&str>> = states.lines().map(|line| line.split('|').collect()).collect();
    assert_eq!(states.len(), 30);
    for row in &states {
        // Tasks that were for `d` alone, and that it had not done.
        let is_fine = row[1] == "done" || row[1] == "failed" && row[2] == "d";
        assert!(is_fine, "{row:?}");
    }
    let done = states.iter().filter(|row| row[1] == "done").count();
    assert!(done >= 28, "{states:?}");
    let twice =
        "SELECT count(*) FROM (SELECT task FROM task_step WHERE state = 'done' GROUP BY task HAVING count(*) > 1)";
    assert_eq!(service.sql(twice).unwrap(), "0", "none is done twice");
    let left: Vec<String> = (std::fs::read_dir(service.directory.path()).unwrap().flatten())
        .map(|entry| entry.file_name().into_string().unwrap())
        .collect();
    assert_eq!(left.len(), 2, "the scenario and the state directory: {left:?}");
}
