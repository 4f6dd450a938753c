//! How bodies move, and what a robot asks of its body.

use crate::planner::PlanInput;
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// How a body moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// A holonomic point: any velocity in the plane.
    Point,
    /// A unicycle: forward speed and turn rate.
    Unicycle,
    /// A planar arm of two links that stands where it stands: joint rates. Its position is that of its tip.
    TwoLinkArm,
}

impl Kind {
    /// Every kind.
    pub const ALL: &[Kind] = &[Kind::Point, Kind::Unicycle, Kind::TwoLinkArm];
    /// The kinds that drive about.
    pub const MOBILE: &[Kind] = &[Kind::Point, Kind::Unicycle];

    /// Its word in scenarios and messages.
    pub fn word(self) -> &'static str {
        match self {
            Kind::Point => "point",
            Kind::Unicycle => "unicycle",
            Kind::TwoLinkArm => "two-link-arm",
        }
    }
}

/// What a body can do. An infinite acceleration means that the body follows at once.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Greatest speed, m/s; of an arm, that of its tip.
    pub speed_mps_max: f64,
    /// Greatest reverse speed of a unicycle, m/s, not negative; zero means that it cannot drive backwards.
    pub reverse_mps_max: f64,
    /// Smallest radius on which a unicycle can turn, m; zero means that it can turn where it stands. With more it steers
    /// like a car.
    pub turning_radius_m_min: f64,
    /// Greatest turn rate of a unicycle, and of each joint of an arm, rad/s.
    pub turn_radps_max: f64,
    /// Greatest change of speed (unicycle) or of velocity (point), m/s².
    pub accel_mps2_max: f64,
    /// Greatest change of turn rate of a unicycle, rad/s².
    pub turn_accel_radps2_max: f64,
}

impl Limits {
    /// Greatest turn rate at a speed that the turning radius leaves, rad/s; infinite without one.
    pub fn turn_at(&self, speed_mps: f64) -> f64 {
        if self.turning_radius_m_min > 0.0 { speed_mps.abs() / self.turning_radius_m_min } else { f64::INFINITY }
    }
}

/// What a robot asks of its body for one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Drive {
    /// A velocity in the world frame, m/s (point).
    Velocity(Vector2<f64>),
    /// Forward speed, m/s, and turn rate, rad/s (unicycle).
    Twist {
        /// Forward speed, m/s.
        speed_mps: f64,
        /// Turn rate, rad/s, counter-clockwise.
        turn_radps: f64,
    },
    /// Rates of the joints, the one at the base first, rad/s, counter-clockwise (two-link arm).
    Joints {
        /// The rates, rad/s.
        rate_radps: [f64; 2],
    },
}

impl Drive {
    /// Stand still, in the form that a body of this kind understands.
    pub fn stop(kind: Kind) -> Drive {
        match kind {
            Kind::Point => Drive::Velocity(Vector2::zeros()),
            Kind::Unicycle => Drive::Twist { speed_mps: 0.0, turn_radps: 0.0 },
            Kind::TwoLinkArm => Drive::Joints { rate_radps: [0.0; 2] },
        }
    }

    /// Whether every number in it is finite.
    pub fn is_finite(&self) -> bool {
        match *self {
            Drive::Velocity(v) => v.x.is_finite() && v.y.is_finite(),
            Drive::Twist { speed_mps, turn_radps } => speed_mps.is_finite() && turn_radps.is_finite(),
            Drive::Joints { rate_radps } => rate_radps.iter().all(|rate| rate.is_finite()),
        }
    }

