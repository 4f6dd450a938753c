//! The guardian: a tiny process that cleans after a daemon that was killed.
//!
//! It holds the reading end of a pipe and does nothing else. When the daemon goes, for whatever reason, the pipe ends:
//! unless the daemon has killed it, it had no time to clean, and the guardian ends the run's processes
//! and removes its shared memory. It runs in a process group of its own, so that a Ctrl-C meant for the daemon does
//! not reach it. It finds the processes by their command lines and by a mark in their environment, not by the number of
//! a process group, which may be given to others as soon as the group is empty.

use crate::exit::Failure;
use bus::{Address, Lease, clean};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// The daemon's end.
pub struct Guardian {
    child: Child,
}

impl Guardian {
    /// Starts the guardian of a fleet.
    ///
    /// # Errors
    /// When no process can be started.
    pub fn start(address: &Address) -> Result<Guardian, Failure> {
        #[expect(clippy::disallowed_methods, reason = "the guardian is one of the processes of a fleet")]
        let mut command = Command::new("/proc/self/exe");
        command.arg0("shoal").arg("guardian").arg("--root").arg(address.root());
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null()).process_group(0);
        let child = command.spawn().map_err(|error| {
            Failure::environment(format!("guardian: cannot start: {error}"))
                .hint("is the limit on processes reached? see `shoal doctor`")
        })?;
        Ok(Guardian { child })
    }

    /// Its process.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// The fleet is gone in good order: there is nothing to guard. Killed, because nothing else ends a process that
    /// somebody has stopped.
    pub fn dismiss(mut self) {
        let _ = self.child.kill();
        if let Some(pid) = crate::supervisor::pid_of(self.child.id()) {
            crate::processes::reap_until(pid, bus::clock::now_ns() + crate::processes::DYING.as_nanos() as u64);
        }
    }
}

/// The guardian's own process: waits for the daemon's end, then cleans if need be.
///
/// # Errors
/// When shared memory cannot be removed.
pub fn main(root: &Path) -> Result<(), Failure> {
    let Ok(address) = Address::at(root) else { return Ok(()) };
    // While the guardian lives nobody else takes the fleet for abandoned.
    let lease = Lease::take(&address)?;
    // Nobody writes: this ends with the daemon.
    let _ = std::io::copy(&mut std::io::stdin(), &mut std::io::sink());
    clean::end_processes(&address);
    drop(lease);
    clean::sweep(&address);
    Ok(())
}
