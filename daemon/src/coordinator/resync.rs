//! After the daemon or the world was replaced: what the coordinator believes is compared with what the world says.
//!
//! The world's answer is the truth about robots: the coordinator does what is missing for it. Tasks are compared in both
//! directions: what the world does not have and has not done is given to it again. What the world has told is so in the one
//! that goes on in its place, too: it is kept before it is told. Everything that was sent before the question has been looked at by the world when
//! it answers, and everything sent later is left alone.

use super::pace::Pace;
use super::{Action, Coordinator, Signal, Waiting};
use model::{ProcessState, RobotIndex, RobotInstance, Scenario, TaskId, TaskState};
use protocol::daemon_to_world::{Absence, Order, Ticket};
use protocol::operator_to_daemon::Reply;
use protocol::world_to_daemon::{Standing, Standings};
use std::collections::BTreeSet;

/// A question that the world has not answered.
#[derive(Default)]
pub(super) struct Resync {
    number: u64,
    /// What operators waited for when it was asked.
    waiting: Vec<Ticket>,
    /// Robots that there were then, in front.
    robots: usize,
    /// Tasks that were not at their end then, and that the world has not been sent since.
    pub(super) tasks: BTreeSet<TaskId>,
}

impl Coordinator {
    /// A fleet that runs already: the instances that a daemon of before has started, with their processes if those run. What
    /// they do is asked of the world. No two daemons of a fleet may have the same `era`: an answer to the one before is none
    /// to this one.
    pub fn adopted(scenario: Scenario, begun: &[(RobotInstance, Option<u32>)], era: u32) -> Coordinator {
        let mut coordinator = Coordinator::new(scenario);
        coordinator.resyncs = u64::from(era) << 32;
        coordinator.pace = Pace::adopted(era);
        for (instance, pid) in begun {
            let Some(member) = coordinator.members.get_mut(instance.index.at()) else { continue };
            let is_newer = member.state == ProcessState::Awaited || member.instance.incarnation < instance.incarnation;
            if is_newer && (member.pid.is_none() || pid.is_some()) {
                let state = if pid.is_some() { ProcessState::Starting } else { ProcessState::Dead };
                (member.instance, member.pid, member.state) = (*instance, *pid, state);
            }
        }
        coordinator
    }

    /// The daemon or the world is new: the world is asked how everything stands.
    pub fn resync(&mut self) {
        let number = self.resyncs;
        self.resyncs += 1;
        self.resync = Some(Resync {
            number,
            waiting: self.waiting.iter().map(|waiting| waiting.ticket).collect(),
            robots: self.members.len(),
            tasks: self.tasks.open_ids().collect(),
        });
        self.actions.push(Action::Order(Order::Resync(number)));
    }

    /// Whether the world has not said yet how everything stands.
    pub fn is_resyncing(&self) -> bool {
        self.resync.is_some()
    }

    /// The world says how everything stands.
    pub(super) fn standings(&mut self, standings: Standings) {
        // That of a world that was replaced before it was heard is out of date.
        let Some(resync) = self.resync.take_if(|resync| resync.number == standings.number) else { return };
        for slot in 0..self.members.len().min(resync.robots) {
            let (index, newest) = (RobotIndex::of(slot), self.members[slot].newest());
            let is_asked_for = resync.waiting.contains(&Ticket::Admit(newest));
            match standings.robots.iter().find(|(instance, _)| instance.index == index) {
                Some((before, Standing::Left)) if before.incarnation < newest.incarnation && is_asked_for => {
                    self.admit_again(slot);
                }
                Some((instance, standing)) => self.stands(*instance, *standing),
                None => self.admit_again(slot),
            }
        }
        for (id, index, active) in &standings.tasks {
            self.has_task(*id, *index, *active, resync.tasks.contains(id));
        }
        let held: BTreeSet<TaskId> = standings.tasks.iter().map(|(id, ..)| *id).collect();
        for id in resync.tasks.difference(&held) {
            if self.tasks.state_of(*id).is_none_or(TaskState::is_final) {
                continue;
            }
            match standings.ended.iter().find(|(ended, _)| ended == id) {
                Some((_, step)) => self.task_step(*id, *step),
                None => self.order_task_again(*id),
            }
        }
        self.wait_on(&resync.waiting, &standings);
    }

