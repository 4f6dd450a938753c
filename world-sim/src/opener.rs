//! When the next tick of `lockstep` may open: at once, at its time if a rate is wanted, or when an operator says so. Pure.

use model::{PaceChange, PaceState, Rate};
use protocol::daemon_to_world::PaceId;

/// A fleet that is late for its rate catches up, unless it is later than this: then it goes on from here.
const CATCH_UP_NS: u64 = 100_000_000;

/// Whether the next tick may open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Opens {
    /// Now.
    Now,
    /// At this time, ns.
    At(u64),
    /// Not before an operator lets it.
    OnOrder,
}

/// Opens ticks, one after the other. Without an order it opens every tick at once.
#[derive(Clone, Debug)]
pub struct Opener {
    /// Simulated time of a tick, s.
    dt_s: f64,
    paused: bool,
    /// While paused, ticks before this one open all the same.
    until_tick: u64,
    rate: Rate,
    /// A tick that was opened by the present rate, and when, ns.
    since: Option<(u64, u64)>,
    /// Changes that have not been answered, each with the tick at which they are.
    asked: Vec<(PaceId, u64)>,
}

impl Opener {
    /// Of ticks that are this long in simulated time, s.
    pub fn new(dt_s: f64) -> Opener {
        Opener { dt_s, paused: false, until_tick: 0, rate: Rate::Max, since: None, asked: Vec::new() }
    }

    /// The same, with ticks held to a rate.
    pub fn at(dt_s: f64, rate: Rate) -> Opener {
        Opener { rate, ..Opener::new(dt_s) }
    }

    /// Changes the pace; `next` is the first tick that has not been opened. [`answered`](Opener::answered) says when that has
    /// come about.
    pub fn change(&mut self, id: PaceId, change: PaceChange, next: u64) {
        let answered_at = match change {
            PaceChange::Pause => {
                self.cut_short(next);
                (self.paused, self.until_tick) = (true, next);
                next
            }
            PaceChange::Resume { rate } => {
                self.cut_short(next);
                (self.paused, self.since) = (false, None);
                self.rate = rate.unwrap_or(self.rate);
                0
            }
            PaceChange::Step { ticks } => {
                let from = if self.paused { self.until_tick.max(next) } else { next };
                (self.paused, self.until_tick) = (true, from.saturating_add(ticks.max(1)));
                self.until_tick
            }
        };
        self.asked.push((id, answered_at));
    }

    /// Steps that are under way end here.
    fn cut_short(&mut self, next: u64) {
        for (_, answered_at) in &mut self.asked {
            *answered_at = (*answered_at).min(next);
        }
    }

    /// Whether this tick, which is the next one, may open now.
    pub fn opens(&mut self, tick: u64, now_ns: u64) -> Opens {
        if self.paused && tick >= self.until_tick {
            self.since = None;
            return Opens::OnOrder;
        }
        let Rate::Factor(factor) = self.rate else { return Opens::Now };
        let (first, began_ns) = *self.since.get_or_insert((tick, now_ns));
        // To absolute times: what one tick is late does not add up.
        let due_ns = began_ns.saturating_add((tick.saturating_sub(first) as f64 * self.dt_s * 1e9 / factor) as u64);
        if now_ns < due_ns {
            return Opens::At(due_ns);
        }
        if now_ns - due_ns > CATCH_UP_NS {
            self.since = Some((tick, now_ns));
        }
        Opens::Now
    }

    /// The next change that has come about, when `tick` ticks have been done.
    pub fn answered(&mut self, tick: u64) -> Option<PaceId> {
        let index = self.asked.iter().position(|(_, answered_at)| *answered_at <= tick)?;
        Some(self.asked.remove(index).0)
    }

    /// The number of changes that have not been answered.
    pub fn unanswered(&self) -> usize {
        self.asked.len()
    }

    /// The run is over: all steps are.
    pub fn end(&mut self) {
        self.cut_short(0);
    }

