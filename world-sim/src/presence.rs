//! Who takes part: the life of one slot.
//!
//! ```text
//!                 Join/Admit            ready                Leave, Remove (from anywhere)
//!        Vacant ------------> Awaited ---------> Present ------------------> Left
//!                                                |  ^  |
//!                            Kill, died: Dead <--'  |  '--> Paused (timeline), Held (straggler)
//!                            (restart left: next    |         |
//!                            incarnation, later) ---'<--------'       policy drop: Dropped
//! ```
//! Every transition happens inside `World::open`, so that a robot is absent or present for whole ticks. A process
//! that ends before its robot ever entered leaves no body: such a slot is awaited again, or dead without having been
//! in the world.

use crate::journal::Journal;
use model::{Restart, Seat, StragglerPolicy};
use protocol::daemon_to_world::Absence;
use protocol::world_to_daemon::Notice;

/// Where a slot is in its life. Ticks are the first of the state that they lead to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// There is no robot in this slot.
    Vacant,
    /// Not in the world yet.
    Awaited {
        /// It enters at this tick, or later when it is ready.
        at: u64,
    },
    /// Plans and answers.
    Present {
        /// Since this tick.
        since: u64,
    },
    /// Stopped by the timeline.
    Paused {
        /// It takes part again at this tick.
        until: u64,
    },
    /// Does not answer.
    Held {
        /// It answers again, and enters at the next opening.
        answers: bool,
    },
    /// Its process has ended.
    Dead {
        /// A restart brings it back at this tick.
        returns: Option<u64>,
    },
    /// Did not answer and was killed for it.
    Dropped,
    /// Gone, body and all.
    Left,
}

/// The life of one slot.
#[derive(Clone, Debug)]
pub(crate) struct Presence {
    slot: u32,
    pub(crate) state: State,
    /// The life that is in the world, or the next one.
    pub(crate) incarnation: u32,
    /// The tick at which the robot first entered the world.
    pub(crate) joined: Option<u64>,
    restart: Restart,
    restarts: u32,
    /// The daemon knows of the entry that this state waits for.
    told: bool,
}

impl Presence {
    /// A slot without a robot.
    pub(crate) fn vacant(slot: usize) -> Presence {
        Presence {
            slot: slot as u32,
            state: State::Vacant,
            incarnation: 0,
            joined: None,
            restart: Restart { limit: 0, delay_ticks: 0 },
            restarts: 0,
            told: false,
        }
    }

    /// A slot whose robot enters at `at`.
    pub(crate) fn awaited(slot: usize, at: u64, restart: Restart) -> Presence {
        Presence { state: State::Awaited { at }, restart, ..Presence::vacant(slot) }
    }

    pub(crate) fn seat(&self) -> Seat {
        Seat { slot: self.slot, incarnation: self.incarnation }
    }

    /// Whether its body is in the world.
    pub(crate) fn in_world(&self) -> bool {
        self.joined.is_some() && self.state != State::Left
    }

    pub(crate) fn takes_part(&self) -> bool {
        matches!(self.state, State::Present { .. })
    }

    /// Whether others hear it at `tick`: a newcomer is visible to sensors first and audible one tick later, when it
    /// has spoken.
    pub(crate) fn on_radio(&self, tick: u64) -> bool {
        matches!(self.state, State::Present { since } if since < tick)
    }

