//! Time for the shells: one monotonic clock that all processes of a machine share, and absolute sleeps.

use rustix::fs::{Mode, OFlags};
use rustix::thread::ClockId;
use rustix::time::Timespec;
use std::num::NonZeroU64;
use std::os::fd::OwnedFd;

const NS_PER_S: u64 = 1_000_000_000;

/// The monotonic clock, ns. The same for every process of this machine; no system call.
pub fn now_ns() -> u64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    now.tv_sec.unsigned_abs() * NS_PER_S + now.tv_nsec.unsigned_abs()
}

/// Sleeps until the monotonic clock shows `ns`; returns at once if it does already. An absolute time does not drift,
/// however often a signal interrupts it.
pub fn sleep_until_ns(ns: u64) {
    let until = timespec(ns);
    while rustix::thread::clock_nanosleep_absolute(ClockId::Monotonic, &until) == Err(rustix::io::Errno::INTR) {}
}

/// Asks the kernel not to delay this thread's timers in order to batch them: 1 ns of slack instead of 50 us.
/// It is a wish: where it is refused, wake-ups come later and the latency report shows it.
pub fn set_timer_slack_1ns() {
    let _ = rustix::thread::set_current_timer_slack(NonZeroU64::new(1));
}

/// What the kernel counted for the main thread of process `pid`.
pub fn schedstat_of(pid: u32) -> Option<Schedstat> {
    schedstat(&format!("/proc/{pid}/schedstat"))
}

/// What the scheduler counted for a thread.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Schedstat {
    /// Time on a processor, ns.
    pub ran_ns: u64,
    /// Time ready to run, without a processor, ns.
    pub waited_ns: u64,
}

fn schedstat(path: &str) -> Option<Schedstat> {
    #[expect(clippy::disallowed_methods, reason = "the scheduler's counters are a file")]
    let text = std::fs::read_to_string(path).ok()?;
    let mut fields = text.split_ascii_whitespace();
    Some(Schedstat { ran_ns: fields.next()?.parse().ok()?, waited_ns: fields.next()?.parse().ok()? })
}

/// The scheduler's counters of one thread, kept open: a look is one system call, and allocates nothing.
pub struct RunQueue {
    file: OwnedFd,
}

impl RunQueue {
    /// Those of the calling thread; `None` where the kernel does not keep them.
    pub fn open() -> Option<RunQueue> {
        let file = rustix::fs::open("/proc/thread-self/schedstat", OFlags::RDONLY | OFlags::CLOEXEC, Mode::empty());
        let mut queue = RunQueue { file: file.ok()? };
        queue.waited_ns().is_some().then_some(queue)
    }

    /// Time ready to run, without a processor, ns, since the thread began.
    pub fn waited_ns(&mut self) -> Option<u64> {
        // Three numbers of at most twenty digits.
        let mut bytes = [0_u8; 80];
        let len = rustix::io::retry_on_intr(|| rustix::io::pread(&self.file, &mut bytes, 0)).ok()?;
        str::from_utf8(&bytes[..len]).ok()?.split_ascii_whitespace().nth(1)?.parse().ok()
    }
}

pub(crate) fn timespec(ns: u64) -> Timespec {
    #[expect(clippy::cast_possible_wrap, reason = "2^63 ns are 292 years, and the remainder is below a second")]
    Timespec { tv_sec: (ns / NS_PER_S) as i64, tv_nsec: (ns % NS_PER_S) as i64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sleeps_end_after_their_time() {
        set_timer_slack_1ns();
        let start = now_ns();
        sleep_until_ns(start + 3_000_000);
        assert!(now_ns() >= start + 3_000_000);
        sleep_until_ns(start);
    }

    #[test]
    fn the_scheduler_is_asked() {
        if let Some(stat) = schedstat_of(std::process::id()) {
            assert!(stat.ran_ns > 0);
        }
        assert_eq!(schedstat_of(u32::MAX), None);
    }

    #[test]
    fn a_queue_that_is_kept_open_goes_on_counting() {
        let Some(mut queue) = RunQueue::open() else { return };
        let first = queue.waited_ns().unwrap();
        // The same number by another way, before and after.
        let between = schedstat("/proc/thread-self/schedstat").unwrap().waited_ns;
        let last = queue.waited_ns().unwrap();
        assert!(first <= between && between <= last, "{first} {between} {last}");
    }
}
