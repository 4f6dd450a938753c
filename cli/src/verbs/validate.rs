//! `shoal validate`: checks scenarios without running them.

use crate::args::{Format, ValidateArgs};
use crate::exit::{self, Failure, Line};
use crate::out;
use crate::source;
use model::{Mode, Problem, Scenario};
use scenarios::Overrides;
use serde::Serialize;
use std::ffi::{OsStr, OsString};

/// What there is to say about one scenario.
#[derive(Debug, Serialize)]
struct Entry {
    file: String,
    ok: bool,
    name: Option<String>,
    description: Option<String>,
    mode: Option<Mode>,
    tick_hz: Option<f64>,
    duration_s: Option<f64>,
    robots: Option<usize>,
    obstacles: Option<usize>,
    /// Walls of its map, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    walls: Option<usize>,
    events: Option<usize>,
    problems: Vec<ProblemEntry>,
    /// Problems that are left out because there are many like them.
    problems_more: usize,
    /// What is questionable; the scenario can be run nevertheless.
    warnings: Vec<ProblemEntry>,
    #[serde(skip)]
    failure: Option<Failure>,
    /// The warnings, for people.
    #[serde(skip)]
    told: Vec<Problem>,
}

#[derive(Debug, Serialize)]
struct ProblemEntry {
    line: Option<usize>,
    key: String,
    message: String,
    hint: Option<String>,
}

/// Checks the scenarios, or the whole catalog if none is named, and says what is in them or what is wrong with them.
///
/// # Errors
/// When standard output cannot be written. Wrong scenarios are no error here, but lead to exit code 2.
pub fn run(options: &ValidateArgs) -> Result<i32, Failure> {
    let all = options.scenarios.is_empty();
    let names: Vec<OsString> = if all {
        scenarios::catalog().iter().map(|entry| entry.name.into()).collect()
    } else {
        options.scenarios.clone()
    };
    let entries: Vec<Entry> = names.iter().map(|name| check(name)).collect();
    match options.format {
        Format::Json => out::json(&serde_json::json!({ "schema": "shoal.validate/1", "files": entries }))?,
        Format::Text => {
            for entry in &entries {
                match &entry.failure {
                    Some(failure) => out::fail(failure),
                    None => out::data(&ok_line(entry, all))?,
                }
                if !entry.told.is_empty() {
                    out::talk(&source::warnings(&entry.file, &entry.told, out::stderr_colored()));
                }
            }
        }
    }
    Ok(if entries.iter().all(|entry| entry.ok) { exit::OK } else { exit::USAGE })
}

fn check(name: &OsStr) -> Entry {
    let file = name.to_string_lossy().into_owned();
    let (file, text) = match source::read(name) {
        Ok(read) => read,
        Err(failure) => return unreadable(file, failure),
    };
    match scenarios::parse_with_files(&file, &text, &Overrides::default(), &source::Folder::of(name)) {
        Ok(scenario) => sound(file, &scenario),
        Err(problems) => {
            let listed = problems.shown.iter().map(problem_entry).collect();
            let more = problems.count() - problems.shown.len();
            Entry { problems: listed, problems_more: more, ..unsound(file, source::failure(&problems)) }
        }
    }
}

fn sound(file: String, scenario: &Scenario) -> Entry {
    Entry {
        file,
        ok: true,
        name: Some(scenario.name.clone()),
        description: Some(scenario.description.clone()),
        mode: Some(scenario.clock.mode),
        tick_hz: Some(scenario.clock.tick_hz),
        duration_s: Some(scenario.clock.ticks_max as f64 * scenario.clock.dt_s()),
        robots: Some(scenario.robots.len()),
        obstacles: Some(scenario.obstacles.len()),
        walls: scenario.walls().map(geometry::Map::len),
        events: Some(scenario.events.len()),
        problems: Vec::new(),
        problems_more: 0,
        warnings: scenario.warnings.iter().map(problem_entry).collect(),
        failure: None,
        told: scenario.warnings.clone(),
    }
}

fn unsound(file: String, failure: Failure) -> Entry {
    Entry {
        file,
        ok: false,
        name: None,
        description: None,
        mode: None,
        tick_hz: None,
        duration_s: None,
        robots: None,
        obstacles: None,
        walls: None,
        events: None,
        problems: Vec::new(),
        problems_more: 0,
        warnings: Vec::new(),
        failure: Some(failure),
        told: Vec::new(),
    }
}

/// A file that cannot be read has one problem.
fn unreadable(file: String, failure: Failure) -> Entry {
    let texts = |hints: bool| {
        let wanted = failure.lines.iter().filter_map(|line| match line {
            Line::Error(text) if !hints => Some(text.as_str()),
            Line::Hint(text) if hints => Some(text.as_str()),
            _ => None,
        });
        wanted.collect::<Vec<_>>().join("; ")
    };
    let problem = ProblemEntry { line: None, key: String::new(), message: texts(false), hint: Some(texts(true)) };
    Entry { problems: vec![problem], ..unsound(file, failure) }
}

fn problem_entry(problem: &Problem) -> ProblemEntry {
    let Problem { line, key, message, hint, .. } = problem.clone();
    ProblemEntry { line, key, message, hint }
}

fn ok_line(entry: &Entry, described: bool) -> String {
    let count = |n: Option<usize>, what: &str| {
        let n = n.unwrap_or(0);
        format!("{n} {what}{}", if n == 1 { "" } else { "s" })
    };
    let description = match &entry.description {
        Some(text) if described && !text.is_empty() => format!("    {text}\n"),
        _ => String::new(),
    };
    format!(
        "ok: {}: {}, {}{}, {}, {} s, {} at {} Hz\n{description}",
        entry.file,
        count(entry.robots, "robot"),
        count(entry.obstacles, "obstacle"),
        entry.walls.map(|walls| format!(", a map of {}", count(Some(walls), "wall"))).unwrap_or_default(),
        count(entry.events, "event"),
        entry.duration_s.unwrap_or(0.0),
        entry.mode.map_or("", Mode::word),
        entry.tick_hz.unwrap_or(0.0),
    )
}
