//! Processors and scheduling classes of the processes of a fleet.
//!
//! The daemon sets them between fork and exec: so they hold for every executable that a robot names, and for whatever
//! that starts, from the first instruction on. What the machine does not allow is found out before anything is started,
//! by a thread that does the same to itself and ends.

use crate::error::{Error, Kind};
use model::{Class, Processes, Scheduling, cpu_list};
use rustix::process::{Resource, getrlimit};
use rustix::thread::{CapabilitySet, CpuSet, capabilities, sched_getaffinity, sched_setaffinity};
use std::io;
use std::os::unix::process::CommandExt;
use std::process::Command;

/// Linux has no higher one.
const PRIORITY_MAX: u64 = 99;

/// What is asked of the kernel.
#[derive(Clone, Copy)]
struct Wish {
    cpus: Option<CpuSet>,
    class: Option<Class>,
}

impl Wish {
    fn of(scheduling: &Scheduling) -> Wish {
        let mut set = CpuSet::new();
        scheduling.cpus.iter().for_each(|cpu| set.set(usize::from(*cpu)));
        Wish { cpus: (!scheduling.cpus.is_empty()).then_some(set), class: scheduling.class }
    }

    /// Asks for the calling thread. Only system calls: nothing is allocated, no lock is taken.
    fn grant(&self) -> io::Result<()> {
        if let Some(cpus) = &self.cpus {
            sched_setaffinity(None, cpus)?;
        }
        self.class.map_or(Ok(()), set_class)
    }
}

/// Gives the process that a command starts its processors and its class.
pub(crate) fn schedule(command: &mut Command, scheduling: &Scheduling) {
    if *scheduling != Scheduling::default() {
        let wish = Wish::of(scheduling);
        // SAFETY: the child of a process with threads may only do between fork and exec what is safe in a signal
        // handler; `grant` makes two system calls.
        unsafe { command.pre_exec(move || wish.grant()) };
    }
}