    /// Why it will never take part again, if so.
    pub(crate) fn gone(&self) -> Option<&'static str> {
        match self.state {
            State::Left => Some("left"),
            State::Dropped => Some("dropped"),
            State::Dead { returns: None } => Some("dead"),
            _ => None,
        }
    }

    /// The tick at which the state that it is in ends by itself, if it does.
    pub(crate) fn entry(&self) -> Option<u64> {
        match self.state {
            State::Awaited { at } => Some(at),
            State::Paused { until } => Some(until),
            State::Dead { returns } => returns,
            _ => None,
        }
    }

    /// Whether it must be ready before `tick` can open.
    pub(crate) fn due(&self, tick: u64) -> bool {
        self.entry().is_some_and(|at| at <= tick)
    }

    /// Tells the daemon ahead of time that a process will be needed, and on time that one may go on.
    pub(crate) fn announce(&mut self, tick: u64, ahead_ticks: u64, journal: &mut Journal) {
        let Some(at) = self.entry().filter(|_| !self.told) else { return };
        let seat = self.seat();
        if matches!(self.state, State::Paused { .. }) {
            if at <= tick {
                self.told = true;
                journal.tell(Notice::Resume { seat });
            }
        } else if at <= tick.saturating_add(ahead_ticks) {
            self.told = true;
            journal.tell(Notice::Expect { seat, tick: at });
        }
    }

    /// Takes part from `tick` on. True if its body is new to the world.
    pub(crate) fn enter(&mut self, tick: u64, journal: &mut Journal) -> bool {
        let kind = match self.state {
            State::Awaited { .. } => "joined",
            State::Dead { .. } => "restarted",
            _ => "resumed",
        };
        let detail = match self.state {
            State::Held { .. } => "answers again".to_owned(),
            _ if self.incarnation > 0 => format!("incarnation {}", self.incarnation),
            _ => String::new(),
        };
        self.state = State::Present { since: tick };
        self.told = false;
        journal.tell(Notice::Entered { seat: self.seat(), tick });
        journal.note(tick, kind, self.slot, detail);
        let new = self.joined.is_none();
        self.joined.get_or_insert(tick);
        new
    }

    /// The timeline kills its process.
    pub(crate) fn kill(&mut self, tick: u64, journal: &mut Journal) {
        if !self.has_process() {
            return self.ignore(tick, "kill", journal);
        }
        journal.tell(Notice::Kill { seat: self.seat() });
        journal.note(tick, "killed", self.slot, "timeline".to_owned());
        self.die(tick);
    }

    /// The timeline stops its process for some ticks.
    pub(crate) fn pause(&mut self, tick: u64, ticks: u64, journal: &mut Journal) {
        let until = tick.saturating_add(ticks.max(1));
        match self.state {
            State::Present { .. } => {}
            // Its resume may be on its way already; the pause that follows it wins.
            State::Paused { until: before } if before < until => {}
            _ => return self.ignore(tick, "pause", journal),
        }
        self.state = State::Paused { until };
        self.told = false;
        journal.tell(Notice::Pause { seat: self.seat() });
        journal.note(tick, "paused", self.slot, format!("until tick {until}"));
    }

    /// It goes, and is gone.
    pub(crate) fn leave(&mut self, tick: u64, journal: &mut Journal) {
        if matches!(self.state, State::Vacant | State::Left) {
            return self.ignore(tick, "leave", journal);
        }
        let seat = self.seat();
        if matches!(self.state, State::Paused { .. }) && !self.told {
            // A stopped process could not see that it has to end.
            journal.tell(Notice::Resume { seat });
        }
        self.state = State::Left;
        journal.tell(Notice::Left { seat });
        journal.note(tick, "left", self.slot, String::new());
    }

    /// The daemon says that the process of this seat does not answer.
    pub(crate) fn absent(
        &mut self,
        seat: Seat,
        cause: Absence,
        policy: StragglerPolicy,
        tick: u64,
        journal: &mut Journal,
    ) {
        if seat != self.seat() || !self.has_process() {
            return; // An older life, or one that has ended already.
        }
        let waiting_to_enter = matches!(self.state, State::Awaited { .. } | State::Dead { .. });
        match cause {
            Absence::Died { signal, code, words } => {
                let ending = match (signal, code) {
                    (Some(signal), _) => format!("signal {signal}"),
                    (None, Some(code)) => format!("exit code {code}"),
                    (None, None) => String::new(),
                };
                let parts = [ending, words].into_iter().filter(|part| !part.is_empty());
                journal.note(tick, "died", self.slot, parts.collect::<Vec<_>>().join(": "));
                self.die(tick);
            }
            Absence::NotStarted { why } if waiting_to_enter => self.not_started(why, tick, journal),
            Absence::Overdue if waiting_to_enter => self.not_started("not ready in time".to_owned(), tick, journal),
            Absence::Deaf { why } => {
                journal.tell(Notice::Kill { seat });
                journal.note(tick, "deaf", self.slot, why);
                self.die(tick);
            }
            Absence::Overdue if self.takes_part() || self.due(tick) => {
                self.straggle("overdue", policy, tick, journal);
            }
            // A stop that the timeline asked for is no news, even when it is reported late.
            Absence::Stopped if self.takes_part() => self.straggle("stopped", policy, tick, journal),
            // The daemon had not heard yet that it has entered.
            Absence::NotStarted { why } => {
                journal.note(tick, "died", self.slot, why);
                self.die(tick);
            }
            Absence::Overdue | Absence::Stopped => {}
        }
    }

    /// A held robot answers again.
    pub(crate) fn back(&mut self, seat: Seat) {
        if seat == self.seat()
            && let State::Held { answers } = &mut self.state
        {
            *answers = true;
        }
    }

    fn not_started(&mut self, why: String, tick: u64, journal: &mut Journal) {
        // It may still come up, too late: its place is given to the next life, or to nobody.
        journal.tell(Notice::Kill { seat: self.seat() });
        journal.note(tick, "not-started", self.slot, why);
        self.die(tick);
    }

    fn straggle(&mut self, why: &str, policy: StragglerPolicy, tick: u64, journal: &mut Journal) {
        match policy {
            StragglerPolicy::Wait | StragglerPolicy::Hold => {
                self.state = State::Held { answers: false };
                journal.note(tick, "held", self.slot, why.to_owned());
            }
            StragglerPolicy::Drop => {
                self.state = State::Dropped;
                journal.tell(Notice::Kill { seat: self.seat() });
                journal.note(tick, "dropped", self.slot, why.to_owned());
            }
        }
    }

    fn die(&mut self, tick: u64) {
        let before = self.entry().filter(|_| self.joined.is_none());
        if self.restarts >= self.restart.limit {
            self.state = State::Dead { returns: None };
            return;
        }
        self.restarts += 1;
        self.incarnation += 1;
        self.told = false;
        let at = tick.saturating_add(self.restart.delay_ticks.max(1));
        self.state = match self.joined {
            Some(_) => State::Dead { returns: Some(at) },
            None => State::Awaited { at: at.max(before.unwrap_or(0)) },
        };
    }

    /// Whether the present life has a process, or one on its way.
    pub(crate) fn has_process(&self) -> bool {
        match self.state {
            State::Present { .. } | State::Paused { .. } | State::Held { .. } => true,
            State::Awaited { .. } | State::Dead { returns: Some(_) } => self.told,
            State::Vacant | State::Dead { returns: None } | State::Dropped | State::Left => false,
        }
    }

    fn ignore(&self, tick: u64, what: &str, journal: &mut Journal) {
        journal.note(tick, "ignored", self.slot, format!("{what}: the robot is {:?}", self.state));
    }
}
