//! What a shell is offered of the fleets that run.

use crate::service::Service;
use crate::support::SHOAL;
use std::process::Command;

/// The words for the last of these, which has been begun.
fn words(line: &[&str]) -> Vec<String> {
    let index = (line.len() - 1).to_string();
    let mut asked = Command::new(SHOAL);
    asked.envs([("SHOAL_COMPLETE", "bash"), ("_CLAP_IFS", "\n"), ("_CLAP_COMPLETE_INDEX", &*index)]);
    let output = asked.arg("--").args(line).output().unwrap();
    String::from_utf8(output.stdout).unwrap().lines().map(str::to_owned).collect()
}

#[test]
fn a_shell_is_offered_robots_and_fleets_that_run() {
    let service = Service::up(2);
    let fleets = words(&["shoal", "ps", "--fleet", ""]);
    assert!(fleets.contains(&service.name), "{fleets:?}");
    service.json(&["add", "--id", "scout-7", "--start", "0,3", "--goal", "2,3"]);
    let robots = words(&["shoal", "task", "send", "scout"]);
    assert_eq!(robots, ["scout-7"], "a robot that came later is among them");
    assert!(words(&["shoal", "restart", ""]).contains(&"a".to_owned()));
}
