//! A row of a summary: the runs that differ in their seeds only, alone and against those of the baseline.

use crate::record::Record;
use crate::statistics::{bootstrap, mean, median, wilson};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// The runs that differ in their seeds only.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The scenario.
    pub scenario: String,
    /// The planner; null: the scenario's own.
    pub planner: Option<String>,
    /// The varied keys and their values.
    pub varied: BTreeMap<String, String>,
    /// Number of runs.
    pub runs: usize,
    /// Number of different trajectories: with 1, the seed changes nothing, and the runs are one.
    pub trajectories: usize,
    /// Runs in which all robots arrived and nothing touched.
    pub successes: usize,
    /// Their share.
    pub success_rate: f64,
    /// Its Wilson interval.
    pub success_rate_95: Option<[f64; 2]>,
    /// Robots that were to arrive, in all runs.
    pub robots_due: usize,
    /// Those that did.
    pub arrived: usize,
    /// Their share.
    pub arrival_rate: Option<f64>,
    /// Contacts between robots, in all runs.
    pub robot_contacts: u64,
    /// Contacts with obstacles, in all runs.
    pub obstacle_contacts: u64,
    /// Median makespan of the successful runs, s; null if there is none.
    pub makespan_s_median: Option<f64>,
    /// Its bootstrap interval; null with fewer than two successful runs.
    pub makespan_s_median_95: Option<[f64; 2]>,
    /// The smallest, s.
    pub makespan_s_min: Option<f64>,
    /// The largest, s.
    pub makespan_s_max: Option<f64>,
    /// Mean of the runs' mean path ratios.
    pub path_ratio_mean: Option<f64>,
    /// Mean of the runs' mean lost times, s.
    pub time_lost_s_mean: Option<f64>,
    /// Goals reached by all robots, in all runs.
    pub goals_done: u64,
    /// Mean of the runs' goals per second of simulated time.
    pub throughput_per_s_mean: Option<f64>,
    /// The smallest clearance between robots of all runs, m.
    pub min_clearance_m: Option<f64>,
    /// The same to obstacles, m.
    pub min_obstacle_clearance_m: Option<f64>,
    /// Mean of the runs' mean smoothness.
    pub ldj_mean: Option<f64>,
    /// Mean of the runs' reversals per metre.
    pub reversals_per_m_mean: Option<f64>,
    /// Crossings in all runs.
    pub crossings: u64,
    /// Those in which the wrong one went first.
    pub right_of_way_violations: u64,
    /// Robots that stood still short of their goals, in all runs.
    pub deadlocked: usize,
    /// Robots that drove without coming nearer, in all runs.
    pub livelocked: usize,
    /// Robots that reversed all the time, in all runs.
    pub oscillating: usize,
    /// Against the baseline; null without one, and for the baseline itself.
    pub against_baseline: Option<Paired>,
}

/// A row against that of the baseline, seed by seed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Paired {
    /// Seeds with which both succeeded; what follows is about these.
    pub pairs: usize,
    /// Seeds with which only this planner succeeded.
    pub only_this: usize,
    /// Seeds with which only the baseline did.
    pub only_baseline: usize,
    /// Median of the differences of the makespans, this minus baseline, s.
    pub difference_s_median: Option<f64>,
    /// Its bootstrap interval.
    pub difference_s_median_95: Option<[f64; 2]>,
    /// Median makespan against that of the baseline.
    pub makespan_ratio: Option<f64>,
    /// Its bootstrap interval; pairs are drawn as pairs.
    pub makespan_ratio_95: Option<[f64; 2]>,
}

