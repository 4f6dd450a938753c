//! The inputs of a world, for a record: everything that it is told, call by call, from which a replay tells another one
//! the same.

use super::World;
use model::RobotInstance;
use protocol::inputs::{WorldInput, WorldInputs};

impl World {
    /// Keeps from now on what it is told. To be called before the first tick.
    pub fn keep_inputs(&mut self) {
        self.tape.get_or_insert_default();
    }

    /// What it was told since the last call, if it keeps that.
    pub fn take_inputs(&mut self) -> Option<WorldInputs> {
        let tape = self.tape.as_mut()?;
        let next = WorldInputs { number: tape.number + 1, inputs: Vec::with_capacity(tape.inputs.len()) };
        Some(std::mem::replace(tape, next))
    }

    /// The command of this robot was written in this step of its agent, which is named by its stamp, monotonic clock, ns.
    /// It is kept, and changes nothing.
    pub fn commanded(&mut self, instance: RobotInstance, stamp_ns: u64) {
        self.keep(|| WorldInput::Commanded { instance, stamp_ns });
    }

    pub(super) fn keep(&mut self, input: impl FnOnce() -> WorldInput) {
        if let Some(tape) = &mut self.tape {
            tape.inputs.push(input());
        }
    }
}
