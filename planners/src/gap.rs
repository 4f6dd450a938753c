//! Shares of the gap between two robots: what each may use up of it in a tick, so that the two never overlap.
//!
//! For two discs, n is the direction from the one to the other and g their gap. The one keeps v·n dt ≤ s g, the other
//! v·(−n) dt ≤ (1 − s) g: together they come nearer by no more than the gap, at every instant of the tick, whatever they do
//! otherwise. Standing still always fits.
//!
//! The share s is a half, or more for the one that was approaching faster, if both have said what they were about to do.
//! Both sides must come to shares that add up to one: they are computed from what was said, and from nothing else.

use geometry::HalfPlane;
use nalgebra::{Point2, Vector2};

/// Of the gap: what neither uses, so that rounding never adds up to a contact.
const SLACK: f64 = 1e-9;

/// One of two robots, as both know it.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    /// Where it is, m.
    pub at: Point2<f64>,
    /// Its radius, m.
    pub radius_m: f64,
    /// What it said last that it would do, m/s.
    pub command: Option<Vector2<f64>>,
}

/// The velocities with which `me` uses up no more than its share of the gap in a tick; nothing if the gap is wider than
/// `reach_m`.
pub fn own_share(me: &Side, other: &Side, dt_s: f64, reach_m: f64) -> Option<HalfPlane> {
    let offset = other.at - me.at;
    let distance_m = offset.norm();
    let gap_m = distance_m - me.radius_m - other.radius_m;
    if gap_m > reach_m || distance_m <= 0.0 {
        return None;
    }
    let toward = offset / distance_m;
    let share = match (me.command, other.command) {
        (Some(mine), Some(theirs)) if gap_m > 0.0 => {
            (0.5 + dt_s * (mine + theirs).dot(&toward) / (2.0 * gap_m)).clamp(0.0, 1.0)
        }
        _ => 0.5,
    };
    Some(HalfPlane::below(toward, (share * gap_m * (1.0 - SLACK) / dt_s).max(0.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Two robots that use all they may, in any direction, do not touch at any instant.
        #[test]
        fn two_that_use_all_they_may_do_not_touch(
            at in (-3.0..3.0f64, -3.0..3.0f64), radii in (0.05..0.5f64, 0.05..0.5f64),
            commands in prop::array::uniform4(-2.0..2.0f64), wishes in prop::array::uniform4(-9.0..9.0f64), tells: bool
        ) {
            let (dt_s, [a, b, c, d]) = (0.1, commands);
            let said = |command: Vector2<f64>| tells.then_some(command);
            let one = Side { at: Point2::origin(), radius_m: radii.0, command: said(Vector2::new(a, b)) };
            let two = Side { at: Point2::new(at.0, at.1), radius_m: radii.1, command: said(Vector2::new(c, d)) };
            prop_assume!((two.at - one.at).norm() > radii.0 + radii.1);
            let [e, f, g, h] = wishes;
            let velocity = |me: &Side, other: &Side, wish: Vector2<f64>| {
                let planes: Vec<HalfPlane> = own_share(me, other, dt_s, 9.0).into_iter().collect();
                geometry::half_planes::nearest(&planes, 2.0, wish).expect("standing still fits")
            };
            let (v, w) = (velocity(&one, &two, Vector2::new(e, f)), velocity(&two, &one, Vector2::new(g, h)));
            let closest = geometry::swept_distance(one.at, one.at + v * dt_s, two.at, two.at + w * dt_s);
            prop_assert!(closest >= radii.0 + radii.1, "{closest}");
        }
    }

    #[test]
    fn who_approaches_faster_has_the_greater_share_and_both_shares_are_one() {
        let side =
            |x: f64, vx: f64| Side { at: Point2::new(x, 0.0), radius_m: 0.2, command: Some(Vector2::new(vx, 0.0)) };
        let (fast, slow) = (side(0.0, 1.0), side(0.6, 0.0));
        let bound = |me: &Side, other: &Side| -own_share(me, other, 0.1, 9.0).unwrap().excess(Vector2::zeros()) * 0.1;
        let (first, second) = (bound(&fast, &slow), bound(&slow, &fast));
        assert!((first - 0.15).abs() < 1e-9 && (first + second - 0.2).abs() < 1e-9, "{first} {second}");
    }
}
