//! A string along a way over cells, pulled taut.

use super::{Ground, TOUCH, is_open, keeps_at};
use nalgebra::{Point2, center};

/// How often all corners are pulled, and how often a pull is halved.
const PULLS: usize = 4;
const HALVINGS: usize = 6;

/// The corners of the way from a place over these cells to the goal, the goal last, m.
pub(super) fn pull(
    ground: Ground<'_>,
    from: Point2<f64>,
    cells: &[Point2<f64>],
    goal: Point2<f64>,
    keeps_m: f64,
) -> Vec<Point2<f64>> {
    let keeps = [keeps_at(ground, from, keeps_m), keeps_m * (1.0 - TOUCH), keeps_at(ground, goal, keeps_m)];
    let points: Vec<Point2<f64>> = [from].into_iter().chain(cells.iter().copied()).chain([goal]).collect();
    let last = points.len() - 1;
    let open = |a: usize, b: usize| {
        // Where a way begins and ends it may be nearer to a wall than elsewhere.
        let least = keeps[1].min(if a == 0 { keeps[0] } else { f64::INFINITY });
        let least = least.min(if b == last { keeps[2] } else { f64::INFINITY });
        is_open(ground, [points[a], points[b]], least)
    };
    let mut corners = vec![0];
    let mut at = 0;
    while at < last {
        // As far as can be seen: twice as far each time, then back by halves.
        let (mut seen, mut reach) = (at + 1, 2);
        while at + reach <= last && open(at, at + reach) {
            (seen, reach) = (at + reach, 2 * reach);
        }
        let mut hidden = (at + reach).min(last + 1);
        if hidden == last + 1 && open(at, last) {
            seen = last;
        }
        while seen < last && hidden - seen > 1 {
            let half = seen + (hidden - seen) / 2;
            if open(at, half) { seen = half } else { hidden = half }
        }
        corners.push(seen);
        at = seen;
    }
    let mut line: Vec<Point2<f64>> = corners.into_iter().map(|index| points[index]).collect();
    let ends = line.len() - 1;
    let open_between = |line: &[Point2<f64>], index: usize, p: Point2<f64>| {
        let before = if index == 1 { keeps[0].min(keeps[1]) } else { keeps[1] };
        let after = if index + 1 == ends { keeps[2].min(keeps[1]) } else { keeps[1] };
        is_open(ground, [line[index - 1], p], before) && is_open(ground, [p, line[index + 1]], after)
    };
    for _ in 0..PULLS {
        for index in 1..ends {
            // As near to the straight line between its neighbours as there is room.
            let across = crate::shapes::Capsule::segment(line[index - 1], line[index + 1]).nearest_core(line[index]);
            let (mut kept, mut wanted) = (line[index], across);
            if open_between(&line, index, across) {
                kept = across;
            } else {
                for _ in 0..HALVINGS {
                    let half = center(&kept, &wanted);
                    if open_between(&line, index, half) { kept = half } else { wanted = half }
                }
            }
            line[index] = kept;
        }
    }
    line.remove(0);
    line
}
