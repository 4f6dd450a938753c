//! Whether and when a process that has ended is started again.

use model::{Restart, RestartPolicy};
use serde::{Deserialize, Serialize};

/// How a process ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum End {
    /// By itself, with exit code 0.
    Clean,
    /// By a signal, with another exit code, or before it was ready.
    Failed,
}

/// What follows the end of a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// The next process takes part after this number of ticks, at least 1.
    Again(u64),
    /// The policy wants no other process after such an end.
    NotWanted,
    /// The policy wants another process, and there have been too many.
    LimitReached,
}

/// The restarts of one robot.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Restarts {
    policy: Restart,
    /// The ticks of those in the window, the oldest first; no more than the limit.
    at: Vec<u64>,
    /// The newest end was not followed by a restart, although the policy wants one.
    at_limit: bool,
}

impl Restarts {
    pub(crate) fn new(policy: Restart) -> Restarts {
        Restarts { policy, at: Vec::new(), at_limit: false }
    }

    /// The number of restarts in the window.
    pub(crate) fn recent(&self) -> u32 {
        self.at.len() as u32
    }

    /// Whether there is no further restart because there have been too many.
    pub(crate) fn limit_is_reached(&self) -> bool {
        self.at_limit
    }

    pub(crate) fn policy(&self) -> &Restart {
        &self.policy
    }

    /// A process ended at this tick. A restart that follows is counted.
    pub(crate) fn after(&mut self, end: End, tick: u64) -> Verdict {
        let wanted = match self.policy.policy {
            RestartPolicy::Never => false,
            RestartPolicy::OnFailure => end == End::Failed,
            RestartPolicy::Always => true,
        };
        if !wanted {
            return Verdict::NotWanted;
        }
        if let Some(window) = self.policy.window_ticks {
            self.at.retain(|at| tick.saturating_sub(*at) < window);
        }
        self.at_limit = self.recent() >= self.policy.limit;
        if self.at_limit {
            return Verdict::LimitReached;
        }
        let delay = self.policy.delay_ticks as f64 * self.policy.backoff.powi(self.at.len() as i32);
        self.at.push(tick);
        // The conversion takes what is larger than any tick as the last one.
        Verdict::Again((delay.round() as u64).min(self.policy.delay_ticks_max).max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Verdict::{Again, LimitReached, NotWanted};

    /// What follows failures at these ticks.
    fn check(policy: Restart, ticks: &[u64], expected: &[Verdict]) {
        let mut restarts = Restarts::new(policy);
        let verdicts: Vec<Verdict> = ticks.iter().map(|tick| restarts.after(End::Failed, *tick)).collect();
        assert_eq!(verdicts, expected, "{policy:?}");
    }

    #[test]
    fn the_policy_says_which_ends_are_followed_by_a_restart() {
        let cases = [
            (RestartPolicy::Never, NotWanted, NotWanted),
            (RestartPolicy::OnFailure, NotWanted, Again(5)),
            (RestartPolicy::Always, Again(5), Again(5)),
        ];
        for (policy, clean, failed) in cases {
            let restarts = || Restarts::new(Restart { policy, ..Restart::on_failure(1, 5) });
            assert_eq!((restarts().after(End::Clean, 0), restarts().after(End::Failed, 0)), (clean, failed));
        }
    }

    #[test]
    fn without_a_window_the_limit_is_for_the_whole_run() {
        check(Restart::on_failure(2, 3), &[0, 1000, 1_000_000], &[Again(3), Again(3), LimitReached]);
        check(Restart::on_failure(0, 3), &[7], &[LimitReached]);
        check(Restart::on_failure(1, 0), &[7], &[Again(1)]);
    }

    #[test]
    fn in_a_window_old_restarts_do_not_count() {
        let policy = Restart { window_ticks: Some(100), ..Restart::on_failure(2, 3) };
        check(
            policy,
            &[0, 50, 99, 100, 149, 150],
            &[Again(3), Again(3), LimitReached, Again(3), LimitReached, Again(3)],
        );
    }

    #[test]
    fn delays_grow_up_to_the_maximum_and_begin_again_after_a_quiet_window() {
        let policy =
            Restart { window_ticks: Some(1000), backoff: 2.0, delay_ticks_max: 50, ..Restart::on_failure(100, 10) };
        check(policy, &[0, 10, 30, 70, 120], &[Again(10), Again(20), Again(40), Again(50), Again(50)]);
        check(policy, &[0, 10, 1009, 2009], &[Again(10), Again(20), Again(20), Again(10)]);
        let odd = Restart { backoff: 1.5, ..Restart::on_failure(100, 3) };
        check(odd, &[0, 1, 2], &[Again(3), Again(5), Again(7)]);
        // No number of restarts overflows.
        let steep = Restart { backoff: 1000.0, ..Restart::on_failure(1000, 1000) };
        let mut restarts = Restarts::new(steep);
        let last = (0..1000).map(|tick| restarts.after(End::Failed, tick)).last();
        assert_eq!(last, Some(Again(u64::MAX)));
    }
}
