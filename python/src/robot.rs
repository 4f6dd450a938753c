//! What stays the same of a robot as long as its process runs.

use model::{BodyKind, MapRef, ParamValue};
use numpy::{PyArray1, PyArray2};
use planners::Obstacle;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;
use robot_agent::AgentSpec;
use std::sync::{Arc, OnceLock};

use crate::arrays::{column, rows};

/// A robot, as its planner knows it from the beginning.
pub(crate) struct RobotData {
    pub(crate) spec: AgentSpec,
    random: PyOnceLock<Py<PyAny>>,
    /// Made when it is asked for: a map can have a million walls.
    map: OnceLock<Arc<Vec<Obstacle>>>,
}

impl RobotData {
    pub(crate) fn new(spec: AgentSpec) -> Arc<RobotData> {
        Arc::new(RobotData { spec, random: PyOnceLock::new(), map: OnceLock::new() })
    }

    /// The robot's name.
    pub(crate) fn name(&self) -> &str {
        &self.spec.robot.id
    }

    /// The fixed obstacles and all walls that the robot knows before it has seen any.
    pub(crate) fn map(&self) -> Obstacles {
        let all = || {
            let walls = self.spec.walls.as_ref().filter(|_| self.spec.robot.knows_map).map(MapRef::map);
            let walls = walls.into_iter().flat_map(|walls| (0..).zip(walls.walls()));
            let fixed = self.spec.map.iter().map(|piece| {
                let velocity = nalgebra::Vector2::zeros();
                Obstacle { id: piece.id, shape: piece.shape, velocity }
            });
            Arc::new(fixed.chain(walls.map(|(index, wall)| Obstacle::wall(index, wall))).collect())
        };
        Obstacles(Arc::clone(self.map.get_or_init(all)))
    }

    /// Its stream of random numbers, a `numpy.random.Generator`.
    pub(crate) fn random(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let make = || {
            let instance = self.spec.instance;
            let mut stream =
                model::random::Stream::new(self.spec.clock.seed, instance.index.0, instance.incarnation, "python");
            // Four words of 32 bits: the seed of the generator.
            let words: Vec<u32> = (0..4).map(|_| (stream.unit() * f64::from(u32::MAX)) as u32).collect();
            Ok(py.import("numpy.random")?.call_method1("default_rng", (words,))?.unbind())
        };
        self.random.get_or_try_init(py, make).map(|random| random.clone_ref(py))
    }
}

/// What a robot is, known from the beginning: the argument of a planner's constructor.
#[pyclass(frozen, module = "shoal", name = "Robot")]
pub(crate) struct Robot(pub(crate) Arc<RobotData>);

#[pymethods]
impl Robot {
    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    /// Its index in the fleet, from 0.
    #[getter]
    fn index(&self) -> u32 {
        self.0.spec.instance.index.0
    }

    /// How often its process was started before.
    #[getter]
    fn incarnation(&self) -> u32 {
        self.0.spec.instance.incarnation
    }

    /// How its body moves: `point`, `unicycle`, `diff-drive` or `two-link-arm`.
    #[getter]
    fn kind(&self) -> &'static str {
        self.0.spec.robot.kind.word()
    }

    /// Body radius, m.
    #[getter]
    fn radius_m(&self) -> f64 {
        self.0.spec.robot.radius_m
    }

    /// What its body can do.
    #[getter]
    fn limits(&self) -> Limits {
        Limits(self.0.spec.robot.limits)
    }

    /// Seed of the run.
    #[getter]
    fn seed(&self) -> u64 {
        self.0.spec.clock.seed
    }

    /// Length of a tick, s.
    #[getter]
    fn dt_s(&self) -> f64 {
        self.0.spec.clock.dt_s()
    }

    /// The planner that the scenario names for the robot.
    #[getter]
    fn planner(&self) -> &str {
        &self.0.spec.robot.planner
    }

    /// The parameters that the scenario gives for that planner.
    #[getter]
    fn params<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let params = PyDict::new(py);
        for (name, value) in &self.0.spec.robot.params {
            match value {
                ParamValue::Float(number) => params.set_item(name, number)?,
                ParamValue::Int(number) => params.set_item(name, number)?,
                ParamValue::Bool(value) => params.set_item(name, value)?,
                ParamValue::Choice(word) => params.set_item(name, word)?,
            }
        }
        Ok(params)
    }

    /// The fixed obstacles and all walls of the world, if the robot knows the map.
    #[getter]
    fn map(&self) -> Obstacles {
        self.0.map()
    }

    /// The robot's stream of random numbers, a `numpy.random.Generator`.
    #[getter]
    fn random(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.0.random(py)
    }

    fn __repr__(&self) -> String {
        format!("<shoal.Robot {} (index {}, {})>", self.name(), self.index(), self.kind())
    }
}

