//! Processes that stand still, and ticks that wait for them: what becomes of such robots, and what is said about it.

use super::{Action, Coordinator, News};
use model::{Mode, ProcessState, RobotInstance, StragglerPolicy};
use protocol::daemon_to_world::{Absence, Order};
use std::time::Duration;

/// A tick of `lockstep` that has been open for a while.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OpenTick {
    /// Which tick.
    pub tick: u64,
    /// When it was opened, monotonic clock.
    pub opened: Duration,
    /// Robots that take part in it and have not answered; at least one.
    pub missing: Vec<RobotInstance>,
    /// The number of the other robots that take part: they wait for the next tick.
    pub others: usize,
}

impl Coordinator {
    /// A process was stopped by a signal. One that is starting is given up at the start limit if it is not ready by then.
    pub fn stopped(&mut self, instance: RobotInstance) {
        let mut unasked = false;
        self.with_current(instance, |member| {
            member.halted = true;
            unasked = member.state == ProcessState::Running;
        });
        if unasked {
            self.stands_still(instance);
        }
    }

    /// A stopped process goes on. The world notices by itself when the robot answers again.
    pub fn continued(&mut self, instance: RobotInstance) {
        let (mut goes_on, mut since) = (false, None);
        self.with_current(instance, |member| {
            member.halted = false;
            goes_on = member.state == ProcessState::Stopped;
            if goes_on {
                member.state = ProcessState::Running;
                since = member.stopped_at.take();
            }
        });
        if goes_on {
            let took = self.looked_at.zip(since).map(|(now, since)| now.saturating_sub(since));
            let after = took.map_or_else(String::new, |took| format!(" after {:.1} s", took.as_secs_f64()));
            let line = format!("robot `{}`: its process goes on{after}", self.name(instance.index));
            self.news_of(News::RobotGoesOn, instance, line);
        }
    }

    /// A robot in the world stands still, and the world did not ask for it.
    pub(super) fn stands_still(&mut self, instance: RobotInstance) {
        let now = self.looked_at;
        self.with_current(instance, |member| {
            member.state = ProcessState::Stopped;
            member.stopped_at = now;
        });
        if self.stopping {
            return;
        }
        let waits = match self.scenario.clock.mode {
            Mode::Realtime => "; no robot waits for it, and its body stands still",
            Mode::Lockstep | Mode::Single => "",
        };
        let name = self.name(instance.index);
        let line = format!("robot `{name}`: its process was stopped by a signal from outside the fleet{waits}");
        self.news_of(News::RobotStopped, instance, line);
        if self.scenario.fleet.straggler != StragglerPolicy::Wait {
            self.actions.push(Action::Order(Order::Absent { instance, cause: Absence::Stopped }));
        }
    }

    /// A tick has been open for too long, or none is: it is said once who waits for whom, and once that it is over.
    pub fn open_tick(&mut self, open: Option<OpenTick>, now: Duration) {
        let is_same = |said: &OpenTick| open.as_ref().is_some_and(|open| open.tick == said.tick);
        if let Some(said) = self.open_tick.take_if(|said| !is_same(said)) {
            let took_s = now.saturating_sub(said.opened).as_secs_f64();
            let names = self.names_of(&said, &|_| String::new());
            let line = format!("tick {} went on after {took_s:.1} s: it waited for {names}", said.tick);
            self.news_of(News::TickGoesOn, said.missing[0], line);
        }
        let Some(open) = open.filter(|open| self.open_tick.is_none() && !open.missing.is_empty() && !self.stopping)
        else {
            return;
        };
        let others = match open.others {
            0 => String::new(),
            1 => ", and 1 other robot waits with it".to_owned(),
            others => format!(", and {others} other robots wait with it"),
        };
        let names = self.names_of(&open, &|state| format!(" ({})", state.word()));
        let line = format!("tick {} waits for {names}{others}", open.tick);
        self.news_of(News::TickWaits, open.missing[0], line);
        self.open_tick = Some(open);
    }

    /// The missing robots, each with more about it by its state, as in "robot `a` (stopped)".
    fn names_of(&self, open: &OpenTick, more: &dyn Fn(ProcessState) -> String) -> String {
        const NAMED_MAX: usize = 4;
        let name = |instance: &RobotInstance| {
            let more = self.members.get(instance.index.at()).map_or_else(String::new, |member| more(member.state));
            format!("robot `{}`{more}", self.name(instance.index))
        };
        let names: Vec<String> = open.missing.iter().take(NAMED_MAX).map(name).collect();
        let more = match open.missing.len().saturating_sub(NAMED_MAX) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        format!("{}{more}", names.join(", "))
    }

    fn news_of(&mut self, kind: News, instance: RobotInstance, line: String) {
        self.actions.push(Action::News { kind, robot: Some(instance.index), line });
    }
}

#[cfg(test)]
mod tests;
