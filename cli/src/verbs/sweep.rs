//! `shoal sweep`: scenarios x planners x varied keys x seeds, over all processors, and what all runs say together.

mod lockstep;

use crate::args::{Format, SweepArgs, SweepMode};
use crate::exit::{self, Failure, Line};
use crate::file::STANDARD;
use crate::progress::Bar;
use crate::{out, source};
use bus::clock;
use daemon::signals::Interrupted;
use model::{FilterKind, Mode};
use planners::params::nearest;
use std::path::Path;
use sweep::directory::{self, Directory};
use sweep::execute::{self, Execute};
use sweep::plan::SCHEMA;
use sweep::{Error, ErrorKind, Plan, Record, ScenarioSource, Summary, Varied, pool, summary, text};

/// Combinations whose problems are printed; the problems of more are mostly the same.
const REFUSED_MAX: usize = 10;
/// Failed runs that are listed on standard output; summary.txt lists all.
const FAILURES_MAX: usize = 10;

/// Runs the sweep, prints its summary, and says how to exit.
///
/// # Errors
/// With exit code 2, when what was asked for is wrong or the directory is that of something else; with 3, when the
/// environment does not allow it.
pub fn run(options: &SweepArgs) -> Result<i32, Failure> {
    let plan = plan_of(options)?;
    check_names(options, &plan)?;
    let interrupted = Interrupted::watch(exit::INTERRUPTED)?;
    let mut live = Bar::on_terminal();
    if !check_scenarios(&plan, &interrupted, &mut live)? {
        return Ok(exit::INTERRUPTED);
    }
    let opened = options.out.as_deref().map(|path| Directory::open(path, &plan)).transpose()?;
    let (mut directory, kept) = opened.unzip();
    let mut records: Vec<Option<Record>> = vec![None; plan.runs()];
    for record in kept.into_iter().flatten() {
        let run = record.run;
        records[run] = Some(record);
    }
    let to_do: Vec<usize> = (0..plan.runs()).filter(|run| records[*run].is_none()).collect();
    let resumed = plan.runs() - to_do.len();
    if resumed > 0 {
        live.finish();
        out::talk(&format!("{resumed} of {} runs have ended before and are not repeated", plan.runs()));
    }
    let execute: &Execute<'_> = match options.mode {
        SweepMode::Single => &execute::single,
        SweepMode::Lockstep => &lockstep::run,
    };
    // Its estimate counts from here.
    live = Bar::on_terminal();
    let jobs = options.jobs.map_or_else(processors, usize::from);
    let began_ns = clock::now_ns();
    let state = std::cell::Cell::new((0, 0));
    let mut keep = |record: Record| {
        if let Some(directory) = &mut directory {
            directory.keep(&record)?;
        }
        let (done, failed) = state.get();
        state.set((done + 1, failed + usize::from(!record.success)));
        // As it would be read again: see `Record::parse`.
        let record = Record::parse(&record.line()).expect("a record that was just written");
        let run = record.run;
        records[run] = Some(record);
        Ok(())
    };
    let mut told = || {
        let (done, failed) = state.get();
        let wall_s = clock::now_ns().saturating_sub(began_ns) as f64 * 1e-9;
        let (all_done, runs) = (resumed + done, plan.runs());
        live.at(all_done as u64, runs as u64, &progress_words(all_done, runs, done, failed, wall_s));
    };
    let ran = pool::run(&plan, &to_do, jobs, execute, &|| interrupted.yes(), &mut keep, &mut told);
    live.finish();
    if interrupted.yes() {
        let kept = records.iter().flatten().count();
        out::talk(&interrupted_line(kept, plan.runs(), options.out.as_deref()));
        return Ok(exit::INTERRUPTED);
    }
    ran?;
    let records: Vec<Record> = records.into_iter().map(|record| record.expect("every run has ended")).collect();
    let summary = summary::summarize(&plan, &records, options.baseline.as_deref(), &options.assertions);
    // Whatever becomes of standard output, the files are written.
    let written = directory.map(|directory| directory.finish(&plan, &records, &summary)).transpose();
    let printed = print(&summary, options.format);
    if let (Ok(Some(files)), Some(path), Format::Text) = (&written, &options.out, options.format) {
        let (pictures, others): (Vec<&str>, Vec<&str>) =
            files.iter().map(String::as_str).partition(|name| name.ends_with(".svg"));
        let plots = if pictures.len() == 1 { "1 box plot".to_owned() } else { format!("{} box plots", pictures.len()) };
        out::talk(&format!("{}: runs.jsonl, {}, {plots}", path.display(), others.join(", ")));
    }
    Failure::first_of([printed, written.map(drop).map_err(Failure::from)])?;
    let holds = summary.assertions.iter().all(|checked| checked.holds);
    Ok(if holds { exit::OK } else { exit::EXPECTATIONS })
}

