//! What a robot tells every robot that hears it: its own pose, where it will be a tick later, and what it intends.
//!
//! Intentions are up to its method. Who does not tell any is known by its pose and its command alone.

use iceoryx2::prelude::ZeroCopySend;

/// A robot's own account of itself at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.SharedPose.v3")]
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
    /// What it intends, with [`SharedPose::FLAG_INTENT`].
    pub intent: SharedIntent,
    /// See the `FLAG_*` constants.
    pub flags: u32,
    /// Keeps the layout explicit.
    pub reserved: u32,
}

/// What a robot intends, as its method says.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.SharedIntent.v1")]
pub struct SharedIntent {
    /// The velocity that it would have if it were alone, m/s.
    pub wish_x_mps: f64,
    /// m/s.
    pub wish_y_mps: f64,
    /// Length of the way to its goal that is left, m.
    pub left_m: f64,
    /// Length of that way when it began, m.
    pub way_m: f64,
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

    /// Whether a flag is set.
    pub fn has(&self, flag: u32) -> bool {
        self.flags & flag != 0
    }
}

/// The last two poses, or the newest alone. In `lockstep` a neighbour may or may not have spoken in this tick already; with
/// two poses the one of the tick before is always there, whoever ran first.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.PosePair.v3")]
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
