//! Smoothness of paths and drives: the log dimensionless jerk that the report of a run has.

use geometry::Smoothness;
use nalgebra::Point2;

/// Of a drive through these positions, one a tick of `dt_s`; 0 is best. `None` for one that never moves.
pub fn of_drive(positions: &[Point2<f64>], dt_s: f64) -> Option<f64> {
    let mut smoothness = Smoothness::default();
    positions.windows(2).for_each(|pair| smoothness.push((pair[1] - pair[0]) / dt_s, dt_s));
    smoothness.ldj(dt_s)
}

/// Of a path that is driven at 1 m/s.
pub fn of_path(points: &[Point2<f64>]) -> Option<f64> {
    const DT_S: f64 = 0.05;
    let mut at = vec![*points.first()?];
    let mut left_m = DT_S;
    for pair in points.windows(2) {
        let (mut from, step) = (pair[0], pair[1] - pair[0]);
        let mut length_m = step.norm();
        while length_m >= left_m {
            from += step.normalize() * left_m;
            length_m -= left_m;
            left_m = DT_S;
            at.push(from);
        }
        left_m -= length_m;
    }
    of_drive(&at, DT_S)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A zigzag and the straight line between its ends.
    #[test]
    fn a_straight_path_is_smoother_than_a_bent_one() {
        let zigzag: Vec<Point2<f64>> =
            (0..40).map(|i| Point2::new(f64::from(i) * 0.2, f64::from(i % 2) * 0.1)).collect();
        let straight = [zigzag[0], Point2::new(8.0, 0.0)];
        let [bent, straight] = [&zigzag[..], &straight[..]].map(|path| of_path(path).expect("it moves"));
        assert!(straight > bent + 1.0, "{straight} {bent}");
        assert_eq!(of_path(&[Point2::origin()]), None);
    }

    #[test]
    fn a_path_is_resampled_by_its_length() {
        let coarse: Vec<Point2<f64>> = (0..=10).map(|i| Point2::new(f64::from(i), 0.0)).collect();
        let fine: Vec<Point2<f64>> = (0..=1000).map(|i| Point2::new(f64::from(i) * 0.01, 0.0)).collect();
        let [coarse, fine] = [coarse, fine].map(|path| of_path(&path).expect("it moves"));
        assert!((coarse - fine).abs() < 0.05, "{coarse} {fine}");
    }
}
