//! `shoal up`: a fleet that runs until it is stopped.

use super::fleet;
use crate::args::{Format, UpArgs};
use crate::begin;
use crate::exit::{self, Failure};
use crate::run::{Terminal, facts_of};
use crate::sink::ReportFile;
use crate::{file::Files, out, source};
use bus::Progress;
use bus::clean::FleetEntry;
use daemon::coordinator::News;
use daemon::detach::{self, Saying, Side};
use daemon::service::{Service, StateDir, check_name, default_state};
use daemon::supervisor::{self, FleetView, Orphan, Start, Watch};
use model::{Mode, Scenario, Stop};
use scenarios::Overrides;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The newest report, in the state directory.
const REPORT_FILE: &str = "report.json";
/// What a daemon in the background writes to standard error.
const ERRORS_FILE: &str = "stderr.log";

/// Starts the fleet; in the foreground until it ends, or until it runs. The exit code.
///
/// # Errors
/// When the scenario is not valid, a fleet of this name runs, or the environment does not allow it.
pub fn run(options: &UpArgs) -> Result<i32, Failure> {
    let fleet = match orphan(options)? {
        Some(fleet) => fleet,
        None => Fleet::new(options)?,
    };
    if !options.detach {
        return in_foreground(options, fleet);
    }
    match detach::detach()? {
        Side::Caller(hearing) => heard(options, &hearing.hear(), &fleet.state()?),
        Side::Daemon(saying) => Ok(in_background(fleet, orphan_limit(options), saying)),
    }
}

/// The fleet that this process is to look after.
enum Fleet {
    /// One to be started.
    New { scenario: Box<Scenario>, start: Start<'static>, name: String, state: PathBuf },
    /// One that runs, and whose daemon has ended.
    Orphan(FleetEntry),
}

impl Fleet {
    fn new(options: &UpArgs) -> Result<Fleet, Failure> {
        let Some(source) = &options.scenario else {
            let wanted = options.name.as_ref().map_or_else(String::new, |name| format!(" `{name}`"));
            return Err(Failure::environment(format!("no fleet{wanted} runs without a daemon"))
                .hint("`shoal ps` shows the fleets; with a SCENARIO, `shoal up --adopt` starts it if there is none"));
        };
        let mode = Mode::from(options.mode);
        let start = begin::start(&options.start, mode)?;
        let overrides = options.changes.overrides(Some(mode), None);
        let mut scenario = source::load(source, &overrides)?;
        if !scenario.warnings.is_empty() {
            out::talk(&source::warnings(&scenario.name, &scenario.warnings, out::stderr_colored()));
        }
        // It ends when it is told to.
        (scenario.clock.stop, scenario.clock.ticks_max) = (Stop::Duration, u64::MAX);
        let name = name_of(options, &scenario)?;
        let state = match &options.state {
            Some(path) => path.clone(),
            None => default_state(&name, &|variable| std::env::var_os(variable))?,
        };
        refuse_second(&name)?;
        Ok(Fleet::New { scenario: Box::new(scenario), start, name, state })
    }

    /// Its state directory.
    fn state(&self) -> Result<PathBuf, Failure> {
        match self {
            Fleet::New { state, .. } => Ok(state.clone()),
            Fleet::Orphan(entry) => fleet::state_of(&entry.address).ok_or_else(|| gone(entry)),
        }
    }

    /// Its name.
    fn name(&self) -> &str {
        match self {
            Fleet::New { name, .. } => name,
            Fleet::Orphan(entry) => entry.name.as_deref().unwrap_or(entry.address.id()),
        }
    }

    /// The scenario that it runs.
    fn scenario(&self) -> Result<Scenario, Failure> {
        match self {
            Fleet::New { scenario, .. } => Ok(Scenario::clone(scenario)),
            Fleet::Orphan(entry) => fleet::left(&entry.address, world_sim::shell::SCENARIO_FILE),
        }
    }

