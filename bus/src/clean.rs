//! Hygiene: what a fleet leaves behind, and who takes it away.
#![expect(clippy::disallowed_methods, reason = "processes are found by reading /proc")]

use crate::address::SHM;
use crate::clock::{now_ns, sleep_until_ns};
use crate::{Address, BusError, Lease, Result};
use model::{RobotIndex, RobotInstance};
use rustix::io::Errno;
use rustix::process::{Pid, PidfdFlags, Signal, kill_process, pidfd_open, pidfd_send_signal};
use std::collections::BTreeSet;
use std::io::ErrorKind;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// The environment variable that marks the processes of a fleet, and all that those start: its value is the root.
pub const MARK: &str = "SHOAL_FLEET";
/// The file in the root of a fleet that is left running that holds its name.
pub const NAME_FILE: &str = "name";
/// The file in the root of a fleet that is left running that holds the path of its state directory.
pub const STATE_FILE: &str = "state";
/// Attempts to remove a root into which a process that is just ending still writes, at most.
const PASSES_MAX: u32 = 8;
/// How long killed processes may take to go.
const GRACE_NS: u64 = 3_000_000_000;

/// What was taken away.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SweepReport {
    /// Files that were in its root.
    pub files: u64,
    /// Shared memory that they took, bytes.
    pub bytes: u64,
    /// Processes that were killed.
    pub killed: u64,
    /// There was a root, and it is gone.
    pub root: bool,
    /// What could not be removed, and why.
    pub left: Vec<BusError>,
}

/// A fleet of this user on this machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FleetEntry {
    /// Where it lives.
    pub address: Address,
    /// Its name, if it was given one.
    pub name: Option<String>,
    /// Nobody looks after it.
    pub abandoned: bool,
    /// Processes of this user that were started for it.
    pub processes: Vec<u32>,
}

/// Removes the root of a fleet, which holds everything of it. Its processes must have ended; if one is just ending, what
/// it still makes is removed as well. A second sweep, or one at the same time, does no harm.
pub fn sweep(address: &Address) -> SweepReport {
    remove(address.root())
}

fn remove(root: &Path) -> SweepReport {
    let (files, bytes) = below(root);
    let mut report = SweepReport { files, bytes, ..SweepReport::default() };
    let mut result = std::fs::remove_dir_all(root);
    for _ in 0..PASSES_MAX {
        match &result {
            Err(e) if e.kind() == ErrorKind::DirectoryNotEmpty => result = std::fs::remove_dir_all(root),
            _ => break,
        }
    }
    match result {
        Ok(()) => report.root = true,
        Err(e) if e.kind() == ErrorKind::NotFound => {}
        Err(e) => report.left.push(BusError::io(root, "remove the fleet's directory", e)),
    }
    report
}

/// The user to whom a fleet with this id belongs, if it is not this one.
pub fn owner_of(id: &str) -> Option<u32> {
    let ours = rustix::process::geteuid().as_raw();
    let is_root = |name: &str| {
        let (uid, found) = name.strip_prefix("shoal-")?.split_once('-')?;
        Some(found == id && uid.parse() != Ok(ours))
    };
    let named = listed(Path::new(SHM)).ok()?.into_iter().filter(|(name, _)| is_root(name) == Some(true));
    let owners = named.filter_map(|(_, path)| std::fs::symlink_metadata(path).ok()).filter(|meta| meta.is_dir());
    owners.map(|meta| meta.uid()).find(|uid| *uid != ours)
}

/// Shared memory that a fleet takes up, bytes.
pub fn usage(address: &Address) -> u64 {
    below(address.root()).1
}

/// What is left of a fleet that has ended: its root, its processes; in words.
pub fn left_of(address: &Address) -> Vec<String> {
    let root = address.root().exists().then(|| address.root().display().to_string());
    root.into_iter().chain(processes_of(address).into_iter().map(|pid| format!("process {pid}"))).collect()
}

