//! What a record keeps besides what happened: what the world and the agents were told, in which order. From it, a replay
//! computes the run again.
//!
//! The world's inputs are values: orders, who was ready, commands. An agent's are references: of which tick its odometry
//! was, and which pose of each neighbour it had ([`StepNote`]). A replay has computed the values itself; check sums tell
//! whether they are the ones that the agent had.

use crate::daemon_to_world::Order;
use crate::world_to_robot::{NeighborRef, Piece};
use model::{Drive, PlanState, Radio, RobotInstance};
use serde::{Deserialize, Serialize};

/// One call of the world, as its shell made it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum WorldInput {
    /// A fact or a wish from outside.
    Order(Order),
    /// The run is over: orders that wait are refused.
    Refused,
    /// A daemon was answered between two ticks.
    Answered,
    /// Orders took effect although no tick opened: the fleet was paused.
    TookEffect,
    /// A tick was opened.
    Opened {
        /// Of the robot instances that were to enter, those that were ready.
        ready: Vec<RobotInstance>,
    },
    /// Time stood still for the world's process.
    StoodStill {
        /// For how long, ms.
        lost_ms: u64,
    },
    /// The world went on in place of another one. No replay gets beyond this.
    WentOn {
        /// The number of ticks that the other one had simulated more.
        ticks: u64,
        /// How long there was no world, ms.
        away_ms: u64,
    },
    /// A robot that was held answers again.
    Back(RobotInstance),
    /// What came with the command of a robot.
    Planned {
        /// The robot instance.
        instance: RobotInstance,
        /// Whether its method has a plan.
        state: PlanState,
        /// How much its filter has changed the command, in greatest speeds.
        filtered: f64,
    },
    /// Which step of its agent the command of a robot comes from.
    Commanded {
        /// The robot instance.
        instance: RobotInstance,
        /// When the command was written, monotonic clock, ns.
        stamp_ns: u64,
    },
    /// The tick was closed.
    Closed {
        /// The commands of those that took part, in their order.
        drives: Vec<Option<Drive>>,
    },
}

/// Inputs of the world that belong together in a record, numbered: one that is missing is missed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WorldInputs {
    /// 0 for the first of a run.
    pub number: u64,
    /// The inputs, in their order.
    pub inputs: Vec<WorldInput>,
}

/// What an agent tells the record.
#[derive(Clone, Debug, PartialEq)]
pub enum AgentNote {
    /// It has begun.
    Began {
        /// Its executable is not shoal's own: what it computes may be another method's.
        is_own: bool,
    },
    /// It has planned.
    Step(StepNote),
    /// This number of notes before this one found no room.
    Lost(u64),
}

/// The inputs of one step of an agent, and check sums.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepNote {
    /// The tick of its odometry.
    pub tick: u64,
    /// When it woke up, monotonic clock, ns; `None` where ages are ticks.
    pub now_ns: Option<u64>,
    /// When its pose and its command were written, monotonic clock, ns: it names the step.
    pub stamp_ns: u64,
    /// Whom it heard, in the order of robots.
    pub heard: Vec<HeardNote>,
    /// What else it had, if the world went on while it read: then that may be of a later tick.
    pub between: Option<BetweenTicks>,
    /// Check sum over the values of all its inputs.
    pub inputs_sum: u64,
    /// Check sum over what it said and asked for.
    pub outputs_sum: u64,
}

/// What was heard of one neighbour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HeardNote {
    /// Which robot instance.
    pub who: NeighborRef,
    /// The step in which it said that; zero: it has not said anything yet.
    pub stamp_ns: u64,
    /// Check sum over what it says about the border to this robot; `None` if nothing.
    pub border_sum: Option<u16>,
}

/// What an agent was told of the world while that changed, as values.
#[derive(Clone, Debug, PartialEq)]
pub struct BetweenTicks {
    /// Its radio.
    pub radio: Radio,
    /// What it saw, sorted by piece index.
    pub pieces: Vec<Piece>,
}

const BEGAN: u8 = 1;
const STEP: u8 = 2;
const LOST: u8 = 3;

const HAS_NOW: u64 = 1;
const IS_BETWEEN: u64 = 2;

const HAS_INCARNATION: u64 = 1;
const HAS_BORDER: u64 = 2;
const HAS_SPOKEN: u64 = 4;

