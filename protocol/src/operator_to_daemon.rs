//! What a second terminal asks of a running fleet, and what it is answered.

use model::{Event, Fault, Mode, PaceChange, PaceState, ProcessState, RobotIndex, Task, TaskId, TaskState};
use serde::{Deserialize, Serialize};

/// Version of the requests and replies: goes up with every change of theirs. Both sides name theirs before they say
/// anything else.
pub const PROTOCOL_VERSION: u32 = 9;

/// A request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Request {
    /// Who is in the fleet?
    Status,
    /// What has happened?
    Events {
        /// The number of the newest entry of the log that is known already, 0 if none is.
        after: u64,
    },
    /// Let one more robot join.
    Add(NewRobot),
    /// Give robots goals.
    Task(NewTasks),
    /// Which tasks are there?
    Tasks(TaskFilter),
    /// A task is not to be done any more: its number, or the name that its sender gave it.
    Cancel(String),
    /// Do something to a robot, on purpose.
    Inject {
        /// Name of the robot.
        robot: String,
        /// What is done.
        fault: Fault,
        /// For this long in simulated time, s; `None`: until the robot is resumed.
        for_s: Option<f64>,
    },
    /// End the fleet in good order.
    Stop,
    /// A robot is to leave.
    Remove {
        /// Name of the robot.
        robot: String,
    },
    /// A robot is to get a new process, whatever has become of the one that it had.
    Restart {
        /// Name of the robot.
        robot: String,
    },
    /// Ticks are to stop, to go on, or to go on for a while; in `lockstep`.
    Pace(PaceChange),
}

/// Goals for robots.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NewTasks {
    /// Who is to do them.
    pub assign: Assign,
    /// The goals, at least one; a robot that gets several does them in this order.
    pub tasks: Vec<Task>,
    /// A name by which the sender knows the task, which is the only one then. Sent again, it is the same task.
    pub key: Option<String>,
}

/// Who is to do a task.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Assign {
    /// This robot.
    Robot(String),
    /// For one goal after the other, the robot with the shortest way to it, its present goals included.
    Nearest,
    /// The robots for which the sum of these ways is the least: at most one goal for each, as far as there are robots.
    Optimal,
    /// Goal by goal the lowest bid of all robots and all goals that are left: what a robot itself says that it has left to its
    /// present goal, and its way from there.
    Auction,
}

/// Which tasks.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TaskFilter {
    /// These, by their numbers or by the names that their senders gave them; all, if there is none.
    pub which: Vec<String>,
    /// Those of this robot.
    pub robot: Option<String>,
    /// Those in one of these states; in any state, if there is none.
    pub states: Vec<TaskState>,
    /// The newest of them, no more than this number.
    pub newest: u32,
}

/// A task, and what has become of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TaskRecord {
    /// Its number.
    pub id: TaskId,
    /// The name that its sender gave it.
    pub key: Option<String>,
    /// How its robot was chosen.
    pub assign: Assign,
    /// The robot that has it, or had it.
    pub robot: String,
    /// The goal.
    pub task: Task,
    /// Where it is in its life.
    pub state: TaskState,
    /// What happened to it, in order; the last one is its state.
    pub steps: Vec<TaskChange>,
}

/// A step in the life of a task.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TaskChange {
    /// When, by the clock on the wall, ms since 1970.
    pub at_ms: u64,
    /// The state from then on.
    pub state: TaskState,
    /// The robot that had it then.
    pub robot: String,
    /// Why; may be empty.
    pub reason: String,
}

/// An entry of the log, with what its reader does not know.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EventRecord {
    /// Its number: 1 for the first entry that this daemon heard of.
    pub number: u64,
    /// What happened.
    pub event: Event,
    /// The name of the robot that it is about.
    pub robot: Option<String>,
    /// More about it, for people; may be empty.
    pub detail: String,
}

/// A robot to add; what is not said comes from the scenario's defaults.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NewRobot {
    /// Its name, which may be that of a robot that has left; `None` lets the daemon find one.
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
    /// To [`Request::Events`]: the newest entries of the log, the oldest of them first. The daemon keeps some hundred.
    Events(Vec<EventRecord>),
    /// To [`Request::Add`] and [`Request::Restart`]: the robot takes part, hears all its neighbours, and is heard by them.
    Joined {
        /// Its name.
        robot: String,
        /// Its index.
        index: RobotIndex,
        /// Its incarnation.
        incarnation: u32,
        /// Since the daemon took the request, ms.
        joined_ms: f64,
        /// The number of neighbours that it hears.
        neighbors: u32,
    },
    /// The robots have the goals, but for those tasks of several that are refused.
    Tasked(Vec<TaskRecord>),
    /// To [`Request::Tasks`], by number; to [`Request::Cancel`], the one that was cancelled.
    Tasks(Vec<TaskRecord>),
    /// The robot has left.
    Removed {
        /// Its name.
        robot: String,
    },
    /// The fleet is ending.
    Stopping,
    /// To [`Request::Pace`]: the fleet keeps this pace. Steps that took too long to be waited for are still under way then
    /// ([`PaceState::until_tick`]).
    Pace(PaceState),
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
    /// It could not be done, because of something that the request has nothing to do with, like a full disk. Nothing has
    /// changed.
    Failed {
        /// What is wrong.
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
    /// `lockstep`: no tick opens without an operator.
    pub paused: bool,
    /// Simulated time per wall time to which ticks are held, 1 in `realtime`; `None`: they follow one another as fast as the
    /// processes can.
    pub rate: Option<f64>,
    /// The robots that the newest tick of `lockstep` has been waiting for, if it has for longer than half a second.
    pub waits_for: Vec<String>,
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
    /// Its incarnation: how many lives its slot had before.
    pub incarnation: u32,
    /// How often this robot was restarted: as its incarnation, if no robot that has left had its slot.
    pub restarts: u32,
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