/// All fleets of this user on this machine, by id.
///
/// # Errors
/// When `/dev/shm` cannot be read.
pub fn list_fleets() -> Result<Vec<FleetEntry>> {
    let mut fleets = Vec::new();
    for (_, path) in listed(Path::new(SHM))? {
        let Some(address) = Address::parse(&path) else { continue };
        if Address::at(&path).is_err() {
            continue;
        }
        let abandoned = Lease::is_abandoned(&address).unwrap_or(false);
        let processes = processes_of(&address);
        let name = std::fs::read_to_string(address.file(NAME_FILE)).ok();
        fleets.push(FleetEntry { address, name, abandoned, processes });
    }
    fleets.sort_by(|a, b| a.address.id().cmp(b.address.id()));
    Ok(fleets)
}

/// Kills what still runs of every abandoned fleet, and sweeps it.
///
/// # Errors
/// When `/dev/shm` cannot be read, or a lease cannot be tested.
pub fn clean_abandoned() -> Result<Vec<(Address, SweepReport)>> {
    let mut cleaned = Vec::new();
    for (_, path) in listed(Path::new(SHM))? {
        if let Some(address) = Address::unborn(&path) {
            cleaned.push((address, remove(&path)));
        }
    }
    for fleet in list_fleets()? {
        if let Some(report) = clean_if_abandoned(&fleet.address)? {
            cleaned.push((fleet.address, report));
        }
    }
    Ok(cleaned)
}

/// Kills what still runs of this fleet and sweeps it, if nobody looks after it; `None` if somebody does, or it is gone.
///
/// # Errors
/// When the lease cannot be tested.
pub fn clean_if_abandoned(address: &Address) -> Result<Option<SweepReport>> {
    // Held until the end, so that two cleaners do not meet, and nobody adopts a fleet that is going.
    let Some(_lease) = Lease::seize(address)? else { return Ok(None) };
    let killed = end_processes(address);
    Ok(Some(SweepReport { killed, ..sweep(address) }))
}

/// Removes what a process left unfinished that was killed between making a file and giving it a size: iceoryx2 would
/// wait for it, if not for ever. A file that a living process has open is left to that process. How many there were.
pub fn unfinished(address: &Address) -> u64 {
    let empty = || -> Vec<(PathBuf, u64)> {
        let files = listed(address.root()).unwrap_or_default().into_iter();
        let files = files.filter_map(|(_, path)| Some((std::fs::symlink_metadata(&path).ok()?, path)));
        let files = files.filter(|(meta, _)| meta.is_file() && meta.len() == 0);
        files.map(|(meta, path)| (path, meta.ino())).collect()
    };
    let suspects = empty();
    if suspects.is_empty() {
        return 0;
    }
    // In this order: who makes a file has it open from its first moment until it has a size.
    let open = open_files(address.root());
    let still = empty();
    let dead = suspects.iter().filter(|file| !open.contains(&file.0) && still.contains(file));
    dead.filter(|(path, _)| std::fs::remove_file(path).is_ok()).count() as u64
}

/// The files below a directory that processes of this user have open.
fn open_files(below: &Path) -> BTreeSet<PathBuf> {
    let processes = listed(Path::new("/proc")).unwrap_or_default().into_iter();
    let processes = processes.filter(|(name, _)| name.bytes().all(|byte| byte.is_ascii_digit()));
    let descriptors = processes.flat_map(|(_, path)| listed(&path.join("fd")).unwrap_or_default());
    descriptors.filter_map(|(_, path)| std::fs::read_link(path).ok()).filter(|file| file.starts_with(below)).collect()
}

/// The processes of a fleet that take part in it: agents (an agent behind a wrapper, and the wrapper), each with its robot
/// instance, and the world, which has none.
pub fn members(address: &Address) -> Vec<(u32, Option<RobotInstance>)> {
    let root = address.root().as_os_str().as_encoded_bytes();
    let read = |pid: u32| std::fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
    let member = |pid: u32| Some((pid, member_of(&read(pid), root)?));
    processes_of(address).into_iter().filter_map(member).collect()
}

