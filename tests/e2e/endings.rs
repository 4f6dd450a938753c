//! Runs that something from outside brings to an end: whatever happens to one process or to the files of a fleet, the
//! run ends, says why, and reports what it came to.

use crate::support::{Ended, Fleet, Run, assert_clean, is_gone, lanes, processes_of, script, signal, stop, wait_for};
use rustix::process::{Pid, Signal, kill_process};
use std::path::PathBuf;
use std::sync::mpsc::channel;

/// A run that does not end by itself, in its third tick or later.
fn endless(mode: &str) -> (Fleet, PathBuf) {
    let scenario = format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(3, 2.0));
    let mut fleet = Run::scenario(&scenario).mode(mode).start();
    let root = fleet.root();
    fleet.wait_tick(3);
    (fleet, root)
}

/// Ended with exit code 3 and a report all the same, in which the same cause stands that was said.
#[track_caller]
fn assert_failed_with_a_report(ended: &Ended, cause: &str) {
    assert_eq!(ended.code, Some(3), "{ended}");
    let failures = ended.report["failures"].as_array().unwrap_or_else(|| panic!("no report\n{ended}"));
    let named = failures.iter().filter_map(|failure| failure.as_str()).any(|failure| failure.contains(cause));
    assert!(named && ended.stderr.contains(cause), "`{cause}` is missing\n{ended}");
    assert_eq!(ended.report["exit_code"], 3, "{ended}");
    assert!(ended.report["ticks"].as_u64().unwrap() >= 3, "{ended}");
    assert_eq!(ended.report["per_robot"].as_array().unwrap().len(), 3, "{ended}");
}

#[test]
fn a_stopped_guardian_does_not_hold_up_the_end() {
    let (mut fleet, root) = endless("realtime");
    stop(fleet.process("guardian"));
    signal(fleet.daemon(), Signal::INT);
    let ended = fleet.wait().expect(130);
    assert_eq!(ended.report["per_robot"].as_array().unwrap().len(), 3, "{ended}");
    assert_clean(&root);
}

#[test]
fn a_process_that_cannot_be_reaped_does_not_hold_up_the_end() {
    let (mut fleet, root) = endless("lockstep");
    let agent = i32::try_from(fleet.agent(1)).unwrap();
    let (seized, is_seized) = channel();
    let (let_go, may_go) = channel::<()>();
    // As long as its tracer does not look, a process that has ended is nobody else's to reap.
    let tracer = std::thread::spawn(move || {
        let nothing = std::ptr::null_mut::<libc::c_void>();
        // SAFETY: PTRACE_SEIZE takes two null pointers here, and touches no memory of this process.
        let result = unsafe { libc::ptrace(libc::PTRACE_SEIZE, agent, nothing, nothing) };
        seized.send(result).unwrap();
        let _ = may_go.recv();
    });
    if is_seized.recv().unwrap() != 0 {
        return eprintln!("skipped: tracing is not permitted");
    }
    signal(fleet.daemon(), Signal::INT);
    let ended = fleet.wait().expect(130);
    assert!(ended.stderr.contains(&format!("process {agent} was killed but does not exit")), "{ended}");
    assert_eq!(ended.report["per_robot"].as_array().unwrap().len(), 3, "{ended}");
    drop(let_go);
    tracer.join().unwrap();
    assert_clean(&root);
}

/// The first SIGBUS that is not a fault of its own only takes the handler away with which Rust looks for stack overflows.
fn sigbus(pid: u32) {
    let number = Pid::from_raw(i32::try_from(pid).unwrap()).unwrap();
    wait_for("the process to die", || {
        let gone = is_gone(pid);
        if !gone {
            let _ = kill_process(number, Signal::BUS);
        }
        gone.then_some(())
    });
}

#[test]
fn a_robot_that_dies_of_sigbus_is_a_death_like_any_other() {
    for mode in ["realtime", "lockstep"] {
        let (mut fleet, root) = endless(mode);
        sigbus(fleet.agent(1));
        fleet.wait_said("b died: signal 7");
        let tick = fleet.tick();
        fleet.wait_tick(tick + 3);
        signal(fleet.daemon(), Signal::INT);
        let ended = fleet.wait().expect(130);
        assert_eq!(ended.event("died", "b")["detail"], "signal 7", "{ended}");
        assert!(!ended.stderr.contains("full"), "{ended}");
        assert_clean(&root);
    }
}

