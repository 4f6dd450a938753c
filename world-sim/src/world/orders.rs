//! Orders: what a daemon asks of the world, and what it is answered.

use super::{UNKNOWN, World};
use crate::arm;
use crate::presence::State;
use model::{EventKind, Fault, FaultSource, GoalSource, Mode, Robot, RobotIndex, RobotInstance};
use protocol::daemon_to_world::{Absence, Order, Ticket};
use protocol::inputs::WorldInput;
use protocol::world_to_daemon::Notice;

impl World {
    /// A fact or a wish from outside. It takes effect when the next tick opens, but for [`Order::Stop`], which
    /// [`finished`](World::finished) knows of at once, [`Order::Pace`], which [`opens`](World::opens) does, and [`Order::Resync`], which is answered between this tick and the
    /// next one with all that came before it: the daemon that asks may have to start the robot that the next tick waits for.
    pub fn order(&mut self, order: Order) {
        self.keep(|| WorldInput::Order(order.clone()));
        match order {
            Order::Stop => self.stopped = true,
            Order::Pace { id, change } if self.clock.mode == Mode::Lockstep => {
                self.opener.change(id, change, self.tick + u64::from(self.is_open));
                let pace = self.pace();
                self.journal.tell(Notice::Pace(pace));
                self.answer_pace();
            }
            Order::Pace { .. } => self.answer(order.ticket(), Err("its robots do not wait for the world's ticks")),
            Order::Resync(_) => {
                self.orders.push(order);
                self.answer_daemon();
            }
            _ => self.orders.push(order),
        }
    }

    /// Answers a daemon that has asked how everything stands, unless a tick is open; whether one had.
    pub(super) fn answer_daemon(&mut self) -> bool {
        let has_asked = !self.is_open && self.orders.iter().any(|order| matches!(order, Order::Resync(_)));
        if has_asked {
            self.apply_orders();
        }
        has_asked
    }

    /// Answers changes of the pace that have come about.
    pub(super) fn answer_pace(&mut self) {
        while let Some(id) = self.opener.answered(self.tick) {
            let state = self.pace();
            self.journal.tell(Notice::Pace(state));
            self.answer(Some(Ticket::Pace(id)), Ok::<(), &str>(()));
        }
    }

    /// The senders of orders that have not taken effect are told that the run is over.
    pub fn refuse_orders(&mut self) {
        self.keep(|| WorldInput::Refused);
        self.opener.end();
        self.answer_pace();
        for order in std::mem::take(&mut self.orders) {
            self.answer(order.ticket(), Err("the run is over"));
        }
    }

    pub(super) fn apply_orders(&mut self) {
        let mut orders = std::mem::take(&mut self.orders);
        self.stirred |= !orders.is_empty();
        for order in orders.drain(..) {
            match order {
                Order::Admit { instance, ref robot } => {
                    let admitted = self.admit(instance, robot);
                    self.answer(order.ticket(), admitted);
                }
                Order::Remove { index } => {
                    let left = self.leave(index.at());
                    self.answer(order.ticket(), left);
                }
                Order::Restart { index } => {
                    let restarted = self.restart(index);
                    self.answer(order.ticket(), restarted);
                }
                Order::Task { id, index, task } => {
                    // A daemon that does not know whether the world has it sends it again.
                    let taken =
                        if self.knows_task(id) { Ok(()) } else { self.task(index, task, GoalSource::Operator(id)) };
                    self.answer(order.ticket(), taken);
                }
                Order::Fault { id: _, index, fault, ticks } => {
                    let done = self.inject(index, fault, ticks, FaultSource::Operator);
                    self.answer(order.ticket(), done);
                }
                Order::Cancel { id, index } => {
                    let cancelled = self.cancel(index, id);
                    self.answer(order.ticket(), cancelled);
                }
                Order::Absent { instance, cause } => {
                    if let Some(presence) = self.presences.get_mut(instance.index.at()) {
                        presence.absent(instance, cause, self.straggler, self.tick, &mut self.journal);
                    }
                }
                Order::Resync(number) => self.tell_all(number),
                Order::Stop | Order::Pace { .. } => {} // Has taken effect when it was given.
            }
        }
        self.orders = orders;
    }

    fn answer(&mut self, ticket: Option<Ticket>, result: Result<(), impl Into<String>>) {
        if let Some(ticket) = ticket {
            self.journal.tell(Notice::Answer { ticket, refused: result.err().map(Into::into) });
        }
    }

    fn admit(&mut self, instance: RobotInstance, robot: &Robot) -> Result<(), &'static str> {
        let slot = instance.index.at();
        let is_free = self.presences.get(slot).is_none_or(|presence| presence.is_free_for(instance.incarnation));
        let problem = match &robot.arm {
            // Its links would come between the pieces of others.
            Some(_) => "an arm cannot be added",
            None if arm::of_slot(&self.arms, slot).is_some() => "the slot is that of an arm",
            None if slot < self.slots_max && is_free => {
                self.place(instance, robot, self.tick);
                // Who looks at the slot sees the new robot, not the one that it had before.
                self.shown[slot] = u32::MAX;
                // Its process is on its way: what is reported of it counts from here on.
                self.presences[slot].announce(self.tick, self.ahead_ticks, &mut self.journal);
                return Ok(());
            }
            None => "the slot is not free",
        };
        let index = instance.index;
        self.journal.note(self.tick, index, EventKind::Ignored { order: "admit".to_owned(), why: problem.to_owned() });
        Err(problem)
    }

    /// The robot goes. Its tasks are dropped before it is said that it has left: whoever gives them to others, or gives its
    /// slot to another robot, knows of them by then.
    pub(super) fn leave(&mut self, slot: usize) -> Result<(), String> {
        let why = match self.presences.get_mut(slot) {
            None => UNKNOWN.to_owned(),
            Some(presence) if matches!(presence.state, State::Vacant | State::Left) => presence.in_words(),
            Some(_) => {
                self.orphan(slot);
                self.presences[slot].leave(self.tick, &mut self.journal);
                return Ok(());
            }
        };
        let event = EventKind::Ignored { order: "leave".to_owned(), why: why.clone() };
        self.journal.note(self.tick, RobotIndex::of(slot), event);
        Err(why)
    }

    fn restart(&mut self, index: RobotIndex) -> Result<(), String> {
        let restarted = match self.presences.get_mut(index.at()) {
            Some(presence) => presence.restart(self.tick, &mut self.journal),
            None => Err(UNKNOWN.to_owned()),
        };
        if let Err(why) = &restarted {
            let (order, why) = ("restart".to_owned(), why.clone());
            self.journal.note(self.tick, index, EventKind::Ignored { order, why });
        }
        restarted
    }
}

/// Whether an order that has not taken effect yet means that the tick need not wait for a robot instance.
pub(super) fn excuses(order: &Order, instance: RobotInstance) -> bool {
    match order {
        // A process that is stopped may go on; it is waited for until it is overdue.
        Order::Absent { instance: absent, cause } => *absent == instance && *cause != Absence::Stopped,
        Order::Remove { index } | Order::Restart { index } | Order::Fault { index, fault: Fault::Kill, .. } => {
            *index == instance.index
        }
        Order::Admit { .. }
        | Order::Task { .. }
        | Order::Cancel { .. }
        | Order::Fault { .. }
        | Order::Resync(_)
        | Order::Pace { .. }
        | Order::Stop => false,
    }
}
