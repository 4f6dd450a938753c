//! The report and the log of a run, as Python reads them.

use model::{Event, Outcome, RobotIndex, Scenario};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use report::{RunFacts, numbers};

/// The report of a run in one thread, as JSON.
pub(crate) fn report(scenario: Scenario, outcome: Outcome, wall_time_s: f64) -> String {
    numbers::json(&report::assemble(RunFacts::new(scenario, outcome, wall_time_s))).to_string()
}

/// The log as dicts: tick, time_s, robot, event, detail.
pub(crate) fn events<'py>(
    py: Python<'py>,
    events: &[Event],
    tick_hz: f64,
    name: &dyn Fn(RobotIndex, u64) -> String,
) -> PyResult<Bound<'py, PyList>> {
    let list = PyList::empty(py);
    for event in events {
        let entry = PyDict::new(py);
        let of = |robot: RobotIndex| name(robot, event.tick);
        entry.set_item("tick", event.tick)?;
        entry.set_item("time_s", event.tick as f64 / tick_hz)?;
        entry.set_item("robot", event.robot.map(of))?;
        entry.set_item("event", event.kind.name().word())?;
        entry.set_item("detail", event.kind.detail(&of))?;
        list.append(entry)?;
    }
    Ok(list)
}
