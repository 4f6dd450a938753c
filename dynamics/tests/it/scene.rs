//! What the tests share: bodies, and worlds of a few of them.

use geometry::Capsule;
use model::{BodyKind, Drive, Dynamics, Limits, Wheels};
use nalgebra::{Point2, Vector2};
use shoal_dynamics::{Bodies, Chassis, State};

pub(crate) const DT_S: f64 = 0.02;

pub(crate) const LIMITS: Limits = Limits {
    speed_mps_max: 2.0,
    reverse_mps_max: 2.0,
    turning_radius_m_min: 0.0,
    turn_radps_max: 6.0,
    accel_mps2_max: f64::INFINITY,
    turn_accel_radps2_max: f64::INFINITY,
};
pub(crate) const DYNAMICS: Dynamics = Dynamics { mass_kg: 1.0, friction: 0.3, grip: 0.8 };
/// As a TurtleBot3 Burger has them.
pub(crate) const WHEELS: Wheels = Wheels {
    radius_m: 0.033,
    track_m: 0.16,
    speed_radps_max: 6.67,
    accel_radps2_max: 60.0,
    torque_nm_max: f64::INFINITY,
};

pub(crate) fn point(mass_kg: f64) -> Chassis {
    let dynamics = Dynamics { mass_kg, ..DYNAMICS };
    Chassis { kind: BodyKind::Point, limits: LIMITS, wheels: None, dynamics, radius_m: 0.2 }
}

pub(crate) fn unicycle() -> Chassis {
    Chassis { kind: BodyKind::Unicycle, ..point(1.0) }
}

pub(crate) fn wheeled() -> Chassis {
    Chassis { kind: BodyKind::DiffDrive, wheels: Some(WHEELS), radius_m: 0.105, ..point(1.0) }
}

/// On ice: nothing that its drive does moves it.
pub(crate) fn on_ice(chassis: Chassis) -> Chassis {
    Chassis { dynamics: Dynamics { grip: 0.0, ..chassis.dynamics }, ..chassis }
}

pub(crate) fn world_among(obstacles: &[Capsule]) -> Bodies {
    Bodies::new(DT_S, obstacles.iter().map(|piece| (std::slice::from_ref(piece), Vector2::zeros(), false)))
}

pub(crate) fn world() -> Bodies {
    world_among(&[])
}

/// A wall along the y axis, at this x.
pub(crate) fn wall_at(x_m: f64) -> Capsule {
    Capsule::segment(Point2::new(x_m, -50.0), Point2::new(x_m, 50.0))
}

pub(crate) fn run(world: &mut Bodies, drives: &[Option<Drive>], ticks: usize) {
    (0..ticks).for_each(|_| world.tick(drives, |_| [Vector2::zeros(); 2]));
}

pub(crate) fn state(world: &Bodies, slot: usize) -> State {
    world.state(slot).expect("it is here")
}

pub(crate) fn velocity(x: f64, y: f64) -> Option<Drive> {
    Some(Drive::Velocity(Vector2::new(x, y)))
}

pub(crate) fn twist(speed_mps: f64, turn_radps: f64) -> Option<Drive> {
    Some(Drive::Twist { speed_mps, turn_radps })
}
