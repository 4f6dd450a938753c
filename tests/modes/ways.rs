//! Shortest ways on a map with many obstacles: what takes long of them is found once, and all agents read it.

use crate::support::{SHOAL, deterministic, report};
use rustix::process::Signal;
use shoal_tests::process::{Place, Run, parent_of, text_of, wait_for};
use std::fmt::Write;
use std::path::PathBuf;

/// Six robots of one size and one of another cross a field of 25 squares.
fn scenario(folder: &tempfile::TempDir) -> PathBuf {
    let mut text =
        "[clock]\nduration_s = 20\n[defaults]\nplanner = \"lanes\"\nknows_map = true\nradius_m = 0.2\n".to_owned();
    for square in 0..25 {
        let (x, y) = (1.6 * f64::from(square % 5) - 3.2, 1.7 * f64::from(square / 5) - 3.4);
        let (left, right, low, high) = (x - 0.4, x + 0.4, y - 0.4, y + 0.4);
        let corners = format!("[[{left}, {low}], [{right}, {low}], [{right}, {high}], [{left}, {high}]]");
        writeln!(text, "[[obstacle]]\nshape = \"polygon\"\ncorners_m = {corners}").expect("a text");
    }
    for robot in 0..7 {
        let y = f64::from(robot) - 3.0;
        let more = if robot == 6 { "radius_m = 0.15" } else { "" };
        writeln!(text, "[[robot]]\nid = \"r{robot}\"\nstart_m = [-5, {y}]\ngoal_m = [5, {}]\n{more}", -y)
            .expect("a text");
    }
    let path = folder.path().join("squares.toml");
    #[expect(clippy::disallowed_methods, reason = "a scenario of its own")]
    std::fs::write(&path, text).expect("it can be written");
    path
}

#[test]
fn agents_that_share_ways_drive_as_one_thread_does() {
    let folder = tempfile::tempdir().expect("a temporary directory");
    let path = scenario(&folder);
    let run = |mode| report(&format!("{} --mode {mode}", path.display()));
    let (single, lockstep) = (run("single"), run("lockstep"));
    assert_eq!(single["trajectory_hash"], lockstep["trajectory_hash"]);
    assert_eq!(deterministic(&single), deterministic(&lockstep));
    assert_eq!(single["outcome"]["arrived_all"], true, "{:#}", single["outcome"]);
}

/// Of all processes of a fleet the agents map the file with the ways, each of them.
#[test]
fn every_agent_reads_what_was_found_once() {
    let folder = tempfile::tempdir().expect("a temporary directory");
    let path = scenario(&folder);
    let _place = Place::take();
    let running = Run::new(SHOAL).words(&format!("run {} --mode realtime --duration 60s", path.display())).start();
    let maps = |pid: u32| {
        let all = text_of(format!("/proc/{pid}/maps"))?;
        all.lines().find(|line| line.ends_with("/ways")).map(str::to_owned)
    };
    let readers = || -> Vec<String> {
        let processes = std::fs::read_dir("/proc").expect("it is there").filter_map(Result::ok);
        let pids = processes.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
        pids.filter(|pid| parent_of(*pid) == Some(running.pid())).filter_map(maps).collect()
    };
    let lines = wait_for("the seventh agent", || Some(readers()).filter(|lines| lines.len() == 7));
    assert!(lines.iter().all(|line| line.contains("r--s")), "{lines:?}");
    running.signal(Signal::INT);
    let ended = running.end();
    assert!(ended.code.is_some(), "{ended}");
}
