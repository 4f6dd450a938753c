//! Plane geometry against brute force.

use nalgebra::{Point2, Vector2};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use shoal_geometry::{Capsule, Polygon, segment_distance, segments_cross, swept_distance};

fn point() -> impl Strategy<Value = Point2<f64>> {
    (-10.0f64..10.0, -10.0f64..10.0).prop_map(|(x, y)| Point2::new(x, y))
}

fn p(x: f64, y: f64) -> Point2<f64> {
    Point2::new(x, y)
}

/// Points along a segment, both ends included.
fn along(a: Point2<f64>, b: Point2<f64>, steps: u32) -> impl Iterator<Item = Point2<f64>> {
    (0..=steps).map(move |i| a + (b - a) * (f64::from(i) / f64::from(steps)))
}

fn smallest(distances: impl Iterator<Item = f64>) -> f64 {
    distances.fold(f64::INFINITY, f64::min)
}

#[test]
fn distances_to_capsules() {
    let wall = Capsule { a: p(0.0, 0.0), b: p(4.0, 0.0), radius: 0.5 };
    for (shape, from, expected) in [
        (wall, p(2.0, 2.0), 1.5),
        (wall, p(2.0, 0.2), -0.3),
        (wall, p(7.0, 4.0), 4.5),
        (wall, p(-3.0, 0.0), 2.5),
        (Capsule::disc(p(1.0, 1.0), 0.5), p(4.0, 5.0), 4.5),
        (Capsule::disc(p(1.0, 1.0), 0.5), p(1.0, 1.0), -0.5),
        (Capsule::segment(p(0.0, 0.0), p(0.0, 3.0)), p(1.0, 1.0), 1.0),
        (Capsule::disc(p(1.0, 1.0), 0.5).moved(Vector2::new(3.0, 4.0)), p(4.0, 5.0), -0.5),
    ] {
        assert!((shape.distance(from) - expected).abs() < 1e-12, "{shape:?} {from}");
    }
}

#[test]
fn inside_of_a_polygon() {
    let corners = |list: &[[f64; 2]]| Polygon { corners: list.iter().map(|c| Point2::from(*c)).collect() };
    let u = corners(&[[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [2.0, 3.0], [2.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]]);
    for (point, inside) in [
        (p(0.5, 2.0), true),
        (p(1.5, 2.0), false),
        (p(1.5, 0.5), true),
        (p(2.5, 2.9), true),
        (p(-0.5, 1.0), false),
        (p(3.5, 1.0), false),
        (p(1.5, 3.5), false),
    ] {
        assert_eq!(u.contains(point), inside, "{point}");
    }
    let turned = Polygon { corners: u.corners.iter().rev().copied().collect() };
    assert!(turned.contains(p(0.5, 2.0)) && !turned.contains(p(1.5, 2.0)));
    assert_eq!(u.edges().count(), 8);
    assert_eq!(u.edges().last(), Some(Capsule::segment(p(0.0, 3.0), p(0.0, 0.0))));
}

#[test]
fn segments() {
    for (a0, a1, b0, b1, distance, cross) in [
        (p(0.0, 0.0), p(2.0, 2.0), p(0.0, 2.0), p(2.0, 0.0), 0.0, true),
        (p(0.0, 0.0), p(2.0, 0.0), p(0.0, 1.0), p(2.0, 1.0), 1.0, false),
        (p(0.0, 0.0), p(2.0, 0.0), p(1.0, 0.0), p(1.0, 2.0), 0.0, false), // touches
        (p(0.0, 0.0), p(2.0, 0.0), p(1.0, 0.0), p(5.0, 0.0), 0.0, false), // lies on the same line, overlaps
        (p(0.0, 0.0), p(2.0, 0.0), p(5.0, 4.0), p(9.0, 4.0), 5.0, false),
        (p(0.0, 0.0), p(0.0, 0.0), p(3.0, 4.0), p(3.0, 4.0), 5.0, false), // two points
    ] {
        assert!((segment_distance(a0, a1, b0, b1) - distance).abs() < 1e-12, "{a0} {a1} {b0} {b1}");
        assert_eq!(segments_cross(a0, a1, b0, b1), cross, "{a0} {a1} {b0} {b1}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(1986),
        ..ProptestConfig::default()
    })]

    #[test]
    fn capsule_distance_is_that_of_its_nearest_core_point(
        a in point(), b in point(), from in point(), radius in 0.0f64..2.0,
    ) {
        let exact = Capsule { a, b, radius }.distance(from);
        let sampled = smallest(along(a, b, 1000).map(|core| (from - core).norm() - radius));
        prop_assert!(exact <= sampled + 1e-9 && sampled - exact <= (b - a).norm() / 2000.0 + 1e-9);
    }

    #[test]
    fn swept_distance_is_the_closest_approach(p0 in point(), p1 in point(), q0 in point(), q1 in point()) {
        let exact = swept_distance(p0, p1, q0, q1);
        let sampled = smallest(along(p0, p1, 1000).zip(along(q0, q1, 1000)).map(|(p, q)| (p - q).norm()));
        let step = ((q1 - q0) - (p1 - p0)).norm() / 1000.0;
        prop_assert!(exact <= sampled + 1e-9 && sampled - exact <= step / 2.0 + 1e-9);
    }

    #[test]
    fn segment_distance_is_the_smallest_of_all_pairs(a0 in point(), a1 in point(), b0 in point(), b1 in point()) {
        let exact = segment_distance(a0, a1, b0, b1);
        let b = Capsule::segment(b0, b1);
        let sampled = smallest(along(a0, a1, 1000).map(|on_a| b.distance(on_a)));
        prop_assert!(exact <= sampled + 1e-9 && sampled - exact <= (a1 - a0).norm() / 2000.0 + 1e-9);
        prop_assert_eq!(exact, segment_distance(b0, b1, a0, a1));
    }

    #[test]
    fn a_triangle_contains_what_is_left_of_all_its_edges(a in point(), b in point(), c in point(), from in point()) {
        let side = |s: Point2<f64>, t: Point2<f64>| (t - s).perp(&(from - s)) > 0.0;
        let (ab, bc, ca) = (side(a, b), side(b, c), side(c, a));
        let contains = Polygon { corners: vec![a, b, c] }.contains(from);
        prop_assert_eq!(contains, ab == bc && bc == ca);
    }
}
