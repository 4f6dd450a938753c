//! Signals, and pipes that are not read: supervisors start, contain and end processes in their own ways.

use crate::support::{Ended, Fleet, Run, assert_clean, example, lanes, run, shoal, signal, wait_for};
use model::RobotIndex;
use rustix::fs::{OFlags, fcntl_setfl};
use rustix::io::Errno;
use rustix::process::{Pid, Resource, Rlimit, Signal, kill_process, setrlimit};
use std::os::fd::{AsFd, OwnedFd};
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

fn endless() -> Run {
    Run::scenario(&format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(3, 2.0)))
}

/// Sends every process of the fleet the same signal.
fn signal_all(fleet: &mut Fleet, with: Signal) {
    let others = fleet.processes().into_iter().map(|process| process.pid);
    for pid in others.chain([fleet.daemon()]).collect::<Vec<_>>() {
        // One that ends this moment has been told as well.
        let _ = kill_process(Pid::from_raw(i32::try_from(pid).unwrap()).unwrap(), with);
    }
}

/// Ended in good order: asked to, with a report and both files.
#[track_caller]
fn assert_both_files(ended: &Ended, dir: &Path) {
    assert_eq!((ended.code, &ended.report["interrupted"]), (Some(130), &true.into()), "{ended}");
    let report = std::fs::read_to_string(dir.join("out.json")).unwrap_or_else(|error| panic!("{error}\n{ended}"));
    assert!(report.contains("\"interrupted\": true"), "{report}");
    assert!(std::fs::metadata(dir.join("out.mcap")).is_ok_and(|meta| meta.len() > 0), "{ended}");
    let gone = ended.report["events"].as_array().unwrap().iter().any(|event| event["kind"] == "died");
    assert!(!gone, "{ended}");
}

#[test]
fn every_process_is_asked_to_end_at_once() {
    let own = example("own_planner");
    for with in [Signal::TERM, Signal::INT, Signal::HUP] {
        for mode in ["realtime", "lockstep"] {
            // In the middle of a run, and while its processes start.
            for tick in [Some(3), None] {
                let dir = TempDir::new().unwrap();
                let files = |run: Run| {
                    run.arg("--report")
                        .arg(dir.path().join("out.json"))
                        .arg("--record")
                        .arg(dir.path().join("out.mcap"))
                };
                let mut fleet = files(endless().mode(mode).set(&format!("robot[2].agent={own:?}"))).start();
                let root = fleet.root();
                match tick {
                    Some(tick) => fleet.wait_tick(tick),
                    None => _ = fleet.process("world"),
                }
                signal_all(&mut fleet, with);
                assert_both_files(&fleet.wait(), dir.path());
                assert_clean(&root);
            }
        }
    }
}

#[test]
fn who_is_not_the_daemon_does_not_end_by_a_signal() {
    let mut fleet = endless().mode("lockstep").start();
    let root = fleet.root();
    fleet.wait_tick(3);
    for process in fleet.processes() {
        for with in [Signal::TERM, Signal::INT, Signal::HUP] {
            signal(process.pid, with);
        }
    }
    let tick = fleet.tick();
    fleet.wait_tick(tick + 100);
    assert_eq!(fleet.processes().len(), 5);
    signal(fleet.daemon(), Signal::TERM);
    let ended = fleet.wait().expect(130);
    assert_eq!(ended.report["failures"], serde_json::json!([]), "{ended}");
    assert_clean(&root);
}

#[test]
fn what_was_ignored_at_the_start_stays_ignored() {
    for (ignored, asks) in [(Signal::HUP, Signal::TERM), (Signal::INT, Signal::HUP)] {
        let mut fleet = endless().mode("realtime").ignoring(ignored).start();
        let root = fleet.root();
        fleet.wait_tick(3);
        signal(fleet.daemon(), ignored);
        signal(fleet.daemon(), ignored);
        let tick = fleet.tick();
        fleet.wait_tick(tick + 10);
        signal(fleet.daemon(), asks);
        let ended = fleet.wait().expect(130);
        assert_eq!(ended.stderr.matches("stopping").count(), 1, "{ended}");
        assert_clean(&root);

        // One thread, no processes.
        let long = endless().mode("single").set("clock.tick_hz=1000").ignoring(ignored).start();
        let daemon = long.daemon();
        wait_for("the other signal to be minded", || catches(daemon, asks).then_some(()));
        signal(daemon, ignored);
        signal(daemon, ignored);
        assert!(!catches(daemon, ignored));
        signal(daemon, asks);
        let ended = long.wait().expect(130);
        assert_eq!(ended.report["interrupted"], true, "{ended}");
    }
}

/// Whether a process has a handler for a signal.
fn catches(pid: u32, signal: Signal) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap_or("0").trim();
    u64::from_str_radix(mask, 16).unwrap() >> (signal.as_raw() - 1) & 1 == 1
}

