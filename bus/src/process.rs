//! What a process of a fleet does first: it ties its life to the one that started it; and what it does when it is ready:
//! it gives back the stack that only getting ready took.

use crate::{BusError, Result};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::mm::{Advice, madvise};
use rustix::process::{Pid, PidfdFlags, Signal, getppid, kill_process, pidfd_open, set_parent_process_death_signal};
use std::ops::Range;
use std::os::fd::OwnedFd;

/// This much below the present frame stays: the next calls need it at once.
const STACK_KEPT: usize = 8 << 10;
const PAGE: usize = 4096;

/// Asks the kernel to kill this process when its parent dies, and then looks whether that happened already: `false`
/// means that the process was started by somebody who is gone, and should end.
pub fn die_with_parent(parent: u32) -> bool {
    // Where it is refused (it never is on Linux) the guardian still ends this process.
    let _ = set_parent_process_death_signal(Some(Signal::KILL));
    getppid().map(Pid::as_raw_pid).and_then(|pid| u32::try_from(pid).ok()) == Some(parent)
}

/// When a process was started, in ticks of the kernel since the boot: with this, its number names one process only. `None`
/// if there is none, or it has ended.
pub fn start_of(pid: u32) -> Option<u64> {
    #[expect(clippy::disallowed_methods, reason = "the kernel tells of a process in a file")]
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The name of the program may hold anything; what follows its last parenthesis is the third field, the state.
    let mut fields = stat.rsplit_once(')')?.1.split_ascii_whitespace();
    fields.next().filter(|state| !matches!(*state, "Z" | "X"))?;
    fields.nth(18)?.parse().ok()
}

/// The same for a process that the daemon started, or one that a wrapper started for it: asks the kernel to kill this
/// process when its parent dies, and sees to it that it dies with `ancestor`, however many processes stand between them.
///
/// # Errors
/// When `ancestor` is not among the processes that led to this one, or cannot be watched: a process that would not
/// notice the end of its fleet must not begin.
pub fn die_with_ancestor(ancestor: u32) -> Result<()> {
    if die_with_parent(ancestor) {
        return Ok(());
    }
    let refused = |cause: String, hint: &str| {
        BusError::new(format!("agent (process {})", std::process::id()), "join the fleet", cause, hint)
    };
    let watch = "the daemon is not its parent, so it must be watched";
    let daemon = i32::try_from(ancestor).ok().and_then(Pid::from_raw);
    let daemon = (daemon.ok_or(Errno::SRCH).and_then(|pid| pidfd_open(pid, PidfdFlags::empty())))
        .map_err(|errno| refused(format!("{watch}: {}", std::io::Error::from(errno)), WRAPPER))?;
    // In this order: what is an ancestor now, and has not ended since it was opened, is what was opened.
    if !descends_from(std::process::id(), ancestor) || ended(&daemon, Some(&Timespec::default())) {
        return Err(refused(format!("process {ancestor}, the daemon, is not among its parents"), WRAPPER));
    }
    // Asleep until then. A thread, because the loop of an agent must not ask the kernel in every period.
    let guard = std::thread::Builder::new().name("watch-daemon".to_owned()).stack_size(WATCH_STACK);
    let watching = guard.spawn(move || {
        while !ended(&daemon, Some(&WATCH)) {}
        let _ = kill_process(rustix::process::getpid(), Signal::KILL);
    });
    watching.map(drop).map_err(|error| refused(format!("{watch}: {error}"), "is the limit on processes reached?"))
}

const WRAPPER: &str = "a wrapper has to stay until the agent ends, in its PID namespace, or to become the agent: `exec real-agent \"$@\"`";
const WATCH: Timespec = Timespec { tv_sec: 600, tv_nsec: 0 };
const WATCH_STACK: usize = 64 << 10;
/// More processes than this do not stand between an agent and its daemon.
const GENERATIONS_MAX: usize = 64;

/// Whether a process ends within this time.
fn ended(process: &OwnedFd, within: Option<&Timespec>) -> bool {
    matches!(poll(&mut [PollFd::new(process, PollFlags::IN)], within), Ok(1..))
}

/// Whether `ancestor` is the parent of process `pid`, or of its parent, and so on.
pub fn descends_from(pid: u32, ancestor: u32) -> bool {
    let parents = std::iter::successors(Some(pid), |pid| parent_of(*pid));
    parents.skip(1).take(GENERATIONS_MAX).any(|parent| parent == ancestor)
}

fn parent_of(pid: u32) -> Option<u32> {
    #[expect(clippy::disallowed_methods, reason = "the kernel tells in a file whose child a process is")]
    let text = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    text.rsplit_once(')')?.1.split_ascii_whitespace().nth(1)?.parse().ok()
}

/// Leaves the end of this process to its daemon: signals that ask a whole fleet to end (a service manager sends them to
/// every process at once) are for the daemon, which ends the others when the result is safe. A file that has become as
/// large as it may be is an error of the write, and does not kill.
///
/// Processes that a daemon starts have inherited all of this; here it is for those behind a wrapper that took it back.
pub fn leave_ending_to_daemon() {
    for signal in [libc::SIGINT, libc::SIGTERM, libc::SIGHUP, libc::SIGXFSZ] {
        // SAFETY: ignoring a signal runs no code of ours; the numbers are those of real signals.
        unsafe { libc::signal(signal, libc::SIG_IGN) };
    }
}

