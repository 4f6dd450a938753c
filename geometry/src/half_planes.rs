//! The point of a disc that lies in many half-planes and is nearest to a wished one: linear programs in the plane.
//!
//! de Berg, Cheong, van Kreveld, Overmars, "Computational Geometry", 3rd ed. 2008, ch. 4 (incremental, in the order given,
//! which is not shuffled, so that the answer is the same again); and for half-planes that have no point in common van den Berg,
//! Guy, Lin, Manocha 2011, sec. 5.3: the point that goes least far outside any of them.

use nalgebra::Vector2;

/// Lines of nearly one direction count as parallel: the sine of the angle between them.
const PARALLEL: f64 = 1e-10;

/// What lies to the left of a line, the line included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfPlane {
    /// A point of the line.
    pub point: Vector2<f64>,
    /// The direction of the line, of length 1.
    pub direction: Vector2<f64>,
}

impl HalfPlane {
    /// All x with `normal` · x ≤ `bound`; the normal has length 1.
    #[inline]
    pub fn below(normal: Vector2<f64>, bound: f64) -> HalfPlane {
        HalfPlane { point: normal * bound, direction: Vector2::new(-normal.y, normal.x) }
    }

    /// How far a point is outside, negative inside.
    #[inline]
    pub fn excess(&self, x: Vector2<f64>) -> f64 {
        self.direction.perp(&(self.point - x))
    }

    /// The half-plane grown by a distance.
    #[inline]
    pub fn relaxed(&self, by: f64) -> HalfPlane {
        HalfPlane { point: self.point + Vector2::new(self.direction.y, -self.direction.x) * by, ..*self }
    }
}

/// What is looked for.
#[derive(Clone, Copy)]
enum Aim {
    /// The point nearest to this one.
    Near(Vector2<f64>),
    /// The point farthest in this direction, of length 1.
    Along(Vector2<f64>),
}

/// The point within `radius` of the origin and in all half-planes that is nearest to `wish`. If there is none, `Err` has the
/// index of the first half-plane that has no point in common with those before it, and the best point for those.
pub fn nearest(planes: &[HalfPlane], radius: f64, wish: Vector2<f64>) -> Result<Vector2<f64>, (usize, Vector2<f64>)> {
    solve(planes, radius, Aim::Near(wish))
}

/// The same for half-planes of which only the first `hard` have to hold: where not all can, the point is as little as
/// possible outside any of the others. The hard ones must have a point in common. `room` is only used for work.
pub fn nearest_relaxed(
    planes: &[HalfPlane],
    hard: usize,
    radius: f64,
    wish: Vector2<f64>,
    room: &mut Vec<HalfPlane>,
) -> Vector2<f64> {
    match nearest(planes, radius, wish) {
        Ok(x) => x,
        Err((failed, best)) => least_excess(planes, hard, radius, failed.max(hard), best, room),
    }
}

/// From the half-plane with index `failed` on: the point in the hard ones that is least far outside the others, of which each
/// in turn that is worse than the worst so far is made the worst.
fn least_excess(
    planes: &[HalfPlane],
    hard: usize,
    radius: f64,
    failed: usize,
    mut best: Vector2<f64>,
    room: &mut Vec<HalfPlane>,
) -> Vector2<f64> {
    let mut worst = 0.0;
    for (index, plane) in planes.iter().enumerate().skip(failed) {
        if plane.excess(best) <= worst {
            continue;
        }
        room.clear();
        room.extend(&planes[..hard]);
        for other in &planes[hard..index] {
            // Where both are outside equally far.
            let sine = plane.direction.perp(&other.direction);
            let point = if sine.abs() <= PARALLEL {
                if plane.direction.dot(&other.direction) > 0.0 {
                    continue;
                }
                (plane.point + other.point) * 0.5
            } else {
                plane.point + plane.direction * (other.direction.perp(&(plane.point - other.point)) / sine)
            };
            let direction = other.direction - plane.direction;
            room.push(HalfPlane { point, direction: direction / direction.norm() });
        }
        // The deepest point of the half-plane, on its left.
        let inward = Vector2::new(-plane.direction.y, plane.direction.x);
        // The present point is one that fits, up to rounding: where no better is found, it stays.
        if let Ok(deeper) = solve(room, radius, Aim::Along(inward)) {
            best = deeper;
        }
        worst = plane.excess(best);
    }
    best
}

fn solve(planes: &[HalfPlane], radius: f64, aim: Aim) -> Result<Vector2<f64>, (usize, Vector2<f64>)> {
    let mut best = match aim {
        Aim::Near(wish) => wish.cap_magnitude(radius),
        Aim::Along(direction) => direction * radius,
    };
    for (index, plane) in planes.iter().enumerate() {
        if plane.excess(best) > 0.0 {
            best = on_line(&planes[..index], plane, radius, aim).ok_or((index, best))?;
        }
    }
    Ok(best)
}

