//! `shoal.run`: this process as the agent of a robot.

use crate::planner::{Failure, PythonPlanner, own_error};
use crate::slow::Stopwatch;
use model::Mode;
use pyo3::prelude::*;
use robot_agent::shell::{self, Args, ShellError};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;

/// What unwinds from a plan that failed to the end of the agent.
struct PlanFailed;

/// Runs this process as an agent until its robot leaves or the run ends. `arguments` are those of the process; `make` is
/// called with the `shoal.Robot` and returns the function that plans; `place` says where that is.
#[pyfunction]
pub(crate) fn run_agent(py: Python<'_>, arguments: Vec<String>, make: Py<PyAny>, place: String) -> PyResult<()> {
    let args = match Args::after_own(arguments) {
        Ok(args) => args,
        Err(error) => return Err(failed(py, "usage_error", &error.to_string())),
    };
    let main: u64 = py.import("threading")?.call_method0("get_ident")?.extract()?;
    let failure = Arc::new(Failure::default());
    let mut watched = None;
    let result = py.detach(|| {
        let mut build = |spec: &robot_agent::AgentSpec| {
            let ends = || resume_unwind(Box::new(PlanFailed));
            let made = Python::attach(|py| PythonPlanner::make(py, &make, spec, &failure, ends));
            let planner = match made {
                Ok(Some(planner)) => planner,
                Ok(None) => return robot_agent::planner_of(spec),
                Err(error) => {
                    failure.leave(error);
                    return Err(own_error(spec));
                }
            };
            let period_s = (spec.clock.mode == Mode::Realtime).then(|| spec.clock.dt_s());
            let watch = Stopwatch::new(&spec.robot.id, place.clone(), period_s);
            watched = Some((watch.watch(main), Arc::clone(&watch)));
            Ok(Box::new(planner.watched(&watch)) as Box<dyn planners::Planner>)
        };
        catch_unwind(AssertUnwindSafe(|| shell::run(&args, &mut build, &mut |_, _| {})))
    });
    if let Some((thread, watch)) = watched {
        watch.stop();
        thread.thread().unpark();
        // It may wait for this thread to let go of Python.
        py.detach(|| drop(thread.join()));
    }
    match (failure.take(), result) {
        (Some(error), _) => Err(error),
        (None, Ok(Ok(()))) => Ok(()),
        (None, Ok(Err(error @ ShellError::Usage(_)))) => Err(failed(py, "usage_error", &error.to_string())),
        (None, Ok(Err(error))) => Err(failed(py, "fleet_error", &error.to_string())),
        (None, Err(panic)) => resume_unwind(panic),
    }
}

/// An exception of this module's own.
fn failed(py: Python<'_>, kind: &str, text: &str) -> PyErr {
    let made = py.import("shoal._errors").and_then(|errors| errors.call_method1(kind, (text,)));
    made.map_or_else(|error| error, PyErr::from_value)
}
