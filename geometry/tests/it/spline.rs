//! Natural cubic splines: through their points, smooth, straight at the ends, and defined for points that coincide.

use model::random::Stream;
use nalgebra::{Point2, Vector2};
use shoal_geometry::spline::{Spline, length};

#[test]
fn it_goes_through_its_points_and_is_smooth() {
    let mut stream = Stream::new(1, 0, 0, "spline");
    let points: Vec<Point2<f64>> =
        (0..6).map(|i| Point2::new(f64::from(i) + stream.between(-0.3, 0.3), stream.between(-2.0, 2.0))).collect();
    let spline = Spline::through(&points);
    let mut t = 0.0;
    for (i, point) in points.iter().enumerate() {
        t += if i > 0 { (point - points[i - 1]).norm() } else { 0.0 };
        assert!((spline.at(t) - point).norm() < 1e-12, "point {i}");
        let h = 1e-4;
        let slope = |t: f64| (spline.at(t + h) - spline.at(t - h)) / (2.0 * h);
        let bend = |t: f64| (spline.at(t + h).coords - 2.0 * spline.at(t).coords + spline.at(t - h).coords) / (h * h);
        if i > 0 && i + 1 < points.len() {
            assert!((slope(t - 2.0 * h) - slope(t + 2.0 * h)).norm() < 1e-2, "slope at {i}");
            assert!((bend(t - 2.0 * h) - bend(t + 2.0 * h)).norm() < 1e-1, "bend at {i}");
        } else {
            let inside = if i == 0 { t + 2.0 * h } else { t - 2.0 * h };
            assert!(bend(inside).norm() < 1e-1, "end {i}: {}", bend(inside));
        }
    }
    assert!((spline.end() - length(&points)).abs() < 1e-12);
}

#[test]
fn two_points_make_a_line_and_one_a_point() {
    let (a, b) = (Point2::new(1.0, 2.0), Point2::new(4.0, 6.0));
    let line = Spline::through(&[a, b]);
    assert!((line.at(2.0) - (a + Vector2::new(1.2, 1.6))).norm() < 1e-12);
    let mut samples = Vec::new();
    for points in [vec![a], vec![a, a, a]] {
        Spline::through(&points).sample(5, &mut samples);
        assert_eq!(samples, [a; 5]);
    }
}

/// Via points that coincide are one via point.
#[test]
fn coinciding_points_count_once() {
    let points = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]].map(Point2::from);
    let doubled = [points[0], points[0], points[1], points[1], points[2], points[2]];
    let (mut once, mut twice) = (Vec::new(), Vec::new());
    Spline::through(&points).sample(50, &mut once);
    Spline::through(&doubled).sample(50, &mut twice);
    assert_eq!(once, twice);
    assert_eq!((once[0], once[49]), (points[0], points[2]));
}

#[test]
fn samples_are_even_in_the_parameter() {
    let spline = Spline::through(&[[0.0, 0.0], [1.0, 2.0], [3.0, 3.0], [4.0, 1.0]].map(Point2::from));
    let mut samples = Vec::new();
    spline.sample(31, &mut samples);
    for (j, sample) in samples.iter().enumerate() {
        assert!((spline.at(spline.end() * j as f64 / 30.0) - sample).norm() < 1e-12);
    }
}
