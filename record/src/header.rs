//! What a record says of itself: at its beginning, and at its end. And the names under which things stand in it.

use model::{Outcome, Scenario};
use std::collections::BTreeMap;

/// The version of the format. It goes up with every change of what is written, the types of scenarios included: they are
/// kept as the binary that wrote them has them.
pub const FORMAT: u32 = 2;

/// The library that records say they were written with.
pub(crate) const LIBRARY: &str = concat!("shoal ", env!("CARGO_PKG_VERSION"));
/// How the library of every record begins.
pub(crate) const LIBRARY_PREFIX: &str = "shoal ";

pub(crate) const FRAME: &str = "shoal.frame";
pub(crate) const EVENT: &str = "shoal.event";
pub(crate) const ROBOT: &str = "shoal.robot";
pub(crate) const INPUT: &str = "shoal.input";
pub(crate) const GAP: &str = "shoal.gap";
pub(crate) const MAP: &str = "shoal.map";
pub(crate) const MAP_SHOWN: &str = "/map";
pub(crate) const METRICS: &str = "/metrics";

pub(crate) const METADATA: &str = "shoal";
pub(crate) const METADATA_END: &str = "shoal.end";
pub(crate) const SCENARIO: &str = "scenario.bin";
pub(crate) const SCENARIO_JSON: &str = "scenario.json";
pub(crate) const OUTCOME: &str = "outcome.bin";
pub(crate) const OUTCOME_JSON: &str = "outcome.json";

/// Simulated time of a tick, ns.
pub fn time_ns(tick: u64, tick_hz: f64) -> u64 {
    (tick as f64 * 1e9 / tick_hz).round() as u64
}

/// Which binary wrote a record, of what.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct About {
    /// Version of shoal.
    pub version: String,
    /// Its build: the identity that the linker gave the executable, or `unknown`.
    pub build: String,
    /// Name of the scenario.
    pub name: String,
    /// Random seed.
    pub seed: String,
    /// Clock mode.
    pub mode: String,
    /// Ticks per second.
    pub tick_hz: String,
}

impl About {
    pub(crate) fn of(scenario: &Scenario) -> About {
        About {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            build: crate::identity::build().unwrap_or_else(|| "unknown".to_owned()),
            name: scenario.name.clone(),
            seed: scenario.clock.seed.to_string(),
            mode: scenario.clock.mode.word().to_owned(),
            tick_hz: scenario.clock.tick_hz.to_string(),
        }
    }

    pub(crate) fn to_map(&self) -> BTreeMap<String, String> {
        let About { version, build, name, seed, mode, tick_hz } = self;
        let pairs = [("version", version), ("build", build), ("name", name), ("seed", seed), ("mode", mode)];
        let format = FORMAT.to_string();
        let pairs = pairs.into_iter().chain([("tick_hz", tick_hz), ("format", &format)]);
        pairs.map(|(key, value)| (key.to_owned(), value.clone())).collect()
    }

    /// With the version of the format.
    pub(crate) fn from_map(mut map: BTreeMap<String, String>) -> Option<(About, u32)> {
        let format = map.get("format")?.parse().ok()?;
        let mut take = |key: &str| map.remove(key).unwrap_or_default();
        let about = About {
            version: take("version"),
            build: take("build"),
            name: take("name"),
            seed: take("seed"),
            mode: take("mode"),
            tick_hz: take("tick_hz"),
        };
        Some((about, format))
    }
}

/// What a record ends with.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ending {
    /// What the run came to.
    pub outcome: Outcome,
}

impl Ending {
    pub(crate) fn to_map(&self, frames_left_out: u64, inputs_left_out: u64) -> BTreeMap<String, String> {
        let outcome = &self.outcome;
        let pairs = [
            ("trajectory_hash", format!("{:016x}", outcome.trajectory_hash)),
            ("ticks", outcome.ticks.to_string()),
            ("frames_left_out", frames_left_out.to_string()),
            ("inputs_left_out", inputs_left_out.to_string()),
        ];
        pairs.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
    }
}
