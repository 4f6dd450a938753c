//! The report of a run, `shoal.report/1`: what came out, in navigation and in time.
//!
//! ```text
//! RunFacts --assemble--> Report --text::render--> people
//!             |                 --JSON----------> programs
//!             '-- judge: verdict, expectations, exit code
//! ```
//! Everything is pure. The names of the fields are a contract: fields may be added, none renamed. What
//! a clock mode does not have is null.

mod assemble;
pub mod exit;
pub mod judge;
pub mod layout;
pub mod measured;
pub mod numbers;
mod tasks;
pub mod text;

pub use assemble::assemble;
pub use layout::{Column, Page, cut, table};

use model::{
    Cause, EventName, Gone, Mode, Outcome, PerCause, PerMetric, Physics, PlanState, RobotIndex, RobotInstance,
    RobotState, Scenario, Stall,
};
use serde::{Deserialize, Serialize};

/// The name and version of the format.
pub const SCHEMA: &str = "shoal.report/1";

/// What is known about a run when it has ended.
#[derive(Clone, Debug)]
pub struct RunFacts {
    /// What was run, overrides applied.
    pub scenario: Scenario,
    /// What it came to, by ground truth.
    pub outcome: Outcome,
    /// The robots by slot: those of the scenario, then those that were added while it ran.
    pub robots: Vec<RobotFacts>,
    /// From the first tick to the end of the last, s, wall clock.
    pub wall_time_s: f64,
    /// Ctrl-C, or a signal that asks to end.
    pub interrupted: bool,
    /// What was measured in the loop; `None` in `single`.
    pub latency: Option<LatencyFacts>,
    /// Robots that were held or dropped because they did not answer: how often.
    pub stragglers: u64,
    /// The processes of the fleet; empty in `single`.
    pub processes: Vec<ProcessFacts>,
    /// From the command to the first tick, ms.
    pub startup_ms: Option<f64>,
    /// Shared memory of the fleet, bytes.
    pub shm_bytes: Option<u64>,
    /// Where the record of the run is.
    pub record: Option<String>,
    /// What went wrong around the run, in words.
    pub failures: Vec<String>,
}

impl RunFacts {
    /// The facts of a run of the scenario's own robots, everything else still unknown.
    pub fn new(scenario: Scenario, outcome: Outcome, wall_time_s: f64) -> RunFacts {
        let robots = scenario.robots.iter().map(RobotFacts::of).collect();
        RunFacts {
            scenario,
            outcome,
            robots,
            wall_time_s,
            interrupted: false,
            latency: None,
            stragglers: 0,
            processes: Vec::new(),
            startup_ms: None,
            shm_bytes: None,
            record: None,
            failures: Vec::new(),
        }
    }
}

/// What the report says about a robot besides its outcome.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RobotFacts {
    /// Its name.
    pub id: String,
    /// How often it goes through its goals; `None` is forever.
    pub rounds: Option<u32>,
    /// Its method.
    pub planner: String,
}

impl RobotFacts {
    /// Of a robot of a scenario, or of one that was added.
    pub fn of(robot: &model::Robot) -> RobotFacts {
        RobotFacts { id: robot.id.clone(), rounds: robot.rounds, planner: robot.planner.clone() }
    }
}

/// What was measured in the loop of all agents and of the world, merged. Null and zero counts mean: not measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LatencyFacts {
    /// A distribution for each metric, us.
    #[serde(flatten)]
    pub metrics: PerMetric<Option<Percentiles>>,
    /// Periods that were to be run, all agents and the world together; null in `lockstep`.
    pub periods: Option<u64>,
    /// Periods that were missed; null in `lockstep`.
    pub deadline_misses: Option<u64>,
    /// Why periods were late; null in `lockstep`.
    #[serde(default)]
    pub blame: Option<Blame>,
    /// How the world's loop did.
    #[serde(default)]
    pub world: Option<LoopLatency>,
    /// How the loop of every robot did, all its incarnations together, in the order of the robots.
    #[serde(default)]
    pub per_robot: Vec<LoopLatency>,
}

/// Late periods: those that began later than a fifth of a period, ended too late, never began, or worked with old
/// odometry (`bus::blame`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Blame {
    /// All of them.
    pub late: u64,
    /// How many of them each cause delayed.
    #[serde(flatten)]
    pub by_cause: PerCause<u64>,
}

impl Blame {
    /// Late periods by cause.
    pub fn of(by_cause: PerCause<u64>) -> Blame {
        Blame { late: by_cause.iter().map(|(_, n)| n).sum(), by_cause }
    }

