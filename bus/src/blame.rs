//! Whose fault it was: every late period of a `realtime` loop gets one cause.
//!
//! A period is *late* when its process woke later than [`WAKE_SHARE_MAX`] of a period after its start, when its work was
//! over after its end, when it never began because the loop was still away, or when what it had to work with was older
//! than [`INPUT_PERIODS_MAX`] periods. The cause is whatever took the largest part of the time from the start that the
//! clock set to the end of the work ([`cause`]).
//!
//! Only the kernel knows how long a process was ready to run and was not let. Asking costs a system call, so it is asked
//! ([`clock::RunQueue`]) after a late period and every period of the second that follows, and otherwise once a second;
//! [`Waits`] works out what the late period's part is.

use crate::clock::{self, RunQueue};
use crate::{Counter, StatsWriter};
use model::{Cause, Metric};

/// A process that wakes later than this share of its period is late. The verdict `starved` uses the same bound.
pub const WAKE_SHARE_MAX: f64 = 0.2;
/// The planner, or the world's tick, has this share of a period; what it takes beyond that can be blamed on it.
pub const WORK_SHARE: f64 = 0.5;
/// Odometry is old after so many periods: the world writes it once in each.
pub const INPUT_PERIODS_MAX: u64 = 2;
/// While nothing is late, the scheduler's counters are looked at this often, ns; for as long after a late period, every period.
const LOOK_EVERY_NS: u64 = 1_000_000_000;

/// One period of a loop, when it is over. Times are of the monotonic clock, ns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Period {
    /// How long a period is.
    pub period_ns: u64,
    /// When it was to begin.
    pub due_ns: u64,
    /// When the loop was done with the period before.
    pub free_ns: u64,
    /// When the process woke for it.
    pub woken_ns: u64,
    /// When its work was over.
    pub done_ns: u64,
    /// How long the planner took, or the world for its tick.
    pub work_ns: u64,
    /// How old the odometry was when the process woke; 0 where there is none.
    pub input_age_ns: u64,
}

impl Period {
    /// Periods that were over before the work was: this one, and those that could not even begin.
    pub fn missed(&self) -> u64 {
        self.done_ns.saturating_sub(self.due_ns + self.period_ns).div_ceil(self.period_ns.max(1))
    }

    fn wake_ns(&self) -> u64 {
        self.woken_ns.saturating_sub(self.due_ns)
    }

    fn is_late_in_time(&self) -> bool {
        self.missed() > 0 || self.wake_ns() as f64 > WAKE_SHARE_MAX * self.period_ns as f64
    }

    /// Whether it asks for a cause.
    pub fn is_late(&self) -> bool {
        self.is_late_in_time() || self.input_age_ns > INPUT_PERIODS_MAX * self.period_ns
    }
}

/// Why this period was late: the largest part of the time from its start to the end of its work. `waited_ns` of it the
/// process was ready without a processor; `before` is the cause of the period before, which this one inherits as far
/// as it began late because that one was not over; `work` is the cause that too much work is.
pub fn cause(period: &Period, waited_ns: u64, before: Cause, work: Cause) -> Cause {
    if !period.is_late_in_time() {
        return Cause::Input;
    }
    let inherited_ns = period.free_ns.min(period.woken_ns).saturating_sub(period.due_ns);
    let wake_ns = period.wake_ns() - inherited_ns;
    let elapsed_ns = period.done_ns.saturating_sub(period.due_ns).saturating_sub(inherited_ns);
    let waited_ns = waited_ns.min(elapsed_ns);
    // What of the waiting did not go by before the process woke went by while it worked.
    let worked_ns = period.work_ns.saturating_sub(waited_ns.saturating_sub(wake_ns));
    let share_ns = (WORK_SHARE * period.period_ns as f64) as u64;
    let parts = [
        (waited_ns, Cause::Scheduler),
        (worked_ns.saturating_sub(share_ns), work),
        (inherited_ns, before),
        (elapsed_ns.saturating_sub(waited_ns).saturating_sub(worked_ns), Cause::Neither),
    ];
    // Of equal parts the first one.
    parts.into_iter().rev().max_by_key(|(ns, _)| *ns).map_or(Cause::Neither, |(_, cause)| cause)
}

/// Finds out what part of the waiting that the kernel counted belongs to the period that was just late.
///
/// Between two looks there are periods that were on time. They woke a little late too: partly because their timer
/// was late, which is no waiting for a processor, partly because of it. A look after a time in which nothing was late
/// tells how much is the timer's; the rest of their lateness was waiting and is taken off. Where late periods come again and
/// again such a time does not come, and on a busy processor timers are as late as queues are long: so after a late period each
/// one is looked at, and what was counted since is the next late one's own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Waits {
    /// How late the timer itself is, ns.
    timer_ns: u64,
    /// Periods on time since the last look, and how late they woke together, ns.
    on_time: u64,
    lateness_ns: u64,
    /// Until then every period is looked at.
    closely_until_ns: u64,
}

