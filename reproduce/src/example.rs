//! Single plans, for worked examples.

use model::{BodyKind, Limits};
use nalgebra::{Point2, Vector2};
use planners::{Obstacle, PlanInput};

/// What a point robot without extent is given that stands at the origin.
pub fn at_origin(goal: Point2<f64>, obstacles: &[Obstacle]) -> PlanInput<'_> {
    PlanInput {
        tick: 0,
        dt_s: 0.05,
        position: Point2::origin(),
        yaw_rad: 0.0,
        velocity: Vector2::zeros(),
        turn_radps: 0.0,
        radius_m: 0.0,
        kind: BodyKind::Point,
        limits: Limits {
            speed_mps_max: 1.0,
            reverse_mps_max: 0.0,
            turning_radius_m_min: 0.0,
            turn_radps_max: 3.0,
            accel_mps2_max: f64::INFINITY,
            turn_accel_radps2_max: f64::INFINITY,
        },
        goal,
        goal_tolerance_m: 0.1,
        goal_yaw_rad: None,
        goal_yaw_tolerance_rad: 0.1,
        arrived: false,
        obstacles,
        neighbors: &[],
        map: obstacles,
        walls: None,
        arm: None,
        wheels: None,
        allowed: &[],
    }
}
