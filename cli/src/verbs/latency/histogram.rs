//! How the values of a metric are spread, over ranges with round ends.

use bus::StatsSnapshot;
use model::{Metric, RobotIndex};
use report::Page;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use view::histogram::Bar;

/// Where ranges begin within a power of ten.
const STEPS: [u64; 6] = [1000, 1500, 2000, 3000, 5000, 7000];
/// Powers of ten, from 1 us to 100 s.
const POWERS: u32 = 8;

/// Values by range.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Spread {
    /// Where each range begins, ns; it ends where the next one begins.
    edges: Vec<u64>,
    counts: Vec<u64>,
}

/// The ends of the ranges, ns.
fn edges() -> Vec<u64> {
    let powers = (0..POWERS).flat_map(|power| STEPS.map(|step| step * 10_u64.pow(power)));
    std::iter::once(0).chain(powers).collect()
}

impl Spread {
    /// A metric over these robots: what the agents measured themselves, or what the world measured of them.
    pub(super) fn of(
        robots: &BTreeMap<RobotIndex, StatsSnapshot>,
        world: Option<&StatsSnapshot>,
        metric: Metric,
    ) -> Spread {
        let edges = edges();
        let mut counts = vec![0; edges.len()];
        for (&slot, snapshot) in robots {
            let of_world = || world.map_or_else(Vec::new, |world| world.spread_of(slot, metric, &edges));
            let spread = if metric.is_of_world() { of_world() } else { snapshot.spread(metric, &edges) };
            counts.iter_mut().zip(spread).for_each(|(count, more)| *count += more);
        }
        Spread { edges, counts }.trimmed()
    }

    /// Without the empty ranges at both ends.
    fn trimmed(mut self) -> Spread {
        let last = self.counts.iter().rposition(|count| *count > 0).map_or(0, |last| last + 1);
        self.counts.truncate(last);
        self.edges.truncate(last);
        let first = self.counts.iter().position(|count| *count > 0).unwrap_or(0);
        Spread { edges: self.edges.split_off(first), counts: self.counts.split_off(first) }
    }

    /// How many values.
    pub(super) fn n(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// As bars of a picture.
    pub(super) fn bars(&self) -> Vec<Bar> {
        self.edges.iter().zip(&self.counts).map(|(edge, &n)| Bar { from: micros(*edge), n }).collect()
    }

    /// For programs.
    pub(super) fn json(&self) -> Value {
        let all = edges();
        let end = |edge: u64| all.iter().find(|other| **other > edge).map(|ns| *ns as f64 * 1e-3);
        let bins = self.edges.iter().zip(&self.counts);
        bins.map(|(edge, n)| json!({ "from_us": *edge as f64 * 1e-3, "to_us": end(*edge), "n": n })).collect()
    }

    /// For people: a line per range.
    pub(super) fn text(&self, page: &mut Page) {
        let most = self.counts.iter().copied().max().unwrap_or(0).max(1);
        let widest = self.counts.iter().map(|n| n.to_string().len()).max().unwrap_or(1);
        let names: Vec<String> = self.edges.iter().map(|edge| micros(*edge)).collect();
        let name_width = names.iter().map(String::len).max().unwrap_or(1);
        let room = page.width().saturating_sub(name_width + widest + 14).max(4) as u64;
        for (name, n) in names.iter().zip(&self.counts) {
            let share = 100.0 * *n as f64 / self.n() as f64;
            // Whatever is there can be seen.
            let bar = "#".repeat(((n * room).div_ceil(most)) as usize);
            page.line(&format!("  {name:>name_width$}  {n:>widest$} {share:>5.1} %  {bar}"));
        }
    }
}

/// The beginning of a range: `1.5`, `300`.
fn micros(ns: u64) -> String {
    if ns.is_multiple_of(1000) { (ns / 1000).to_string() } else { format!("{:.1}", ns as f64 * 1e-3) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bus::{Address, StatsWriter, Strips, clean};

    #[test]
    fn a_spread_as_text_and_json() {
        let address = Address::create().unwrap();
        for (slot, values_us) in [(0, [1, 1, 40, 60]), (1, [40, 45, 900, 20_000])] {
            let name = format!("agent-{slot}-0");
            let mut stats = StatsWriter::create(&address, &name, &[Metric::Wake], Strips::NONE).unwrap();
            values_us.into_iter().for_each(|us| stats.record(Metric::Wake, us * 1000 + 10));
        }
        let stats = bus::stats::read_all(&address);
        clean::sweep(&address);
        let (mut robots, world) = bus::stats::by_robot(&stats.unwrap());
        let spread = Spread::of(&robots, world.as_ref(), Metric::Wake);
        let mut text = String::new();
        for width in [60, 30] {
            let mut page = Page::new(width);
            spread.text(&mut page);
            text += &page.into_text();
        }
        insta::assert_snapshot!(text);
        assert_eq!((spread.n(), spread.bars()[0].clone()), (8, Bar { from: "1".into(), n: 2 }));
        assert_eq!(spread.json()[0], json!({ "from_us": 1.0, "to_us": 1.5, "n": 2 }));
        assert_eq!(Spread::of(&robots, None, Metric::Plan).bars(), []);
        robots.remove(&RobotIndex(0));
        assert_eq!(Spread::of(&robots, None, Metric::Wake).n(), 4);
    }
}
