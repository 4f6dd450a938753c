//! `shoal run`: a scenario from its text to its report.

use crate::args::{Format, RunArgs};
use crate::exit::{self, Failure};
use crate::file::{Files, STANDARD};
use crate::out;
use crate::progress::{Progress, ProgressState};
use crate::record::RecordPlace;
use crate::{sink, source};
use bus::clock;
use daemon::coordinator::{self, News};
use daemon::signals::Interrupted;
use daemon::supervisor::{self, Finished, Watch};
use model::{Mode, Outcome, RobotIndex, Scenario};
use protocol::world_to_daemon::Notice;
use report::{ProcessFacts, RobotFacts, RunFacts, measured};
use std::ffi::OsStr;
use std::ops::ControlFlow;
use std::path::Path;
use world_sim::World;

/// In `single`, ticks between two looks at the clock for the live line.
const TICKS_PER_LOOK: u64 = 64;

/// Runs what the command line asks for, prints the report, and says how to exit.
///
/// # Errors
/// When the run cannot be started or reported.
pub fn run(options: &RunArgs) -> Result<i32, Failure> {
    let overrides = options.changes.overrides(options.mode.map(Mode::from), options.duration);
    let scenario = source::load(&options.scenario, &overrides)?;
    if !scenario.warnings.is_empty() {
        out::talk(&source::warnings(&scenario.name, &scenario.warnings, out::stderr_colored()));
    }
    let mut files = files_of(&options.scenario, &scenario);
    // A report that goes to standard output goes there alone.
    let (named, format) = match options.report.as_deref() {
        Some(path) if path == Path::new(STANDARD) => (None, Format::Json),
        named => (named, options.format),
    };
    let file = named.map(|path| sink::ReportFile::prepare(path, &mut files)).transpose()?;
    let record = options.record.as_deref().map(|path| RecordPlace::prepare(path, &mut files)).transpose()?;
    let (mut facts, failures) = match scenario.clock.mode {
        Mode::Single => in_one_thread(scenario, record.as_ref())?,
        Mode::Lockstep | Mode::Realtime => as_processes(scenario, record.as_ref())?,
    };
    facts.failures = failures.iter().map(|failure| failure.message().to_owned()).collect();
    let report = report::assemble(facts);
    // Printed first: what becomes of the files must not cost what is known. And whatever becomes of standard output, the
    // file is written.
    let printed = sink::print(&report, format);
    let written = file.map_or(Ok(()), |file| file.write(&report));
    failures.iter().for_each(out::fail);
    Failure::first_of([printed, written]).map(|()| report.exit_code)
}

/// What a run reads: no output may replace it.
fn files_of(named: &OsStr, scenario: &Scenario) -> Files {
    let mut files = Files::new();
    if let Some(path) = source::file_of(named) {
        files.read("the scenario", path);
    }
    for robot in &scenario.robots {
        if let Some(agent) = &robot.agent {
            files.read(format!("the agent of robot `{}`", robot.id), Path::new(agent));
        }
    }
    files
}

/// What is known of a run that has ended, and what went wrong around it.
type Ran = (RunFacts, Vec<Failure>);

