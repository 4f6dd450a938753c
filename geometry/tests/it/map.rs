//! Maps: every question against brute force over all walls, outlines against the cells, and bytes that were changed.

use nalgebra::{Point2, Vector2};
use proptest::prelude::*;
use shoal_geometry::map::raster::CELLS_MAX;
use shoal_geometry::map::{Cells, Raster, WALLS_MAX};
use shoal_geometry::{Capsule, Map, MapError, segment_distance};

fn point() -> impl Strategy<Value = Point2<f64>> {
    (-12.0..12.0f64, -12.0..12.0f64).prop_map(|(x, y)| Point2::new(x, y))
}

fn walls(most: usize) -> impl Strategy<Value = Vec<Capsule>> {
    let wall = (point(), -3.0..3.0f64, -3.0..3.0f64, 0..3u8).prop_map(|(a, dx, dy, kind)| match kind {
        0 => Capsule::segment(a, a + Vector2::new(dx, 0.0)),
        1 => Capsule::segment(a, a + Vector2::new(0.0, dy)),
        _ => Capsule::segment(a, a + Vector2::new(dx, dy)),
    });
    prop::collection::vec(wall, 0..most)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// What the tree answers is what looking at every wall answers.
    #[test]
    fn every_question_is_answered_as_by_looking_at_all_walls(
        walls in walls(200), p in point(), q in point(), limit in 0.0..8.0f64, keeps in 0.0..2.0f64, most in 0..20usize
    ) {
        let map = Map::build(&walls, false, None).unwrap();
        prop_assert_eq!(map.len(), walls.len());
        let all: Vec<Capsule> = map.walls().collect();
        let mut left: Vec<Capsule> = walls;
        for wall in &all {
            let place = left.iter().position(|known| known == wall);
            prop_assert!(place.is_some(), "{wall:?} is not one of them");
            left.swap_remove(place.unwrap());
        }
        let least = |of: &dyn Fn(&Capsule) -> f64| all.iter().map(of).fold(f64::INFINITY, f64::min);
        let to_point = least(&|wall| wall.distance(p));
        prop_assert_eq!(map.distance(p, f64::INFINITY), to_point);
        prop_assert_eq!(map.distance(p, limit), to_point.min(limit));
        let to_line = least(&|wall| segment_distance(p, q, wall.a, wall.b) - wall.radius);
        prop_assert_eq!(map.distance_of_line([p, q], f64::INFINITY), to_line);
        prop_assert_eq!(map.is_near(p, keeps), to_point < keeps);
        prop_assert_eq!(map.blocks([p, q], keeps), to_line < keeps);
        let mut found = Vec::new();
        map.nearest(p, limit, most, &mut found);
        let mut expected: Vec<(f64, u32)> = all.iter().map(|wall| wall.distance(p)).zip(0..).collect();
        expected.retain(|(distance, _)| *distance <= limit);
        expected.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        expected.truncate(most);
        expected.sort_by_key(|(_, index)| *index);
        prop_assert_eq!(found, expected);
        let (low, high) = (p.inf(&q), p.sup(&q));
        let mut seen = vec![0; all.len()];
        map.each_in([low, high], |index, wall| {
            assert_eq!(*wall, all[index]);
            seen[index] += 1;
        });
        for (wall, seen) in all.iter().zip(seen) {
            let (from, to) = (wall.a.inf(&wall.b), wall.a.sup(&wall.b));
            let meets = from.x <= high.x && from.y <= high.y && to.x >= low.x && to.y >= low.y;
            prop_assert!(seen == 1 || seen == 0 && !meets);
        }
    }

    /// The outlines of cells: they are as long as there are borders, none could be longer, and what they enclose is what is
    /// solid, however the map is turned.
    #[test]
    fn outlines_are_the_borders_of_what_is_solid(
        solid in prop::collection::vec(any::<bool>(), 1..400), columns in 1..130u32, turned: bool, cell_m in 0.05..2.0f64
    ) {
        let rows = (solid.len() as u32).div_ceil(columns);
        let mut cells = Cells::new(columns, rows).unwrap();
        let at = |index: usize| (index % columns as usize, index / columns as usize);
        for (index, _) in solid.iter().enumerate().filter(|(_, solid)| **solid) {
            cells.fill(at(index).0, at(index).1);
        }
        prop_assert_eq!(cells.solid_count(), solid.iter().filter(|solid| **solid).count());
        let yaw_rad = if turned { 0.7 } else { 0.0 };
        let raster = Raster { origin: Point2::new(-1.0, 2.0), yaw_rad, cell_m, columns, rows };
        let walls = cells.outlines(&raster, WALLS_MAX);
        let is_solid = |column: i64, row: i64| {
            let outside = column < 0 || row < 0 || column >= i64::from(columns) || row >= i64::from(rows);
            outside || cells.is_solid(column as usize, row as usize)
        };
        // How many unit borders there are, and in how many straight runs with what is solid on one side.
        let (mut borders, mut runs) = (0, 0);
        for row in 0..=i64::from(rows) {
            for column in 0..=i64::from(columns) {
                let below = |column: i64| (is_solid(column, row - 1), is_solid(column, row));
                let beside = |row: i64| (is_solid(column - 1, row), is_solid(column, row));
                let differs = |sides: (bool, bool)| sides.0 != sides.1;
                if column < i64::from(columns) && differs(below(column)) {
                    borders += 1;
                    runs += usize::from(column == 0 || below(column - 1) != below(column));
                }
                if row < i64::from(rows) && differs(beside(row)) {
                    borders += 1;
                    runs += usize::from(row == 0 || beside(row - 1) != beside(row));
                }
            }
        }
        let length: f64 = walls.iter().map(|wall| (wall.b - wall.a).norm()).sum();
        prop_assert_eq!(walls.len(), runs);
        prop_assert!((length / cell_m - f64::from(borders)).abs() < 1e-6 * f64::from(borders).max(1.0));
        let map = Map::build(&walls, true, Some(raster)).unwrap();
        for row in -1..=i64::from(rows) {
            for column in -1..=i64::from(columns) {
                let middle = raster.at(column as f64 + 0.5, row as f64 + 0.5);
                prop_assert_eq!(map.is_solid(middle), is_solid(column, row), "{} {}", column, row);
            }
        }
        prop_assert_eq!(map.raster(), Some(raster));
        // Each wall is in one line, and lines go on from wall to wall.
        let chains = map.chains();
        prop_assert_eq!(chains.iter().map(|chain| chain.len() - 1).sum::<usize>(), walls.len());
        let parts = chains.iter().flat_map(|chain| chain.windows(2));
        prop_assert!(parts.into_iter().all(|pair| walls.iter().any(|wall| [wall.a, wall.b] == [pair[0], pair[1]])));
    }
}

