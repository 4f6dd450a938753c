//! The monotonic clock and absolute sleeps, as shoal's agents use them.

use rustix::thread::ClockId;
use rustix::time::Timespec;
use std::num::NonZeroU64;

const NS_PER_S: u64 = 1_000_000_000;

/// The monotonic clock, ns: the same for every process of the machine.
pub fn now_ns() -> u64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    now.tv_sec.unsigned_abs() * NS_PER_S + now.tv_nsec.unsigned_abs()
}

/// Sleeps until the monotonic clock shows `ns`.
pub fn sleep_until_ns(ns: u64) {
    let until = Timespec { tv_sec: (ns / NS_PER_S) as i64, tv_nsec: (ns % NS_PER_S) as i64 };
    while rustix::thread::clock_nanosleep_absolute(ClockId::Monotonic, &until) == Err(rustix::io::Errno::INTR) {}
}

/// Timer slack of 1 ns for this thread and for those that it starts.
pub fn set_timer_slack_1ns() {
    let _ = rustix::thread::set_current_timer_slack(NonZeroU64::new(1));
}
