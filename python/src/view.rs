//! What a planner in Python sees in a tick. Arrays are made when they are asked for, and are the caller's own.

use crate::arrays::{column, rows};
use crate::robot::{Limits, Obstacles, RobotData};
use numpy::{PyArray1, PyArray2};
use planners::{Neighbor, Obstacle, PlanInput};
use pyo3::prelude::*;
use std::sync::Arc;

/// What is copied out of a `PlanInput`, because a script may keep it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Seen {
    tick: u64,
    dt_s: f64,
    position: [f64; 2],
    yaw_rad: f64,
    velocity: [f64; 2],
    turn_radps: f64,
    limits: Option<model::Limits>,
    goal: [f64; 2],
    goal_tolerance_m: f64,
    goal_yaw_rad: Option<f64>,
    goal_yaw_tolerance_rad: f64,
    arrived: bool,
    joints_rad: Option<[f64; 2]>,
    neighbors: Vec<Neighbor>,
    obstacles: Arc<Vec<Obstacle>>,
    /// Normal and bound of each half-plane of allowed velocities.
    allowed: Vec<[f64; 3]>,
}

/// Sets the obstacles, in the memory of the old ones if there is no other reference to it.
fn refill(known: &mut Arc<Vec<Obstacle>>, obstacles: &[Obstacle]) {
    if known.is_empty() && obstacles.is_empty() {
        return;
    }
    match Arc::get_mut(known) {
        Some(own) => {
            own.clear();
            own.extend_from_slice(obstacles);
        }
        None => *known = Arc::new(obstacles.to_vec()),
    }
}

impl Seen {
    /// Takes everything over from the input of a tick.
    pub(crate) fn take(&mut self, input: &PlanInput<'_>) {
        self.tick = input.tick;
        self.dt_s = input.dt_s;
        self.position = input.position.into();
        self.yaw_rad = input.yaw_rad;
        self.velocity = input.velocity.into();
        self.turn_radps = input.turn_radps;
        self.limits = Some(input.limits);
        self.goal = input.goal.into();
        self.goal_tolerance_m = input.goal_tolerance_m;
        self.goal_yaw_rad = input.goal_yaw_rad;
        self.goal_yaw_tolerance_rad = input.goal_yaw_tolerance_rad;
        self.arrived = input.arrived;
        self.joints_rad = input.arm.map(|arm| arm.joints_rad);
        self.neighbors.clear();
        self.neighbors.extend_from_slice(input.neighbors);
        refill(&mut self.obstacles, input.obstacles);
        self.allowed.clear();
        self.allowed.extend(input.allowed.iter().map(|half| {
            // To the left of the line is inside: the normal points to the right.
            let normal = [half.direction.y, -half.direction.x];
            [normal[0], normal[1], normal[0] * half.point.x + normal[1] * half.point.y]
        }));
    }
}

/// Everything that a planner may look at in a tick, in the world frame.
#[pyclass(frozen, module = "shoal", name = "View")]
pub(crate) struct View {
    pub(crate) robot: Arc<RobotData>,
    pub(crate) seen: Arc<Seen>,
}

#[pymethods]
impl View {
    /// The robot's name.
    #[getter]
    fn name(&self) -> &str {
        self.robot.name()
    }

    /// The robot's index in the fleet, from 0.
    #[getter]
    fn index(&self) -> u32 {
        self.robot.spec.instance.index.0
    }

    /// The tick that is planned, from 0 at the start of the run.
    #[getter]
    fn tick(&self) -> u64 {
        self.seen.tick
    }

    /// Simulated time of this tick, s.
    #[getter]
    fn time_s(&self) -> f64 {
        self.seen.tick as f64 * self.seen.dt_s
    }

    /// Length of a tick, s.
    #[getter]
    fn dt_s(&self) -> f64 {
        self.seen.dt_s
    }