    /// What delayed most of them, and how many, if anything was late. Of causes that delayed equally many, the first.
    pub fn most(&self) -> Option<(Cause, u64)> {
        let causes = self.by_cause.iter().filter(|(_, n)| **n > 0);
        causes.rev().max_by_key(|(_, n)| **n).map(|(cause, n)| (cause, *n))
    }
}

/// How one loop did in time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LoopLatency {
    /// The robot, or [`ProcessFacts::WORLD`].
    pub id: String,
    /// Its index; null for the world.
    #[serde(rename = "slot")]
    pub index: Option<RobotIndex>,
    /// A distribution for each metric, us. What the world measures of a robot is within 6.3 %.
    #[serde(flatten)]
    pub metrics: PerMetric<Option<Percentiles>>,
    /// Periods that were to be run, or ticks answered.
    pub periods: u64,
    /// Periods that were missed; null in `lockstep`.
    pub deadline_misses: Option<u64>,
    /// Why periods were late; null in `lockstep`.
    pub blame: Option<Blame>,
    /// Share of the time in which it was ready and had no processor; null where it is not known.
    pub run_queue_wait: Option<f64>,
}

/// A distribution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Percentiles {
    /// Median.
    pub p50: f64,
    /// 90 % are at most this.
    pub p90: f64,
    /// 99 % are at most this.
    pub p99: f64,
    /// 99.9 % are at most this.
    pub p999: f64,
    /// The largest.
    pub max: f64,
    /// How many.
    pub n: u64,
}

/// A process of the fleet, one entry per life.
#[derive(Clone, Debug, PartialEq)]
pub struct ProcessFacts {
    /// What it is: [`ProcessFacts::WORLD`], `daemon`, `guardian`, or the robot's name.
    pub name: String,
    /// Whose agent it is, if it is one.
    pub instance: Option<RobotInstance>,
    /// Its number.
    pub pid: u32,
    /// Processor time it used, s.
    pub cpu_s: f64,
    /// Its proportional share of memory, KiB, sampled while it ran.
    pub pss_kib: Option<u64>,
    /// How long it was ready to run but did not, s (`/proc/PID/schedstat`, from the first tick on: starting a fleet
    /// is not part of the run).
    pub run_queue_wait_s: Option<f64>,
}

impl ProcessFacts {
    /// The name of the world's process.
    pub const WORLD: &'static str = "world";

    /// Whether it is part of the loop: the world or an agent.
    pub fn in_loop(&self) -> bool {
        self.instance.is_some() || self.name == ProcessFacts::WORLD
    }
}

/// Whether the numbers speak about the method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// They do.
    Valid,
    /// The machine, not the method, shaped the result.
    Starved,
    /// A robot lacked something that it needed: the result is not that of the scenario.
    Impaired,
}

/// The report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// [`SCHEMA`].
    pub schema: String,
    /// Name of the scenario.
    pub scenario: String,
    /// Clock mode.
    pub mode: Mode,
    /// The method, or `mixed`.
    pub planner: String,
    /// The filter of the robots, or `mixed`.
    pub filter: String,
    /// What moved the bodies.
    #[serde(default)]
    pub physics: Physics,
    /// Seed of everything random.
    pub seed: u64,
    /// Robots of the scenario, and those that were added.
    pub robots: usize,
    /// Ticks per second of simulated time.
    pub tick_hz: f64,
    /// Ticks that were run.
    pub ticks: u64,
    /// Simulated time, s.
    pub sim_time_s: f64,
    /// Wall time of the same, s.
    pub wall_time_s: f64,
    /// Real-time factor: simulated over wall time.
    pub rtf: Option<f64>,
    /// Hash of every robot's state at every tick, 16 hexadecimal digits.
    pub trajectory_hash: String,
    /// Whether the numbers speak about the method.
    pub verdict: Verdict,
    /// The exit code of the run.
    pub exit_code: i32,
    /// How the fleet did.
    pub outcome: OutcomeReport,
    /// How every robot did, by slot.
    pub per_robot: Vec<RobotReport>,
    /// How the loop did in time; null in `single`.
    pub latency: Option<LatencyReport>,
    /// What it cost.
    pub resources: ResourcesReport,
    /// What happened, in order.
    pub events: Vec<EventReport>,
    /// Why the machine, not the method, shaped the result; empty if it did not.
    pub starved_because: Vec<String>,
    /// Why the verdict is `impaired`; empty if it is not.
    #[serde(default)]
    pub impaired_because: Vec<String>,
    /// Expectations that were not met, in words; empty if all were.
    pub unmet: Vec<String>,
    /// What went wrong around the run: it was cut short, or something that was to be kept of it is missing. Not the
    /// robots' doing; exit code 3. Empty if nothing did.
    #[serde(default)]
    pub failures: Vec<String>,
    /// Whether the run was interrupted.
    pub interrupted: bool,
    /// The run ends at this simulated time at the latest, s.
    pub sim_time_s_max: f64,
    /// Events that the log had no room for.
    pub events_lost: u64,
    /// Where the record of the run is, for `shoal plot`; null if there is none.
    #[serde(default)]
    pub record: Option<String>,
    /// What is questionable about the scenario, as `shoal validate` says it.
    #[serde(default)]
    pub warnings: Vec<String>,
}

