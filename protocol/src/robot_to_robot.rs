//! What a robot tells every robot that hears it: its own pose, and nothing of its intentions but how far it has to go.

use iceoryx2::prelude::ZeroCopySend;

/// A robot's own account of itself at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.SharedPose.v2")]
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
    /// See the `FLAG_*` constants.
    pub flags: u32,
    /// Keeps the layout explicit.
    pub reserved: u32,
}

impl SharedPose {
    /// It has reached its last goal.
    pub const FLAG_ARRIVED: u32 = 1;
    /// It stands still on purpose: its planner says so.
    pub const FLAG_STOPPED: u32 = 2;
    /// There is a pose here: a board that was just made holds none.
    pub const FLAG_SPOKEN: u32 = 4;

    /// Whether a flag is set.
    pub fn has(&self, flag: u32) -> bool {
        self.flags & flag != 0
    }
}

/// The last two poses, or the newest alone. In `lockstep` a neighbour may or may not have spoken in this tick already; with
/// two poses the one of the tick before is always there, whoever ran first.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.PosePair.v2")]
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
