//! What operators ask of a fleet, and what they are answered.
//!
//! What only the world can grant is answered when the world has said so: an acknowledgement means that it is done.
//! Every request gets one answer, however long the world takes: after [`CONFIRM_WITHIN`] the operator is told that it
//! is not known yet.

use super::{Action, Coordinator};
use model::kind::Range;
use model::{Fault, RobotIndex, RobotInstance};
use protocol::daemon_to_world::{Order, Ticket};
use protocol::operator_to_daemon::{Reply, Request, TaskRecord};
use std::time::Duration;

/// An operator is not kept waiting for the world for longer. The operator's own patience is longer.
pub const CONFIRM_WITHIN: Duration = Duration::from_secs(3);
/// What is not a request is reported no more often.
pub const NOISE_EVERY: Duration = Duration::from_secs(10);
/// Orders that the world has not answered; further ones are refused.
pub const WAITING_MAX: usize = 256;

/// What is known at once of the answer to a request.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// All of it.
    Now(Reply),
    /// The world decides; an [`Action::Reply`] with this ticket follows.
    Later(Ticket),
}

/// An order that the world has not answered.
pub(super) struct Waiting {
    pub(super) ticket: Ticket,
    pub(super) robot: String,
    /// Since when, once the clock has been looked at.
    pub(super) since: Option<Duration>,
    pub(super) owed: Owed,
}

/// What an operator is told when the world has taken the order.
#[derive(Default, PartialEq)]
pub(super) enum Owed {
    /// This.
    Reply(Reply),
    /// Nothing yet: the robot is to join.
    Joining,
    /// What has become of the task.
    Task,
    /// The pace that the fleet keeps then.
    Pace,
    /// Nothing: the operator has been answered.
    #[default]
    Nothing,
}

/// What has been said of clients that send what is not a request.
#[derive(Clone, Copy, Default)]
pub(super) struct Noise {
    /// How often they had.
    said: u64,
    /// When it was said.
    at: Option<Duration>,
}

impl Waiting {
    pub(super) fn new(ticket: Ticket, robot: String, owed: Owed) -> Waiting {
        Waiting { ticket, robot, since: None, owed }
    }

    /// What waits, for people.
    pub(super) fn what(&self) -> String {
        match self.ticket {
            Ticket::Task(task) | Ticket::Cancel(task) => format!("task {task} of robot `{}`", self.robot),
            Ticket::Admit(_) | Ticket::Remove(_) | Ticket::Restart(_) => format!("robot `{}`", self.robot),
            Ticket::Pace(_) => "pace of the fleet".to_owned(),
            Ticket::Fault(_) => format!("fault for robot `{}`", self.robot),
        }
    }
}

impl Coordinator {
    /// An operator asks for something. `near` says whether a robot of that radius would overlap a body at a place.
    /// Status needs measurements and is the shell's to answer.
    pub fn request(&mut self, request: &Request, near: &dyn Fn([f64; 2], f64) -> Option<RobotIndex>) -> Answer {
        let granted = match request {
            Request::Tasks(filter) => return self.list_tasks(filter).map_or_else(Answer::refused, Answer::tasks),
            Request::Status => Err(refused("status is answered by the supervisor, not by the coordinator", None)),
            Request::Events { after } => return Answer::Now(Reply::Events(self.log.after(*after))),
            Request::Stop => {
                self.enough();
                return Answer::Now(Reply::Stopping);
            }
            _ if self.stopping => Err(refused("the run is over", None)),
            Request::Task(new) => return self.new_tasks(new).unwrap_or_else(Answer::refused),
            _ if self.unanswered() >= WAITING_MAX => Err(refused(
                &format!("{WAITING_MAX} requests wait for the world already"),
                Some("is the world stopped or the machine overloaded? see `shoal ps`, and try again later"),
            )),
            Request::Add(new) => self.add(new, near),
            Request::Remove { robot } => self.remove(robot),
            Request::Restart { robot } => self.restart(robot),
            Request::Cancel(name) => {
                self.cancel_task(name).map(|(ticket, robot)| Waiting::new(ticket, robot, Owed::Task))
            }
            Request::Pace(change) => self.change_pace(*change),
            Request::Inject { robot, fault, for_s } => self.inject(robot, *fault, *for_s),
        };
        match granted {
            Ok(waiting) => {
                let ticket = waiting.ticket;
                self.waiting.push(waiting);
                Answer::Later(ticket)
            }
            Err(refusal) => Answer::Now(refusal.into()),
        }
    }