fn small() -> Map {
    let mut cells = Cells::new(7, 5).unwrap();
    [(1, 1), (2, 1), (5, 3)].into_iter().for_each(|(column, row)| cells.fill(column, row));
    let raster = Raster { origin: Point2::new(0.0, 0.0), yaw_rad: 0.3, cell_m: 0.5, columns: 7, rows: 5 };
    Map::build(&cells.outlines(&raster, WALLS_MAX), true, Some(raster)).unwrap()
}

#[test]
fn bytes_that_are_read_again_are_the_same_map() {
    let map = small();
    let again = Map::read(map.bytes().to_vec()).unwrap();
    assert_eq!(map, again);
    assert_eq!((map.raster(), map.bounds_m(), map.len()), (again.raster(), again.bounds_m(), again.len()));
    let empty = Map::build(&[], false, None).unwrap();
    assert_eq!(Map::read(empty.bytes().to_vec()).unwrap().len(), 0);
    assert_eq!(empty.distance(Point2::origin(), f64::INFINITY), f64::INFINITY);
    assert!(!empty.is_solid(Point2::origin()) && !empty.blocks([Point2::origin(), Point2::new(1.0, 0.0)], 1.0));
}

/// A map that was changed anywhere, or cut anywhere, is refused; so is one that tells of walls that are not there.
#[test]
fn bytes_that_were_changed_are_refused() {
    let whole = small().bytes().to_vec();
    for at in 0..whole.len() {
        for bit in [1, 128] {
            let mut changed = whole.clone();
            changed[at] ^= bit;
            // Four bytes of the header say nothing.
            assert!((20..24).contains(&at) || Map::read(changed).is_err(), "byte {at}");
        }
        assert!(Map::read(whole[..at].to_vec()).is_err(), "{at} bytes");
    }
    let told = |walls: u32| {
        let mut bytes = whole.clone();
        bytes[16..20].copy_from_slice(&walls.to_le_bytes());
        Map::read(bytes).unwrap_err()
    };
    assert_eq!(told(u32::MAX), MapError::Length);
    assert_eq!(told(WALLS_MAX as u32), MapError::Length);
    assert_eq!(Map::read(b"SHOALMAP".to_vec()).unwrap_err(), MapError::Foreign);
    assert_eq!(Map::read([b"SHOALMAP".as_slice(), &[9; 200]].concat()).unwrap_err(), MapError::Version(0x0909_0909));
}

#[test]
fn walls_that_are_no_walls_are_refused() {
    let wall = |x: f64| Capsule::segment(Point2::origin(), Point2::new(x, 0.0));
    for x in [f64::NAN, f64::INFINITY, 1e8] {
        assert_eq!(Map::build(&[wall(x)], false, None).unwrap_err(), MapError::Number);
    }
    let many = vec![wall(1.0); WALLS_MAX + 1];
    assert_eq!(Map::build(&many, false, None).unwrap_err(), MapError::TooMany(WALLS_MAX + 1));
    assert!(Cells::new(0, 5).is_none() && Cells::new(u32::MAX, u32::MAX).is_none());
    assert!(Cells::new(CELLS_MAX as u32, 2).is_none());
}

/// A question looks at the neighbourhood: as many walls for a map of a hundred thousand as for one of a thousand.
#[test]
fn a_question_does_not_grow_with_the_map() {
    for side in [30, 300] {
        let at = |i: i32| Point2::new(f64::from(i % side), f64::from(i / side));
        let walls: Vec<Capsule> =
            (0..side * side).map(|i| Capsule::segment(at(i), at(i) + Vector2::new(0.5, 0.0))).collect();
        let map = Map::build(&walls, false, None).unwrap();
        let (middle, mut looks) = (Point2::new(f64::from(side), f64::from(side)) * 0.5, 0);
        map.each_in([middle, middle + Vector2::new(2.0, 2.0)], |_, _| looks += 1);
        assert!((6..=64).contains(&looks), "{side}: {looks}");
    }
}
