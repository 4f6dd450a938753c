//! Everywhere the centre of a body may get to with a command, braking from then on.
//!
//! Bodies move as `model::kinematics` says. A point or a unicycle of speed v that brakes with a comes to rest within v² / (2 a); in
//! ticks it takes less. On wheels, each wheel rolls on as long as it takes, and the centre goes the mean of both ways, or half of
//! their difference if they roll against each other. A body that turns and cannot stop turning at once claims a disc as wide as that
//! way, whichever way it turns.

use super::Body;
use model::kinematics::Pose;
use model::{BodyKind, Drive};
use nalgebra::{Point2, Vector2};
use std::f64::consts::PI;

/// The convex hull of some discs, as displacements from where the robot is: their middles and radii, m.
#[derive(Clone, Debug, Default)]
pub(super) struct Claim {
    ends: Vec<(Vector2<f64>, f64)>,
}

impl Claim {
    /// How far it goes in a direction of length 1, m; at least zero, because the robot is where it is.
    pub(super) fn most_m(&self, direction: Vector2<f64>) -> f64 {
        self.ends.iter().fold(0.0f64, |most, (end, spare_m)| most.max(end.dot(&direction) + spare_m))
    }

    /// How far it goes at all, m.
    pub(super) fn farthest_m(&self) -> f64 {
        self.ends.iter().fold(0.0f64, |most, (end, spare_m)| most.max(end.norm() + spare_m))
    }

    /// The hull as a segment from the robot to the farthest middle, and how far all of it is beside that, m.
    pub(super) fn as_segment(&self) -> (Vector2<f64>, f64) {
        let far =
            self.ends.iter().fold(
                Vector2::zeros(),
                |far: Vector2<f64>, (end, _)| {
                    if end.norm_squared() > far.norm_squared() { *end } else { far }
                },
            );
        let line = geometry::Capsule::segment(Point2::origin(), Point2::from(far));
        let beside = self.ends.iter().map(|(end, spare_m)| line.distance(Point2::from(*end)) + spare_m);
        (far, beside.fold(0.0, f64::max))
    }

    /// Both claims as one.
    pub(super) fn join(&mut self, other: &Claim) {
        self.ends.extend(&other.ends);
    }
}

/// The claim of a body whose last command may act for some ticks more.
pub(super) fn held(body: &Body, pose: &Pose, still: Option<(Drive, u32)>, claim: &mut Claim) {
    claim.ends.clear();
    let origin = pose.position;
    let mut at = *pose;
    rest(body, &at, origin, claim);
    if let Some((drive, ticks)) = still {
        for _ in 0..ticks {
            go(body, &mut at, drive, origin, claim);
        }
    }
}

/// The claim of a command that may act for `ticks`, but may come as late as that; until it comes the one before it acts as long as
/// it may, and then the body stands.
pub(super) fn of(body: &Body, pose: &Pose, still: Option<(Drive, u32)>, drive: Drive, ticks: u32, claim: &mut Claim) {
    claim.ends.clear();
    let origin = pose.position;
    let (old, old_ticks) = still.unwrap_or((drive, 0));
    for waits in 0..ticks {
        let mut at = *pose;
        for _ in 0..waits.min(old_ticks) {
            go(body, &mut at, old, origin, claim);
        }
        if waits > old_ticks {
            at.halt();
        }
        for _ in waits..ticks {
            go(body, &mut at, drive, origin, claim);
        }
    }
}

