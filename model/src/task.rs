//! Goals that a robot is given while it runs.
//!
//! The life of a task is in the log of the run, as [`EventKind`](crate::EventKind)s: `task` (the robot has it: it waits
//! behind other goals, or replaces them), then `task-done` or `task-dropped`; or `ignored`, with the reason. Where it came
//! from names it.

use crate::choice;
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
    /// A waiting task goes before waiting goals of a lower priority. Goals of the scenario have priority 0.
    pub priority: i32,
    /// The task is dropped if it is not done this long after the robot got it, s of simulated time, above 0.
    pub deadline_s: Option<f64>,
}

impl Task {
    /// To this place (m), behind the goals that are there, with priority 0 and without a deadline.
    pub fn to(goal: impl Into<Point2<f64>>) -> Task {
        Task { goal: goal.into(), yaw_rad: None, now: false, priority: 0, deadline_s: None }
    }
}

choice! {
    /// Why a robot that had a task has it no more without having done it.
    #[derive(Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum TaskEnd {
        /// An operator cancelled it.
        Cancelled = "cancelled",
        /// A task that was to be done at once took its place.
        Replaced = "replaced",
        /// It was not done by its deadline.
        Overdue = "deadline",
        /// The robot left, was dropped, or is dead for good.
        RobotGone = "robot-gone",
        /// The planner of the robot found no way, or the robot did not get on for too long.
        Unreachable = "unreachable",
    }
}

impl TaskEnd {
    /// Whether another robot may do what this one did not.
    pub const fn is_for_another(self) -> bool {
        matches!(self, TaskEnd::RobotGone | TaskEnd::Unreachable)
    }
}

choice! {
    /// Where a task is in its life.
    #[derive(Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum TaskState {
        /// The daemon has it; the world has not confirmed that the robot has it.
        Queued = "queued",
        /// The robot has it, behind other goals.
        Assigned = "assigned",
        /// The robot heads for it.
        Active = "active",
        /// The robot reached it.
        Done = "done",
        /// It was not done, and will not be: the reason says why.
        Failed = "failed",
        /// An operator cancelled it, or replaced it by another task.
        Cancelled = "cancelled",
        /// No robot ever had it: the reason says why.
        Refused = "refused",
    }
}

impl TaskState {
    /// Whether nothing will change any more.
    pub const fn is_final(self) -> bool {
        matches!(self, TaskState::Done | TaskState::Failed | TaskState::Cancelled | TaskState::Refused)
    }
}

/// What became of a task that a robot has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum TaskStep {
    /// The robot heads for it from now on.
    Active,
    /// The robot reached it.
    Done,
    /// The robot has it no more, and has not done it.
    Dropped(TaskEnd),
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
