//! Every rule of AMR-APF, with values computed by hand from the paper's equations. The worked examples of its
//! specification are rows of `reproduce`; here no rule leans on them.

mod crowds;
mod cycle;
mod obstacles;
mod robots;

use super::field::Own;
use super::params::{Params, Preset};
use nalgebra::{Point2, Rotation2, Vector2};

/// A robot at the origin with this heading, and its goal.
fn own(heading_deg: f64, goal: [f64; 2]) -> Own {
    Own { position: Point2::origin(), heading_rad: heading_deg.to_radians(), goal: goal.into(), sgn_zero: false }
}

/// A preset with sgn(0) = +1.
fn preset(preset: Preset) -> Params {
    Params::of(preset)
}

/// A force in the world.
fn world(own: &Own, force: Vector2<f64>) -> Vector2<f64> {
    Rotation2::new(own.heading_rad) * force
}

/// The place at this distance and bearing from another one.
fn off(from: [f64; 2], distance_m: f64, bearing_deg: f64) -> [f64; 2] {
    let (sin, cos) = bearing_deg.to_radians().sin_cos();
    [from[0] + distance_m * cos, from[1] + distance_m * sin]
}

fn assert_near(found: Vector2<f64>, expected: [f64; 2], what: &str) {
    assert!((found - Vector2::from(expected)).norm() < 1e-9, "{what}: {found:?} instead of {expected:?}");
}
