//! The radio between robots.

use serde::{Deserialize, Serialize};

/// The radio between robots. Delay, loss and noise act where a pose is received.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Radio {
    /// Poses are heard late by this many ticks, on top of the one tick that every pose takes.
    pub delay_ticks: u32,
    /// Share of poses that get lost, 0 to 1, drawn per receiver, sender and tick.
    pub drop: f64,
    /// Standard deviation of the error on a received position, m, per axis.
    pub noise_m: f64,
}

impl Radio {
    /// The radio as it is without faults.
    pub const PERFECT: Radio = Radio { delay_ticks: 0, drop: 0.0, noise_m: 0.0 };
    /// Longest delay: a receiver remembers this many poses of each neighbour.
    pub const DELAY_TICKS_MAX: u32 = 255;

    /// Whether every pose that comes in range is heard, without an added delay.
    pub fn is_sure(&self) -> bool {
        self.delay_ticks == 0 && self.drop <= 0.0
    }
}
