//! Daemons and worlds that die, and those that come after them: what outlives a process is what the next one has.

use crate::checks;
use crate::daemon::Daemon;
use crate::dice::{Dice, MS};
use crate::fleet::Fleet;
use crate::world::WorldProcess;
use model::{Event, Mode, RobotInstance, TaskId};
use protocol::codec;
use protocol::operator_to_daemon::TaskRecord;
use std::collections::{BTreeMap, BTreeSet};
use world_sim::World;

/// What is not in any process: the database of tasks, the specs of agents, and the last state of the world.
#[derive(Default)]
pub(crate) struct Estate {
    /// The daemon keeps records.
    pub(crate) keeps: bool,
    pub(crate) records: BTreeMap<TaskId, TaskRecord>,
    /// The newest life of each robot that was started.
    pub(crate) specs: BTreeSet<RobotInstance>,
    /// Every life that was ever started.
    pub(crate) started: BTreeSet<RobotInstance>,
    /// The number of daemons that there have been.
    pub(crate) eras: u32,
    checkpoint: Option<(Vec<u8>, Vec<Event>)>,
    /// The world has died, and the daemon is to see to another one.
    pub(crate) world_died: bool,
    /// The daemon has asked how everything stands, and started another world, which begins then, ns.
    pub(crate) world_begins: Option<u64>,
}

impl Estate {
    /// The world leaves its state between two ticks.
    pub(crate) fn leave(&mut self, world: &World) {
        if self.keeps {
            let bytes = codec::encode(&world.checkpoint()).expect("it can be encoded");
            self.checkpoint = Some((bytes, world.events().to_vec()));
        }
    }

    pub(crate) fn start(&mut self, instance: RobotInstance) {
        assert!(self.started.insert(instance), "{instance:?} is started twice");
        self.specs.retain(|before| before.index != instance.index);
        self.specs.insert(instance);
    }
}

impl Fleet {
    /// Its daemons and, in `realtime`, its worlds die as well.
    pub(crate) fn with_successions(mut self, seed: u64) -> Fleet {
        self.shared.estate.keeps = true;
        self.succession = Some(Dice::new(seed ^ 0x7375_6363));
        self.daemon.keep_records();
        self
    }

    /// Now and then one of them dies.
    pub(crate) fn succeed(&mut self) {
        let Some(dice) = &mut self.succession else { return };
        if self.shared.calm || self.broken_off || self.shared.world_ended {
            return;
        }
        let (daemon_dies, world_dies) = (dice.permille(40), dice.permille(40));
        if daemon_dies {
            self.shared.coverage.daemon_deaths += 1;
            let away_ns = dice.between_ms(1, 3000);
            self.shared.tell(|| "weather: the daemon dies".to_owned());
            self.daemon.dies(&mut self.operators);
            self.kernel.lose_parent();
            self.daemon = Daemon::after(&self.daemon, &mut self.kernel, &mut self.shared);
            self.daemon_stopped = self.shared.now + away_ns;
            self.daemon.wake = self.daemon_stopped;
        }
        if world_dies && self.is_realtime() && self.world.runs() && self.shared.estate.checkpoint.is_some() {
            self.shared.coverage.world_deaths += 1;
            self.shared.tell(|| "weather: the world dies".to_owned());
            self.world.dies();
            self.shared.tape = None;
            // What it had taken and not kept goes with it.
            while self.shared.dice.permille(300) && self.shared.orders.pop().is_some() {}
            (self.shared.estate.world_died, self.shared.calls.daemon) = (true, true);
        }
    }

    fn is_realtime(&self) -> bool {
        self.daemon.coordinator.scenario().clock.mode == Mode::Realtime
    }

    /// A world that the daemon has started goes on from what the one before has left.
    pub(crate) fn begin_world(&mut self) {
        let Some(at) = self.shared.estate.world_begins.filter(|at| *at <= self.shared.now) else { return };
        self.shared.estate.world_begins = None;
        let (bytes, events) = self.shared.estate.checkpoint.clone().expect("a world ran before");
        let checkpoint = codec::decode(&bytes).expect("it is whole");
        let scenario = self.daemon.coordinator.scenario().clone();
        let (lost, away_ms) = (self.world.world.tick(), self.shared.now.saturating_sub(at) / MS);
        let mut world = World::resume(&scenario, checkpoint, events).expect("it is of this fleet");
        world.went_on(lost.saturating_sub(world.tick()), away_ms);
        self.world = WorldProcess::after(&scenario, world, &mut self.shared);
    }

    /// What has to be true of tasks in the end, with ticks that are lost.
    pub(crate) fn check_succession(&mut self) {
        if self.succession.is_some() {
            checks::tasks_survive(self);
        }
    }
}
