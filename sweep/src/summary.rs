//! What all runs of a sweep together say: a row for each combination of scenario, planner and varied keys, a line for each
//! planner over all scenarios, and the runs that failed.

use crate::assertion::{Assertion, Checked};
use crate::plan::Plan;
use crate::record::Record;
use crate::row::Row;
use crate::statistics::{self, geometric_mean};
use model::Mode;
use report::numbers::plural;
use serde::Serialize;
use std::collections::BTreeMap;

/// The name and version of `summary.json`.
pub const SCHEMA: &str = "shoal.sweep/1";

/// What all runs of a sweep together say.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// Version of shoal.
    pub shoal: String,
    /// Clock mode.
    pub mode: Mode,
    /// Number of runs.
    pub runs: usize,
    /// Runs in which all robots arrived and nothing touched.
    pub successes: usize,
    /// The seeds of each row.
    pub seeds: Vec<u64>,
    /// The planner that the others are compared with.
    pub baseline: Option<String>,
    /// The probability with which an interval holds what it is about.
    pub confidence: f64,
    /// A row for each scenario, planner and combination of varied keys, in the order of the command line.
    pub rows: Vec<Row>,
    /// The same over all scenarios.
    pub planners: Vec<PlannerRow>,
    /// Runs that did not succeed, in the order of the plan.
    pub failures: Vec<FailedRun>,
    /// What came of the assertions.
    pub assertions: Vec<Checked>,
}

/// A planner, and a combination of varied keys, over all scenarios.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlannerRow {
    /// The planner; null: the scenarios' own.
    pub planner: Option<String>,
    /// The varied keys and their values.
    pub varied: BTreeMap<String, String>,
    /// Number of scenarios.
    pub scenarios: usize,
    /// Scenarios in which every run succeeded.
    pub clean: usize,
    /// Number of runs.
    pub runs: usize,
    /// Those that succeeded.
    pub successes: usize,
    /// Geometric mean of the makespan ratios to the baseline; null without a baseline.
    pub makespan_ratio_mean: Option<f64>,
    /// Scenarios that have such a ratio: both planners succeeded with one seed at least.
    pub ratio_scenarios: Option<usize>,
}

/// A run that did not succeed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FailedRun {
    /// Its number.
    pub run: usize,
    /// The scenario.
    pub scenario: String,
    /// The planner; null: the scenario's own.
    pub planner: Option<String>,
    /// The varied keys and their values.
    pub varied: BTreeMap<String, String>,
    /// The seed.
    pub seed: u64,
    /// What was wrong, in words.
    pub cause: String,
    /// The command that repeats it.
    pub command: String,
    /// The same in pieces that belong on one line.
    #[serde(skip)]
    pub words: Vec<String>,
}

/// Makes the summary of all runs, one record for each, in the order of the plan.
///
/// # Panics
/// When a record is missing.
pub fn summarize(plan: &Plan, records: &[Record], baseline: Option<&str>, assertions: &[Assertion]) -> Summary {
    assert_eq!(records.len(), plan.runs(), "a record for each run");
    let cells: Vec<&[Record]> = records.chunks(plan.seeds.len()).collect();
    let rows: Vec<Row> = (cells.iter().enumerate())
        .map(|(cell, runs)| {
            let other = baseline.and_then(|name| plan.cell_with(cell, name)).filter(|other| *other != cell);
            Row::new(runs, other.map(|other| cells[other]))
        })
        .collect();
    Summary {
        schema: SCHEMA,
        shoal: plan.shoal.clone(),
        mode: plan.mode,
        runs: records.len(),
        successes: records.iter().filter(|record| record.success).count(),
        seeds: plan.seeds.clone(),
        baseline: baseline.map(str::to_owned),
        confidence: statistics::CONFIDENCE,
        planners: over_scenarios(plan, &rows, baseline),
        failures: records.iter().filter(|record| !record.success).map(|record| failure(plan, record)).collect(),
        assertions: assertions.iter().map(|assertion| assertion.check(&rows, baseline)).collect(),
        rows,
    }
}

fn over_scenarios(plan: &Plan, rows: &[Row], baseline: Option<&str>) -> Vec<PlannerRow> {
    // Rows of one scenario stand together, each with the same planners and settings in the same order.
    let of_each = plan.cells() / plan.scenarios.len().max(1);
    let place = |i: usize| {
        let mine: Vec<&Row> = rows.iter().skip(i).step_by(of_each).collect();
        let is_baseline = baseline.is_some() && mine[0].planner.as_deref() == baseline;
        let ratio = |row: &&Row| match &row.against_baseline {
            Some(paired) => paired.makespan_ratio,
            None => row.makespan_s_median.filter(|_| is_baseline).map(|_| 1.0),
        };
        let ratios: Vec<f64> = mine.iter().filter_map(ratio).collect();
        PlannerRow {
            planner: mine[0].planner.clone(),
            varied: mine[0].varied.clone(),
            scenarios: mine.len(),
            clean: mine.iter().filter(|row| row.successes == row.runs).count(),
            runs: mine.iter().map(|row| row.runs).sum(),
            successes: mine.iter().map(|row| row.successes).sum(),
            makespan_ratio_mean: geometric_mean(&ratios),
            ratio_scenarios: baseline.map(|_| ratios.len()),
        }
    };
    (0..of_each).map(place).collect()
}

fn failure(plan: &Plan, record: &Record) -> FailedRun {
    let words = plan.run(record.run).command();
    FailedRun {
        run: record.run,
        scenario: record.scenario.clone(),
        planner: record.planner.clone(),
        varied: record.varied.clone(),
        seed: record.seed,
        cause: cause(record),
        command: words.join(" "),
        words,
    }
}

/// What was wrong with a run, in words.
fn cause(record: &Record) -> String {
    let mut parts = Vec::new();
    if record.arrived < record.robots_due {
        let stalls =
            [(record.deadlocked, "deadlocked"), (record.livelocked, "livelocked"), (record.oscillating, "oscillating")];
        let stalls: Vec<String> =
            stalls.iter().filter(|(n, _)| *n > 0).map(|(n, word)| format!("{n} {word}")).collect();
        let stalls = if stalls.is_empty() { String::new() } else { format!(" ({})", stalls.join(", ")) };
        parts.push(format!("{} of {} arrived{stalls}", record.arrived, record.robots_due));
    }
    for (n, what) in [(record.robot_contacts, "between robots"), (record.obstacle_contacts, "with obstacles")] {
        if n > 0 {
            parts.push(format!("{n} contact{} {what}", plural(n)));
        }
    }
    parts.join(", ")
}
