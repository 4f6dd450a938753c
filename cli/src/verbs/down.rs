//! `shoal down`: the end of a running fleet, in good order, or at once.

use super::fleet;
use crate::args::{DownArgs, Format};
use crate::exit::Failure;
use crate::out;
use bus::clean::{FleetEntry, clean_if_abandoned, end_processes};
use bus::{Address, clock, helm};
use protocol::operator_to_daemon::{Reply, Request};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open, pidfd_send_signal};
use serde_json::json;
use std::os::fd::OwnedFd;
use std::time::Duration;

/// How long a killed daemon's guardian may take to clear up.
const CLEARING: Duration = Duration::from_secs(10);
/// How long the daemon of a fleet that has ended may take for its report.
const REPORTING: Duration = Duration::from_secs(2);
const LOOK_EVERY_NS: u64 = 10_000_000;

/// Ends it.
///
/// # Errors
/// When no fleet is running, or what is left of it cannot be removed.
pub fn run(options: &DownArgs) -> Result<(), Failure> {
    let fleet = fleet::choose_entry(&options.fleet)?;
    let name = fleet.name.clone().unwrap_or_else(|| fleet.address.id().to_owned());
    let begun_ns = clock::now_ns();
    let daemon = daemon_of(&fleet.address);
    let asked = match options.force {
        true => false,
        false => ask(&fleet.address, &name),
    };
    let limit = Duration::from_secs_f64(options.limit.min(1e6));
    let forced = !(asked && is_gone_within(&fleet.address, limit));
    if forced {
        if asked {
            out::talk(&format!("fleet {name} has not ended within {} s: it is killed", options.limit));
        }
        force(&fleet, daemon.as_ref())?;
    }
    // The last thing that it does is to write its report.
    if let Some(daemon) = &daemon {
        await_end(daemon, REPORTING);
    }
    let took_s = clock::now_ns().saturating_sub(begun_ns) as f64 * 1e-9;
    match options.format {
        Format::Json => out::measured(&json!({
            "schema": "shoal.down/1", "fleet": fleet.address.id(), "name": fleet.name, "forced": forced, "took_s": took_s,
        })),
        Format::Text => {
            let how = if forced { "was killed" } else { "has ended" };
            out::data(&format!("fleet {name} {how} ({took_s:.2} s)\n"))
        }
    }
}

/// Whether the daemon has promised to end the fleet.
fn ask(address: &Address, name: &str) -> bool {
    match fleet::ask(address, &Request::Stop) {
        Ok(Reply::Stopping) => true,
        Ok(reply) => {
            out::fail(&fleet::confused(&reply));
            false
        }
        // It may have ended in this moment.
        Err(_) if !address.root().exists() => true,
        Err(failure) => {
            out::talk(&format!("fleet {name}: {}: it is killed", failure.message()));
            false
        }
    }
}

/// The daemon's process. The number is looked up again when it is held: it may have been given to another process.
fn daemon_of(address: &Address) -> Option<OwnedFd> {
    let (pid, _) = super::ps::processes(address);
    let held = pidfd_open(i32::try_from(pid).ok().and_then(Pid::from_raw)?, PidfdFlags::empty()).ok()?;
    (super::ps::processes(address).0 == pid).then_some(held)
}

/// Waits for the end of a process, for a bounded time.
fn await_end(process: &OwnedFd, limit: Duration) {
    let limit = Timespec { tv_sec: limit.as_secs() as i64, tv_nsec: limit.subsec_nanos().into() };
    // An interrupted wait is a short one.
    let _ = poll(&mut [PollFd::new(process, PollFlags::IN)], Some(&limit));
}

fn is_gone_within(address: &Address, limit: Duration) -> bool {
    let until_ns = clock::now_ns() + limit.as_nanos() as u64;
    while address.root().exists() {
        if clock::now_ns() > until_ns {
            return false;
        }
        clock::sleep_until_ns(clock::now_ns() + LOOK_EVERY_NS);
    }
    true
}

/// Kills the daemon: its guardian ends the fleet's processes and removes what it shares. A guardian that does not, because
/// its fleet may go on without a daemon or because it was stopped, is killed as well.
fn force(fleet: &FleetEntry, daemon: Option<&OwnedFd>) -> Result<(), Failure> {
    if let Some(daemon) = daemon {
        let _ = pidfd_send_signal(daemon, Signal::KILL);
    }
    if !helm::is_left_running(&fleet.address) && is_gone_within(&fleet.address, CLEARING) {
        return Ok(());
    }
    end_processes(&fleet.address);
    let until_ns = clock::now_ns() + CLEARING.as_nanos() as u64;
    while fleet.address.root().exists() {
        clean_if_abandoned(&fleet.address)?;
        if clock::now_ns() > until_ns {
            let left = bus::clean::left_of(&fleet.address).join(", ");
            return Err(Failure::environment(format!(
                "fleet `{}`: it was killed, and this is left: {left}",
                fleet.address.id()
            ))
            .hint("`shoal clean` removes it when its processes have ended"));
        }
        clock::sleep_until_ns(clock::now_ns() + LOOK_EVERY_NS);
    }
    Ok(())
}
