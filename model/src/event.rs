//! What happened in a run.

use serde::{Deserialize, Serialize};

/// What happened, for the report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// At which tick.
    pub tick: u64,
    /// What: `joined`, `left`, `task`, `task-done`, `arrived`, `contact`, `killed`, `died`, `paused`, `resumed`,
    /// `held`, `dropped`, `restarted`, `not-started`, `deaf`, `radio`, `gap` (time stood still), `ignored`, `off-goal`, ...
    pub kind: String,
    /// Slot of the robot it is about, if it is about one.
    pub slot: Option<u32>,
    /// More about it, for people.
    pub detail: String,
    /// Of a contact, where and when it was.
    pub touch: Option<Touch>,
}

/// The first touch of a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Touch {
    /// Simulated time, s: between the ticks.
    pub t_s: f64,
    /// The point where the surfaces met; of bodies that entered the world overlapping, the middle of the overlap, m.
    pub at_m: [f64; 2],
}

impl Event {
    /// Whether an event of this kind says that a robot lacked something that it needed, so that the run is not that of
    /// its scenario.
    pub fn impairs(kind: &str) -> bool {
        matches!(kind, "not-started" | "deaf")
    }
}
