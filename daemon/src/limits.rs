//! What containers, units and users may have of the machine: limits of control groups and of the user, and whether a
//! fleet can fit into them at all. Of a group and those above it the tightest limit counts.
#![expect(clippy::disallowed_methods, reason = "the daemon looks at the machine")]

use crate::error::{Error, Kind};
use model::{Fault, Mode, Scenario, TimelineAction};
use report::text::bytes_text;
use rustix::process::{Resource, getrlimit};
use std::fs;
use std::path::{Path, PathBuf};

/// Memory that a fleet takes at least, bytes, as a control group counts it: daemon, world and guardian, and every agent
/// with its part of the shared memory. Fleets of 2, 17 and 64 robots were measured to take 5.3, 16.8 and 54 MiB.
pub fn memory_needed(robots: u64) -> u64 {
    (3 << 20) + robots * (768 << 10)
}

/// What the control groups of this process leave. `None` means unlimited.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Groups {
    /// Processes and threads that may still be started.
    pub processes: Option<u64>,
    /// Memory that may still be used, bytes; what the kernel can take back at any time counts as free.
    pub memory: Option<u64>,
    /// Processors' worth of time.
    pub processors: Option<f64>,
}

impl Groups {
    /// Those of this process.
    pub fn of_this_process() -> Groups {
        Groups::seen_from(Path::new("/"))
    }

    /// The same, where `root` is the root of the file system.
    fn seen_from(root: &Path) -> Groups {
        let text = |path: &str| fs::read_to_string(root.join(path)).unwrap_or_default();
        let mounts: Vec<Mount> = text("proc/self/mountinfo").lines().filter_map(Mount::parse).collect();
        let mut groups = Groups::default();
        for line in text("proc/self/cgroup").lines() {
            let mut parts = line.splitn(3, ':');
            let (Some(_), Some(controllers), Some(group)) = (parts.next(), parts.next(), parts.next()) else {
                continue;
            };
            let controllers: Vec<&str> = controllers.split(',').collect();
            let Some(mount) = mounts.iter().find(|mount| mount.has(&controllers)) else { continue };
            for folder in mount.folders(group) {
                let file = |name: &str| fs::read_to_string(root.join(&folder).join(name)).ok();
                groups.add(&file);
            }
        }
        groups
    }

    /// Takes in the limits of one group. The files of both versions have different names.
    fn add(&mut self, file: &dyn Fn(&str) -> Option<String>) {
        let number = |name: &str| file(name)?.trim().parse::<u64>().ok();
        let least = |known: Option<u64>, here: Option<u64>| known.into_iter().chain(here).min();
        let stat = |key: &str| {
            let text = file("memory.stat")?;
            text.lines().find_map(|line| line.strip_prefix(key)?.trim().parse::<u64>().ok())
        };
        let left = |max: Option<u64>, used: Option<u64>| Some(max?.saturating_sub(used.unwrap_or(0)));
        self.processes = least(self.processes, left(number("pids.max"), number("pids.current")));
        let cache = stat("inactive_file ").unwrap_or(0);
        let second = left(number("memory.max"), number("memory.current").map(|used| used.saturating_sub(cache)));
        let cache = stat("total_inactive_file ").unwrap_or(0);
        // Version 1 writes no limit as one that no machine reaches.
        let max = number("memory.limit_in_bytes").filter(|max| *max < 1 << 60);
        let first = left(max, number("memory.usage_in_bytes").map(|used| used.saturating_sub(cache)));
        self.memory = least(least(self.memory, second), first);
        let quota = file("cpu.max").and_then(|text| {
            let (quota, period) = text.trim().split_once(' ')?;
            Some(quota.parse::<f64>().ok()? / period.parse::<f64>().ok()?)
        });
        let quota = quota.or_else(|| Some(number("cpu.cfs_quota_us")? as f64 / number("cpu.cfs_period_us")? as f64));
        let quota = quota.filter(|quota| quota.is_finite() && *quota > 0.0);
        self.processors = self.processors.into_iter().chain(quota).reduce(f64::min);
    }
}