/// Gives the kernel back the stack below the caller's frame. iceoryx2 opens services with some 150 KiB of it, which a
/// robot's loop never comes near again. It takes some 0.1 ms, so it has no place in a period. Where the kernel does not
/// say where the stack is, nothing happens.
#[inline(never)]
pub fn give_back_stack() {
    #[expect(clippy::disallowed_methods, reason = "the kernel tells in a file where the stack is")]
    let Ok(maps) = std::fs::read_to_string("/proc/self/maps") else { return };
    let here = (&raw const maps).addr();
    let Some(stack) = maps.lines().filter_map(range).find(|range| range.contains(&here)) else { return };
    let end = here.saturating_sub(STACK_KEPT) & !(PAGE - 1);
    let Some(len) = end.checked_sub(stack.start).filter(|len| *len > 0) else { return };
    // SAFETY: the range lies below all frames of this thread but that of `madvise` itself, which is in what is kept, and
    // in the mapping of this thread's stack, whose lower end is a guard page or free. So nothing in it is alive.
    let _ = unsafe { madvise(std::ptr::without_provenance_mut(stack.start), len, Advice::LinuxDontNeed) };
}

/// The state of a process as the kernel has it: `R` runs or could, `S` and `D` sleep, `T` is stopped by a signal, `t` by a
/// debugger, `Z` has ended. `None` when there is no such process.
pub fn state_of(pid: u32) -> Option<char> {
    #[expect(clippy::disallowed_methods, reason = "the kernel tells it in a file")]
    let stat = std::fs::read(format!("/proc/{pid}/stat")).ok()?;
    // The name in front may contain anything, parentheses included.
    let end = stat.iter().rposition(|byte| *byte == b')')?;
    stat.get(end + 2).map(|byte| char::from(*byte))
}

/// The addresses of a mapping: `begin-end permissions ...`, hexadecimal.
fn range(line: &str) -> Option<Range<usize>> {
    let (begin, end) = line.split_once(' ')?.0.split_once('-')?;
    Some(usize::from_str_radix(begin, 16).ok()?..usize::from_str_radix(end, 16).ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::hint::black_box;

    const DEEP: usize = 1 << 20;

    #[inline(never)]
    fn go_deep() -> u8 {
        let mut frame = [0_u8; DEEP];
        black_box(&mut frame).fill(1);
        frame[black_box(DEEP / 2)]
    }

    /// Memory of this thread's stack, KiB.
    #[expect(clippy::disallowed_methods, reason = "the kernel tells it in a file")]
    fn resident_kib() -> usize {
        let local = 0_u8;
        let here = (&raw const local).addr();
        let maps = std::fs::read_to_string("/proc/self/smaps").unwrap();
        let stack = maps.lines().skip_while(|line| !range(line).is_some_and(|range| range.contains(&here)));
        let line = stack.skip(1).find_map(|line| line.strip_prefix("Rss:")).unwrap();
        line.split_ascii_whitespace().next().unwrap().parse().unwrap()
    }

    #[test]
    fn the_state_of_a_process_is_a_letter() {
        assert!(matches!(state_of(std::process::id()), Some('R' | 'S')), "it is there");
        assert_eq!(state_of(u32::MAX), None);
    }

    #[test]
    fn a_process_knows_its_ancestors() {
        let me = std::process::id();
        let parent = parent_of(me).unwrap();
        assert_eq!(getppid().map(|pid| pid.as_raw_nonzero().get() as u32), Some(parent));
        assert!(descends_from(me, parent) && !descends_from(parent, me) && !descends_from(me, me));
    }

    #[test]
    #[expect(clippy::disallowed_methods, reason = "a process that is no relative")]
    fn a_process_that_would_not_notice_the_end_of_its_fleet_does_not_begin() {
        let mut stranger = std::process::Command::new("sleep").arg("1000").spawn().unwrap();
        let refused = die_with_ancestor(stranger.id());
        stranger.kill().unwrap();
        stranger.wait().unwrap();
        // The kernel was asked to kill this process with its parent; it need not.
        set_parent_process_death_signal(None).unwrap();
        let error = refused.unwrap_err();
        assert!(error.to_string().contains("not among its parents"), "{error}");
        assert!(error.hint().unwrap().contains("exec"), "{error:?}");
    }

    #[test]
    fn what_lies_below_is_given_back_and_what_is_in_use_stays() {
        let used: [u64; 512] = black_box(std::array::from_fn(|i| i as u64));
        assert_eq!(go_deep(), 1);
        let before = resident_kib();
        give_back_stack();
        let after = resident_kib();
        assert!(before >= DEEP / 1024, "{before} KiB");
        assert!(after < before - DEEP / 1024 / 2, "{before} KiB before, {after} KiB after");
        assert!(black_box(&used).iter().enumerate().all(|(i, value)| *value == i as u64));
        assert_eq!(go_deep(), 1);
    }
}
