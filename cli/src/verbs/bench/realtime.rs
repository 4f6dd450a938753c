//! `shoal bench realtime`: a fleet on its timers, and as many bare timers at the same rate, by turns.

use super::crew;
use super::figures::{Beside, Document, code, quantile, short};
use super::scene::Scene;
use crate::args::BenchRealtimeArgs;
use crate::exit::{self, Failure};
use crate::out;
use crate::progress::Bar;
use bus::{Counter, StatsSnapshot};
use daemon::coordinator::News;
use daemon::signals::Interrupted;
use daemon::supervisor::{self, FleetView, Start, Watch};
use model::Metric;
use report::Column;
use serde::Serialize;
use std::time::Duration;

/// Rates that are tried, Hz.
const RATES_HZ: [u32; 8] = [1000, 500, 200, 100, 50, 20, 10, 5];
/// Periods per second that a fleet is asked for in all, at most.
const PERIODS_PER_S_MAX: u32 = 16_000;

#[derive(Serialize)]
struct Row {
    robots: usize,
    planner: &'static str,
    rate_hz: u32,
    repetitions: usize,
    periods: u64,
    /// Share of the periods that ended before their work was done, or that a bare timer slept through.
    missed: Beside,
    /// How late an agent or a timer woke, us: half of the time at most this.
    wake_us_p50: Beside,
    /// The same, 99 of 100 times.
    wake_us_p99: Beside,
}

pub(super) fn run(options: &BenchRealtimeArgs) -> Result<i32, Failure> {
    let interrupted = Interrupted::watch(exit::INTERRUPTED)?;
    let mut rows = Vec::new();
    for &robots in &options.robots {
        if interrupted.yes() {
            break;
        }
        let rate_hz = options.hz.unwrap_or_else(|| rate_of(robots));
        out::talk(&format!("{robots} robots at {rate_hz} Hz: {} times {} s", options.repetitions, options.seconds));
        rows.extend(measure(robots, rate_hz, options, &interrupted)?);
    }
    let document = Document::new("shoal.bench-realtime/1", rows, &interrupted);
    let columns = [
        Column::right("robots", 0),
        Column::right("Hz", 0),
        Column::right("missed %", 0),
        Column::right("bare", 0),
        Column::right("wake p50 us", 0),
        Column::right("bare", 0),
        Column::right("ratio", 0),
        Column::right("p99 us", 1),
        Column::right("bare", 1),
        Column::right("ratio", 1),
        Column::right("periods", 2),
    ];
    let cells = |row: &Row| {
        let (p50, p99) = (row.wake_us_p50, row.wake_us_p99);
        let missed = [row.missed.fleet, row.missed.bare].map(|share| format!("{:.3}", 100.0 * share));
        [row.robots.to_string(), row.rate_hz.to_string()]
            .into_iter()
            .chain(missed)
            .chain([p50.fleet, p50.bare, p50.ratio, p99.fleet, p99.bare, p99.ratio].map(short))
            .chain([row.periods.to_string()])
            .collect()
    };
    document.print(
        options.format,
        &columns,
        cells,
        &[
            "How late agents wake for their periods, beside bare timers of the same number, rate and spread; medians of \
             the repetitions. Missed are periods that were over before their work was.",
        ],
    )?;
    Ok(code(&interrupted))
}

/// The highest rate at which so many robots stay below [`PERIODS_PER_S_MAX`].
fn rate_of(robots: usize) -> u32 {
    let fits = |rate: &&u32| robots as u64 * u64::from(**rate) <= u64::from(PERIODS_PER_S_MAX);
    *RATES_HZ.iter().find(fits).unwrap_or(&RATES_HZ[RATES_HZ.len() - 1])
}

/// What one repetition found: the periods, how many of them were missed, and the percentiles of the lateness, us.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    periods: u64,
    missed: u64,
    p50_us: f64,
    p99_us: f64,
}