/// What is to be run.
fn plan_of(options: &SweepArgs) -> Result<Plan, Failure> {
    let mut scenarios = Vec::new();
    let mut refused: Vec<Failure> = Vec::new();
    for name in &options.scenarios {
        if name == STANDARD {
            let failure = Failure::usage("scenario `-`: a sweep cannot read standard input");
            refused.push(failure.hint("write it to a file, so that the command of a run can be repeated"));
            continue;
        }
        match source::read(name) {
            Ok((shown, text)) => scenarios.push(ScenarioSource::new(shown, text).with_files(source::Folder::of(name))),
            Err(failure) => refused.push(failure),
        }
    }
    Failure::first_of(refused.into_iter().map(Err))?;
    let plan = Plan {
        schema: SCHEMA.to_owned(),
        shoal: env!("CARGO_PKG_VERSION").to_owned(),
        build: directory::build(),
        mode: Mode::from(options.mode),
        scenarios,
        planners: options.planners.clone(),
        set: options.set.clone(),
        varied: varied(options),
        seeds: options.seeds.0.clone(),
    };
    plan.check()?;
    Ok(plan)
}

/// The varied keys; filters are one of them.
fn varied(options: &SweepArgs) -> Vec<Varied> {
    let values: Vec<String> =
        options.filters.iter().map(|filter| format!("\"{}\"", FilterKind::from(*filter).word())).collect();
    let filters = (!values.is_empty()).then(|| Varied { key: "defaults.filter".to_owned(), values });
    filters.into_iter().chain(options.varied.iter().cloned()).collect()
}

/// Planners that --baseline and --assert name are among those of the sweep.
fn check_names(options: &SweepArgs, plan: &Plan) -> Result<(), Failure> {
    let check = |what: String, name: &str| {
        if plan.planners.iter().any(|planner| planner == name) {
            return Ok(());
        }
        let failure = Failure::usage(format!("{what}: planner `{}` is not in the sweep", name.escape_debug()));
        let list = plan.planners.join(", ");
        Err(match nearest(name, plan.planners.iter().map(String::as_str)) {
            _ if plan.planners.is_empty() => failure.hint(format!("add it: `--planner {name}`")),
            Some(near) => failure.hint(format!("planners of the sweep: {list} (did you mean `{near}`?)")),
            None => failure.hint(format!("planners of the sweep: {list}; `--planner {name}` adds it")),
        })
    };
    if let Some(name) = &options.baseline {
        check("--baseline".to_owned(), name)?;
    }
    for assertion in &options.assertions {
        if let Some(name) = assertion.planner() {
            check(format!("--assert {}", assertion.text()), name)?;
        }
        if assertion.needs_baseline() && options.baseline.is_none() {
            return Err(Failure::usage(format!("--assert {}: it needs a baseline", assertion.text()))
                .hint("name the planner to compare with: `--baseline PLANNER`"));
        }
        let is_ratio_of_itself = assertion.needs_baseline() && assertion.planner() == options.baseline.as_deref();
        if is_ratio_of_itself {
            return Err(Failure::usage(format!("--assert {}: the baseline has no ratio to itself", assertion.text()))
                .hint("name another planner"));
        }
    }
    Ok(())
}

