//! A planner that is a Python function: the view goes in, a command comes out.

use crate::answer::plan_of;
use crate::robot::{Robot, RobotData};
use crate::slow::Stopwatch;
use crate::view::{Seen, View};
use model::Drive;
use planners::{Plan, PlanInput, Planner};
use pyo3::prelude::*;
use robot_agent::AgentSpec;
use std::sync::{Arc, Mutex, PoisonError};

/// The first error of a run. A planner cannot fail, so it leaves it here and says that the robot is to stand still.
#[derive(Debug, Default)]
pub(crate) struct Failure(Mutex<Option<PyErr>>);

impl Failure {
    /// Leaves an error, unless there is one.
    pub(crate) fn leave(&self, error: PyErr) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    }

    /// Whether there is one.
    pub(crate) fn is_there(&self) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }

    /// The error.
    pub(crate) fn take(&self) -> Option<PyErr> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// What is done with the error of a plan after it has been left.
pub(crate) type Ends = fn();

/// The planner of one robot.
pub(crate) struct PythonPlanner {
    call: Py<PyAny>,
    robot: Arc<RobotData>,
    seen: Arc<Seen>,
    failure: Arc<Failure>,
    watch: Option<Arc<Stopwatch>>,
    ends: Ends,
}

impl PythonPlanner {
    /// Has `make` make the planner of a robot: it gets the `shoal.Robot`, and returns the function that plans, or `None` for
    /// the planner that the scenario names.
    ///
    /// # Errors
    /// When `make` raises an exception.
    pub(crate) fn make(
        py: Python<'_>,
        make: &Py<PyAny>,
        spec: &AgentSpec,
        failure: &Arc<Failure>,
        ends: Ends,
    ) -> PyResult<Option<PythonPlanner>> {
        let robot = RobotData::new(spec.clone());
        let call = make.call1(py, (Robot(Arc::clone(&robot)),))?;
        if call.is_none(py) {
            return Ok(None);
        }
        let (seen, failure) = (Arc::default(), Arc::clone(failure));
        Ok(Some(PythonPlanner { call, robot, seen, failure, watch: None, ends }))
    }

    /// The same, watched by this stopwatch.
    pub(crate) fn watched(self, watch: &Arc<Stopwatch>) -> PythonPlanner {
        PythonPlanner { watch: Some(Arc::clone(watch)), ..self }
    }

    fn call(&mut self, py: Python<'_>, input: &PlanInput<'_>) -> PyResult<Plan> {
        // A script that has kept the view of an earlier tick keeps its values.
        match Arc::get_mut(&mut self.seen) {
            Some(seen) => seen.take(input),
            None => {
                let mut seen = Seen::default();
                seen.take(input);
                self.seen = Arc::new(seen);
            }
        }
        let view = View { robot: Arc::clone(&self.robot), seen: Arc::clone(&self.seen) };
        let view = Bound::new(py, view)?;
        let answer = self.call.bind(py).call1((&view,)).map_err(|error| self.raised(py, input.tick, error));
        drop(view);
        plan_of(&answer?, input.kind).map_err(|problem| self.wrong(py, input.tick, &problem))
    }

    /// The error for an exception that the function has raised.
    fn raised(&self, py: Python<'_>, tick: u64, error: PyErr) -> PyErr {
        self.error(py, tick, None, Some(error))
    }

    /// The error for an answer that is not a plan.
    fn wrong(&self, py: Python<'_>, tick: u64, problem: &str) -> PyErr {
        self.error(py, tick, Some(problem), None)
    }

    fn error(&self, py: Python<'_>, tick: u64, problem: Option<&str>, cause: Option<PyErr>) -> PyErr {
        let make = || -> PyResult<PyErr> {
            let time_s = tick as f64 * self.robot.spec.clock.dt_s();
            if let Some(cause) = &cause {
                // Where it was raised is kept beside the exception, and not in it.
                cause.value(py).setattr("__traceback__", cause.traceback(py))?;
            }
            let cause = cause.as_ref().map(|cause| cause.value(py));
            let arguments = (self.robot.name(), tick, time_s, self.call.bind(py), problem, cause);
            let error = py.import("shoal._errors")?.call_method1("plan_error", arguments)?;
            Ok(PyErr::from_value(error))
        };
        make().unwrap_or_else(|error| error)
    }
}

impl Planner for PythonPlanner {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        if let Some(watch) = &self.watch {
            watch.begin();
        }
        let plan = Python::attach(|py| self.call(py, input));
        if let Some(watch) = &self.watch {
            watch.end();
        }
        plan.unwrap_or_else(|error| {
            self.failure.leave(error);
            (self.ends)();
            Plan::only(Drive::stop(input.kind))
        })
    }
}

/// The error of an agent whose planner cannot be made; the exception itself is left elsewhere.
pub(crate) fn own_error(spec: &AgentSpec) -> robot_agent::AgentError {
    robot_agent::AgentError::Own { robot: spec.robot.id.clone(), problem: "its planner cannot be made".to_owned() }
}
