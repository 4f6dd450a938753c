//! From a wanted velocity to a drive that a unicycle can follow.

use crate::planner::PlanInput;
use geometry::wrap;
use model::{Drive, Limits};
use nalgebra::Vector2;

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

/// Greatest speed from which a body stops within half of this distance, m/s; infinite for one that stops at once.
pub fn stoppable_speed(distance_m: f64, limits: &Limits) -> f64 {
    if limits.accel_mps2_max.is_infinite() { f64::INFINITY } else { (limits.accel_mps2_max * distance_m).sqrt() }
}

/// Greatest speed at which a unicycle has turned towards its goal before it could have passed it, m/s: half of the angle it
/// turns faster and faster, half of it slower and slower. Infinite for one whose turn rate follows at once.
pub fn turning_speed(to_goal: Vector2<f64>, yaw_rad: f64, limits: &Limits) -> f64 {
    if limits.turn_accel_radps2_max.is_infinite() {
        return f64::INFINITY;
    }
    let error = wrap(to_goal.y.atan2(to_goal.x) - yaw_rad).abs().max(f64::MIN_POSITIVE);
    to_goal.norm() / (2.0 * (error / limits.turn_accel_radps2_max).sqrt())
}