fn measure(
    robots: usize,
    rate_hz: u32,
    options: &BenchRealtimeArgs,
    interrupted: &Interrupted,
) -> Result<Option<Row>, Failure> {
    let scene = Scene {
        robots,
        mode: "realtime",
        planner: "straight",
        obstacles: false,
        parked: false,
        tick_hz: f64::from(rate_hz),
        duration_s: options.seconds,
    };
    let mut found: Vec<[Found; 2]> = Vec::new();
    let (mut bar, what) = (Bar::on_terminal(), format!("{robots} robots at {rate_hz} Hz"));
    for done in 0..options.repetitions {
        bar.at(done.into(), options.repetitions.into(), &what);
        let fleet = fleet(&scene)?;
        crew::rest(Duration::from_millis(200), interrupted);
        if interrupted.yes() {
            break;
        }
        let bare = bare(robots, rate_hz, options.seconds)?;
        found.push([fleet, bare]);
    }
    let Some(first) = found.first() else { return Ok(None) };
    let pairs = |pick: fn(&Found) -> f64| {
        Beside::of(&found.iter().map(|[fleet, bare]| (pick(fleet), pick(bare))).collect::<Vec<_>>())
    };
    // Misses are rare: all repetitions together.
    let share = |side: usize| {
        let (missed, periods) =
            found.iter().fold((0, 0), |sum, both| (sum.0 + both[side].missed, sum.1 + both[side].periods));
        missed as f64 / periods.max(1) as f64
    };
    let (fleet, bare) = (share(0), share(1));
    debug_assert!(first[0].periods > 0);
    Ok(Some(Row {
        robots,
        planner: scene.planner,
        rate_hz,
        repetitions: found.len(),
        periods: found.iter().map(|[fleet, _]| fleet.periods).sum(),
        missed: Beside { fleet, bare, ratio: fleet / bare },
        wake_us_p50: pairs(|found| found.p50_us),
        wake_us_p99: pairs(|found| found.p99_us),
    }))
}

fn fleet(scene: &Scene) -> Result<Found, Failure> {
    let finished = supervisor::run(scene.scenario()?, Start::default(), &mut Silent)?.undisturbed()?;
    let mut stats = StatsSnapshot::default();
    let agents = finished.stats.iter().filter(|(name, _)| name != bus::stats::WORLD);
    agents.for_each(|(_, snapshot)| stats.merge(snapshot));
    let wake = stats.percentiles(Metric::Wake).unwrap_or_default();
    Ok(Found {
        periods: stats.counter(Counter::Periods),
        missed: stats.counter(Counter::DeadlineMisses),
        p50_us: wake.p50 as f64 * 1e-3,
        p99_us: wake.p99 as f64 * 1e-3,
    })
}

/// One timer more than there are robots: the world has one, too.
fn bare(robots: usize, rate_hz: u32, seconds: f64) -> Result<Found, Failure> {
    let period_ns = 1_000_000_000 / u64::from(rate_hz);
    let mut late_us = crew::timers(robots + 1, period_ns, seconds)?;
    // One that is later than its period is long has slept through the next ones as well.
    let period_us = period_ns as f64 * 1e-3;
    Ok(Found {
        periods: late_us.len() as u64,
        missed: late_us.iter().filter(|late| **late > period_us).count() as u64,
        p50_us: quantile(&mut late_us, 0.5),
        p99_us: quantile(&mut late_us, 0.99),
    })
}

struct Silent;

impl Watch for Silent {
    fn started(&mut self, _: &FleetView<'_>) {}

    fn progress(&mut self, _: &bus::Progress, _: f64) {}

    fn say(&mut self, line: &str) {
        out::talk(line);
    }

    fn news(&mut self, _: News, line: &str) {
        out::talk(line);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn larger_fleets_are_slower() {
        assert_eq!([15, 64, 200, 1000].map(rate_of), [1000, 200, 50, 10]);
    }
}
