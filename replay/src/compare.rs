//! Two records, tick by tick.

use crate::verdict::{Difference, Differences, Rank};
use crate::verifier::fields;
use record::Body;
use serde::Serialize;
use std::collections::BTreeMap;

/// How two records compare.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Ticks that both have.
    pub ticks: u64,
    /// Ticks of each.
    pub lengths: [u64; 2],
    /// The first difference, by tick: `recorded` is the first record, `replayed` the second one.
    pub first: Option<Difference>,
    /// The robots that both have, by name: how far they are apart.
    pub robots: Vec<Apart>,
    /// Robots that one of them does not have, by name.
    pub unmatched: Vec<String>,
}

/// How far a robot is from where it is in the other record.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Apart {
    /// Its name.
    pub robot: String,
    /// The first tick in which it is somewhere else.
    pub from_tick: Option<u64>,
    /// The greatest distance, m.
    pub max_m: f64,
    /// The tick of that.
    pub max_tick: u64,
    /// The mean distance over all ticks that both have, m.
    pub mean_m: f64,
    /// The distance in the last of them, m.
    pub last_m: f64,
}

/// Takes the frames of two records, and compares them.
#[derive(Default)]
pub struct Comparer {
    differences: Differences,
    ticks: u64,
    lengths: [u64; 2],
    /// By name.
    apart: BTreeMap<String, Sum>,
    unmatched: BTreeMap<String, ()>,
}

#[derive(Default)]
struct Sum {
    from_tick: Option<u64>,
    max_m: f64,
    max_tick: u64,
    total_m: f64,
    count: u64,
    last_m: f64,
}

impl Comparer {
    /// A tick: the bodies of each record, with their names; `None` where a record has none of this tick.
    pub fn tick(&mut self, tick: u64, frames: [Option<&[(String, Body)]>; 2]) {
        for (length, frame) in self.lengths.iter_mut().zip(frames) {
            *length = if frame.is_some() { tick + 1 } else { *length };
        }
        let [Some(ones), Some(others)] = frames else {
            let words = frames.map(|frame| if frame.is_some() { "a frame" } else { "none" }.to_owned());
            return self.differences.add(Rank::Frame, tick, None, "frame", words);
        };
        self.ticks += 1;
        for (name, one) in ones {
            match others.iter().find(|(other, _)| other == name) {
                Some((_, other)) => self.body(tick, name, one, other),
                None => self.only(tick, name, ["there", "not there"]),
            }
        }
        for (name, _) in others.iter().filter(|(name, _)| !ones.iter().any(|(one, _)| one == name)) {
            self.only(tick, name, ["not there", "there"]);
        }
    }

    fn only(&mut self, tick: u64, name: &str, words: [&str; 2]) {
        self.unmatched.insert(name.to_owned(), ());
        self.differences.add(Rank::Frame, tick, Some(name.to_owned()), "body", words.map(str::to_owned));
    }

    fn body(&mut self, tick: u64, name: &str, one: &Body, other: &Body) {
        if one.flags != other.flags {
            let flags = [one, other].map(|body| format!("{:#x}", body.flags));
            self.differences.add(Rank::Frame, tick, Some(name.to_owned()), "flags", flags);
        }
        for ((field, a), (_, b)) in fields(one).into_iter().zip(fields(other)) {
            if a.to_bits() != b.to_bits() {
                let values = [format!("{a:?}"), format!("{b:?}")];
                self.differences.add(Rank::Frame, tick, Some(name.to_owned()), field, values);
            }
        }
        let [dx, dy] = [0, 1].map(|axis| one.position_m[axis] - other.position_m[axis]);
        let distance_m = dx.hypot(dy);
        let sum = self.apart.entry(name.to_owned()).or_default();
        if distance_m > 0.0 {
            sum.from_tick.get_or_insert(tick);
        }
        if distance_m > sum.max_m {
            (sum.max_m, sum.max_tick) = (distance_m, tick);
        }
        sum.total_m += distance_m;
        sum.count += 1;
        sum.last_m = distance_m;
    }

    /// What came out.
    pub fn finish(self) -> Comparison {
        let apart = |(robot, sum): (String, Sum)| Apart {
            robot,
            from_tick: sum.from_tick,
            max_m: sum.max_m,
            max_tick: sum.max_tick,
            mean_m: sum.total_m / sum.count.max(1) as f64,
            last_m: sum.last_m,
        };
        Comparison {
            ticks: self.ticks,
            lengths: self.lengths,
            first: self.differences.into_first(),
            robots: self.apart.into_iter().map(apart).collect(),
            unmatched: self.unmatched.into_keys().collect(),
        }
    }
}
