//! `shoal up`: a fleet that runs until it is stopped.

use super::fleet;
use crate::args::{Format, UpArgs};
use crate::exit::{self, Failure};
use crate::run::{Terminal, facts_of};
use crate::sink::ReportFile;
use crate::{file::Files, out, source};
use bus::Progress;
use daemon::coordinator::News;
use daemon::detach::{self, Saying, Side};
use daemon::service::{Service, StateDir, check_name, default_state};
use daemon::supervisor::{self, FleetView, Watch};
use model::{Mode, Scenario, Stop};
use scenarios::Overrides;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// The newest report, in the state directory.
const REPORT_FILE: &str = "report.json";
/// What a daemon in the background writes to standard error.
const ERRORS_FILE: &str = "stderr.log";

/// Starts the fleet; in the foreground until it ends, or until it runs. The exit code.
///
/// # Errors
/// When the scenario is not valid, a fleet of this name runs, or the environment does not allow it.
pub fn run(options: &UpArgs) -> Result<i32, Failure> {
    let overrides = Overrides {
        mode: Some(Mode::from(options.mode)),
        planner: options.planner.clone(),
        robots: options.robots,
        seed: options.seed,
        duration_s: None,
        set: options.set.clone(),
    };
    let mut scenario = source::load(&options.scenario, &overrides)?;
    if !scenario.warnings.is_empty() {
        out::talk(&source::warnings(&scenario.name, &scenario.warnings, out::stderr_colored()));
    }
    // It ends when it is told to.
    (scenario.clock.stop, scenario.clock.ticks_max) = (Stop::Duration, u64::MAX);
    let name = name_of(options, &scenario)?;
    let path = match &options.state {
        Some(path) => path.clone(),
        None => default_state(&name, &|variable| std::env::var_os(variable))?,
    };
    refuse_second(&name)?;
    if !options.detach {
        return in_foreground(options, scenario, &name, &path);
    }
    match detach::detach()? {
        Side::Caller(hearing) => heard(options, &hearing.hear(), &path),
        Side::Daemon(saying) => Ok(in_background(scenario, &name, &path, saying)),
    }
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
        Some(fleet) => Err(Failure::usage(format!("fleet `{name}` runs already (id {})", fleet.address.id()))
            .hint("end it with `shoal down`, or choose another `--name`")),
    }
}

fn in_foreground(options: &UpArgs, scenario: Scenario, name: &str, path: &Path) -> Result<i32, Failure> {
    let service = Service::open(name, StateDir::take(path)?)?;
    let state = service.state.path().to_owned();
    let mut watch =
        Foreground { terminal: Terminal::new(&scenario), format: options.format, name, state: state.clone() };
    let finished = supervisor::serve(scenario, service, &mut watch);
    watch.terminal.finish();
    let (text, code) = ended(finished, name, &state)?;
    out::talk(&text);
    Ok(code)
}

/// A daemon in the background. It says one word to its caller, and then writes to the log alone.
fn in_background(scenario: Scenario, name: &str, path: &Path, saying: Saying) -> i32 {
    let serve = |saying: &mut Option<Saying>| -> Result<i32, Failure> {
        let service = Service::open(name, StateDir::take(path)?)?;
        let state = service.state.path().to_owned();
        detach::leave_terminal(&state.join(ERRORS_FILE))?;
        let mut watch = Background { saying, name, state: state.clone(), alone: false };
        ended(supervisor::serve(scenario, service, &mut watch), name, &state).map(|(_, code)| code)
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
