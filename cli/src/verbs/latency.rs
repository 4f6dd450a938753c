//! `shoal latency`: how late and how old things are in a running fleet. It reads what the processes count into shared
//! memory, and asks nobody: not the agents, which do not notice, and not the daemon, which may have been stopped.

mod histogram;
mod recorded;

use super::fleet;
use crate::args::{Format, LatencyArgs, MetricArg};
use crate::exit::Failure;
use crate::file::{Files, STANDARD};
use crate::out;
use bus::{Address, Counter, Gate, StatsSnapshot};
use histogram::Spread;
use model::{Metric, Mode, RobotIndex, Scenario};
use protocol::daemon_to_robot::AgentSpec;
use report::measured;
use report::text::{blame_words, latency_lines, percentile_cells, percentile_columns, period_lines};
use report::{Column, LatencyFacts, LatencyReport, LoopLatency, Page, Percentiles, judge, table};
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// What can be seen of a fleet at one moment.
struct Look {
    /// `fleet` or `record`.
    what: &'static str,
    /// Its name.
    fleet: String,
    scenario: String,
    mode: Mode,
    tick_hz: f64,
    tick: u64,
    robots: BTreeMap<RobotIndex, StatsSnapshot>,
    world: Option<StatsSnapshot>,
    names: BTreeMap<RobotIndex, String>,
    facts: LatencyFacts,
}

/// One robot's use of another one's poses.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Pair {
    robot: String,
    heard: String,
    pose_age_us: Percentiles,
}

/// Shows it.
///
/// # Errors
/// With exit code 3 when no fleet is running or a picture cannot be written, with 2 when the fleet must be named, or a
/// robot is not known.
pub fn run(options: &LatencyArgs) -> Result<(), Failure> {
    let alone = options.svg.as_deref() == Some(Path::new(STANDARD));
    let svg = options.svg.as_deref().filter(|_| !alone);
    let svg = svg.map(|path| Files::new().write("picture", "--svg", path)).transpose()?;
    let look = match &options.record {
        Some(path) => recorded::look(path)?.only(&options.robots)?,
        None => {
            let address = fleet::choose(&options.fleet)?;
            look(&address)
                .and_then(|look| look.only(&options.robots))
                .map_err(|failure| if address.root().exists() { failure } else { ended(&address) })?
        }
    };
    let MetricArg(metric) = options.metric;
    let spread = Spread::of(&look.robots, look.world.as_ref(), metric);
    let subject = match options.robots.is_empty() {
        true => metric.word().to_owned(),
        false => format!("{} of {}", metric.word(), options.robots.join(", ")),
    };
    let title = format!("{}, fleet {}: {subject}, {} values", look.scenario, look.fleet, spread.n());
    let draw = || view::histogram::draw(&title, "us, from", &spread.bars());
    let printed = match options.format {
        _ if alone => out::data(&draw()),
        Format::Json => {
            let mut value = look.json();
            if options.pairs {
                value["pairs"] = json!(look.pairs());
            }
            if options.histogram {
                value["histogram"] = json!({ "metric": metric.field(), "n": spread.n(), "bins": spread.json() });
            }
            out::measured(&value)
        }
        Format::Text => {
            let mut page = Page::new(out::stdout_width());
            look.text(&mut page, !options.robots.is_empty(), metric);
            if options.pairs {
                look.pairs_text(&mut page);
            }
            if options.histogram {
                page.gap();
                page.words(&format!("{subject}, us, {} values; a range begins at", spread.n()), 0);
                spread.text(&mut page);
            }
            out::data(&page.into_text())
        }
    };
    Failure::first_of([printed, svg.map_or(Ok(()), |file| file.write(draw().as_bytes()))])
}

/// How the loops of a fleet have done so far.
///
/// # Errors
/// When its files cannot be read.
pub(super) fn facts(address: &Address) -> Result<LatencyFacts, Failure> {
    look(address).map(|look| look.facts)
}

fn ended(address: &Address) -> Failure {
    Failure::environment(format!("fleet `{}`: the run has ended", address.id()))
        .hint("its report has the latency as well")
}

