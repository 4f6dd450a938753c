//! What the world shows to whoever watches. With nobody watching it is not even written.

use iceoryx2::prelude::ZeroCopySend;

/// One tick of the whole fleet: this header, and one [`FrameBody`] per robot in the world and per moving obstacle.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.FrameHeader.v1")]
pub struct FrameHeader {
    /// The tick.
    pub tick: u64,
    /// When it was written, monotonic clock, ns.
    pub stamp_ns: u64,
    /// Simulated time, s.
    pub time_s: f64,
    /// Robots that have arrived.
    pub arrived: u32,
    /// Contacts so far.
    pub contacts: u32,
}

/// A body in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.FrameBody.v2")]
pub struct FrameBody {
    /// Position, m (of an arm: its tip; of an obstacle: the point that its motion carries).
    pub x_m: f64,
    /// Position, m.
    pub y_m: f64,
    /// Heading, rad; of an arm, the direction of its last link.
    pub yaw_rad: f64,
    /// Radius, m; of an arm, half the thickness of its links.
    pub radius_m: f64,
    /// Velocity, m/s.
    pub vx_mps: f64,
    /// Velocity, m/s.
    pub vy_mps: f64,
    /// Joint angles of an arm, the one at the base first, rad; zero for everything else. Where the links are follows from
    /// them and from the arm's geometry in the scenario.
    pub joints_rad: [f64; 2],
    /// Slot of the robot, or index of the obstacle.
    pub index: u32,
    /// See the `FLAG_*` constants.
    pub flags: u32,
}

impl FrameBody {
    /// It is an obstacle, not a robot.
    pub const FLAG_OBSTACLE: u32 = 1;
    /// The robot has arrived.
    pub const FLAG_ARRIVED: u32 = 2;
    /// The robot's process is not taking part (held, dropped, dead).
    pub const FLAG_SILENT: u32 = 4;
}
