//! The pace of a fleet in `lockstep`: operators hold its ticks, let them go on, and have some of them done.

use super::operators::{Owed, Refusal, Waiting, refused};
use super::{Action, Coordinator};
use model::{Mode, PaceChange, PaceState, Rate};
use protocol::daemon_to_world::{Order, PaceId, Ticket};

/// The pace, as far as the world has told it.
#[derive(Default)]
pub(super) struct Pace {
    pub(super) state: PaceState,
    next: PaceId,
}

impl Pace {
    /// The pace of a fleet that this daemon takes over. No two daemons of a fleet may have the same `era`.
    pub(super) fn adopted(era: u32) -> Pace {
        Pace { next: PaceId(u64::from(era) << 32), ..Pace::default() }
    }

    /// Whether no tick opens any more, until an operator lets one.
    pub(super) fn holds(&self) -> bool {
        self.state.paused && self.state.until_tick.is_none()
    }
}

impl Coordinator {
    /// A fleet begins at this pace: to be said before the world's process is started.
    pub fn begin_at(&mut self, paused: bool, rate: Rate) {
        if rate != Rate::Max {
            self.order_pace(PaceChange::Resume { rate: Some(rate) });
        }
        if paused {
            self.order_pace(PaceChange::Pause);
        }
    }

    /// An operator wants another pace.
    pub(super) fn change_pace(&mut self, change: PaceChange) -> Result<Waiting, Refusal> {
        if self.scenario.clock.mode == Mode::Realtime {
            let hint = "`shoal run` and `shoal up` with `--mode lockstep` start a fleet that can be paused; `shoal inject \
                        pause ROBOT` stops one robot of this one";
            return Err(refused("in `realtime` every robot has its own timer: there are no ticks to hold", Some(hint)));
        }
        let problem = match change {
            PaceChange::Resume { rate: Some(rate) } => rate.problem(),
            PaceChange::Step { ticks: 0 } => Some("0 ticks are no step".to_owned()),
            _ => None,
        };
        if let Some(problem) = problem {
            return Err(refused(&problem, Some("`shoal resume --help` and `shoal step --help` show examples")));
        }
        let ticket = Ticket::Pace(self.order_pace(change));
        Ok(Waiting::new(ticket, String::new(), Owed::Pace))
    }

    fn order_pace(&mut self, change: PaceChange) -> PaceId {
        let id = self.pace.next;
        self.pace.next = PaceId(id.0 + 1);
        self.actions.push(Action::Order(Order::Pace { id, change }));
        id
    }

