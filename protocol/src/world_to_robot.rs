//! What the world tells one robot: where it is and where to go, whom it hears and how well, what it sees.
//!
//! All of these are entries of the world's board. The odometry is written every tick, the others when they change.

use iceoryx2::prelude::ZeroCopySend;
use model::{MAX_ROBOTS, MAX_SHAPES, Radio, RobotIndex, RobotInstance};
use serde::{Deserialize, Serialize};

/// Most pieces that can be in sight: every piece of every obstacle, every robot, and the links of arms, whose second
/// links count among the shapes.
pub const MAX_SENSED: usize = MAX_SHAPES + MAX_ROBOTS;

/// Where a robot is, and where it is to go.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.Odometry.v3")]
pub struct Odometry {
    /// Tick of this state.
    pub tick: u64,
    /// When it was written, monotonic clock, ns.
    pub stamp_ns: u64,
    /// Position, m; of an arm, that of its tip.
    pub x_m: f64,
    /// Position, m.
    pub y_m: f64,
    /// Heading, rad; of an arm, the direction of its last link.
    pub yaw_rad: f64,
    /// Velocity in the world frame, m/s.
    pub vx_mps: f64,
    /// Velocity in the world frame, m/s.
    pub vy_mps: f64,
    /// Turn rate, rad/s; of an arm, that of its last link.
    pub turn_radps: f64,
    /// Joint angles of an arm, the one at the base first, rad; zero for everybody else.
    pub joints_rad: [f64; 2],
    /// Where the goal is now, m.
    pub goal_x_m: f64,
    /// Where the goal is now, m.
    pub goal_y_m: f64,
    /// The heading that the robot is to have there, rad; it counts with [`Odometry::FLAG_GOAL_YAW`].
    pub goal_yaw_rad: f64,
    /// Which life of the robot this is for.
    pub incarnation: u32,
    /// Goals reached so far.
    pub goals_done: u32,
    /// Goals left, the present one included.
    pub goals_left: u32,
    /// What the robot is to do, see the `FLAG_*` constants.
    pub flags: u32,
}

impl Odometry {
    /// The robot takes part in this tick: it plans, speaks and is expected to answer.
    pub const FLAG_PRESENT: u32 = 1;
    /// The last goal has been reached.
    pub const FLAG_ARRIVED: u32 = 2;
    /// The robot has left for good: its process should end.
    pub const FLAG_LEFT: u32 = 4;
    /// The goal has a heading.
    pub const FLAG_GOAL_YAW: u32 = 8;

    /// Whether a flag is set.
    pub fn has(&self, flag: u32) -> bool {
        self.flags & flag != 0
    }
}

/// A robot in radio range.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend, Serialize, Deserialize)]
#[repr(C)]
#[type_name("shoal.NeighborRef.v1")]
pub struct NeighborRef {
    /// Its index.
    pub index: u32,
    /// Its incarnation: the board to read has this in its name.
    pub incarnation: u32,
}

impl From<RobotInstance> for NeighborRef {
    fn from(RobotInstance { index, incarnation }: RobotInstance) -> NeighborRef {
        NeighborRef { index: index.0, incarnation }
    }
}

impl From<NeighborRef> for RobotInstance {
    fn from(NeighborRef { index, incarnation }: NeighborRef) -> RobotInstance {
        RobotInstance { index: RobotIndex(index), incarnation }
    }
}

/// What the radio and faults on purpose do to a robot: how well it hears, and how fast it computes.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.Impairment.v1")]
pub struct Impairment {
    /// Share of the poses that get lost, 0 to 1.
    pub drop: f64,
    /// Standard deviation of the error on a received position, m, per axis.
    pub noise_m: f64,
    /// Poses are heard late by this many ticks.
    pub delay_ticks: u32,
    /// Every plan takes longer by this time, µs.
    pub slow_us: u32,
}

impl Impairment {
    /// That of a robot with this radio, whose plans take longer by `slow_us`.
    pub fn new(radio: Radio, slow_us: u32) -> Impairment {
        let Radio { delay_ticks, drop, noise_m } = radio;
        Impairment { drop, noise_m, delay_ticks, slow_us }
    }