    /// A robot of the world: its process is what the world believes it to be, or the world is told.
    fn stands(&mut self, instance: RobotInstance, standing: Standing) {
        let Some(member) = self.members.get_mut(instance.index.at()) else { return };
        if member.instance.incarnation > instance.incarnation {
            // The world has not heard of the end of that life.
            return match standing {
                Standing::Left => self.left(instance),
                _ => self.died_unseen(instance),
            };
        }
        if member.instance.incarnation < instance.incarnation {
            let before = member.instance;
            if member.pid.is_none() {
                (member.instance, member.state) = (instance, ProcessState::Awaited);
            } else {
                // The process of a life before it, which is to end.
                return match standing {
                    Standing::Awaited { told: false } => {}
                    Standing::Awaited { told: true } => self.expect(instance),
                    Standing::Left => {
                        self.left(instance);
                        self.signal(before, Signal::Kill, None);
                    }
                    Standing::Dead => self.signal(before, Signal::Kill, Some(ProcessState::Dead)),
                    _ => {
                        self.signal(before, Signal::Kill, Some(ProcessState::Dead));
                        self.died_unseen(instance);
                    }
                };
            }
        }
        let Some(member) = self.members.get_mut(instance.index.at()) else { return };
        let (runs, halted) = (member.pid.is_some() && member.instance == instance, member.halted);
        match standing {
            Standing::Awaited { told: false } => {}
            Standing::Awaited { told: true } if runs => member.state = ProcessState::Starting,
            Standing::Awaited { told: true } if member.state == ProcessState::Awaited => self.expect(instance),
            // It was started once, and an instance is not started twice.
            Standing::Awaited { told: true } => self.died_unseen(instance),
            Standing::Dead | Standing::RestartLimit => {
                let is_at_limit = standing == Standing::RestartLimit;
                member.state = if is_at_limit { ProcessState::RestartLimit } else { ProcessState::Dead };
                self.signal(instance, Signal::Kill, None);
            }
            Standing::Left => (member.state, member.lives) = (ProcessState::Left, instance.incarnation + 1),
            _ if !runs => self.died_unseen(instance),
            Standing::Paused { goes_on: false } => {
                member.state = ProcessState::Paused;
                if !halted {
                    self.signal(instance, Signal::Stop, None);
                }
            }
            Standing::Paused { goes_on: true } => self.signal(instance, Signal::Continue, Some(ProcessState::Running)),
            Standing::Present | Standing::Held => {
                let was_paused = member.state == ProcessState::Paused;
                member.state = ProcessState::Running;
                if was_paused {
                    self.signal(instance, Signal::Continue, None);
                } else if halted {
                    self.stands_still(instance);
                }
            }
        }
    }

    /// The process of a life that the world believes in has ended while nobody looked.
    pub(super) fn died_unseen(&mut self, instance: RobotInstance) {
        self.with_current(instance, |member| member.state = ProcessState::Dead);
        let words = "its process had ended when a daemon looked again".to_owned();
        let cause = Absence::Died { signal: None, code: None, words };
        self.actions.push(Action::Order(Order::Absent { instance, cause }));
    }

    /// A robot that was added, of which the world knows nothing.
    fn admit_again(&mut self, slot: usize) {
        let (Some(member), Some(robot)) = (self.members.get(slot), self.scenario.robots.get(slot)) else { return };
        if member.state != ProcessState::Refused {
            let (instance, robot) = (member.newest(), Box::new(robot.clone()));
            self.actions.push(Action::Order(Order::Admit { instance, robot }));
        }
    }

    /// A robot has this task; `asked`: the coordinator believed then that it was not at its end.
    fn has_task(&mut self, id: TaskId, index: RobotIndex, active: bool, asked: bool) {
        let robot = self.name(index).to_owned();
        match self.tasks.state_of(id) {
            Some(state) if asked && !state.is_final() => {
                self.tasks.set_robot(id, &robot);
                let is = if active { TaskState::Active } else { TaskState::Assigned };
                if state != is {
                    self.change(id, is, "");
                }
            }
            _ => {}
        }
    }

    /// What operators wait for and a world that was replaced may have lost is asked for again, or answered, or given up.
    fn wait_on(&mut self, tickets: &[Ticket], standings: &Standings) {
        let (lost, waiting): (Vec<Waiting>, Vec<Waiting>) =
            std::mem::take(&mut self.waiting).into_iter().partition(|waiting| tickets.contains(&waiting.ticket));
        self.waiting = waiting;
        let standing = |index: RobotIndex| standings.robots.iter().find(|(instance, _)| instance.index == index);
        for waiting in lost {
            match waiting.ticket {
                // It may be in a later life by now.
                Ticket::Admit(RobotInstance { index, incarnation }) => match standing(index) {
                    Some((now, _)) if now.incarnation >= incarnation => self.taken(waiting),
                    // The world has been asked to admit it again.
                    _ => self.waiting.push(waiting),
                },
                Ticket::Remove(index) if standing(index).is_some_and(|(_, standing)| *standing == Standing::Left) => {
                    self.taken(waiting);
                }
                Ticket::Remove(index) => {
                    self.actions.push(Action::Order(Order::Remove { index }));
                    self.waiting.push(waiting);
                }
                Ticket::Cancel(id) if self.tasks.state_of(id).is_none_or(TaskState::is_final) => self.taken(waiting),
                Ticket::Cancel(id) => {
                    self.order_cancel(id);
                    self.waiting.push(waiting);
                }
                // What is not known to have been done is not done a second time.
                Ticket::Restart(_) | Ticket::Fault(_) | Ticket::Task(_) | Ticket::Pace(_) => {
                    let problem = format!("{}: not confirmed: the world's process was replaced", waiting.what());
                    let hint = "it may have been done; send it again if it was not".to_owned();
                    self.answer(waiting, Reply::Unconfirmed { problem, hint });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