/// One tick, after which it may brake.
fn go(body: &Body, at: &mut Pose, drive: Drive, origin: Point2<f64>, claim: &mut Claim) {
    let before = *at;
    match body.wheels {
        Some(wheels) => at.advance_on(&wheels, drive, &body.limits, body.dt_s),
        None => at.advance(drive, &body.limits, body.dt_s),
    }
    if body.kind != BodyKind::Point {
        let half = 0.5 * (at.turn_radps * body.dt_s).abs();
        let from = before.position - origin;
        if half < 0.4 * PI {
            // An arc lies within the triangle of its chord and its tangents.
            let ahead = Vector2::new(before.yaw_rad.cos(), before.yaw_rad.sin()) * 1.0f64.copysign(at.speed_mps);
            let tangent_m = 0.5 * (at.position - before.position).norm() / half.cos();
            claim.ends.extend([(from, 0.0), (from + ahead * tangent_m, 0.0)]);
        } else {
            claim.ends.push((from, at.speed_mps.abs() * body.dt_s));
        }
    }
    rest(body, at, origin, claim);
}

/// From here on it brakes.
fn rest(body: &Body, at: &Pose, origin: Point2<f64>, claim: &mut Claim) {
    let from = at.position - origin;
    let (way_m, turns) = brakes(body, at);
    if turns {
        // Wherever the way leads that it turns on: a disc, of which what is left of the way never leads out.
        claim.ends.push((from, way_m));
        return;
    }
    claim.ends.push((from, 0.0));
    if way_m > 0.0 {
        let ahead = match body.kind {
            BodyKind::Point => at.velocity.normalize(),
            _ => Vector2::new(at.yaw_rad.cos(), at.yaw_rad.sin()) * 1.0f64.copysign(at.speed_mps),
        };
        claim.ends.push((from + ahead * way_m, 0.0));
    }
}

/// The way on which it comes to rest, m, and whether it may turn on that way.
fn brakes(body: &Body, at: &Pose) -> (f64, bool) {
    match body.wheels {
        Some(wheels) if wheels.accel_radps2_max.is_finite() => {
            let [left, right] = at.wheel_radps;
            let ways = [left, right].map(|rate| braked_rad(rate.abs(), wheels.accel_radps2_max, body.dt_s));
            // Wheels that roll against each other move the centre by what they differ.
            let both = if left * right >= 0.0 { ways[0] + ways[1] } else { (ways[0] - ways[1]).abs() };
            (0.5 * wheels.radius_m * both, left != right)
        }
        None if body.limits.accel_mps2_max.is_finite() => {
            let speed = if body.kind == BodyKind::Point { at.velocity.norm() } else { at.speed_mps };
            let turns = at.turn_radps != 0.0 && body.limits.turn_accel_radps2_max.is_finite();
            (speed * speed / (2.0 * body.limits.accel_mps2_max), turns)
        }
        _ => (0.0, false),
    }
}

/// How far a wheel turns until it stands, braking at the start of every tick, rad.
fn braked_rad(rate: f64, accel: f64, dt_s: f64) -> f64 {
    let change = accel * dt_s;
    let ticks = (rate / change).floor();
    dt_s * (ticks * rate - change * 0.5 * ticks * (ticks + 1.0))
}

/// The greatest way on which this body comes to rest, m.
pub(super) fn brake_m(body: &Body) -> f64 {
    match body.wheels {
        Some(wheels) if wheels.accel_radps2_max.is_finite() => {
            wheels.radius_m * wheels.speed_radps_max * wheels.speed_radps_max / (2.0 * wheels.accel_radps2_max)
        }
        None if body.limits.accel_mps2_max.is_finite() => {
            let speed = body.limits.speed_mps_max.max(body.limits.reverse_mps_max);
            speed * speed / (2.0 * body.limits.accel_mps2_max)
        }
        _ => 0.0,
    }
}

/// How many ticks that takes at most.
pub(super) fn brake_ticks(body: &Body) -> f64 {
    let time_s = match body.wheels {
        Some(wheels) if wheels.accel_radps2_max.is_finite() => wheels.speed_radps_max / wheels.accel_radps2_max,
        None if body.limits.accel_mps2_max.is_finite() => {
            body.limits.speed_mps_max.max(body.limits.reverse_mps_max) / body.limits.accel_mps2_max
        }
        _ => 0.0,
    };
    (time_s / body.dt_s).ceil()
}
