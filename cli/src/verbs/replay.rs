//! `shoal replay`: what is in a record, whether the run computes again to the same, and how two runs differ.

use crate::args::{Format, ReplayArgs};
use crate::exit::{self, Failure};
use crate::progress::Bar;
use crate::{out, record, talk};
use ::record::Record;
use daemon::coordinator;
use model::{Event, Scenario};
use replay::compare::{Apart, Comparison};
use replay::{Verdict, of_record};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;

/// What every JSON document of this verb says of itself.
const SCHEMA: &str = "shoal.replay/1";
/// Robots that drifted apart are told up to this number.
const TOLD_MAX: usize = 20;

/// Tells what is in a record, or verifies it, or holds it against another one.
///
/// # Errors
/// With exit code 2, when there is no such record.
pub fn run(options: &ReplayArgs) -> Result<i32, Failure> {
    let record = record::open(&options.file)?;
    record::tell_gaps(&options.file, &record);
    if let Some(against) = &options.against {
        return compare(options, &record, against);
    }
    if options.verify { verify(options, &record) } else { summarize(options, &record).map(|()| exit::OK) }
}

fn verify(options: &ReplayArgs, record: &Record) -> Result<i32, Failure> {
    let (about, this) = (record.about(), ::record::build());
    if this.as_deref().unwrap_or("unknown") != about.build {
        talk::lines(&format!(
            "warning: record `{}`: another build of shoal wrote it (version {}): the same bits are promised for the same \
             build only",
            options.file.display(),
            about.version
        ));
    }
    let (mut bar, what) = (Bar::new(), options.file.display().to_string());
    let verified = of_record::verify(record, &mut |done, total| bar.at(done, total, &what));
    bar.finish();
    let verdict = verified.map_err(|error| record::refused(&options.file, &error))?;
    match options.format {
        Format::Json => out::json(&verdict_json(options, record, &verdict))?,
        Format::Text => out::data(&verdict_text(record, &verdict))?,
    }
    Ok(if is_equal(&verdict) { exit::OK } else { exit::EXPECTATIONS })
}

/// Whether there was something to compare, and all of it is the same. A record that is cut off is compared up to there.
fn is_equal(verdict: &Verdict) -> bool {
    verdict.first.is_none() && verdict.ends_early.is_none() && verdict.frames > 0
}

fn verdict_json(options: &ReplayArgs, record: &Record, verdict: &Verdict) -> Value {
    let mut document = head(options, record);
    document["equal"] = json!(is_equal(verdict));
    document["verdict"] = json!(verdict);
    document["verdict"]["trajectory_hash"] = json!(format!("{:016x}", verdict.trajectory_hash));
    document
}

fn head(options: &ReplayArgs, record: &Record) -> Value {
    let about = record.about();
    json!({
        "schema": SCHEMA,
        "record": options.file.to_string_lossy(),
        "scenario": about.name,
        "mode": about.mode,
        "seed": about.seed,
        "shoal": about.version,
        "build": about.build,
        "whole": record.is_whole(),
    })
}

fn verdict_text(record: &Record, verdict: &Verdict) -> String {
    let about = record.about();
    let word = match (&verdict.first, &verdict.ends_early) {
        (Some(_), _) => "differs",
        (None, Some(_)) => "cannot be verified to its end",
        (None, None) if verdict.frames == 0 => "nothing to compare: the record holds no frame",
        (None, None) if verdict.is_whole => "equal",
        (None, None) => "equal as far as it goes",
    };
    let mut text = format!("{}, {}, seed {}: {word}\n", about.name, about.mode, about.seed);
    if let Some(first) = &verdict.first {
        let _ = writeln!(text, "first difference: {first}");
        if verdict.differences > 1 {
            let _ =
                writeln!(text, "{} differences in all; most of them follow from the first one", verdict.differences);
        }
    }
    if let Some((tick, why)) = &verdict.ends_early {
        let _ = writeln!(text, "from tick {tick} on: {why}");
    }
    let Verdict { ticks, frames, steps, commands, events, .. } = verdict;
    let outcome = if verdict.is_whole { ", the outcome" } else { "" };
    let _ = writeln!(text, "compared: {ticks} ticks, {frames} frames, {commands} commands, {events} events{outcome}");
    let _ = writeln!(text, "computed: {steps} steps of agents, trajectory hash {:016x}", verdict.trajectory_hash);
    for robot in &verdict.unverified {
        let life = if robot.incarnation > 0 { format!(" (incarnation {})", robot.incarnation) } else { String::new() };
        let _ = writeln!(
            text,
            "not computed: robot `{}`{life} from tick {} on, {} commands taken from the record: {}",
            robot.robot, robot.tick, robot.commands, robot.why
        );
    }
    text
}

