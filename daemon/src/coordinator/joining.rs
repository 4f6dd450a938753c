//! Robots that an operator waits for: one that was added or restarted has joined when it takes part, hears its neighbours,
//! and is heard by them. The shell looks who hears whom.

use super::operators::{CONFIRM_WITHIN, Waiting};
use super::{Action, Coordinator};
use model::{Event, EventName, RobotIndex, RobotInstance};
use protocol::daemon_to_world::Ticket;
use protocol::operator_to_daemon::Reply;
use std::time::Duration;

/// Why nobody joins at the moment.
const PAUSED: &str = "the fleet is paused";

/// A robot that the world has accepted.
pub(super) struct Joining {
    ticket: Ticket,
    robot: String,
    index: RobotIndex,
    /// Since when the operator waits, once the clock has been looked at.
    since: Option<Duration>,
    /// The life in which it has entered, and when.
    entered: Option<(RobotInstance, u64)>,
    /// What kept it from entering so far.
    problem: Option<String>,
}

impl Coordinator {
    /// The world has taken an order after which a robot is to enter.
    pub(super) fn await_joining(&mut self, waiting: Waiting, index: RobotIndex) {
        let Waiting { ticket, robot, since, .. } = waiting;
        self.joining.push(Joining { ticket, robot, index, since, entered: None, problem: None });
    }

    /// The robots that operators wait for and that have entered the world, each with the tick in which it did.
    pub fn newcomers(&self) -> Vec<(RobotInstance, u64)> {
        self.joining.iter().filter_map(|joining| joining.entered).collect()
    }

    /// Whether an operator waits for a robot to join.
    pub fn awaits_newcomers(&self) -> bool {
        !self.joining.is_empty()
    }

    /// This newcomer hears its neighbours, which are as many, and they hear it.
    pub fn joined(&mut self, newcomer: RobotInstance, neighbors: u32, now: Duration) {
        let is_it = |joining: &Joining| joining.entered.is_some_and(|(instance, _)| instance == newcomer);
        let Some(place) = self.joining.iter().position(is_it) else { return };
        let Joining { ticket, robot, index, since, .. } = self.joining.remove(place);
        let joined_ms = since.map_or(0.0, |since| now.saturating_sub(since).as_secs_f64() * 1e3);
        let incarnation = newcomer.incarnation;
        let reply = Reply::Joined { robot, index, incarnation, joined_ms, neighbors };
        self.actions.push(Action::Reply(ticket, reply));
    }

    /// A robot has entered the world.
    pub(super) fn newcomer_entered(&mut self, instance: RobotInstance, tick: u64) {
        for joining in self.joining.iter_mut().filter(|joining| joining.index == instance.index) {
            joining.entered = Some((instance, tick));
        }
    }

    /// Something happened, perhaps to a robot that somebody waits for.
    pub(super) fn newcomer_event(&mut self, event: &Event) {
        let matters = [EventName::Died, EventName::NotStarted, EventName::Deaf, EventName::Dropped];
        if !matters.contains(&event.kind.name()) {
            return;
        }
        for joining in self.joining.iter_mut().filter(|joining| Some(joining.index) == event.robot) {
            joining.problem = Some(event.kind.detail(&|robot| format!("slot {robot}")));
        }
    }

    /// The robot in this slot has left.
    pub(super) fn newcomer_left(&mut self, index: RobotIndex) {
        self.give_up_joining(|joining| {
            (joining.index == index).then(|| "it left before it was known that it had joined".to_owned())
        });
    }

    /// Nobody joins any more.
    pub(super) fn refuse_joining(&mut self) {
        self.give_up_joining(|_| Some("the run is over".to_owned()));
    }

    /// Operators who have waited long enough are told that it is not known yet.
    pub(super) fn answer_late_joining(&mut self, now: Duration) {
        let seconds = CONFIRM_WITHIN.as_secs();
        let held = self.pace.holds().then_some(self.pace.state.tick);
        self.give_up_joining(|joining| {
            if let Some(tick) = held {
                return Some(format!("{PAUSED} at tick {tick}, and it joins when the fleet goes on"));
            }
            let since = *joining.since.get_or_insert(now);
            let is_late = now.saturating_sub(since) > CONFIRM_WITHIN;
            is_late.then(|| match (joining.entered, &joining.problem) {
                (Some(_), None) => {
                    format!("it is in the world, and for {seconds} s not all its neighbours heard it, or it them")
                }
                (_, Some(problem)) => format!("it is not in the world after {seconds} s: {problem}"),
                (None, None) => format!("its process is not ready after {seconds} s"),
            })
        });
    }

    /// What a time without the daemon has taken is not counted.
    pub(super) fn joining_was_away(&mut self, away: Duration) {
        self.joining.iter_mut().filter_map(|joining| joining.since.as_mut()).for_each(|since| *since += away);
    }

    /// Answers the operators of those that are not waited for any more, for this reason.
    fn give_up_joining(&mut self, why: impl Fn(&mut Joining) -> Option<String>) {
        let actions = &mut self.actions;
        self.joining.retain_mut(|joining| {
            let Some(why) = why(joining) else { return true };
            let problem = format!("robot `{}`: not confirmed: {why}", joining.robot);
            let hint = match why.starts_with(PAUSED) {
                true => "`shoal step` or `shoal resume` lets the fleet go on".to_owned(),
                false => "`shoal ps` shows the robots and their states".to_owned(),
            };
            actions.push(Action::Reply(joining.ticket, Reply::Unconfirmed { problem, hint }));
            false
        });
    }

    /// Whether an operator waits for the robot in this slot already.
    pub(super) fn is_joining(&self, index: RobotIndex) -> bool {
        let waits = |waiting: &Waiting| match waiting.ticket {
            Ticket::Admit(instance) => instance.index == index,
            Ticket::Restart(restarts) => restarts == index,
            _ => false,
        };
        self.joining.iter().any(|joining| joining.index == index) || self.waiting.iter().any(waits)
    }
}