impl AgentNote {
    /// Appends it as bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        match self {
            AgentNote::Began { is_own } => out.extend([BEGAN, u8::from(*is_own)]),
            AgentNote::Step(step) => step.encode(out),
            AgentNote::Lost(count) => {
                out.push(LOST);
                put(*count, out);
            }
        }
    }

    /// The note that the bytes hold, all of them; `None` if they hold something else.
    pub fn decode(bytes: &[u8]) -> Option<AgentNote> {
        let mut from = Bytes(bytes);
        let note = match from.byte()? {
            BEGAN => AgentNote::Began { is_own: from.byte()? != 0 },
            STEP => AgentNote::Step(StepNote::decode(&mut from)?),
            LOST => AgentNote::Lost(from.number()?),
            _ => return None,
        };
        from.0.is_empty().then_some(note)
    }
}

impl StepNote {
    /// Appends it as bytes: about six per neighbour.
    pub fn encode(&self, out: &mut Vec<u8>) {
        let has_now = if self.now_ns.is_some() { HAS_NOW } else { 0 };
        let is_between = if self.between.is_some() { IS_BETWEEN } else { 0 };
        out.push(STEP);
        put(has_now | is_between, out);
        put(self.tick, out);
        put(self.stamp_ns, out);
        if let Some(now_ns) = self.now_ns {
            put(self.stamp_ns.wrapping_sub(now_ns), out);
        }
        put(self.heard.len() as u64, out);
        let mut next = 0;
        for heard in &self.heard {
            let NeighborRef { index, incarnation } = heard.who;
            let has_incarnation = if incarnation > 0 { HAS_INCARNATION } else { 0 };
            let has_border = if heard.border_sum.is_some() { HAS_BORDER } else { 0 };
            let has_spoken = if heard.stamp_ns > 0 { HAS_SPOKEN } else { 0 };
            put(u64::from(index.wrapping_sub(next)) << 3 | has_incarnation | has_border | has_spoken, out);
            next = index.wrapping_add(1);
            if incarnation > 0 {
                put(incarnation.into(), out);
            }
            if heard.stamp_ns > 0 {
                put(self.stamp_ns.wrapping_sub(heard.stamp_ns), out);
            }
            out.extend(heard.border_sum.into_iter().flat_map(u16::to_le_bytes));
        }
        if let Some(between) = &self.between {
            put_f64(between.radio.drop, out);
            put_f64(between.radio.noise_m, out);
            put(between.radio.delay_ticks.into(), out);
            put(between.pieces.len() as u64, out);
            for piece in &between.pieces {
                let Piece { ax_m, ay_m, bx_m, by_m, radius_m, vx_mps, vy_mps, obstacle, robot } = *piece;
                [ax_m, ay_m, bx_m, by_m, radius_m, vx_mps, vy_mps].iter().for_each(|value| put_f64(*value, out));
                put(obstacle.into(), out);
                put(robot.into(), out);
            }
        }
        out.extend_from_slice(&self.inputs_sum.to_le_bytes());
        out.extend_from_slice(&self.outputs_sum.to_le_bytes());
    }

    fn decode(from: &mut Bytes<'_>) -> Option<StepNote> {
        let kind = from.number()?;
        let (tick, stamp_ns) = (from.number()?, from.number()?);
        let now_ns = if kind & HAS_NOW != 0 { Some(stamp_ns.wrapping_sub(from.number()?)) } else { None };
        let count = from.number()?;
        let mut heard = Vec::new();
        let mut next = 0_u32;
        for _ in 0..count {
            let word = from.number()?;
            let index = next.wrapping_add(u32::try_from(word >> 3).ok()?);
            next = index.wrapping_add(1);
            let incarnation = if word & HAS_INCARNATION != 0 { u32::try_from(from.number()?).ok()? } else { 0 };
            let said_ns = if word & HAS_SPOKEN != 0 { stamp_ns.wrapping_sub(from.number()?) } else { 0 };
            let border_sum =
                if word & HAS_BORDER != 0 { Some(u16::from_le_bytes([from.byte()?, from.byte()?])) } else { None };
            heard.push(HeardNote { who: NeighborRef { index, incarnation }, stamp_ns: said_ns, border_sum });
        }
        let between = if kind & IS_BETWEEN != 0 { Some(BetweenTicks::decode(from)?) } else { None };
        let (inputs_sum, outputs_sum) = (from.word()?, from.word()?);
        Some(StepNote { tick, now_ns, stamp_ns, heard, between, inputs_sum, outputs_sum })
    }
}