/// How the fleet did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OutcomeReport {
    /// Robots that were at their last goal at the end.
    pub arrived: usize,
    /// All of them did; a robot that left on request owes nothing.
    pub arrived_all: bool,
    /// Robots that arrived and were never in contact.
    pub succeeded: usize,
    /// When the last robot arrived, s; null unless all did.
    pub makespan_s: Option<f64>,
    /// Sum of the times of those that arrived, s; null if none did.
    pub flowtime_s: Option<f64>,
    /// Mean time of those that arrived, s; null if none did.
    pub mean_time_s: Option<f64>,
    /// Path of all robots together, m.
    pub path_length_m: f64,
    /// Path against the shortest free path, mean over those that arrived; null where it is undefined.
    pub path_ratio_mean: Option<f64>,
    /// The largest of the same.
    pub path_ratio_max: Option<f64>,
    /// Time minus that of the shortest free path at the greatest speed, mean over those that arrived, s; null where it is
    /// undefined.
    #[serde(default)]
    pub time_lost_s_mean: Option<f64>,
    /// The largest of the same, s.
    #[serde(default)]
    pub time_lost_s_max: Option<f64>,
    /// Goals reached by all robots, including robots that have left.
    #[serde(default)]
    pub goals_done: u64,
    /// Goals reached per second of simulated time, the throughput of a flow; null before the first tick.
    #[serde(default)]
    pub throughput_per_s: Option<f64>,
    /// Times that two robots began to overlap.
    pub robot_contacts: u64,
    /// Times that a robot began to overlap an obstacle.
    pub obstacle_contacts: u64,
    /// Smallest swept clearance between two robots, m.
    pub min_clearance_m: Option<f64>,
    /// Smallest swept clearance between a robot and an obstacle, m.
    pub min_obstacle_clearance_m: Option<f64>,
    /// Robots that had not arrived, made no progress and hardly moved at the end.
    pub deadlocked: usize,
    /// Robots that had not arrived and drove without making progress.
    #[serde(default)]
    pub livelocked: usize,
    /// The same of those that reversed all the time.
    #[serde(default)]
    pub oscillating: usize,
    /// Log dimensionless jerk, 0 is best, mean over the robots that moved.
    pub ldj_mean: Option<f64>,
    /// Reversals of the direction of driving, of all robots together, per metre of their paths; null if none moved.
    #[serde(default)]
    pub reversals_per_m: Option<f64>,
    /// How often the ways of two robots crossed and one of them went first.
    #[serde(default)]
    pub crossings: u64,
    /// How often that was the one that had the other on its right hand.
    #[serde(default)]
    pub right_of_way_violations: u64,
    /// Share of robot-ticks in which the safety filter changed the command; null without a filter.
    pub filter_interventions: Option<f64>,
    /// By how much it changed those, as a share of the greatest speed, mean; null if it changed none.
    #[serde(default)]
    pub filter_change_mean: Option<f64>,
}

