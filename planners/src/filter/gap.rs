//! The line between two robots that both compute from the same words.
//!
//! Each has told where it is now and where it would come to rest from here: a disc that is swept along a segment. n is the direction
//! from the one segment to the other where they are nearest, and g the gap between the two. The one may use up s g of it, the
//! other (1 - s) g: whatever they do otherwise, together they come nearer by no more than the gap, at every instant. Standing
//! still always fits.
//!
//! The share s is 1/2 + Δt (c + c') · n / (2 g), between 0 and 1: more than a half for the one that was approaching faster (c and c'
//! are the commands that both have told). Both come to shares that add up to one: they are computed from what was said, from nothing
//! else, and in the same order.

use nalgebra::{Point2, Vector2};

/// Of the gap: what neither uses, so that rounding never adds up to a contact.
const SLACK: f64 = 1e-9;

/// One of two robots, as both know it.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    /// Its slot.
    pub robot: u32,
    /// Where it is, m.
    pub at: Point2<f64>,
    /// Where it would come to rest if it braked, m.
    pub far: Point2<f64>,
    /// Its radius, and what its centre may be beside the line between the two, m.
    pub radius_m: f64,
    /// The velocity with which it came here, m/s.
    pub command: Vector2<f64>,
}

/// The side of the line that is `me`'s: x · normal ≤ bound for every point x of its disc, at any time of the tick and until it
/// rests. Nothing if the gap is wider than `reach_m`, or if both are in one place.
pub fn own_share(me: &Side, other: &Side, dt_s: f64, reach_m: f64) -> Option<(Vector2<f64>, f64)> {
    let is_first = me.robot < other.robot;
    let (one, two) = if is_first { (me, other) } else { (other, me) };
    let between = geometry::between_segments(one.at, one.far, two.at, two.far);
    let normal = between.try_normalize(0.0)?;
    // How far each of them reaches to the other one. Measured along the normal, so that a normal that is a little off does no harm.
    let front = |side: &Side, normal: Vector2<f64>| {
        side.at.coords.dot(&normal).max(side.far.coords.dot(&normal)) + side.radius_m
    };
    let fronts = [front(one, normal), front(two, -normal)];
    let gap_m = -fronts[0] - fronts[1];
    if gap_m > reach_m {
        return None;
    }
    // Of a gap that is none, nothing is used.
    let (share, gap_m) = if gap_m > 0.0 {
        ((0.5 + dt_s * (one.command + two.command).dot(&normal) / (2.0 * gap_m)).clamp(0.0, 1.0), gap_m)
    } else {
        (0.5, 0.0)
    };
    let used = |share: f64| share * gap_m * (1.0 - SLACK);
    Some(if is_first { (normal, fronts[0] + used(share)) } else { (-normal, fronts[1] + used(1.0 - share)) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn side(robot: u32, x: f64, command: f64) -> Side {
        let at = Point2::new(x, 0.0);
        Side { robot, at, far: at, radius_m: 0.2, command: Vector2::new(command, 0.0) }
    }

    fn own_way(me: &Side, other: &Side) -> f64 {
        let (normal, bound) = own_share(me, other, 0.1, 9.0).unwrap();
        bound - me.at.coords.dot(&normal) - me.radius_m
    }

    #[test]
    fn who_approaches_faster_has_the_greater_share_and_both_shares_are_one() {
        let (fast, slow) = (side(0, 0.0, 1.0), side(1, 0.6, 0.0));
        let (first, second) = (own_way(&fast, &slow), own_way(&slow, &fast));
        assert!((first - 0.15).abs() < 1e-9 && (first + second - 0.2).abs() < 1e-9, "{first} {second}");
    }

    #[test]
    fn what_a_robot_needs_to_stop_is_not_shared() {
        let (fast, slow) = (side(0, 0.0, 0.0), side(1, 0.9, 0.0));
        let fast = Side { far: Point2::new(0.3, 0.0), ..fast };
        let (first, second) = (own_way(&fast, &slow), own_way(&slow, &fast));
        assert!((first - 0.4).abs() < 1e-9 && (second - 0.1).abs() < 1e-9, "{first} {second}");
    }

    proptest! {
        /// The two lines leave no point to both.
        #[test]
        fn both_sides_never_meet(
            at in (-3.0..3.0f64, -3.0..3.0f64), brakes in prop::array::uniform4(-0.5..0.5f64),
            radii in (0.05..0.5f64, 0.05..0.5f64), commands in prop::array::uniform4(-2.0..2.0f64)
        ) {
            let [a, b, c, d] = brakes;
            let [e, f, g, h] = commands;
            let one_at = Point2::new(1e3, -2e3);
            let two_at = one_at + Vector2::new(at.0, at.1);
            let one = Side {
                robot: 0, at: one_at, far: one_at + Vector2::new(a, b), radius_m: radii.0, command: Vector2::new(e, f)
            };
            let two = Side {
                robot: 1, at: two_at, far: two_at + Vector2::new(c, d), radius_m: radii.1, command: Vector2::new(g, h)
            };
            prop_assume!(geometry::segment_distance(one.at, one.far, two.at, two.far) > radii.0 + radii.1);
            let (n, first) = own_share(&one, &two, 0.1, 99.0).unwrap();
            let (m, second) = own_share(&two, &one, 0.1, 99.0).unwrap();
            prop_assert_eq!(n, -m);
            prop_assert!(first <= -second + 1e-12, "{} {}", first, second);
            // And each of them has what it needs to stop.
            for (side, normal, bound) in [(one, n, first), (two, m, second)] {
                for end in [side.at, side.far] {
                    prop_assert!(end.coords.dot(&normal) + side.radius_m <= bound + 1e-9);
                }
            }
        }
    }
}