    /// Clients have sent what is not a request, this often since the start; `newest` says what was wrong with the newest
    /// of it. It is said, but not each time.
    pub fn noise(&mut self, count: u64, newest: &str, now: Duration) {
        let Noise { said, at } = self.noise;
        if count == said || at.is_some_and(|at| now.saturating_sub(at) < NOISE_EVERY) {
            return;
        }
        self.noise = Noise { said: count, at: Some(now) };
        self.say(match count - said {
            1 => format!("operators: refused what is not a request: {newest}"),
            more => format!("operators: refused {more} times what is not a request, the last time: {newest}"),
        });
    }

    /// The world has taken the order with this ticket, or will not.
    pub(super) fn answered(&mut self, ticket: Ticket, problem: Option<String>) {
        if let Ticket::Task(id) = ticket {
            return self.task_answered(id, problem);
        }
        let Some(index) = self.waiting.iter().position(|waiting| waiting.ticket == ticket) else { return };
        let waiting = self.waiting.remove(index);
        let Some(problem) = problem else { return self.taken(waiting) };
        match ticket {
            Ticket::Admit(instance) => self.not_admitted(instance),
            Ticket::Remove(index) => self.not_removed(index),
            Ticket::Restart(_) | Ticket::Task(_) | Ticket::Cancel(_) | Ticket::Fault(_) | Ticket::Pace(_) => {}
        }
        let whose = match ticket {
            Ticket::Pace(_) => "fleet".to_owned(),
            _ => format!("robot `{}`", waiting.robot),
        };
        let refusal = refused(&format!("{whose}: {problem}"), hint_for(&problem));
        self.answer(waiting, refusal.into());
    }

    /// The world has taken an order: its operator is answered, or waits on.
    pub(super) fn taken(&mut self, mut waiting: Waiting) {
        match (std::mem::take(&mut waiting.owed), waiting.ticket) {
            (Owed::Pace, ticket) => self.actions.push(Action::Reply(ticket, Reply::Pace(self.pace.state))),
            (Owed::Reply(reply), ticket) => self.actions.push(Action::Reply(ticket, reply)),
            (Owed::Task, Ticket::Cancel(id)) => {
                let reply = self.cancelled(id);
                self.actions.push(Action::Reply(waiting.ticket, reply));
            }
            (Owed::Joining, Ticket::Admit(RobotInstance { index, .. }) | Ticket::Restart(index)) => {
                self.await_joining(waiting, index);
            }
            (Owed::Task | Owed::Joining | Owed::Nothing, _) => {}
        }
    }

    /// Answers an operator, unless that has been done.
    pub(super) fn answer(&mut self, waiting: Waiting, reply: Reply) {
        if waiting.owed != Owed::Nothing {
            self.actions.push(Action::Reply(waiting.ticket, reply));
        }
    }

    /// Orders of operators that the world has not answered, those included whose operator has been told so.
    pub fn unanswered(&self) -> usize {
        self.waiting.len() + self.tasks.unconfirmed()
    }

    /// The world has said all that it will: what it has not taken will not happen. Unless what it said is lost.
    pub fn refuse_waiting(&mut self) {
        if self.missed.others == 0 {
            while let Some(ticket) = self.waiting.last().map(|waiting| waiting.ticket) {
                self.answered(ticket, Some("the run is over".to_owned()));
            }
        }
        self.refuse_tasks(self.missed.others > 0);
        self.refuse_joining();
        for waiting in std::mem::take(&mut self.waiting) {
            let problem = format!("{}: not confirmed: the run is over, and the world's answer is lost", waiting.what());
            let hint = "it may have been done: the report says so".to_owned();
            self.answer(waiting, Reply::Unconfirmed { problem, hint });
        }
    }

