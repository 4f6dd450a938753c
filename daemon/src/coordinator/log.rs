//! The newest entries of the log, for operators who look at the fleet while it runs. The report has them all.

use model::{Event, RobotIndex};
use protocol::operator_to_daemon::EventRecord;
use std::collections::VecDeque;

/// Number of entries that are kept.
const KEPT: usize = 256;

/// The entries that are kept, the oldest first.
#[derive(Debug, Default)]
pub(super) struct Log {
    newest: u64,
    entries: VecDeque<EventRecord>,
}

impl Log {
    /// Adds one; `name` knows the robots.
    pub(super) fn add(&mut self, event: &Event, name: &dyn Fn(RobotIndex) -> String) {
        self.newest += 1;
        if self.entries.len() == KEPT {
            self.entries.pop_front();
        }
        self.entries.push_back(EventRecord {
            number: self.newest,
            event: event.clone(),
            robot: event.robot.map(name),
            detail: event.kind.detail(name),
        });
    }

    /// Those after the one of this number. A number that is not known yet is one of another daemon: then all of them.
    pub(super) fn after(&self, number: u64) -> Vec<EventRecord> {
        let known = if number > self.newest { 0 } else { number };
        self.entries.iter().filter(|entry| entry.number > known).cloned().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::EventKind;

    #[test]
    fn a_reader_gets_what_it_does_not_know_and_no_more_than_is_kept() {
        let mut log = Log::default();
        let numbers = |log: &Log, after| log.after(after).iter().map(|entry| entry.number).collect::<Vec<_>>();
        assert_eq!(numbers(&log, 0), Vec::<u64>::new());
        for tick in 0..300 {
            let kind = EventKind::Joined { incarnation: 2 };
            log.add(&Event { tick, robot: Some(RobotIndex(3)), kind }, &|index| format!("r{index}"));
        }
        assert_eq!(numbers(&log, 298), [299, 300]);
        assert_eq!(numbers(&log, 300), Vec::<u64>::new());
        assert_eq!(numbers(&log, 0).len(), KEPT);
        assert_eq!(numbers(&log, 301).len(), KEPT, "another daemon counts from 1 again");
        let newest = &log.after(299)[0];
        let told = (newest.event.tick, newest.robot.as_deref(), newest.detail.as_str());
        assert_eq!(told, (299, Some("r3"), "incarnation 2"));
    }
}
