//! Fewer points for the same line.

/// Looks at a point, on the average: about the logarithm of the number of points is usual.
const WORK_PER_POINT: usize = 256;

/// The line without the points that one does not miss: none of them is farther from what is left than `tolerance`
/// (Ramer, Douglas and Peucker). The ends stay. A line that would take far more work than usual keeps points that it does
/// not need.
pub(super) fn thin(points: &[[f64; 2]], tolerance: f64) -> Vec<[f64; 2]> {
    if points.len() < 3 {
        return points.to_vec();
    }
    let mut kept = vec![false; points.len()];
    let last = points.len() - 1;
    (kept[0], kept[last]) = (true, true);
    let mut parts = vec![(0, last)];
    let mut work_left = WORK_PER_POINT * points.len();
    while let Some((from, to)) = parts.pop() {
        let Some(left) = work_left.checked_sub(to - from) else {
            kept[from..to].fill(true);
            continue;
        };
        work_left = left;
        let (mut worst, mut distance_max) = (from, tolerance);
        for (i, point) in points.iter().enumerate().take(to).skip(from + 1) {
            let distance = distance(*point, points[from], points[to]);
            if distance > distance_max {
                (worst, distance_max) = (i, distance);
            }
        }
        if worst > from {
            kept[worst] = true;
            parts.extend([(from, worst), (worst, to)]);
        }
    }
    points.iter().zip(kept).filter(|(_, kept)| *kept).map(|(point, _)| *point).collect()
}

/// From a point to a segment.
fn distance(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (along, to_p) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let square = along[0] * along[0] + along[1] * along[1];
    let share = if square > 0.0 { ((along[0] * to_p[0] + along[1] * to_p[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    (to_p[0] - share * along[0]).hypot(to_p[1] - share * along[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_the_same_line() {
        let spiral: Vec<[f64; 2]> =
            (0..10_000).map(|i| f64::from(i) * 0.002).map(|t| [t * t.cos(), t * t.sin()]).collect();
        let thinned = thin(&spiral, 0.01);
        assert!(thinned.len() < 1000, "{}", thinned.len());
        assert_eq!((thinned.first(), thinned.last()), (spiral.first(), spiral.last()));
        for point in &spiral {
            let nearest = thinned.windows(2).map(|leg| distance(*point, leg[0], leg[1])).fold(f64::MAX, f64::min);
            assert!(nearest <= 0.01, "{point:?}: {nearest}");
        }
        let straight: Vec<[f64; 2]> = (0..500).map(|i| [f64::from(i), 0.0]).collect();
        assert_eq!(thin(&straight, 1e-9), [[0.0, 0.0], [499.0, 0.0]]);
        // There and back: the turning point is far from the segment of the ends, which is a point.
        assert_eq!(thin(&[[0.0, 0.0], [5.0, 0.0], [0.0, 0.0]], 0.1).len(), 3);
        assert_eq!(thin(&[[1.0, 1.0]; 4], 0.1), [[1.0, 1.0]; 2]);
    }
}
