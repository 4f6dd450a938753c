//! The papers' fleets as real processes, in `lockstep`: what holds for robots that hear each other a tick late.

mod amr_apf;
mod decentralized_apf;

use crate::ending::Finished;
use crate::exit::Failure;
use crate::supervisor::{self, Watch};
use model::{ParamValues, Scenario};
use reproduce::row::{Rows, Series};
use scenarios::Overrides;
use std::fmt::Write;
use std::ops::ControlFlow;

/// What the fleets of a paper came to, besides its rows.
#[derive(Default)]
pub(super) struct Fleets {
    pub(super) series: Vec<Series>,
    /// Somebody broke it off.
    pub(super) broken: bool,
    /// The environment does not let a fleet run.
    pub(super) failure: Option<Failure>,
}

/// Why no more fleets are run.
enum Stop {
    Broken,
    Failed(Failure),
}

impl From<Failure> for Stop {
    fn from(failure: Failure) -> Stop {
        Stop::Failed(failure)
    }
}

/// Runs the fleets of a paper, each from so many starts, and adds their rows. No start, no fleet.
pub(super) fn run(paper: &str, runs: u32, rows: &mut Rows<'_>) -> Fleets {
    let mut fleets = Fleets::default();
    let ended = match (paper, runs) {
        (_, 0) => Ok(()),
        ("decentralized-apf", _) => decentralized_apf::run(rows),
        ("amr-apf", _) => amr_apf::run(runs, rows, &mut fleets.series),
        _ => Ok(()),
    };
    match ended {
        Ok(()) => {}
        Err(Stop::Broken) => fleets.broken = true,
        Err(Stop::Failed(failure)) => fleets.failure = Some(failure),
    }
    fleets
}

/// Says what comes next.
fn begin(rows: &mut Rows<'_>, what: &str) -> Result<(), Stop> {
    match rows.begin(what) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(Stop::Broken),
    }
}

/// Runs a fleet of real processes to its end.
fn lockstep(scenario: Scenario) -> Result<Finished, Stop> {
    struct Nobody;
    impl Watch for Nobody {
        fn progress(&mut self, _: &bus::Progress, _: f64) {}
        fn say(&mut self, _: &str) {}
        fn news(&mut self, _: &str, _: &str) {}
    }
    let finished =
        supervisor::run(scenario, None, &mut Nobody).and_then(Finished::undisturbed).map_err(
            |failure| match failure.code {
                crate::exit::INTERRUPTED => Stop::Broken,
                _ => Stop::Failed(failure),
            },
        )?;
    if finished.interrupted { Err(Stop::Broken) } else { Ok(finished) }
}

/// A fleet of robots of one kind, as text of a scenario.
struct Fleet {
    text: String,
}

impl Fleet {
    fn new(name: &str, tick_hz: f64, duration_s: f64, defaults: &str, planner: &str, params: &ParamValues) -> Fleet {
        let params: Vec<String> = params.iter().map(|(key, value)| format!("{key} = {value}")).collect();
        let text = format!(
            "name = \"{name}\"\n[clock]\nmode = \"lockstep\"\ntick_hz = {tick_hz:?}\nduration_s = {duration_s:?}\n\
             [expect]\ncontacts_max = 1000000\n[defaults]\nsensor_range_m = 50.0\nradio_range_m = 50.0\n{defaults}\
             planner = \"{planner}\"\nparams = {{ {} }}\n",
            params.join(", ")
        );
        Fleet { text }
    }

    fn robot(&mut self, index: usize, start: [f64; 2], goal: [f64; 2], more: &str) {
        let _ = writeln!(self.text, "[[robot]]\nid = \"r{index:02}\"\nstart_m = {start:?}\ngoal_m = {goal:?}\n{more}");
    }

    fn disc(&mut self, center: [f64; 2], radius: f64) {
        let _ = writeln!(self.text, "[[obstacle]]\nshape = \"disc\"\ncenter_m = {center:?}\nradius_m = {radius:?}");
    }

    /// The scenario. What the papers let start too close to each other cannot run here.
    fn scenario(&self) -> Result<Scenario, Failure> {
        scenarios::parse("fleet of a paper", &self.text, &Overrides::default())
            .map_err(|problems| crate::source::failure(&problems))
    }
}
