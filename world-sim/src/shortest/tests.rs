use super::*;
use geometry::Capsule;
use model::{Obstacle, Shape};
use proptest::prelude::*;
use std::f64::consts::PI;

fn map(obstacles: &[Shape]) -> Map {
    let placed: Vec<Obstacle> = obstacles.iter().map(|s| Obstacle { shape: s.clone(), motion: None }).collect();
    Map::new(&Shapes::new(&placed, 1), None)
}

fn length(obstacles: &[Shape], [from, to]: [[f64; 2]; 2], radius_m: f64, tolerance_m: f64) -> Option<f64> {
    map(obstacles).shortest(from.into(), &[to.into()], radius_m, tolerance_m)
}

fn check(obstacles: &[Shape], ends: [[f64; 2]; 2], radius_m: f64, expected: Option<f64>) {
    for tolerance_m in [0.0, 0.1] {
        // There and back are as long, with the tolerance at the end where the last line is.
        let (found, back) =
            (length(obstacles, ends, radius_m, tolerance_m), length(obstacles, [ends[1], ends[0]], radius_m, 0.0));
        match (found, back, expected) {
            (Some(found), Some(back), Some(expected)) => {
                assert!((found + tolerance_m - expected).abs() < 2e-5, "{found} + {tolerance_m} m, not {expected} m");
                assert!((back - expected).abs() < 2e-5, "{back} m back, not {expected} m");
            }
            _ => assert_eq!((found, back), (expected, expected)),
        }
    }
}

fn wall(a: [f64; 2], b: [f64; 2]) -> Shape {
    Shape::Capsule(Capsule::segment(a.into(), b.into()))
}

fn disc(x: f64, y: f64, radius: f64) -> Shape {
    Shape::Capsule(Capsule::disc(Point2::new(x, y), radius))
}

fn polygon(corners: &[[f64; 2]]) -> Shape {
    Shape::Polygon(corners.iter().map(|corner| Point2::from(*corner)).collect())
}

/// Two tangents of length sqrt(d² - r²) and the arc between them.
fn around(d: f64, r: f64, turn: f64) -> f64 {
    2.0 * (d * d - r * r).sqrt() + r * (turn - 2.0 * (r / d).acos())
}

const ACROSS: [[f64; 2]; 2] = [[-3.0, 0.0], [3.0, 0.0]];

#[test]
fn shortest_ways_are_what_geometry_says() {
    check(&[], ACROSS, 0.25, Some(6.0));
    // A disc in the way: tangents and an arc around it, inflated.
    check(&[disc(0.0, 0.0, 1.0)], ACROSS, 0.25, Some(around(3.0, 1.25, PI)));
    // A long wall: over its upper end, where the robot rolls around the end point.
    let (d, turn) = (3f64.hypot(1.0), PI + 2.0 * (1f64 / 3.0).atan());
    check(&[wall([0.0, -4.0], [0.0, 1.0])], ACROSS, 0.2, Some(around(d, 0.2, turn)));
    check(&[wall([0.0, -4.0], [0.0, 1.0])], ACROSS, 0.01, Some(around(d, 0.01, turn)));
    // A square, passed by two of its corners: two tangents, two arcs, and along its upper edge.
    let square = polygon(&[[-1.0, -1.5], [1.0, -1.5], [1.0, 1.0], [-1.0, 1.0]]);
    for r in [1e-3, 0.3] {
        let d = 2f64.hypot(1.0);
        let turn = 0.5 * PI + (0.5f64).atan() - (r / d).acos();
        check(std::slice::from_ref(&square), ACROSS, r, Some(2.0 * (d * d - r * r).sqrt() + 2.0 + 2.0 * r * turn));
    }
    // Closed in, and standing inside an obstacle.
    let closed = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let room: Vec<Shape> = (0..4).map(|i| wall(closed[i], closed[(i + 1) % 4])).collect();
    check(&room, [[0.0, 0.0], [3.0, 0.0]], 0.2, None);
    check(std::slice::from_ref(&square), [[0.0, 0.0], [3.0, 0.0]], 0.2, None);
    check(&[square], [[0.0, 0.0], [0.3, 0.0]], 0.2, None);
}

