//! The shortest way past the fixed obstacles that a robot could have taken, for the path ratio.
//!
//! A straight line where that is free. Otherwise Lazy Theta* (A. Nash, S. Koenig, C. Tovey, "Lazy Theta*: Any-Angle
//! Path Planning and Path Length Analysis in 3D", AAAI 2010) on a lattice over the obstacles inflated by the robot's
//! radius, then shortened against the exact shapes. The lattice has a spacing of [`SPACING_M_MIN`] or 1/400 of the
//! larger side of the world, whichever is more.

use crate::grid::Aabb;
use crate::shapes::Shapes;
use nalgebra::{Point2, distance};
use planners::Capsule;
use planners::geometry::{Polygon, segment_distance};
use scenarios::Bounds;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Smallest spacing of the lattice, m.
const SPACING_M_MIN: f64 = 0.05;
/// Lattice points along the larger side of the world, at most.
const POINTS_PER_SIDE_MAX: f64 = 400.0;
/// A way may touch: rounding decides neither for nor against it, m.
const TOUCH_M: f64 = 1e-6;

/// The fixed obstacles, and the lattice of the last radius that was asked for.
pub(crate) struct Map {
    walls: Vec<Capsule>,
    polygons: Vec<Polygon>,
    bounds: Aabb,
    lattice: Option<Lattice>,
}

impl Map {
    pub(crate) fn new(bounds: Bounds, shapes: &Shapes) -> Map {
        let fixed = || shapes.obstacles.iter().filter(|obstacle| !obstacle.moves());
        let walls: Vec<Capsule> = fixed().flat_map(|o| o.pieces.clone()).map(|index| shapes.piece(index)).collect();
        let edges = [Point2::new(bounds.x_m[0], bounds.y_m[0]), Point2::new(bounds.x_m[1], bounds.y_m[1])];
        let thick = walls.iter().fold(0.0, |most: f64, wall| most.max(wall.radius));
        let around = Aabb::around(walls.iter().flat_map(|wall| [wall.a, wall.b])).grown(thick);
        Map {
            bounds: Aabb::around(
                edges.into_iter().chain((!walls.is_empty()).then_some([around.low, around.high]).into_iter().flatten()),
            ),
            walls,
            polygons: fixed().filter_map(|obstacle| obstacle.polygon().cloned()).collect(),
            lattice: None,
        }
    }

    /// Length of the shortest way from `start` past all goals in order, m; `None` if there is none.
    pub(crate) fn shortest(&mut self, start: Point2<f64>, goals: &[Point2<f64>], radius_m: f64) -> Option<f64> {
        let mut at = start;
        goals.iter().try_fold(0.0, |length, goal| {
            let leg = self.leg(at, *goal, radius_m)?;
            at = *goal;
            Some(length + leg)
        })
    }

    fn leg(&mut self, from: Point2<f64>, to: Point2<f64>, radius_m: f64) -> Option<f64> {
        if self.free(from, to, radius_m) {
            return Some(distance(&from, &to));
        }
        let lattice = match self.lattice.take() {
            Some(lattice) if lattice.radius_m == radius_m && lattice.holds(from) && lattice.holds(to) => lattice,
            _ => Lattice::new(self, radius_m, [from, to]),
        };
        let way = lattice.search(self, from, to);
        self.lattice = Some(lattice);
        way.map(|way| self.shortened(way, radius_m).windows(2).map(|leg| distance(&leg[0], &leg[1])).sum())
    }

    /// Whether a disc gets straight from one point to the other.
    fn free(&self, from: Point2<f64>, to: Point2<f64>, radius_m: f64) -> bool {
        let needed = radius_m - TOUCH_M;
        let swept = Aabb::around([from, to]).grown(radius_m);
        let clear = |wall: &Capsule| {
            !swept.meets(&Aabb::around([wall.a, wall.b]).grown(wall.radius))
                || segment_distance(from, to, wall.a, wall.b) - wall.radius >= needed
        };
        self.walls.iter().all(clear) && !self.polygons.iter().any(|polygon| polygon.contains(from))
    }

