//! Who is who in a fleet.

use serde::{Deserialize, Serialize};
use std::fmt;

/// The number of a robot in its fleet: robots of the scenario in its order, then those that were added. It names the robot
/// for the length of a run, and is its place in every list of robots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
#[repr(transparent)]
pub struct RobotIndex(pub u32);

impl RobotIndex {
    /// The robot at this place in a list of robots; lists are bounded ([`MAX_ROBOTS`](crate::MAX_ROBOTS)).
    pub const fn of(place: usize) -> RobotIndex {
        RobotIndex(place as u32)
    }

    /// Its place in a list of robots.
    pub const fn at(self) -> usize {
        self.0 as usize
    }
}

impl fmt::Display for RobotIndex {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// One process of one robot. The incarnation counts how often the robot's process was started before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct RobotInstance {
    /// Which robot.
    pub index: RobotIndex,
    /// How often its process was started before.
    pub incarnation: u32,
}
