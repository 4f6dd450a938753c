//! The table: medians over the repetitions, and how far each is from the best.

use crate::fleet::Measured;
use poses::samples::Times;
use serde_json::{Value, json};

/// What a column shows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Column {
    /// Its key in the JSON form, unit included.
    pub(crate) key: &'static str,
    heading: [&'static str; 3],
    decimals: usize,
    value: fn(&Measured) -> f64,
}

fn at(times: &Times, quantile: f64) -> f64 {
    times.value_at_quantile(quantile) as f64
}

const fn column(key: &'static str, heading: [&'static str; 3], decimals: usize, value: fn(&Measured) -> f64) -> Column {
    Column { key, heading, decimals, value }
}

/// All columns, in order. Less is better in each.
pub(crate) const COLUMNS: [Column; 13] = [
    column("added_us_p50", ["added", "us", "p50"], 1, |m| at(&m.samples.added, 0.5) * 1e-3),
    column("added_us_p99", ["added", "us", "p99"], 0, |m| at(&m.samples.added, 0.99) * 1e-3),
    column("added_us_p999", ["added", "us", "p99.9"], 0, |m| at(&m.samples.added, 0.999) * 1e-3),
    column("late_us_p50", ["late", "us", "p50"], 1, |m| at(&m.samples.late, 0.5) * 1e-3),
    column("late_us_p99", ["late", "us", "p99"], 0, |m| at(&m.samples.late, 0.99) * 1e-3),
    column("late_us_p999", ["late", "us", "p99.9"], 0, |m| at(&m.samples.late, 0.999) * 1e-3),
    column("age_ms_p50", ["age", "ms", "p50"], 2, |m| at(&m.samples.age, 0.5) * 1e-6),
    column("age_ms_p99", ["age", "ms", "p99"], 2, |m| at(&m.samples.age, 0.99) * 1e-6),
    column("age_ms_p999", ["age", "ms", "p99.9"], 2, |m| at(&m.samples.age, 0.999) * 1e-6),
    column("cpu_percent", ["cpu", "%", "/robot"], 2, |m| m.cpu_percent),
    column("pss_mib", ["memory", "MiB", "/robot"], 2, |m| m.pss_mib),
    column("connected_ms", ["con-", "nected", "ms"], 0, |m| m.connected_ms),
    column("lost_percent", ["lost", "poses", "%"], 2, lost_percent),
];

fn lost_percent(measured: &Measured) -> f64 {
    100.0 * measured.samples.lost as f64 / measured.samples.expected.max(1) as f64
}

/// What came of one peer at one N.
#[derive(Debug, Default)]
pub(crate) struct Row {
    /// The peer's name.
    pub(crate) peer: &'static str,
    /// The repetitions that worked.
    pub(crate) runs: Vec<Measured>,
    /// Why there are no more.
    pub(crate) failure: Option<String>,
}

impl Row {
    /// The median of a column over the repetitions, if there are any.
    pub(crate) fn median(&self, column: &Column) -> Option<f64> {
        median(self.runs.iter().map(column.value))
    }

    /// The median of lost poses, percent.
    pub(crate) fn lost_percent(&self) -> f64 {
        median(self.runs.iter().map(lost_percent)).unwrap_or(0.0)
    }

    fn beside(&self) -> Option<(f64, f64)> {
        let cpu_percent = median(self.runs.iter().map(|run| run.cpu_beside_percent))?;
        Some((cpu_percent, median(self.runs.iter().map(|run| run.pss_beside_mib))?)).filter(|(_, mib)| *mib > 0.0)
    }
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => None,
        odd if odd % 2 == 1 => Some(values[middle]),
        _ => Some(f64::midpoint(values[middle - 1], values[middle])),
    }
}

/// How many times the best: 1 if it is the best itself, nothing if the best is zero and this is not.
fn ratio(value: f64, best: f64) -> Option<f64> {
    if value == best {
        return Some(1.0);
    }
    (best > 0.0).then(|| value / best)
}

/// All peers at one N.
#[derive(Debug)]
pub(crate) struct Block {
    /// How many robots.
    pub(crate) robots: usize,
    /// By peer.
    pub(crate) rows: Vec<Row>,
}

impl Block {
    fn best(&self, column: &Column) -> Option<f64> {
        self.rows.iter().filter_map(|row| row.median(column)).min_by(f64::total_cmp)
    }

    fn ratio(&self, row: &Row, column: &Column) -> Option<Option<f64>> {
        Some(ratio(row.median(column)?, self.best(column)?))
    }

    /// For people.
    pub(crate) fn text(&self) -> String {
        let mut text = String::new();
        for line in 0..3 {
            let left = if line == 2 { format!("N = {}", self.robots) } else { String::new() };
            let cells = COLUMNS.iter().map(|column| format!("{:>8}", column.heading[line]));
            text += &format!("{left:<11}{}\n", cells.collect::<String>());
        }
        for row in &self.rows {
            let cell = |column: &Column| row.median(column).map(|v| format!("{v:>8.*}", column.decimals));
            let ratio = |column: &Column| match self.ratio(row, column) {
                Some(Some(ratio)) if ratio < 99.95 => format!("{:>8}", format!("x{ratio:.2}")),
                Some(Some(ratio)) => format!("{:>8}", format!("x{ratio:.0}")),
                _ => format!("{:>8}", "not 0"),
            };
            if !row.runs.is_empty() {
                text += &format!("{:<11}{}\n", row.peer, COLUMNS.iter().filter_map(cell).collect::<String>());
                text += &format!("{:<11}{}\n", "  to best", COLUMNS.iter().map(ratio).collect::<String>());
            }
            if let Some(failure) = &row.failure {
                let some = if row.runs.is_empty() { String::new() } else { format!("only {} runs: ", row.runs.len()) };
                text += &format!("{:<11} {some}{failure}\n", row.peer);
            }
        }
        for row in &self.rows {
            if let Some((cpu_percent, mib)) = row.beside() {
                text += &format!("{}: {cpu_percent:.2} % and {mib:.2} MiB of it run beside the robots\n", row.peer);
            }
        }
        text + &self.verdicts()
    }

