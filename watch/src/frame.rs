//! Where everything is at one tick.

use protocol::world_to_observer::{FrameBody, FrameHeader};

/// A frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// The tick.
    pub tick: u64,
    /// Simulated time, s.
    pub time_s: f64,
    /// Robots at their last goal.
    pub arrived: u32,
    /// Contacts so far.
    pub contacts: u32,
    /// The robots in the world, by slot, and then the obstacles that move.
    pub bodies: Vec<Body>,
}

/// A robot or a moving obstacle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Body {
    /// Slot of the robot, or index of the obstacle.
    pub index: u32,
    /// The `FLAG_*` constants of [`FrameBody`].
    pub flags: u32,
    /// Position, m (of an arm: its tip; of an obstacle: the point that its motion carries).
    pub position_m: [f64; 2],
    /// Heading, rad.
    pub yaw_rad: f64,
    /// Joint angles of an arm, rad.
    pub joints_rad: [f64; 2],
    /// Where a robot heads for, m.
    pub goal_m: Option<[f64; 2]>,
    /// The part of its plan that pulls to its goal, in the unit of its method; zero if there is none.
    pub pull: [f32; 2],
    /// The part that pushes away from things, likewise.
    pub push: [f32; 2],
    /// Where its command takes it, m/s, if it says so.
    pub command_mps: Option<[f64; 2]>,
}

impl Body {
    /// It is an obstacle, not a robot.
    pub fn is_obstacle(&self) -> bool {
        self.flags & FrameBody::FLAG_OBSTACLE != 0
    }

    /// The robot is at its last goal.
    pub fn has_arrived(&self) -> bool {
        self.flags & FrameBody::FLAG_ARRIVED != 0
    }

    /// The robot's process does not take part.
    pub fn is_silent(&self) -> bool {
        self.flags & FrameBody::FLAG_SILENT != 0
    }
}

impl From<&FrameBody> for Body {
    fn from(body: &FrameBody) -> Body {
        Body {
            index: body.index,
            flags: body.flags,
            position_m: [body.x_m, body.y_m],
            yaw_rad: body.yaw_rad,
            joints_rad: body.joints_rad,
            ..Body::default()
        }
    }
}

impl Frame {
    /// From what the world shows.
    pub fn of(header: &FrameHeader, bodies: &[FrameBody]) -> Frame {
        Frame {
            tick: header.tick,
            time_s: header.time_s,
            arrived: header.arrived,
            contacts: header.contacts,
            bodies: bodies.iter().map(Body::from).collect(),
        }
    }
}
