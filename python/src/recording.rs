//! `shoal.load`: a record as arrays.

use crate::results;
use crate::trajectories::Trajectories;
use model::RobotIndex;
use protocol::codec;
use protocol::inputs::WorldInputs;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use record::{InputSource, Record, RecordError};
use std::path::{Path, PathBuf};

/// What is read out of a record before Python sees it.
struct Contents {
    record: Record,
    trajectories: Trajectories,
    names: Vec<String>,
}

/// Reads a record: what it says of itself, its log, its trajectories, and the report of a run in one thread as JSON if it is
/// there to its end.
#[pyfunction]
pub(crate) fn load<'py>(py: Python<'py>, path: PathBuf) -> PyResult<Bound<'py, PyDict>> {
    let contents = py.detach(|| read(&path)).map_err(|error| refused(py, &path, &error))?;
    let Contents { record, trajectories, names } = contents;
    let (scenario, about) = (record.scenario(), record.about());
    let tick_hz = scenario.clock.tick_hz;
    let result = PyDict::new(py);
    result.set_item("name", &about.name)?;
    result.set_item("version", &about.version)?;
    result.set_item("build", &about.build)?;
    result.set_item("mode", scenario.clock.mode.word())?;
    result.set_item("seed", scenario.clock.seed)?;
    result.set_item("tick_hz", tick_hz)?;
    result.set_item("cut", record.cut().map(ToString::to_string))?;
    result.set_item("left_out", record.left_out())?;
    let name = |robot: RobotIndex, tick| record.robot_at(robot, tick).map_or_else(String::new, |own| own.id.clone());
    result.set_item("events", results::events(py, record.events(), tick_hz, &name)?)?;
    result.set_item("robots", names)?;
    result.set_item("arrays", trajectories.arrays(py, tick_hz)?)?;
    let outcome = record.ending().map(|ending| ending.outcome.clone());
    result.set_item("trajectory_hash", outcome.as_ref().map(|outcome| format!("{:016x}", outcome.trajectory_hash)))?;
    let report = outcome.filter(|_| record.added().is_empty());
    result.set_item("report", report.map(|outcome| results::report(scenario.clone(), outcome, 0.0)))?;
    Ok(result)
}

fn read(path: &Path) -> Result<Contents, RecordError> {
    let record = Record::open(path)?;
    let names: Vec<String> = record.robots().map(|(_, robot)| robot.id.clone()).collect();
    let mut trajectories = Trajectories::of(names.len());
    let (mut frames, mut inputs) = (record.frames(), record.inputs());
    // What the world was told between two frames stands with the later one, by its tick.
    let mut next = told(&mut inputs)?;
    while let Some(frame) = frames.next()? {
        while let Some((tick, inputs_of)) = next.take_if(|(tick, _)| *tick <= frame.tick) {
            trajectories.told(tick, &inputs_of);
            next = told(&mut inputs)?;
        }
        trajectories.frame(frame.tick, frame.bodies);
    }
    drop((frames, inputs));
    Ok(Contents { record, trajectories, names })
}

/// The next inputs of the world.
fn told(inputs: &mut record::Inputs<'_>) -> Result<Option<(u64, WorldInputs)>, RecordError> {
    for input in inputs {
        let input = input?;
        if input.source == InputSource::World {
            return Ok(Some((input.tick, codec::decode(&input.bytes)?)));
        }
    }
    Ok(None)
}

fn refused(py: Python<'_>, path: &Path, error: &RecordError) -> PyErr {
    let hint = match error {
        RecordError::Foreign | RecordError::Library(_) | RecordError::Io(_) => {
            "`shoal run --record FILE` writes what is read here"
        }
        RecordError::Beginning(_) | RecordError::Damaged(_) => "was it copied in full? else record the run again",
        _ => "record the run again with this shoal",
    };
    let text = format!("record `{}`: {error}\nhint: {hint}", path.display());
    let made = py.import("shoal._errors").and_then(|errors| errors.call_method1("record_error", (text,)));
    made.map_or_else(|error| error, PyErr::from_value)
}