fn look(address: &Address) -> Result<Look, Failure> {
    let scenario: Scenario = fleet::left(address, world_sim::shell::SCENARIO_FILE)?;
    let stats = bus::stats::read_all(address)?;
    let (robots, world) = bus::stats::by_robot(&stats);
    let mut names: BTreeMap<RobotIndex, String> =
        scenario.robots.iter().enumerate().map(|(slot, robot)| (RobotIndex::of(slot), robot.id.clone())).collect();
    // Robots that were added are not in the scenario; what their agents were told is.
    for (name, instance) in stats.iter().filter_map(|(name, _)| Some((name, bus::stats::instance_of(name)?))) {
        if !names.contains_key(&instance.index)
            && let Ok(spec) = fleet::left::<AgentSpec>(address, name)
        {
            names.insert(instance.index, spec.robot.id);
        }
    }
    let mode = scenario.clock.mode;
    let facts = measured::latency(&stats, &|slot| names.get(&slot).cloned(), mode == Mode::Realtime);
    let tick = Gate::open(address)?.progress().tick;
    let fleet = address.id().to_owned();
    let (scenario, tick_hz) = (scenario.name, scenario.clock.tick_hz);
    Ok(Look { what: "fleet", fleet, scenario, mode, tick_hz, tick, robots, world, names, facts })
}

impl Look {
    /// Only these robots, or all if none is named.
    fn only(mut self, ids: &[String]) -> Result<Look, Failure> {
        if ids.is_empty() {
            return Ok(self);
        }
        let known = |id: &String| self.names.values().any(|name| name == id);
        if let Some(unknown) = ids.iter().find(|id| !known(id)) {
            let list: Vec<&str> = self.names.values().map(String::as_str).collect();
            return Err(Failure::usage(format!(
                "{} `{}`: unknown robot `{}`",
                self.what,
                self.fleet,
                unknown.escape_debug()
            ))
            .hint(format!("its robots: {}", list.join(", "))));
        }
        let names = &self.names;
        self.robots.retain(|slot, _| names.get(slot).is_some_and(|name| ids.contains(name)));
        self.facts.per_robot.retain(|robot| ids.contains(&robot.id));
        Ok(self)
    }

    /// Why the verdict would be `starved` if the run ended now.
    fn starved_because(&self) -> Vec<String> {
        let loops = self.facts.per_robot.iter().chain(&self.facts.world);
        let wait = loops.filter_map(|of| of.run_queue_wait).reduce(f64::max);
        judge::starved_because(
            self.mode,
            1.0 / self.tick_hz,
            Some(&LatencyReport { measured: self.facts.clone(), ..LatencyReport::default() }),
            wait,
        )
    }

    fn pairs(&self) -> Vec<Pair> {
        let name = |slot: RobotIndex| self.names.get(&slot).cloned().unwrap_or_else(|| format!("slot-{slot}"));
        let of = |(slot, snapshot): (&RobotIndex, &StatsSnapshot)| -> Vec<Pair> {
            let kept = snapshot.by_robot(Metric::PoseAge).into_iter();
            let pair = |(heard, percentiles)| Pair {
                robot: name(*slot),
                heard: name(heard),
                pose_age_us: measured::micros(percentiles),
            };
            kept.map(pair).collect()
        };
        self.robots.iter().flat_map(of).collect()
    }

    /// Uses of poses that are in no pair.
    fn uses_dropped(&self) -> u64 {
        self.robots.values().map(|snapshot| snapshot.counter(Counter::UsesDropped)).sum()
    }

    fn json(&self) -> Value {
        let because = self.starved_because();
        let mut value = json!({
            "schema": "shoal.latency/1",
            self.what: self.fleet,
            "scenario": self.scenario,
            "mode": self.mode.word(),
            "tick_hz": self.tick_hz,
            "tick": self.tick,
            "verdict": judge::verdict(&because, &[]),
            "starved_because": because,
            "pair_uses_dropped": self.uses_dropped(),
        });
        let facts = serde_json::to_value(&self.facts).expect("latencies have string keys only");
        if let (Value::Object(into), Value::Object(from)) = (&mut value, facts) {
            into.extend(from);
        }
        value
    }

