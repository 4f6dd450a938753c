//! The log of a run, and what the daemon is told while it goes on.

use model::{Event, EventKind, GoalSource, RobotIndex, TaskId, TaskStep};
use protocol::world_to_daemon::Notice;
use std::collections::VecDeque;

/// Entries that the log holds; what comes later is only counted.
pub(crate) const EVENTS_MAX: usize = 10_000;
/// Entries beyond those that the log holds if they spoil the verdict: a log full of contacts must not hide them.
const IMPAIRMENTS_MAX: usize = 1024;
/// The newest tasks at their end that a daemon can be told of again.
const ENDED_MAX: usize = 512;

/// The log and the notices that nobody has taken yet.
#[derive(Default)]
pub(crate) struct Journal {
    pub(crate) events: Vec<Event>,
    pub(crate) events_lost: u64,
    /// The newest tasks of operators that are at their end, and how they ended, the oldest first.
    pub(crate) ended: VecDeque<(TaskId, TaskStep)>,
    notices: Vec<Notice>,
}

impl Journal {
    /// Something for the daemon to act on.
    pub(crate) fn tell(&mut self, notice: Notice) {
        self.notices.push(notice);
    }

    /// An entry of the log that the daemon hears of at once.
    pub(crate) fn note(&mut self, tick: u64, robot: impl Into<Option<RobotIndex>>, kind: EventKind) {
        let event = Event { tick, robot: robot.into(), kind };
        self.tell(Notice::Log(event.clone()));
        self.keep(event);
    }

    /// What became of a task, if it is one that the daemon follows.
    pub(crate) fn task_step(&mut self, source: GoalSource, step: TaskStep) {
        if let GoalSource::Operator(id) = source {
            self.tell(Notice::Task { id, step });
            if step != TaskStep::Active {
                if self.ended.len() == ENDED_MAX {
                    self.ended.pop_front();
                }
                self.ended.push_back((id, step));
            }
        }
    }

    /// An entry of the log that can wait until the end. It is made only if there is room for it: a jam of robots can make
    /// many contacts.
    pub(crate) fn note_quietly(&mut self, tick: u64, robot: RobotIndex, kind: impl FnOnce() -> EventKind) {
        if self.events.len() < EVENTS_MAX {
            self.keep(Event { tick, robot: Some(robot), kind: kind() });
        } else {
            self.events_lost += 1;
        }
    }

    fn keep(&mut self, event: Event) {
        let room = if event.kind.name().impairs() { EVENTS_MAX + IMPAIRMENTS_MAX } else { EVENTS_MAX };
        if self.events.len() < room {
            self.events.push(event);
        } else {
            self.events_lost += 1;
        }
    }

    /// The notices since the last call, in order. Allocates nothing.
    pub(crate) fn take_notices(&mut self) -> Vec<Notice> {
        std::mem::take(&mut self.notices)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_log_is_bounded_and_counts_what_it_drops() {
        let mut journal = Journal::default();
        for tick in 0..EVENTS_MAX as u64 + 5 {
            journal.note_quietly(tick, RobotIndex(0), || EventKind::GaveUp);
        }
        journal.note(0, RobotIndex(0), EventKind::GaveUp);
        assert_eq!((journal.events.len(), journal.events_lost), (EVENTS_MAX, 6));
        assert_eq!(journal.take_notices().len(), 1, "a notice goes out even when the log is full");
        journal.note(0, RobotIndex(0), EventKind::NotStarted { why: "no room".to_owned() });
        assert_eq!(
            (journal.events.len(), journal.take_notices().len()),
            (EVENTS_MAX + 1, 1),
            "what spoils a verdict stays"
        );
        assert!(journal.take_notices().is_empty());
    }
}