    /// The same request within the limits: a velocity keeps its direction, a twist is cut part by part (and turns no
    /// tighter than its speed allows), and
    /// joint rates shrink together, so that the tip keeps its course. The speed of a tip depends on the pose of its
    /// arm, which is not known here: [`ArmState::within`](crate::arm::ArmState::within) limits it too.
    pub fn within(&self, limits: &Limits) -> Drive {
        match *self {
            Drive::Velocity(v) => Drive::Velocity(v.cap_magnitude(limits.speed_mps_max)),
            Drive::Twist { speed_mps, turn_radps } => {
                let speed_mps = speed_mps.clamp(-limits.reverse_mps_max, limits.speed_mps_max);
                let turn_max = limits.turn_radps_max.min(limits.turn_at(speed_mps));
                Drive::Twist { speed_mps, turn_radps: turn_radps.clamp(-turn_max, turn_max) }
            }
            Drive::Joints { rate_radps: [first, second] } => {
                let fastest = first.abs().max(second.abs());
                let scale = if fastest > limits.turn_radps_max { limits.turn_radps_max / fastest } else { 1.0 };
                Drive::Joints { rate_radps: [first * scale, second * scale] }
            }
        }
    }
}

/// The angle in (-π, π].
pub fn wrap(angle_rad: f64) -> f64 {
    let wrapped = angle_rad.rem_euclid(std::f64::consts::TAU);
    if wrapped > std::f64::consts::PI { wrapped - std::f64::consts::TAU } else { wrapped }
}

/// [`steer`] for a robot that is to get to its goal: at most as fast as the arc through the goal allows. At full speed a
/// body that turns slowly would circle round a goal beside it for ever.
pub fn steer_to_goal(velocity: Vector2<f64>, heading_gain: f64, input: &PlanInput<'_>) -> Drive {
    let velocity = if input.arrived { velocity } else { velocity.cap_magnitude(arc_speed(input)) };
    steer(velocity, input.yaw_rad, heading_gain, &input.limits)
}

/// Greatest speed at which a body can turn on the circle through its goal, m/s; if the goal is not ahead of it, on the
/// smallest that has it on its far side.
pub fn arc_speed(input: &PlanInput<'_>) -> f64 {
    let to_goal = input.goal - input.position;
    let error = wrap(to_goal.y.atan2(to_goal.x) - input.yaw_rad);
    let aside = if error.cos() > 0.0 { error.sin().abs().max(f64::MIN_POSITIVE) } else { 1.0 };
    input.limits.turn_radps_max * to_goal.norm() / (2.0 * aside)
}

/// Turns a wanted velocity into a twist: turn towards it with `heading_gain` (1/s), and drive only as far as the
/// heading agrees (speed × max(0, cos of the heading error)) and the body can [turn that fast](turnable).
pub fn steer(velocity: Vector2<f64>, yaw_rad: f64, heading_gain: f64, limits: &Limits) -> Drive {
    let speed = velocity.norm();
    if speed <= f64::EPSILON {
        return Drive::Twist { speed_mps: 0.0, turn_radps: 0.0 };
    }
    let error = wrap(velocity.y.atan2(velocity.x) - yaw_rad);
    let speed_mps = speed * error.cos().max(0.0) * turnable(error, heading_gain, limits);
    Drive::Twist { speed_mps, turn_radps: turn_towards(error, heading_gain, limits) }.within(limits)
}

/// Share of its speed that a unicycle keeps while it turns by `error_rad`: less than all if it turns slower than a quarter
/// turn's worth of the gain, so that it stays as near to its course as a body that turns fast.
pub fn turnable(error_rad: f64, heading_gain: f64, limits: &Limits) -> f64 {
    let (asked, can) = (heading_gain * error_rad.abs(), std::f64::consts::FRAC_PI_2 * limits.turn_radps_max);
    if asked > can { can / asked } else { 1.0 }
}

/// The turn rate towards a heading: in proportion to the error, but no more than the body can stop from before it.
pub fn turn_towards(error_rad: f64, heading_gain: f64, limits: &Limits) -> f64 {
    let turn = heading_gain * error_rad;
    if limits.turn_accel_radps2_max.is_infinite() {
        return turn;
    }
    let stoppable = (limits.turn_accel_radps2_max * error_rad.abs()).sqrt();
    turn.clamp(-stoppable, stoppable)
}