#[test]
fn a_terminal_that_goes_may_say_so_more_than_once() {
    let mut fleet = endless().mode("realtime").start();
    let root = fleet.root();
    fleet.wait_tick(3);
    signal(fleet.daemon(), Signal::HUP);
    fleet.wait_said("stopping");
    while !fleet.has_ended() {
        let _ = kill_process(Pid::from_raw(i32::try_from(fleet.daemon()).unwrap()).unwrap(), Signal::HUP);
    }
    let ended = fleet.wait().expect(130);
    assert_eq!(ended.report["interrupted"], true, "{ended}");
    assert_clean(&root);
}

/// A pipe that takes nothing more: the end to read from, and the end to write to.
fn full_pipe() -> (OwnedFd, OwnedFd) {
    let (reader, writer) = rustix::pipe::pipe().unwrap();
    fcntl_setfl(&writer, OFlags::NONBLOCK).unwrap();
    while rustix::io::write(&writer, &[b'\n'; 4096]).is_ok() {}
    while rustix::io::write(&writer, b"\n").is_ok() {}
    fcntl_setfl(&writer, OFlags::empty()).unwrap();
    fcntl_setfl(&reader, OFlags::NONBLOCK).unwrap();
    (reader, writer)
}

/// What is in the pipe now.
fn drain(reader: impl AsFd) -> String {
    let (mut all, mut bytes) = (Vec::new(), [0; 4096]);
    loop {
        match rustix::io::read(&reader, &mut bytes) {
            Ok(0) | Err(Errno::AGAIN) => return String::from_utf8_lossy(&all).trim_start().to_owned(),
            Ok(read) => all.extend_from_slice(&bytes[..read]),
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn nobody_waits_for_who_does_not_read_what_is_said() {
    let (reader, writer) = full_pipe();
    let restart = endless().mode("realtime").set("defaults.restart=\"on-failure\"").set("defaults.restart_delay_s=0.1");
    let mut fleet = restart.stderr(writer).start();
    let (root, id) = (fleet.root(), fleet.id());
    let mut kill = |life: u32| {
        let incarnation = |fleet: &mut Fleet| {
            let mut agents = fleet.agents().into_iter().filter(|agent| agent.slot() == Some(1));
            agents.find(|agent| agent.incarnation() == Some(life)).map(|agent| agent.pid)
        };
        let pid = wait_for("the life of b", || incarnation(&mut fleet));
        let ready = fleet.gate();
        let instance = model::RobotInstance { index: RobotIndex(1), incarnation: life };
        wait_for("b to be ready", || ready.is_ready(instance).then_some(()));
        signal(pid, Signal::KILL);
    };
    // Restarts and answers do not wait for the reader.
    (0..3).for_each(&mut kill);
    shoal(&["ps", "--fleet", &id]).expect(0);
    // As soon as there is one, he is told, and of what he missed as well.
    drain(&reader);
    kill(3);
    let mut said = String::new();
    wait_for("the count of what was left out", || {
        said += &drain(&reader);
        (said.contains("left out here: the reader was too slow)") && said.contains("b ")).then_some(())
    });
    signal(fleet.daemon(), Signal::INT);
    let ended = fleet.wait().expect(130);
    assert_eq!(ended.report["interrupted"], true, "{ended}");
    assert_clean(&root);
}

#[test]
fn a_report_that_nobody_reads_can_be_given_up() {
    for with in [Signal::TERM, Signal::INT, Signal::HUP] {
        let (_reader, writer) = full_pipe();
        let mut fleet = endless().mode("lockstep").stdout(writer).start();
        let root = fleet.root();
        fleet.wait_tick(3);
        signal(fleet.daemon(), Signal::INT);
        // Nothing of the fleet is left when its report waits for a reader.
        assert_clean(&root);
        let daemon = fleet.daemon();
        wait_for("the report", || catches(daemon, with).then_some(()));
        assert!(!fleet.has_ended());
        signal(daemon, with);
        fleet.wait().expect(130);
    }
}

/// shoal with a limit of its own.
fn limited(resource: Resource, bytes: u64, args: &[&str]) -> Ended {
    use std::os::unix::process::CommandExt;
    let mut command = Command::new(crate::support::SHOAL);
    command.args(args);
    let limit = Rlimit { current: Some(bytes), maximum: Some(bytes) };
    let set = move || setrlimit(resource, limit).map_err(Into::into);
    // SAFETY: between fork and exec it makes one system call.
    unsafe { command.pre_exec(set) };
    run(command)
}

#[test]
fn limits_that_are_too_small_are_named() {
    let args = ["run", "head-on", "--mode", "lockstep", "--format", "json"];
    for kib in [32, 64, 512] {
        let ended = limited(Resource::Stack, kib << 10, &args);
        ended.expect_failure(3, &[&format!("stack: the limit is {kib} KiB"), "ulimit -s"]);
    }
    for kib in [4, 64, 600] {
        limited(Resource::Fsize, kib << 10, &args).expect_failure(3, &["File too large", "ulimit -f"]);
    }
    let ended = limited(Resource::Stack, 1 << 20, &args).expect(0);
    assert_eq!(ended.report["outcome"]["arrived_all"], true, "{ended}");
}