/// What a body can do.
#[pyclass(frozen, module = "shoal", name = "Limits", skip_from_py_object)]
#[derive(Clone, Copy)]
pub(crate) struct Limits(pub(crate) model::Limits);

#[pymethods]
impl Limits {
    /// Greatest speed, m/s.
    #[getter]
    fn speed_mps_max(&self) -> f64 {
        self.0.speed_mps_max
    }

    /// Greatest reverse speed, m/s.
    #[getter]
    fn reverse_mps_max(&self) -> f64 {
        self.0.reverse_mps_max
    }

    /// Smallest turning radius, m.
    #[getter]
    fn turning_radius_m_min(&self) -> f64 {
        self.0.turning_radius_m_min
    }

    /// Greatest turn rate, rad/s.
    #[getter]
    fn turn_radps_max(&self) -> f64 {
        self.0.turn_radps_max
    }

    /// Greatest acceleration, m/s².
    #[getter]
    fn accel_mps2_max(&self) -> f64 {
        self.0.accel_mps2_max
    }

    /// Greatest change of the turn rate, rad/s².
    #[getter]
    fn turn_accel_radps2_max(&self) -> f64 {
        self.0.turn_accel_radps2_max
    }

    fn __repr__(&self) -> String {
        let model::Limits { speed_mps_max, turn_radps_max, .. } = self.0;
        format!("<shoal.Limits speed_mps_max={speed_mps_max} turn_radps_max={turn_radps_max}>")
    }
}

/// The numbers that a command of this kind of body has, for messages.
pub(crate) fn form_of(kind: BodyKind) -> &'static str {
    match kind {
        BodyKind::Point => "a velocity (vx, vy) in m/s",
        BodyKind::Unicycle | BodyKind::DiffDrive => "a speed in m/s and a turn rate in rad/s (v, omega)",
        BodyKind::TwoLinkArm => "the rates of two joints in rad/s",
    }
}

/// Obstacles, as arrays with a row for each collider.
#[pyclass(frozen, module = "shoal", name = "Obstacles")]
pub(crate) struct Obstacles(pub(crate) Arc<Vec<Obstacle>>);

#[pymethods]
impl Obstacles {
    fn __len__(&self) -> usize {
        self.0.len()
    }

    /// Names the obstacle: the edges of one polygon share it; each wall of a map has its own. Shape (n,), uint32.
    #[getter]
    fn id<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        column(py, self.0.iter().map(|obstacle| obstacle.id))
    }

    /// One end of the core of each collider, m. Shape (n, 2).
    #[getter]
    fn a<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, self.0.iter().map(|obstacle| obstacle.shape.a.into()))
    }

    /// The other end, m; of a disc, the same point. Shape (n, 2).
    #[getter]
    fn b<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, self.0.iter().map(|obstacle| obstacle.shape.b.into()))
    }

    /// Distance from the core to the surface, m. Shape (n,).
    #[getter]
    fn radius_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        column(py, self.0.iter().map(|obstacle| obstacle.shape.radius))
    }

    /// Velocity, m/s. Shape (n, 2).
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, self.0.iter().map(|obstacle| obstacle.velocity.into()))
    }

    fn __repr__(&self) -> String {
        format!("<shoal.Obstacles: {} colliders>", self.0.len())
    }
}
