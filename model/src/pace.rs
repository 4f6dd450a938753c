//! The pace of a fleet in ticks: whether ticks follow one another, and how fast.

use crate::kind::Range;
use serde::{Deserialize, Serialize};

/// Simulated time per wall time to which the ticks of `lockstep` and `single` are held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Rate {
    /// As fast as the processes can.
    #[default]
    Max,
    /// This many times real time, within [`Rate::FACTORS`]. A fleet that cannot keep up goes as fast as it can.
    Factor(f64),
}

impl Rate {
    /// The factors that are possible.
    pub const FACTORS: Range = Range { roomy: false, ..Range::at_least(0.001, 1_000_000.0) };

    /// The factor, if ticks are held to one.
    pub fn factor(self) -> Option<f64> {
        match self {
            Rate::Max => None,
            Rate::Factor(factor) => Some(factor),
        }
    }

    /// Why it is not a rate, if it is none.
    pub fn problem(self) -> Option<String> {
        let factor = self.factor().filter(|factor| !Rate::FACTORS.contains(*factor))?;
        Some(format!("rate {factor} is not {}", Rate::FACTORS))
    }
}

/// What an operator wants of the pace.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum PaceChange {
    /// No further tick opens.
    Pause,
    /// Ticks follow one another again, or go on to.
    Resume {
        /// At this rate from now on; `None`: at the one that there is.
        rate: Option<Rate>,
    },
    /// This many further ticks, at least one, and then none.
    Step {
        /// How many. Those that an operator asked for before and that have not been done come first.
        ticks: u64,
    },
}

/// The pace at this moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PaceState {
    /// Ticks that have been done: the next one to open.
    pub tick: u64,
    /// Simulated time of that, s.
    pub time_s: f64,
    /// No tick opens without an operator.
    pub paused: bool,
    /// While paused: ticks before this one still open, because an operator asked for them; `None`, if there are none.
    pub until_tick: Option<u64>,
    /// How fast ticks follow one another.
    pub rate: Rate,
}