    /// Whether a disc can be at a point.
    fn stands(&self, p: Point2<f64>, radius_m: f64) -> bool {
        self.free(p, p, radius_m)
    }

    /// Pulls the string: drops corners that are not needed, then pulls the rest towards their neighbours in halving
    /// steps, as far as the exact shapes allow.
    fn shortened(&self, mut way: Vec<Point2<f64>>, radius_m: f64) -> Vec<Point2<f64>> {
        for round in 0..4 {
            let mut kept = vec![way[0]];
            let mut at = 0;
            while at + 1 < way.len() {
                let farthest = (at + 2..way.len()).rev().find(|next| self.free(way[at], way[*next], radius_m));
                at = farthest.unwrap_or(at + 1);
                kept.push(way[at]);
            }
            way = kept;
            if round == 3 {
                break;
            }
            for corner in 1..way.len().saturating_sub(1) {
                let (before, after) = (way[corner - 1], way[corner + 1]);
                let mut step = 0.5;
                while step > 1e-3 {
                    let nearest = Capsule::segment(before, after).nearest_core(way[corner]);
                    let pulled = way[corner] + (nearest - way[corner]) * step;
                    if self.free(before, pulled, radius_m) && self.free(pulled, after, radius_m) {
                        way[corner] = pulled;
                    } else {
                        step *= 0.5;
                    }
                    if distance(&nearest, &way[corner]) < 1e-4 {
                        break;
                    }
                }
            }
        }
        way
    }
}

/// Which points of the lattice a disc of one radius can be at.
struct Lattice {
    radius_m: f64,
    origin: Point2<f64>,
    spacing_m: f64,
    columns: i32,
    rows: i32,
    blocked: Vec<bool>,
}

/// A lattice point.
type Node = [i32; 2];

impl Lattice {
    fn new(map: &Map, radius_m: f64, ends: [Point2<f64>; 2]) -> Lattice {
        let area = Aabb::around([map.bounds.low, map.bounds.high].into_iter().chain(ends));
        // The edges of the world are no walls: there is a way round everything on the outside.
        let margin = 2.0 * radius_m + 2.0 * SPACING_M_MIN;
        let area = area.grown(margin);
        let size = area.high - area.low;
        let spacing_m = SPACING_M_MIN.max(size.max() / POINTS_PER_SIDE_MAX);
        let (columns, rows) = ((size.x / spacing_m).ceil() as i32 + 1, (size.y / spacing_m).ceil() as i32 + 1);
        let blocked = vec![false; (columns * rows) as usize];
        let mut lattice = Lattice { radius_m, origin: area.low, spacing_m, columns, rows, blocked };
        // Small robots must not slip through a wall between two lattice points.
        let inflated = radius_m.max(0.71 * spacing_m) - TOUCH_M;
        for wall in &map.walls {
            let around = Aabb::around([wall.a, wall.b]).grown(wall.radius + inflated);
            lattice.block(around, |p| wall.distance(p) < inflated);
        }
        for polygon in &map.polygons {
            lattice.block(Aabb::around(polygon.corners.iter().copied()), |p| polygon.contains(p));
        }
        lattice
    }

    fn block(&mut self, area: Aabb, blocks: impl Fn(Point2<f64>) -> bool) {
        let ([left, bottom], [right, top]) = (self.nearest(area.low), self.nearest(area.high));
        for row in bottom..=top {
            for column in left..=right {
                if blocks(self.point([column, row])) {
                    let index = self.index([column, row]);
                    self.blocked[index] = true;
                }
            }
        }
    }

    fn holds(&self, p: Point2<f64>) -> bool {
        let far = self.point([self.columns - 1, self.rows - 1]);
        Aabb { low: self.origin, high: far }.contains(p)
    }

    fn nearest(&self, p: Point2<f64>) -> Node {
        let at = (p - self.origin) / self.spacing_m;
        [(at.x.round() as i32).clamp(0, self.columns - 1), (at.y.round() as i32).clamp(0, self.rows - 1)]
    }

    fn point(&self, [column, row]: Node) -> Point2<f64> {
        self.origin + nalgebra::Vector2::new(f64::from(column), f64::from(row)) * self.spacing_m
    }

