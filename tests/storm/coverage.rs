//! What happened in storms: a storm in which nothing happens proves nothing.

use model::{Event, EventKind, TaskEnd};
use std::fmt;

macro_rules! coverage {
    ($($(#[$what:meta])* $name:ident: $text:literal,)*) => {
        /// How often each thing happened.
        #[derive(Clone, Debug, Default, PartialEq, Eq)]
        pub(crate) struct Coverage {
            $($(#[$what])* pub(crate) $name: u64,)*
        }

        impl Coverage {
            pub(crate) fn add(&mut self, other: &Coverage) {
                $(self.$name += other.$name;)*
            }

            /// What never happened.
            pub(crate) fn missing(&self) -> Vec<&'static str> {
                let all = [$(($text, self.$name)),*];
                all.into_iter().filter(|(_, times)| *times == 0).map(|(text, _)| text).collect()
            }
        }

        impl fmt::Display for Coverage {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                $(writeln!(f, "{:>12}  {}", self.$name, $text)?;)*
                Ok(())
            }
        }
    };
}

coverage! {
    ticks: "ticks",
    turns: "turns of processes",
    spawns: "processes started",
    restarts: "of those, restarts",
    restart_limits: "robots that died at their restart limit",
    not_spawned: "processes that could not be started",
    failed_starts: "processes that fail, hang, or are deaf",
    late_starts: "processes that start late",
    deaths: "deaths: killed or crashed",
    slow_deaths: "killed processes that did not end immediately",
    stops: "stops (SIGSTOP)",
    resumes: "resumes (SIGCONT)",
    timeline_kills: "kills of the timeline",
    timeline_pauses: "pauses of the timeline",
    faults_asked: "faults asked for",
    faults_acknowledged: "faults acknowledged",
    faults: "faults that began",
    faults_over: "faults that ended",
    paces_asked: "paces asked for",
    paces_acknowledged: "paces acknowledged",
    holds: "paces: turns of the world in which it held a tick",
    joins: "robots that joined late",
    leaves: "robots that left",
    overdue: "robots that were overdue in `lockstep`",
    held: "robots that were held",
    dropped: "robots that were dropped",
    back: "robots that came back by answering again",
    gaps: "gaps of a `realtime` world",
    daemon_stops: "stops of the daemon",
    world_stops: "stops of the world",
    daemon_deaths: "successions: deaths of the daemon",
    world_deaths: "successions: deaths of the world",
    orders_full: "orders that found the ring full",
    notices_full: "notices that found the ring full",
    notices_left_out: "entries of the log that were left out for that",
    notices_lost: "other notices that were lost at the end of a run for that",
    tasks_asked: "tasks asked for",
    robots_asked: "robots asked for",
    names_again: "of those, with the name of one that had left",
    restarts_asked: "restarts asked for",
    restarts_acknowledged: "robots restarted for an operator",
    removals: "removals asked for",
    removals_acknowledged: "robots removed",
    tasks_cancelled: "tasks that an operator cancelled",
    tasks_overdue: "tasks that were dropped at their deadline",
    tasks_orphaned: "tasks whose robot was gone",
    tasks_acknowledged: "tasks acknowledged",
    robots_acknowledged: "robots added",
    refused: "requests refused",
    unconfirmed: "requests left unconfirmed",
    drained: "times that world and coordinator were compared",
    said: "lines for the watcher",
    broken_off: "runs that were broken off",
    replayed: "commands that were computed again from records",
}

impl Coverage {
    /// Takes in what the log of a run says.
    pub(crate) fn count(&mut self, events: &[Event]) {
        for event in events {
            match event.kind {
                EventKind::Joined { .. } => self.joins += u64::from(event.tick > 0),
                EventKind::Restarted { .. } => self.restarts += 1,
                EventKind::Killed { .. } => self.timeline_kills += 1,
                EventKind::Paused { .. } => self.timeline_pauses += 1,
                EventKind::Fault { .. } => self.faults += 1,
                EventKind::FaultOver { .. } => self.faults_over += 1,
                EventKind::Left => self.leaves += 1,
                EventKind::Held { .. } => self.held += 1,
                EventKind::Dropped { .. } => self.dropped += 1,
                EventKind::Resumed { held: true, .. } => self.back += 1,
                EventKind::TaskDropped { why: TaskEnd::Overdue, .. } => self.tasks_overdue += 1,
                EventKind::TaskDropped { why: TaskEnd::RobotGone, .. } => self.tasks_orphaned += 1,
                _ => {}
            }
        }
    }
}
