//! A run of the executable, and its report.

use serde_json::Value;
use shoal_tests::process::{Ended, Place, Run};

pub(crate) const SHOAL: &str = env!("CARGO_BIN_EXE_shoal");

/// Runs `shoal run` with these words, and returns its report, whatever its exit code.
pub(crate) fn report(words: &str) -> Value {
    report_of(&shoal(words))
}

/// Runs `shoal run` with these words to its end.
pub(crate) fn shoal(words: &str) -> Ended {
    let _place = Place::take();
    Run::new(SHOAL).words("run --format json").words(words).end()
}

/// The report that a run printed; its exit code is the process's.
pub(crate) fn report_of(ended: &Ended) -> Value {
    let report: Value = serde_json::from_str(&ended.stdout).unwrap_or_else(|error| panic!("{error}\n{ended}"));
    assert_eq!(report["exit_code"].as_i64(), ended.code.map(i64::from), "{ended}");
    report
}

/// What two runs of the same scenario and seed have in common in the deterministic modes: everything but the time they
/// took and the processes they were.
pub(crate) fn deterministic(report: &Value) -> Value {
    let mut kept = report.clone();
    let fields = kept.as_object_mut().expect("a report is an object");
    for field in ["mode", "wall_time_s", "rtf", "latency", "resources", "verdict", "starved_because"] {
        assert!(fields.remove(field).is_some(), "{field}");
    }
    for robot in fields["per_robot"].as_array_mut().expect("a list") {
        robot.as_object_mut().expect("an object").remove("pid");
    }
    kept
}