impl BetweenTicks {
    fn decode(from: &mut Bytes<'_>) -> Option<BetweenTicks> {
        let (drop, noise_m) = (from.float()?, from.float()?);
        let radio = Radio { drop, noise_m, delay_ticks: u32::try_from(from.number()?).ok()? };
        let mut pieces = Vec::new();
        for _ in 0..from.number()? {
            pieces.push(Piece {
                ax_m: from.float()?,
                ay_m: from.float()?,
                bx_m: from.float()?,
                by_m: from.float()?,
                radius_m: from.float()?,
                vx_mps: from.float()?,
                vy_mps: from.float()?,
                obstacle: u32::try_from(from.number()?).ok()?,
                robot: u32::try_from(from.number()?).ok()?,
            });
        }
        Some(BetweenTicks { radio, pieces })
    }
}

/// Bytes that are being read.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn byte(&mut self) -> Option<u8> {
        let (byte, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*byte)
    }

    fn word(&mut self) -> Option<u64> {
        let (word, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(u64::from_le_bytes(*word))
    }

    fn float(&mut self) -> Option<f64> {
        self.word().map(f64::from_bits)
    }

    fn number(&mut self) -> Option<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(value);
            }
        }
        None
    }
}

fn put(mut value: u64, out: &mut Vec<u8>) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

fn put_f64(value: f64, out: &mut Vec<u8>) {
    out.extend_from_slice(&value.to_bits().to_le_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heard(index: u32, incarnation: u32, stamp_ns: u64, border_sum: Option<u16>) -> HeardNote {
        HeardNote { who: NeighborRef { index, incarnation }, stamp_ns, border_sum }
    }

    fn step() -> StepNote {
        let stamp_ns = 1_234_567_890_123;
        StepNote {
            tick: 812,
            now_ns: Some(stamp_ns - 40_000),
            stamp_ns,
            heard: vec![
                heard(0, 0, stamp_ns - 9_000_000, None),
                heard(1, 3, stamp_ns - 1, Some(0xabcd)),
                heard(70, 0, 0, None),
                // Nobody says anything after he was heard; and if the clock did that, it would not be lost.
                heard(1023, u32::MAX, stamp_ns + 5, Some(0)),
            ],
            between: None,
            inputs_sum: 7,
            outputs_sum: u64::MAX,
        }
    }

    fn between() -> StepNote {
        let piece = Piece { ax_m: -0.0, by_m: f64::NAN, vx_mps: 1e-300, obstacle: 9, robot: 1, ..Piece::default() };
        let radio = Radio { drop: 0.2, noise_m: 0.01, delay_ticks: 3 };
        StepNote { now_ns: None, between: Some(BetweenTicks { radio, pieces: vec![piece; 2] }), ..step() }
    }

    fn bytes_of(note: &AgentNote) -> Vec<u8> {
        let mut bytes = Vec::new();
        note.encode(&mut bytes);
        bytes
    }

    #[test]
    fn what_is_noted_is_read_to_the_last_bit() {
        let notes = [
            AgentNote::Began { is_own: true },
            AgentNote::Began { is_own: false },
            AgentNote::Lost(300),
            AgentNote::Step(StepNote::default()),
            AgentNote::Step(step()),
            AgentNote::Step(between()),
        ];
        for note in notes {
            let bytes = bytes_of(&note);
            // By bytes: a NaN is not equal to itself.
            assert_eq!(AgentNote::decode(&bytes).map(|read| bytes_of(&read)), Some(bytes), "{note:?}");
            if !format!("{note:?}").contains("NaN") {
                assert_eq!(AgentNote::decode(&bytes_of(&note)), Some(note));
            }
        }
    }

    #[test]
    fn a_neighbour_costs_about_six_bytes() {
        let stamp_ns = 86_400_000_000_000;
        let heard = (0..64).map(|index| heard(index, 0, stamp_ns - 13_000_000, None)).collect();
        let note = StepNote { tick: 100_000, now_ns: Some(stamp_ns - 20_000), stamp_ns, heard, ..StepNote::default() };
        let length = bytes_of(&AgentNote::Step(note)).len();
        assert!(length <= 64 * 5 + 40, "{length} bytes");
    }

    #[test]
    fn parts_of_notes_are_no_notes() {
        for note in [step(), between()] {
            let bytes = bytes_of(&AgentNote::Step(note));
            for length in 0..bytes.len() {
                assert_eq!(AgentNote::decode(&bytes[..length]), None, "{length} of {}", bytes.len());
            }
            assert_eq!(AgentNote::decode(&[&bytes[..], &[0]].concat()), None);
        }
        assert_eq!(AgentNote::decode(&[9]), None);
        // A count of neighbours takes no memory before there are any.
        assert_eq!(AgentNote::decode(&[STEP, 0, 0, 0, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x0f]), None);
    }
}
