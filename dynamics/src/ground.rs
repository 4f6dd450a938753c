//! What the ground gives a body in one step. A drive asks for a velocity, and each patch of ground under the body holds it
//! to that velocity with as much force as its motor, its limits and Coulomb friction allow (mass times gravity times grip
//! at most). The engine solves these together with the contacts, so a body that brakes is not pushed away by less than
//! its ground holds.
//!
//! - A point pushes in any direction, with its whole weight on one patch.
//! - A unicycle pushes forwards, and its patch keeps it from sliding sideways; it turns on the friction of a disc of its
//!   own radius (two thirds of the weight times the radius).
//! - A differential drive has half of its weight on each wheel, and each wheel the torque of its motor.
//!
//! What a patch spends along the asked change is not there to hold it sideways (the circle of friction). Force along may
//! still grow where a contact pushes back, so both together reach at most 1.4 times the friction.

use model::{BodyKind, Drive, Dynamics, Limits, Robot, Wheels};
use nalgebra::Vector2;

/// Standard gravity, m/s².
pub(crate) const GRAVITY_MPS2: f64 = 9.806_65;

/// What a body is: an even disc that stands on its feet or wheels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chassis {
    /// How it moves.
    pub kind: BodyKind,
    /// What it can do on firm ground.
    pub limits: Limits,
    /// Its wheels, if it drives on two.
    pub wheels: Option<Wheels>,
    /// Its mass, and what holds it.
    pub dynamics: Dynamics,
    /// Of the disc, m.
    pub radius_m: f64,
}

impl Chassis {
    /// That of a robot.
    pub fn of(robot: &Robot) -> Chassis {
        let Robot { kind, limits, wheels, dynamics, radius_m, .. } = *robot;
        Chassis { kind, limits, wheels, dynamics, radius_m }
    }
}

/// How a body moves, seen from itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Course {
    /// Forwards and to the left, m/s. Of a point, whose heading means nothing, along the axes of the world.
    pub(crate) velocity: Vector2<f64>,
    /// Counter-clockwise, rad/s.
    pub(crate) turn_radps: f64,
}

/// A velocity, m/s or rad/s, and the most that holds a body to it, N or Nm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hold {
    pub(crate) velocity: f64,
    pub(crate) most: f64,
}

/// A patch of ground under a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Patch {
    /// How far to the left of the centre, m.
    pub(crate) aside_m: f64,
    /// The direction of `along`, in the frame of the [`Course`]: a unit vector. `across` is to its left.
    pub(crate) forward: Vector2<f64>,
    pub(crate) along: Hold,
    pub(crate) across: Hold,
    pub(crate) spin: Option<Hold>,
}

impl Chassis {
    /// Of an even disc, kg m².
    fn inertia(&self) -> f64 {
        0.5 * self.dynamics.mass_kg * self.radius_m * self.radius_m
    }

    /// The most that the ground holds, N.
    fn held(&self) -> f64 {
        self.dynamics.grip * self.dynamics.mass_kg * GRAVITY_MPS2
    }

    /// The rates that the motors of its wheels aim at at the end of a step, left and right, rad/s. Without a drive they stop.
    pub(crate) fn aim(&self, drive: Option<Drive>, rates_radps: [f64; 2], h_s: f64) -> [f64; 2] {
        let Some(wheels) = self.wheels else { return [0.0; 2] };
        let wanted = drive.and_then(|drive| wheels.rates_for(drive, &self.limits)).unwrap_or([0.0; 2]);
        wheels.towards(rates_radps, wanted, h_s)
    }

    /// What the ground gives in a step of `h_s` to a body on this course that is asked to drive like this, or whose wheels
    /// aim at these rates; without a drive it brakes. One patch, or one under each wheel.
    pub(crate) fn patches(
        &self,
        drive: Option<Drive>,
        aim_radps: [f64; 2],
        course: Course,
        h_s: f64,
    ) -> [Option<Patch>; 2] {
        if let Some(wheels) = self.wheels {
            return [(-1.0, aim_radps[1]), (1.0, aim_radps[0])].map(|side| Some(self.wheel(wheels, side, course, h_s)));
        }
        let patch = match drive.unwrap_or_else(|| Drive::stop(self.kind)).within(&self.limits) {
            Drive::Velocity(wanted) => self.foot(wanted, course, h_s),
            Drive::Twist { speed_mps, turn_radps } => self.castor(speed_mps, turn_radps, course, h_s),
            // Commands of other bodies.
            Drive::Joints { .. } | Drive::Wheels { .. } => self.foot(Vector2::zeros(), course, h_s),
        };
        [Some(patch), None]
    }

