//! One fleet in one thread: whose turn it is, and what has to be true after it.

use crate::checks;
use crate::coverage::Coverage;
use crate::daemon::Daemon;
use crate::dice::{Dice, MS};
use crate::kernel::Kernel;
use crate::operators::Operators;
use crate::plan::Plan;
use crate::replays;
use crate::restarts;
use crate::shared::Shared;
use crate::world::WorldProcess;
use model::{Mode, Outcome};

/// A storm that has not ended within this number of turns never will.
const TURNS_MAX: u64 = 300_000;

pub(crate) struct Fleet {
    pub(crate) shared: Shared,
    pub(crate) kernel: Kernel,
    pub(crate) operators: Operators,
    pub(crate) daemon: Daemon,
    pub(crate) world: WorldProcess,
    /// Until then, ns.
    pub(crate) daemon_stopped: u64,
    pub(crate) world_stopped: u64,
    /// Robots that operators asked for.
    pub(crate) guests: usize,
    pub(crate) pause_ms: u64,
    plan: Plan,
    gust: u64,
    /// The end has been asked for.
    pub(crate) broken_off: bool,
    /// Decides about faults on purpose, if there are any. Its own: storms without them are what they were.
    pub(crate) mischief: Option<Dice>,
    /// Decides about the pace, if operators change it.
    pub(crate) pacer: Option<Dice>,
    /// Decides about the deaths of daemons and worlds, if there are any.
    pub(crate) succession: Option<Dice>,
}

/// What a storm came to.
#[derive(PartialEq, Debug)]
pub(crate) struct Came {
    /// Hash of everything that happened.
    pub(crate) trace: u64,
    pub(crate) coverage: Coverage,
    pub(crate) outcome: Outcome,
}

/// Whose turn it is. Of those that want to run at the same time, the first one in here does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Turn {
    World,
    Daemon,
    Agent(usize),
    Weather,
}

impl Fleet {
    pub(crate) fn new(seed: u64, plan: Plan) -> Fleet {
        let slots = plan.scenario.fleet.max_robots;
        let mut shared = Shared::new(seed, slots, plan.orders_bytes, plan.notices_bytes);
        shared.calm = plan.calm_tick == 0;
        let (mut kernel, mut operators) = (Kernel::default(), Operators::default());
        let world = WorldProcess::new(&plan.scenario, &mut shared);
        let daemon = Daemon::new(&plan.scenario, &mut kernel, &mut operators, &mut shared);
        let (gust, pause_ms) = (shared.now + 50 * MS, plan.pause_ms);
        Fleet {
            shared,
            kernel,
            operators,
            daemon,
            world,
            daemon_stopped: 0,
            world_stopped: 0,
            guests: 0,
            pause_ms,
            plan,
            gust,
            broken_off: false,
            mischief: None,
            pacer: None,
            succession: None,
        }
    }

    /// Operators put faults on robots, too.
    pub(crate) fn with_mischief(self, seed: u64) -> Fleet {
        Fleet { mischief: Some(Dice::new(seed ^ 0x6661_756c)), ..self }
    }

    /// Operators change the pace, too.
    pub(crate) fn with_pace(self, seed: u64) -> Fleet {
        Fleet { pacer: Some(Dice::new(seed ^ 0x7061_6365)), ..self }
    }