/// Which member of the fleet a command line is: that of its world has no instance.
fn member_of(command_line: &[u8], root: &[u8]) -> Option<Option<RobotInstance>> {
    let arguments: Vec<&[u8]> = command_line.split(|byte| *byte == 0).collect();
    if matches!(arguments[..], [b"shoal", b"world", b"--root", at, ..] if at == root) {
        return Some(None);
    }
    let number = |word: &[u8]| std::str::from_utf8(word).ok()?.parse::<u32>().ok();
    let [slot, incarnation] = agent_of(&arguments, root)?;
    Some(Some(RobotInstance { index: RobotIndex(number(slot)?), incarnation: number(incarnation)? }))
}

/// Kills all processes of this user that were started for this fleet, and waits until they have gone; how many. Not this
/// process, and none of those that started it. Processes that only name the root, such as an editor that shows a log of the
/// fleet, are left alone.
pub fn end_processes(address: &Address) -> u64 {
    let mut killed = BTreeSet::new();
    let until = now_ns() + GRACE_NS;
    loop {
        let processes = processes_of(address);
        for &pid in &processes {
            let Some(number) = i32::try_from(pid).ok().and_then(Pid::from_raw) else { continue };
            if kill(number, || belongs_to(pid, address)).is_ok() {
                killed.insert(pid);
            }
        }
        if processes.is_empty() || now_ns() > until {
            return killed.len() as u64;
        }
        sleep_until_ns(now_ns() + 5_000_000);
    }
}

/// Kills a process if it is the one that is meant.
fn kill(pid: Pid, is_meant: impl Fn() -> bool) -> rustix::io::Result<()> {
    // The descriptor names this very process: asking after it was opened makes sure that the number has not been given to
    // another process.
    match pidfd_open(pid, PidfdFlags::empty()) {
        Ok(fd) if is_meant() => pidfd_send_signal(&fd, Signal::KILL),
        Ok(_) | Err(Errno::SRCH) => Err(Errno::SRCH),
        // Descriptors of processes are refused here (an old kernel, a filter of system calls): the number has to do.
        Err(_) if is_meant() => kill_process(pid, Signal::KILL),
        Err(error) => Err(error),
    }
}

/// Processes of this user that were started for the fleet. Those that started this one are left out: an agent may call
/// `shoal clean`.
fn processes_of(address: &Address) -> Vec<u32> {
    let ours = ancestors();
    let pids = listed(Path::new("/proc")).unwrap_or_default().into_iter().filter_map(|(name, _)| name.parse().ok());
    let mut pids: Vec<u32> = pids.filter(|pid| !ours.contains(pid) && belongs_to(*pid, address)).collect();
    pids.sort_unstable();
    pids
}

fn belongs_to(pid: u32, address: &Address) -> bool {
    let uid = rustix::process::geteuid().as_raw();
    let root = address.root().as_os_str().as_encoded_bytes();
    let read = |name: &str| std::fs::read(format!("/proc/{pid}/{name}")).unwrap_or_default();
    std::fs::metadata(format!("/proc/{pid}")).is_ok_and(|meta| meta.uid() == uid)
        && (is_started_for(&read("cmdline"), root) || is_marked(&read("environ"), root))
}

/// Whether a command line is that of a process of the fleet, as its daemon starts them: shoal itself with an internal verb,
/// or the executable of a robot, perhaps behind a wrapper.
fn is_started_for(command_line: &[u8], root: &[u8]) -> bool {
    let arguments: Vec<&[u8]> = command_line.split(|byte| *byte == 0).collect();
    let own = matches!(arguments[..], [b"shoal", _, b"--root", at, ..] if at == root);
    own || agent_of(&arguments, root).is_some()
}

/// The slot and the incarnation in the arguments of an agent of this fleet.
fn agent_of<'a>(arguments: &[&'a [u8]], root: &[u8]) -> Option<[&'a [u8]; 2]> {
    arguments.windows(8).find_map(|window| match window {
        [b"--root", at, b"--slot", slot, b"--incarnation", incarnation, b"--parent", _] if *at == root => {
            Some([*slot, *incarnation])
        }
        _ => None,
    })
}

