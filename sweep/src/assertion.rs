//! What a sweep is expected to come to: `[PLANNER:]METRIC OP NUMBER`, checked for every row of its summary.

use crate::row::Row;
use serde::{Serialize, Serializer};
use std::fmt;

/// A figure of a row.
type Figure = fn(&Row) -> Option<f64>;
/// A comparison of a figure with a bound.
type Comparison = fn(f64, f64) -> bool;

/// The metrics of assertions: name and figure.
const METRICS: [(&str, Figure); 17] = [
    // Share of runs in which all robots arrived and nothing touched.
    ("success", |row| Some(row.success_rate)),
    // Share of robots that arrived.
    ("arrival", |row| row.arrival_rate),
    // Contacts of all runs together.
    ("contacts", |row| Some((row.robot_contacts + row.obstacle_contacts) as f64)),
    // Those between robots.
    ("robot_contacts", |row| Some(row.robot_contacts as f64)),
    // Those with obstacles.
    ("obstacle_contacts", |row| Some(row.obstacle_contacts as f64)),
    // Median makespan of successful runs, s.
    ("makespan", |row| row.makespan_s_median),
    // Ratio of medians to the baseline.
    ("makespan_ratio", |row| row.against_baseline.as_ref().and_then(|paired| paired.makespan_ratio)),
    // Mean ratio to the shortest path.
    ("path_ratio", |row| row.path_ratio_mean),
    // Mean time lost against the shortest path at the greatest speed, s.
    ("time_lost", |row| row.time_lost_s_mean),
    // Mean of goals per second of simulated time.
    ("throughput", |row| row.throughput_per_s_mean),
    // Smallest clearance between robots, m.
    ("clearance", |row| row.min_clearance_m),
    // Mean smoothness.
    ("ldj", |row| row.ldj_mean),
    // Mean number of reversals per metre.
    ("reversals_per_m", |row| row.reversals_per_m_mean),
    // Share of the crossings of all runs in which the wrong one went first.
    ("right_of_way_violations", |row| {
        (row.crossings > 0).then(|| row.right_of_way_violations as f64 / row.crossings as f64)
    }),
    // Robots of all runs together.
    ("deadlocked", |row| Some(row.deadlocked as f64)),
    // Robots of all runs together.
    ("livelocked", |row| Some(row.livelocked as f64)),
    // Robots of all runs together.
    ("oscillating", |row| Some(row.oscillating as f64)),
];

/// How a figure is compared; a two-character operator stands before its first character.
const OPERATORS: [(&str, Comparison); 5] =
    [(">=", |a, b| a >= b), ("<=", |a, b| a <= b), ("==", |a, b| a == b), (">", |a, b| a > b), ("<", |a, b| a < b)];

/// A condition on the rows of a summary.
#[derive(Clone)]
pub struct Assertion {
    text: String,
    planner: Option<String>,
    metric: &'static str,
    figure: Figure,
    holds: Comparison,
    bound: f64,
}

impl Assertion {
    /// Reads `[PLANNER:]METRIC OP NUMBER`.
    ///
    /// # Errors
    /// In words that say what there is.
    pub fn parse(text: &str) -> Result<Assertion, String> {
        let example = "write [PLANNER:]METRIC OP NUMBER, as in success>=0.95 or apf:contacts==0";
        let (planner, condition) = match text.split_once(':') {
            Some((planner, condition)) => (Some(planner.trim().to_owned()), condition),
            None => (None, text),
        };
        let at = condition.find(['<', '>', '=']).ok_or_else(|| format!("`{text}` has no comparison; {example}"))?;
        let (name, rest) = (condition[..at].trim(), &condition[at..]);
        let operator = OPERATORS.into_iter().find(|(sign, _)| rest.starts_with(sign));
        let (sign, holds) = operator.ok_or_else(|| format!("`{text}`: the comparisons are >=, <=, ==, > and <"))?;
        let Some((metric, figure)) = METRICS.into_iter().find(|(metric, ..)| *metric == name) else {
            let known = METRICS.map(|(metric, ..)| metric).join(", ");
            return Err(format!("unknown metric `{}`; known metrics: {known}", name.escape_debug()));
        };
        let number = rest[sign.len()..].trim();
        let bound = number.parse().ok().filter(|bound: &f64| bound.is_finite());
        let bound = bound.ok_or_else(|| format!("`{number}` is not a number; {example}"))?;
        Ok(Assertion { text: text.trim().to_owned(), planner, metric, figure, holds, bound })
    }