    /// Takes its state directory, and the daemon's place if it runs.
    fn take(self, orphan_limit: Option<Duration>) -> Result<Taken, daemon::Error> {
        Ok(match self {
            Fleet::New { scenario, start, name, state } => {
                let service = Service::open(&name, StateDir::take(&state)?)?;
                Taken::New(scenario, start, Box::new(Service { orphan_limit, ..service }))
            }
            Fleet::Orphan(entry) => Taken::Orphan(Orphan::take(entry.address)?, orphan_limit),
        })
    }
}

/// A fleet for which this process is the only one to look after it.
enum Taken {
    New(Box<Scenario>, Start<'static>, Box<Service>),
    Orphan(Orphan, Option<Duration>),
}

impl Taken {
    /// Looks after it until its end.
    fn serve(self, watch: &mut dyn Watch) -> Result<supervisor::Finished, daemon::Error> {
        match self {
            Taken::New(scenario, start, service) => supervisor::serve(*scenario, *service, start, watch),
            Taken::Orphan(orphan, orphan_limit) => orphan.serve(orphan_limit, watch),
        }
    }
}

/// The fleet to be taken over, if that is asked for and there is one.
fn orphan(options: &UpArgs) -> Result<Option<Fleet>, Failure> {
    if !options.adopt {
        return Ok(None);
    }
    let mut orphans: Vec<FleetEntry> = fleet::running()?.into_iter().filter(fleet::is_orphan).collect();
    let name = match (&options.name, &options.scenario) {
        (Some(name), _) => Some(name.clone()),
        (None, Some(source)) => Some(source::load(source, &Overrides::default())?.name),
        (None, None) => None,
    };
    if let Some(name) = &name {
        orphans.retain(|fleet| fleet.name.as_ref() == Some(name) || fleet.address.id() == name);
    }
    match orphans.len() {
        0 | 1 => Ok(orphans.pop().map(Fleet::Orphan)),
        many => {
            let names: Vec<&str> = orphans.iter().filter_map(|fleet| fleet.name.as_deref()).collect();
            Err(Failure::usage(format!("{many} fleets have no daemon"))
                .hint(format!("name one of them with `--name`: {}", names.join(", "))))
        }
    }
}

fn gone(entry: &FleetEntry) -> Failure {
    Failure::environment(format!("fleet `{}`: it has ended since it was listed", entry.address.id()))
}

fn name_of(options: &UpArgs, scenario: &Scenario) -> Result<String, Failure> {
    let name = options.name.clone().unwrap_or_else(|| scenario.name.clone());
    match check_name(&name) {
        Ok(()) => Ok(name),
        Err(problem) => {
            Err(Failure::usage(format!("name `{}` is not valid for a fleet: {problem}", name.escape_debug()))
                .hint("choose another one with `--name`: letters, digits, `-` and `_`"))
        }
    }
}

fn refuse_second(name: &str) -> Result<(), Failure> {
    match fleet::running()?.into_iter().find(|fleet| fleet.name.as_deref() == Some(name)) {
        None => Ok(()),
        Some(fleet) if fleet::is_orphan(&fleet) => {
            Err(Failure::usage(format!("fleet `{name}` runs without a daemon (id {})", fleet.address.id()))
                .hint(fleet::orphan_hint(name)))
        }
        Some(fleet) => Err(Failure::usage(format!("fleet `{name}` runs already (id {})", fleet.address.id()))
            .hint("end it with `shoal down`, or choose another `--name`")),
    }
}

fn in_foreground(options: &UpArgs, fleet: Fleet) -> Result<i32, Failure> {
    let (name, state, terminal) = (fleet.name().to_owned(), fleet.state()?, Terminal::new(&fleet.scenario()?));
    let taken = fleet.take(orphan_limit(options))?;
    // Absolute, and there.
    let state = std::fs::canonicalize(&state).unwrap_or(state);
    let mut watch = Foreground { terminal, format: options.format, name: &name, state: state.clone() };
    let finished = taken.serve(&mut watch);
    watch.terminal.finish();
    let (text, code) = ended(finished, &name, &state)?;
    out::talk(&text);
    Ok(code)
}

fn orphan_limit(options: &UpArgs) -> Option<Duration> {
    options.orphan_limit.map(|seconds| Duration::from_secs_f64(seconds.min(1e9)))
}

/// A daemon in the background. It says one word to its caller, and then writes to the log alone.
fn in_background(fleet: Fleet, orphan_limit: Option<Duration>, saying: Saying) -> i32 {
    let serve = move |saying: &mut Option<Saying>| -> Result<i32, Failure> {
        let (name, state) = (fleet.name().to_owned(), fleet.state()?);
        let taken = fleet.take(orphan_limit)?;
        let state = std::fs::canonicalize(&state).unwrap_or(state);
        detach::leave_terminal(&state.join(ERRORS_FILE))?;
        let mut watch = Background { saying, name: &name, state: state.clone(), alone: false };
        ended(taken.serve(&mut watch), &name, &state).map(|(_, code)| code)
    };
    let mut saying = Some(saying);
    serve(&mut saying).unwrap_or_else(|failure| {
        if let Some(saying) = saying.take() {
            saying.say(json!({ "code": failure.code, "failure": failure.to_string() }).to_string().as_bytes());
        }
        failure.code
    })
}

/// What the process in the background said.
fn heard(options: &UpArgs, words: &[u8], path: &Path) -> Result<i32, Failure> {
    let Ok(value) = serde_json::from_slice::<Value>(words) else {
        return Err(Failure::environment("daemon: it ended before its fleet ran, without a word").hint(format!(
            "see `{}` and `shoal logs --state {}`",
            path.join(ERRORS_FILE).display(),
            path.display()
        )));
    };
    if let Some(failure) = value["failure"].as_str() {
        let code = value["code"].as_i64().and_then(|code| i32::try_from(code).ok()).unwrap_or(exit::ENVIRONMENT);
        return Err(Failure::from_text(code, failure));
    }
    say_up(options.format, &value)?;
    Ok(exit::OK)
}

fn up_json(fleet: &FleetView<'_>, name: &str, state: &Path) -> Value {
    json!({
        "schema": "shoal.up/1", "fleet": fleet.address.id(), "name": name, "state": state.to_string_lossy(),
        "daemon_pid": std::process::id(), "world_pid": fleet.pids.first(), "processes": fleet.pids.len(),
    })
}

fn say_up(format: Format, up: &Value) -> Result<(), Failure> {
    let text = |key: &str| up[key].as_str().unwrap_or_default().to_owned();
    match format {
        Format::Json => out::json(up),
        Format::Text => out::data(&format!(
            "fleet {} ({}) runs: {} processes, daemon {}; state in {}\n",
            text("name"),
            text("fleet"),
            up["processes"],
            up["daemon_pid"],
            text("state")
        )),
    }
}

/// How it ended, and the exit code. The report goes into the state directory.
fn ended(
    finished: Result<supervisor::Finished, daemon::Error>,
    name: &str,
    state: &Path,
) -> Result<(String, i32), Failure> {
    let finished = finished?;
    let failures: Vec<Failure> = finished.failures.iter().cloned().map(Failure::from).collect();
    let report = report::assemble(facts_of(finished));
    ReportFile::prepare(&state.join(REPORT_FILE), &mut Files::new())?.write(&report)?;
    failures.iter().for_each(out::fail);
    let code = if failures.is_empty() { exit::OK } else { exit::ENVIRONMENT };
    Ok((format!("fleet {name} has ended; its report is {}", state.join(REPORT_FILE).display()), code))
}

struct Foreground<'a> {
    terminal: Terminal,
    format: Format,
    name: &'a str,
    state: PathBuf,
}

impl Watch for Foreground<'_> {
    fn started(&mut self, fleet: &FleetView<'_>) {
        // The reader of standard output may have gone: the fleet runs all the same.
        let _ = say_up(self.format, &up_json(fleet, self.name, &self.state));
    }

    fn progress(&mut self, progress: &Progress, wall_s: f64) {
        self.terminal.progress(progress, wall_s);
    }

    fn say(&mut self, line: &str) {
        self.terminal.say(line);
    }

    fn news(&mut self, kind: News, line: &str) {
        self.terminal.news(kind, line);
    }
}

struct Background<'a> {
    saying: &'a mut Option<Saying>,
    name: &'a str,
    state: PathBuf,
    /// The caller went before the fleet ran.
    alone: bool,
}

impl Watch for Background<'_> {
    fn started(&mut self, fleet: &FleetView<'_>) {
        let up = up_json(fleet, self.name, &self.state).to_string();
        self.alone = self.saying.take().is_some_and(|saying| !saying.say(up.as_bytes()));
    }

    /// A caller who was interrupted does not want the fleet.
    fn enough(&self) -> bool {
        self.alone
    }

    fn progress(&mut self, _: &Progress, _: f64) {}

    fn say(&mut self, _: &str) {}

    fn news(&mut self, _: News, _: &str) {}
}
