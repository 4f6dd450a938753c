//! `shoal pause`, `shoal resume` and `shoal step`: whether the ticks of a fleet in `lockstep` follow one another, and how
//! fast.

use super::fleet;
use crate::args::{Format, PauseArgs, ResumeArgs, StepArgs};
use crate::exit::{self, Failure};
use crate::out;
use bus::clean::FleetEntry;
use bus::{Address, clock};
use model::{PaceChange, PaceState, Rate};
use protocol::operator_to_daemon::{Reply, Request, Status};
use serde_json::json;

/// How often it is asked how far steps are that take long.
const LOOK_EVERY_NS: u64 = 50_000_000;

/// Lets no further tick open.
///
/// # Errors
/// When no fleet is running, its daemon does not answer, or its robots do not wait for ticks; when the open tick is not done
/// within a few seconds.
pub fn pause(options: &PauseArgs) -> Result<(), Failure> {
    let entry = fleet::choose_entry(&options.fleet)?;
    let state = ask(&entry.address, PaceChange::Pause)?;
    if state.until_tick.is_some() {
        let problem = format!("fleet `{}`: tick {} is still open", named(&entry), state.tick);
        return Err(Failure::environment(problem)
            .hint("the fleet pauses when it has been done; `shoal ps` shows which robots it waits for"));
    }
    tell(options.format, &entry, &state, &format!("is paused at {}", at(&state)))
}

/// Lets ticks follow one another again, or makes them faster or slower.
///
/// # Errors
/// When no fleet is running, its daemon does not answer, or its robots do not wait for ticks.
pub fn resume(options: &ResumeArgs) -> Result<(), Failure> {
    let entry = fleet::choose_entry(&options.fleet)?;
    let state = ask(&entry.address, PaceChange::Resume { rate: options.rate })?;
    let rate = match state.rate {
        Rate::Max => "as fast as its processes can".to_owned(),
        Rate::Factor(factor) => format!("at {factor} times real time"),
    };
    tell(options.format, &entry, &state, &format!("goes on from {}, {rate}", at(&state)))
}

/// Has some ticks done, and waits for them. The exit code.
///
/// # Errors
/// When no fleet is running, its daemon does not answer, or its robots do not wait for ticks; when the fleet ends before.
pub fn step(options: &StepArgs) -> Result<i32, Failure> {
    let entry = fleet::choose_entry(&options.fleet)?;
    let until_ns = clock::now_ns().saturating_add((options.timeout.min(1e9) * 1e9) as u64);
    let mut state = ask(&entry.address, PaceChange::Step { ticks: options.ticks })?;
    while let Some(until_tick) = state.until_tick {
        let Status { tick, time_s, paused, .. } = status(&entry.address)?;
        state = PaceState { tick, time_s, paused, ..state };
        // Another operator may have let the fleet go on.
        if tick >= until_tick || !paused {
            state.until_tick = None;
        } else if clock::now_ns() > until_ns {
            tell(options.format, &entry, &state, &format!("is at {}", at(&state)))?;
            out::talk(&format!("{} ticks are not done after {} s", until_tick - tick, options.timeout));
            return Ok(exit::TIME_OUT);
        } else {
            clock::sleep_until_ns(clock::now_ns() + LOOK_EVERY_NS);
        }
    }
    tell(options.format, &entry, &state, &format!("is at {}", at(&state)))?;
    Ok(exit::OK)
}

fn ask(address: &Address, change: PaceChange) -> Result<PaceState, Failure> {
    match fleet::ask(address, &Request::Pace(change))? {
        Reply::Pace(state) => Ok(state),
        reply => Err(fleet::confused(&reply)),
    }
}

fn status(address: &Address) -> Result<Status, Failure> {
    match fleet::ask(address, &Request::Status)? {
        Reply::Status(status) => Ok(status),
        reply => Err(fleet::confused(&reply)),
    }
}

fn named(entry: &FleetEntry) -> &str {
    entry.name.as_deref().unwrap_or(entry.address.id())
}

fn at(state: &PaceState) -> String {
    format!("tick {} ({:.2} s)", state.tick, state.time_s)
}

fn tell(format: Format, entry: &FleetEntry, state: &PaceState, words: &str) -> Result<(), Failure> {
    match format {
        Format::Json => out::measured(&json!({
            "schema": "shoal.pace/1", "fleet": entry.address.id(), "name": entry.name, "tick": state.tick,
            "time_s": state.time_s, "paused": state.paused, "until_tick": state.until_tick, "rate": state.rate.factor(),
        })),
        Format::Text => out::data(&format!("fleet {} {words}\n", named(entry))),
    }
}