    fn index(&self, [column, row]: Node) -> usize {
        (row * self.columns + column) as usize
    }

    fn node(&self, index: usize) -> Node {
        [index as i32 % self.columns, index as i32 / self.columns]
    }

    fn open(&self, node: Node) -> bool {
        (0..self.columns).contains(&node[0]) && (0..self.rows).contains(&node[1]) && !self.blocked[self.index(node)]
    }

    /// Whether all lattice points along the straight line between two are open (Bresenham).
    fn sight(&self, [mut x, mut y]: Node, to: Node) -> bool {
        let (dx, dy) = ((to[0] - x).abs(), -(to[1] - y).abs());
        let (step_x, step_y) = ((to[0] - x).signum(), (to[1] - y).signum());
        let mut error = dx + dy;
        while [x, y] != to {
            if !self.open([x, y]) {
                return false;
            }
            let twice = 2 * error;
            if twice >= dy {
                error += dy;
                x += step_x;
            }
            if twice <= dx {
                error += dx;
                y += step_y;
            }
        }
        self.open(to)
    }

    /// The open lattice points around a point to which a disc gets straight.
    fn doors<'a>(&'a self, map: &'a Map, p: Point2<f64>) -> impl Iterator<Item = Node> + 'a {
        let [column, row] = self.nearest(p);
        let around = (-2..=2).flat_map(move |dy| (-2..=2).map(move |dx| [column + dx, row + dy]));
        around.filter(move |node| self.open(*node) && map.free(p, self.point(*node), self.radius_m))
    }

    /// Lazy Theta*: a node inherits the parent of the one it was reached from, as if that were in sight, and only when
    /// its turn comes finds out.
    fn search(&self, map: &Map, from: Point2<f64>, to: Point2<f64>) -> Option<Vec<Point2<f64>>> {
        if !map.stands(from, self.radius_m) || !map.stands(to, self.radius_m) {
            return None;
        }
        const NOBODY: u32 = u32::MAX;
        let count = self.blocked.len();
        let (mut cost, mut parent, mut closed) = (vec![f64::INFINITY; count], vec![NOBODY; count], vec![false; count]);
        // Costs are positive, so that their bits sort as they do.
        let mut queue: BinaryHeap<Reverse<(u64, u32)>> = BinaryHeap::new();
        let ahead = |node: Node| distance(&self.point(node), &to);
        for door in self.doors(map, from) {
            let index = self.index(door);
            cost[index] = distance(&from, &self.point(door));
            parent[index] = index as u32; // The start, which is no lattice point.
            queue.push(Reverse(((cost[index] + ahead(door)).to_bits(), index as u32)));
        }
        let mut exits = vec![false; count];
        self.doors(map, to).for_each(|node| exits[self.index(node)] = true);

        while let Some(Reverse((_, index))) = queue.pop() {
            let index = index as usize;
            if std::mem::replace(&mut closed[index], true) {
                continue;
            }
            let node = self.node(index);
            let neighbors = NEIGHBORS.iter().map(|[dx, dy]| [node[0] + dx, node[1] + dy]).filter(|n| self.open(*n));
            let from_index = parent[index] as usize;
            if from_index != index && !self.sight(self.node(from_index), node) {
                let through = |n: Node| cost[self.index(n)] + distance(&self.point(n), &self.point(node));
                let known = neighbors.clone().filter(|n| closed[self.index(*n)]);
                let best = known.min_by(|a, b| through(*a).total_cmp(&through(*b)))?;
                (parent[index], cost[index]) = (self.index(best) as u32, through(best));
            }
            if exits[index] {
                return Some(self.way(&parent, index, from, to));
            }
            let base = parent[index] as usize;
            for next in neighbors {
                let next_index = self.index(next);
                let through = cost[base] + distance(&self.point(self.node(base)), &self.point(next));
                if !closed[next_index] && through < cost[next_index] {
                    (cost[next_index], parent[next_index]) = (through, base as u32);
                    queue.push(Reverse(((through + ahead(next)).to_bits(), next_index as u32)));
                }
            }
        }
        None
    }

