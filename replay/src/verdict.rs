//! What a replay came to.

use serde::Serialize;

/// Where a record and its replay are not the same.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// The tick.
    pub tick: u64,
    /// Name of the robot, or of the moving obstacle, if it is about one.
    pub robot: Option<String>,
    /// What differs.
    pub field: String,
    /// What the record says.
    pub recorded: String,
    /// What the replay came to.
    pub replayed: String,
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let robot = self.robot.as_ref().map(|robot| format!(", robot `{robot}`")).unwrap_or_default();
        write!(f, "tick {}{robot}, {}: recorded {}, replayed {}", self.tick, self.field, self.recorded, self.replayed)
    }
}

/// Why the commands of a robot cannot be computed again.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Why {
    /// Its method is not one of this executable.
    Planner(String),
    /// Its executable was not shoal's own, and computes something else.
    OwnExecutable,
    /// Notes of its agent are missing in the record.
    NotesLost,
    /// Its agent used odometry that is older than what a replay keeps.
    TooOld,
    /// It heard a robot whose poses are not known.
    Heard(String),
    /// It did not answer a tick in which it took part.
    NotAnswered,
    /// Its agent planned although the world had not shown it.
    NotThere,
}

impl std::fmt::Display for Why {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Why::Planner(error) => write!(f, "{error}"),
            Why::OwnExecutable => write!(f, "its executable is not shoal's own"),
            Why::NotesLost => write!(f, "notes of its agent are missing in the record"),
            Why::TooOld => write!(f, "its agent used odometry that is too old to be put together again"),
            Why::Heard(robot) => write!(f, "it heard `{robot}`, whose poses cannot be computed"),
            Why::NotAnswered => write!(f, "it did not answer a tick"),
            Why::NotThere => write!(f, "its agent planned in a tick in which it does not take part"),
        }
    }
}

/// A robot instance whose commands were taken from the record.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Unverified {
    /// Name of the robot.
    pub robot: String,
    /// Its incarnation.
    pub incarnation: u32,
    /// From this tick on.
    pub tick: u64,
    /// Why.
    pub why: Why,
    /// The number of commands.
    pub commands: u64,
}

/// What a replay came to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// Ticks that were computed.
    pub ticks: u64,
    /// Frames that were compared.
    pub frames: u64,
    /// Steps of agents that were computed.
    pub steps: u64,
    /// Commands that were compared with what agents computed.
    pub commands: u64,
    /// Events that were compared.
    pub events: u64,
    /// Hash over all ticks, as the replay has it.
    pub trajectory_hash: u64,
    /// The record has its end, and it was compared.
    pub is_whole: bool,
    /// The tick from which on the record does not hold the inputs of the world, and why.
    pub ends_early: Option<(u64, String)>,
    /// Robots whose commands were not computed.
    pub unverified: Vec<Unverified>,
    /// The first difference, by tick.
    pub first: Option<Difference>,
    /// The number of differences; after the first one, most follow from it.
    pub differences: u64,
}

/// The differences found so far.
#[derive(Default)]
pub(crate) struct Differences {
    pub(crate) count: u64,
    /// With its rank among those of its tick.
    first: Option<(u8, Difference)>,
}

/// Of several differences in a tick, the one that the others follow from comes first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub(crate) enum Rank {
    Frame,
    Inputs,
    Event,
    Said,
    Command,
    Outcome,
}

impl Differences {
    pub(crate) fn add(
        &mut self,
        rank: Rank,
        tick: u64,
        robot: Option<String>,
        field: impl Into<String>,
        [recorded, replayed]: [String; 2],
    ) {
        self.count += 1;
        let is_first = self.first.as_ref().is_none_or(|(best, first)| (tick, rank as u8) < (first.tick, *best));
        if is_first {
            let difference = Difference { tick, robot, field: field.into(), recorded, replayed };
            self.first = Some((rank as u8, difference));
        }
    }

    pub(crate) fn into_first(self) -> Option<Difference> {
        self.first.map(|(_, difference)| difference)
    }
}
