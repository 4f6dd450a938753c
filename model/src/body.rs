//! How bodies move, and what a robot asks of its body.

use crate::choice;
use geometry::ArmState;
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

choice! {
    /// How a body moves.
    #[derive(Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum BodyKind {
        /// A holonomic point: any velocity in the plane.
        Point = "point",
        /// A unicycle: forward speed and turn rate.
        Unicycle = "unicycle",
        /// A planar arm of two links that stands where it stands: joint rates. Its position is that of its tip.
        TwoLinkArm = "two-link-arm",
    }
}

impl BodyKind {
    /// The kinds that drive about.
    pub const MOBILE: &[BodyKind] = &[BodyKind::Point, BodyKind::Unicycle];
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
    #[inline]
    pub fn turn_at(&self, speed_mps: f64) -> f64 {
        if self.turning_radius_m_min > 0.0 { speed_mps.abs() / self.turning_radius_m_min } else { f64::INFINITY }
    }
}

/// What a robot asks of its body for one tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
    #[inline]
    pub fn stop(kind: BodyKind) -> Drive {
        match kind {
            BodyKind::Point => Drive::Velocity(Vector2::zeros()),
            BodyKind::Unicycle => Drive::Twist { speed_mps: 0.0, turn_radps: 0.0 },
            BodyKind::TwoLinkArm => Drive::Joints { rate_radps: [0.0; 2] },
        }
    }

    /// Whether every number in it is finite.
    #[inline]
    pub fn is_finite(&self) -> bool {
        match *self {
            Drive::Velocity(v) => v.x.is_finite() && v.y.is_finite(),
            Drive::Twist { speed_mps, turn_radps } => speed_mps.is_finite() && turn_radps.is_finite(),
            Drive::Joints { rate_radps } => rate_radps.iter().all(|rate| rate.is_finite()),
        }
    }

    /// The same request within the limits: a velocity keeps its direction, a twist is cut part by part (and turns no
    /// tighter than its speed allows), and joint rates shrink together, so that the tip keeps its course. The speed of a
    /// tip depends on the pose of its arm, which is not known here: [`Drive::of_arm`] limits it too.
    #[inline]
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

    /// Joint rates of an arm within the limits: both shrink together until each joint and the tip keep theirs.
    #[inline]
    pub fn of_arm(arm: &ArmState, rate_radps: [f64; 2], limits: &Limits) -> Drive {
        let tip = arm.tip_velocity(rate_radps).norm();
        let scale = if tip > limits.speed_mps_max { limits.speed_mps_max / tip } else { 1.0 };
        Drive::Joints { rate_radps: rate_radps.map(|rate| rate * scale) }.within(limits)
    }
}
