//! Robots with many lives: what a life leaves behind when it ends, and when it is killed before it has quite begun.

use crate::support::{Fleet, Run, assert_clean, lanes, script, signal, wait_for};
use rustix::process::Signal;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

/// A fleet in which every robot comes back as often as it has to.
fn immortal(robots: usize) -> Run {
    let scenario = format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(robots, 1.0));
    let run = Run::scenario(&scenario).mode("realtime").set("defaults.restart='on-failure'");
    run.set("defaults.restart_limit=1000").set("defaults.restart_delay_s=0.02")
}

/// Waits until the robot in this slot has had so many lives before.
fn wait_life(fleet: &mut Fleet, slot: u32, incarnation: u32) -> u32 {
    wait_for("the next life", || {
        let agents = fleet.agents();
        let agent =
            agents.iter().find(|agent| agent.slot() == Some(slot) && agent.incarnation() == Some(incarnation))?;
        Some(agent.pid)
    })
}

fn files(root: &Path) -> usize {
    let entries = std::fs::read_dir(root).into_iter().flatten().flatten();
    entries.map(|entry| if entry.path().is_dir() { files(&entry.path()) } else { 1 }).sum()
}

#[test]
fn many_lives_take_no_more_shared_memory_than_one() {
    const LIVES: u32 = 12;
    let mut fleet = immortal(2).start();
    let root = fleet.root();
    fleet.wait_tick(5);
    let before = files(&root);
    for life in 0..LIVES {
        let pid = wait_life(&mut fleet, 0, life);
        fleet.wait_ready(0, life);
        signal(pid, Signal::KILL);
    }
    wait_life(&mut fleet, 0, LIVES);
    fleet.wait_ready(0, LIVES);
    // A life has some eight files. The janitor may be at work on the last one still, and then is not there any more.
    wait_for("what dead lives left to be cleared away", || (files(&root) <= before).then_some(()));
    signal(fleet.daemon(), Signal::INT);
    let ended = fleet.wait().expect(130);
    // What a dead life counted is not lost: both robots had a period in each of their ticks, or nearly.
    let periods = |id: &str| {
        let robots = ended.report["latency"]["per_robot"].as_array().unwrap();
        robots.iter().find(|robot| robot["id"] == id).unwrap()["periods"].as_u64().unwrap()
    };
    assert!(periods("a") * 10 > periods("b"), "{ended}");
    assert_clean(&root);
}

/// A process that is killed between making a file and giving it a size leaves it empty. That stops neither the daemon
/// nor the robot's next life nor the other robots, whichever file it was.
#[test]
fn a_life_that_is_killed_while_it_makes_its_files() {
    if Command::new("strace").arg("-V").output().is_err() {
        eprintln!("skipped: there is no strace");
        return;
    }
    for nth in 1..=3 {
        let dir = TempDir::with_prefix("shoal-e2e-").unwrap();
        let shoal = crate::support::SHOAL;
        let text = format!(
            "#!/bin/sh\ncase \"$*\" in\n*'--slot 0 --incarnation 0 '*) exec strace -D -o /dev/null -e trace=ftruncate \
             -e inject=ftruncate:signal=KILL:when={nth} {shoal} agent \"$@\" ;;\nesac\nexec {shoal} agent \"$@\"\n"
        );
        let agent = script(dir.path(), "agent", &text);
        let mut fleet = immortal(2).set(&format!("defaults.agent='{}'", agent.display())).start();
        let root = fleet.root();
        wait_life(&mut fleet, 0, 1);
        fleet.wait_ready(0, 1);
        let tick = fleet.tick();
        fleet.wait_tick(tick + 5);
        let id = fleet.id();
        crate::support::shoal(&["ps", "--fleet", &id]).expect(0);
        let empty = || {
            let mut files = std::fs::read_dir(&root).into_iter().flatten().flatten();
            files.any(|file| {
                file.file_name().as_encoded_bytes().starts_with(b"iox2.")
                    && file.metadata().is_ok_and(|meta| meta.len() == 0)
            })
        };
        wait_for("the empty file to be removed", || (!empty()).then_some(()));
        signal(fleet.daemon(), Signal::INT);
        let ended = fleet.wait().expect(130);
        ended.event("died", "a");
        // The other robot was not told of the half-made board: it has one incarnation.
        let lives_before = |id: &str| {
            let mut robots = ended.report["per_robot"].as_array().unwrap().iter();
            robots.find(|robot| robot["id"] == id).unwrap()["incarnation"].as_u64().unwrap()
        };
        assert_eq!((lives_before("a"), lives_before("b")), (1, 0), "{ended}");
        assert_clean(&root);
    }
}
