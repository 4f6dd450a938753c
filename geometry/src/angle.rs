//! Angles.

use nalgebra::Vector2;

/// The angle in (-π, π].
#[inline]
pub fn wrap(angle_rad: f64) -> f64 {
    let wrapped = angle_rad.rem_euclid(std::f64::consts::TAU);
    if wrapped > std::f64::consts::PI { wrapped - std::f64::consts::TAU } else { wrapped }
}

/// The heading of a direction, rad; 0 for none.
#[inline]
pub fn heading(direction: Vector2<f64>) -> f64 {
    if direction.norm_squared() > 0.0 { direction.y.atan2(direction.x) } else { 0.0 }
}