impl Waits {
    /// Whether to look after a period that was on time and is over `now_ns`; the last look was `looked_ns`.
    pub fn wants_look(&self, now_ns: u64, looked_ns: u64) -> bool {
        now_ns < self.closely_until_ns || now_ns.saturating_sub(looked_ns) > LOOK_EVERY_NS
    }

    /// A period was on time.
    pub fn on_time(&mut self, wake_ns: u64) {
        self.on_time += 1;
        self.lateness_ns += wake_ns;
    }

    /// A look while nothing was late: `waited_ns` more than at the look before.
    pub fn quiet(&mut self, waited_ns: u64) {
        let timer_ns = self.lateness_ns.saturating_sub(waited_ns).checked_div(self.on_time);
        self.timer_ns = timer_ns.unwrap_or(self.timer_ns);
        (self.on_time, self.lateness_ns) = (0, 0);
    }

    /// A look after a late period that is over `now_ns`: how much of `waited_ns` was its.
    pub fn late(&mut self, waited_ns: u64, now_ns: u64) -> u64 {
        self.closely_until_ns = now_ns + LOOK_EVERY_NS;
        let others_ns = self.lateness_ns.saturating_sub(self.on_time * self.timer_ns);
        (self.on_time, self.lateness_ns) = (0, 0);
        waited_ns.saturating_sub(others_ns)
    }
}

/// Follows the periods of one `realtime` loop, and counts what there is to say about them.
pub struct Watch {
    work: Cause,
    /// A late world does the ticks that it slept through one after the other; an agent leaves periods out.
    catches_up: bool,
    /// `None` where the kernel does not say: then nothing is blamed on the scheduler.
    queue: Option<RunQueue>,
    waits: Waits,
    waited_ns: u64,
    looked_ns: u64,
    before: Cause,
    free_ns: u64,
}

impl Watch {
    /// Begins to watch the loop of an agent, which runs in the calling thread.
    pub fn of_agent() -> Watch {
        Watch::new(Cause::Planner, false)
    }

    /// Begins to watch the loop of the world, which runs in the calling thread.
    pub fn of_world() -> Watch {
        Watch::new(Cause::World, true)
    }

    fn new(work: Cause, catches_up: bool) -> Watch {
        let mut queue = RunQueue::open();
        let waited_ns = queue.as_mut().and_then(RunQueue::waited_ns).unwrap_or(0);
        let looked_ns = clock::now_ns();
        let (before, waits) = (Cause::Neither, Waits::default());
        Watch { work, catches_up, queue, waits, waited_ns, looked_ns, before, free_ns: 0 }
    }

    /// A period is over; its `free_ns` is not looked at. Counts it, its misses, how late the process woke for it and for
    /// those that it slept or worked through, and its cause if it was late. One system call if one was late within the last
    /// second, or if there was none for a second; else none.
    pub fn judge(&mut self, stats: &mut StatsWriter, period: Period) {
        let period = Period { free_ns: std::mem::replace(&mut self.free_ns, period.done_ns), ..period };
        let missed = if self.catches_up { period.missed().min(1) } else { period.missed() };
        let skipped = missed.saturating_sub(1);
        stats.add(Counter::Periods, 1 + skipped);
        stats.add(Counter::DeadlineMisses, missed);
        stats.record(Metric::Wake, period.wake_ns());
        // The starts that fell into this period waited until its work was over.
        let first_ns = period.due_ns + period.period_ns;
        stats.record_stall(Metric::Wake, period.done_ns.saturating_sub(first_ns), period.period_ns, skipped);
        if period.is_late() {
            let delta_ns = self.look(stats);
            let cause = cause(&period, self.waits.late(delta_ns, period.done_ns), self.before, self.work);
            stats.add_late(cause, 1 + skipped);
            self.before = cause;
        } else {
            self.waits.on_time(period.wake_ns());
            if self.waits.wants_look(period.done_ns, self.looked_ns) {
                let delta_ns = self.look(stats);
                self.waits.quiet(delta_ns);
            }
        }
    }

    /// How much longer the loop has waited for a processor since the last look.
    fn look(&mut self, stats: &mut StatsWriter) -> u64 {
        let Some(waited_ns) = self.queue.as_mut().and_then(RunQueue::waited_ns) else { return 0 };
        let now_ns = clock::now_ns();
        let delta_ns = waited_ns.saturating_sub(self.waited_ns);
        stats.add(Counter::WaitedNs, delta_ns);
        stats.add(Counter::WatchedNs, now_ns.saturating_sub(self.looked_ns));
        (self.waited_ns, self.looked_ns) = (waited_ns, now_ns);
        delta_ns
    }
}

#[cfg(test)]
mod tests {
    use super::Cause::{Input, Neither, Planner, Scheduler, World};
    use super::*;
    use proptest::prelude::*;

    const MS: u64 = 1_000_000;

    /// A period of 20 ms that is due at 1000 ms; times in ms after that.
    fn period(free: u64, woken: u64, done: u64, work: u64) -> Period {
        let due_ns = 1000 * MS;
        Period {
            period_ns: 20 * MS,
            due_ns,
            free_ns: due_ns + free * MS,
            woken_ns: due_ns + woken * MS,
            done_ns: due_ns + done * MS,
            work_ns: work * MS,
            input_age_ns: 20 * MS,
        }
    }

