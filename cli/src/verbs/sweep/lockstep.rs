//! A run of a sweep in `lockstep`: a `shoal run` of its own, whose report is read.

use crate::source::file_of;
use daemon::processes::shoal;
use model::Scenario;
use report::{Report, Verdict};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{MemfdFlags, memfd_create};
use rustix::process::{Pid, PidfdFlags, Signal, kill_process, pidfd_open};
use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, Read, Seek, Write};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::Child;
use sweep::{Error, Record, Run, execute};

/// How often it is asked whether the sweep goes on.
const LOOK_EVERY: Timespec = Timespec { tv_sec: 0, tv_nsec: 50_000_000 };
/// Looks between the request to end and the kill: less than a second.
const GRACE_LOOKS: u32 = 14;
/// No report is larger.
const REPORT_BYTES_MAX: u64 = 1 << 30;
/// Number of lines of the standard error of a run that are repeated if the run fails.
const SAID_LINES: usize = 4;

/// Runs the fleet as processes.
///
/// # Errors
/// When it cannot be started, or its result is not that of the scenario.
pub(super) fn run(run: &Run<'_>, _: Scenario, goes_on: &dyn Fn() -> bool) -> Result<Option<Record>, Error> {
    let failed = |cause: &str| execute::failed(run, cause);
    let io_failed = |error: io::Error| failed(&format!("cannot start a fleet: {error}"));
    let (mut input, mut output, mut said) = (memory()?, memory()?, memory()?);
    // The text that was checked, whatever has become of its file.
    input.write_all(run.scenario.text.as_bytes()).and_then(|()| input.rewind()).map_err(io_failed)?;
    let mut command = shoal("run");
    command.arg("-").args(run.options()).args(["--format", "json"]);
    // A name without a directory is of a file in this one, where `shoal run` looks by itself.
    let folder = file_of(OsStr::new(&run.scenario.name)).and_then(Path::parent);
    if let Some(folder) = folder.filter(|folder| !folder.as_os_str().is_empty()) {
        command.arg("--beside").arg(folder);
    }
    // Of its own group: Ctrl-C is for the sweep, which asks its fleets to end.
    command.process_group(0).stdin(input);
    command.stdout(output.try_clone().map_err(io_failed)?).stderr(said.try_clone().map_err(io_failed)?);
    let child = command.spawn().map_err(io_failed)?;
    if !ends(child, goes_on).map_err(io_failed)? {
        return Ok(None);
    }
    let text = read(&mut output).map_err(io_failed)?;
    let Ok(report) = serde_json::from_str::<Report>(&text) else {
        let said = read(&mut said).unwrap_or_default();
        let said: Vec<&str> = said.lines().take(SAID_LINES).collect();
        return Err(failed(&format!("there is no report: {}", said.join("; "))));
    };
    let reasons = [&report.failures, &report.impaired_because, &report.starved_because];
    let reasons: Vec<&str> = reasons.into_iter().flatten().map(String::as_str).collect();
    match report.verdict {
        _ if report.interrupted => Ok(None),
        Verdict::Valid if reasons.is_empty() => {
            let cpu_s = report.resources.cpu_s.unwrap_or(0.0);
            Ok(Some(Record::new(run, &report, cpu_s)))
        }
        _ => Err(failed(&format!("it is not the result of the scenario: {}", reasons.join("; ")))
            .hint("fewer fleets at a time: `--jobs 1`; `shoal doctor` checks this machine")),
    }
}

/// Waits for the end of a child; false if the sweep did not go on, and the child was ended.
fn ends(mut child: Child, goes_on: &dyn Fn() -> bool) -> io::Result<bool> {
    let pid = Pid::from_child(&child);
    let pidfd = pidfd_open(pid, PidfdFlags::empty())?;
    let mut looks_left = None;
    while poll(&mut [PollFd::new(&pidfd, PollFlags::IN)], Some(&LOOK_EVERY)) != Ok(1) {
        match &mut looks_left {
            None if goes_on() => {}
            None => {
                // The child is there until it is waited for.
                let _ = kill_process(pid, Signal::TERM);
                looks_left = Some(GRACE_LOOKS);
            }
            Some(0) => {
                let _ = child.kill();
                looks_left = Some(u32::MAX);
            }
            Some(left) => *left -= 1,
        }
    }
    child.wait()?;
    Ok(looks_left.is_none())
}

/// A file without a name: what is written to it waits for no reader.
fn memory() -> Result<File, Error> {
    let file = memfd_create("shoal-sweep", MemfdFlags::CLOEXEC);
    file.map(File::from).map_err(|error| Error::environment(format!("a fleet cannot be started: {error}")))
}

fn read(file: &mut File) -> io::Result<String> {
    file.rewind()?;
    let mut text = String::new();
    file.take(REPORT_BYTES_MAX).read_to_string(&mut text)?;
    Ok(text)
}