    /// The pace, when `tick` ticks have been done.
    pub fn state(&self, tick: u64) -> PaceState {
        let until_tick = Some(self.until_tick).filter(|until| self.paused && *until > tick);
        let time_s = tick as f64 * self.dt_s;
        PaceState { tick, time_s, paused: self.paused, until_tick, rate: self.rate }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    /// Ticks of 20 ms, and numbers of changes from 0 on.
    struct Fleet {
        opener: Opener,
        tick: u64,
        changes: u64,
    }

    impl Fleet {
        fn new() -> Fleet {
            Fleet { opener: Opener::new(0.02), tick: 0, changes: 0 }
        }

        fn change(&mut self, change: PaceChange) -> PaceId {
            let id = PaceId(self.changes);
            self.changes += 1;
            self.opener.change(id, change, self.tick);
            id
        }

        /// Does the ticks that open until then; how many.
        fn run(&mut self, now_ns: u64, most: u64) -> u64 {
            let before = self.tick;
            while self.tick < before + most && self.opener.opens(self.tick, now_ns) == Opens::Now {
                self.tick += 1;
            }
            self.tick - before
        }

        fn answered(&mut self) -> Vec<u64> {
            std::iter::from_fn(|| self.opener.answered(self.tick)).map(|PaceId(id)| id).collect()
        }
    }

    const RESUME: PaceChange = PaceChange::Resume { rate: None };

    fn at(factor: f64) -> PaceChange {
        PaceChange::Resume { rate: Some(Rate::Factor(factor)) }
    }

    #[test]
    fn a_fleet_that_nobody_holds_opens_every_tick() {
        let mut fleet = Fleet::new();
        assert_eq!(fleet.run(0, 1000), 1000);
        assert_eq!(fleet.opener.state(1000), PaceState { tick: 1000, time_s: 20.0, ..PaceState::default() });
    }

    #[test]
    fn a_pause_holds_the_next_tick_and_steps_are_answered_when_they_are_done() {
        let mut fleet = Fleet::new();
        assert_eq!(fleet.run(0, 7), 7);
        fleet.change(PaceChange::Pause);
        assert_eq!(fleet.answered(), [0]);
        assert_eq!((fleet.run(MS, 99), fleet.opener.opens(7, MS)), (0, Opens::OnOrder));
        fleet.change(PaceChange::Step { ticks: 3 });
        assert_eq!(fleet.opener.state(7).until_tick, Some(10));
        assert_eq!((fleet.answered(), fleet.run(MS, 2)), (vec![], 2));
        // What is asked for on the way comes after it.
        fleet.change(PaceChange::Step { ticks: 5 });
        assert_eq!((fleet.run(MS, 1), fleet.answered()), (1, vec![1]));
        assert_eq!((fleet.run(MS, 99), fleet.answered()), (5, vec![2]));
        assert_eq!(fleet.opener.state(15), PaceState { tick: 15, time_s: 0.3, paused: true, ..PaceState::default() });
        fleet.change(RESUME);
        assert_eq!((fleet.answered(), fleet.run(MS, 99)), (vec![3], 99));
        // A fleet that runs does them, and stops.
        fleet.change(PaceChange::Step { ticks: 0 });
        assert_eq!((fleet.run(MS, 99), fleet.answered()), (1, vec![4]));
    }

    #[test]
    fn whoever_waits_for_steps_is_answered_when_they_are_cut_short() {
        for cut in [PaceChange::Pause, RESUME] {
            let mut fleet = Fleet::new();
            fleet.change(PaceChange::Step { ticks: u64::MAX });
            assert_eq!((fleet.run(0, 5), fleet.answered()), (5, vec![]));
            fleet.change(cut);
            assert_eq!(fleet.answered(), [0, 1]);
            assert_eq!(fleet.run(0, 9), if cut == RESUME { 9 } else { 0 });
        }
        let mut fleet = Fleet::new();
        fleet.change(PaceChange::Step { ticks: 9 });
        assert_eq!(fleet.run(0, 5), 5);
        fleet.opener.end();
        assert_eq!(fleet.answered(), [0]);
    }

    /// The tick that is open is done before a pause has come about.
    #[test]
    fn a_pause_waits_for_the_open_tick() {
        let mut fleet = Fleet::new();
        fleet.opener.change(PaceId(0), PaceChange::Pause, 1);
        assert!(fleet.answered().is_empty());
        fleet.tick = 1;
        assert_eq!((fleet.answered(), fleet.run(0, 9)), (vec![0], 0));
    }

    #[test]
    fn a_rate_keeps_to_absolute_times_and_does_not_make_up_for_a_gap() {
        let mut fleet = Fleet::new();
        fleet.change(at(2.0));
        assert_eq!(fleet.run(MS, 99), 1, "the first one at once, and then one in 10 ms");
        assert_eq!(fleet.opener.opens(1, 2 * MS), Opens::At(11 * MS));
        assert_eq!((fleet.run(11 * MS - 1, 99), fleet.run(14 * MS, 99)), (0, 1));
        assert_eq!(fleet.opener.opens(2, 14 * MS), Opens::At(21 * MS), "lateness does not add up");
        assert_eq!(fleet.run(101 * MS, 99), 9, "what is late is caught up");
        assert_eq!(fleet.run(1_101 * MS, 99), 1, "but not a second");
        assert_eq!(fleet.opener.opens(12, 1_101 * MS), Opens::At(1_111 * MS));
        // Another one counts from now on, and so does the same one after a pause.
        fleet.change(at(0.5));
        assert_eq!((fleet.run(1_102 * MS, 99), fleet.opener.opens(13, 1_102 * MS)), (1, Opens::At(1_142 * MS)));
        fleet.change(PaceChange::Pause);
        assert_eq!(fleet.run(9_000 * MS, 99), 0);
        fleet.change(PaceChange::Step { ticks: 2 });
        assert_eq!((fleet.run(9_001 * MS, 99), fleet.run(9_041 * MS, 99)), (1, 1));
        fleet.change(RESUME);
        assert_eq!((fleet.run(9_050 * MS, 99), fleet.opener.state(0).rate), (1, Rate::Factor(0.5)));
        fleet.change(PaceChange::Resume { rate: Some(Rate::Max) });
        assert_eq!(fleet.run(9_050 * MS, 99), 99);
    }
}
