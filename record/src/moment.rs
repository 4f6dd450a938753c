//! What is recorded: a [`Moment`] is everything that is new when a tick has been opened.

use crate::frame::Body;
use model::{Event, Robot, RobotIndex, RobotInstance};

/// Who was told something.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum InputSource {
    /// The world.
    World,
    /// The process of a robot.
    Robot(RobotInstance),
}

impl InputSource {
    /// As the messages of `shoal.input` have it: 0, or the slot plus 1; and the incarnation.
    pub(crate) fn numbers(self) -> (u64, u64) {
        match self {
            InputSource::World => (0, 0),
            InputSource::Robot(instance) => (u64::from(instance.index.0) + 1, instance.incarnation.into()),
        }
    }

    pub(crate) fn from_numbers(source: u64, incarnation: u64) -> Option<InputSource> {
        let Some(slot) = source.checked_sub(1) else { return Some(InputSource::World) };
        let index = RobotIndex(u32::try_from(slot).ok()?);
        Some(InputSource::Robot(RobotInstance { index, incarnation: u32::try_from(incarnation).ok()? }))
    }
}

/// A robot that came to a slot while the fleet ran.
#[derive(Clone, Debug, PartialEq)]
pub struct Added {
    /// The first tick that shows it.
    pub tick: u64,
    /// Its slot.
    pub index: RobotIndex,
    /// The robot.
    pub robot: Robot,
}

/// Where everything is when a tick has been opened, and what happened since the moment before.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moment {
    /// The tick.
    pub tick: u64,
    /// Robots that have arrived.
    pub arrived: u32,
    /// Contacts so far.
    pub contacts: u64,
    /// Robots by slot, then moving obstacles.
    pub bodies: Vec<Body>,
    /// New entries of the log.
    pub events: Vec<Event>,
    /// Robots that came.
    pub added: Vec<Added>,
    /// What processes were told: tick, source, and where its bytes end in `input_bytes`.
    pub inputs: Vec<(u64, InputSource, usize)>,
    /// The bytes of all inputs, one after the other.
    pub input_bytes: Vec<u8>,
}

impl Moment {
    /// Empties it; its memory stays.
    pub(crate) fn clear(&mut self) {
        self.bodies.clear();
        self.events.clear();
        self.added.clear();
        self.inputs.clear();
        self.input_bytes.clear();
    }

    /// Notes what a process was told at a tick.
    pub fn input(&mut self, tick: u64, source: InputSource, bytes: &[u8]) {
        self.input_bytes.extend_from_slice(bytes);
        self.inputs.push((tick, source, self.input_bytes.len()));
    }
}
