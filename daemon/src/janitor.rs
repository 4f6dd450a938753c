//! The janitor: a short-lived process that clears away what dead members of a fleet hold in iceoryx2.
//!
//! It opens what killed processes were just making, and so may meet anything. Nothing waits for it: a restart does not,
//! and a janitor that takes too long is killed; the next one begins anew.

use crate::error::Error;
use bus::{Address, Node, clean};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::Duration;

/// A janitor that has not ended after this long is given up.
const LIMIT: Duration = Duration::from_secs(10);
/// From one janitor to the next, so that a robot that dies again and again does not keep the machine busy.
const PAUSE: Duration = Duration::from_millis(200);

/// The daemon's end: at most one janitor at a time.
pub struct Janitor {
    root: PathBuf,
    /// A process has died that nobody has cleared away yet.
    wanted: bool,
    child: Option<Child>,
    started_at: Duration,
}

impl Janitor {
    /// Of the fleet at `address`; nothing runs yet.
    pub fn new(address: &Address) -> Janitor {
        Janitor { root: address.root().to_path_buf(), wanted: false, child: None, started_at: Duration::ZERO }
    }

    /// A process of the fleet has died.
    pub fn want(&mut self) {
        self.wanted = true;
    }

    /// Starts one if it is wanted, and ends one that takes too long. To be called now and then; it never waits.
    pub fn tend(&mut self, now: Duration) {
        let since = now.saturating_sub(self.started_at);
        if let Some(child) = &mut self.child {
            match child.try_wait() {
                Ok(None) if since > LIMIT => _ = child.kill(),
                Ok(None) => {}
                // What it could not clear away, the next one can try.
                Ok(Some(_)) | Err(_) => self.child = None,
            }
        } else if self.wanted && (since > PAUSE || self.started_at == Duration::ZERO) {
            self.started_at = now;
            let mut command = crate::processes::shoal("janitor");
            command.arg("--root").arg(&self.root).arg("--parent").arg(std::process::id().to_string());
            command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
            // Where no process can be started now, one may be later.
            self.child = command.spawn().ok();
            self.wanted = self.child.is_none();
        }
    }
}

impl Drop for Janitor {
    fn drop(&mut self) {
        let Some(mut child) = self.child.take() else { return };
        let _ = child.kill();
        if let Some(pid) = crate::processes::pid_of(child.id()) {
            crate::processes::reap_until(pid, bus::clock::now_ns() + crate::processes::DYING.as_nanos() as u64);
        }
    }
}

/// The janitor's own process.
///
/// # Errors
/// When the fleet is gone.
pub fn main(root: &Path, parent: u32) -> Result<(), Error> {
    if !bus::process::die_with_parent(parent) {
        return Ok(());
    }
    let address = Address::at(root)?;
    clean::unfinished(&address);
    Node::new(&address, "janitor")?.clear_dead();
    Ok(())
}
