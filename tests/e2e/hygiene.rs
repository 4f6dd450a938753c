//! However a run ends, nothing of it is left: no process, no shared memory.

use crate::support::{
    Ended, Fleet, PrivateShm, Run, assert_clean, assert_clean_in, is_gone, lanes, objects, objects_in, processes_of,
    run, script, shoal, signal, stop, wait_for,
};
use rustix::process::Signal;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A run that does not end by itself, after its first ticks.
fn endless(mode: &str) -> (Fleet, PathBuf) {
    let mut fleet = Run::scenario(&endless_scenario()).mode(mode).start();
    let root = fleet.root();
    fleet.wait_tick(3);
    assert!(!objects(&root).is_empty() && fleet.agents().len() == 3);
    (fleet, root)
}

fn endless_scenario() -> String {
    format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(3, 2.0))
}

/// Ends a run with a signal to its daemon; both kinds of fleets.
fn asked_to_end(with: Signal) {
    for mode in ["realtime", "lockstep"] {
        let (fleet, root) = endless(mode);
        signal(fleet.daemon(), with);
        let ended = fleet.wait().expect(130);
        assert_eq!((&ended.report["interrupted"], &ended.report["exit_code"]), (&true.into(), &130.into()), "{ended}");
        assert!(ended.report["ticks"].as_u64().unwrap() >= 3, "{ended}");
        assert_eq!(ended.report["per_robot"].as_array().unwrap().len(), 3, "{ended}");
        assert_clean(&root);
    }
}

#[test]
fn after_a_normal_end() {
    for mode in ["realtime", "lockstep"] {
        let mut fleet = Run::scenario(&lanes(3, 0.5)).mode(mode).set("clock.tick_hz=1000").start();
        let root = fleet.root();
        fleet.wait().expect(0);
        assert_clean(&root);
    }
}

#[test]
fn after_ctrl_c() {
    asked_to_end(Signal::INT);
}

#[test]
fn after_sigterm() {
    asked_to_end(Signal::TERM);
}

#[test]
fn after_the_terminal_is_gone() {
    asked_to_end(Signal::HUP);
}

#[test]
fn after_ctrl_c_twice() {
    let (mut fleet, root) = endless("realtime");
    // Without its world the run cannot come to an end in good order.
    stop(fleet.process("world"));
    signal(fleet.daemon(), Signal::INT);
    fleet.wait_said("press Ctrl-C again to stop immediately");
    assert!(!fleet.has_ended());
    // What comes right after the first signal belongs to that; and one that came after the end would find no handler.
    std::thread::sleep(Duration::from_millis(400));
    signal(fleet.daemon(), Signal::INT);
    let ended = fleet.wait().expect(130);
    assert!(ended.stdout.is_empty(), "{ended}");
    assert_clean(&root);
}

#[test]
fn after_ctrl_c_while_a_robot_does_not_answer() {
    let mut fleet = Run::scenario(&endless_scenario()).mode("lockstep").set("fleet.straggler_limit_s=36000").start();
    let root = fleet.root();
    fleet.wait_tick(3);
    let agent = fleet.agent(1);
    stop(agent);
    signal(fleet.daemon(), Signal::INT);
    fleet.wait().expect(130);
    assert_clean(&root);
}

#[test]
fn after_ctrl_c_while_the_fleet_starts() {
    let dir = TempDir::new().unwrap();
    let agent = script(dir.path(), "never-ready", "#!/bin/sh\nsleep 1000\n");
    let run = Run::scenario(&endless_scenario()).mode("realtime").set(&format!("defaults.agent={agent:?}"));
    let mut fleet = run.set("fleet.start_limit_s=36000").start();
    let root = fleet.root();
    fleet.agent(2);
    signal(fleet.daemon(), Signal::INT);
    fleet.wait().expect(130);
    assert_clean(&root);
}

#[test]
fn after_the_daemon_is_killed() {
    for mode in ["realtime", "lockstep"] {
        let (fleet, root) = endless(mode);
        signal(fleet.daemon(), Signal::KILL);
        let ended = fleet.wait();
        assert_eq!(ended.signal, Some(9), "{ended}");
        // The guardian does it, without anybody starting shoal again.
        assert_clean(&root);
    }
}

