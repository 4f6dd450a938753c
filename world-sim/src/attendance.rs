//! Which processes answer: whom a tick waits for, which command counts, and who is given up. Pure: the shell looks into
//! shared memory and at the clock, and asks here what that means.

mod stragglers;

use crate::World;
use crate::presence::State;
use model::RobotInstance;
use protocol::daemon_to_world::{Absence, Order};
use protocol::robot_to_world::Command;
use std::time::Duration;
use stragglers::Stragglers;
pub use stragglers::{PATIENCE, Seen};

/// Who answers, of the robots of one world.
pub struct Attendance {
    /// Instances whose process does not answer: they are not waited for. Each with its signs of life until then.
    silent: Vec<(RobotInstance, u64)>,
    /// Of each slot, the tick after the last one in which it took part.
    took_part: Vec<u64>,
    /// `realtime`: since when each slot has been without a command, ns: when the odometry was written that the newest one
    /// was computed from; its entry counts as one.
    commanded_ns: Vec<u64>,
    /// `realtime`: when time last went on after a gap, ns.
    resumed_ns: u64,
    command_timeout_ns: u64,
    stragglers: Stragglers,
    /// When the tick that waits for answers was opened, ns.
    opened_ns: u64,
    straggler_limit: Duration,
    /// The run is to end after the present tick.
    stopping: bool,
}

impl Attendance {
    /// Of a fleet with this many slots, none of which has been missed.
    pub fn new(slots: usize, straggler_limit: Duration, command_timeout_ns: u64) -> Attendance {
        Attendance {
            silent: Vec::new(),
            took_part: vec![0; slots],
            commanded_ns: vec![0; slots],
            resumed_ns: 0,
            command_timeout_ns,
            stragglers: Stragglers::new(straggler_limit),
            opened_ns: 0,
            straggler_limit,
            stopping: false,
        }
    }

    /// Whether a robot instance has been given up, and has shown no sign of life since.
    pub fn is_silent(&self, instance: RobotInstance) -> bool {
        self.silent.iter().any(|(who, _)| *who == instance)
    }

    /// How many instances are given up at the moment.
    pub fn silent_count(&self) -> usize {
        self.silent.len()
    }

    /// An order has come. `signs` counts the signs of life of a robot instance.
    pub fn take(&mut self, world: &mut World, order: Order, signs: &dyn Fn(RobotInstance) -> u64) {
        match order {
            Order::Absent { instance, cause } => self.give_up(world, instance, cause, signs),
            order => {
                self.stopping |= order == Order::Stop;
                world.order(order);
            }
        }
    }

    /// This instance is not waited for any more; the world decides what that means. An instance that is not in the world, or
    /// not any more, is ignored: a message about it must not affect the instance that takes its place later.
    pub fn give_up(
        &mut self,
        world: &mut World,
        instance: RobotInstance,
        cause: Absence,
        signs: &dyn Fn(RobotInstance) -> u64,
    ) {
        let matters = match cause {
            // That it does not answer is known.
            Absence::Overdue => world.has_process(instance) && !self.is_silent(instance),
            // One that does not take part has nothing to answer. If it is to enter, it does that when it goes on.
            Absence::Stopped => world.takes_part(instance),
            // Also of one that had been given up: only now is it known that it will not come back.
            Absence::Died { .. } | Absence::NotStarted { .. } | Absence::Deaf { .. } => world.has_process(instance),
        };
        if !matters {
            return;
        }
        if !self.is_silent(instance) {
            self.silent.push((instance, signs(instance)));
        }
        world.order(Order::Absent { instance, cause });
    }

    /// No tick is open: robots that gave a sign of life since they were given up come back.
    pub fn welcome_back(&mut self, world: &mut World, signs: &dyn Fn(RobotInstance) -> u64) {
        self.silent.retain(|(instance, before)| {
            let alive = signs(*instance) != *before;
            if alive {
                world.back(*instance);
            }
            !alive && world.has_process(*instance)
        });
    }

    /// Whether a robot that is to enter now, and that has not been given up, has not `said` yet what it has to say before.
    pub fn misses(&self, world: &mut World, said: &dyn Fn(RobotInstance) -> bool) -> bool {
        world.due().iter().any(|instance| !said(*instance) && !self.is_silent(*instance))
    }

