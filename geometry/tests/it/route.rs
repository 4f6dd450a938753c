//! Ways over maps, against the shortest way over cells in octile steps, found by an independent search.

use nalgebra::{Point2, distance};
use proptest::prelude::*;
use shoal_geometry::Map;
use shoal_geometry::map::{Cells, Raster, WALLS_MAX};
use shoal_geometry::route::{Progress, Route, Search, is_open, keeps_at};
use std::f64::consts::SQRT_2;

const SIDE: u32 = 24;
const RASTER: Raster = Raster { origin: Point2::new(0.0, 0.0), yaw_rad: 0.0, cell_m: 1.0, columns: SIDE, rows: SIDE };

fn map_of(cells: &Cells, yaw_rad: f64) -> (Map, Raster) {
    let raster = Raster { yaw_rad, ..RASTER };
    (Map::build(&cells.outlines(&raster, WALLS_MAX), true, Some(raster)).unwrap(), raster)
}

fn search(map: &Map, radius_m: f64, from: Point2<f64>, goal: Point2<f64>, steps: usize) -> Option<Route> {
    let mut search = Search::new(radius_m, from, goal);
    loop {
        match search.go_on(&[map], steps) {
            Progress::Searching => {}
            Progress::Found(route) => return Some(route),
            Progress::None => return None,
        }
    }
}

/// Length of the shortest way from the middle of a cell to that of another one in octile steps that cut no corner, in cells:
/// relaxation until nothing changes.
fn octile(cells: &Cells, from: [usize; 2], to: [usize; 2]) -> Option<f64> {
    let side = SIDE as usize;
    let free = |x: i64, y: i64| {
        (0..side as i64).contains(&x) && (0..side as i64).contains(&y) && !cells.is_solid(x as usize, y as usize)
    };
    let mut lengths = vec![f64::INFINITY; side * side];
    lengths[from[1] * side + from[0]] = 0.0;
    let mut changes = true;
    while std::mem::take(&mut changes) {
        for y in 0..side as i64 {
            for x in (0..side as i64).filter(|x| free(*x, y)) {
                for (dx, dy) in [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)] {
                    if !(free(x + dx, y + dy) && free(x + dx, y) && free(x, y + dy)) {
                        continue;
                    }
                    let step = if dx != 0 && dy != 0 { SQRT_2 } else { 1.0 };
                    let (here, there) = (y as usize * side + x as usize, (y + dy) as usize * side + (x + dx) as usize);
                    if lengths[there] + step < lengths[here] - 1e-9 {
                        (lengths[here], changes) = (lengths[there] + step, true);
                    }
                }
            }
        }
    }
    Some(lengths[to[1] * side + to[0]]).filter(|length| length.is_finite())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// There is a way where cells have one and none where they have not; it keeps its room, and it is at most as long as over
    /// the cells and hardly shorter than any way could be.
    #[test]
    fn a_way_is_as_short_as_over_cells(
        solid in prop::collection::vec((0..SIDE as usize, 0..SIDE as usize), 0..220),
        ends in [(0..SIDE as usize, 0..SIDE as usize), (0..SIDE as usize, 0..SIDE as usize)],
        yaw_rad in prop_oneof![Just(0.0), -3.0..3.0f64], radius_m in 0.15..0.44f64
    ) {
        let mut cells = Cells::new(SIDE, SIDE).unwrap();
        let ends = ends.map(|(x, y)| [x, y]);
        for (x, y) in solid.into_iter().filter(|(x, y)| !ends.contains(&[*x, *y])) {
            cells.fill(x, y);
        }
        let (map, raster) = map_of(&cells, yaw_rad);
        let [from, goal] = ends.map(|[x, y]| raster.at(x as f64 + 0.5, y as f64 + 0.5));
        let found = search(&map, radius_m, from, goal, 1 << 20);
        let shortest = octile(&cells, ends[0], ends[1]);
        prop_assert_eq!(found.is_some(), shortest.is_some());
        let (Some(route), Some(octile)) = (found, shortest) else { return Ok(()) };
        let length = route.length_m(from);
        prop_assert!(length <= octile + 1e-3, "{} over cells, {} by the way", octile, length);
        // A way with corners of any direction is at most 8.3 % shorter than one over cells, and one that may cut corners, as a disc
        // that is smaller than a cell can, some of a cell at each of them.
        prop_assert!(length >= distance(&from, &goal) - 1e-9);
        prop_assert!(length >= octile / 1.083 - 0.6 * route.corners.len() as f64, "{} over cells, {}", octile, length);
        let mut at = from;
        for corner in &route.corners {
            let keeps_m = keeps_at(&[&map], at, route.keeps_m).min(keeps_at(&[&map], *corner, route.keeps_m));
            prop_assert!(is_open(&[&map], [at, *corner], keeps_m), "{:?} to {:?}", at, corner);
            at = *corner;
        }
        prop_assert_eq!(at, goal);
        // In portions it finds the same.
        prop_assert_eq!(search(&map, radius_m, from, goal, 7), Some(route));
    }
}

/// A corridor of one cell: discs that fit get through, others do not; and a disc that touches a wall gets away from it.
#[test]
fn what_fits_gets_through() {
    let mut cells = Cells::new(SIDE, SIDE).unwrap();
    (0..SIDE as usize).filter(|y| *y != 12).for_each(|y| cells.fill(10, y));
    let (map, raster) = map_of(&cells, 0.0);
    let (from, goal) = (raster.at(2.0, 3.0), raster.at(20.0, 20.0));
    for (radius_m, fits) in [(0.1, true), (0.3, true), (0.45, true), (0.49, true), (0.51, false), (2.0, false)] {
        assert_eq!(search(&map, radius_m, from, goal, 1 << 20).is_some(), fits, "{radius_m}");
    }
    let touching = Point2::new(10.0 - 0.3, 5.2);
    assert!(search(&map, 0.3, touching, goal, 1 << 20).is_some());
    // Where nothing is in the way, it is straight.
    let straight = search(&map, 0.3, from, raster.at(8.0, 9.0), 1 << 20).unwrap();
    assert_eq!(straight.corners, [raster.at(8.0, 9.0)]);
}

/// Where there are no cells, as round polygons, the search has some of its own.
#[test]
fn ways_round_walls_without_cells() {
    let wall = |a: [f64; 2], b: [f64; 2]| shoal_geometry::Capsule::segment(a.into(), b.into());
    let walls = [wall([0.0, -3.0], [0.0, 3.0]), wall([0.0, 3.0], [-4.0, 3.0]), wall([0.0, -3.0], [-4.0, -3.0])];
    let map = Map::build(&walls, false, None).unwrap();
    let (from, goal) = (Point2::new(-2.0, 0.0), Point2::new(2.0, 0.0));
    let route = search(&map, 0.25, from, goal, 1 << 20).unwrap();
    // Out of the pocket, round its end and along its back: a string round three points.
    let string: f64 = [from, Point2::new(-4.0, 3.0), Point2::new(0.0, 3.0), goal]
        .windows(2)
        .map(|pair| distance(&pair[0], &pair[1]))
        .sum();
    let length = route.length_m(from);
    assert!((string..1.12 * string).contains(&length), "{length} against {string}");
}
