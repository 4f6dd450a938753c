//! `shoal replay`: runs of real processes, recorded and computed again from their records alone.

use crate::support::{SHOAL, shoal};
use serde_json::Value;
use shoal_tests::process::Run;
use std::path::Path;

/// What `replay --verify` says of a record, and its exit code.
fn verify(path: &Path) -> (Option<i32>, Value) {
    let ended = Run::new(SHOAL).words(&format!("replay {} --verify --format json", path.display())).end();
    let document = serde_json::from_str(&ended.stdout).unwrap_or_else(|error| panic!("{error}: {ended}"));
    (ended.code, document)
}

/// Records a run, and verifies it to its end.
fn check(line: &str) {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = directory.path().join("run.mcap");
    let ended = shoal(&format!("{line} --record {}", path.display()));
    assert!(matches!(ended.code, Some(0 | 1 | 4)), "{ended}");
    let (code, document) = verify(&path);
    assert_eq!(code, Some(0), "{line}: {document:#}");
    let verdict = &document["verdict"];
    assert_eq!((&document["equal"], &verdict["is_whole"]), (&Value::Bool(true), &Value::Bool(true)), "{document:#}");
    assert_eq!(verdict["unverified"], Value::Array(Vec::new()), "{line}: {document:#}");
    let count = |key: &str| verdict[key].as_u64().unwrap_or(0);
    assert!(count("commands") > 0 && count("steps") > 0, "{line}: {document:#}");
    let left_out = record::Record::open(&path).expect("a record").left_out();
    assert_eq!(count("frames") + left_out, count("ticks") + 1, "{line}: {document:#}");
    // On a machine that is very busy a `realtime` world holds the command of a robot that missed a period, and leaves out frames
    // rather than wait for the disk.
    if !line.contains("realtime") {
        assert!(count("steps") >= count("commands"), "{line}: {document:#}");
        assert_eq!(left_out, 0, "{line}: frames left out");
    }
}

#[test]
fn demo_15_is_the_same_again_in_every_mode() {
    for mode in ["single", "lockstep", "realtime"] {
        for filter in ["none", "shared-gap"] {
            check(&format!("demo-15 --mode {mode} --filter {filter} --duration 6s"));
        }
    }
}

#[test]
fn so_is_a_run_with_lost_and_late_messages() {
    for mode in ["lockstep", "realtime"] {
        for filter in ["none", "shared-gap"] {
            let radio = "--set radio.drop=0.2 --set radio.delay_ticks=2 --set radio.noise_m=0.01";
            check(&format!("demo-15 --mode {mode} --filter {filter} --duration 4s {radio}"));
        }
    }
}

#[test]
fn so_are_obstacles_that_move_and_other_planners() {
    for line in ["moving-obstacles", "late-join", "unicycle-15 --planner orca", "ring-15 --planner decentralized-apf"] {
        check(&format!("{line} --mode realtime --duration 4s"));
    }
}
