//! What the daemon tells the world: facts about processes, and what operators ask for. The world decides what they
//! mean, at the next boundary between two ticks.

use model::{Fault, PaceChange, Robot, RobotIndex, RobotInstance, Task, TaskId};
use serde::{Deserialize, Serialize};

/// One order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Order {
    /// A robot that the scenario does not have enters as this instance as soon as its agent is ready, which the daemon has
    /// begun to start.
    Admit {
        /// Its index, which is free or that of a robot that has left, and its first life, which none had before.
        instance: RobotInstance,
        /// The robot.
        robot: Box<Robot>,
    },
    /// The robot goes, and is gone. What it had to do is dropped before.
    Remove {
        /// Its index.
        index: RobotIndex,
    },
    /// The robot gets a new process; a process that it has is killed. It does not count as one of its restarts.
    Restart {
        /// Its index.
        index: RobotIndex,
    },
    /// A goal for a robot.
    Task {
        /// Its number, given by the daemon.
        id: TaskId,
        /// Index of the robot.
        index: RobotIndex,
        /// The goal.
        task: Task,
    },
    /// Something is done to a robot, on purpose.
    Fault {
        /// Its number, given by the daemon.
        id: FaultId,
        /// Index of the robot.
        index: RobotIndex,
        /// What is done.
        fault: Fault,
        /// For this many ticks, at least one; `None`: until the robot is resumed.
        ticks: Option<u64>,
    },
    /// A robot is to give up a task that it has not done.
    Cancel {
        /// Number of the task.
        id: TaskId,
        /// Index of the robot that has it.
        index: RobotIndex,
    },
    /// The process of this instance does not answer.
    Absent {
        /// Whose.
        instance: RobotInstance,
        /// Why.
        cause: Absence,
    },
    /// A daemon wants to know how everything stands: it is new, or the world is. The answer is a
    /// [`Notice::Standings`](crate::world_to_daemon::Notice::Standings) with this number.
    Resync(u64),
    /// Ticks are to stop, to go on, or to go on for a while. It takes effect between two ticks, in `lockstep` only.
    Pace {
        /// Its number, given by the daemon.
        id: PaceId,
        /// What is to be.
        change: PaceChange,
    },
    /// The run ends after the present tick.
    Stop,
}

/// What an order is called in the world's answer to it
/// ([`Notice::Answer`](crate::world_to_daemon::Notice::Answer)): those that an operator waits for have a ticket.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Ticket {
    /// [`Order::Admit`] of this instance.
    Admit(RobotInstance),
    /// [`Order::Remove`] of this robot.
    Remove(RobotIndex),
    /// [`Order::Restart`] of this robot.
    Restart(RobotIndex),
    /// [`Order::Task`] with this number.
    Task(TaskId),
    /// [`Order::Fault`] with this number.
    Fault(FaultId),
    /// [`Order::Cancel`] of the task with this number.
    Cancel(TaskId),
    /// [`Order::Pace`] with this number. Steps are answered when they have been done.
    Pace(PaceId),
}

/// The number of a change of the pace, given by the daemon. No two daemons of a fleet give the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct PaceId(pub u64);

/// The number of a fault that an operator asked for, given by the daemon: 0 for the first of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct FaultId(pub u32);

impl Order {
    /// Its ticket, if it has one.
    pub fn ticket(&self) -> Option<Ticket> {
        match self {
            Order::Admit { instance, .. } => Some(Ticket::Admit(*instance)),
            Order::Remove { index } => Some(Ticket::Remove(*index)),
            Order::Restart { index } => Some(Ticket::Restart(*index)),
            Order::Task { id, .. } => Some(Ticket::Task(*id)),
            Order::Fault { id, .. } => Some(Ticket::Fault(*id)),
            Order::Cancel { id, .. } => Some(Ticket::Cancel(*id)),
            Order::Pace { id, .. } => Some(Ticket::Pace(*id)),
            Order::Absent { .. } | Order::Resync(_) | Order::Stop => None,
        }
    }
}

/// Why a process does not answer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Absence {
    /// It died of this signal, or ended with this code.
    Died {
        /// The signal, if it was one.
        signal: Option<i32>,
        /// The exit code, if there was one.
        code: Option<i32>,
        /// What it printed last; may be empty.
        words: String,
    },
    /// It was stopped (SIGSTOP).
    Stopped,
    /// It did not answer within the straggler limit.
    Overdue,
    /// It was not ready within the start limit, or could not be started at all.
    NotStarted {
        /// The cause, with the words of the kernel where it was the kernel that refused.
        why: String,
    },
    /// It cannot hear a robot that it should hear, or the world cannot read its commands.
    Deaf {
        /// The cause, with the words of the kernel.
        why: String,
    },
}