/// The best point on the line of a half-plane, in the disc and in those before it.
fn on_line(before: &[HalfPlane], plane: &HalfPlane, radius: f64, aim: Aim) -> Option<Vector2<f64>> {
    let HalfPlane { point, direction } = *plane;
    let middle = -point.dot(&direction);
    let square = middle * middle + radius * radius - point.norm_squared();
    if square < 0.0 {
        return None;
    }
    let half = square.sqrt();
    let (mut low, mut high) = (middle - half, middle + half);
    for other in before {
        let sine = direction.perp(&other.direction);
        let outside = other.direction.perp(&(point - other.point));
        if sine.abs() <= PARALLEL {
            if outside < 0.0 {
                return None;
            }
            continue;
        }
        let t = outside / sine;
        if sine >= 0.0 {
            high = high.min(t);
        } else {
            low = low.max(t);
        }
        if low > high {
            return None;
        }
    }
    let t = match aim {
        Aim::Near(wish) => direction.dot(&(wish - point)).clamp(low, high),
        Aim::Along(along) if direction.dot(&along) > 0.0 => high,
        Aim::Along(_) => low,
    };
    Some(point + direction * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn planes() -> impl Strategy<Value = Vec<HalfPlane>> {
        prop::collection::vec((0.0..std::f64::consts::TAU, -0.8..1.5f64), 0..12).prop_map(|all| {
            let plane = |(angle, bound): (f64, f64)| HalfPlane::below(Vector2::new(angle.cos(), angle.sin()), bound);
            all.into_iter().map(plane).collect()
        })
    }

    /// Many points of the disc, the wish among them.
    fn grid(wish: Vector2<f64>) -> impl Iterator<Item = Vector2<f64>> {
        let at = |x: i32, y: i32| Vector2::new(f64::from(x), f64::from(y)) / 40.0;
        let all = (-40..=40).flat_map(move |x| (-40..=40).map(move |y| at(x, y)));
        all.filter(|x| x.norm() <= 1.0).chain([wish.cap_magnitude(1.0)])
    }

    fn worst(planes: &[HalfPlane], x: Vector2<f64>) -> f64 {
        planes.iter().map(|plane| plane.excess(x)).fold(0.0, f64::max)
    }

    #[test]
    fn what_is_free_is_the_wish_and_a_wall_is_slid_along() {
        let wish = Vector2::new(0.6, 0.3);
        assert_eq!(nearest(&[], 1.0, wish), Ok(wish));
        let wall = HalfPlane::below(Vector2::x(), 0.2);
        assert!((nearest(&[wall], 1.0, wish).unwrap() - Vector2::new(0.2, 0.3)).norm() < 1e-12);
        assert!((wall.relaxed(0.1).excess(Vector2::new(0.35, 5.0)) - 0.05).abs() < 1e-12);
    }

    #[test]
    fn of_opposite_half_planes_the_middle_is_the_least_evil() {
        let planes = [HalfPlane::below(Vector2::x(), -0.2), HalfPlane::below(-Vector2::x(), -0.4)];
        let x = nearest_relaxed(&planes, 0, 1.0, Vector2::new(0.9, 0.0), &mut Vec::new());
        assert!((x.x - 0.1).abs() < 1e-12, "{x}");
        // The hard one holds.
        let x = nearest_relaxed(&planes, 1, 1.0, Vector2::new(0.9, 0.0), &mut Vec::new());
        assert!((x.x + 0.2).abs() < 1e-12, "{x}");
    }

    proptest! {
        #[test]
        fn nothing_is_nearer_that_fits(planes in planes(), x in -1.5..1.5f64, y in -1.5..1.5f64) {
            let wish = Vector2::new(x, y);
            let found = nearest(&planes, 1.0, wish);
            if let Ok(found) = found {
                prop_assert!(found.norm() <= 1.0 + 1e-9 && worst(&planes, found) < 1e-9);
            }
            let limit = found.map_or(f64::INFINITY, |found| (found - wish).norm() - 1e-9);
            for other in grid(wish).filter(|x| worst(&planes, *x) <= 0.0) {
                prop_assert!(found.is_ok() && (other - wish).norm() >= limit, "{other} fits, {found:?} was found");
            }
        }

        #[test]
        fn nothing_is_less_far_outside(planes in planes(), x in -1.5..1.5f64, y in -1.5..1.5f64, walls in 0usize..3) {
            let wish = Vector2::new(x, y);
            // Walls that leave the origin free.
            let mut all: Vec<HalfPlane> =
                (0..walls).map(|k| HalfPlane::below(Vector2::new((k as f64).cos(), (k as f64).sin()), 0.1)).collect();
            all.extend(&planes);
            let found = nearest_relaxed(&all, walls, 1.0, wish, &mut Vec::new());
            prop_assert!(found.norm() <= 1.0 + 1e-9 && worst(&all[..walls], found) < 1e-9);
            let least = worst(&all, found);
            for other in grid(wish).filter(|x| worst(&all[..walls], *x) <= 0.0) {
                prop_assert!(worst(&all, other) >= least - 1e-9, "{other} is better than {found}");
            }
        }
    }
}
