//! What a robot records: three histograms and three counters, of fixed size, so that recording costs every peer the same.

use hdrhistogram::Histogram;
use std::fmt::Write;

/// The longest time that is told apart, ns; longer ones count as this.
const LONGEST_NS: u64 = 100_000_000_000;
/// Below this, times are not told apart, ns.
const SHORTEST_NS: u64 = 100;
/// Significant decimal digits, as in shoal's own statistics.
const DIGITS: u8 = 2;

/// A histogram of times, ns.
pub type Times = Histogram<u32>;

/// An empty histogram.
pub fn times() -> Times {
    Histogram::new_with_bounds(SHORTEST_NS, LONGEST_NS, DIGITS).expect("the bounds are in order")
}

/// What one robot measured, or all of them together.
#[derive(Clone, Debug)]
pub struct Samples {
    /// See the crate's documentation.
    pub added: Times,
    /// See the crate's documentation.
    pub late: Times,
    /// See the crate's documentation.
    pub age: Times,
    /// Poses that should have been in hand at some step.
    pub expected: u64,
    /// Those of them that never were.
    pub lost: u64,
    /// Periods that passed without a step because an earlier one was too late.
    pub missed: u64,
}

impl Default for Samples {
    fn default() -> Samples {
        Samples { added: times(), late: times(), age: times(), expected: 0, lost: 0, missed: 0 }
    }
}

impl Samples {
    /// As lines, for [`Samples::read_line`].
    pub fn to_lines(&self) -> String {
        let mut text = format!("counts {} {} {}\n", self.expected, self.lost, self.missed);
        for (name, times) in [("added", &self.added), ("late", &self.late), ("age", &self.age)] {
            text.push_str(name);
            for bar in times.iter_recorded() {
                let _ = write!(text, " {}:{}", bar.value_iterated_to(), bar.count_at_value());
            }
            text.push('\n');
        }
        text
    }

    /// Adds what a line says; `None` if it is none of ours.
    pub fn read_line(&mut self, line: &str) -> Option<()> {
        let (name, rest) = line.split_once(' ').unwrap_or((line, ""));
        let mut words = rest.split_ascii_whitespace();
        if name == "counts" {
            for count in [&mut self.expected, &mut self.lost, &mut self.missed] {
                *count += words.next()?.parse::<u64>().ok()?;
            }
            return Some(());
        }
        let times = match name {
            "added" => &mut self.added,
            "late" => &mut self.late,
            "age" => &mut self.age,
            _ => return None,
        };
        for word in words {
            let (value, count) = word.split_once(':')?;
            times.saturating_record_n(value.parse().ok()?, count.parse().ok()?);
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_add_up_across_lines() {
        let mut one = Samples { expected: 10, lost: 1, missed: 2, ..Samples::default() };
        for ns in [1_000_u64, 50_000, 50_100, 20_000_000] {
            one.added.saturating_record(ns);
            one.late.saturating_record(ns / 2);
            one.age.saturating_record(ns + 7_000);
        }
        let mut all = Samples::default();
        for _ in 0..2 {
            one.to_lines().lines().for_each(|line| all.read_line(line).unwrap());
        }
        assert_eq!((all.expected, all.lost, all.missed), (20, 2, 4));
        assert_eq!((all.added.len(), all.late.len(), all.age.len()), (8, 8, 8));
        assert_eq!(all.added.value_at_quantile(1.0), one.added.value_at_quantile(1.0));
        assert_eq!(all.read_line("other 1:1"), None);
    }
}
