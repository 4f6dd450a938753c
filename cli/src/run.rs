//! `shoal run`: a scenario from its text to its report.

use crate::args::{Format, RunArgs};
use crate::begin;
use crate::beside::View;
use crate::exit::{self, Failure};
use crate::file::{Files, STANDARD};
use crate::out;
use crate::progress::{Progress, ProgressState};
use crate::record::RecordPlace;
use crate::{sink, source};
use bus::clock;
use daemon::coordinator::{self, News};
use daemon::signals::Interrupted;
use daemon::supervisor::{self, Finished, FleetView, Start, Watch};
use model::{Mode, Outcome, Rate, RobotIndex, Scenario};
use protocol::world_to_daemon::Notice;
use report::{ProcessFacts, RobotFacts, RunFacts, measured};
use scenarios::NamedIn;
use std::ffi::OsStr;
use std::ops::ControlFlow;
use std::path::Path;
use world_sim::World;
use world_sim::opener::{Opener, Opens};

/// In `single`, ticks between two looks at the clock for the live line.
const TICKS_PER_LOOK: u64 = 64;
/// In `single`, the longest sleep without a look whether the run was interrupted, ns.
const SLEEP_NS: u64 = 50_000_000;

/// Runs what the command line asks for, prints the report, and says how to exit.
///
/// # Errors
/// When the run cannot be started or reported.
pub fn run(options: &RunArgs) -> Result<i32, Failure> {
    let overrides = options.changes.overrides(options.mode.map(Mode::from), options.duration);
    let scenario = source::load_beside(&options.scenario, &overrides, options.beside.as_deref())?;
    if !scenario.warnings.is_empty() {
        out::talk(&source::warnings(&scenario.name, &scenario.warnings, out::stderr_colored()));
    }
    let mut start = begin::start(&options.start, scenario.clock.mode)?;
    let mut files = files_of(&options.scenario, &scenario);
    // A report that goes to standard output goes there alone.
    let (named, format) = match options.report.as_deref() {
        Some(path) if path == Path::new(STANDARD) => (None, Format::Json),
        named => (named, options.format),
    };
    let file = named.map(|path| sink::ReportFile::prepare(path, &mut files)).transpose()?;
    let record = options.record.as_deref().map(|path| RecordPlace::prepare(path, &mut files)).transpose()?;
    if options.changes.agent.is_some() && scenario.clock.mode == Mode::Single {
        return Err(Failure::usage("`--agent`: a run in `single` has no processes, and starts no agents")
            .hint("add `--mode lockstep`, which is reproducible as well"));
    }
    if options.view && scenario.clock.mode == Mode::Single {
        return Err(Failure::usage("`--view`: a run in `single` has no processes that could be watched")
            .hint("add `--mode lockstep`, which drives the same trajectories"));
    }
    let view = options.view.then_some(options.view_port);
    // Who watches wants to see something.
    if options.view && scenario.clock.mode == Mode::Lockstep && options.start.rate.is_none() {
        start.rate = Rate::Factor(1.0);
    }
    let (mut facts, failures) = match scenario.clock.mode {
        Mode::Single => in_one_thread(scenario, record.as_ref(), start.rate)?,
        Mode::Lockstep | Mode::Realtime => as_processes(scenario, record.as_ref(), start, view)?,
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
    if let Some(map) = &scenario.map {
        files.read("the map", &source::Folder::of(named).path_of(&map.file, NamedIn::Scenario));
    }
    for robot in &scenario.robots {
        let Some(agent) = &robot.agent else { continue };
        // The program and, as in `python3 my.py`, what it is to run.
        let scripts = agent.arguments().iter().map(Path::new).filter(|path| path.is_file());
        for path in scripts.chain([Path::new(agent.program())]) {
            files.read(format!("the agent of robot `{}`", robot.id), path);
        }
    }
    files
}

/// What is known of a run that has ended, and what went wrong around it.
type Ran = (RunFacts, Vec<Failure>);

/// `single`: no process, no shared memory.
fn in_one_thread(scenario: Scenario, record: Option<&RecordPlace>, rate: Rate) -> Result<Ran, Failure> {
    let interrupted = Interrupted::watch(exit::INTERRUPTED)?;
    let mut recorder = record.map(|place| place.begin(&scenario)).transpose()?;
    let mut progress = Progress::new(scenario.robots.len(), scenario.clock.ticks_max, scenario.clock.tick_hz);
    let mut opener = Opener::at(scenario.clock.dt_s(), rate);
    let started_ns = clock::now_ns();
    let wall_s = move || clock::now_ns().saturating_sub(started_ns) as f64 * 1e-9;
    let mut world = World::new(&scenario);
    if recorder.is_some() {
        world.keep_inputs();
    }
    let show = &mut |world: &mut World| {
        if let Some(recorder) = &mut recorder {
            recorder.frame(world);
        }
    };
    let outcome = single::run_shown(&scenario, world, show, &mut |world, notices| {
        for notice in notices {
            if let Notice::Log(event) = notice
                && event.kind.name().is_notable(event.tick)
            {
                progress.news(News::Event(event.kind.name()), &coordinator::describe(&scenario, event));
            }
        }
        let mut show = || {
            progress.update(&ProgressState {
                tick: world.tick(),
                robots: world.robot_count(),
                arrived: world.arrived_count(),
                contacts: world.contacts(),
                wall_s: wall_s(),
            });
        };
        if rate == Rate::Max && world.tick().is_multiple_of(TICKS_PER_LOOK) {
            show();
        }
        while rate != Rate::Max
            && !world.finished()
            && let Opens::At(due_ns) = opener.opens(world.tick(), clock::now_ns())
            && !interrupted.yes()
        {
            show();
            clock::sleep_until_ns(due_ns.min(clock::now_ns() + SLEEP_NS));
        }
        if interrupted.yes() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    progress.finish();
    let outcome: Outcome = outcome.map_err(|error| Failure::usage(error.to_string()))?;
    let ran_s = wall_s();
    let recorded = record.zip(recorder).map_or(Ok(()), |(place, recorder)| place.finish(recorder, &outcome));
    let mut facts = RunFacts::new(scenario, outcome, ran_s);
    facts.processes.push(this_process());
    facts.interrupted = interrupted.yes();
    facts.record = kept(record, &recorded);
    Ok((facts, recorded.err().into_iter().collect()))
}

/// `lockstep` and `realtime`: every robot a process.
fn as_processes(
    scenario: Scenario,
    record: Option<&RecordPlace>,
    start: Start<'_>,
    view: Option<u16>,
) -> Result<Ran, Failure> {
    let mut terminal = Terminal::new(&scenario);
    terminal.view_port = view;
    let start = Start { record: record.map(RecordPlace::path), ..start };
    let finished = supervisor::run(scenario, start, &mut terminal);
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

/// The live line of a fleet, and its view if one is wanted.
pub(crate) struct Terminal {
    progress: Progress,
    view_port: Option<u16>,
    view: Option<View>,
}

impl Terminal {
    pub(crate) fn new(scenario: &Scenario) -> Terminal {
        let (robots, time) = (scenario.robots.len(), scenario.clock);
        let progress = Progress::new(robots, time.ticks_max, time.tick_hz);
        Terminal { progress, view_port: None, view: None }
    }

    pub(crate) fn finish(&mut self) {
        self.progress.finish();
        if let Some(view) = self.view.take() {
            view.finish();
        }
    }
}

impl Watch for Terminal {
    fn started(&mut self, fleet: &FleetView<'_>) {
        let view = self.view_port.map(|port| View::start(fleet.address.id(), port)).transpose();
        match view {
            Ok(view) => self.view = view,
            Err(failure) => self.progress.event(failure.message()),
        }
    }

    fn progress(&mut self, state: &bus::Progress, wall_s: f64) {
        if let Some(address) = self.view.as_mut().and_then(View::address) {
            self.progress.event(&format!("view: {address}"));
        }
        self.progress.update(&ProgressState {
            tick: state.tick,
            robots: state.robots as usize,
            arrived: state.arrived as usize,
            contacts: state.contacts,
            wall_s,
        });
    }

    fn say(&mut self, line: &str) {
        self.progress.event(line);
    }

    fn news(&mut self, kind: News, line: &str) {
        self.progress.news(kind, line);
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
