//! Where and when two bodies that came into contact in a tick touched first: for the log, so only of contacts.

use crate::moving::Moving;
use geometry::{Capsule, segments_cross};
use nalgebra::{Point2, Vector2};

/// Instants at which links that turn are looked at. A touch is found to a small part of the time between two of them.
const INSTANTS: u32 = 64;
/// Halvings of an interval: to a billionth of a tick.
const HALVINGS: u32 = 30;

/// The first touch of two bodies, made of parts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct First {
    /// When, as a share of the tick.
    pub(crate) share: f64,
    /// Where, m.
    pub(crate) at: Point2<f64>,
}

/// The first touch of two bodies in a tick; `None` if no part of one touches a part of the other, as when a body appears
/// inside a polygon.
pub(crate) fn first<'a>(parts: &[Moving<'_>], others: impl Iterator<Item = Moving<'a>>) -> Option<First> {
    let mut found: Option<First> = None;
    for other in others {
        for part in parts {
            if let Some(share) = share(part, &other).filter(|share| found.is_none_or(|first| *share < first.share)) {
                found = Some(First { share, at: between(&part.at(share), &other.at(share)) });
            }
        }
    }
    found
}

fn share(a: &Moving<'_>, b: &Moving<'_>) -> Option<f64> {
    let gap = |t: f64| {
        let (a, b) = (a.at(t), b.at(t));
        let (p, q) = nearest(&a, &b);
        (q - p).norm() - a.radius - b.radius
    };
    let at_first = gap(0.0);
    if at_first <= 0.0 {
        return Some(0.0);
    }
    if at_first > a.travel_m() + b.travel_m() {
        return None;
    }
    // Apart at one instant and together at a later one: the touch is in between.
    let bisect = |mut apart: f64, mut together: f64| {
        for _ in 0..HALVINGS {
            let t = 0.5 * (apart + together);
            *(if gap(t) > 0.0 { &mut apart } else { &mut together }) = t;
        }
        together
    };
    if let (Moving::Straight { .. }, Moving::Straight { .. }) = (a, b) {
        // The distance of two convex bodies that move straight is a convex function of time: its least is found by thirds.
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..2 * HALVINGS {
            let (t1, t2) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            let (gap1, gap2) = (gap(t1), gap(t2));
            if gap1.min(gap2) <= 0.0 {
                return Some(bisect(0.0, if gap1 <= 0.0 { t1 } else { t2 }));
            }
            if gap1 < gap2 { high = t2 } else { low = t1 }
        }
        return [0.5 * (low + high), 1.0].into_iter().find(|t| gap(*t) <= 0.0).map(|t| bisect(0.0, t));
    }
    let instant = |i: u32| f64::from(i) / f64::from(INSTANTS);
    let together = (1..=INSTANTS).find(|i| gap(instant(*i)) <= 0.0)?;
    Some(bisect(instant(together - 1), instant(together)))
}

/// The point where two bodies touch, or the middle of how far they overlap.
fn between(a: &Capsule, b: &Capsule) -> Point2<f64> {
    let (p, q) = nearest(a, b);
    let (apart, distance) = (q - p, (q - p).norm());
    let direction = if distance > 0.0 { apart / distance } else { Vector2::zeros() };
    p + direction * (a.radius + 0.5 * (distance - a.radius - b.radius)).clamp(0.0, distance)
}

/// The nearest points of two cores.
fn nearest(a: &Capsule, b: &Capsule) -> (Point2<f64>, Point2<f64>) {
    if segments_cross(a.a, a.b, b.a, b.b) {
        let (along, across) = (a.b - a.a, b.b - b.a);
        let at = a.a + along * ((b.a - a.a).perp(&across) / along.perp(&across));
        return (at, at);
    }
    let ends = [
        (a.a, b.nearest_core(a.a)),
        (a.b, b.nearest_core(a.b)),
        (a.nearest_core(b.a), b.a),
        (a.nearest_core(b.b), b.b),
    ];
    let nearer = |x: &(Point2<f64>, Point2<f64>), y: &(Point2<f64>, Point2<f64>)| {
        (x.1 - x.0).norm_squared().total_cmp(&(y.1 - y.0).norm_squared())
    };
    ends.into_iter().min_by(nearer).expect("there are four")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc(from: [f64; 2], to: [f64; 2], radius: f64) -> Moving<'static> {
        Moving::Straight { from: Capsule::disc(from.into(), radius), to: Capsule::disc(to.into(), radius) }
    }

    fn check(a: Moving<'_>, b: Moving<'_>, expected: Option<(f64, [f64; 2])>) {
        let found = [first(&[a], [b].into_iter()), first(&[b], [a].into_iter())];
        for found in found {
            match (found, expected) {
                (Some(First { share, at }), Some((when, place))) => {
                    assert!((share - when).abs() < 1e-7, "{share}, not {when}");
                    assert!((at - Point2::from(place)).norm() < 1e-5, "{at}, not {place:?}");
                }
                _ => assert_eq!(found.is_some(), expected.is_some()),
            }
        }
    }

    #[test]
    fn touches_by_hand() {
        let still = |at| disc(at, at, 0.5);
        // Head on, 600 m in a tick; each is at its half of the gap.
        check(
            disc([-300.0, 0.0], [300.0, 0.0], 0.5),
            disc([300.0, 0.0], [-300.0, 0.0], 0.5),
            Some((0.5 - 0.5 / 600.0, [0.0, 0.0])),
        );
        check(disc([-10.0, 0.0], [10.0, 0.0], 0.5), still([3.0, 0.0]), Some((0.6, [2.5, 0.0])));
        check(disc([-10.0, 0.0], [10.0, 0.0], 0.5), still([3.0, 1.1]), None);
        check(disc([-10.0, 0.0], [1.0, 0.0], 0.5), still([3.0, 0.0]), None);
        // Together from the beginning: in the middle of the overlap.
        check(still([0.0, 0.0]), still([0.8, 0.0]), Some((0.0, [0.4, 0.0])));
        // Through a thin wall, and into the side of it.
        let wall = Capsule::segment(Point2::new(1.0, -10.0), Point2::new(1.0, 10.0));
        let wall = Moving::Straight { from: wall, to: wall };
        check(disc([-299.0, 2.0], [301.0, 2.0], 0.05), wall, Some((299.95 / 600.0, [1.0, 2.0])));
        check(disc([1.0, 110.1], [1.0, 10.0], 0.1), wall, Some((100.0 / 100.1, [1.0, 10.0])));
    }
}
