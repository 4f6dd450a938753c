//! Who takes part: the life of one slot.
//!
//! ```text
//!                 Join/Admit            ready                Leave, Remove (from anywhere)
//!        Vacant ------------> Awaited ---------> Present ------------------> Left (Admit: Awaited, the next life)
//!                                                |  ^  |
//!                            Kill, died: Dead <--'  |  '--> Paused (on purpose), Held (straggler)
//!                            (restart left: next    |         |
//!                            incarnation, later) ---'<--------'       policy drop: Dropped
//! ```
//! Every transition happens inside `World::open`, so that a robot is absent or present for whole ticks. A process
//! that ends before its robot ever entered leaves no body: such a slot is awaited again, or dead without having been
//! in the world.

use crate::journal::Journal;
use crate::restarts::{End, Restarts, Verdict};
use model::{EventKind, FaultSource, Gone, Restart, RobotIndex, RobotInstance, Silence, StragglerPolicy};
use protocol::daemon_to_world::Absence;
use protocol::world_to_daemon::{Notice, Standing};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Where a robot is in its life. Ticks are the first of the state that they lead to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum State {
    /// No robot has this index.
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
    /// Stopped on purpose.
    Paused {
        /// It takes part again at this tick; `None`: when it is resumed.
        until: Option<u64>,
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

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            State::Vacant => write!(f, "unknown"),
            State::Awaited { .. } => write!(f, "not in the world yet"),
            State::Present { .. } => write!(f, "in the world"),
            State::Paused { until: Some(until) } => write!(f, "paused until tick {until}"),
            State::Paused { until: None } => write!(f, "paused"),
            State::Held { .. } => write!(f, "held"),
            State::Dead { returns: Some(at) } => write!(f, "dead until tick {at}"),
            State::Dead { returns: None } => write!(f, "dead"),
            State::Dropped => write!(f, "dropped"),
            State::Left => write!(f, "gone: it left"),
        }
    }
}

/// The life of one robot.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Presence {
    index: RobotIndex,
    pub(crate) state: State,
    /// The life that is in the world, or the next one.
    pub(crate) incarnation: u32,
    /// The tick at which the robot first entered the world.
    pub(crate) joined: Option<u64>,
    restarts: Restarts,
    /// The daemon knows of the entry that this state waits for.
    told: bool,
}

impl Presence {
    /// A slot without a robot.
    pub(crate) fn vacant(slot: usize) -> Presence {
        Presence {
            index: RobotIndex::of(slot),
            state: State::Vacant,
            incarnation: 0,
            joined: None,
            restarts: Restarts::new(Restart::NEVER),
            told: false,
        }
    }

    /// A slot whose robot enters at `at`, with this as its first life.
    pub(crate) fn awaited(instance: RobotInstance, at: u64, restart: Restart) -> Presence {
        let RobotInstance { index, incarnation } = instance;
        let (state, restarts) = (State::Awaited { at }, Restarts::new(restart));
        Presence { state, restarts, incarnation, ..Presence::vacant(index.at()) }
    }

    /// Whether another robot may take the slot with this as its first life: no life is lived twice.
    pub(crate) fn is_free_for(&self, incarnation: u32) -> bool {
        match self.state {
            State::Vacant => true,
            State::Left => incarnation > self.incarnation,
            _ => false,
        }
    }