fn set_class(class: Class) -> io::Result<()> {
    let policy = match class {
        Class::Other => libc::SCHED_OTHER,
        Class::Batch => libc::SCHED_BATCH,
        Class::Fifo { .. } => libc::SCHED_FIFO,
        Class::Rr { .. } => libc::SCHED_RR,
    };
    let priority = libc::c_int::from(class.priority().unwrap_or(0));
    // The call itself, because musl's function of that name only says that it is missing.
    // SAFETY: 0 is the calling thread. The kernel's `struct sched_param` is one number, which it only reads, and which
    // lives until it is back.
    match unsafe { libc::syscall(libc::SYS_sched_setscheduler, 0, policy, &raw const priority) } {
        0 => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}

/// Finds out whether this machine allows what a scenario asks for.
///
/// # Errors
/// Names the key, the cause and the way out.
pub fn check(processes: &Processes) -> Result<(), Error> {
    if *processes == Processes::default() {
        return Ok(());
    }
    let mine = processors_of_this_process();
    for (whose, scheduling) in [("world", &processes.world), ("agents", &processes.agents)] {
        if let Some(mine) = &mine {
            check_cpus(whose, &scheduling.cpus, mine, online().as_deref())?;
        }
        let key = format!("processes.{whose}");
        try_out(Wish { class: None, ..Wish::of(scheduling) })
            .map_err(|error| Error::new(Kind::Scheduling, format!("{key}.cpus: {error}")).hint("leave the key out"))?;
        if let Some(class) = scheduling.class {
            try_out(Wish { cpus: None, class: Some(class) })
                .map_err(|error| refused(&key, class, &error, Permission::of_this_process()))?;
        }
    }
    Ok(())
}

/// The highest priority of a real-time class that a process may have here.
///
/// # Errors
/// When it may have none.
pub fn real_time_priority_max() -> io::Result<u64> {
    try_out(Wish { cpus: None, class: Some(Class::Fifo { priority: 1 }) })?;
    let Permission { privileged, priority_max } = Permission::of_this_process();
    Ok(if privileged { PRIORITY_MAX } else { priority_max.min(PRIORITY_MAX) })
}

/// Grants a wish to a thread that ends.
fn try_out(wish: Wish) -> io::Result<()> {
    if wish.cpus.is_none() && wish.class.is_none() {
        return Ok(());
    }
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().spawn_scoped(scope, || wish.grant())?;
        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

/// The processors that this process may use; `None` where the kernel has more than the call has room for.
pub fn processors_of_this_process() -> Option<Vec<u16>> {
    let set = sched_getaffinity(None).ok()?;
    Some((0..=model::CPU_MAX).filter(|cpu| set.is_set(usize::from(*cpu))).collect())
}

fn online() -> Option<Vec<u16>> {
    #[expect(clippy::disallowed_methods, reason = "the kernel's own account of its processors")]
    let text = std::fs::read_to_string("/sys/devices/system/cpu/online").ok()?;
    listed(text.trim())
}

/// Reads `0-3,8`.
fn listed(text: &str) -> Option<Vec<u16>> {
    let mut cpus = Vec::new();
    for part in text.split(',') {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let [first, last] = [first, last].map(|number| number.parse::<u16>().ok());
        cpus.extend(first?..=last?);
    }
    Some(cpus)
}

fn check_cpus(whose: &str, wanted: &[u16], mine: &[u16], online: Option<&[u16]>) -> Result<(), Error> {
    let missing = |among: &[u16]| -> Vec<u16> { wanted.iter().copied().filter(|cpu| !among.contains(cpu)).collect() };
    let refuse = |missing: &[u16], problem: String, hint: String| {
        let noun = if missing.len() == 1 { "processor" } else { "processors" };
        let message = format!("processes.{whose}.cpus: {noun} {}: {problem}", cpu_list(missing));
        Err(Error::new(Kind::Scheduling, message).hint(hint))
    };
    match online.map(|online| (online, missing(online))) {
        Some((online, offline)) if !offline.is_empty() => refuse(
            &offline,
            format!("not online; this machine has {}", cpu_list(online)),
            format!("`--set processes.{whose}.cpus=[...]` names others"),
        ),
        _ => match missing(mine).as_slice() {
            [] => Ok(()),
            forbidden => refuse(
                forbidden,
                format!("not allowed; shoal itself may only use {}", cpu_list(mine)),
                format!(
                    "name others, or start shoal with more: `taskset -c {} shoal ...`, `--cpuset-cpus` of a container",
                    cpu_list(wanted)
                ),
            ),
        },
    }
}

/// What decides whether a process may have a real-time class.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Permission {
    /// It may do so without a limit: CAP_SYS_NICE.
    privileged: bool,
    /// Highest priority that it may take (`RLIMIT_RTPRIO`).
    priority_max: u64,
}

impl Permission {
    fn of_this_process() -> Permission {
        Permission {
            privileged: capabilities(None).is_ok_and(|sets| sets.effective.contains(CapabilitySet::SYS_NICE)),
            priority_max: getrlimit(Resource::Rtprio).current.unwrap_or(u64::MAX),
        }
    }
}

/// Why the kernel refused a class, and the way out.
fn refused(key: &str, class: Class, error: &io::Error, permission: Permission) -> Error {
    let what = match class.priority() {
        Some(priority) => format!("{} with priority {priority}", class.word()),
        None => class.word().to_owned(),
    };
    let failure = |cause: &str| Error::new(Kind::Scheduling, format!("{key}.scheduling: {what}: {cause}"));
    let without = "or leave it out: `batch` needs no permission";
    match class.priority() {
        Some(priority) if error.raw_os_error() == Some(libc::EPERM) => {
            let Permission { privileged, priority_max } = permission;
            if !privileged && priority_max < u64::from(priority) {
                failure(&format!("not permitted; the limit on real-time priorities is {priority_max}")).hint(format!(
                    "raise it (`ulimit -r {priority}`, `rtprio` in /etc/security/limits.conf, `LimitRTPRIO=` of systemd, \
                     `--ulimit rtprio={priority}` of a container), grant CAP_SYS_NICE, {without}"
                ))
            } else {
                failure("not permitted, although the limit on real-time priorities allows it").hint(format!(
                    "has this cgroup no real-time time (`cpu.rt_runtime_us`), or is the call filtered (seccomp)? {without}"
                ))
            }
        }
        _ => failure(&error.to_string()).hint("leave the key out to keep the class that shoal was started with"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_processors_are_read_as_they_are_written() {
        for (text, cpus) in
            [("0", vec![0]), ("0-1", vec![0, 1]), ("0-3,8", vec![0, 1, 2, 3, 8]), ("2,4,6-7", vec![2, 4, 6, 7])]
        {
            assert_eq!(listed(text), Some(cpus.clone()), "{text}");
            assert_eq!(cpu_list(&cpus), text);
        }
        assert_eq!(listed("all"), None);
    }

    #[test]
    fn processors_that_cannot_be_had_are_named() {
        let check = |wanted: &[u16], mine: &[u16], online: Option<&[u16]>, expected: &str| match check_cpus(
            "agents", wanted, mine, online,
        ) {
            Ok(()) => assert_eq!(expected, ""),
            Err(Error { kind, message, hints, .. }) => {
                assert_eq!((kind, message.as_str(), hints.len()), (Kind::Scheduling, expected, 1));
            }
        };
        check(&[], &[0], Some(&[0]), "");
        check(&[0, 1], &[0, 1, 2], Some(&[0, 1, 2, 3]), "");
        check(&[0, 1], &[0, 1], None, "");
        check(&[0, 7], &[0, 1], Some(&[0, 1]), "processes.agents.cpus: processor 7: not online; this machine has 0-1");
        check(
            &[0, 2, 3],
            &[0, 1],
            Some(&[0, 1, 2, 3]),
            "processes.agents.cpus: processors 2-3: not allowed; shoal itself may only use 0-1",
        );
        check(&[5], &[0], None, "processes.agents.cpus: processor 5: not allowed; shoal itself may only use 0");
    }

    #[test]
    fn every_refusal_of_a_class_has_its_cause_and_a_way_out() {
        let check = |class: Class, errno: i32, privileged: bool, priority_max: u64, words: [&str; 2]| {
            let error = io::Error::from_raw_os_error(errno);
            let failure = refused("processes.world", class, &error, Permission { privileged, priority_max });
            assert_eq!(failure.kind, Kind::Scheduling);
            let (text, way_out) = (&failure.message, failure.hints.join("\n"));
            assert!(text.starts_with(&format!("processes.world.scheduling: {}", class.word())), "{text}");
            assert!(text.contains(words[0]) || way_out.contains(words[0]), "{text}");
            assert!(text.contains(words[1]) || way_out.contains(words[1]), "{text}\n{way_out}");
        };
        let fifo = Class::Fifo { priority: 10 };
        check(fifo, libc::EPERM, false, 0, ["with priority 10: not permitted; the limit", "ulimit -r 10"]);
        check(fifo, libc::EPERM, false, 9, ["is 9", "CAP_SYS_NICE"]);
        check(Class::Rr { priority: 1 }, libc::EPERM, false, 10, ["rr with priority 1", "cpu.rt_runtime_us"]);
        check(fifo, libc::EPERM, true, 0, ["although", "cpu.rt_runtime_us"]);
        check(fifo, libc::ENOSYS, true, 0, ["Function not implemented", "leave the key out"]);
        check(Class::Batch, libc::EPERM, false, 0, ["batch: Operation not permitted", "leave the key out"]);
    }

    #[test]
    fn trying_out_leaves_this_thread_as_it_is() {
        let before = (sched_getaffinity(None).unwrap(), class_of_this_thread());
        let cpus = vec![*processors_of_this_process().unwrap().first().unwrap()];
        let wish = Scheduling { cpus, class: Some(Class::Batch) };
        check(&Processes { world: wish.clone(), agents: wish, ..Processes::default() }).unwrap();
        assert_eq!((sched_getaffinity(None).unwrap(), class_of_this_thread()), before);
    }

    fn class_of_this_thread() -> i64 {
        // SAFETY: it only asks; 0 is the calling thread.
        unsafe { libc::syscall(libc::SYS_sched_getscheduler, 0) }
    }
}