fn compare(options: &ReplayArgs, record: &Record, against: &Path) -> Result<i32, Failure> {
    let other = record::open(against)?;
    record::tell_gaps(against, &other);
    let compared = of_record::compare([record, &other], &mut |_, _| {});
    let comparison = compared.map_err(|error| record::refused(&options.file, &error))?;
    match options.format {
        Format::Json => {
            let mut document = head(options, record);
            document["against"] = json!(against.to_string_lossy());
            document["equal"] = json!(comparison.first.is_none());
            document["comparison"] = json!(comparison);
            out::json(&document)?;
        }
        Format::Text => out::data(&comparison_text([record, &other], &comparison))?,
    }
    Ok(if comparison.first.is_none() { exit::OK } else { exit::EXPECTATIONS })
}

fn comparison_text(records: [&Record; 2], comparison: &Comparison) -> String {
    let mut text = String::new();
    for (word, record) in ["record", "against"].into_iter().zip(records) {
        let about = record.about();
        let _ = writeln!(text, "{word:<8} {}, {}, seed {}", about.name, about.mode, about.seed);
    }
    let Some(first) = &comparison.first else {
        let _ = writeln!(text, "equal: {} ticks", comparison.ticks);
        return text;
    };
    let robot = first.robot.as_ref().map(|robot| format!(", robot `{robot}`")).unwrap_or_default();
    let _ = writeln!(
        text,
        "first difference: tick {}{robot}, {}: {} against {}",
        first.tick, first.field, first.recorded, first.replayed
    );
    let [one, other] = comparison.lengths;
    let _ = writeln!(text, "ticks: {one} against {other}, {} in both", comparison.ticks);
    for name in &comparison.unmatched {
        let _ = writeln!(text, "`{name}` is not in both at all ticks");
    }
    let mut apart: Vec<&Apart> = comparison.robots.iter().filter(|apart| apart.from_tick.is_some()).collect();
    apart.sort_by(|a, b| b.max_m.total_cmp(&a.max_m));
    if !apart.is_empty() {
        let width = apart.iter().map(|apart| apart.robot.len()).max().unwrap_or(0).max(5);
        let _ = writeln!(text, "{:<width$}  from tick  greatest m  at tick  mean m  last m", "robot");
        for Apart { robot, from_tick, max_m, max_tick, mean_m, last_m } in apart.iter().take(TOLD_MAX) {
            let from = from_tick.unwrap_or_default();
            let _ = writeln!(
                text,
                "{robot:<width$}  {from:>9}  {max_m:>10.3}  {max_tick:>7}  {mean_m:>6.3}  {last_m:>6.3}"
            );
        }
        if apart.len() > TOLD_MAX {
            let _ = writeln!(text, "{} more; `--format json` has all", apart.len() - TOLD_MAX);
        }
    }
    text
}

fn summarize(options: &ReplayArgs, record: &Record) -> Result<(), Failure> {
    let scenario = with_added(record);
    match options.format {
        Format::Json => {
            let mut document = head(options, record);
            document["events"] = json!(record.events());
            document["outcome"] = json!(record.ending().map(|ending| &ending.outcome));
            out::json(&document)
        }
        Format::Text => out::data(&summary_text(record, &scenario)),
    }
}

/// The scenario with the robots that came while the fleet ran.
fn with_added(record: &Record) -> Scenario {
    let robots = record.robots().map(|(_, robot)| robot.clone()).collect();
    Scenario { robots, ..record.scenario().clone() }
}

fn summary_text(record: &Record, scenario: &Scenario) -> String {
    let about = record.about();
    let mut text = format!(
        "{}, {}, seed {}, {} Hz; recorded by shoal {}\n",
        about.name, about.mode, about.seed, about.tick_hz, about.version
    );
    match record.ending().map(|ending| &ending.outcome) {
        Some(outcome) => {
            let arrived = outcome.robots.iter().filter(|robot| robot.arrived).count();
            let _ = writeln!(
                text,
                "{:.2} s, {} ticks; {arrived} of {} robots arrived; {} contacts; trajectory hash {:016x}",
                outcome.ticks as f64 * scenario.clock.dt_s(),
                outcome.ticks,
                outcome.robots.len(),
                outcome.robot_contacts + outcome.obstacle_contacts,
                outcome.trajectory_hash
            );
        }
        None => _ = writeln!(text, "it does not say how the run ended"),
    }
    let line = |event: &Event| coordinator::describe(scenario, event) + "\n";
    text.extend(record.events().iter().map(line));
    text
}
