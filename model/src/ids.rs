//! Who is who in a fleet.

use serde::{Deserialize, Serialize};

/// One life of one robot's process. Slots name robots for the length of a run; the incarnation counts how often
/// the robot's process was started before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Seat {
    /// The robot's slot.
    pub slot: u32,
    /// How often its process was started before.
    pub incarnation: u32,
}
