//! Medians, ratios, and the page that shows them.

use crate::args::Format;
use crate::exit::{self, Failure};
use crate::out;
use daemon::signals::Interrupted;
use report::{Column, Page, table};
use serde::Serialize;

/// Something of a fleet beside the same of bare processes, of the same run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(super) struct Beside {
    pub(super) fleet: f64,
    pub(super) bare: f64,
    /// Median of the ratios of neighbouring repetitions.
    pub(super) ratio: f64,
}

impl Beside {
    /// The medians of repetitions, each a pair of neighbours in time.
    pub(super) fn of(pairs: &[(f64, f64)]) -> Beside {
        let all = |pick: fn(&(f64, f64)) -> f64| median(&mut pairs.iter().map(pick).collect::<Vec<_>>());
        Beside { fleet: all(|pair| pair.0), bare: all(|pair| pair.1), ratio: all(|pair| pair.0 / pair.1) }
    }
}

/// The middle of some values; 0 of none.
pub(super) fn median(values: &mut [f64]) -> f64 {
    quantile(values, 0.5)
}

/// Sorts the values, and takes the one that this share of them does not exceed; 0 of none.
pub(super) fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let rank = (share * values.len() as f64).ceil() as usize;
    values.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
}

/// How to exit.
pub(super) fn code(interrupted: &Interrupted) -> i32 {
    if interrupted.yes() { exit::INTERRUPTED } else { exit::OK }
}

/// What all benches print.
#[derive(Serialize)]
pub(super) struct Document<T> {
    pub(super) schema: &'static str,
    /// Processors that this process may use.
    pub(super) processors: usize,
    pub(super) rows: Vec<T>,
    pub(super) interrupted: bool,
}

impl<T: Serialize> Document<T> {
    pub(super) fn new(schema: &'static str, rows: Vec<T>, interrupted: &Interrupted) -> Document<T> {
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        Document { schema, processors, rows, interrupted: interrupted.yes() }
    }

    /// Prints it, as tables if people are to read it.
    pub(super) fn print(
        &self,
        format: Format,
        columns: &[Column],
        cells: impl Fn(&T) -> Vec<String>,
        notes: &[&str],
    ) -> Result<(), Failure> {
        if format == Format::Json {
            return out::measured(self);
        }
        let mut page = Page::new(out::stdout_width());
        let rows: Vec<Vec<String>> = self.rows.iter().map(cells).collect();
        table(columns, &rows, 0, page.width()).iter().for_each(|line| page.line(line));
        page.gap();
        notes.iter().for_each(|note| page.words(note, 0));
        page.words(&format!("{} processors.", self.processors), 0);
        if cfg!(debug_assertions) {
            page.words("This is a debug build: a release build is faster.", 0);
        }
        out::data(&page.into_text())
    }
}

/// Three digits.
pub(super) fn short(value: f64) -> String {
    match value {
        value if !value.is_finite() => "-".to_owned(),
        value if value >= 99.95 => format!("{value:.0}"),
        value if value >= 9.995 => format!("{value:.1}"),
        value => format!("{value:.2}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_and_quantiles() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&mut []), 0.0);
        let mut hundred: Vec<f64> = (1..=100).map(f64::from).collect();
        assert_eq!(quantile(&mut hundred, 0.99), 99.0);
        assert_eq!(quantile(&mut hundred, 1.0), 100.0);
        // The ratio is not that of the medians: each repetition has its own.
        let beside = Beside::of(&[(10.0, 10.0), (40.0, 20.0), (60.0, 30.0)]);
        assert_eq!(beside, Beside { fleet: 40.0, bare: 20.0, ratio: 2.0 });
    }
}