    #[test]
    fn what_is_late() {
        let check = |period: Period, late: bool, missed: u64| {
            assert_eq!((period.is_late(), period.missed()), (late, missed), "{period:?}");
        };
        check(period(0, 0, 1, 1), false, 0);
        check(period(0, 4, 5, 1), false, 0); // just at the bound
        check(period(0, 5, 6, 1), true, 0);
        check(period(0, 0, 20, 19), false, 0); // just done
        check(period(0, 0, 21, 20), true, 1);
        check(period(0, 0, 40, 40), true, 1);
        check(period(0, 0, 41, 40), true, 2);
        check(Period { input_age_ns: 40 * MS, ..period(0, 0, 1, 1) }, false, 0);
        check(Period { input_age_ns: 40 * MS + 1, ..period(0, 0, 1, 1) }, true, 0);
    }

    #[test]
    fn the_largest_part_is_to_blame() {
        let check = |period: Period, waited_ms: u64, before: Cause, expected: Cause| {
            assert_eq!(cause(&period, waited_ms * MS, before, Planner), expected, "{period:?} {waited_ms}");
        };
        // Late to wake: for want of a processor, or for no reason that is known here.
        check(period(0, 6, 7, 1), 6, Neither, Scheduler);
        check(period(0, 6, 7, 1), 0, Planner, Neither);
        check(period(0, 6, 7, 1), 2, Neither, Neither);
        // On time, but worked too long; or was taken off the processor meanwhile.
        check(period(0, 0, 30, 30), 0, Scheduler, Planner);
        check(period(0, 0, 30, 30), 25, Planner, Scheduler);
        check(period(0, 0, 30, 1), 0, Planner, Neither);
        // Within its share the planner is not to blame, whatever else takes long.
        check(period(0, 5, 15, 10), 5, Neither, Scheduler);
        check(period(0, 12, 21, 9), 0, Neither, Neither);
        check(period(0, 3, 22, 18), 3, Neither, Planner);
        // The period before was not over: what delayed that delays this.
        check(period(12, 12, 13, 1), 0, Scheduler, Scheduler);
        check(period(12, 12, 13, 1), 0, Planner, Planner);
        check(period(5, 12, 13, 1), 7, Planner, Scheduler);
        // A planner that is always too slow stays to blame.
        check(period(15, 15, 50, 35), 0, Planner, Planner);
        // More waiting was counted than there was time.
        check(period(0, 6, 7, 1), 500, Neither, Scheduler);
        // Late only in what it had to work with; and if it was late itself as well, that comes first.
        check(Period { input_age_ns: 50 * MS, ..period(0, 0, 1, 1) }, 0, Scheduler, Input);
        check(Period { input_age_ns: 50 * MS, ..period(0, 6, 7, 1) }, 6, Neither, Scheduler);
        assert_eq!(cause(&period(0, 0, 30, 30), 0, Neither, World), World);
    }

    #[test]
    fn waiting_of_periods_on_time_is_not_that_of_the_late_one() {
        // Wakes 50 us late, 10 us of it in the queue.
        let mut waits = Waits::default();
        (0..50).for_each(|_| waits.on_time(50_000));
        waits.quiet(50 * 10_000);
        assert_eq!(waits.timer_ns, 40_000);
        // Quiet, then one that waited 6 ms.
        (0..20).for_each(|_| waits.on_time(50_000));
        let at = 1000 * MS;
        assert_eq!(waits.late(20 * 10_000 + 6 * MS, at), 6 * MS);
        // Others arrive: every period waits 3 ms; then one is late for another reason.
        (0..10).for_each(|_| waits.on_time(3 * MS + 40_000));
        assert_eq!(waits.late(30 * MS, at), 0);
        // Nothing between two late ones: all of it belongs to the second.
        assert_eq!(waits.late(7 * MS, at), 7 * MS);
    }

    #[test]
    fn after_a_late_period_every_period_is_looked_at() {
        let mut waits = Waits::default();
        let second = LOOK_EVERY_NS;
        assert!(!waits.wants_look(9 * second, 8 * second) && waits.wants_look(9 * second + 1, 8 * second));
        waits.late(0, 10 * second);
        assert!(waits.wants_look(10 * second + 1, 10 * second) && waits.wants_look(11 * second - 1, 11 * second - 2));
        assert!(!waits.wants_look(11 * second, 11 * second - 1));
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        /// Whatever it is told, it stays within its words: nobody is blamed who had no part.
        #[test]
        fn nobody_is_blamed_without_a_part(
            free in 0_u64..40, woken in 0_u64..40, rest in 0_u64..60, share in 0_u64..=100, waited in 0_u64..100,
        ) {
            let done = woken + rest;
            let period = period(free, woken, done, rest * share / 100);
            let found = cause(&period, waited * MS, World, Planner);
            let allowed = match found {
                Scheduler => waited > 0,
                Planner => period.work_ns > 10 * MS,
                World => free > 0,
                Input => !period.is_late_in_time(),
                Neither => true,
            };
            prop_assert!(allowed, "{period:?} {waited}: {found:?}");
        }
    }
}