    fn text(&self, page: &mut Page, named: bool, metric: Metric) {
        let because = self.starved_because();
        let verdict = if because.is_empty() { "valid" } else { "starved" };
        page.words(
            &format!(
                "{} {}: {}, {} at {} Hz, tick {} ({:.1} s); so far {verdict}",
                self.what,
                self.fleet,
                self.scenario,
                self.mode.word(),
                self.tick_hz,
                self.tick,
                self.tick as f64 / self.tick_hz
            ),
            2,
        );
        for reason in &because {
            page.words(&format!("- {reason}"), 2);
        }
        if named {
            self.facts.per_robot.iter().for_each(|robot| robot_text(page, robot));
            return;
        }
        let facts = &self.facts;
        if facts.per_robot.is_empty() {
            page.words("no robot is in the world yet", 0);
            return;
        }
        page.gap();
        latency_lines(page, "latency, us", &facts.metrics);
        period_lines(page, facts);
        self.robots_text(page, metric);
    }

    /// A row per robot, and one for the world.
    fn robots_text(&self, page: &mut Page, metric: Metric) {
        let loops = self.facts.per_robot.iter().chain(&self.facts.world);
        let rows: Vec<Vec<String>> = loops.filter_map(|of| loop_row(of, metric)).collect();
        page.gap();
        page.words(&format!("{}, us", metric.word()), 0);
        let columns: Vec<Column> = std::iter::once(Column::left("robot", 0, 32))
            .chain(percentile_columns())
            .chain([Column::right("missed", 5), Column::right("late", 6), Column::left("mostly", 7, 9)])
            .collect();
        for line in table(&columns, &rows, 2, page.width()) {
            page.line(&line);
        }
    }

    fn pairs_text(&self, page: &mut Page) {
        let rows: Vec<Vec<String>> = (self.pairs().into_iter())
            .map(|pair| [vec![pair.robot, pair.heard], percentile_cells(&pair.pose_age_us).to_vec()].concat())
            .collect();
        page.gap();
        page.words("age of the poses that a robot used, by whose they were, us (within 6.3 %)", 0);
        let columns: Vec<Column> = [Column::left("robot", 0, 32), Column::left("heard", 0, 32)]
            .into_iter()
            .chain(percentile_columns())
            .collect();
        for line in table(&columns, &rows, 2, page.width()) {
            page.line(&line);
        }
        if self.uses_dropped() > 0 {
            let most = bus::stats::PAIRS_MAX;
            page.words(
                &format!("{} uses are not listed: a robot keeps the last {most} that it heard", self.uses_dropped()),
                2,
            );
        }
    }
}

/// Everything about one robot.
fn robot_text(page: &mut Page, robot: &LoopLatency) {
    page.gap();
    page.words(&format!("{}, us", robot.id), 0);
    latency_lines(page, "", &robot.metrics);
    if let Some(missed) = robot.deadline_misses {
        page.row("missed periods", &format!("{missed} of {}", robot.periods));
    }
    if let Some(blame) = &robot.blame {
        page.row("late periods", &blame_words(blame));
    }
    if let Some(share) = robot.run_queue_wait {
        page.row("waited", &format!("{:.2} % of the time, for a processor", 100.0 * share));
    }
}

fn loop_row(of: &LoopLatency, metric: Metric) -> Option<Vec<String>> {
    let percentiles = of.metrics[metric]?;
    let late = of.blame.map_or_else(String::new, |blame| blame.late.to_string());
    let mostly = of.blame.and_then(|blame| blame.most()).map_or("", |(cause, _)| cause.word());
    let missed = of.deadline_misses.map_or_else(String::new, |missed| missed.to_string());
    Some([vec![of.id.clone()], percentile_cells(&percentiles).to_vec(), vec![missed, late, mostly.to_owned()]].concat())
}

#[cfg(test)]
mod tests;
