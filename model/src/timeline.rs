//! What happens while a run goes on, by a plan: the timeline of a scenario, and faults on purpose, which operators ask for
//! as well.

use crate::kind::LARGE;
use crate::radio::Radio;
use crate::task::Task;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Something that happens at the beginning of a tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimelineEvent {
    /// The tick.
    pub tick: u64,
    /// What happens.
    pub what: TimelineAction,
}

/// What can happen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum TimelineAction {
    /// The robot of this slot enters the world; before that it is not there.
    Join {
        /// Slot of the robot.
        robot: usize,
    },
    /// The robot goes, and is gone.
    Leave {
        /// Slot of the robot.
        robot: usize,
    },
    /// The robot is given a goal.
    Task {
        /// Slot of the robot.
        robot: usize,
        /// The goal.
        task: Task,
    },
    /// Something is done to the robot, or ends.
    Fault {
        /// Slot of the robot.
        robot: usize,
        /// What is done.
        fault: Fault,
        /// For this many ticks, at least one; `None`: until the robot is resumed. Counts for faults that last.
        ticks: Option<u64>,
    },
    /// The radio changes from now on, for one receiver or for all.
    Radio {
        /// Slot of the receiver; `None` is all.
        robot: Option<usize>,
        /// What it is from now on.
        radio: Radio,
    },
}

impl TimelineAction {
    /// The robot's process is killed.
    pub const fn kill(robot: usize) -> TimelineAction {
        TimelineAction::Fault { robot, fault: Fault::Kill, ticks: None }
    }

    /// The robot's process is stopped for some ticks.
    pub const fn pause(robot: usize, ticks: u64) -> TimelineAction {
        TimelineAction::Fault { robot, fault: Fault::Pause, ticks: Some(ticks) }
    }
}

/// A fault on purpose: something that is done to one robot. A second one of the same kind takes the place of the first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Fault {
    /// Its process is killed (SIGKILL): absent from this tick on, its body stays. A restart is a matter of the scenario.
    Kill,
    /// Its process is stopped (SIGSTOP): it stands still and is silent.
    Pause,
    /// Whatever was done to it ends: it goes on if it is paused, and every other fault that lasts is over.
    Resume,
    /// No robot hears it.
    Mute,
    /// What it hears comes late, on top of the one tick that every pose takes.
    Delay {
        /// By this many ticks.
        ticks: u32,
    },
    /// A part of what it would hear is lost.
    Drop {
        /// This share of the poses, 0 to 1.
        share: f64,
    },
    /// The positions that it hears are wrong.
    Noise {
        /// Standard deviation of the error per axis, m.
        sigma_m: f64,
    },
    /// Every plan of its method takes longer, in wall time. `single` has no processes, and takes no longer.
    SlowCpu {
        /// By this time, ms.
        ms: f64,
    },
}

impl Fault {
    /// The largest [`Fault::SlowCpu`], ms.
    pub const SLOW_MS_MAX: f64 = 1000.0;

    /// Its word in scenarios and on the command line.
    pub fn word(&self) -> &'static str {
        match self {
            Fault::Kill => "kill",
            Fault::Pause => "pause",
            Fault::Resume => "resume",
            Fault::Mute => "mute",
            Fault::Delay { .. } => "delay",
            Fault::Drop { .. } => "drop",
            Fault::Noise { .. } => "noise",
            Fault::SlowCpu { .. } => "slow-cpu",
        }
    }

    /// Whether it goes on until its end comes; the others happen and are over.
    pub fn lasts(&self) -> bool {
        !matches!(self, Fault::Kill | Fault::Resume)
    }

    /// What is wrong with its number, if anything is: scenarios have the same limits.
    pub fn problem(&self) -> Option<String> {
        let within = |number: f64, max: f64, unit: &str| {
            let fits = (0.0..=max).contains(&number);
            (!fits).then(|| format!("{}: {number}{unit} is not between 0 and {max}{unit}", self.word()))
        };
        match *self {
            Fault::Kill | Fault::Pause | Fault::Resume | Fault::Mute => None,
            Fault::Delay { ticks } => within(ticks.into(), Radio::DELAY_TICKS_MAX.into(), " ticks"),
            Fault::Drop { share } => within(share, 1.0, ""),
            Fault::Noise { sigma_m } => within(sigma_m, LARGE, " m"),
            Fault::SlowCpu { ms } => within(ms, Fault::SLOW_MS_MAX, " ms"),
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Fault::Kill | Fault::Pause | Fault::Resume | Fault::Mute => f.write_str(self.word()),
            Fault::Delay { ticks } => write!(f, "delay of {ticks} ticks"),
            Fault::Drop { share } => write!(f, "drop of {share}"),
            Fault::Noise { sigma_m } => write!(f, "noise of {sigma_m} m"),
            Fault::SlowCpu { ms } => write!(f, "slow-cpu of {ms} ms"),
        }
    }
}

/// Who wanted a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FaultSource {
    /// The timeline of the scenario.
    Timeline,
    /// An operator.
    Operator,
}

impl fmt::Display for FaultSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            FaultSource::Timeline => "timeline",
            FaultSource::Operator => "operator",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_limits_of_a_scenario() {
        let fine = [
            Fault::Kill,
            Fault::Delay { ticks: 255 },
            Fault::Drop { share: 0.0 },
            Fault::Drop { share: 1.0 },
            Fault::Noise { sigma_m: 1e6 },
            Fault::SlowCpu { ms: 0.5 },
        ];
        assert!(fine.iter().all(|fault| fault.problem().is_none()));
        let wrong = [
            (Fault::Delay { ticks: 256 }, "delay: 256 ticks is not between 0 and 255 ticks"),
            (Fault::Drop { share: 1.01 }, "drop: 1.01 is not between 0 and 1"),
            (Fault::Drop { share: f64::NAN }, "drop: NaN is not between 0 and 1"),
            (Fault::Noise { sigma_m: -0.1 }, "noise: -0.1 m is not between 0 and 1000000 m"),
            (Fault::Noise { sigma_m: f64::INFINITY }, "noise: inf m is not between 0 and 1000000 m"),
            (Fault::SlowCpu { ms: 1e9 }, "slow-cpu: 1000000000 ms is not between 0 and 1000 ms"),
        ];
        for (fault, problem) in wrong {
            assert_eq!(fault.problem().as_deref(), Some(problem));
        }
    }
}