#[test]
fn a_world_that_dies_takes_only_the_ground_truth_with_it() {
    let (mut fleet, root) = endless("realtime");
    sigbus(fleet.process("world"));
    let ended = fleet.wait().expect_failure(3, &["world-sim killed by signal 7 before the run was over", "at tick "]);
    assert!(ended.stderr.contains("of 3 robots had arrived") && !ended.stderr.contains("full"), "{ended}");
    assert_clean(&root);
}

#[test]
fn a_world_that_does_not_end_is_not_waited_for() {
    let (mut fleet, root) = endless("realtime");
    stop(fleet.process("world"));
    signal(fleet.daemon(), Signal::TERM);
    fleet.wait().expect_failure(3, &["world-sim does not end", "at tick "]);
    assert_clean(&root);
}

#[test]
fn a_gate_that_somebody_else_stops() {
    for mode in ["realtime", "lockstep"] {
        let (mut fleet, root) = endless(mode);
        fleet.gate().stop();
        assert_failed_with_a_report(&fleet.wait(), "gate: stopped from outside");
        assert_clean(&root);
    }
}

#[test]
fn files_that_somebody_removes() {
    for mode in ["realtime", "lockstep"] {
        let (fleet, root) = endless(mode);
        std::fs::remove_dir_all(&root).unwrap();
        let ended = fleet.wait();
        assert_failed_with_a_report(&ended, "its files were removed");
        assert_failed_with_a_report(&ended, "statistics: missing");
        assert_clean(&root);
    }
}

#[test]
fn files_that_somebody_removes_but_not_the_directory() {
    for mode in ["realtime", "lockstep"] {
        let (fleet, root) = endless(mode);
        let entries = std::fs::read_dir(&root).unwrap().flatten();
        for file in entries.map(|entry| entry.path()).filter(|path| !path.is_dir()) {
            // Processes make and remove some meanwhile.
            let _ = std::fs::remove_file(file);
        }
        let ended = fleet.wait();
        assert_failed_with_a_report(&ended, "its files were removed");
        assert_eq!(ended.report["failures"].as_array().unwrap().len(), 1, "{ended}");
        assert_clean(&root);
    }
}

#[test]
fn files_that_somebody_removes_before_the_daemon_is_killed() {
    // Agents that are not shoal's do not die with their parent: the guardian ends them, with or without a directory.
    let dir = tempfile::TempDir::new().unwrap();
    let mark = (50_000_000 + std::process::id()).to_string();
    let agent = script(dir.path(), "agent", &format!("#!/bin/sh\nexec sleep {mark}\n"));
    let sleepers = || processes_of(mark.as_ref()).len();
    let run = Run::scenario(&lanes(3, 2.0)).mode("realtime").set(&format!("defaults.agent={agent:?}"));
    let mut fleet = run.set("fleet.start_limit_s=36000").start();
    let root = fleet.root();
    wait_for("the agents", || (sleepers() == 3).then_some(()));
    stop(fleet.daemon());
    std::fs::remove_dir_all(&root).unwrap();
    signal(fleet.daemon(), Signal::KILL);
    fleet.wait();
    assert_clean(&root);
    wait_for("the agents to be gone", || (sleepers() == 0).then_some(()));
}

#[test]
fn a_record_that_fails_is_in_the_report() {
    let dir = tempfile::TempDir::new().unwrap();
    let folder = dir.path().join("folder");
    std::fs::create_dir(&folder).unwrap();
    let mut fleet = Run::scenario(&lanes(3, 5.0)).mode("realtime").arg("--record").arg(folder.join("out.mcap")).start();
    fleet.wait_tick(3);
    std::fs::remove_dir_all(&folder).unwrap();
    signal(fleet.daemon(), Signal::INT);
    let ended = fleet.wait();
    assert_failed_with_a_report(&ended, "cannot write");
    assert_eq!(ended.report["record"], serde_json::Value::Null, "{ended}");
}
