//! What the parts of a tick cost, one public function at a time: `cargo bench -p shoal-micro`, and
//! `cargo bench -p shoal-micro -- boards` for those whose name has that in it. How whole fleets do is what `shoal bench`
//! measures; docs/performance-notebook.md has figures of both.
//!
//! The benches run in a process of their own, which has fleets' addresses. This one outlives it, whatever ends it, and
//! removes what it left in shared memory.
#![expect(clippy::disallowed_methods, reason = "benches have processes and threads")]
#![expect(clippy::print_stderr, reason = "it is a program")]

mod agent;
mod boards;
mod gate;
mod home;
mod plan;
mod route;
mod world;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::process::{Command, ExitCode};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::Duration;

/// In the process of the benches: the one that watches it.
const WATCHER: &str = "SHOAL_MICRO_WATCHER";

fn main() -> ExitCode {
    if let Some(watcher) = std::env::var(WATCHER).ok().and_then(|pid| pid.parse().ok()) {
        if bus::process::die_with_parent(watcher) {
            divan::main();
        }
        return ExitCode::SUCCESS;
    }
    match watch() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: benches: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the benches in a child, and cleans up after it; whether all was well.
fn watch() -> Result<bool, Box<dyn std::error::Error>> {
    let told_to_end = Arc::new(AtomicBool::new(false));
    for signal in [SIGHUP, SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&told_to_end))?;
    }
    let words = std::env::args_os().skip(1);
    let mut child = Command::new("/proc/self/exe").args(words).env(WATCHER, std::process::id().to_string()).spawn()?;
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        if told_to_end.load(Relaxed) {
            child.kill()?;
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    // The kernel has taken back the leases of its fleets, so they are abandoned.
    let mut well = status.success();
    for (address, report) in bus::clean::clean_abandoned()? {
        for problem in &report.left {
            eprintln!("error: fleet `{}`: {problem}", address.id());
            well = false;
        }
    }
    Ok(well)
}