    /// This robot takes part in the tick that has just been opened.
    pub fn takes_part(&mut self, instance: RobotInstance, tick: u64, opened_ns: u64) {
        let slot = instance.index.at();
        if std::mem::replace(&mut self.took_part[slot], tick + 1) != tick {
            self.commanded_ns[slot] = opened_ns; // It has just entered, or come back.
        }
    }

    // ---- `lockstep`: everybody is waited for

    /// A tick has been opened and waits for answers.
    pub fn await_answers(&mut self, opened_ns: u64) {
        self.opened_ns = opened_ns;
        self.stragglers.begin(opened_ns);
    }

    /// Those of the open tick that have neither `answered` nor been given up, into `missing`.
    pub fn missing(&self, world: &World, answered: &dyn Fn(RobotInstance) -> bool, missing: &mut Vec<RobotInstance>) {
        missing.clear();
        let participants = world.participants().iter();
        missing.extend(participants.filter(|instance| !answered(**instance) && !self.is_silent(**instance)));
    }

    /// Who of the missing has kept the tick waiting for too long. `see` asks the kernel.
    pub fn overdue(
        &mut self,
        now_ns: u64,
        missing: &[RobotInstance],
        see: &mut dyn FnMut(RobotInstance) -> Option<Seen>,
    ) -> Vec<RobotInstance> {
        // A run that is to end does not wait for a robot that hangs.
        let short = PATIENCE.min(self.straggler_limit).as_nanos() as u64;
        if self.stopping && now_ns.saturating_sub(self.opened_ns) > short {
            return missing.to_vec();
        }
        self.stragglers.overdue(now_ns, missing, see)
    }

    // ---- `realtime`: the newest command counts, while it is not too old

    /// The world goes on in place of another one: robots that it holds come back when they give a sign of life.
    pub fn go_on(&mut self, world: &World, signs: &dyn Fn(RobotInstance) -> u64) {
        let states = (0..world.slots()).filter_map(|slot| world.state(slot));
        let held = states.filter(|(_, state)| matches!(state, State::Held { .. })).map(|(instance, _)| instance);
        self.silent.extend(held.map(|instance| (instance, signs(instance))));
    }

    /// The first period begins.
    pub fn begin(&mut self, start_ns: u64) {
        self.commanded_ns.fill(start_ns);
    }

    /// Time stood still for the world's process until now: no robot could give a new command in that time.
    pub fn stood_still(&mut self, now_ns: u64) {
        self.resumed_ns = now_ns;
    }

    /// The command that acts in this period, of the newest that a robot gave. A robot that has not given any for too long
    /// is given up.
    pub fn newest(
        &mut self,
        world: &mut World,
        instance: RobotInstance,
        command: Option<Command>,
        now_ns: u64,
        signs: &dyn Fn(RobotInstance) -> u64,
    ) -> Option<Command> {
        let slot = instance.index.at();
        if let Some(command) = &command {
            self.commanded_ns[slot] = self.commanded_ns[slot].max(command.odometry_stamp_ns);
        }
        let since_ns = self.commanded_ns[slot].max(self.resumed_ns);
        if now_ns.saturating_sub(since_ns) > self.command_timeout_ns {
            self.give_up(world, instance, Absence::Overdue, signs);
        }
        // A command is as old as what its robot knew, and some are only good for a few ticks.
        let oldest_ns = now_ns.saturating_sub(self.command_timeout_ns);
        let ticks = |command: &Command| world.tick().saturating_sub(command.tick);
        command
            .filter(|command| command.odometry_stamp_ns >= oldest_ns)
            .filter(|command| command.hold_ticks == 0 || ticks(command) < u64::from(command.hold_ticks))
    }
}

/// The command on a board, if the robot of this instance wrote it.
pub fn command_of(instance: RobotInstance, command: Command) -> Option<Command> {
    (command.incarnation == instance.incarnation && command.stamp_ns > 0).then_some(command)
}

/// `lockstep`: the command that acts in this tick, of the newest that a robot gave: the one with which it `answered`.
/// Whether its process still lives does not matter.
pub fn command_of_tick(tick: u64, answered: bool, command: Option<Command>) -> Option<Command> {
    command.filter(|command| answered && command.tick == tick)
}