impl Row {
    /// The row of runs that differ in their seeds only; and against those of the baseline, with the same seeds.
    pub fn new(runs: &[Record], baseline: Option<&[Record]>) -> Row {
        let first = &runs[0];
        let successes = runs.iter().filter(|run| run.success).count();
        let count = |of: fn(&Record) -> usize| runs.iter().map(of).sum::<usize>();
        let known = |of: fn(&Record) -> Option<f64>| runs.iter().filter_map(of).collect::<Vec<f64>>();
        let least = |of: fn(&Record) -> Option<f64>| known(of).into_iter().reduce(f64::min);
        let (due, arrived) = (count(|run| run.robots_due), count(|run| run.arrived));
        let makespans = makespans(runs);
        Row {
            scenario: first.scenario.clone(),
            planner: first.planner.clone(),
            varied: first.varied.clone(),
            runs: runs.len(),
            trajectories: runs.iter().map(|run| &run.trajectory_hash).collect::<BTreeSet<_>>().len(),
            successes,
            success_rate: successes as f64 / runs.len() as f64,
            success_rate_95: wilson(successes, runs.len()),
            robots_due: due,
            arrived,
            arrival_rate: (due > 0).then(|| arrived as f64 / due as f64),
            robot_contacts: runs.iter().map(|run| run.robot_contacts).sum(),
            obstacle_contacts: runs.iter().map(|run| run.obstacle_contacts).sum(),
            makespan_s_median: median(&makespans),
            makespan_s_median_95: bootstrap(&makespans, median),
            makespan_s_min: makespans.iter().copied().reduce(f64::min),
            makespan_s_max: makespans.iter().copied().reduce(f64::max),
            path_ratio_mean: mean(&known(|run| run.path_ratio_mean)),
            time_lost_s_mean: mean(&known(|run| run.time_lost_s_mean)),
            goals_done: runs.iter().map(|run| run.goals_done).sum(),
            throughput_per_s_mean: mean(&known(|run| run.throughput_per_s)),
            min_clearance_m: least(|run| run.min_clearance_m),
            min_obstacle_clearance_m: least(|run| run.min_obstacle_clearance_m),
            ldj_mean: mean(&known(|run| run.ldj_mean)),
            reversals_per_m_mean: mean(&known(|run| run.reversals_per_m)),
            crossings: runs.iter().map(|run| run.crossings).sum(),
            right_of_way_violations: runs.iter().map(|run| run.right_of_way_violations).sum(),
            deadlocked: count(|run| run.deadlocked),
            livelocked: count(|run| run.livelocked),
            oscillating: count(|run| run.oscillating),
            against_baseline: baseline.map(|baseline| paired(runs, baseline)),
        }
    }

    /// Scenario, planner and varied keys in a line.
    pub fn title(&self) -> String {
        let mut title = self.scenario.clone();
        if let Some(planner) = &self.planner {
            title += &format!(", {planner}");
        }
        for (key, value) in &self.varied {
            title += &format!(", {key}={value}");
        }
        title
    }
}

/// The makespans of successful runs, s.
pub fn makespans(runs: &[Record]) -> Vec<f64> {
    runs.iter().filter_map(makespan).collect()
}

fn makespan(record: &Record) -> Option<f64> {
    record.makespan_s.filter(|_| record.success)
}

/// Both have their runs in the order of the seeds.
fn paired(ours: &[Record], theirs: &[Record]) -> Paired {
    let both: Vec<(Option<f64>, Option<f64>)> =
        ours.iter().zip(theirs).map(|(ours, theirs)| (makespan(ours), makespan(theirs))).collect();
    let pairs: Vec<[f64; 2]> = both.iter().filter_map(|(ours, theirs)| Some([(*ours)?, (*theirs)?])).collect();
    let side = |pairs: &[[f64; 2]], i: usize| median(&pairs.iter().map(|pair| pair[i]).collect::<Vec<f64>>());
    let ratio = |pairs: &[[f64; 2]]| Some(side(pairs, 0)? / side(pairs, 1)?).filter(|ratio| ratio.is_finite());
    let differences: Vec<f64> = pairs.iter().map(|[ours, theirs]| ours - theirs).collect();
    let succeeded = |runs: &[Record], i: usize| runs.get(i).is_some_and(|run| run.success);
    let only = |one: &[Record], other: &[Record]| {
        (0..one.len()).filter(|i| succeeded(one, *i) && !succeeded(other, *i)).count()
    };
    Paired {
        pairs: pairs.len(),
        only_this: only(ours, theirs),
        only_baseline: only(theirs, ours),
        difference_s_median: median(&differences),
        difference_s_median_95: bootstrap(&differences, median),
        makespan_ratio: ratio(&pairs),
        makespan_ratio_95: bootstrap(&pairs, ratio),
    }
}
