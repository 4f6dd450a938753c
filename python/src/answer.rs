//! What a planner in Python answers, and what is wrong with it.

use crate::robot::form_of;
use model::{BodyKind, Drive, PlanState};
use nalgebra::Vector2;
use planners::Plan;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyFloat, PyList, PyTuple};

/// An answer with more than a command.
#[pyclass(frozen, module = "shoal", name = "Plan")]
pub(crate) struct Answer {
    command: [f64; 2],
    wheels: bool,
    stopped: bool,
    state: PlanState,
}

#[pymethods]
impl Answer {
    #[new]
    #[pyo3(signature = (command, *, wheels = false, stopped = false, state = "ready"))]
    fn new(command: &Bound<'_, PyAny>, wheels: bool, stopped: bool, state: &str) -> PyResult<Answer> {
        let known = [PlanState::Ready, PlanState::Planning, PlanState::GaveUp];
        let state = known.into_iter().find(|known| known.word() == state).ok_or_else(|| {
            PyValueError::new_err(format!("state `{state}`: not one of `ready`, `planning`, `gave-up`"))
        })?;
        let command = numbers(command)
            .map_err(|found| PyValueError::new_err(format!("a command has two numbers, found {found}")))?;
        Ok(Answer { command, wheels, stopped, state })
    }

    /// The two numbers of the command.
    #[getter]
    fn command(&self) -> (f64, f64) {
        (self.command[0], self.command[1])
    }

    /// Whether they are the rates of the left and the right wheel, rad/s.
    #[getter]
    fn wheels(&self) -> bool {
        self.wheels
    }

    /// Whether the robot stands still on purpose.
    #[getter]
    fn stopped(&self) -> bool {
        self.stopped
    }

    /// Whether there is a plan: `ready`, `planning` or `gave-up`.
    #[getter]
    fn state(&self) -> &'static str {
        self.state.word()
    }

    fn __repr__(&self) -> String {
        let ([first, second], state) = (self.command, self.state.word());
        format!("shoal.Plan(({first}, {second}), wheels={}, stopped={}, state={state:?})", self.wheels, self.stopped)
    }
}

/// The plan in an answer for a body of this kind.
///
/// # Errors
/// What is wrong with it, in words.
pub(crate) fn plan_of(answer: &Bound<'_, PyAny>, kind: BodyKind) -> Result<Plan, String> {
    let (command, wheels, stopped, state) = match answer.cast::<Answer>() {
        Ok(whole) => {
            let whole = whole.get();
            (whole.command, whole.wheels, whole.stopped, whole.state)
        }
        Err(_) => {
            let command = numbers(answer).map_err(|found| {
                format!("returned {found}, not two numbers: {} takes {}", kind.word(), form_of(kind))
            })?;
            (command, false, false, PlanState::Ready)
        }
    };
    let [first, second] = command;
    if !first.is_finite() || !second.is_finite() {
        return Err(format!("returned ({}, {}): a command must be finite", shown(first), shown(second)));
    }
    let drive = match kind {
        _ if wheels && kind != BodyKind::DiffDrive => {
            return Err(format!("returned rates of wheels, which a {} does not have", kind.word()));
        }
        _ if wheels => Drive::Wheels { rate_radps: command },
        BodyKind::Point => Drive::Velocity(Vector2::from(command)),
        BodyKind::Unicycle | BodyKind::DiffDrive => Drive::Twist { speed_mps: first, turn_radps: second },
        BodyKind::TwoLinkArm => Drive::Joints { rate_radps: command },
    };
    Ok(Plan { stopped, state, ..Plan::only(drive) })
}

/// As Python writes it.
fn shown(number: f64) -> String {
    if number.is_nan() { "nan".to_owned() } else { number.to_string() }
}

/// Two numbers: a tuple, a list, an array of shape (2,), anything that NumPy takes for one.
fn numbers(answer: &Bound<'_, PyAny>) -> Result<[f64; 2], String> {
    if let Ok(pair) = answer.cast::<PyTuple>()
        && pair.len() == 2
        && let (Ok(first), Ok(second)) = (pair.get_borrowed_item(0), pair.get_borrowed_item(1))
        && let (Ok(first), Ok(second)) = (first.cast::<PyFloat>(), second.cast::<PyFloat>())
    {
        return Ok([first.value(), second.value()]);
    }
    as_array(answer).map_err(|error| {
        let kind = answer.get_type().name().map_or_else(|_| "something else".to_owned(), |name| name.to_string());
        match error {
            Some(shape) => format!("an array of shape {shape}"),
            None if answer.is_none() => "None (is a `return` missing?)".to_owned(),
            None => match answer.len() {
                Ok(length) if answer.is_instance_of::<PyTuple>() || answer.is_instance_of::<PyList>() => {
                    format!("a {kind} of {length} that are not all numbers")
                }
                _ => format!("an object of type {kind}"),
            },
        }
    })
}

/// The slow way; fails with the shape of what is an array, but not such a one.
fn as_array(answer: &Bound<'_, PyAny>) -> Result<[f64; 2], Option<String>> {
    let py = answer.py();
    let array = || -> PyResult<Bound<'_, PyAny>> {
        if answer.is_none() {
            return Err(PyValueError::new_err("None"));
        }
        py.import(pyo3::intern!(py, "numpy"))?
            .call_method1(pyo3::intern!(py, "asarray"), (answer, pyo3::intern!(py, "float64")))
    };
    let array = array().map_err(|_| None)?;
    let shape = array.getattr(pyo3::intern!(py, "shape")).and_then(|shape| shape.repr()).map_err(|_| None)?.to_string();
    if shape != "(2,)" {
        return Err(Some(shape));
    }
    let item = |index: usize| array.get_item(index).and_then(|item| item.extract::<f64>()).map_err(|_| None);
    Ok([item(0)?, item(1)?])
}