#[test]
fn a_corner_and_a_trap() {
    // An L of two walls that meet: round its convex side the robot rolls on a quarter and more, inside it cannot be cut.
    let l = [wall([0.0, 0.0], [0.0, 5.0]), wall([0.0, 0.0], [5.0, 0.0])];
    let (d, r) = (2f64.sqrt(), 0.25);
    let turn = 1.5 * PI - 2.0 * (r / d).acos() - 2.0 * (0.25 * PI);
    check(&l, [[1.0, -1.0], [-1.0, 1.0]], r, Some(2.0 * (d * d - r * r).sqrt() + r * (turn - 0.0)));
    check(&l, [[3.0, 0.3], [0.3, 3.0]], r, Some(2f64.sqrt() * 2.7));
    // Out of a U and round one of its arms: the end of the arm takes half a turn.
    let u = [wall([2.0, -1.0], [2.0, 1.0]), wall([-1.0, 1.0], [2.0, 1.0]), wall([-1.0, -1.0], [2.0, -1.0])];
    let found = length(&u, [[1.0, 0.0], [4.0, 0.0]], 0.2, 0.0).unwrap();
    // From inside to the end of the arm at (-1, 1), along its outside to the corner at (2, 1), and down to the goal.
    let (d1, d2) = (2f64.hypot(1.0), 2f64.hypot(1.0));
    let first = (d1 * d1 - 0.04).sqrt() + 0.2 * (PI + (0.5f64).atan() - (0.2 / d1).acos() - 0.5 * PI + 0.5 * PI);
    let last = (d2 * d2 - 0.04).sqrt() + 0.2 * (0.5 * PI + (0.5f64).atan() - (0.2 / d2).acos());
    let expected = first + 3.0 + last;
    assert!((found - expected).abs() < 0.2 * PI, "{found}, about {expected}");
}

#[test]
fn a_door_is_passed_if_it_is_wide_enough_however_large_the_world_is() {
    let door = |gap: f64, far: f64| [wall([0.0, -far], [0.0, 2.0]), wall([0.0, 2.0 + gap], [0.0, far])];
    let ends = [[-3.0, 2.5], [3.0, 2.5]];
    check(&door(1.0, 9.0), ends, 0.3, Some(6.0));
    for far in [9.0, 900.0, 9e5] {
        let through = |gap| length(&door(gap, far), ends, 0.3, 0.0).unwrap();
        // The robot rolls over the upper end: from 2.5 m it must get below 2 + gap - 0.3.
        let d = 3f64.hypot(0.5 - 0.8);
        let below = around(d, 0.3, PI - 2.0 * (0.3f64 / 3.0).atan());
        assert!((through(0.8) - 6.0).abs() < 1e-6 || (through(0.8) - below).abs() < 1e-6, "{}", through(0.8));
        assert!(through(0.4) > 15.0 && through(0.6) < 6.2, "{} {}", through(0.4), through(0.6));
    }
}

#[test]
fn the_way_ends_where_the_tolerance_begins() {
    // The middle of the goal is in an obstacle, but not all of its tolerance.
    let found = length(&[disc(3.0, 0.0, 0.5)], ACROSS, 0.25, 1.0);
    assert!((found.unwrap() - 5.0).abs() < 1e-9);
    assert_eq!(length(&[disc(3.0, 0.0, 0.5)], ACROSS, 0.25, 0.7), None);
    assert_eq!(length(&[], ACROSS, 0.25, 6.0), Some(0.0), "it is there already");
    // A wall in front of the goal: its tolerance is entered beside the end of the wall, on the arc around it.
    let shield = [wall([2.5, -9.0], [2.5, 0.3])];
    let (to_edge, to_middle) =
        (length(&shield, ACROSS, 0.25, 0.6).unwrap(), length(&shield, ACROSS, 0.25, 0.0).unwrap());
    let corner = Point2::new(2.5, 0.3);
    assert!(
        to_edge < to_middle - 0.59 && to_edge > (Point2::new(-3.0, 0.0) - corner).norm() - 0.3,
        "{to_edge} {to_middle}"
    );
    // Goals on the way: from tolerance to tolerance.
    let goals = [[0.0, 0.0], [0.0, 4.0], [0.0, 4.1]].map(Point2::from);
    let found = map(&[]).shortest(Point2::new(-3.0, 0.0), &goals, 0.25, 0.1).unwrap();
    assert!((found - (2.9 + 3.8)).abs() < 1e-12, "{found}");
}

#[test]
fn a_search_that_costs_too_much_says_nothing() {
    let discs: Vec<Shape> = (0..100).map(|i| disc(f64::from(i % 10), f64::from(i / 10), 0.2)).collect();
    let mut map = map(&discs);
    let ends = [Point2::new(-2.0, 4.0), Point2::new(12.0, 4.2)];
    assert!(map.shortest(ends[0], &[ends[1]], 0.2, 0.1).is_some());
    let mut map = self::map(&discs);
    map.walls.looks.set(20);
    assert_eq!(map.shortest(ends[0], &[ends[1]], 0.2, 0.1), None);
}

