//! What C sees: plain structs, filled again for every tick.
#![expect(non_camel_case_types, reason = "the names are those of the header")]

use robot_agent::model;
use robot_agent::planners::{Neighbor, Obstacle, PlanInput};
use std::ffi::{c_char, c_void};

/// A point of the plane, m, or a velocity, m/s.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct shoal_vec2 {
    /// Along x.
    pub x: f64,
    /// Along y.
    pub y: f64,
}

/// A body that moves into any direction; its command is a velocity.
pub const SHOAL_KIND_POINT: u32 = 0;
/// A body that drives ahead and turns; its command is a speed and a turn rate.
pub const SHOAL_KIND_UNICYCLE: u32 = 1;
/// A body with two driven wheels; its command is a speed and a turn rate, or the rates of its wheels.
pub const SHOAL_KIND_DIFF_DRIVE: u32 = 2;
/// An arm of two links; its command is the rates of its joints.
pub const SHOAL_KIND_TWO_LINK_ARM: u32 = 3;

/// What a body can do.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct shoal_limits {
    /// Greatest speed, m/s.
    pub speed_mps_max: f64,
    /// Greatest reverse speed, m/s.
    pub reverse_mps_max: f64,
    /// Smallest turning radius, m.
    pub turning_radius_m_min: f64,
    /// Greatest turn rate, and of an arm the greatest rate of each joint, rad/s.
    pub turn_radps_max: f64,
    /// Greatest change of speed or velocity, m/s^2.
    pub accel_mps2_max: f64,
    /// Greatest change of the turn rate, rad/s^2.
    pub turn_accel_radps2_max: f64,
}

/// Another robot, as its newest message describes it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct shoal_neighbor {
    /// Position when it spoke, m.
    pub position: shoal_vec2,
    /// Velocity when it spoke, m/s.
    pub velocity: shoal_vec2,
    /// Where its command takes it within a tick after it spoke, m; it counts with `has_next`.
    pub next: shoal_vec2,
    /// Heading when it spoke, rad.
    pub yaw_rad: f64,
    /// Body radius, m.
    pub radius_m: f64,
    /// Age of the message, s.
    pub age_s: f64,
    /// Distance to its goal, m.
    pub remaining_m: f64,
    /// Index of the robot in the fleet.
    pub id: u32,
    /// It says where its command takes it.
    pub has_next: bool,
    /// It has reached its last goal.
    pub arrived: bool,
    /// It stands still on purpose.
    pub stopped: bool,
}

/// A collider of an obstacle: everything within `radius_m` of the line from `a` to `b`. A disc has `a` equal to `b`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct shoal_obstacle {
    /// One end, m.
    pub a: shoal_vec2,
    /// The other end, m.
    pub b: shoal_vec2,
    /// Velocity, m/s.
    pub velocity: shoal_vec2,
    /// Distance from the line to the surface, m.
    pub radius_m: f64,
    /// Names the obstacle; the edges of a polygon share it.
    pub id: u32,
}

/// The velocities with `normal.x * vx + normal.y * vy <= bound`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct shoal_half_plane {
    /// Of length 1.
    pub normal: shoal_vec2,
    /// m/s.
    pub bound: f64,
}

/// Everything that a planner may look at in a tick, in the world frame. What it points to is valid during the call.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct shoal_view {
    /// The robot's name.
    pub name: *const c_char,
    /// The tick that is planned, from 0 at the start of the run.
    pub tick: u64,
    /// Seed of the run.
    pub seed: u64,
    /// Simulated time of this tick, s.
    pub time_s: f64,
    /// Length of a tick, s.
    pub dt_s: f64,
    /// Own position, m; of an arm, that of its tip.
    pub position: shoal_vec2,
    /// Own velocity, m/s.
    pub velocity: shoal_vec2,
    /// Own heading, rad.
    pub yaw_rad: f64,
    /// Own turn rate, rad/s.
    pub turn_radps: f64,
    /// Own body radius, m.
    pub radius_m: f64,
    /// What the body can do.
    pub limits: shoal_limits,
    /// Where the robot heads now, m.
    pub goal: shoal_vec2,
    /// The goal counts as reached within this distance, m.
    pub goal_tolerance_m: f64,
    /// The heading that the robot is to have at its goal, rad; it counts with `has_goal_yaw`.
    pub goal_yaw_rad: f64,
    /// Joint angles of an arm, the one at the base first, rad; zero for other bodies.
    pub joints_rad: [f64; 2],
    /// The robots that are heard on the radio, by index.
    pub neighbors: *const shoal_neighbor,
    /// Number of neighbours.
    pub neighbor_count: usize,
    /// What the sensors see.
    pub obstacles: *const shoal_obstacle,
    /// Number of colliders that the sensors see.
    pub obstacle_count: usize,
    /// The fixed obstacles of the whole world, if the robot knows the map.
    pub map: *const shoal_obstacle,
    /// Number of colliders of the map.
    pub map_count: usize,
    /// The velocities that the filter allows.
    pub allowed: *const shoal_half_plane,
    /// Number of half-planes; without a filter 0.
    pub allowed_count: usize,
    /// The robot's stream of random numbers, for `shoal_uniform` and `shoal_normal`.
    pub random: *mut c_void,
    /// The robot's index in the fleet, from 0.
    pub index: u32,
    /// How often its process was started before.
    pub incarnation: u32,
    /// How the body moves: `SHOAL_KIND_POINT` and so on.
    pub kind: u32,
    /// The goal has a heading.
    pub has_goal_yaw: bool,
    /// The last goal has been reached.
    pub arrived: bool,
}

