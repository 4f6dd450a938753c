//! How bodies move, and what a robot asks of its body.

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
    /// Greatest turn rate of a unicycle, and of each joint of an arm, rad/s.
    pub turn_radps_max: f64,
    /// Greatest change of speed (unicycle) or of velocity (point), m/s².
    pub accel_mps2_max: f64,
    /// Greatest change of turn rate of a unicycle, rad/s².
    pub turn_accel_radps2_max: f64,
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

    /// The same request within the limits: a velocity keeps its direction, a twist is cut part by part, and
    /// joint rates shrink together, so that the tip keeps its course. The speed of a tip depends on the pose of its
    /// arm, which is not known here: [`ArmState::within`](crate::arm::ArmState::within) limits it too.
    pub fn within(&self, limits: &Limits) -> Drive {
        match *self {
            Drive::Velocity(v) => Drive::Velocity(v.cap_magnitude(limits.speed_mps_max)),
            Drive::Twist { speed_mps, turn_radps } => Drive::Twist {
                speed_mps: speed_mps.clamp(-limits.reverse_mps_max, limits.speed_mps_max),
                turn_radps: turn_radps.clamp(-limits.turn_radps_max, limits.turn_radps_max),
            },
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

/// Turns a wanted velocity into a twist: turn towards it with `heading_gain` (1/s), and drive only as far as the
/// heading agrees (speed × max(0, cos of the heading error)).
pub fn steer(velocity: Vector2<f64>, yaw_rad: f64, heading_gain: f64, limits: &Limits) -> Drive {
    let speed = velocity.norm();
    if speed <= f64::EPSILON {
        return Drive::Twist { speed_mps: 0.0, turn_radps: 0.0 };
    }
    let error = wrap(velocity.y.atan2(velocity.x) - yaw_rad);
    Drive::Twist { speed_mps: speed * error.cos().max(0.0), turn_radps: heading_gain * error }.within(limits)
}
