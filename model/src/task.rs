//! Goals that a robot is given while it runs.
//!
//! The life of a task is in the log of the run, as [`EventKind`](crate::EventKind)s: `task` (the robot has it: it waits
//! behind other goals, or replaces them), then `task-done`; or `ignored`, with the reason. Where it came from names it.

use nalgebra::Point2;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The number of a task that an operator sent, given by the daemon: 0 for the first of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
pub struct TaskId(pub u32);

/// A goal for a robot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Task {
    /// The goal, m.
    pub goal: Point2<f64>,
    /// The heading that the robot is to have there, rad; `None` is any.
    pub yaw_rad: Option<f64>,
    /// The robot heads there at once and forgets the goals that were waiting; otherwise the task waits behind them.
    pub now: bool,
}

/// Where a goal comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum GoalSource {
    /// The robot had it from the start.
    Scenario,
    /// A task of the timeline.
    Timeline,
    /// A task of an operator.
    Operator(TaskId),
}

impl fmt::Display for TaskId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl fmt::Display for GoalSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            GoalSource::Scenario => write!(f, "scenario"),
            GoalSource::Timeline => write!(f, "timeline"),
            GoalSource::Operator(id) => write!(f, "task {id}"),
        }
    }
}