    /// Lets it blow until all is over.
    pub(crate) fn run(mut self) -> Came {
        while !self.daemon.has_finished {
            self.step();
            assert!(self.shared.coverage.turns < TURNS_MAX, "the run does not end");
        }
        // A run whose robots have all arrived is over immediately.
        if self.world.world.tick() == self.plan.scenario.clock.ticks_max {
            checks::nobody_is_lost(&self);
        }
        let restart_limits = if self.succession.is_none() { restarts::are_by_the_policy(&self) } else { 0 };
        checks::tasks_are_kept(&self);
        if self.succession.is_none() {
            checks::tasks_are_followed(&mut self);
        }
        self.check_succession();
        checks::nothing_is_missed_in_silence(&self);
        self.kernel.everybody_ends(&mut self.shared);
        let answers = self.operators.check(&self.world.world, &self.daemon.coordinator);
        let outcome = self.world.world.outcome();
        self.shared.coverage.replayed += replays::is_the_same_again(self.shared.tape.take(), &outcome);
        let mut coverage = self.shared.coverage;
        coverage.count(&outcome.events);
        coverage.orders_full = self.shared.orders.refusals;
        coverage.notices_full = self.shared.notices.refusals;
        coverage.notices_left_out = self.shared.missed.entries;
        coverage.notices_lost = self.shared.missed.others;
        coverage.tasks_acknowledged = answers.tasks;
        coverage.tasks_cancelled = answers.cancelled;
        coverage.robots_acknowledged = answers.robots;
        coverage.restarts_acknowledged = answers.restarted;
        coverage.removals_acknowledged = answers.removed;
        coverage.faults_acknowledged = answers.faults;
        coverage.paces_acknowledged = answers.paces;
        coverage.refused = answers.refused;
        coverage.unconfirmed = answers.unconfirmed;
        coverage.restart_limits = restart_limits;
        coverage.broken_off = u64::from(self.broken_off);
        Came { trace: self.shared.trace, coverage, outcome }
    }

    pub(crate) fn step(&mut self) {
        let (at, turn) = self.next();
        self.shared.now = self.shared.now.max(at);
        self.shared.note(self.shared.now);
        self.shared.coverage.turns += 1;
        match turn {
            Turn::World => self.world.turn(&mut self.shared),
            Turn::Daemon => self.daemon.turn(&mut self.kernel, &mut self.operators, &mut self.shared),
            Turn::Agent(index) => self.kernel.run(index, &mut self.shared),
            Turn::Weather => {
                if !self.shared.calm {
                    self.rage();
                    self.harm();
                    self.succeed();
                }
                self.change_pace();
                self.gust = self.next_gust();
            }
        }
        self.begin_world();
        self.call();
        let tick = self.world.world.tick();
        if tick >= self.plan.calm_tick && !self.shared.calm {
            self.calm_down();
        }
        if self.plan.break_off.is_some_and(|at| at <= tick) && !std::mem::replace(&mut self.broken_off, true) {
            self.daemon.interrupts = 1;
            self.daemon.wake = self.shared.now;
        }
        if !self.shared.world_ended {
            checks::bounds(self);
            if checks::is_drained(self) {
                self.shared.coverage.drained += 1;
                checks::agreement(self);
            }
        }
    }

    fn next(&self) -> (u64, Turn) {
        let agent = self.kernel.next().map(|(at, index)| (at, Turn::Agent(index)));
        let weather = (!self.shared.calm || self.pacer.is_some()).then_some((self.gust, Turn::Weather));
        let turns = [
            Some((self.world.wake.max(self.world_stopped), Turn::World)),
            Some((self.daemon.wake.max(self.daemon_stopped), Turn::Daemon)),
            self.shared.estate.world_begins.map(|at| (at, Turn::World)),
            agent,
            weather,
        ];
        turns.into_iter().flatten().min().expect("the daemon has a heartbeat")
    }

    /// Wakes those who were called in the turn that has just been taken.
    fn call(&mut self) {
        let calls = std::mem::take(&mut self.shared.calls);
        let soon = self.shared.now + self.shared.dice.between_ms(0, 4);
        // The periods of a `realtime` world are its own.
        let waits = self.plan.scenario.clock.mode != Mode::Realtime || self.world.waits_for_calls();
        if calls.world && waits && !self.world.has_ended() {
            self.world.wake = self.world.wake.min(soon);
        }
        if calls.daemon {
            self.daemon.wake = self.daemon.wake.min(soon);
        }
        if calls.agents {
            self.kernel.call_agents(&mut self.shared);
        }
    }
}
