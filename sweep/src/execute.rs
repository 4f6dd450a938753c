//! A run of a sweep in this thread.

use crate::plan::Run;
use crate::record::Record;
use crate::{Error, plan::Plan};
use model::Scenario;
use report::RunFacts;
use rustix::time::{ClockId, clock_gettime};
use std::ops::ControlFlow;

/// What executes the runs of a plan: `None` is a run that was broken off because `goes_on` said no.
pub type Execute<'a> = dyn Fn(&Run<'_>, Scenario, &dyn Fn() -> bool) -> Result<Option<Record>, Error> + Sync + 'a;

/// Runs the whole fleet in this thread: mode `single`.
///
/// # Errors
/// When a planner cannot be built.
pub fn single(run: &Run<'_>, scenario: Scenario, goes_on: &dyn Fn() -> bool) -> Result<Option<Record>, Error> {
    let before_s = cpu_s();
    let mut broken = false;
    let outcome = single::run(&scenario, &mut |_, _| {
        broken = !goes_on();
        if broken { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    let took_s = cpu_s() - before_s;
    let outcome = outcome.map_err(|error| failed(run, &error.to_string()))?;
    if broken {
        return Ok(None);
    }
    let report = report::assemble(RunFacts::new(scenario, outcome, took_s));
    Ok(Some(Record::new(run, &report, took_s)))
}

/// Why a run could not be done, and how to repeat it.
pub fn failed(run: &Run<'_>, cause: &str) -> Error {
    Error::environment(format!("run {}: {cause}", run.index)).hint(format!("to repeat it: {}", run.command().join(" ")))
}

/// Reads the scenario of a run, whose combination was checked before the sweep began.
///
/// # Errors
/// When it is wrong with this seed.
pub fn scenario(plan: &Plan, index: usize) -> Result<Scenario, Error> {
    let run = plan.run(index);
    run.scenario().map_err(|problems| {
        let mut error = Error::usage(String::new());
        let mut message = Vec::new();
        for line in problems.to_string().lines() {
            match line.strip_prefix("hint: ") {
                Some(hint) => error.hints.push(hint.to_owned()),
                None => message.push(line.strip_prefix("error: ").unwrap_or(line).to_owned()),
            }
        }
        error.message = message.join("; ");
        error.hint(format!("to repeat it: {}", run.command().join(" ")))
    })
}

/// Processor time of this thread, s.
fn cpu_s() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}