    /// As it was given.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The planner whose rows it is about; `None`: all rows.
    pub fn planner(&self) -> Option<&str> {
        self.planner.as_deref()
    }

    /// Whether it is about a ratio to the baseline.
    pub fn needs_baseline(&self) -> bool {
        self.metric == "makespan_ratio"
    }

    /// Checks all rows. A figure that a row does not have, as the makespan where no run succeeded, does not hold; only of a
    /// ratio to the baseline the rows of the baseline are left out.
    pub fn check(&self, rows: &[Row], baseline: Option<&str>) -> Checked {
        let is_itself = |row: &Row| self.needs_baseline() && row.planner.as_deref() == baseline;
        let is_meant = |row: &&Row| (self.planner.is_none() || row.planner == self.planner) && !is_itself(row);
        let concerned = rows.iter().filter(is_meant);
        let failed = concerned.filter_map(|row| {
            let found = (self.figure)(row);
            let holds = found.is_some_and(|figure| (self.holds)(figure, self.bound));
            (!holds).then(|| FailedRow { row: row.title(), metric: self.metric, found })
        });
        let failed: Vec<FailedRow> = failed.collect();
        Checked { assertion: self.clone(), holds: failed.is_empty(), failed }
    }
}

impl fmt::Debug for Assertion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Assertion").field(&self.text).finish()
    }
}

impl PartialEq for Assertion {
    fn eq(&self, other: &Assertion) -> bool {
        self.text == other.text
    }
}

impl Serialize for Assertion {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.text)
    }
}

/// What came of an assertion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Checked {
    /// The assertion.
    pub assertion: Assertion,
    /// It holds for every row.
    pub holds: bool,
    /// The rows for which it does not.
    pub failed: Vec<FailedRow>,
}

/// A row for which an assertion does not hold.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FailedRow {
    /// Scenario, planner and varied keys.
    pub row: String,
    /// The metric.
    pub metric: &'static str,
    /// What it was; null if the row does not have it.
    pub found: Option<f64>,
}

impl FailedRow {
    /// In words.
    pub fn words(&self) -> String {
        match self.found {
            Some(found) => format!("{}: {} is {}", self.row, self.metric, report::numbers::rounded(found)),
            None => format!("{}: there is no {}", self.row, self.metric),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_what_is_compared() {
        for (text, figure, holds) in [
            ("success>=0.95", 0.95, true),
            ("success >= 0.95", 0.94, false),
            ("success<0.5", 0.5, false),
            ("success>0.5", 0.51, true),
            ("success<=0", 0.0, true),
            ("apf:success==1", 1.0, true),
        ] {
            let assertion = Assertion::parse(text).unwrap();
            assert_eq!((assertion.holds)(figure, assertion.bound), holds, "{text}");
        }
        assert_eq!(Assertion::parse("apf:success==1").unwrap().planner(), Some("apf"));
        assert!(Assertion::parse("makespan_ratio<=1.1").unwrap().needs_baseline());
    }

    #[test]
    fn what_cannot_be_read_says_what_there_is() {
        for (text, words) in [
            ("success", "has no comparison"),
            ("success=1", "the comparisons are"),
            ("succ>=1", "known metrics: success, "),
            ("success>=many", "`many` is not a number"),
            ("success>=nan", "is not a number"),
            (">=1", "unknown metric ``"),
        ] {
            let error = Assertion::parse(text).unwrap_err();
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
