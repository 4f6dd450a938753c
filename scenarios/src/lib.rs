//! Scenarios: the TOML format, its validation, and the catalog that ships with shoal.
//!
//! A text becomes a [`Scenario`] in three steps: `document.rs` reads the TOML and remembers the lines, `walk.rs` checks
//! keys, types and bounds against the declarations of `table.rs`, and `resolve.rs` fills in defaults, places layouts and
//! checks what depends on more than one value. Each step goes on after a problem, so that all are reported at once. A
//! [`Draft`] is a document that is put together in code: it takes the second and the third step.
//!
//! Nothing here reads files or clocks: the caller reads those that a scenario names ([`Files`]).

mod add;
mod arm;
mod catalog;
mod check;
mod document;
mod draft;
mod files;
mod ground;
mod layers;
mod layout;
mod map;
mod methods;
mod node;
mod obstacles;
mod paper;
mod problems;
mod processes;
mod reference;
mod resolve;
mod robots;
mod schema;
mod table;
mod timeline;
mod types;
mod walk;
mod warnings;
mod wheels;

pub use add::{NewLayout, NewRobot, add_robot, goal_problem, places};
pub use catalog::{CatalogEntry, UnknownScenario, catalog, find_catalog};
pub use draft::{Draft, DraftValue};
pub use files::{Files, NamedIn, NoFiles};
pub use paper::{Expectation, Paper, Results};
pub use problems::Problems;
pub use reference::reference;
pub use schema::schema;

use document::{Raw, RawTable, RawValue};
use model::field::Table;
use model::key::{KeyName, Named, OptionalKey};
use model::{AgentCommand, FilterKind, Mode, Scenario};
use problems::{Origin, Report};
use table::{Body, Clock, Layout, Root};

/// What the command line changes in a scenario.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides {
    /// `--mode`.
    pub mode: Option<Mode>,
    /// `--planner`: every robot that this method can drive uses it; parameters for other methods no longer count.
    pub planner: Option<String>,
    /// `--filter`: every robot that can have a filter has this one.
    pub filter: Option<FilterKind>,
    /// `--agent`: every robot has this agent.
    pub agent: Option<AgentCommand>,
    /// `--robots`, for scenarios with a layout.
    pub robots: Option<usize>,
    /// `--seed`.
    pub seed: Option<u64>,
    /// `--duration`, s. Events that come later do not happen.
    pub duration_s: Option<f64>,
    /// `--set`, each as `path.to.key=TOML-value`. The options above are stronger.
    pub set: Vec<String>,
}

/// Reads a scenario that names no files. `file_name` is only for messages, and for the name of a scenario that has none.
///
/// # Errors
/// With all problems of the text.
pub fn parse(file_name: &str, text: &str, overrides: &Overrides) -> Result<Scenario, Problems> {
    parse_with_paper(file_name, text, overrides).map(|(scenario, _)| scenario)
}

/// Reads a scenario and the files that it names, such as its map.
///
/// # Errors
/// With all problems of the text and of the files.
pub fn parse_with_files(
    file_name: &str,
    text: &str,
    overrides: &Overrides,
    files: &dyn Files,
) -> Result<Scenario, Problems> {
    parse_all(file_name, text, overrides, files).map(|(scenario, _)| scenario)
}

/// Reads a scenario, and what its table `[paper]` says.
///
/// # Errors
/// With all problems of the text.
pub fn parse_with_paper(file_name: &str, text: &str, overrides: &Overrides) -> Result<(Scenario, Paper), Problems> {
    parse_all(file_name, text, overrides, &NoFiles)
}

fn parse_all(
    file_name: &str,
    text: &str,
    overrides: &Overrides,
    files: &dyn Files,
) -> Result<(Scenario, Paper), Problems> {
    let mut report = Report::new(format!("scenario `{file_name}`"), options(overrides));
    let Some(document) = document::read(text, &mut report) else {
        report.finish()?;
        unreachable!("a text that cannot be read has a problem");
    };
    read(stem(file_name), document, overrides, files, report)
}

impl Draft {
    /// The scenario, if this is the table of a whole one. `name` is for messages, and for a scenario without a name.
    ///
    /// # Errors
    /// With all problems, as a file has them; a draft has no lines, so they name the keys alone.
    pub fn scenario(self, name: &str) -> Result<Scenario, Problems> {
        let report = Report::new(format!("scenario `{name}`"), Vec::new());
        read(name, self.document(), &Overrides::default(), &NoFiles, report).map(|(scenario, _)| scenario)
    }
}