    pub(crate) fn instance(&self) -> RobotInstance {
        RobotInstance { index: self.index, incarnation: self.incarnation }
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

    /// Whether there is no robot to do anything to: none yet, or none any more.
    pub(crate) fn is_gone(&self) -> bool {
        self.state == State::Vacant || self.gone().is_some()
    }

    /// Why it will never take part again, if so.
    pub(crate) fn gone(&self) -> Option<Gone> {
        match self.state {
            State::Left => Some(Gone::Left),
            State::Dropped => Some(Gone::Dropped),
            State::Dead { returns: None } => Some(Gone::Dead),
            _ => None,
        }
    }

    /// The tick at which the state that it is in ends by itself, if it does.
    pub(crate) fn entry(&self) -> Option<u64> {
        match self.state {
            State::Awaited { at } => Some(at),
            State::Paused { until } => until,
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
        let instance = self.instance();
        if matches!(self.state, State::Paused { .. }) {
            if at <= tick {
                self.told = true;
                journal.tell(Notice::Resume { instance });
            }
        } else if at <= tick.saturating_add(ahead_ticks) {
            self.told = true;
            journal.tell(Notice::Expect { instance, tick: at });
        }
    }

    /// Takes part from `tick` on. True if its body is new to the world.
    pub(crate) fn enter(&mut self, tick: u64, journal: &mut Journal) -> bool {
        let incarnation = self.incarnation;
        let kind = match self.state {
            State::Awaited { .. } => EventKind::Joined { incarnation },
            State::Dead { .. } => EventKind::Restarted { incarnation },
            _ => EventKind::Resumed { incarnation, held: matches!(self.state, State::Held { .. }) },
        };
        self.state = State::Present { since: tick };
        self.told = false;
        journal.tell(Notice::Entered { instance: self.instance(), tick });
        journal.note(tick, self.index, kind);
        let new = self.joined.is_none();
        self.joined.get_or_insert(tick);
        new
    }

    /// Its process is killed on purpose, if it has one.
    pub(crate) fn kill(&mut self, tick: u64, source: FaultSource, journal: &mut Journal) -> Result<(), String> {
        if !self.has_process() {
            return Err(self.in_words());
        }
        journal.tell(Notice::Kill { instance: self.instance() });
        journal.note(tick, self.index, EventKind::Killed { source });
        self.die(End::Failed, tick, journal);
        Ok(())
    }

    /// A new life takes its place, whatever has become of it. Its policy does not count this as a restart.
    pub(crate) fn restart(&mut self, tick: u64, journal: &mut Journal) -> Result<(), String> {
        let waits = matches!(self.state, State::Awaited { .. } | State::Dead { returns: Some(_) });
        if self.is_absent() || self.joined.is_none() && waits && !self.told {
            return Err(self.in_words());
        }
        if self.has_process() {
            journal.tell(Notice::Kill { instance: self.instance() });
        }
        // A life that nobody has been asked for yet is the next one.
        self.incarnation += u32::from(!waits || self.told);
        self.told = false;
        let (at, before) = (tick.saturating_add(1), self.entry().unwrap_or(0));
        self.state = match self.joined {
            Some(_) => State::Dead { returns: Some(at) },
            None => State::Awaited { at: at.max(before) },
        };
        journal.note(tick, self.index, EventKind::Replaced { incarnation: self.incarnation });
        Ok(())
    }

    /// Whether the slot has no robot: none yet, or one that has left.
    fn is_absent(&self) -> bool {
        matches!(self.state, State::Vacant | State::Left)
    }

    /// Its process is stopped on purpose, until a tick or until it is resumed.
    pub(crate) fn pause(
        &mut self,
        tick: u64,
        until: Option<u64>,
        source: FaultSource,
        journal: &mut Journal,
    ) -> Result<(), String> {
        let is_later = |before: Option<u64>| before.is_some_and(|before| until.is_none_or(|until| before < until));
        match self.state {
            State::Present { .. } => {}
            // Its resume may be on its way already; the pause that follows it wins.
            State::Paused { until: before } if is_later(before) => {}
            _ => return Err(self.in_words()),
        }
        self.state = State::Paused { until };
        self.told = false;
        journal.tell(Notice::Pause { instance: self.instance() });
        journal.note(tick, self.index, EventKind::Paused { source, until_tick: until });
        Ok(())
    }

    /// It goes on at the next tick, if it is paused; whether it is.
    pub(crate) fn resume(&mut self, tick: u64) -> bool {
        let State::Paused { until } = &mut self.state else { return false };
        let at = tick.saturating_add(1);
        *until = Some(until.map_or(at, |until| until.min(at)));
        true
    }

    /// It goes, and is gone.
    pub(crate) fn leave(&mut self, tick: u64, journal: &mut Journal) {
        let instance = self.instance();
        if matches!(self.state, State::Paused { .. }) && !self.told {
            // A stopped process could not see that it has to end.
            journal.tell(Notice::Resume { instance });
        }
        self.state = State::Left;
        journal.tell(Notice::Left { instance });
        journal.note(tick, self.index, EventKind::Left);
    }

    /// The daemon says that the process of this instance does not answer.
    pub(crate) fn absent(
        &mut self,
        instance: RobotInstance,
        cause: Absence,
        policy: StragglerPolicy,
        tick: u64,
        journal: &mut Journal,
    ) {
        if instance != self.instance() || !self.has_process() {
            return; // An older life, or one that has ended already.
        }
        let waiting_to_enter = matches!(self.state, State::Awaited { .. } | State::Dead { .. });
        match cause {
            Absence::Died { signal, code, words } => {
                let end = if code == Some(0) { End::Clean } else { End::Failed };
                journal.note(tick, self.index, EventKind::Died { signal, code, words });
                self.die(end, tick, journal);
            }
            Absence::NotStarted { why } if waiting_to_enter => self.not_started(why, tick, journal),
            Absence::Overdue if waiting_to_enter => self.not_started("not ready in time".to_owned(), tick, journal),
            Absence::Deaf { why } => {
                journal.tell(Notice::Kill { instance });
                journal.note(tick, self.index, EventKind::Deaf { why });
                self.die(End::Failed, tick, journal);
            }
            Absence::Overdue if self.takes_part() || self.due(tick) => {
                self.straggle(Silence::Overdue, policy, tick, journal);
            }
            // A stop that the timeline asked for is no news, even when it is reported late.
            Absence::Stopped if self.takes_part() => self.straggle(Silence::Stopped, policy, tick, journal),
            // The daemon had not heard yet that it has entered.
            Absence::NotStarted { why } => {
                journal.note(tick, self.index, EventKind::Died { signal: None, code: None, words: why });
                self.die(End::Failed, tick, journal);
            }
            Absence::Overdue | Absence::Stopped => {}
        }
    }

    /// A held robot answers again.
    pub(crate) fn back(&mut self, instance: RobotInstance) {
        if instance == self.instance()
            && let State::Held { answers } = &mut self.state
        {
            *answers = true;
        }
    }

    fn not_started(&mut self, why: String, tick: u64, journal: &mut Journal) {
        // It may still come up, too late: its place is given to the next life, or to nobody.
        journal.tell(Notice::Kill { instance: self.instance() });
        journal.note(tick, self.index, EventKind::NotStarted { why });
        self.die(End::Failed, tick, journal);
    }

    fn straggle(&mut self, silence: Silence, policy: StragglerPolicy, tick: u64, journal: &mut Journal) {
        match policy {
            StragglerPolicy::Wait | StragglerPolicy::Hold => {
                self.state = State::Held { answers: false };
                journal.note(tick, self.index, EventKind::Held { silence });
            }
            StragglerPolicy::Drop => {
                self.state = State::Dropped;
                journal.tell(Notice::Kill { instance: self.instance() });
                journal.note(tick, self.index, EventKind::Dropped { silence });
            }
        }
    }

    fn die(&mut self, end: End, tick: u64, journal: &mut Journal) {
        let before = self.entry().filter(|_| self.joined.is_none());
        let delay = match self.restarts.after(end, tick) {
            Verdict::Again(delay) => delay,
            verdict => {
                self.state = State::Dead { returns: None };
                if verdict == Verdict::LimitReached {
                    self.give_up(tick, journal);
                }
                return;
            }
        };
        self.incarnation += 1;
        self.told = false;
        let at = tick.saturating_add(delay);
        self.state = match self.joined {
            Some(_) => State::Dead { returns: Some(at) },
            None => State::Awaited { at: at.max(before.unwrap_or(0)) },
        };
    }

    /// What a daemon has to know that is new; `None` for a slot without a robot.
    pub(crate) fn standing(&self) -> Option<Standing> {
        Some(match self.state {
            State::Vacant => return None,
            State::Awaited { .. } | State::Dead { returns: Some(_) } => Standing::Awaited { told: self.told },
            State::Present { .. } => Standing::Present,
            State::Paused { .. } => Standing::Paused { goes_on: self.told },
            State::Held { .. } => Standing::Held,
            State::Dead { returns: None } if self.restarts.limit_is_reached() => Standing::RestartLimit,
            State::Dead { returns: None } | State::Dropped => Standing::Dead,
            State::Left => Standing::Left,
        })
    }

    /// It is not started again, although its policy wants that.
    fn give_up(&mut self, tick: u64, journal: &mut Journal) {
        let (restarts, window_ticks) = (self.restarts.recent(), self.restarts.policy().window_ticks);
        journal.tell(Notice::RestartLimit { instance: self.instance() });
        journal.note(tick, self.index, EventKind::RestartLimit { restarts, window_ticks });
    }

    /// Whether the present life has a process, or one on its way.
    pub(crate) fn has_process(&self) -> bool {
        match self.state {
            State::Present { .. } | State::Paused { .. } | State::Held { .. } => true,
            State::Awaited { .. } | State::Dead { returns: Some(_) } => self.told,
            State::Vacant | State::Dead { returns: None } | State::Dropped | State::Left => false,
        }
    }

    pub(crate) fn in_words(&self) -> String {
        format!("the robot is {}", self.state)
    }
}
