//! What a fleet needs to know of the machine, read and tried out.
#![expect(clippy::disallowed_methods, reason = "the doctor looks at the machine")]

use bus::Address;
use bus::clean::{list_fleets, sweep};
use daemon::{limits, scheduling};
use rustix::process::{PidfdFlags, Resource, getpid, getrlimit, pidfd_open};
use rustix::thread::{current_timer_slack, futex, set_current_timer_slack};
use std::fs;
use std::num::NonZeroU64;
use std::path::Path;
use std::sync::atomic::AtomicU32;

/// What was seen. A limit of `None` is no limit; a text of `Err` says why something failed.
#[derive(Clone, Debug)]
pub struct Machine {
    /// Making a fleet's directory in `/dev/shm`: the free bytes, or why it failed and the way out.
    pub shm_free: Result<u64, (String, Option<String>)>,
    /// Open files that a process may have: hard limit (the soft one is raised to it).
    pub open_files_max: Option<u64>,
    /// Open files that may still be opened on the whole machine.
    pub open_files_left: Option<u64>,
    /// Memory mappings that a process may have.
    pub maps_max: Option<u64>,
    /// Processes that this user may still start: by `RLIMIT_NPROC`, the cgroup and the kernel.
    pub processes_left: Option<u64>,
    /// Available memory, bytes: of the machine, or what the cgroup leaves of it.
    pub memory_available: Option<u64>,
    /// Processors' worth of time that the cgroup allows.
    pub processors_max: Option<f64>,
    /// Processors that this process may use.
    pub cores: usize,
    /// Their numbers, ascending; empty where they are not shown.
    pub cpus: Vec<u16>,
    /// The highest priority of a real-time class that a process may have.
    pub real_time: Result<u64, String>,
    /// Whether `/proc/self/schedstat` says how long a process waited.
    pub schedstat: bool,
    /// Kernel release.
    pub kernel: String,
    /// Opening a pidfd of this process.
    pub pidfd: Result<(), String>,
    /// Waking nobody on a futex.
    pub futex: Result<(), String>,
    /// Setting the timer slack of this thread to 1 ns.
    pub timer_slack: Result<(), String>,
    /// Clock source of the kernel.
    pub clock_source: Option<String>,
    /// Ids of the fleets that run.
    pub fleets_running: Vec<String>,
    /// Ids of the fleets that nobody looks after.
    pub fleets_abandoned: Vec<String>,
}

/// Looks at this machine. What is tried out is undone.
pub fn probe() -> Machine {
    let fleets = list_fleets().unwrap_or_default();
    let ids = |abandoned: bool| {
        let wanted = fleets.iter().filter(|fleet| fleet.abandoned == abandoned);
        wanted.map(|fleet| fleet.address.id().to_owned()).collect()
    };
    let groups = limits::Groups::of_this_process();
    let clock = "/sys/devices/system/clocksource/clocksource0/current_clocksource";
    Machine {
        shm_free: shm_free(),
        open_files_max: getrlimit(Resource::Nofile).maximum,
        open_files_left: open_files_left(),
        maps_max: number("/proc/sys/vm/max_map_count"),
        processes_left: limits::processes_left(&groups),
        memory_available: limits::memory_left(&groups),
        processors_max: groups.processors,
        cores: std::thread::available_parallelism().map_or(1, usize::from),
        cpus: scheduling::processors_of_this_process().unwrap_or_default(),
        real_time: scheduling::real_time_priority_max().map_err(|error| error.to_string()),
        schedstat: schedstat(),
        kernel: rustix::system::uname().release().to_string_lossy().into_owned(),
        pidfd: pidfd_open(getpid(), PidfdFlags::empty()).map(drop).map_err(said),
        futex: futex::wake(&AtomicU32::new(0), futex::Flags::empty(), 1).map(drop).map_err(said),
        timer_slack: timer_slack(),
        clock_source: fs::read_to_string(clock).ok().map(|name| name.trim().to_owned()).filter(|name| !name.is_empty()),
        fleets_running: ids(false),
        fleets_abandoned: ids(true),
    }
}

fn shm_free() -> Result<u64, (String, Option<String>)> {
    let failed = |error: bus::BusError| (error.to_string(), error.hint().map(str::to_owned));
    let address = Address::create().map_err(failed)?;
    let written = fs::write(address.file("doctor"), [0_u8; 8192]);
    let stat = rustix::fs::statvfs(address.root());
    sweep(&address);
    let full = "remove what is in the way, or enlarge it: `mount -o remount,size=2G /dev/shm`";
    written.map_err(|error| (format!("cannot write to it: {error}"), Some(full.to_owned())))?;
    let stat = stat.map_err(|error| (format!("cannot ask for the free space: {error}"), None))?;
    Ok(stat.f_bavail.saturating_mul(stat.f_frsize))
}

fn open_files_left() -> Option<u64> {
    let text = fs::read_to_string("/proc/sys/fs/file-nr").ok()?;
    let mut words = text.split_whitespace().map(str::parse::<u64>);
    let (used, _, max) = (words.next()?.ok()?, words.next()?.ok()?, words.next()?.ok()?);
    // Unlimited machines say so with a number beyond counting.
    (max < u64::MAX / 4).then(|| max.saturating_sub(used))
}

/// Three numbers, the first of which moves: kernels without scheduler statistics show zeros.
fn schedstat() -> bool {
    let text = fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    let numbers: Vec<u64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    numbers.len() == 3 && numbers.iter().any(|&number| number > 0)
}

fn timer_slack() -> Result<(), String> {
    let before = current_timer_slack().map_err(said)?;
    set_current_timer_slack(NonZeroU64::new(1)).map_err(said)?;
    let set = current_timer_slack().map_err(said)?;
    let _ = set_current_timer_slack(NonZeroU64::new(before));
    if set == 1 { Ok(()) } else { Err(format!("it was set to 1 ns and is {set} ns")) }
}

fn number(path: impl AsRef<Path>) -> Option<u64> {
    fs::read_to_string(path).ok()?.trim().parse().ok()
}

fn said(error: rustix::io::Errno) -> String {
    std::io::Error::from(error).to_string()
}
