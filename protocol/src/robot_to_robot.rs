//! What a robot tells every robot that hears it: its own pose, where it will be a tick later, what it promises and what it intends;
//! and, where messages may be late or lost, where the borders between it and others are.
//!
//! Intentions are up to its method. Who does not tell any is known by its pose and its command alone.

use iceoryx2::prelude::ZeroCopySend;

/// A robot's own account of itself at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.SharedPose.v6")]
pub struct SharedPose {
    /// The tick that it describes.
    pub tick: u64,
    /// When it was written, monotonic clock, ns. Zero: never.
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
    /// Body radius, m; of an arm, half the thickness of its links.
    pub radius_m: f64,
    /// Joint angles of an arm, the one at the base first, rad; zero for everybody else.
    pub joints_rad: [f64; 2],
    /// Distance to its goal, m: the scalar behind right of way.
    pub remaining_m: f64,
    /// Where its command of this tick takes it, if the world gets that in time: its position at the next tick, m.
    pub next_x_m: f64,
    /// m.
    pub next_y_m: f64,
    /// The far end of everywhere that it may get to, braking after its command, with [`SharedPose::FLAG_PROMISE`], m.
    pub far_x_m: f64,
    /// m.
    pub far_y_m: f64,
    /// How far it may be beside the line to there, m.
    pub spare_m: f32,
    /// The greatest way on which it comes to rest, m.
    pub brake_m: f32,
    /// What it intends, with [`SharedPose::FLAG_INTENT`].
    pub intent: SharedIntent,
    /// For who watches: the part of its plan that pulls to its goal, x and y, in the unit of its method; zero if there is none.
    pub pull: [f32; 2],
    /// The part that pushes away from things.
    pub push: [f32; 2],
    /// See the `FLAG_*` constants.
    pub flags: u32,
    /// Its greatest speed, m/s.
    pub speed_mps_max: f32,
}

/// What a robot intends, as its method says.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.SharedIntent.v2")]
pub struct SharedIntent {
    /// The velocity that it would have if it were alone, m/s.
    pub wish_x_mps: f64,
    /// m/s.
    pub wish_y_mps: f64,
    /// Length of the way to its goal that is left, m.
    pub left_m: f64,
    /// Of two that are stuck in each other's way, the one with the greater rank goes first; below 0 once it has been at its goal.
    pub rank: f64,
    /// The next corner of its way, with [`SharedPose::FLAG_CORNER`], m.
    pub corner_x_m: f64,
    /// m.
    pub corner_y_m: f64,
    /// The share of its speed that it has lost lately.
    pub slow: f32,
    /// The share of its headway that it has lost lately.
    pub lag: f32,
}

impl SharedPose {
    /// It has reached its last goal.
    pub const FLAG_ARRIVED: u32 = 1;
    /// It stands still on purpose: its planner says so.
    pub const FLAG_STOPPED: u32 = 2;
    /// There is a pose here: a board that was just made holds none.
    pub const FLAG_SPOKEN: u32 = 4;
    /// Where it will be at the next tick is known.
    pub const FLAG_NEXT: u32 = 8;
    /// It says what it intends.
    pub const FLAG_INTENT: u32 = 16;
    /// Its way has a corner before the goal.
    pub const FLAG_CORNER: u32 = 32;
    /// It makes room for one that has way.
    pub const FLAG_YIELDS: u32 = 128;
    /// It has a filter, and promises where it stays.
    pub const FLAG_PROMISE: u32 = 64;

    /// Whether a flag is set.
    pub fn has(&self, flag: u32) -> bool {
        self.flags & flag != 0
    }
}

/// What a robot tells another one about the border between the two.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.SharedBorder.v2")]
pub struct SharedBorder {
    /// Which offer, or the number of the one that is accepted: the tick in which it was made.
    pub number: u64,
    /// The direction from the one that offers to the other one, of length 1.
    pub normal_x: f64,
    /// Its other part.
    pub normal_y: f64,
    /// Where the border is in that direction, m.
    pub offset_m: f64,
    /// To whom this is said: its slot.
    pub robot: u32,
    /// And its life.
    pub incarnation: u32,
    /// Which form, see the `FORM_*` constants.
    pub form: u32,
    /// With an accepted offer: how many ticks later the newest one was made that has been heard of. None before that will be
    /// accepted any more.
    pub heard_after: u32,
}

impl SharedBorder {
    /// Nothing.
    pub const FORM_NONE: u32 = 0;
    /// A border is offered.
    pub const FORM_LINE: u32 = 1;
    /// It is offered to have none.
    pub const FORM_APART: u32 = 2;
    /// An offer is accepted.
    pub const FORM_ACCEPTED: u32 = 3;
}

/// All that a robot says about borders in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.SharedBorders.v2")]
pub struct SharedBorders {
    /// The tick of the pose that it belongs to.
    pub tick: u64,
    /// The first ones are to robots that leave the least room; the rest is empty.
    pub borders: [SharedBorder; SharedBorders::MAX],
}

impl SharedBorders {
    /// To how many robots one can talk in a tick.
    pub const MAX: usize = 16;

    /// What is said to this robot; a form of nothing if nothing is.
    pub fn to(&self, robot: u32, incarnation: u32) -> SharedBorder {
        let said = self.borders.iter().find(|border| {
            border.form != SharedBorder::FORM_NONE && border.robot == robot && border.incarnation == incarnation
        });
        said.copied().unwrap_or_default()
    }
}

/// The last two poses, or the newest alone. In `lockstep` a neighbour may or may not have spoken in this tick already; with
/// two poses the one of the tick before is always there, whoever ran first.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.PosePair.v5")]
pub struct PosePair {
    /// The newest pose.
    pub newest: SharedPose,
    /// The one before it.
    pub previous: SharedPose,
}

impl PosePair {
    /// Adds a pose; the older of the two goes.
    pub fn push(&mut self, pose: SharedPose) {
        self.previous = self.newest;
        self.newest = pose;
    }

    /// The newest pose of a tick before `tick`, if there is one.
    pub fn before(&self, tick: u64) -> Option<&SharedPose> {
        [&self.newest, &self.previous].into_iter().find(|pose| pose.has(SharedPose::FLAG_SPOKEN) && pose.tick < tick)
    }
}
