//! What is kept of a run: one line of `runs.jsonl`.

use crate::plan::Run;
use report::{Report, RobotReport, numbers};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The name and version of a line.
pub const SCHEMA: &str = "shoal.sweep-run/1";

/// What is kept of a run. The facts are those of its report, `shoal.report/1`, and have their names there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// [`SCHEMA`].
    pub schema: String,
    /// The number of the run in the order of the plan.
    pub run: usize,
    /// The scenario, as the command line named it.
    pub scenario: String,
    /// The planner of all robots; null: the scenario's own.
    pub planner: Option<String>,
    /// The varied keys and their values as TOML.
    pub varied: BTreeMap<String, String>,
    /// The seed.
    pub seed: u64,
    /// All robots that were to arrive did, and there was no contact.
    pub success: bool,
    /// Robots of the run.
    pub robots: usize,
    /// Robots that were to arrive: all but those on patrol and those that left as they were asked to.
    pub robots_due: usize,
    /// Those of them that did.
    pub arrived: usize,
    /// Contacts between robots.
    pub robot_contacts: u64,
    /// Contacts of robots with obstacles.
    pub obstacle_contacts: u64,
    /// When the last robot arrived, s; null unless all did.
    pub makespan_s: Option<f64>,
    /// Sum of the times of those that arrived, s; null if none did.
    pub flowtime_s: Option<f64>,
    /// Mean of the same, s.
    pub mean_time_s: Option<f64>,
    /// Path against the shortest free path, mean over those that arrived; null where it is undefined.
    pub path_ratio_mean: Option<f64>,
    /// Time minus that of the shortest free path at the greatest speed, mean over those that arrived, s; null where it is
    /// undefined.
    pub time_lost_s_mean: Option<f64>,
    /// Goals reached by all robots.
    pub goals_done: u64,
    /// The same per second of simulated time.
    pub throughput_per_s: Option<f64>,
    /// Smallest swept clearance between two robots, m.
    pub min_clearance_m: Option<f64>,
    /// Smallest swept clearance between a robot and an obstacle, m.
    pub min_obstacle_clearance_m: Option<f64>,
    /// Smoothness (log dimensionless jerk), mean over the robots; 0 is best.
    pub ldj_mean: Option<f64>,
    /// Reversals of the direction of driving per metre of path, all robots together.
    pub reversals_per_m: Option<f64>,
    /// How often the ways of two robots crossed and one of them went first.
    pub crossings: u64,
    /// How often that was the one that had the other on its right hand.
    pub right_of_way_violations: u64,
    /// Robots that stood still short of their goals.
    pub deadlocked: usize,
    /// Robots that drove without coming nearer.
    pub livelocked: usize,
    /// Robots that reversed all the time.
    pub oscillating: usize,
    /// Ticks that were run.
    pub ticks: u64,
    /// Hash of every robot's state at every tick, 16 hexadecimal digits.
    pub trajectory_hash: String,
    /// How every robot did.
    pub per_robot: Vec<RobotRecord>,
    /// What the run cost. It differs from run to run, so summary and database leave it out.
    pub cost: Cost,
}

/// What is kept of a robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotRecord {
    /// Its name.
    pub id: String,
    /// Its planner.
    pub planner: String,
    /// Whether it was at its last goal at the end.
    pub arrived: bool,
    /// When it came there since it joined, s.
    pub time_s: Option<f64>,
    /// How far it drove, m.
    pub path_length_m: f64,
    /// Against the shortest free path.
    pub path_ratio: Option<f64>,
    /// Its time minus that of the shortest free path at its greatest speed, s.
    pub time_lost_s: Option<f64>,
    /// Goals that it reached.
    pub goals_done: u32,
    /// Contacts that it was part of.
    pub contacts: u64,
    /// How far from its goal it was at the end, m.
    pub final_distance_m: Option<f64>,
    /// How it was at the end, as in the report.
    pub state: String,
    /// Mean speed over the last 10 s, m/s; null if it had arrived or did not take part at the end.
    pub end_speed_mps: Option<f64>,
    /// Smoothness.
    pub ldj: Option<f64>,
    /// Reversals of the direction of driving per metre of its path.
    pub reversals_per_m: Option<f64>,
}

