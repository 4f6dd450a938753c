//! What the world tells the daemon: whom it expects, what happened, and in the end the outcome.

use crate::daemon_to_world::Ticket;
use model::{Event, Outcome, RobotIndex, RobotInstance, TaskId, TaskStep};
use serde::{Deserialize, Serialize};

/// Something that the daemon acts on while the run goes on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Notice {
    /// The agent of this instance is needed at that tick: start it.
    Expect {
        /// Whose.
        instance: RobotInstance,
        /// When it is to take part first.
        tick: u64,
    },
    /// The robot of this instance takes part from this tick on.
    Entered {
        /// Whose.
        instance: RobotInstance,
        /// Since when.
        tick: u64,
    },
    /// Kill the process of this instance: the timeline or the straggler policy says so.
    Kill {
        /// Whose.
        instance: RobotInstance,
    },
    /// Stop the process of this instance (SIGSTOP).
    Pause {
        /// Whose.
        instance: RobotInstance,
    },
    /// Let the process of this instance go on (SIGCONT).
    Resume {
        /// Whose.
        instance: RobotInstance,
    },
    /// The robot of this instance has left; its process ends by itself.
    Left {
        /// Whose.
        instance: RobotInstance,
    },
    /// The process of this instance has ended and is not restarted, because the restart limit is reached.
    RestartLimit {
        /// Which instance.
        instance: RobotInstance,
    },
    /// The order with this ticket has taken effect, or never will.
    Answer {
        /// Which order.
        ticket: Ticket,
        /// Why it has no effect; `None` if it was taken.
        refused: Option<String>,
    },
    /// What became of a task that an operator sent and a robot has.
    Task {
        /// Number of the task.
        id: TaskId,
        /// What became of it.
        step: TaskStep,
    },
    /// How everything stands: the answer to [`Order::Resync`](crate::daemon_to_world::Order::Resync), in one piece.
    Standings(Standings),
    /// An entry for the log of the run.
    Log(Event),
}

/// How everything stands.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Standings {
    /// The number of the order that asked.
    pub number: u64,
    /// The robots, in their order: the incarnation that is in the world, or the next one, and where it is in its life.
    pub robots: Vec<(RobotInstance, Standing)>,
    /// The tasks of operators that robots have: which robot, and whether it heads for it now.
    pub tasks: Vec<(TaskId, RobotIndex, bool)>,
    /// The newest tasks of operators at their end, and how they ended.
    pub ended: Vec<(TaskId, TaskStep)>,
}

/// Where a robot is in its life, as far as its process is concerned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Standing {
    /// It enters, or comes back, with a process that the daemon has been told to start (or not yet).
    Awaited {
        /// The daemon has been told.
        told: bool,
    },
    /// It takes part.
    Present,
    /// Its process is to be stopped, or to go on.
    Paused {
        /// It is to go on.
        goes_on: bool,
    },
    /// It does not answer.
    Held,
    /// It will not come back.
    Dead,
    /// The same, because its restart limit is reached.
    RestartLimit,
    /// It has left.
    Left,
}

/// What the world leaves when its process ends.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WorldEnd {
    /// What the run came to.
    pub outcome: Outcome,
    /// Why there is no record, if one was wanted and there is none.
    pub record_failed: Option<String>,
    /// The scenario was over, or the daemon had ordered the end; `false`: the gate was stopped before.
    pub finished: bool,
}