/// Whether an environment has the mark of the fleet: what agents start inherits it.
fn is_marked(environment: &[u8], root: &[u8]) -> bool {
    let value = |entry: &[u8]| entry.strip_prefix(MARK.as_bytes())?.strip_prefix(b"=").map(|value| value == root);
    environment.split(|byte| *byte == 0).any(|entry| value(entry) == Some(true))
}

fn ancestors() -> Vec<u32> {
    let mut pids = vec![std::process::id()];
    while let Some(parent) = pids.last().and_then(|&pid| parent_of(pid)).filter(|parent| !pids.contains(parent)) {
        pids.push(parent);
    }
    pids
}

fn parent_of(pid: u32) -> Option<u32> {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    status.lines().find_map(|line| line.strip_prefix("PPid:"))?.trim().parse().ok().filter(|&parent| parent > 0)
}

fn listed(directory: &Path) -> Result<Vec<(String, PathBuf)>> {
    let entries = std::fs::read_dir(directory).map_err(|e| BusError::io(directory, "read the directory", e))?;
    let named = |entry: std::fs::DirEntry| Some((entry.file_name().into_string().ok()?, entry.path()));
    Ok(entries.filter_map(|entry| named(entry.ok()?)).collect())
}

/// How many files there are from here on, and what they take, bytes.
fn below(path: &Path) -> (u64, u64) {
    let Ok(meta) = std::fs::symlink_metadata(path) else { return (0, 0) };
    let entries = if meta.is_dir() { listed(path).unwrap_or_default() } else { Vec::new() };
    let here = (u64::from(!meta.is_dir()), meta.blocks() * 512);
    entries.iter().map(|(_, path)| below(path)).fold(here, |sum, more| (sum.0 + more.0, sum.1 + more.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_processes_that_were_started_for_the_fleet_are_its_own() {
        const ROOT: &str = "/dev/shm/shoal-0-abcd234";
        let check = |arguments: &str, environment: &str, expected: bool| {
            let joined = |text: &str| text.replace(' ', "\0").replace("ROOT", ROOT).into_bytes();
            let (line, environment) = (joined(arguments), joined(environment));
            let belongs = is_started_for(&line, ROOT.as_bytes()) || is_marked(&environment, ROOT.as_bytes());
            assert_eq!(belongs, expected, "{arguments} {environment:?}");
        };
        check("shoal world --root ROOT --parent 7 ", "", true);
        check("shoal guardian --root ROOT ", "", true);
        check("shoal agent --root ROOT --slot 1 --incarnation 0 --parent 7 ", "", true);
        check("/bin/sh own --root ROOT --slot 1 --incarnation 0 --parent 7 ", "", true);
        check("timeout 9 own --root ROOT --slot 1 --incarnation 0 --parent 7 -v ", "", true);
        check("sleep 1000 ", "HOME=/ SHOAL_FLEET=ROOT PATH=/bin ", true);

        check("tail -f ROOT/world.log ", "HOME=/ ", false);
        check("vi --root ROOT ", "", false);
        check("watch shoal ps --fleet ROOT ", "", false);
        check("bash -c cd:ROOT;shoal:world:--root:ROOT ", "", false);
        check("shoal world --root ROOT2 --parent 7 ", "SHOAL_FLEET=ROOT2 XSHOAL_FLEET=ROOT SHOAL_FLEETS=ROOT ", false);
        check("", "", false);
        let member =
            |arguments: &str| member_of(arguments.replace(' ', "\0").replace("ROOT", ROOT).as_bytes(), ROOT.as_bytes());
        let instance = RobotInstance { index: RobotIndex(3), incarnation: 2 };
        assert_eq!(member("shoal world --root ROOT --incarnation 0 --parent 7 "), Some(None));
        for agent in ["shoal agent", "timeout 9 own", "/bin/sh own -x"] {
            let line = format!("{agent} --root ROOT --slot 3 --incarnation 2 --parent 7 ");
            assert_eq!(member(&line), Some(Some(instance)), "{line}");
        }
        for other in [
            "shoal guardian --root ROOT ",
            "shoal world --root ROOT2 ",
            "shoal agent --root ROOT --slot x --incarnation 2 --parent 7 ",
        ] {
            assert_eq!(member(other), None, "{other}");
        }
    }
}
