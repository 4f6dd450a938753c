//! Faults on purpose that last: what is on a robot, and until when. Pauses are not among them: they are states of its
//! life ([`presence`](crate::presence)).

use model::{Fault, Radio};
use protocol::world_to_robot::Impairment;
use serde::{Deserialize, Serialize};

/// The faults of one robot.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Faults {
    /// Its radio, as the scenario and its timeline have it.
    pub(crate) radio: Radio,
    /// At most one of each kind, with the tick at which it ends; `None`: when the robot is resumed.
    on: Vec<(Fault, Option<u64>)>,
}

impl Faults {
    /// A robot without faults, with this radio.
    pub(crate) fn none(radio: Radio) -> Faults {
        Faults { radio, on: Vec::new() }
    }

    /// Puts a fault on the robot, in place of one of the same kind.
    pub(crate) fn put(&mut self, fault: Fault, until: Option<u64>) {
        self.on.retain(|(known, _)| known.word() != fault.word());
        self.on.push((fault, until));
    }

    /// Takes off the faults whose end is such.
    pub(crate) fn lift(&mut self, ends: impl Fn(Option<u64>) -> bool) -> Vec<Fault> {
        let (over, on) = std::mem::take(&mut self.on).into_iter().partition(|(_, until)| ends(*until));
        self.on = on;
        let over: Vec<(Fault, Option<u64>)> = over;
        over.into_iter().map(|(fault, _)| fault).collect()
    }

    /// The tick at which the next one ends by itself.
    pub(crate) fn next_end(&self) -> Option<u64> {
        self.on.iter().filter_map(|(_, until)| *until).min()
    }

    /// Whether no robot hears this one.
    pub(crate) fn is_mute(&self) -> bool {
        self.on.iter().any(|(fault, _)| *fault == Fault::Mute)
    }

    /// What is done to the robot's radio, and to its processor.
    pub(crate) fn impairment(&self) -> Impairment {
        let mut impairment = Impairment::new(self.radio, 0);
        for (fault, _) in &self.on {
            match *fault {
                Fault::Delay { ticks } => impairment.delay_ticks = ticks,
                Fault::Drop { share } => impairment.drop = share,
                Fault::Noise { sigma_m } => impairment.noise_m = sigma_m,
                Fault::SlowCpu { ms } => impairment.slow_us = (ms * 1000.0).round() as u32,
                Fault::Mute | Fault::Kill | Fault::Pause | Fault::Resume => {}
            }
        }
        impairment
    }
}