/// `single`: no process, no shared memory.
fn in_one_thread(scenario: Scenario, record: Option<&RecordPlace>) -> Result<Ran, Failure> {
    let interrupted = Interrupted::watch(exit::INTERRUPTED)?;
    let mut recorder = record.map(|place| place.begin(&scenario)).transpose()?;
    let mut progress = Progress::new(scenario.robots.len(), scenario.clock.ticks_max, scenario.clock.tick_hz);
    let started_ns = clock::now_ns();
    let wall_s = move || clock::now_ns().saturating_sub(started_ns) as f64 * 1e-9;
    let show = &mut |world: &World| {
        if let Some(recorder) = &mut recorder {
            recorder.frame(world);
        }
    };
    let outcome = single::run_shown(&scenario, show, &mut |world, notices| {
        for notice in notices {
            if let Notice::Log(event) = notice
                && event.kind.name().is_notable(event.tick)
            {
                progress.news(News::Event(event.kind.name()), &coordinator::describe(&scenario, event));
            }
        }
        if world.tick().is_multiple_of(TICKS_PER_LOOK) {
            progress.update(&ProgressState {
                tick: world.tick(),
                robots: world.robot_count(),
                arrived: world.arrived_count(),
                contacts: world.contacts(),
                wall_s: wall_s(),
            });
        }
        if interrupted.yes() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    progress.finish();
    let outcome: Outcome = outcome.map_err(|error| Failure::usage(error.to_string()))?;
    let recorded = record.zip(recorder).map_or(Ok(()), |(place, recorder)| place.finish(recorder, &outcome));
    let mut facts = RunFacts::new(scenario, outcome, wall_s());
    facts.processes.push(this_process());
    facts.interrupted = interrupted.yes();
    facts.record = kept(record, &recorded);
    Ok((facts, recorded.err().into_iter().collect()))
}

/// `lockstep` and `realtime`: every robot a process.
fn as_processes(scenario: Scenario, record: Option<&RecordPlace>) -> Result<Ran, Failure> {
    let mut terminal = Terminal::new(&scenario);
    let finished = supervisor::run(scenario, record.map(RecordPlace::path), &mut terminal);
    terminal.finish();
    let finished = finished?;
    let failed = record.zip(finished.record_failed.as_ref()).map(|(place, cause)| place.failed(cause));
    let recorded = failed.map_or(Ok(()), Err);
    // A record that lacks frames is one all the same.
    let checked = record.filter(|_| recorded.is_ok()).map_or(Ok(()), RecordPlace::check);
    let mut failures: Vec<Failure> = finished.failures.iter().cloned().map(Failure::from).collect();
    let facts = RunFacts { record: kept(record, &recorded), ..facts_of(finished) };
    failures.extend([recorded, checked].into_iter().filter_map(Result::err));
    Ok((facts, failures))
}

/// Where the record is, if there is one.
fn kept(record: Option<&RecordPlace>, recorded: &Result<(), Failure>) -> Option<String> {
    record.filter(|_| recorded.is_ok()).map(|place| place.path().to_string_lossy().into_owned())
}

/// The live line of a fleet.
pub(crate) struct Terminal(Progress);

impl Terminal {
    pub(crate) fn new(scenario: &Scenario) -> Terminal {
        let (robots, time) = (scenario.robots.len(), scenario.clock);
        Terminal(Progress::new(robots, time.ticks_max, time.tick_hz))
    }

    pub(crate) fn finish(&mut self) {
        self.0.finish();
    }
}

impl Watch for Terminal {
    fn progress(&mut self, state: &bus::Progress, wall_s: f64) {
        self.0.update(&ProgressState {
            tick: state.tick,
            robots: state.robots as usize,
            arrived: state.arrived as usize,
            contacts: state.contacts,
            wall_s,
        });
    }

    fn say(&mut self, line: &str) {
        self.0.event(line);
    }

    fn news(&mut self, kind: News, line: &str) {
        self.0.news(kind, line);
    }
}

/// Everything but where the record is.
pub(crate) fn facts_of(finished: Finished) -> RunFacts {
    let realtime = finished.scenario.clock.mode == Mode::Realtime;
    let name = |robot: RobotIndex| finished.scenario.robots.get(robot.at()).map(|robot| robot.id.clone());
    let latency = measured::latency(&finished.stats, &name, realtime);
    let scenario = finished.scenario;
    let fleet = (finished.processes.into_iter()).map(|(instance, pid, measured)| ProcessFacts {
        name: match instance {
            Some(instance) => scenario.robots[instance.index.at()].id.clone(),
            None => ProcessFacts::WORLD.to_owned(),
        },
        instance,
        pid,
        cpu_s: measured.cpu_s,
        pss_kib: measured.pss_kib,
        run_queue_wait_s: Some(measured.run_queue_wait_s),
    });
    let processes = fleet.chain([this_process()]).collect();
    let stragglers = finished.outcome.events.iter().filter(|event| event.kind.name().is_straggling());
    let stragglers = stragglers.count() as u64;
    RunFacts {
        robots: scenario.robots.iter().map(RobotFacts::of).collect(),
        outcome: finished.outcome,
        wall_time_s: finished.wall_time_s,
        interrupted: finished.interrupted,
        latency: Some(latency),
        stragglers,
        processes,
        startup_ms: finished.startup_ms,
        shm_bytes: Some(finished.shm_bytes),
        record: None,
        failures: finished.failures.iter().map(|error| error.message.clone()).collect(),
        scenario,
    }
}

/// What the daemon itself used.
fn this_process() -> ProcessFacts {
    let pid = std::process::id();
    let used_s = clock::schedstat_of(pid).map_or(0.0, |stat| stat.ran_ns as f64 * 1e-9);
    ProcessFacts {
        name: "daemon".to_owned(),
        instance: None,
        pid,
        cpu_s: used_s,
        pss_kib: None,
        run_queue_wait_s: None,
    }
}