#[test]
fn a_process_that_only_names_the_fleet_survives_it() {
    let (fleet, root) = endless("realtime");
    // With a file that stays: it may come to the lease only when that is gone.
    let names = [std::path::Path::new("/dev/null"), &root.join("lease")];
    let mut bystander =
        std::process::Command::new("tail").arg("-f").args(names).stdout(std::process::Stdio::null()).spawn().unwrap();
    wait_for("the bystander", || processes_of(&root).iter().any(|process| process.pid == bystander.id()).then_some(()));
    signal(fleet.daemon(), Signal::KILL);
    fleet.wait();
    wait_for("the guardian", || objects(&root).is_empty().then_some(()));
    wait_for("the fleet's processes to be gone", || (processes_of(&root).len() == 1).then_some(()));
    let ended = bystander.try_wait().unwrap();
    bystander.kill().unwrap();
    bystander.wait().unwrap();
    assert_eq!(ended, None);
}

#[test]
fn after_the_daemon_is_killed_while_processes_are_stopped() {
    let (mut fleet, root) = endless("realtime");
    stop(fleet.agent(0));
    stop(fleet.process("world"));
    signal(fleet.daemon(), Signal::KILL);
    fleet.wait();
    assert_clean(&root);
}

#[test]
fn after_a_fleet_whose_agents_are_somebody_elses() {
    // These know nothing of shoal: they do not die with their parent, what they start does not name the run, and leaves
    // the fleet's process group.
    let dir = TempDir::new().unwrap();
    for (turn, with) in [Signal::KILL, Signal::INT].into_iter().enumerate() {
        let mark = (10_000_000 * (turn as u32 + 1) + std::process::id()).to_string();
        let agent = script(
            dir.path(),
            &format!("agent-{turn}"),
            &format!("#!/bin/sh\nsetsid sleep {mark} &\nexec sleep {mark}\n"),
        );
        let sleepers = || processes_of(mark.as_ref()).into_iter().filter(|process| process.verb() == mark).count();
        let run = Run::scenario(&endless_scenario()).mode("realtime").set(&format!("defaults.agent={agent:?}"));
        let mut fleet = run.set("fleet.start_limit_s=36000").start();
        let root = fleet.root();
        wait_for("the agents", || (sleepers() == 6).then_some(()));
        signal(fleet.daemon(), with);
        fleet.wait();
        assert_clean(&root);
        wait_for("the agents to be gone", || (sleepers() == 0).then_some(()));
    }
}

#[test]
fn after_agents_have_ended_that_started_others() {
    let dir = TempDir::new().unwrap();
    let mark = (30_000_000 + std::process::id()).to_string();
    let agent = script(dir.path(), "agent", &format!("#!/bin/sh\nsleep {mark} &\nsleep 0.5\n"));
    let run = Run::scenario(&lanes(2, 0.1)).mode("lockstep").set(&format!("defaults.agent={agent:?}"));
    let mut fleet = run.start();
    let root = fleet.root();
    fleet.wait().expect(1);
    assert_clean(&root);
    wait_for("what they started to be gone", || processes_of(mark.as_ref()).is_empty().then_some(()));
}

#[test]
fn after_the_world_is_killed() {
    for mode in ["realtime", "lockstep"] {
        let (mut fleet, root) = endless(mode);
        signal(fleet.process("world"), Signal::KILL);
        fleet.wait().expect_failure(3, &["world-sim killed by signal 9 before the run was over"]);
        assert_clean(&root);
    }
}

#[test]
fn after_the_guardian_is_killed() {
    let mut fleet = Run::scenario(&lanes(3, 2.0)).mode("realtime").set("fleet.command_timeout_s=30").start();
    let root = fleet.root();
    fleet.wait_tick(1);
    signal(fleet.process("guardian"), Signal::KILL);
    fleet.wait().expect(0);
    assert_clean(&root);
}

/// Nobody is left who could clean: the next shoal does.
fn after_everything_is_killed(then: &[&str]) {
    // In a /dev/shm of its own, because every shoal cleans, also those of other tests.
    let Some(machine) = PrivateShm::new("-t tmpfs -o size=256m tmpfs") else { return };
    let mut fleet = Run::scenario_by(machine.shoal(), &endless_scenario()).mode("realtime").start();
    let root = fleet.root();
    fleet.agent(2);
    let (guardian, world) = (fleet.process("guardian"), fleet.process("world"));
    // A world that is stopped before it has tied its life to the daemon's would survive it.
    let stats = machine.path().join(root.file_name().unwrap()).join("stats/world");
    wait_for("the world to be at work", || stats.exists().then_some(()));
    signal(guardian, Signal::KILL);
    signal(world, Signal::STOP); // so that it is not the daemon that notices first
    signal(fleet.daemon(), Signal::KILL);
    fleet.wait();
    wait_for("the processes to die with the daemon", || is_gone(world).then_some(()));
    assert!(!objects_in(&machine.path(), &root).is_empty(), "there is something to remove");

    let mut command = machine.shoal();
    command.args(then);
    let ended = run(command).expect(0);
    let said = format!("{}{}", ended.stdout, ended.stderr);
    assert!(said.contains("removed what fleet"), "{ended}");
    assert_clean_in(&machine.path(), &root);
    assert_eq!(std::fs::read_dir(machine.path()).unwrap().count(), 0);
}

