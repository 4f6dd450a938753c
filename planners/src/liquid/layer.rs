//! Keeping clear of what moves: the paper plans for one robot among things that stand still, this is ours. (Robots in
//! the potential would be an alternative, but two that meet would both put up virtual obstacles and both go back.)
//!
//! Everything that moves pushes with Khatib's law, η (1/ρ − 1/ρ₀) / ρ², from where it should be by now. What is ahead
//! also pushes to the right, so that two robots pass each other instead of stopping face to face. The pushes are added
//! to the velocity that the method wants. What they make of it may not lead into an obstacle: of the velocity towards a
//! surface, only as much is kept as the body can stop from before it.
//!
//! Other robots push, and sensed things that move. Robots that have arrived do not push, they count as obstacles. In
//! `liquid`, what moves is not in the plan. In `liquid-online` sensed things are in the potential where they are now,
//! and virtual obstacles put up while something moves nearby are taken down after `lifetime_s`.
//!
//! With `neighbors = false` nothing pushes and no robot is an obstacle; sensed things stay in the online potential.

use super::known::moves;
use crate::planner::{Obstacle, Plan, PlanInput, nearest_by_id};
use crate::steering::{arc_speed, steer_to_goal, turn_towards, turnable};
use geometry::wrap;
use model::{BodyKind, Drive};
use nalgebra::{Point2, Vector2};

/// Surfaces count as at least this far apart, so that pushes stay finite, m.
const RHO_MIN_M: f64 = 0.001;
/// A robot is taken to have kept its course for so long after it spoke, s.
const STALE_S: f64 = 0.3;
/// A unicycle whose heading is farther off than this turns where it is, rad.
const TURN_FIRST_RAD: f64 = std::f64::consts::FRAC_PI_3;
/// Share of its acceleration that a body is expected to brake with; the rest is for what goes wrong.
const BRAKE_SHARE: f64 = 0.7;
/// A point that does not follow at once keeps so far from surfaces, m.
const LAG_MARGIN_M: f64 = 0.02;
/// A robot that was silent for longer than this is forgotten, s.
const DROP_S: f64 = 2.0;

/// The layer of one robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// Whether there is one.
    pub on: bool,
    /// η, m⁴/s.
    pub gain: f64,
    /// ρ₀, from surface to surface, m.
    pub range_m: f64,
    /// Turn rate of a unicycle per radian of heading error, 1/s.
    pub heading_gain: f64,
    /// Own slot: settles who goes where when centres coincide.
    pub robot: u32,
}

impl Layer {
    /// The push of everything that moves on a robot that wants to go somewhere, m/s.
    pub fn push(&self, wanted: Vector2<f64>, input: &PlanInput<'_>) -> Vector2<f64> {
        if !self.on {
            return Vector2::zeros();
        }
        let robots = input.neighbors.iter().filter(|other| !other.arrived && other.age_s <= DROP_S).map(|other| {
            let position = other.position + other.velocity * other.age_s.clamp(0.0, STALE_S);
            // Two robots with one centre must not be pushed the same way, so the lower slot goes back.
            let apart = if self.robot < other.id { -Vector2::x() } else { Vector2::x() };
            self.push_of(input.position - position, other.radius_m + input.radius_m, wanted, apart)
        });
        let things = nearest_by_id(input.obstacles, input.position).filter(moves).map(|thing| {
            let offset = input.position - thing.shape.nearest_core(input.position);
            self.push_of(offset, thing.shape.radius + input.radius_m, wanted, Vector2::x())
        });
        robots.chain(things).sum()
    }

    fn push_of(&self, offset: Vector2<f64>, radii_m: f64, wanted: Vector2<f64>, apart: Vector2<f64>) -> Vector2<f64> {
        let rho = (offset.norm() - radii_m).max(RHO_MIN_M);
        if rho >= self.range_m {
            return Vector2::zeros();
        }
        let away = offset.try_normalize(0.0).unwrap_or(apart);
        let size = self.gain * (1.0 / rho - 1.0 / self.range_m) / rho.powi(2);
        // Seen from what is ahead, counter-clockwise is to my right.
        let ahead = wanted.dot(&away) < 0.0;
        let aside = if ahead { Vector2::new(-away.y, away.x) } else { Vector2::zeros() };
        size * (away + aside)
    }