/// Checks and resolves a document.
fn read(
    name: &str,
    mut document: RawTable,
    overrides: &Overrides,
    files: &dyn Files,
    mut report: Report,
) -> Result<(Scenario, Paper), Problems> {
    let planner = apply(&mut document, overrides, &mut report);
    let root = walk::walk(document, &mut report);
    let (mut scenario, paper) = resolve::resolve(&root, name, (planner, overrides.filter), files, &mut report);
    if let Some(method) = planner.and_then(planners::find) {
        check_planner(method, &scenario, Origin::Option(overrides.set.len() + 1), &mut report);
    }
    if overrides.filter == Some(FilterKind::SharedGap) {
        check_filter(&scenario, Origin::Option(overrides.set.len() + 5), &mut report);
    }
    scenario.warnings = report.finish()?;
    Ok((scenario, paper))
}

/// Reports a method that replaces all others and cannot drive a single robot.
fn check_planner(method: &planners::Method, scenario: &Scenario, origin: Origin, report: &mut Report) {
    let mut robots = scenario.robots.iter();
    if robots.clone().any(|robot| method.kinds.contains(&robot.kind)) {
        return;
    }
    if let Some(robot) = robots.next() {
        let message = format!("`{}` can drive none of these robots, such as `{}`", method.name, robot.id);
        report.add_hint(origin, "", message, methods::for_kind(robot.kind));
    }
}

/// Reports a filter that is asked for and that not a single robot can have.
fn check_filter(scenario: &Scenario, origin: Origin, report: &mut Report) {
    if scenario.robots.iter().all(|robot| robot.filter == FilterKind::None) {
        let message = "none of these robots can have a filter";
        report.add_hint(origin, "", message, "it takes kinematic physics, and bodies that drive about");
    }
}

/// The options as they were given, for messages.
fn options(overrides: &Overrides) -> Vec<String> {
    let Overrides { mode, planner, filter, agent, robots, seed, duration_s, set } = overrides;
    let mut options: Vec<String> = set.iter().map(|assignment| format!("--set {assignment}")).collect();
    options.push(mode.map(|mode| format!("--mode {}", mode.word())).unwrap_or_default());
    options.push(planner.as_ref().map(|name| format!("--planner {name}")).unwrap_or_default());
    options.push(robots.map(|count| format!("--robots {count}")).unwrap_or_default());
    options.push(seed.map(|seed| format!("--seed {seed}")).unwrap_or_default());
    options.push(duration_s.map(|duration_s| format!("--duration {duration_s}s")).unwrap_or_default());
    options.push(filter.map(|filter| format!("--filter {}", filter.word())).unwrap_or_default());
    options.push(agent.as_ref().map(|agent| format!("--agent {agent}")).unwrap_or_default());
    options
}

/// Writes the overrides into the document, and returns the method that replaces all others.
fn apply<'a>(document: &mut RawTable, overrides: &'a Overrides, report: &mut Report) -> Option<&'a str> {
    let Overrides { mode, planner, filter: _, agent, robots, seed, duration_s, set } = overrides;
    for (index, assignment) in set.iter().enumerate() {
        document::set(document, assignment, Origin::Option(index), report);
    }
    let option = |index: usize| Origin::Option(set.len() + index);
    let has_layout = document.get(Root::layout.name()).is_some();
    if agent.is_some() {
        document.remove_all(Body::agent.name());
    }
    let mut put = |index: usize, section: OptionalKey<Table>, key: KeyName, value: Option<RawValue>| {
        if let Some(value) = value {
            document.put(&[section.name(), key.name()], Raw { origin: option(index), value });
        }
    };
    put(0, Root::clock, Clock::mode.any(), mode.map(|mode| RawValue::Text(mode.word().to_string())));
    put(3, Root::clock, Clock::seed.any(), seed.map(|seed| RawValue::Int(seed.into())));
    put(4, Root::clock, Clock::duration_s.any(), duration_s.map(RawValue::Float));
    put(6, Root::defaults, Body::agent.any(), agent.as_ref().map(|agent| command(agent, option(6))));
    if let Some(count) = robots {
        if has_layout {
            put(2, Root::layout, Layout::robots.any(), Some(RawValue::Int(*count as i128)));
        } else {
            report.add_hint(
                option(2),
                "",
                "this scenario has no [layout] that could have more or fewer robots",
                "its robots are listed one by one; for any number of robots take a scenario such as ring-15",
            );
        }
    }
    let name = planner.as_deref()?;
    methods::find(name, "", option(1), report).map(|method| method.name)
}

/// The agent of the command line as a file would name it.
fn command(agent: &AgentCommand, origin: Origin) -> RawValue {
    let word = |word: &String| Raw { origin, value: RawValue::Text(word.clone()) };
    match agent {
        AgentCommand::Path(path) => RawValue::Text(path.clone()),
        AgentCommand::Words(words) => RawValue::List(words.iter().map(word).collect()),
    }
}

/// The name of a file without folders and ending.
fn stem(file_name: &str) -> &str {
    let name = file_name.rsplit(['/', '\\']).next().unwrap_or(file_name);
    name.strip_suffix(".toml").unwrap_or(name)
}