#[test]
fn after_everything_is_killed_and_shoal_clean() {
    after_everything_is_killed(&["clean"]);
}

#[test]
fn after_everything_is_killed_and_the_next_run() {
    after_everything_is_killed(&["run", "head-on", "--mode", "lockstep"]);
}

/// While a fleet starts, what there is to clean grows by the millisecond.
#[test]
fn after_a_signal_at_any_moment() {
    let Some(machine) = PrivateShm::new("-t tmpfs -o size=256m tmpfs") else { return };
    let left = || std::fs::read_dir(machine.path()).unwrap().count();
    for with in [Signal::KILL, Signal::INT, Signal::TERM] {
        for delay_ms in [0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64] {
            let mut fleet = Run::scenario_by(machine.shoal(), &endless_scenario()).mode("lockstep").start();
            std::thread::sleep(Duration::from_millis(delay_ms));
            signal(fleet.daemon(), with);
            // A shell that has these tests in the background has them ignore SIGINT, and so does shoal until it has a
            // handler: such a signal is nobody's, and is sent again.
            let sent = Instant::now();
            let mut again = false;
            wait_for("the end of the run", || {
                if !again && sent.elapsed() > Duration::from_secs(3) {
                    again = true;
                    signal(fleet.daemon(), with);
                }
                fleet.has_ended().then_some(())
            });
            let ended = fleet.wait();
            // The handler may not be there yet.
            let asked = with != Signal::KILL && (ended.code, ended.signal) == (Some(130), None);
            assert!(asked || ended.signal == Some(with.as_raw()), "after {delay_ms} ms\n{ended}");
            // Between the first directory and the guardian there is nobody but the next shoal.
            wait_for("everything to be removed", || {
                let mut clean = machine.shoal();
                clean.arg("clean");
                (left() == 0 || run(clean).code == Some(0) && left() == 0).then_some(())
            });
        }
    }
}

#[test]
fn live_fleets_are_left_alone() {
    let (mut fleet, root) = endless("realtime");
    let id = fleet.id();
    let alive = fleet.processes().len();
    for _ in 0..3 {
        let cleaned: Ended = shoal(&["clean", "--format", "json"]).expect(0);
        let names = |key: &str| cleaned.report[key].to_string();
        assert!(names("running").contains(&id) && !names("cleaned").contains(&id), "{cleaned}");
    }
    // Not even while it starts, or when its daemon is stopped.
    stop(fleet.daemon());
    shoal(&["clean"]).expect(0);
    signal(fleet.daemon(), Signal::CONT);
    assert_eq!(fleet.processes().len(), alive);
    let tick = fleet.tick();
    fleet.wait_tick(tick + 10);
    signal(fleet.daemon(), Signal::INT);
    fleet.wait().expect(130);
    assert_clean(&root);
}

#[test]
fn fleets_that_start_are_left_alone() {
    std::thread::scope(|scope| {
        let cleaner = scope.spawn(|| {
            for _ in 0..20 {
                shoal(&["clean"]).expect(0);
            }
        });
        while !cleaner.is_finished() {
            Run::catalog("head-on").mode("lockstep").finish().expect(0);
        }
    });
}

#[test]
fn observers_that_come_too_late_leave_nothing() {
    let Some(machine) = PrivateShm::new("-t tmpfs -o size=256m tmpfs") else { return };
    std::thread::scope(|scope| {
        let fleets = scope.spawn(|| {
            for _ in 0..10 {
                Run::scenario_by(machine.shoal(), &lanes(2, 1.0)).mode("lockstep").finish().expect(0);
            }
        });
        while !fleets.is_finished() {
            let mut ps = machine.shoal();
            ps.arg("ps");
            run(ps);
        }
    });
    let mut clean = machine.shoal();
    clean.arg("clean");
    run(clean).expect(0);
    assert_eq!(std::fs::read_dir(machine.path()).unwrap().count(), 0);
}
