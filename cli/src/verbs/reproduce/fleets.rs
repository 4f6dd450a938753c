//! The papers' fleets as real processes, in `lockstep`: what holds for robots that hear each other a tick late.

mod amr_apf;
mod decentralized_apf;

use crate::exit::Failure;
use crate::run::facts_of;
use daemon::coordinator::News;
use daemon::supervisor::{self, Finished, Start, Watch};
use model::{Outcome, Scenario};
use reproduce::row::{Rows, Series};
use std::ops::ControlFlow;

/// What the fleets of a paper came to, besides its rows.
#[derive(Default)]
pub(super) struct Fleets {
    pub(super) series: Vec<Series>,
    /// Interrupted.
    pub(super) broken: bool,
    /// The machine does not let a fleet run.
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

/// Runs the fleets of a paper, each from this number of starts, and adds their rows. No start, no fleet.
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

/// How often [`run`] says what comes next.
pub(super) fn steps(paper: &str, runs: u32) -> usize {
    match (paper, runs) {
        (_, 0) => 0,
        ("decentralized-apf", _) => decentralized_apf::scenes().count(),
        ("amr-apf", _) => amr_apf::fleets() * runs as usize,
        _ => 0,
    }
}

/// Says what comes next.
fn begin(rows: &mut Rows<'_>, what: &str) -> Result<(), Stop> {
    match rows.begin(what) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(Stop::Broken),
    }
}

/// What a fleet came to.
pub(super) struct Ran {
    pub(super) outcome: Outcome,
    /// Why the run is not evidence: the machine starved it, or something outside the scenario impaired it.
    pub(super) unusable: Option<String>,
}

/// Runs a fleet of real processes to its end.
fn lockstep(scenario: Scenario) -> Result<Ran, Stop> {
    struct Unwatched;
    impl Watch for Unwatched {
        fn progress(&mut self, _: &bus::Progress, _: f64) {}
        fn say(&mut self, _: &str) {}
        fn news(&mut self, _: News, _: &str) {}
    }
    let finished = supervisor::run(scenario, Start::default(), &mut Unwatched).and_then(Finished::undisturbed);
    let finished = finished.map_err(|error| match error.kind {
        daemon::Kind::Interrupted => Stop::Broken,
        _ => Stop::Failed(error.into()),
    })?;
    if finished.interrupted {
        return Err(Stop::Broken);
    }
    let outcome = finished.outcome.clone();
    let report = report::assemble(facts_of(finished));
    let unusable = unusable(report.verdict, &report.impaired_because, &report.starved_because);
    Ok(Ran { outcome, unusable })
}

/// Why a run with this verdict is not evidence.
fn unusable(verdict: report::Verdict, impaired: &[String], starved: &[String]) -> Option<String> {
    let reasons = || [impaired, starved].concat().join("; ");
    match verdict {
        report::Verdict::Valid => None,
        report::Verdict::Starved => Some(format!("the run was starved: {}", reasons())),
        report::Verdict::Impaired => Some(format!("the run was impaired: {}", reasons())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use report::Verdict;

    #[test]
    fn only_valid_runs_are_evidence() {
        let reason = ["a straggler was held or dropped 2 times".to_owned()];
        assert_eq!(unusable(Verdict::Valid, &[], &[]), None);
        let starved = unusable(Verdict::Starved, &[], &reason).expect("no evidence");
        assert!(starved.contains("starved") && starved.contains("2 times"), "{starved}");
        assert!(unusable(Verdict::Impaired, &reason, &[]).is_some_and(|text| text.contains("impaired")));
    }
}