/// The shortest way over corners of polygons drawn around the grown obstacles, by looking at all pairs: no shorter than
/// the shortest way, and hardly longer.
fn oracle(walls: &Walls, ends: [Point2<f64>; 2], radius_m: f64) -> Option<f64> {
    const SIDES: usize = 48;
    let mut nodes = ends.to_vec();
    for wall in &walls.capsules {
        let out = (wall.radius + radius_m) / (PI / SIDES as f64).cos() * (1.0 + 1e-9);
        for end in [wall.a, wall.b] {
            nodes.extend((0..SIDES).map(|i| end + direction(2.0 * PI * i as f64 / SIDES as f64) * out));
        }
    }
    nodes.retain(|p| walls.stands(*p, radius_m));
    if nodes.len() < 2 || nodes[0] != ends[0] || nodes[1] != ends[1] {
        return None;
    }
    let (mut cost, mut done) = (vec![f64::INFINITY; nodes.len()], vec![false; nodes.len()]);
    cost[0] = 0.0;
    loop {
        let at = (0..nodes.len()).filter(|i| !done[*i]).min_by(|a, b| cost[*a].total_cmp(&cost[*b]))?;
        if cost[at].is_infinite() {
            return None;
        }
        if at == 1 {
            return Some(cost[1]);
        }
        done[at] = true;
        for next in 0..nodes.len() {
            let through = cost[at] + distance(&nodes[at], &nodes[next]);
            if !done[next] && through < cost[next] && walls.free(nodes[at], nodes[next], radius_m) {
                cost[next] = through;
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]
    #[test]
    fn no_way_is_shorter_and_hardly_one_as_short(
        discs in prop::collection::vec((-3.0..3.0f64, -3.0..3.0f64, 0.1..0.8f64), 0..4),
        walls in prop::collection::vec((-3.0..3.0f64, -3.0..3.0f64, -2.5..2.5f64, -2.5..2.5f64, 0.0..0.2f64), 0..4),
        corners in prop::collection::vec((-2.0..2.0f64, -2.0..2.0f64, 0.5..2.0f64), 0..2),
        radius_m in 0.05..0.3f64, y in (-1.0..1.0f64, -1.0..1.0f64),
    ) {
        let mut shapes: Vec<Shape> = discs.iter().map(|(x, y, r)| disc(*x, *y, *r)).collect();
        shapes.extend(walls.iter().map(|(x, y, dx, dy, radius)| {
            let a = Point2::new(*x, *y);
            Shape::Capsule(Capsule { a, b: a + Vector2::new(*dx, *dy), radius: *radius })
        }));
        shapes.extend(corners.iter().map(|(x, y, s)| polygon(&[[*x, *y], [x + s, *y], [x + 0.3 * s, y + s]])));
        let mut map = map(&shapes);
        let ends = [Point2::new(-4.0, y.0), Point2::new(4.0, y.1)];
        let found = map.shortest(ends[0], &[ends[1]], radius_m, 0.0);
        // A robot that is a little smaller has a way wherever this one has, which is no longer.
        let (upper, lower) = (oracle(&map.walls, ends, radius_m), oracle(&map.walls, ends, radius_m * 0.97 - 1e-3));
        prop_assert!(found.is_some() || upper.is_none(), "no way, but one of {upper:?}");
        if let Some(found) = found {
            prop_assert!(upper.is_none_or(|upper| found <= upper + 1e-6), "{found}, but there is one of {upper:?}");
            prop_assert!(lower.is_some_and(|lower| lower <= found * 1.002 + 1e-6), "{found}, but a smaller robot needs {lower:?}");
        }
        // Any tolerance: no shorter than by as much, and shorter.
        let near = map.shortest(ends[0], &[ends[1]], radius_m, 0.5);
        if let (Some(near), Some(found)) = (near, found) {
            prop_assert!(near <= found - 0.5 + 1e-6, "{near}, {found}");
        }
        prop_assert!(near.is_some() || found.is_none());
    }
}

/// What a way costs depends on what is in its way, not on what there is: looks at obstacles, a thousand of which are there.
#[test]
fn a_way_through_a_large_world_costs_little() {
    let mut places = model::random::Stream::new(1, 0, 0, "places");
    let mut place = || Point2::new(200.0 * places.unit(), 200.0 * places.unit());
    let discs: Vec<Shape> = (0..1000).map(|_| place()).map(|p| disc(p.x, p.y, 0.3)).collect();
    let mut map = map(&discs);
    let found = (0..50).filter(|_| map.shortest(place(), &[place()], 0.25, 0.1).is_some()).count();
    let looks = LOOKS_MAX - map.walls.looks.get();
    assert!(found > 40 && looks < 2_000_000, "{found} ways for {looks} looks");
}