/// A hierarchy of control groups, where it can be seen.
struct Mount {
    /// The group that is seen at the mount point.
    group: PathBuf,
    /// The mount point, without its first slash.
    point: PathBuf,
    /// Controllers of version 1; empty for version 2.
    options: Vec<String>,
    unified: bool,
}

impl Mount {
    /// From a line of `/proc/self/mountinfo`.
    fn parse(line: &str) -> Option<Mount> {
        let (place, kind) = line.split_once(" - ")?;
        let mut place = place.split(' ').skip(3);
        let (group, point) = (place.next()?, place.next()?);
        let mut kind = kind.split(' ');
        let unified = match kind.next()? {
            "cgroup2" => true,
            "cgroup" => false,
            _ => return None,
        };
        let options = if unified { "" } else { kind.nth(1)? };
        Some(Mount {
            group: group.into(),
            point: point.trim_start_matches('/').into(),
            options: options.split(',').filter(|option| !option.is_empty()).map(str::to_owned).collect(),
            unified,
        })
    }

    /// Whether it is the hierarchy of these controllers; that of version 2 is called by none.
    fn has(&self, controllers: &[&str]) -> bool {
        match controllers {
            [""] => self.unified,
            names => !self.unified && names.iter().all(|name| self.options.iter().any(|option| option == name)),
        }
    }

    /// The directories of a group and of those above it, as far as they can be seen.
    fn folders(&self, group: &str) -> Vec<PathBuf> {
        // What is outside of what is mounted is seen as the mount point.
        let below = Path::new(group).strip_prefix(&self.group).unwrap_or(Path::new(""));
        below.ancestors().map(|folder| self.point.join(folder)).collect()
    }
}

/// Processes and threads that may still be started: by the limit of the user, the control groups and the kernel.
pub fn processes_left(groups: &Groups) -> Option<u64> {
    let root = rustix::process::geteuid().is_root();
    let limit = getrlimit(Resource::Nproc).maximum.filter(|_| !root);
    let by_user = limit.map(|limit| limit.saturating_sub(threads_of_user()));
    let threads: Option<u64> = fs::read_to_string("/proc/loadavg").ok().and_then(|text| {
        // "0.00 0.01 0.05 1/123 4711": running and existing threads.
        text.split_whitespace().nth(3)?.split_once('/')?.1.parse().ok()
    });
    let max = fs::read_to_string("/proc/sys/kernel/threads-max").ok().and_then(|max| max.trim().parse::<u64>().ok());
    let by_kernel = max.map(|max| max.saturating_sub(threads.unwrap_or(0)));
    [by_user, by_kernel, groups.processes].into_iter().flatten().min()
}

fn threads_of_user() -> u64 {
    use std::os::unix::fs::MetadataExt;
    let uid = rustix::process::geteuid().as_raw();
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    processes
        .filter(|entry| entry.file_name().to_string_lossy().bytes().all(|byte| byte.is_ascii_digit()))
        .filter(|entry| entry.metadata().is_ok_and(|meta| meta.uid() == uid))
        .map(|entry| fs::read_dir(entry.path().join("task")).map_or(1, Iterator::count) as u64)
        .sum()
}

/// Memory that is available, bytes: that of the machine, or what the control groups leave of it.
pub fn memory_left(groups: &Groups) -> Option<u64> {
    [meminfo("MemAvailable:"), groups.memory].into_iter().flatten().min()
}

fn meminfo(key: &str) -> Option<u64> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

/// Refuses a fleet that certainly does not fit into what its processes may have.
///
/// # Errors
/// When it does not fit.
pub fn check(scenario: &Scenario) -> Result<(), Error> {
    let groups = Groups::of_this_process();
    let swap = meminfo("SwapFree:").unwrap_or(0);
    fits(scenario, processes_left(&groups), memory_left(&groups).map(|memory| memory + swap))
}