    /// The plan for a wanted velocity and a push. A point that nothing pushes, and that
    /// follows at once, drives exactly what is wanted.
    pub fn plan(&self, wanted: Vector2<f64>, push: Vector2<f64>, known: &[Obstacle], input: &PlanInput<'_>) -> Plan {
        let speed_max = input.limits.speed_mps_max;
        let kept = |velocity: Vector2<f64>| slide(input.obstacles, input, slide(known, input, velocity));
        let drive = match input.kind {
            BodyKind::Point if push == Vector2::zeros() && input.limits.accel_mps2_max.is_infinite() => {
                Drive::Velocity(wanted.cap_magnitude(speed_max))
            }
            BodyKind::Point => Drive::Velocity(kept((wanted + push).cap_magnitude(speed_max))),
            BodyKind::Unicycle | BodyKind::DiffDrive => {
                let velocity = kept((wanted + push).cap_magnitude(speed_max));
                // Who is pushed gets out of the way first.
                let pushed = push != Vector2::zeros();
                let drive = if pushed {
                    steer_to_goal(velocity, self.heading_gain, input)
                } else {
                    self.steer(velocity, input)
                };
                match drive {
                    Drive::Twist { speed_mps, turn_radps } => {
                        // It drives where it looks, not where it should look.
                        let along = |yaw_rad: f64| {
                            let heading = Vector2::new(yaw_rad.cos(), yaw_rad.sin());
                            kept(speed_mps * heading).dot(&heading).clamp(0.0, speed_mps)
                        };
                        let speed_mps = along(input.yaw_rad).min(along(input.yaw_rad + turn_radps * input.dt_s));
                        Drive::Twist { speed_mps, turn_radps }
                    }
                    drive => drive,
                }
            }
            BodyKind::TwoLinkArm => Drive::stop(input.kind),
        };
        Plan { attractive: wanted, repulsive: push, ..Plan::only(drive) }
    }
}

impl Layer {
    /// Turns a wanted velocity into a twist that keeps close to it: the robot turns first where it should go another
    /// way, because a step is shorter than the arc of a turn at speed.
    fn steer(&self, velocity: Vector2<f64>, input: &PlanInput<'_>) -> Drive {
        let speed = velocity.norm().min(arc_speed(input));
        if speed <= f64::EPSILON {
            return Drive::stop(input.kind);
        }
        let error = wrap(velocity.y.atan2(velocity.x) - input.yaw_rad);
        let gain = self.heading_gain;
        let share = (1.0 - error.abs() / TURN_FIRST_RAD).max(0.0) * turnable(error, gain, &input.limits);
        let turn_radps = turn_towards(error, gain, &input.limits);
        Drive::Twist { speed_mps: speed * share, turn_radps }.within(&input.limits)
    }
}

/// The plan of a robot that stands still on purpose.
pub fn stay(input: &PlanInput<'_>) -> Plan {
    Plan { stopped: true, ..Plan::only(Drive::stop(input.kind)) }
}

/// The velocity without what would lead into an obstacle before the body can stop.
fn slide(obstacles: &[Obstacle], input: &PlanInput<'_>, velocity: Vector2<f64>) -> Vector2<f64> {
    nearest_by_id(obstacles, input.position).fold(velocity, |velocity, obstacle| {
        let offset = input.position - obstacle.shape.nearest_core(input.position);
        let lags = input.kind == BodyKind::Point && input.limits.accel_mps2_max.is_finite();
        let margin = if lags { LAG_MARGIN_M } else { 0.0 };
        let gap = (offset.norm() - obstacle.shape.radius - input.radius_m - margin).max(0.0);
        let Some(away) = offset.try_normalize(0.0) else { return velocity };
        let allowed = stoppable(gap, input);
        // A point that comes too fast brakes with all it has: whatever it would turn, too, takes from that.
        let velocity = if lags && -input.velocity.dot(&away) > allowed { input.velocity } else { velocity };
        let excess = (-velocity.dot(&away) - allowed).max(0.0);
        velocity + excess * away
    })
}

/// The velocity that ends on a point: at full speed, and no farther than the point within a tick.
pub fn towards(point: Point2<f64>, input: &PlanInput<'_>) -> Vector2<f64> {
    (point - input.position).cap_magnitude(input.limits.speed_mps_max * input.dt_s) / input.dt_s
}

/// Greatest speed at which the body may go on for a tick if it is to stop within a distance, m/s: v dt + v² / 2a.
fn stoppable(distance_m: f64, input: &PlanInput<'_>) -> f64 {
    let (accel, dt_s) = (BRAKE_SHARE * input.limits.accel_mps2_max, input.dt_s);
    if accel.is_finite() { accel * ((dt_s * dt_s + 2.0 * distance_m / accel).sqrt() - dt_s) } else { distance_m / dt_s }
}

/// Greatest speed at a distance from where it is to stop, m/s; of a unicycle, also the greatest at which it can still
/// turn to a point there.
pub fn speed_near(distance_m: f64, heading_gain: f64, input: &PlanInput<'_>) -> f64 {
    let stopping = stoppable(distance_m, input);
    match input.kind {
        BodyKind::Point | BodyKind::TwoLinkArm => stopping,
        BodyKind::Unicycle | BodyKind::DiffDrive => stopping.min(heading_gain * distance_m),
    }
}
