//! What unit tests of several methods share.

use crate::planner::{Neighbor, PlanInput};
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
        walls: None,
        arm: None,
        wheels: None,
        allowed: &[],
    }
}

/// A robot of radius 0.2 m that has just said that it stands here, 9 m from its goal.
pub(crate) fn neighbor(id: u32, position: [f64; 2]) -> Neighbor {
    Neighbor {
        id,
        position: position.into(),
        yaw_rad: 0.0,
        velocity: Vector2::zeros(),
        radius_m: 0.2,
        age_s: 0.0,
        remaining_m: 9.0,
        arrived: false,
        stopped: false,
        next: None,
        intent: None,
    }
}