    /// Where shoal stands to its aims: within 1.1 of the best everywhere, three times better than dora and zenoh in two
    /// columns at least.
    fn verdicts(&self) -> String {
        let Some(shoal) = self.rows.iter().find(|row| row.peer == "shoal" && !row.runs.is_empty()) else {
            return String::new();
        };
        let far: Vec<String> = COLUMNS
            .iter()
            .filter(|column| self.ratio(shoal, column).is_some_and(|ratio| ratio.is_none_or(|ratio| ratio > 1.1)))
            .map(|column| column.key.to_owned())
            .collect();
        let near = COLUMNS.len() - far.len();
        let far = if far.is_empty() { String::new() } else { format!("; not in {}", far.join(", ")) };
        let mut text = format!("shoal is within x1.1 of the best in {near} of {} columns{far}\n", COLUMNS.len());
        for row in self.rows.iter().filter(|row| row.peer != "shoal" && !row.runs.is_empty()) {
            let much = |column: &&Column| {
                let (theirs, ours) = (row.median(column).unwrap_or(0.0), shoal.median(column).unwrap_or(0.0));
                theirs > 0.0 && theirs >= 3.0 * ours
            };
            let keys: Vec<&str> = COLUMNS.iter().filter(much).map(|column| column.key).collect();
            if !keys.is_empty() {
                text += &format!("shoal is 3 times better than {} in {}\n", row.peer, keys.join(", "));
            }
        }
        text
    }

    /// For programs.
    pub(crate) fn json(&self) -> Value {
        let rows: Vec<Value> = self.rows.iter().map(|row| self.row_json(row)).collect();
        json!({ "robots": self.robots, "peers": rows })
    }

    fn row_json(&self, row: &Row) -> Value {
        let medians = COLUMNS.iter().map(|column| (column.key.to_owned(), json!(row.median(column))));
        let ratios = COLUMNS.iter().map(|column| (column.key.to_owned(), json!(self.ratio(row, column).flatten())));
        let runs: Vec<Value> = row
            .runs
            .iter()
            .map(|run| {
                let columns = COLUMNS.iter().map(|column| (column.key.to_owned(), json!((column.value)(run))));
                let mut run_json: serde_json::Map<String, Value> = columns.collect();
                run_json.insert("missed_periods".into(), json!(run.samples.missed));
                run_json.insert("started_ms".into(), json!(run.started_ms));
                run_json.insert("samples".into(), json!(run.samples.age.len()));
                run_json.into()
            })
            .collect();
        let beside = row.beside();
        json!({
            "peer": row.peer,
            "median": medians.collect::<serde_json::Map<_, _>>(),
            "to_best": ratios.collect::<serde_json::Map<_, _>>(),
            "cpu_beside_percent": beside.map(|(cpu, _)| cpu),
            "pss_beside_mib": beside.map(|(_, mib)| mib),
            "runs": runs,
            "failure": row.failure,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use poses::samples::Samples;

    fn run(added_ns: u64, cpu_percent: f64) -> Measured {
        let mut samples = Samples { expected: 100, ..Samples::default() };
        samples.added.saturating_record(added_ns);
        samples.late.saturating_record(50_000);
        samples.age.saturating_record(added_ns + 10_000_000);
        Measured {
            samples,
            cpu_percent,
            cpu_beside_percent: 0.0,
            pss_mib: 1.0,
            pss_beside_mib: 0.0,
            started_ms: 2.0,
            connected_ms: 5.0,
        }
    }

    #[test]
    fn the_median_of_three_is_the_middle_one_and_of_two_the_mean() {
        assert_eq!(median([3.0, 1.0, 2.0].into_iter()), Some(2.0));
        assert_eq!(median([3.0, 1.0].into_iter()), Some(2.0));
        assert_eq!(median(std::iter::empty()), None);
    }

    #[test]
    fn ratios_are_to_the_best_and_a_zero_that_is_missed_has_none() {
        assert_eq!(ratio(0.0, 0.0), Some(1.0));
        assert_eq!(ratio(3.0, 2.0), Some(1.5));
        assert_eq!(ratio(3.0, 0.0), None);
    }

    #[test]
    fn the_table_tells_ratios_failures_and_aims() {
        let shoal = Row { peer: "shoal", runs: vec![run(50_000, 0.2), run(51_000, 0.1)], failure: None };
        let dora = Row { peer: "dora", runs: vec![run(500_000, 0.15)], failure: Some("robot 1 ended".into()) };
        let zenoh = Row { peer: "zenoh", runs: vec![], failure: Some("not built: no compiler".into()) };
        let text = Block { robots: 2, rows: vec![shoal, dora, zenoh] }.text();
        for part in [
            "shoal is within x1.1 of the best in 13 of 13 columns\n",
            "shoal is 3 times better than dora in added_us_p50, added_us_p99, added_us_p999\n",
            "only 1 runs: robot 1 ended",
            "zenoh       not built: no compiler",
        ] {
            assert!(text.contains(part), "`{part}` is missing in\n{text}");
        }
    }
}