    /// Operators who have waited long enough are told that it is not known yet.
    pub(super) fn answer_late(&mut self, now: Duration) {
        self.answer_late_tasks(now);
        self.answer_late_joining(now);
        for waiting in &mut self.waiting {
            let since = *waiting.since.get_or_insert(now);
            if now.saturating_sub(since) <= CONFIRM_WITHIN || std::mem::take(&mut waiting.owed) == Owed::Nothing {
                continue;
            }
            if let (Ticket::Pace(_), Some(_)) = (waiting.ticket, self.pace.state.until_tick) {
                // Steps are under way. How far they are `status` tells.
                self.actions.push(Action::Reply(waiting.ticket, Reply::Pace(self.pace.state)));
                continue;
            }
            let seconds = CONFIRM_WITHIN.as_secs();
            let problem = format!("{}: not confirmed: the world has not answered for {seconds} s", waiting.what());
            let hint = "it may still be done; `shoal ps` shows the robots, and whether the world runs".to_owned();
            self.actions.push(Action::Reply(waiting.ticket, Reply::Unconfirmed { problem, hint }));
        }
    }

    fn inject(&mut self, name: &str, fault: Fault, for_s: Option<f64>) -> Result<Waiting, Refusal> {
        let slot = self.slot_of(name)?;
        let wrong = |problem: &str| Err(refused(problem, Some("`shoal inject --help` lists faults and their options")));
        if let Some(problem) = fault.problem() {
            return wrong(&problem);
        }
        let ticks = match for_s {
            Some(_) if !fault.lasts() => {
                return wrong(&format!("{}: it does not last: it has no length", fault.word()));
            }
            Some(for_s) if !Range::POSITIVE.contains(for_s) => {
                return wrong(&format!("{}: {for_s} s is not a length of time", fault.word()));
            }
            Some(for_s) => Some(((for_s * self.scenario.clock.tick_hz).round() as u64).max(1)),
            None => None,
        };
        let id = self.faults;
        self.faults.0 += 1;
        self.actions.push(Action::Order(Order::Fault { id, index: RobotIndex::of(slot), fault, ticks }));
        Ok(Waiting::new(Ticket::Fault(id), name.to_owned(), Owed::Reply(Reply::Injected { ticks })))
    }

    /// The slot of the robot with this name.
    pub(super) fn slot_of(&self, name: &str) -> Result<usize, Refusal> {
        let robots = &self.scenario.robots;
        robots.iter().position(|robot| robot.id == name).ok_or_else(|| {
            let known: Vec<&str> = robots.iter().map(|robot| robot.id.as_str()).collect();
            refused(&format!("unknown robot `{}`", shown(name)), Some(&format!("known robots: {}", known.join(", "))))
        })
    }
}

/// The way out, for what the world says most.
pub(super) fn hint_for(problem: &str) -> Option<&'static str> {
    match problem {
        world_sim::TOO_MANY_GOALS => {
            Some("send it when the robot has reached some of its goals, or with `--now` instead of them")
        }
        _ if problem.contains("the robot is ") => Some("`shoal ps` shows the robots of the fleet"),
        _ => None,
    }
}

/// A name that may be anything, as it can be shown.
pub(super) fn shown(name: &str) -> String {
    name.chars().take(40).flat_map(char::escape_debug).collect()
}

impl Answer {
    fn refused(refusal: Refusal) -> Answer {
        Answer::Now(refusal.into())
    }

    fn tasks(records: Vec<TaskRecord>) -> Answer {
        Answer::Now(Reply::Tasks(records))
    }
}

/// Why a request is not granted, and the way out.
pub(super) struct Refusal {
    pub(super) problem: String,
    hint: Option<String>,
}

impl From<Refusal> for Reply {
    fn from(Refusal { problem, hint }: Refusal) -> Reply {
        Reply::Refused { problem, hint }
    }
}

pub(super) fn refused(problem: &str, hint: Option<&str>) -> Refusal {
    Refusal { problem: problem.to_owned(), hint: hint.map(str::to_owned) }
}