    /// Own position, m; of an arm, that of its tip. Shape (2,).
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        column(py, self.seen.position.into_iter())
    }

    /// Own heading, rad, counter-clockwise from +x.
    #[getter]
    fn yaw_rad(&self) -> f64 {
        self.seen.yaw_rad
    }

    /// Own velocity, m/s. Shape (2,).
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        column(py, self.seen.velocity.into_iter())
    }

    /// Own turn rate, rad/s.
    #[getter]
    fn turn_radps(&self) -> f64 {
        self.seen.turn_radps
    }

    /// Own body radius, m.
    #[getter]
    fn radius_m(&self) -> f64 {
        self.robot.spec.robot.radius_m
    }

    /// How the body moves: `point`, `unicycle`, `diff-drive` or `two-link-arm`.
    #[getter]
    fn kind(&self) -> &'static str {
        self.robot.spec.robot.kind.word()
    }

    /// What the body can do.
    #[getter]
    fn limits(&self) -> Limits {
        Limits(self.seen.limits.unwrap_or(self.robot.spec.robot.limits))
    }

    /// Where the robot heads now, m. Shape (2,).
    #[getter]
    fn goal<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        column(py, self.seen.goal.into_iter())
    }

    /// The goal counts as reached within this distance, m.
    #[getter]
    fn goal_tolerance_m(&self) -> f64 {
        self.seen.goal_tolerance_m
    }

    /// The heading that the robot is to have at its goal, rad, or `None` for any.
    #[getter]
    fn goal_yaw_rad(&self) -> Option<f64> {
        self.seen.goal_yaw_rad
    }

    /// That heading counts as reached within this angle, rad.
    #[getter]
    fn goal_yaw_tolerance_rad(&self) -> f64 {
        self.seen.goal_yaw_tolerance_rad
    }

    /// Whether the last goal has been reached.
    #[getter]
    fn arrived(&self) -> bool {
        self.seen.arrived
    }

    /// Joint angles of an arm, the one at the base first, rad; `None` for other bodies. Shape (2,).
    #[getter]
    fn joints_rad<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.seen.joints_rad.map(|joints| column(py, joints.into_iter()))
    }

    /// The robots that are heard on the radio, by index.
    #[getter]
    fn neighbors(&self) -> Neighbors {
        Neighbors(Arc::clone(&self.seen))
    }

    /// What the sensors see: obstacles, walls of the map, and the bodies of robots that are not heard.
    #[getter]
    fn obstacles(&self) -> Obstacles {
        Obstacles(Arc::clone(&self.seen.obstacles))
    }

    /// The fixed obstacles and all walls of the world, if the robot knows the map.
    #[getter]
    fn map(&self) -> Obstacles {
        self.robot.map()
    }

    /// The velocities that the filter allows, as rows (nx, ny, bound): allowed is `nx * vx + ny * vy <= bound`. Without a
    /// filter there are no rows. Shape (n, 3).
    #[getter]
    fn allowed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, self.seen.allowed.iter().copied())
    }

    /// The robot's stream of random numbers, a `numpy.random.Generator`: the same numbers for the same seed, robot and
    /// incarnation.
    #[getter]
    fn random(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.robot.random(py)
    }

    fn __repr__(&self) -> String {
        let [x, y] = self.seen.position;
        format!("<shoal.View of {} at tick {}: ({x:.3}, {y:.3})>", self.name(), self.seen.tick)
    }
}

/// Other robots, as arrays with a row for each.
#[pyclass(frozen, module = "shoal", name = "Neighbors")]
pub(crate) struct Neighbors(Arc<Seen>);

impl Neighbors {
    fn all(&self) -> std::slice::Iter<'_, Neighbor> {
        self.0.neighbors.iter()
    }
}

#[pymethods]
impl Neighbors {
    fn __len__(&self) -> usize {
        self.0.neighbors.len()
    }

    /// Index of the robot in the fleet. Shape (n,), uint32.
    #[getter]
    fn id<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        column(py, self.all().map(|neighbor| neighbor.id))
    }

    /// Position when it spoke, m. Shape (n, 2).
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, self.all().map(|neighbor| neighbor.position.into()))
    }

    /// Velocity when it spoke, m/s. Shape (n, 2).
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, self.all().map(|neighbor| neighbor.velocity.into()))
    }

    /// Heading when it spoke, rad. Shape (n,).
    #[getter]
    fn yaw_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        column(py, self.all().map(|neighbor| neighbor.yaw_rad))
    }

    /// Body radius, m. Shape (n,).
    #[getter]
    fn radius_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        column(py, self.all().map(|neighbor| neighbor.radius_m))
    }

    /// Age of the message, s. Shape (n,).
    #[getter]
    fn age_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        column(py, self.all().map(|neighbor| neighbor.age_s))
    }

    /// Distance to its goal, m. Shape (n,).
    #[getter]
    fn remaining_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        column(py, self.all().map(|neighbor| neighbor.remaining_m))
    }

    /// Whether it has reached its last goal. Shape (n,), bool.
    #[getter]
    fn arrived<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        column(py, self.all().map(|neighbor| neighbor.arrived))
    }

    /// Whether it stands still on purpose. Shape (n,), bool.
    #[getter]
    fn stopped<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        column(py, self.all().map(|neighbor| neighbor.stopped))
    }

    /// Where its command takes it within a tick after it spoke, m; NaN where it does not say. Shape (n, 2).
    #[getter]
    fn next<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, self.all().map(|neighbor| neighbor.next.map_or([f64::NAN; 2], Into::into)))
    }

    fn __repr__(&self) -> String {
        format!("<shoal.Neighbors: {} robots>", self.0.neighbors.len())
    }
}
