//! What the kernel says about processes, and what they leave behind.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Where POSIX shared memory lives on Linux.
pub(crate) const SHM: &str = "/dev/shm";

/// Processor time that a process has taken, all its threads, ns; 0 once it has gone.
pub(crate) fn cpu_ns(pid: u32) -> u64 {
    let mut clock: libc::clockid_t = 0;
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: both calls only write to the variables that they are given.
    let failed = unsafe {
        libc::clock_getcpuclockid(pid as libc::pid_t, &raw mut clock) != 0
            || libc::clock_gettime(clock, &raw mut time) != 0
    };
    if failed { 0 } else { time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64 }
}

/// Memory of a process, shared pages divided among those who share them, KiB.
pub(crate) fn pss_kib(pid: u32) -> Option<u64> {
    let text = std::fs::read_to_string(format!("/proc/{pid}/smaps_rollup")).ok()?;
    text.lines().find_map(|line| line.strip_prefix("Pss:"))?.trim().strip_suffix(" kB")?.parse().ok()
}

/// Shared-memory objects that a process has mapped.
pub(crate) fn shared_objects(pid: u32) -> BTreeSet<PathBuf> {
    let maps = std::fs::read_to_string(format!("/proc/{pid}/maps")).unwrap_or_default();
    let paths = maps.lines().filter_map(|line| line.find(SHM).map(|at| PathBuf::from(&line[at..])));
    paths.filter(|path| path.exists()).collect()
}

/// The processes that a process has started, and those that they have.
pub(crate) fn descendants(pid: u32) -> Vec<u32> {
    let children = |pid: u32| -> Vec<u32> {
        let tasks = std::fs::read_dir(format!("/proc/{pid}/task")).into_iter().flatten().flatten();
        let lists = tasks.filter_map(|task| std::fs::read_to_string(task.path().join("children")).ok());
        lists
            .flat_map(|list| list.split_ascii_whitespace().filter_map(|pid| pid.parse().ok()).collect::<Vec<_>>())
            .collect()
    };
    let mut found = children(pid);
    let mut next = 0;
    while next < found.len() {
        found.extend(children(found[next]));
        next += 1;
    }
    found
}

/// Whether a process was started for the run in this directory: its command line names it.
pub(crate) fn belongs_to(pid: u32, directory: &Path) -> bool {
    let name = directory.as_os_str().as_encoded_bytes();
    std::fs::read(format!("/proc/{pid}/cmdline"))
        .is_ok_and(|line| line.windows(name.len()).any(|window| window == name))
}

/// A directory for a run, on tmpfs. Everything that begins with its name belongs to the run.
pub(crate) fn make_directory(run: u32) -> std::io::Result<PathBuf> {
    let user = rustix::process::geteuid().as_raw();
    // The last character ends it: no name of a run begins another one's.
    let path = Path::new(SHM).join(format!("peers-{user}-{}-{run}_", std::process::id()));
    std::fs::create_dir(&path)?;
    Ok(path)
}

/// Removes everything whose name begins with this, under `/dev/shm`.
pub(crate) fn remove_all(prefix: &str) {
    for entry in std::fs::read_dir(SHM).into_iter().flatten().flatten() {
        if entry.file_name().to_string_lossy().starts_with(prefix) {
            let path = entry.path();
            let _ = if path.is_dir() { std::fs::remove_dir_all(&path) } else { std::fs::remove_file(&path) };
        }
    }
}

/// Removes what drivers of this user left that were killed.
pub(crate) fn remove_abandoned() {
    let prefix = format!("peers-{}-", rustix::process::geteuid().as_raw());
    for entry in std::fs::read_dir(SHM).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let Some(pid) = name.strip_prefix(&prefix).and_then(|rest| rest.split('-').next()) else { continue };
        if pid.parse::<u32>().is_ok() && !Path::new("/proc").join(pid).exists() {
            remove_all(&format!("{prefix}{pid}-"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kernel_knows_this_process() {
        let pid = std::process::id();
        assert!(cpu_ns(pid) > 0);
        assert!(pss_kib(pid).unwrap() > 100);
        // One more than the largest that Linux gives out.
        assert_eq!(cpu_ns((1 << 22) + 1), 0);
    }

    #[test]
    fn a_child_is_a_descendant_and_belongs_to_what_its_command_line_names() {
        let mut child = std::process::Command::new("sleep").arg("60").spawn().unwrap();
        assert!(descendants(std::process::id()).contains(&child.id()));
        while !belongs_to(child.id(), Path::new("60")) {}
        assert!(!belongs_to(child.id(), Path::new("61")));
        child.kill().unwrap();
        child.wait().unwrap();
    }
}
