//! What a process of a fleet does first: it ties its life to the one that started it.

use rustix::process::{Pid, Signal, getppid, set_parent_process_death_signal};

/// Asks the kernel to kill this process when its parent dies, and then looks whether that happened already: `false`
/// means that the process was started by somebody who is gone, and should end.
pub fn die_with_parent(parent: u32) -> bool {
    // Where it is refused (it never is on Linux) the guardian still ends this process.
    let _ = set_parent_process_death_signal(Some(Signal::KILL));
    getppid().map(Pid::as_raw_pid).and_then(|pid| u32::try_from(pid).ok()) == Some(parent)
}