    /// The radio in it.
    pub fn radio(&self) -> Radio {
        Radio { delay_ticks: self.delay_ticks, drop: self.drop, noise_m: self.noise_m }
    }
}

/// The robots in radio range, in their order, and after them those that will be heard as soon as they have spoken: their
/// boards can be opened before.
#[derive(Clone, Copy, Debug, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.NeighborList.v2")]
pub struct NeighborList {
    /// How many are heard.
    pub len: u32,
    /// How many come after those.
    pub coming: u32,
    /// The first `len` and `coming` count.
    pub entries: [NeighborRef; MAX_ROBOTS],
}

impl NeighborList {
    /// Nobody.
    pub const EMPTY: NeighborList =
        NeighborList { len: 0, coming: 0, entries: [NeighborRef { index: 0, incarnation: 0 }; MAX_ROBOTS] };

    /// Makes it these, and those that come. What is behind them stays what it was: it does not count, and it is kilobytes.
    ///
    /// # Panics
    /// With more than [`MAX_ROBOTS`] together.
    pub fn set(&mut self, robots: &[NeighborRef], coming: &[NeighborRef]) {
        self.entries[..robots.len()].copy_from_slice(robots);
        self.entries[robots.len()..robots.len() + coming.len()].copy_from_slice(coming);
        (self.len, self.coming) = (robots.len() as u32, coming.len() as u32);
    }

    /// The robots that are heard.
    pub fn as_slice(&self) -> &[NeighborRef] {
        &self.entries[..(self.len as usize).min(MAX_ROBOTS)]
    }

    /// The robots that will be heard.
    pub fn coming(&self) -> &[NeighborRef] {
        let rest = &self.entries[(self.len as usize).min(MAX_ROBOTS)..];
        &rest[..(self.coming as usize).min(rest.len())]
    }
}

/// The pieces in sensor range, by index, sorted.
#[derive(Clone, Copy, Debug, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.SensedList.v1")]
pub struct SensedList {
    /// How many.
    pub len: u32,
    /// Keeps the layout explicit.
    pub reserved: u32,
    /// The first `len` count.
    pub pieces: [u16; MAX_SENSED],
}

impl SensedList {
    /// Nothing.
    pub const EMPTY: SensedList = SensedList { len: 0, reserved: 0, pieces: [0; MAX_SENSED] };

    /// Makes it these. What is behind them stays what it was.
    ///
    /// # Panics
    /// With more than [`MAX_SENSED`].
    pub fn set(&mut self, pieces: &[u16]) {
        self.pieces[..pieces.len()].copy_from_slice(pieces);
        self.len = pieces.len() as u32;
    }

    /// The indices in it.
    pub fn as_slice(&self) -> &[u16] {
        &self.pieces[..(self.len as usize).min(MAX_SENSED)]
    }
}

/// A piece of an obstacle, the body of a robot, or a link of an arm, where it is at this tick.
///
/// Pieces are numbered: first those of the obstacles in the order of the scenario, then the body of each robot:
/// one piece, or the two links of an arm.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.Piece.v2")]
pub struct Piece {
    /// One end of its core, m.
    pub ax_m: f64,
    /// One end of its core, m.
    pub ay_m: f64,
    /// The other end, m.
    pub bx_m: f64,
    /// The other end, m.
    pub by_m: f64,
    /// From the core to the surface, m.
    pub radius_m: f64,
    /// Velocity, m/s; of a link, that of its middle.
    pub vx_mps: f64,
    /// Velocity, m/s.
    pub vy_mps: f64,
    /// The obstacle it belongs to: its index in the scenario, or the number of obstacles plus the index of the robot.
    pub obstacle: u32,
    /// See [`Piece::robot`]: the index of the robot plus one, or 0 for an obstacle.
    pub robot: u32,
}

impl Piece {
    /// The robot whose disc it is, if it is one: who hears that robot as well knows that both are one body.
    pub fn robot(&self) -> Option<RobotIndex> {
        self.robot.checked_sub(1).map(RobotIndex)
    }
}