/// Time that a run took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Processor time of the whole run, the world included, s.
    pub cpu_s: f64,
    /// The same for each robot and tick, us.
    pub cpu_us_per_robot_tick: Option<f64>,
}

impl Record {
    /// What is kept of a run with this report, which took this much processor time.
    pub fn new(run: &Run<'_>, report: &Report, cpu_s: f64) -> Record {
        let outcome = &report.outcome;
        let due = |robot: &&RobotReport| !robot.patrols && robot.gone != Some(model::Gone::Left);
        let due: Vec<&RobotReport> = report.per_robot.iter().filter(due).collect();
        let robot_ticks = report.ticks as f64 * report.robots as f64;
        Record {
            schema: SCHEMA.to_owned(),
            run: run.index,
            scenario: run.scenario.name.clone(),
            planner: run.planner.map(str::to_owned),
            varied: run.varied_map(),
            seed: run.seed,
            success: outcome.arrived_all && outcome.robot_contacts + outcome.obstacle_contacts == 0,
            robots: report.robots,
            robots_due: due.len(),
            arrived: due.iter().filter(|robot| robot.arrived).count(),
            robot_contacts: outcome.robot_contacts,
            obstacle_contacts: outcome.obstacle_contacts,
            makespan_s: outcome.makespan_s,
            flowtime_s: outcome.flowtime_s,
            mean_time_s: outcome.mean_time_s,
            path_ratio_mean: outcome.path_ratio_mean,
            time_lost_s_mean: outcome.time_lost_s_mean,
            goals_done: outcome.goals_done,
            throughput_per_s: outcome.throughput_per_s,
            min_clearance_m: outcome.min_clearance_m,
            min_obstacle_clearance_m: outcome.min_obstacle_clearance_m,
            ldj_mean: outcome.ldj_mean,
            reversals_per_m: outcome.reversals_per_m,
            crossings: outcome.crossings,
            right_of_way_violations: outcome.right_of_way_violations,
            deadlocked: outcome.deadlocked,
            livelocked: outcome.livelocked,
            oscillating: outcome.oscillating,
            ticks: report.ticks,
            trajectory_hash: report.trajectory_hash.clone(),
            per_robot: report.per_robot.iter().map(RobotRecord::new).collect(),
            cost: Cost {
                cpu_s,
                cpu_us_per_robot_tick: Some(1e6 * cpu_s / robot_ticks).filter(|cost_us| cost_us.is_finite()),
            },
        }
    }

    /// The record as a line, without its end.
    pub fn line(&self) -> String {
        numbers::json(self).to_string()
    }

    /// Reads a line. Every record of a summary comes from a line, also of a run that has just ended: so numbers are the same to
    /// the last bit whether the sweep was resumed or not.
    ///
    /// # Errors
    /// In words, when it is not a line of this format.
    pub fn parse(line: &str) -> Result<Record, String> {
        let record: Record = serde_json::from_str(line).map_err(|error| error.to_string())?;
        if record.schema != SCHEMA {
            return Err(format!("its schema is `{}`, not `{SCHEMA}`", record.schema.escape_debug()));
        }
        Ok(record)
    }

    /// Whether it is the record of this run.
    pub fn is_of(&self, run: &Run<'_>) -> bool {
        self.run == run.index
            && self.scenario == run.scenario.name
            && self.planner.as_deref() == run.planner
            && self.seed == run.seed
            && self.varied == run.varied_map()
    }

    /// All contacts.
    pub fn contacts(&self) -> u64 {
        self.robot_contacts + self.obstacle_contacts
    }
}

impl RobotRecord {
    fn new(robot: &RobotReport) -> RobotRecord {
        RobotRecord {
            id: robot.id.clone(),
            planner: robot.planner.clone(),
            arrived: robot.arrived,
            time_s: robot.time_s,
            path_length_m: robot.path_length_m,
            path_ratio: robot.path_ratio,
            time_lost_s: robot.time_lost_s,
            goals_done: robot.goals_done,
            contacts: robot.contacts,
            final_distance_m: robot.final_distance_m,
            state: robot.state.word().to_owned(),
            end_speed_mps: robot.end_speed_mps,
            ldj: robot.ldj,
            reversals_per_m: robot.reversals_per_m,
        }
    }
}
