//! What unit tests of several methods share.

use crate::planner::PlanInput;
use model::{BodyKind, Limits};
use nalgebra::{Point2, Vector2};

/// Limits of a slow unicycle with unlimited accelerations.
pub(crate) const LIMITS: Limits = Limits {
    speed_mps_max: 0.2,
    reverse_mps_max: 0.0,
    turning_radius_m_min: 0.0,
    turn_radps_max: 1.0,
    accel_mps2_max: f64::INFINITY,
    turn_accel_radps2_max: f64::INFINITY,
};

/// A unicycle with these limits at the origin, facing +x, with its goal 9 m ahead, in ticks of 0.1 s, alone.
pub(crate) fn input() -> PlanInput<'static> {
    PlanInput {
        tick: 0,
        dt_s: 0.1,
        position: Point2::origin(),
        yaw_rad: 0.0,
        velocity: Vector2::zeros(),
        turn_radps: 0.0,
        radius_m: 0.2,
        kind: BodyKind::Unicycle,
        limits: LIMITS,
        goal: Point2::new(9.0, 0.0),
        goal_tolerance_m: 0.1,
        goal_yaw_rad: None,
        goal_yaw_tolerance_rad: 0.1,
        arrived: false,
        obstacles: &[],
        neighbors: &[],
        map: &[],
        arm: None,
        wheels: None,
        allowed: &[],
    }
}