    fn way(&self, parent: &[u32], mut index: usize, from: Point2<f64>, to: Point2<f64>) -> Vec<Point2<f64>> {
        let mut way = vec![to, self.point(self.node(index))];
        while parent[index] as usize != index {
            index = parent[index] as usize;
            way.push(self.point(self.node(index)));
        }
        way.push(from);
        way.reverse();
        way
    }
}

const NEIGHBORS: [Node; 8] = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]];

#[cfg(test)]
mod tests {
    use super::*;
    use scenarios::{Obstacle, Shape};

    const BOUNDS: Bounds = Bounds { x_m: [-5.0, 5.0], y_m: [-5.0, 5.0] };

    fn check(obstacles: &[Shape], [from, to]: [[f64; 2]; 2], radius_m: f64, expected: Option<f64>) {
        let placed: Vec<Obstacle> = obstacles.iter().map(|s| Obstacle { shape: s.clone(), motion: None }).collect();
        let length = Map::new(BOUNDS, &Shapes::new(&placed, 1)).shortest(from.into(), &[to.into()], radius_m);
        match (length, expected) {
            (Some(length), Some(expected)) => {
                let off = length / expected - 1.0;
                assert!((-1e-4..0.01).contains(&off), "{length} m, not {expected} m ({:.2} %)", off * 100.0);
            }
            _ => assert_eq!(length, expected),
        }
    }

    fn wall(a: [f64; 2], b: [f64; 2]) -> Shape {
        Shape::Capsule(Capsule::segment(a.into(), b.into()))
    }

    /// Two tangents of length sqrt(d² - r²) and the arc between them.
    fn around(d: f64, r: f64, turn: f64) -> f64 {
        2.0 * (d * d - r * r).sqrt() + r * (turn - 2.0 * (r / d).acos())
    }

    #[test]
    fn shortest_ways_are_what_geometry_says() {
        use std::f64::consts::PI;
        let across = [[-3.0, 0.0], [3.0, 0.0]];
        check(&[], across, 0.25, Some(6.0));
        // A disc in the way: tangents and an arc around it, inflated.
        let disc = Shape::Capsule(Capsule::disc(Point2::origin(), 1.0));
        check(&[disc], across, 0.25, Some(around(3.0, 1.25, PI)));
        // A long wall: over its upper end, where the robot rolls around the end point.
        let d = 3f64.hypot(1.0);
        let turn = PI + 2.0 * (1f64 / 3.0).atan();
        check(&[wall([0.0, -4.0], [0.0, 1.0])], across, 0.2, Some(around(d, 0.2, turn)));
        check(&[wall([0.0, -4.0], [0.0, 1.0])], across, 0.01, Some(around(d, 0.01, turn)));
        // A square, passed by two of its corners.
        let corners = [[-1.0, -1.5], [1.0, -1.5], [1.0, 1.0], [-1.0, 1.0]];
        let square = Shape::Polygon(corners.map(Point2::from).to_vec());
        check(std::slice::from_ref(&square), across, 0.001, Some(2.0 * 2f64.hypot(1.0) + 2.0));
        // Closed in, and standing inside an obstacle.
        let closed = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let room: Vec<Shape> = (0..4).map(|i| wall(closed[i], closed[(i + 1) % 4])).collect();
        check(&room, [[0.0, 0.0], [3.0, 0.0]], 0.2, None);
        check(&[square], [[0.0, 0.0], [3.0, 0.0]], 0.2, None);
    }

    #[test]
    fn a_door_is_passed_if_it_is_wide_enough() {
        let door = |gap: f64| [wall([0.0, -9.0], [0.0, 2.0]), wall([0.0, 2.0 + gap], [0.0, 9.0])];
        let ends = [[-3.0, 2.5], [3.0, 2.5]];
        check(&door(1.0), ends, 0.3, Some(6.0));
        let map = |gap| {
            let placed = door(gap).map(|shape| Obstacle { shape, motion: None });
            Map::new(BOUNDS, &Shapes::new(&placed, 1)).shortest(ends[0].into(), &[ends[1].into()], 0.3).unwrap()
        };
        assert!(map(0.8) < 6.1 && map(0.4) > 15.0, "{} {}", map(0.8), map(0.4));
    }
}
