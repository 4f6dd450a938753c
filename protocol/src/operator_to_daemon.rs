//! What a second terminal asks of a running fleet, and what it is answered.

use model::{Fault, Mode, ProcessState, RobotIndex, Task, TaskId};
use serde::{Deserialize, Serialize};

/// Version of the requests and replies: goes up with every change of theirs. Both sides name theirs before they say
/// anything else.
pub const PROTOCOL_VERSION: u32 = 5;

/// A request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Request {
    /// Who is in the fleet?
    Status,
    /// Let one more robot join.
    Add(NewRobot),
    /// Give a robot a goal.
    Task {
        /// Name of the robot.
        robot: String,
        /// The goal.
        task: Task,
    },
    /// Do something to a robot, on purpose.
    Inject {
        /// Name of the robot.
        robot: String,
        /// What is done.
        fault: Fault,
        /// For this long in simulated time, s; `None`: until the robot is resumed.
        for_s: Option<f64>,
    },
}

/// A robot to add; what is not said comes from the scenario's defaults.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NewRobot {
    /// Its name; `None` lets the daemon find one.
    pub id: Option<String>,
    /// Where it starts, m.
    pub start_m: [f64; 2],
    /// Its heading, rad; `None` is towards its goal.
    pub start_yaw_rad: Option<f64>,
    /// Its goal, m.
    pub goal_m: [f64; 2],
    /// The heading that it is to have there, rad; `None` is any.
    pub goal_yaw_rad: Option<f64>,
    /// Its method.
    pub planner: Option<String>,
    /// How it moves: `point`, `unicycle` or `diff-drive`; arms are built in with the scenario.
    pub kind: Option<String>,
}

/// An answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Reply {
    /// To [`Request::Status`].
    Status(Status),
    /// The world has a place for the robot, and lets it in as soon as its process is ready.
    Added {
        /// Its name.
        robot: String,
        /// Its index.
        index: RobotIndex,
    },
    /// The robot has the goal.
    Tasked {
        /// Number of the task.
        id: TaskId,
    },
    /// It has been done to the robot.
    Injected {
        /// It ends after this many ticks; `None`: when the robot is resumed, or it is over already.
        ticks: Option<u64>,
    },
    /// It has been handed on to the world, which has not said within a few seconds whether it takes it, and may still do
    /// so.
    Unconfirmed {
        /// What waits.
        problem: String,
        /// What to do about it.
        hint: String,
    },
    /// It cannot be done: why, and the way out.
    Refused {
        /// What is wrong.
        problem: String,
        /// What to do about it.
        hint: Option<String>,
    },
}

/// The fleet at this moment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Name of the scenario.
    pub scenario: String,
    /// Clock mode.
    pub mode: Mode,
    /// The newest tick.
    pub tick: u64,
    /// Simulated time, s.
    pub time_s: f64,
    /// Process of the daemon.
    pub daemon_pid: u32,
    /// Process of the world.
    pub world_pid: u32,
    /// What the kernel says of it: running, stopped, or ended.
    pub world_state: ProcessState,
    /// Since the newest tick, wall time, s; `None` before the first. It grows while the world is stopped, hangs, or waits
    /// for a robot.
    pub tick_age_s: Option<f64>,
    /// The robots, in their order.
    pub robots: Vec<RobotStatus>,
}

/// One robot at this moment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RobotStatus {
    /// Its name.
    pub id: String,
    /// Its index.
    #[serde(rename = "slot")]
    pub index: RobotIndex,
    /// Its incarnation.
    pub incarnation: u32,
    /// Its process, if it has one.
    pub pid: Option<u32>,
    /// Where it is.
    pub state: ProcessState,
    /// Its method.
    pub planner: String,
    /// Position, m; `None` before it is in the world.
    pub position_m: Option<[f64; 2]>,
    /// Its goal now, m; `None` before it is in the world.
    pub goal_m: Option<[f64; 2]>,
    /// It has reached its last goal.
    pub arrived: bool,
    /// Goals reached.
    pub goals_done: u32,
    /// Goals left.
    pub goals_left: u32,
}
