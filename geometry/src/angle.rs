//! Angles, and numbers on their way.

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

/// A value on its way to another, changed by no more than this.
#[inline]
pub fn towards(from: f64, to: f64, change_max: f64) -> f64 {
    if (to - from).abs() <= change_max { to } else { from + change_max.copysign(to - from) }
}