fn fits(scenario: &Scenario, processes: Option<u64>, memory: Option<u64>) -> Result<(), Error> {
    if scenario.clock.mode == Mode::Single {
        return Ok(());
    }
    let robots = together(scenario);
    let fewer = "or run fewer robots";
    // Beside the agents: the world and the guardian.
    let needed = robots + 2;
    if let Some(left) = processes.filter(|left| *left < needed) {
        return Err(Error::new(
            Kind::Limits,
            format!("processes: the limits leave {left}, and {robots} robots need {needed} at once"),
        )
        .hint(format!(
            "raise the limit (`ulimit -u`, `--pids-limit` of a container, `TasksMax=` of a unit), {fewer}"
        )));
    }
    let needed = memory_needed(robots);
    if let Some(left) = memory.filter(|left| *left < needed) {
        return Err(Error::new(
            Kind::Limits,
            format!(
                "memory: the limits leave {}, and {robots} robots need {} at least",
                bytes_text(left),
                bytes_text(needed)
            ),
        )
        .hint(format!("raise the limit (`--memory` of a container, `MemoryMax=` of a unit), {fewer}")));
    }
    Ok(())
}

/// So many robots are there at one moment: all from the beginning, or all that never leave.
fn together(scenario: &Scenario) -> u64 {
    let count = |pick: fn(&TimelineAction) -> bool| scenario.events.iter().filter(|event| pick(&event.what)).count();
    let late = count(|what| matches!(what, TimelineAction::Join { .. }));
    let gone =
        count(|what| matches!(what, TimelineAction::Leave { .. } | TimelineAction::Fault { fault: Fault::Kill, .. }));
    scenario.robots.len().saturating_sub(late.min(gone)) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Files of a made-up machine: (path, content).
    fn seen(files: &[(&str, &str)]) -> Groups {
        let root = tempfile::tempdir().unwrap();
        for (path, content) in files {
            let path = root.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, content).unwrap();
        }
        Groups::seen_from(root.path())
    }

    const UNIFIED: (&str, &str) =
        ("proc/self/mountinfo", "30 20 0:26 / /sys/fs/cgroup rw,nosuid - cgroup2 cgroup2 rw,nsdelegate\n");

    #[test]
    fn the_tightest_limit_of_a_group_and_those_above_counts() {
        assert_eq!(seen(&[]), Groups::default());
        let groups = seen(&[
            UNIFIED,
            ("proc/self/cgroup", "0::/user.slice/run-1.scope\n"),
            ("sys/fs/cgroup/pids.max", "max\n"),
            ("sys/fs/cgroup/user.slice/pids.max", "100\n"),
            ("sys/fs/cgroup/user.slice/pids.current", "60\n"),
            ("sys/fs/cgroup/user.slice/memory.max", "1000000\n"),
            ("sys/fs/cgroup/user.slice/memory.current", "900000\n"),
            ("sys/fs/cgroup/user.slice/memory.stat", "anon 100000\ninactive_file 700000\nactive_file 1\n"),
            ("sys/fs/cgroup/user.slice/cpu.max", "max 100000\n"),
            ("sys/fs/cgroup/user.slice/run-1.scope/pids.max", "50\n"),
            ("sys/fs/cgroup/user.slice/run-1.scope/pids.current", "1\n"),
            ("sys/fs/cgroup/user.slice/run-1.scope/memory.max", "max\n"),
            ("sys/fs/cgroup/user.slice/run-1.scope/cpu.max", "150000 100000\n"),
        ]);
        assert_eq!(groups, Groups { processes: Some(40), memory: Some(800_000), processors: Some(1.5) });
    }

    #[test]
    fn a_container_sees_its_group_as_the_root() {
        let limits = [
            ("sys/fs/cgroup/pids.max", "20"),
            ("sys/fs/cgroup/pids.current", "30"),
            ("sys/fs/cgroup/memory.max", "5000"),
        ];
        let expected = Groups { processes: Some(0), memory: Some(5000), processors: None };
        // With a namespace of control groups, without one, and in one that was entered from outside.
        for (group, seen_root) in [("/", "/"), ("/docker/1234", "/docker/1234"), ("/../other", "/docker/1234")] {
            let mounts = UNIFIED.1.replacen(" / ", &format!(" {seen_root} "), 1);
            let own = format!("0::{group}\n");
            let mut files = vec![("proc/self/mountinfo", mounts.as_str()), ("proc/self/cgroup", own.as_str())];
            files.extend(limits);
            assert_eq!(seen(&files), expected, "{group}");
        }
    }

    #[test]
    fn groups_of_version_1_are_one_hierarchy_per_controller() {
        let groups = seen(&[
            (
                "proc/self/mountinfo",
                "23 1 0:20 / / rw - overlay overlay rw\n\
                 32 31 0:29 / /sys/fs/cgroup/cpu,cpuacct rw,relatime shared:9 - cgroup cgroup rw,cpu,cpuacct\n\
                 35 31 0:32 / /sys/fs/cgroup/memory rw - cgroup cgroup rw,memory\n\
                 39 31 0:36 / /sys/fs/cgroup/pids rw - cgroup cgroup rw,pids\n\
                 41 31 0:38 / /sys/fs/cgroup/unified rw - cgroup2 cgroup2 rw\n",
            ),
            ("proc/self/cgroup", "9:name=systemd:/a\n8:pids:/a\n4:memory:/a/b\n1:cpu,cpuacct:/a\n0::/a\n"),
            ("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n"),
            ("sys/fs/cgroup/memory/a/memory.limit_in_bytes", "5000000\n"),
            ("sys/fs/cgroup/memory/a/memory.usage_in_bytes", "1000000\n"),
            ("sys/fs/cgroup/memory/a/b/memory.limit_in_bytes", "9000000\n"),
            ("sys/fs/cgroup/memory/a/b/memory.stat", "cache 1\ntotal_inactive_file 5\n"),
            ("sys/fs/cgroup/pids/a/pids.max", "7\n"),
            ("sys/fs/cgroup/cpu,cpuacct/a/cpu.cfs_quota_us", "50000\n"),
            ("sys/fs/cgroup/cpu,cpuacct/a/cpu.cfs_period_us", "100000\n"),
            ("sys/fs/cgroup/cpu,cpuacct/cpu.cfs_quota_us", "-1\n"),
            ("sys/fs/cgroup/cpu,cpuacct/cpu.cfs_period_us", "100000\n"),
        ]);
        assert_eq!(groups, Groups { processes: Some(7), memory: Some(4_000_000), processors: Some(0.5) });
    }

    #[test]
    fn a_fleet_that_cannot_fit_is_refused_with_what_it_needs() {
        let entry = scenarios::find_catalog("late-join").unwrap();
        let mut scenario = scenarios::parse(entry.name, entry.text, &scenarios::Overrides::default()).unwrap();
        scenario.clock.mode = Mode::Lockstep;
        let robots = together(&scenario);
        let check = |scenario: &Scenario, processes, memory, words: Option<&str>| match (
            fits(scenario, processes, memory),
            words,
        ) {
            (Ok(()), None) => {}
            (Err(Error { kind: Kind::Limits, message, hints, .. }), Some(words)) => {
                assert!(message.contains(words) && !hints.is_empty(), "{message}");
            }
            (found, _) => panic!("{processes:?} {memory:?}: {found:?}"),
        };
        check(&scenario, None, None, None);
        check(&scenario, Some(robots + 2), Some(1 << 30), None);
        check(&scenario, Some(robots + 1), None, Some("processes: the limits leave"));
        check(&scenario, None, Some(4 << 20), Some("memory: the limits leave 4.0 MiB"));
        scenario.clock.mode = Mode::Single;
        check(&scenario, Some(0), Some(0), None);
    }
}
