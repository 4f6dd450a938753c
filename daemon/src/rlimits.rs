//! Limits of memory and open files that a scenario sets for the processes of its robots.
//!
//! They are set between fork and exec, as scheduling is: so they hold for every executable that a robot names, and for
//! whatever that starts.
//!
//! The limit on memory is RLIMIT_DATA, which counts private writable mappings: what a process allocates. RLIMIT_AS would count
//! the executable and every shared mapping too: an agent of a fleet of 15 robots has 20 MiB of address space, of which
//! 0.4 MiB are its data, and the rest grows with the boards that it opens. Nothing limits what is resident: Linux ignores
//! RLIMIT_RSS, and a control group for each agent needs one that is delegated to this user, which only some service managers do.

use crate::descriptors::hears_most;
use crate::error::{Error, Kind};
use bus::descriptors::{PER_BOARD, of_agent};
use model::{Mode, ProcessLimits, Scenario};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use std::os::unix::process::CommandExt;
use std::process::Command;

const MIB: u64 = 1 << 20;

/// What an agent of shoal allocates at least, and for each robot that it hears, bytes. Measured: 0.4 MiB with 14 others.
const AGENT: u64 = 512 << 10;
const PER_ROBOT: u64 = 4 << 10;

/// Gives the process that a command starts these limits, or those that it has where they are lower.
pub(crate) fn limit(command: &mut Command, limits: ProcessLimits) {
    let wishes = [
        (Resource::Data, limits.memory_mib.map(|mib| u64::from(mib) * MIB)),
        (Resource::Nofile, limits.files.map(u64::from)),
    ];
    for (resource, limit) in wishes {
        let Some(limit) = limit else { continue };
        let limit = getrlimit(resource).maximum.map_or(limit, |maximum| maximum.min(limit));
        let limit = Rlimit { current: Some(limit), maximum: Some(limit) };
        // SAFETY: the child of a process with threads may only do between fork and exec what is safe in a signal handler;
        // this is one system call.
        unsafe { command.pre_exec(move || Ok(setrlimit(resource, limit)?)) };
    }
}

/// Refuses limits with which the agents of a fleet certainly cannot start.
///
/// # Errors
/// Names the key, the need and the way out.
pub(crate) fn check(scenario: &Scenario) -> Result<(), Error> {
    let limits = scenario.processes.agent_limits;
    if limits == ProcessLimits::default() || scenario.clock.mode == Mode::Single {
        return Ok(());
    }
    let (id, heard) = hears_most(scenario).unwrap_or_default();
    fits(limits, &id, heard)
}

/// `heard` is the largest number of robots that one of them, `id`, hears at the start.
fn fits(limits: ProcessLimits, id: &str, heard: usize) -> Result<(), Error> {
    let who = if heard == 0 { "an agent".to_owned() } else { format!("robot `{id}`, which hears {heard} others,") };
    let files = of_agent(heard);
    if let Some(limit) = limits.files.filter(|limit| u64::from(*limit) < files) {
        let problem = format!("processes.agents.files_max: {limit} open files: {who} needs {files}");
        let hint = format!(
            "files_max = {files}; fewer robots or a smaller radio_range_m need {PER_BOARD} less per robot that is heard"
        );
        return Err(Error::new(Kind::Limits, problem).hint(hint));
    }
    let memory_mib = (AGENT + PER_ROBOT * heard as u64).div_ceil(MIB);
    if let Some(limit) = limits.memory_mib.filter(|limit| u64::from(*limit) < memory_mib) {
        let problem = format!("processes.agents.memory_mib_max: {limit} MiB: {who} needs {memory_mib} MiB");
        return Err(Error::new(Kind::Limits, problem).hint(format!("memory_mib_max = {memory_mib}, or leave it out")));
    }
    Ok(())
}

/// What a process prints that could not have more memory, in the words of Rust, C, C++, Python and shells.
const OUT_OF_MEMORY: [&str; 6] =
    ["memory allocation of", "os error 12", "Cannot allocate memory", "ut of memory", "bad_alloc", "MemoryError"];
/// What a process prints that could not open more files.
const OUT_OF_FILES: [&str; 2] = ["os error 24", "Too many open files"];

/// The last words of an agent that has ended; where they speak of a limit that the scenario has set, with its key.
pub(crate) fn explain(limits: ProcessLimits, words: String) -> String {
    let says = |signs: &[&str]| signs.iter().any(|sign| words.contains(sign));
    let limit = match limits {
        ProcessLimits { memory_mib: Some(mib), .. } if says(&OUT_OF_MEMORY) => {
            format!("processes.agents.memory_mib_max = {mib}")
        }
        ProcessLimits { files: Some(files), .. } if says(&OUT_OF_FILES) => {
            format!("processes.agents.files_max = {files}")
        }
        _ => return words,
    };
    format!("{words} (its limit is {limit})")
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: ProcessLimits = ProcessLimits { memory_mib: None, files: None };

    #[test]
    fn limits_that_are_too_small_to_start_are_refused_with_the_need() {
        let check = |memory_mib: Option<u32>, files: Option<u32>, heard: usize, expected: &str| match fits(
            ProcessLimits { memory_mib, files },
            "r03",
            heard,
        ) {
            Ok(()) => assert_eq!(expected, ""),
            Err(error) => {
                assert_eq!((error.kind, error.message.as_str()), (Kind::Limits, expected));
                assert_eq!(error.hints.len(), 1);
            }
        };
        check(None, None, 1000, "");
        check(Some(1), Some(25), 0, "");
        check(None, Some(24), 0, "processes.agents.files_max: 24 open files: an agent needs 25");
        check(
            None,
            Some(74),
            10,
            "processes.agents.files_max: 74 open files: robot `r03`, which hears 10 others, needs 75",
        );
        check(Some(1), None, 128, "");
        let needs = "robot `r03`, which hears 129 others, needs 2 MiB";
        check(Some(1), None, 129, &format!("processes.agents.memory_mib_max: 1 MiB: {needs}"));
    }

    #[test]
    fn words_about_a_limit_get_the_key_of_the_scenario() {
        let check = |limits: ProcessLimits, words: &str, more: &str| {
            assert_eq!(explain(limits, words.to_owned()), format!("{words}{more}"));
        };
        let limits = ProcessLimits { memory_mib: Some(64), files: Some(30) };
        check(
            limits,
            "memory allocation of 1048576 bytes failed",
            " (its limit is processes.agents.memory_mib_max = 64)",
        );
        check(limits, "MemoryError", " (its limit is processes.agents.memory_mib_max = 64)");
        check(limits, "no file: Too many open files (os error 24)", " (its limit is processes.agents.files_max = 30)");
        check(limits, "no licence", "");
        check(ProcessLimits { files: None, ..limits }, "Too many open files", "");
        check(NONE, "memory allocation of 7 bytes failed", "");
    }

    #[test]
    fn a_process_starts_with_its_limits() {
        #[expect(clippy::disallowed_methods, reason = "a process that says which limits it has")]
        let mut command = Command::new("sh");
        command.args(["-c", "ulimit -d; ulimit -H -n"]);
        limit(&mut command, ProcessLimits { memory_mib: Some(16), files: Some(77) });
        let output = command.output().expect("there is a shell");
        assert_eq!(String::from_utf8_lossy(&output.stdout), "16384\n77\n");
    }
}