/// Checks every combination of scenario, planner and varied keys with the first seed, and every seed with the first of
/// these combinations of its scenario, and prints warnings; false if it was interrupted.
///
/// # Errors
/// With the problems of all of them.
fn check_scenarios(plan: &Plan, interrupted: &Interrupted, live: &mut Bar) -> Result<bool, Failure> {
    let seeds = plan.seeds.len();
    let cells_of_each = plan.cells() / plan.scenarios.len();
    let (mut refused, mut warned) = (Vec::<Failure>::new(), Vec::<String>::new());
    let is_checked = |index: &usize| index.is_multiple_of(seeds) || (index / seeds).is_multiple_of(cells_of_each);
    for index in (0..plan.runs()).filter(is_checked) {
        if interrupted.yes() {
            return Ok(false);
        }
        live.at(index as u64, plan.runs() as u64, "checking the scenarios");
        match plan.run(index).scenario() {
            Ok(scenario) => {
                let name = &plan.run(index).scenario.name;
                let text = source::warnings(name, &scenario.warnings, out::stderr_colored());
                if !text.is_empty() && !warned.contains(&text) {
                    warned.push(text);
                }
            }
            Err(problems) => {
                let failure = source::failure(&problems);
                if !refused.contains(&failure) {
                    refused.push(failure);
                }
                if refused.len() == REFUSED_MAX {
                    break;
                }
            }
        }
    }
    live.finish();
    if !refused.is_empty() {
        return Err(merged(refused));
    }
    warned.iter().for_each(|text| out::talk(text));
    Ok(true)
}

/// All lines of several failures, each once.
fn merged(failures: Vec<Failure>) -> Failure {
    let mut lines: Vec<Line> = Vec::new();
    for line in failures.iter().flat_map(|failure| &failure.lines) {
        if !lines.contains(line) {
            lines.push(line.clone());
        }
    }
    Failure { code: exit::USAGE, lines }
}

fn print(summary: &Summary, format: Format) -> Result<(), Failure> {
    match format {
        Format::Json => out::data(&directory::json(summary)),
        Format::Text => {
            let page = report::layout::Style { width: out::stdout_width(), color: out::stdout_colored() };
            out::data(&text::render(summary, &text::Style { page, failures_max: FAILURES_MAX }))
        }
    }
}

/// Processors that this process may use.
fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// What the runs come to so far.
fn progress_words(done: usize, of: usize, to_do_done: usize, failed: usize, wall_s: f64) -> String {
    let rate = if to_do_done > 0 && wall_s > 0.0 {
        format!("  {:.1} runs/s", to_do_done as f64 / wall_s)
    } else {
        String::new()
    };
    format!("{done} of {of} runs{rate}  {failed} failed")
}

fn interrupted_line(kept: usize, runs: usize, out: Option<&Path>) -> String {
    match out {
        Some(path) => format!(
            "interrupted: {kept} of {runs} runs are kept in {}; give the same command again to resume",
            path.display()
        ),
        None => format!("interrupted: {kept} of {runs} runs had ended; with `--out DIR` they are kept"),
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Failure {
        let code = match error.kind {
            ErrorKind::Usage => exit::USAGE,
            ErrorKind::Environment => exit::ENVIRONMENT,
        };
        Failure::new(code, error.message).hints(error.hints)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_says_how_the_runs_go() {
        assert_eq!(progress_words(0, 10, 0, 0, 0.0), "0 of 10 runs  0 failed");
        assert_eq!(progress_words(50, 100, 10, 2, 5.0), "50 of 100 runs  2.0 runs/s  2 failed");
    }
}