    /// The patch of a point.
    fn foot(&self, wanted: Vector2<f64>, course: Course, h_s: f64) -> Patch {
        let change = wanted - course.velocity;
        let forward = change.try_normalize(0.0).unwrap_or_else(Vector2::x);
        let most = self.held().min(self.dynamics.mass_kg * self.limits.accel_mps2_max);
        let along = Hold { velocity: wanted.dot(&forward), most };
        let spent = (self.dynamics.mass_kg * change.norm() / h_s).min(most);
        let across = self.left_over(self.held(), spent).min(most);
        Patch {
            aside_m: 0.0,
            forward,
            along,
            across: Hold { velocity: forward.perp(&wanted), most: across },
            spin: None,
        }
    }

    /// The patch of a unicycle.
    fn castor(&self, speed_mps: f64, turn_radps: f64, course: Course, h_s: f64) -> Patch {
        let (held, mass) = (self.held(), self.dynamics.mass_kg);
        let most = held.min(mass * self.limits.accel_mps2_max);
        let spent = (mass * (speed_mps - course.velocity.x).abs() / h_s).min(most);
        let across = self.left_over(held, spent);
        let turn_max = self.limits.turn_at(course.velocity.x);
        let spin_most = (held * self.radius_m * 2.0 / 3.0).min(self.inertia() * self.limits.turn_accel_radps2_max);
        Patch {
            aside_m: 0.0,
            forward: Vector2::x(),
            along: Hold { velocity: speed_mps, most },
            across: Hold { velocity: 0.0, most: across },
            spin: Some(Hold { velocity: turn_radps.clamp(-turn_max, turn_max), most: spin_most }),
        }
    }

    /// The patch under a wheel, on the left (1) or on the right (-1), that aims at a rate.
    fn wheel(&self, wheels: Wheels, (side, aim_radps): (f64, f64), course: Course, h_s: f64) -> Patch {
        let aside_m = side * 0.5 * wheels.track_m;
        let held = 0.5 * self.held();
        let velocity = aim_radps * wheels.radius_m;
        let here = course.velocity.x - course.turn_radps * aside_m;
        let along = Hold { velocity, most: held.min(self.motor(wheels)) };
        let spent = (0.5 * self.dynamics.mass_kg * (velocity - here).abs() / h_s).min(along.most);
        let across = Hold { velocity: 0.0, most: self.left_over(held, spent) };
        Patch { aside_m, forward: Vector2::x(), along, across, spin: None }
    }

    /// The force of a motor where its wheel meets the ground, N.
    fn motor(&self, wheels: Wheels) -> f64 {
        wheels.torque_nm_max / wheels.radius_m
    }

    /// What is left of friction beside what is spent across it, N.
    fn left_over(&self, held: f64, spent: f64) -> f64 {
        (held * held - spent * spent).max(0.0).sqrt()
    }

    /// The rates of the wheels after a step in which the body came to this course. A motor that is stronger than the grip of
    /// its wheel keeps it at the rate that it aims at, on whatever ground; a weaker one stalls and turns as the ground goes
    /// by. No wheel passes its limits, of rate and of change.
    pub(crate) fn rates_after(&self, aim_radps: [f64; 2], rates_radps: [f64; 2], course: Course, h_s: f64) -> [f64; 2] {
        let Some(wheels) = self.wheels else { return [0.0; 2] };
        if self.motor(wheels) >= 0.5 * self.held() {
            return aim_radps;
        }
        let ground = wheels.rates_of(course.velocity.x, course.turn_radps);
        let ground = ground.map(|rate| rate.clamp(-wheels.speed_radps_max, wheels.speed_radps_max));
        wheels.towards(rates_radps, ground, h_s)
    }
}
