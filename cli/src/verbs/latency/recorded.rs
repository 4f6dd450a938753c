//! The latencies of a run that has ended, from its record: as its processes had counted them when they were recorded last.

use super::Look;
use crate::exit::Failure;
use crate::record;
use ::record::{Figures, Record, Spread};
use model::{Mode, PerMetric, RobotIndex};
use report::{Blame, LatencyFacts, LoopLatency, Percentiles, ProcessFacts};
use std::collections::BTreeMap;
use std::path::Path;

/// Reads it.
///
/// # Errors
/// With exit code 2, when there is no record, or it holds no figures.
pub(super) fn look(path: &Path) -> Result<Look, Failure> {
    let record = record::open(path)?;
    record::tell_gaps(path, &record);
    let Some((tick, figures)) = record.figures().map_err(|error| record::refused(path, &error))? else {
        let shown = path.display();
        return Err(Failure::usage(format!("record `{shown}`: it has no latencies"))
            .hint("those of a run in `lockstep` or `realtime` have, from its first second on"));
    };
    let scenario = record.scenario();
    let (mode, tick_hz) = (scenario.clock.mode, scenario.clock.tick_hz);
    let names: BTreeMap<RobotIndex, String> = record.robots().map(|(index, robot)| (index, robot.id.clone())).collect();
    Ok(Look {
        what: "record",
        fleet: path.display().to_string(),
        scenario: scenario.name.clone(),
        mode,
        tick_hz,
        tick,
        robots: BTreeMap::new(),
        world: None,
        facts: facts(&figures, &record, mode == Mode::Realtime),
        names,
    })
}

/// The figures as reports have them.
fn facts(figures: &[(String, Figures)], record: &Record, realtime: bool) -> LatencyFacts {
    let of = |name: &str| figures.iter().find(|(own, _)| own == name).map(|(_, figures)| figures);
    let own = |index: Option<RobotIndex>, name: &str| of(name).map(|figures| of_loop(index, name, figures, realtime));
    let fleet = of("fleet").cloned().unwrap_or_default();
    LatencyFacts {
        metrics: metrics(&fleet),
        periods: realtime.then_some(fleet.periods),
        deadline_misses: realtime.then_some(fleet.deadline_misses),
        blame: realtime.then(|| Blame::of(fleet.late)),
        per_robot: record.robots().filter_map(|(index, robot)| own(Some(index), &robot.id)).collect(),
        world: own(None, ProcessFacts::WORLD),
    }
}

fn of_loop(index: Option<RobotIndex>, name: &str, figures: &Figures, realtime: bool) -> LoopLatency {
    LoopLatency {
        id: name.to_owned(),
        index,
        metrics: metrics(figures),
        periods: figures.periods,
        deadline_misses: realtime.then_some(figures.deadline_misses),
        blame: realtime.then(|| Blame::of(figures.late)),
        run_queue_wait: figures.run_queue_wait,
    }
}

fn metrics(figures: &Figures) -> PerMetric<Option<Percentiles>> {
    PerMetric::of(|metric| {
        figures.spreads[metric].map(|Spread { n, p50, p90, p99, p999, max }| Percentiles {
            p50,
            p90,
            p99,
            p999,
            max,
            n,
        })
    })
}