    /// The world keeps another pace. Of steps nothing is said.
    pub(super) fn pace(&mut self, state: PaceState) {
        let before = std::mem::replace(&mut self.pace.state, state);
        let tick = state.tick;
        let rate = state
            .rate
            .factor()
            .map_or_else(|| "as fast as the processes can".to_owned(), |factor| format!("at {factor} times real time"));
        match (before.paused, state.paused) {
            (false, true) => {
                let at = state.until_tick.unwrap_or(tick);
                self.say(format!("the fleet pauses at tick {at}: `shoal step` and `shoal resume` let it go on"));
            }
            (true, false) => self.say(format!("the fleet goes on from tick {tick}, {rate}")),
            _ if before.rate != state.rate => self.say(format!("from tick {tick} on the fleet goes {rate}")),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{ALL_READY, FREE_PLACE, answer, pass, refusal, replies, running};
    use super::super::{Answer, CONFIRM_WITHIN};
    use super::*;
    use protocol::operator_to_daemon::{NewRobot, Request};
    use protocol::world_to_daemon::Notice;

    fn ask(coordinator: &mut Coordinator, change: PaceChange) -> Answer {
        coordinator.request(&Request::Pace(change), FREE_PLACE)
    }

    fn tell(coordinator: &mut Coordinator, tick: u64, until_tick: Option<u64>) {
        coordinator.notice(Notice::Pace(PaceState { tick, paused: true, until_tick, ..PaceState::default() }));
    }

    #[test]
    fn steps_are_answered_when_they_are_done_or_have_taken_long() {
        let mut coordinator = running(&[]);
        let late_s = 1 + CONFIRM_WITHIN.as_secs();
        let [first, second] = [0, 1].map(|id| Ticket::Pace(PaceId(id)));
        assert_eq!(ask(&mut coordinator, PaceChange::Step { ticks: 5 }), Answer::Later(first));
        let ordered = Order::Pace { id: PaceId(0), change: PaceChange::Step { ticks: 5 } };
        assert_eq!(coordinator.take_actions(), [Action::Order(ordered)]);
        tell(&mut coordinator, 7, Some(12));
        assert_eq!(replies(&mut coordinator), []);
        tell(&mut coordinator, 12, None);
        answer(&mut coordinator, first, None);
        assert_eq!(replies(&mut coordinator), [(first, "tick 12, until None".to_owned())]);

        assert_eq!(ask(&mut coordinator, PaceChange::Step { ticks: 500 }), Answer::Later(second));
        tell(&mut coordinator, 12, Some(512));
        pass(&mut coordinator, 20..=20 + late_s, ALL_READY);
        assert_eq!(replies(&mut coordinator), [(second, "tick 12, until Some(512)".to_owned())]);
        answer(&mut coordinator, second, None);
        assert_eq!(replies(&mut coordinator), [], "once");
        // A world that says nothing.
        tell(&mut coordinator, 512, None);
        let Answer::Later(third) = ask(&mut coordinator, PaceChange::Pause) else { panic!("the world is asked") };
        pass(&mut coordinator, 30..=30 + late_s, ALL_READY);
        let told = replies(&mut coordinator);
        assert!(told[0].0 == third && told[0].1.contains("pace of the fleet: not confirmed"), "{told:?}");
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let mut coordinator = running(&[]);
        let zero = PaceChange::Step { ticks: 0 };
        assert!(refusal(ask(&mut coordinator, zero)).contains("0 ticks"));
        for factor in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let resume = PaceChange::Resume { rate: Some(Rate::Factor(factor)) };
            assert!(refusal(ask(&mut coordinator, resume)).contains("rate"), "{factor}");
        }
        let mut coordinator = running(&["clock.mode=\"realtime\""]);
        assert!(refusal(ask(&mut coordinator, PaceChange::Pause)).contains("its own timer"));
        assert_eq!(coordinator.take_actions(), []);
    }

    /// Nobody waits for a robot that joins when the fleet goes on.
    #[test]
    fn a_robot_that_is_added_to_a_paused_fleet_is_not_waited_for() {
        let mut coordinator = running(&["fleet.max_robots=3"]);
        tell(&mut coordinator, 7, None);
        let (start_m, goal_m) = ([0.0, -2.0], [1.0, -2.0]);
        let new = NewRobot { id: Some("new".to_owned()), start_m, goal_m, ..NewRobot::default() };
        let Answer::Later(ticket) = coordinator.request(&Request::Add(new), FREE_PLACE) else { panic!("it has room") };
        answer(&mut coordinator, ticket, None);
        pass(&mut coordinator, 1..=1, ALL_READY);
        let told = replies(&mut coordinator);
        assert!(told[0].0 == ticket && told[0].1.contains("the fleet is paused at tick 7"), "{told:?}");
    }

    #[test]
    fn a_change_is_said_once() {
        let mut coordinator = running(&[]);
        let said = |coordinator: &mut Coordinator| -> Vec<String> {
            let said = |action| if let Action::Say(line) = action { Some(line) } else { None };
            coordinator.take_actions().into_iter().filter_map(said).collect()
        };
        tell(&mut coordinator, 7, Some(8));
        assert!(said(&mut coordinator)[0].starts_with("the fleet pauses at tick 8"));
        tell(&mut coordinator, 8, None);
        assert_eq!(said(&mut coordinator), [""; 0]);
        let rate = Rate::Factor(0.5);
        coordinator.notice(Notice::Pace(PaceState { tick: 8, rate, ..PaceState::default() }));
        assert_eq!(said(&mut coordinator), ["the fleet goes on from tick 8, at 0.5 times real time"]);
    }
}
