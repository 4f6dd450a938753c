//! `shoal.simulate`: a whole fleet in this thread.

use crate::planner::{Failure, PythonPlanner, own_error};
use crate::results;
use crate::scenario::Scenario;
use crate::trajectories::Trajectories;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use robot_agent::{Agent, AgentSpec};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;
use world_sim::World;
use world_sim::recorder::bodies_of;

/// Ticks between two looks whether Ctrl-C was pressed.
const TICKS_PER_LOOK: u64 = 64;

/// Runs a scenario in this thread: its hash, its report as JSON, its log, its trajectories unless `trajectories` is false, and
/// the time that it took, s. `make` is called with each `shoal.Robot` and returns the function that plans, or `None` for the
/// planner that the scenario names.
#[pyfunction]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    scenario: &Scenario,
    make: Option<Py<PyAny>>,
    trajectories: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let scenario = &scenario.0;
    let failure = Arc::new(Failure::default());
    let mut kept = Trajectories::of(scenario.robots.len());
    let begun = Instant::now();
    let outcome = py.detach(|| {
        let mut world = World::new(scenario);
        if trajectories {
            world.keep_inputs();
        }
        let mut build = |spec: AgentSpec| {
            let Some(make) = &make else { return Agent::new(spec) };
            match Python::attach(|py| PythonPlanner::make(py, make, &spec, &failure, || {})) {
                Ok(Some(planner)) => Ok(Agent::with_planner(spec, Box::new(planner))),
                Ok(None) => Agent::new(spec),
                Err(error) => {
                    failure.leave(error);
                    Err(own_error(&spec))
                }
            }
        };
        let mut show = |world: &mut World| {
            if trajectories {
                if let Some(inputs) = world.take_inputs() {
                    kept.told(world.tick(), &inputs);
                }
                kept.frame(world.tick(), &bodies_of(world));
            }
        };
        single::run_with(scenario, world, &mut build, &mut show, &mut |world, _| {
            if world.tick().is_multiple_of(TICKS_PER_LOOK)
                && let Err(interrupt) = Python::attach(|py| py.check_signals())
            {
                failure.leave(interrupt);
            }
            if failure.is_there() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
    });
    let took_s = begun.elapsed().as_secs_f64();
    if let Some(error) = failure.take() {
        return Err(error);
    }
    let outcome = outcome.map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
    let tick_hz = scenario.clock.tick_hz;
    let result = PyDict::new(py);
    result.set_item("trajectory_hash", format!("{:016x}", outcome.trajectory_hash))?;
    let name = |robot: model::RobotIndex, _| {
        scenario.robots.get(robot.at()).map_or_else(String::new, |robot| robot.id.clone())
    };
    result.set_item("events", results::events(py, &outcome.events, tick_hz, &name)?)?;
    result.set_item("report", results::report(scenario.clone(), outcome, took_s))?;
    result.set_item("took_s", took_s)?;
    result.set_item("robots", scenario.robots.iter().map(|robot| robot.id.as_str()).collect::<Vec<_>>())?;
    if trajectories {
        result.set_item("arrays", kept.arrays(py, tick_hz)?)?;
    }
    Ok(result)
}
