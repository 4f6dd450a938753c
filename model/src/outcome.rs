//! What a run came to.

use crate::event::Event;
use crate::ids::RobotIndex;
use crate::plan::PlanState;
use serde::{Deserialize, Serialize};

/// What a run came to, by ground truth.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Ticks that were run.
    pub ticks: u64,
    /// Hash of every robot's state at every tick.
    pub trajectory_hash: u64,
    /// One entry per robot that was ever in the world, in their order.
    pub robots: Vec<RobotOutcome>,
    /// Number of times two robots began to overlap.
    pub robot_contacts: u64,
    /// Number of times a robot began to overlap an obstacle.
    pub obstacle_contacts: u64,
    /// Smallest swept clearance between two robots, m; `None` with fewer than two.
    pub min_clearance_m: Option<f64>,
    /// Smallest swept clearance between a robot and an obstacle, m; `None` without obstacles.
    pub min_obstacle_clearance_m: Option<f64>,
    /// How often the ways of two robots crossed and one of them went first (module `crossings` of the world).
    pub crossings: u64,
    /// How often that was the one that had the other on its right hand.
    pub right_of_way_violations: u64,
    /// What filters did to the commands of robots that have one.
    pub filter: FilterCount,
    /// Goals reached by all robots, including robots that have left and whose index another robot has now.
    pub goals_done: u64,
    /// The log.
    pub events: Vec<Event>,
    /// Events that did not fit the log.
    pub events_lost: u64,
}

/// What filters did to commands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FilterCount {
    /// Commands of robots with a filter.
    pub commands: u64,
    /// How many of them were changed.
    pub changed: u64,
    /// By how much in all, in greatest speeds of their robots.
    pub change: f64,
}

/// What became of one robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RobotOutcome {
    /// Which robot.
    pub robot: RobotIndex,
    /// Its last incarnation.
    pub incarnation: u32,
    /// It is within the tolerance of its last goal when the run ends (or has caught a goal that moves).
    pub arrived: bool,
    /// When it came there for good, since the start of the run (for a late joiner: since it joined), s.
    pub time_s: Option<f64>,
    /// The tick at which it did.
    pub arrived_tick: Option<u64>,
    /// The tick at which it entered the world.
    pub joined_tick: u64,
    /// How far it drove until it arrived, or in all, m.
    pub path_length_m: f64,
    /// Against the shortest free path; `None` where that is undefined.
    pub path_ratio: Option<f64>,
    /// Its time minus that of the shortest free path at its greatest speed, s; `None` where the shortest free path is
    /// undefined.
    pub time_lost_s: Option<f64>,
    /// How often it reversed its direction of driving until it arrived, or in all (module `progress` of the world).
    pub reversals: u32,
    /// Contacts it was part of.
    pub contacts: u64,
    /// Goals reached that came as tasks.
    pub tasks_done: u32,
    /// Goals reached in all.
    pub goals_done: u32,
    /// How often it has gone through the goals that it had from the start.
    pub rounds_done: u32,
    /// From where it was last to its present or last goal, m; `None` if it never was in the world.
    pub final_distance_m: Option<f64>,
    /// It has not arrived and takes part, but gets nowhere.
    pub stall: Option<Stall>,
    /// Mean speed over the last 10 s, or since it joined, of a robot that takes part and has not arrived, m/s.
    pub end_speed_mps: Option<f64>,
    /// Whether its method had a plan at the end.
    pub plan: PlanState,
    /// Smoothness (log dimensionless jerk), 0 is best; `None` for a robot that never moved.
    pub ldj: Option<f64>,
    /// It was taken out: dropped, dead for good, or left.
    pub gone: Option<Gone>,
}

crate::choice! {
    /// Why a robot is not there at the end.
    #[derive(Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Gone {
        /// It left, as it was asked to.
        Left = "left",
        /// It did not answer and was taken out.
        Dropped = "dropped",
        /// Its process ended and was not started again.
        Dead = "dead",
        /// It never entered the world.
        NeverJoined = "never-joined",
    }
}

crate::choice! {
    /// How a robot makes no progress, as the module `progress` of the world judges it.
    #[derive(Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Stall {
        /// It stands.
        Deadlocked = "deadlocked",
        /// It drives, but comes no nearer.
        Livelocked = "livelocked",
        /// It drives, but reverses all the time.
        Oscillating = "oscillating",
    }
}
