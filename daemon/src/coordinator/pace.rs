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