/// How one robot did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotReport {
    /// How often it went through its goals; null for a robot that goes through them once.
    #[serde(default)]
    pub rounds: Option<u32>,
    /// It goes through them forever: it never arrives, and is not expected to.
    #[serde(default)]
    pub patrols: bool,
    /// Its name.
    pub id: String,
    /// Its method.
    pub planner: String,
    /// Its last life.
    pub incarnation: u32,
    /// Its last process; null in `single`.
    pub pid: Option<u32>,
    /// It was within the tolerance of its last goal at the end (or had caught a goal that moves).
    pub arrived: bool,
    /// When it came there for good, since it joined, s.
    pub time_s: Option<f64>,
    /// Its path until then, or in all, m.
    pub path_length_m: f64,
    /// Against the shortest free path; null where that is undefined.
    pub path_ratio: Option<f64>,
    /// Its time minus that of the shortest free path at its greatest speed, s; null where that is undefined.
    #[serde(default)]
    pub time_lost_s: Option<f64>,
    /// Contacts it was part of.
    pub contacts: u64,
    /// Goals reached that came as tasks.
    pub tasks_done: u32,
    /// Goals reached in all.
    pub goals_done: u32,
    /// It had not arrived, made no progress and hardly moved at the end.
    pub deadlocked: bool,
    /// What became of it.
    #[serde(default)]
    pub state: RobotState,
    /// How it got nowhere at the end, whatever its planner said; null if it did not, or had arrived.
    #[serde(default)]
    pub stall: Option<Stall>,
    /// Mean speed over the last 10 s, m/s; null if it had arrived or did not take part at the end.
    #[serde(default)]
    pub end_speed_mps: Option<f64>,
    /// From where it was last to its present or last goal, m; null if it never was in the world.
    #[serde(default)]
    pub final_distance_m: Option<f64>,
    /// Whether its planner had a plan at the end: `ready`, `planning` or `gave-up`.
    #[serde(default)]
    pub planner_state: PlanState,
    /// Log dimensionless jerk, 0 is best.
    pub ldj: Option<f64>,
    /// How often it reversed its direction of driving until it arrived, or in all.
    #[serde(default)]
    pub reversals: u32,
    /// The same per metre of its path; null if it did not move.
    #[serde(default)]
    pub reversals_per_m: Option<f64>,
    /// Why it was not there at the end.
    pub gone: Option<Gone>,
}

/// How the loop did in time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LatencyReport {
    /// What the processes measured.
    #[serde(flatten)]
    pub measured: LatencyFacts,
    /// Times that a robot was held or dropped because it did not answer.
    pub stragglers: u64,
    /// Times that time stood still for the world (stopped, frozen, without a processor) for longer than it makes up for:
    /// that time was skipped; 0 in `lockstep`.
    #[serde(default)]
    pub gaps: u64,
    /// How long all of these were together, ms.
    #[serde(default)]
    pub gaps_ms: u64,
}

/// What the run cost.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ResourcesReport {
    /// From the command to the first tick, ms.
    pub startup_ms: Option<f64>,
    /// Processor time of all processes, s.
    pub cpu_s: Option<f64>,
    /// Proportional share of memory of an agent, mean, KiB.
    pub agent_pss_kib_mean: Option<f64>,
    /// The largest of the same, KiB.
    pub agent_pss_kib_max: Option<u64>,
    /// Shared memory of the fleet, bytes.
    pub shm_bytes: Option<u64>,
    /// Longest wait of an agent or the world for a processor, as a share of the wall time.
    pub run_queue_wait_max: Option<f64>,
    /// Processors and scheduling classes that the scenario gave the processes; null if it gave none, and in `single`.
    #[serde(default)]
    pub scheduling: Option<SchedulingReport>,
}

/// Processors and scheduling classes of the processes of a fleet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SchedulingReport {
    /// Of the world.
    pub world: ProcessScheduling,
    /// Of every agent.
    pub agents: ProcessScheduling,
}

/// Processors and scheduling class of a process. What is null it has from whoever started shoal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProcessScheduling {
    /// Processors that it might use.
    pub cpus: Option<Vec<u16>>,
    /// Its class: `other`, `batch`, `fifo` or `rr`.
    pub class: Option<String>,
    /// Its priority, if the class is a real-time one.
    pub priority: Option<u8>,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EventReport {
    /// At which tick.
    pub tick: u64,
    /// The same as simulated time, s.
    pub t_s: f64,
    /// What.
    pub kind: EventName,
    /// The robot it is about, if it is about one.
    pub robot: Option<String>,
    /// More about it, for people.
    pub detail: String,
    /// Of a contact: the other robot, or `obstacle` and its place in the scenario; null for everything else.
    #[serde(default)]
    pub with: Option<String>,
    /// Of a contact: where the surfaces met first, m; null for everything else.
    #[serde(default)]
    pub at_m: Option<[f64; 2]>,
    /// Of a contact: when they did, between the ticks, s.
    #[serde(default)]
    pub touch_s: Option<f64>,
}

#[cfg(test)]
mod tests;
