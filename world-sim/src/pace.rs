//! When the periods of a `realtime` world begin. Pure.

/// A `realtime` world that is late catches up, but not more than this many periods, or the life of a command if that is
/// longer: robots would drive blind for that time. What is more is a gap.
const CATCH_UP_PERIODS: u64 = 10;

/// Periods of equal length, one after the other.
pub struct Pace {
    period_ns: u64,
    gap_ns: u64,
    due_ns: u64,
}

impl Pace {
    /// The first period begins at `start_ns`.
    pub fn new(start_ns: u64, period_ns: u64, command_timeout_ns: u64) -> Pace {
        Pace { period_ns, gap_ns: command_timeout_ns.max(CATCH_UP_PERIODS * period_ns), due_ns: start_ns }
    }

    /// When the next period begins, ns.
    pub fn next_ns(&mut self) -> u64 {
        self.due_ns += self.period_ns;
        self.due_ns
    }

    /// The world wakes for the period that was due last. How long time stood still, ns, if it did: then it goes on from
    /// here, in the same phase as the agents' timers. A world that is late for less does the ticks it slept through one
    /// after the other: simulated time keeps to the clock.
    pub fn woken(&mut self, now_ns: u64) -> Option<u64> {
        let late_ns = now_ns.saturating_sub(self.due_ns);
        if late_ns <= self.gap_ns {
            return None;
        }
        self.due_ns += late_ns / self.period_ns * self.period_ns;
        Some(late_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_late_is_caught_up_and_a_gap_is_not() {
        let mut pace = Pace::new(1_000, 100, 1_200);
        assert_eq!((pace.next_ns(), pace.woken(1_150)), (1_100, None));
        assert_eq!((pace.next_ns(), pace.woken(2_400)), (1_200, None), "twelve periods: the life of a command");
        assert_eq!(pace.next_ns(), 1_300, "they are done one after the other");
        assert_eq!(pace.woken(2_555), Some(1_255));
        assert_eq!(pace.next_ns(), 2_600, "in the same phase");
        let mut pace = Pace::new(0, 100, 10);
        assert_eq!((pace.next_ns(), pace.woken(1_100), pace.woken(1_101)), (100, None, Some(1_001)));
    }
}
