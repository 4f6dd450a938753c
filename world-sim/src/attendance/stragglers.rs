//! How long the robots that a tick of `lockstep` waits for have kept it waiting *themselves*.
//!
//! A tick takes as long as its slowest robot. On a loaded machine that may be a process that is ready and has no
//! processor, or everything may stand still for a while, the world included. That is the machine's doing: it changes
//! when a run ends, and must not change how. So of the wall time since the tick was opened a robot is charged only with
//! what it spent computing, sleeping, or stopped, and is overdue when that is more than the limit. What a process waits
//! for a processor the kernel says (`/proc/PID/schedstat`); where it does not, all of the time is charged.
//!
//! Nothing is looked at before a tick has taken a tenth of a second, so the loop pays nothing for this.

use bus::clock::Schedstat;
use model::RobotInstance;
use std::time::Duration;

/// The world's longest sleep without a look at the orders and at the slots.
pub const PATIENCE: Duration = Duration::from_millis(100);

/// A tick waits for no robot longer than this many limits of wall time, whatever the robot was waiting for itself.
const WALL_LIMITS_MAX: u64 = 100;
/// Looks within one limit; each reads two small files for every robot that is missing.
const LOOKS: u32 = 32;

/// What the kernel says of a process at one look.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// What it has used.
    pub stat: Schedstat,
    /// It runs, or could.
    pub runnable: bool,
}

/// A robot that has not answered.
struct Missing {
    instance: RobotInstance,
    first: Option<Seen>,
    last: Option<Seen>,
    /// Time since the first look in which both it and the world could have run, ns.
    charged_ns: u64,
}

impl Missing {
    /// What it kept the tick waiting itself, ns.
    fn own_ns(&self) -> u64 {
        let waited = |seen: &Option<Seen>| seen.map_or(0, |seen| seen.stat.waited_ns);
        self.charged_ns.saturating_sub(waited(&self.last).saturating_sub(waited(&self.first)))
    }
}

/// Those that the open tick waits for.
pub(super) struct Stragglers {
    limit_ns: u64,
    every_ns: u64,
    opened_ns: u64,
    looked_ns: u64,
    missing: Vec<Missing>,
}

impl Stragglers {
    /// Robots are overdue after this limit.
    pub(super) fn new(limit: Duration) -> Stragglers {
        let ns = |duration: Duration| u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX);
        let every_ns = ns(PATIENCE.max(limit / LOOKS));
        Stragglers { limit_ns: ns(limit), every_ns, opened_ns: 0, looked_ns: 0, missing: Vec::new() }
    }

    /// A tick has been opened.
    pub(super) fn begin(&mut self, opened_ns: u64) {
        (self.opened_ns, self.looked_ns) = (opened_ns, opened_ns);
        self.missing.clear();
    }

    /// Who of those that have not answered is overdue. `see` asks the kernel; it is only used now and then.
    pub(super) fn overdue(
        &mut self,
        now_ns: u64,
        missing: &[RobotInstance],
        see: &mut dyn FnMut(RobotInstance) -> Option<Seen>,
    ) -> Vec<RobotInstance> {
        let passed_ns = now_ns.saturating_sub(self.looked_ns);
        if passed_ns < self.every_ns {
            return Vec::new();
        }
        self.looked_ns = now_ns;
        // The world sleeps for no longer than its patience. What is beyond it, it did not run itself.
        let charged_ns = passed_ns.min(self.every_ns + PATIENCE.as_nanos() as u64);
        let hopeless = now_ns.saturating_sub(self.opened_ns) > self.limit_ns.saturating_mul(WALL_LIMITS_MAX);
        self.missing.retain(|before| missing.contains(&before.instance));
        let mut overdue = Vec::new();
        for &instance in missing {
            let seen = see(instance);
            let Some(robot) = self.missing.iter_mut().find(|before| before.instance == instance) else {
                // What it waited until now nobody can tell: it is charged from here on.
                self.missing.push(Missing { instance, first: seen, last: seen, charged_ns: 0 });
                continue;
            };
            // A wait for a processor is counted by the kernel when it is over.
            let waits = robot.last.zip(seen).is_some_and(|(last, seen)| seen.runnable && seen.stat == last.stat);
            robot.charged_ns += if waits { 0 } else { charged_ns };
            robot.last = seen;
            if hopeless || robot.own_ns() > self.limit_ns {
                overdue.push(instance);
            }
        }
        overdue
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::RobotIndex;

    const S: u64 = 1_000_000_000;

    fn instance(slot: u32) -> RobotInstance {
        RobotInstance { index: RobotIndex(slot), incarnation: 0 }
    }

    /// When a robot is given up whose process does this with every second, and the world looks ten times a second but
    /// for a gap: seconds after the opening.
    fn given_up_after(ran: f64, waited: f64, runnable: bool, gap: std::ops::Range<u64>) -> Option<u64> {
        let mut stragglers = Stragglers::new(Duration::from_secs(10));
        stragglers.begin(S);
        (1..20_000).filter(|tenth| !gap.contains(tenth)).find_map(|tenth| {
            let ns = |share: f64| (tenth as f64 * 0.1e9 * share) as u64;
            let stat = Schedstat { ran_ns: ns(ran), waited_ns: 77 * S + ns(waited) };
            let mut see = |_| Some(Seen { stat, runnable });
            let overdue = stragglers.overdue(S + tenth * S / 10, &[instance(3)], &mut see);
            (!overdue.is_empty()).then_some(tenth / 10)
        })
    }

    const NEVER: std::ops::Range<u64> = 0..0;

    #[test]
    fn a_robot_is_charged_with_its_own_time_only() {
        // Asleep or stopped, and computing without an end on a machine of its own.
        assert_eq!(given_up_after(0.0, 0.0, false, NEVER), Some(10));
        assert_eq!(given_up_after(1.0, 0.0, true, NEVER), Some(10));
        // Without a processor half of the time.
        assert_eq!(given_up_after(0.5, 0.5, true, NEVER), Some(20));
        // Nearly always, and without ever getting one: bounded all the same.
        assert_eq!(given_up_after(0.001, 0.999, true, NEVER), Some(1000));
        assert_eq!(given_up_after(0.0, 0.0, true, NEVER), Some(1000));
        // The world stood still as well, for 30 s.
        assert_eq!(given_up_after(0.0, 0.0, false, 50..350), Some(40));
    }

    #[test]
    fn where_the_kernel_does_not_say_wall_time_counts_and_an_answer_is_an_answer() {
        let mut stragglers = Stragglers::new(Duration::from_secs(10));
        stragglers.begin(S);
        for second in 1..10 {
            assert_eq!(stragglers.overdue(S + second * S, &[instance(0), instance(1)], &mut |_| None), []);
        }
        // Whoever looks every second is charged with less than it.
        assert_eq!(stragglers.overdue(100 * S, &[instance(1)], &mut |_| None), []);
        stragglers.begin(200 * S);
        assert_eq!(stragglers.overdue(200 * S + S / 100, &[instance(1)], &mut |_| panic!("too early")), []);
    }
}
