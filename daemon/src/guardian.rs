//! The guardian: a tiny process that cleans after a daemon that was killed.
//!
//! It holds the reading end of a pipe, and keeps the logs of the fleet small, which a stopped daemon does not. When the
//! daemon goes, for whatever reason, the pipe ends:
//! unless the daemon has killed it, it had no time to clean, and the guardian ends the run's processes
//! and removes its shared memory. It runs in a process group of its own, so that a Ctrl-C meant for the daemon does
//! not reach it. It finds the processes by their command lines and by a mark in their environment, not by the number of
//! a process group, which may be given to others as soon as the group is empty.
//!
//! A fleet that is left running goes on without its daemon, and its guardian waits for another daemon, which brings a guardian
//! of its own. Only where the world has ended as well, and no daemon comes within `GRACE`, is the fleet ended; or where it has
//! been without a daemon for longer than it was told to be (`shoal up --orphan-limit`).

use crate::error::{Error, Kind};
use bus::{Address, Helm, Helmsman, Lease, clean, helm};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// How long a fleet that is left running may be without a daemon and a world.
const GRACE: Duration = Duration::from_secs(10);
/// How often it looks at the logs.
const LOGS_EVERY: Timespec = Timespec { tv_sec: 1, tv_nsec: 0 };
/// How often it looks for another daemon.
const LOOK: Duration = Duration::from_secs(1);

/// The daemon's end.
pub struct Guardian {
    child: Child,
}

impl Guardian {
    /// Starts the guardian of a fleet.
    ///
    /// # Errors
    /// When no process can be started.
    pub fn start(address: &Address) -> Result<Guardian, Error> {
        #[expect(clippy::disallowed_methods, reason = "the guardian is one of the processes of a fleet")]
        let mut command = Command::new("/proc/self/exe");
        command.arg0("shoal").arg("guardian").arg("--root").arg(address.root());
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null()).process_group(0);
        let child = command.spawn().map_err(|error| {
            Error::new(Kind::Process, format!("guardian: cannot start: {error}"))
                .hint("is the limit on processes reached? see `shoal doctor`")
        })?;
        Ok(Guardian { child })
    }

    /// Whether its process has ended: then the fleet needs another one.
    pub fn has_ended(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(Some(_)) | Err(_))
    }

    /// Its process.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// The fleet is gone in good order: there is nothing to guard. Killed, because nothing else ends a process that
    /// somebody has stopped.
    pub fn dismiss(mut self) {
        let _ = self.child.kill();
        if let Some(pid) = crate::processes::pid_of(self.child.id()) {
            crate::processes::reap_until(pid, bus::clock::now_ns() + crate::processes::DYING.as_nanos() as u64);
        }
    }
}

/// Waits for the daemon's end: nobody writes, so the pipe only ends. Meanwhile logs are kept small: the daemon does that
/// itself, unless it is stopped.
fn wait_for_end(address: &Address) {
    let (stdin, mut bytes) = (std::io::stdin(), [0; 64]);
    loop {
        match poll(&mut [PollFd::new(&stdin, PollFlags::IN)], Some(&LOGS_EVERY)) {
            Ok(0) => crate::logs::trim_all(address.root()),
            _ => match rustix::io::read(&stdin, &mut bytes) {
                Err(rustix::io::Errno::INTR) | Ok(1..) => {}
                Ok(0) | Err(_) => return,
            },
        }
    }
}

/// Waits for another daemon, or for the end of a fleet that is left running: `None`. The daemon's place, if the fleet has
/// neither a daemon nor a world for too long, or no daemon for longer than it may. Meanwhile logs are kept small.
///
/// The process `before` is the daemon that has gone: the kernel closes its end of the pipe a moment before it counts as dead.
fn wait_for_daemon(address: &Address, before: u32) -> Option<Helm> {
    let limit = helm::orphan_limit(address).unwrap_or(Duration::MAX);
    let (mut alone, begun) = (Duration::ZERO, crate::processes::now());
    while address.root().exists() {
        if Helmsman::of(address).is_some_and(|daemon| daemon.pid() != before && daemon.lives()) {
            return None;
        }
        alone = if helm::living_world(address).is_some() { Duration::ZERO } else { alone + LOOK };
        if (alone > GRACE || crate::processes::now().saturating_sub(begun) > limit)
            && let Ok(Some(helm)) = Helm::take(address)
        {
            return Some(helm);
        }
        crate::logs::trim_all(address.root());
        bus::clock::sleep_until_ns(bus::clock::now_ns() + LOOK.as_nanos() as u64);
    }
    None
}

/// The guardian's own process: waits for the daemon's end, then cleans if need be.
///
/// # Errors
/// When shared memory cannot be removed.
pub fn main(root: &Path) -> Result<(), Error> {
    bus::process::leave_ending_to_daemon();
    let daemon = std::os::unix::process::parent_id();
    let Ok(address) = Address::at(root) else { return Ok(()) };
    // While the guardian lives nobody else takes the fleet for abandoned.
    let lease = Lease::take(&address)?;
    wait_for_end(&address);
    // Held until the end: nobody takes over a fleet that is going.
    let _helm = match helm::is_left_running(&address) {
        true => match wait_for_daemon(&address, daemon) {
            None => return Ok(()),
            helm => helm,
        },
        false => None,
    };
    clean::end_processes(&address);
    drop(lease);
    clean::sweep(&address);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use bus::helm::ORPHAN_LIMIT_FILE;

    #[test]
    #[expect(clippy::disallowed_methods, reason = "the test writes what a daemon would")]
    fn a_daemon_that_is_just_dying_is_not_taken_for_another_one() {
        let address = Address::create().unwrap();
        std::fs::write(address.file(ORPHAN_LIMIT_FILE), "0").unwrap();
        // Its place is free, and its process still counts as living.
        Helm::take(&address).unwrap().unwrap().sign(&address, 1, "0").unwrap();
        assert!(Helmsman::of(&address).unwrap().lives());
        let this = std::process::id();
        assert!(wait_for_daemon(&address, this).is_some(), "the fleet is to be ended");
        assert!(wait_for_daemon(&address, this + 1).is_none(), "another daemon looks after it");
        clean::sweep(&address);
    }
}
