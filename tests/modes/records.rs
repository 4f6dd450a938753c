//! The record of a run: the same from real processes as from one thread, whole or not there at all.

use crate::support::{SHOAL, report_of, shoal};
use model::{Mode, RobotIndex};
use record::{Body, Record};
use rustix::process::Signal;
use shoal_tests::process::{Place, Run, wait_for};
use std::path::Path;

fn read(path: &Path) -> Record {
    Record::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn frames(record: &Record) -> Vec<(u64, Vec<Body>)> {
    let mut all = Vec::new();
    let mut frames = record.frames();
    while let Some(frame) = frames.next().expect("it is not damaged") {
        all.push((frame.tick, frame.bodies.to_vec()));
    }
    all
}

/// Late joiners, tasks and moving obstacles: every body at every tick to the last bit, and the same log.
#[test]
fn single_and_lockstep_record_the_same() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    for name in ["demo-15", "late-join", "moving-obstacles"] {
        let [single, lockstep] = ["single", "lockstep"].map(|mode| {
            let path = directory.path().join(format!("{name}-{mode}.mcap"));
            let ended = shoal(&format!("{name} --mode {mode} --record {}", path.display()));
            let (report, record) = (report_of(&ended), read(&path));
            assert_eq!(ended.code, Some(0), "{ended}");
            assert_eq!(report["record"].as_str(), path.to_str(), "{ended}");
            assert!(record.is_whole() && record.left_out() == 0, "{ended}");
            let hash = format!("{:016x}", record.ending().expect("it is whole").outcome.trajectory_hash);
            assert_eq!(report["trajectory_hash"], hash, "{ended}");
            assert_eq!(record.events(), record.ending().expect("it is whole").outcome.events);
            record
        });
        let mut scenario = lockstep.scenario().clone();
        scenario.clock.mode = Mode::Single;
        assert_eq!(single.scenario(), &scenario, "{name}");
        assert_eq!(single.ending(), lockstep.ending(), "{name}");
        assert_eq!(single.added(), lockstep.added(), "{name}");
        let (single, lockstep) = (frames(&single), frames(&lockstep));
        let differs = single.iter().zip(&lockstep).find(|(a, b)| a != b);
        assert!(differs.is_none() && single.len() == lockstep.len(), "{name}: {differs:?}");
        let ticks: Vec<u64> = single.iter().map(|(tick, _)| *tick).collect();
        assert_eq!(ticks, (0..ticks.len() as u64).collect::<Vec<_>>(), "{name}: a frame for every tick");
    }
}

/// What is recorded is what happened: the frames against the report.
#[test]
fn a_record_agrees_with_its_report() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = directory.path().join("late.mcap");
    let report = report_of(&shoal(&format!("late-join --mode lockstep --record {}", path.display())));
    let record = read(&path);
    let frames = frames(&record);
    assert_eq!(frames.len() as u64, report["ticks"].as_u64().expect("a number") + 1);
    for (slot, robot) in report["per_robot"].as_array().expect("a list").iter().enumerate() {
        let own: Vec<&Body> = (frames.iter())
            .filter_map(|(_, bodies)| bodies.iter().find(|body| !body.is_obstacle() && body.index as usize == slot))
            .collect();
        let legs = own.windows(2).map(|pair| {
            let ([ax, ay], [bx, by]) = (pair[0].position_m, pair[1].position_m);
            (bx - ax).hypot(by - ay)
        });
        let (driven, told) = (legs.sum::<f64>(), robot["path_length_m"].as_f64().expect("a number"));
        // The report's path ends at the goal; what follows is how a robot comes to rest. Who has left when a tick opens
        // is not in its frame: the last move before that is not seen.
        let unseen = if robot["gone"] == "left" { 0.021 } else { 1e-6 };
        assert!((told - unseen..told + 0.2).contains(&driven), "{slot}: {driven} against {told}");
        assert_eq!(record.robot(RobotIndex::of(slot)).map(|robot| robot.id.as_str()), robot["id"].as_str());
    }
}

/// Ended by a signal, a run has a whole record; killed, it has one that can be read to its last chunk, and nothing else is
/// left where it is.
#[test]
fn a_run_that_is_broken_off() {
    for signal in [Signal::INT, Signal::KILL] {
        let _place = Place::take();
        let directory = tempfile::tempdir().expect("a temporary directory");
        let path = directory.path().join("run.mcap");
        let line = format!(
            "run head-on --mode realtime --set clock.stop=\"duration\" --duration 1h --record {}",
            path.display()
        );
        let running = Run::new(SHOAL).words(&line).start();
        wait_for("the fleet", || {
            let ended = Run::new(SHOAL).words("ps --format json").end();
            let fleets: serde_json::Value = serde_json::from_str(&ended.stdout).ok()?;
            let own =
                |fleet: &serde_json::Value| fleet["daemon_pid"] == running.pid() && fleet["tick"].as_u64() > Some(100);
            fleets["fleets"].as_array()?.iter().any(own).then_some(())
        });
        running.signal(signal);
        let ended = running.end();
        let names: Vec<_> = std::fs::read_dir(directory.path()).expect("a directory").flatten().collect();
        assert_eq!(names.len(), 1, "{signal:?}: {names:?}: {ended}");
        let record = read(&path);
        let ticks: Vec<u64> = frames(&record).into_iter().map(|(tick, _)| tick).collect();
        assert!(ticks.len() > 40 && ticks.iter().copied().eq(0..ticks.len() as u64), "{ticks:?}: {ended}");
        if signal == Signal::INT {
            assert_eq!(ended.code, Some(130), "{ended}");
        }
        assert_eq!((record.is_whole(), record.ending().is_some()), (signal == Signal::INT, signal == Signal::INT));
    }
}