/// The command that the kind of body takes.
pub const SHOAL_FORM_DEFAULT: u32 = 0;
/// The rates of the left and the right wheel of a diff-drive, rad/s.
pub const SHOAL_FORM_WHEELS: u32 = 1;

/// What a planner asks of the body. It is zero when the planner is called: the body stands.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct shoal_command {
    /// Velocity along x, m/s; or forward speed, m/s; or rate of the joint at the base or of the left wheel, rad/s.
    pub first: f64,
    /// Velocity along y, m/s; or turn rate, rad/s; or rate of the joint at the elbow or of the right wheel, rad/s.
    pub second: f64,
    /// `SHOAL_FORM_DEFAULT` or `SHOAL_FORM_WHEELS`.
    pub form: u32,
    /// The robot stands still on purpose; the others are told.
    pub stopped: bool,
}

/// Plans a tick: fills in the command and returns 0. Any other number ends the process: the robot is dead for the fleet, which
/// goes on. It must not throw.
pub type shoal_plan = unsafe extern "C" fn(*mut c_void, *const shoal_view, *mut shoal_command) -> i32;

impl From<[f64; 2]> for shoal_vec2 {
    fn from([x, y]: [f64; 2]) -> shoal_vec2 {
        shoal_vec2 { x, y }
    }
}

impl From<model::Limits> for shoal_limits {
    fn from(limits: model::Limits) -> shoal_limits {
        shoal_limits {
            speed_mps_max: limits.speed_mps_max,
            reverse_mps_max: limits.reverse_mps_max,
            turning_radius_m_min: limits.turning_radius_m_min,
            turn_radps_max: limits.turn_radps_max,
            accel_mps2_max: limits.accel_mps2_max,
            turn_accel_radps2_max: limits.turn_accel_radps2_max,
        }
    }
}

impl From<&Neighbor> for shoal_neighbor {
    fn from(neighbor: &Neighbor) -> shoal_neighbor {
        shoal_neighbor {
            position: <[f64; 2]>::from(neighbor.position).into(),
            velocity: <[f64; 2]>::from(neighbor.velocity).into(),
            next: <[f64; 2]>::from(neighbor.next.unwrap_or(neighbor.position)).into(),
            yaw_rad: neighbor.yaw_rad,
            radius_m: neighbor.radius_m,
            age_s: neighbor.age_s,
            remaining_m: neighbor.remaining_m,
            id: neighbor.id,
            has_next: neighbor.next.is_some(),
            arrived: neighbor.arrived,
            stopped: neighbor.stopped,
        }
    }
}

impl From<&Obstacle> for shoal_obstacle {
    fn from(obstacle: &Obstacle) -> shoal_obstacle {
        shoal_obstacle {
            a: <[f64; 2]>::from(obstacle.shape.a).into(),
            b: <[f64; 2]>::from(obstacle.shape.b).into(),
            velocity: <[f64; 2]>::from(obstacle.velocity).into(),
            radius_m: obstacle.shape.radius,
            id: obstacle.id,
        }
    }
}

/// The lists of a view, in memory that is used again.
#[derive(Default)]
pub(crate) struct Lists {
    neighbors: Vec<shoal_neighbor>,
    obstacles: Vec<shoal_obstacle>,
    map: Vec<shoal_obstacle>,
    allowed: Vec<shoal_half_plane>,
}

impl Lists {
    pub(crate) fn take(&mut self, input: &PlanInput<'_>) {
        self.neighbors.clear();
        self.neighbors.extend(input.neighbors.iter().map(shoal_neighbor::from));
        self.obstacles.clear();
        self.obstacles.extend(input.obstacles.iter().map(shoal_obstacle::from));
        // The map stays what it is.
        if self.map.len() != input.map.len() {
            self.map = input.map.iter().map(shoal_obstacle::from).collect();
        }
        self.allowed.clear();
        self.allowed.extend(input.allowed.iter().map(|half| {
            // To the left of the line is inside: the normal points to the right.
            let normal = shoal_vec2 { x: half.direction.y, y: -half.direction.x };
            shoal_half_plane { normal, bound: normal.x * half.point.x + normal.y * half.point.y }
        }));
    }

    /// The part of a view that these lists are.
    pub(crate) fn fill(&self, view: &mut shoal_view) {
        (view.neighbors, view.neighbor_count) = (self.neighbors.as_ptr(), self.neighbors.len());
        (view.obstacles, view.obstacle_count) = (self.obstacles.as_ptr(), self.obstacles.len());
        (view.map, view.map_count) = (self.map.as_ptr(), self.map.len());
        (view.allowed, view.allowed_count) = (self.allowed.as_ptr(), self.allowed.len());
    }
}
