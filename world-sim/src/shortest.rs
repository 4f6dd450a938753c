//! The shortest way past the fixed obstacles that a robot could have taken, for the path ratio.
//!
//! The centre of a disc must keep its radius from every obstacle, so the obstacles are grown by it. Every one is made of
//! capsules, and a shortest way past grown capsules is made of straight lines that touch circles around the ends of their
//! cores, and of arcs on these circles: a search over those tangents ([`tangents`]) finds it exactly, however large the
//! world is. That the way ends at the tolerance of a goal is part of it: the last line ends that much before the goal, or
//! where the edge of the tolerance meets a grown obstacle.
//!
//! A way past some of the obstacles that happens to touch none of the others is the shortest past all of them. So the search
//! begins without obstacles and takes in those that are in its way, until none is; only where these become many does it take
//! in all.

mod tangents;
mod terrain;

use crate::grid::Aabb;
use crate::shapes::Shapes;
use geometry::{Capsule, Polygon, segment_distance};
use nalgebra::{Point2, Vector2, distance};
use std::cell::Cell;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::rc::Rc;
use tangents::{Circle, Network, Side, arc, tangent};
use terrain::Terrain;

/// A way may touch: rounding decides neither for nor against it, m.
pub(crate) const TOUCH_M: f64 = 1e-6;
/// What all ways of a run may cost together, in looks at an obstacle and steps of the search: a few seconds. Ways that would
/// cost more are not known.
const LOOKS_MAX: u64 = 100_000_000;
/// More obstacles than this in the way of one leg are many.
const FEW: usize = 48;

/// The fixed obstacles, and the tangents of every radius for which all of them had to be taken in.
pub(crate) struct Map {
    walls: Walls,
    networks: Vec<Network>,
    /// The walls of a map have another way of being passed.
    terrain: Option<Terrain>,
}

impl Map {
    pub(crate) fn new(shapes: &Shapes, map: Option<&crate::walls::Walls>) -> Map {
        let fixed = || shapes.obstacles.iter().filter(|obstacle| !obstacle.moves());
        let capsules: Vec<Capsule> = fixed().flat_map(|o| o.pieces.clone()).map(|index| shapes.piece(index)).collect();
        let polygons = fixed().filter_map(|obstacle| obstacle.polygon().cloned()).collect();
        let terrain = map.map(|map| Terrain::new(&map.0, &capsules));
        Map { walls: Walls::new(capsules, polygons), networks: Vec::new(), terrain }
    }

    /// Length of the shortest way of a disc from `start` past all goals in order, to the tolerance of each, m; `None` if
    /// there is none, or if it takes too long to find. Between two goals the way is measured from anywhere in the one
    /// tolerance to anywhere in the other, so with goals on the way it is the least that a way can have.
    pub(crate) fn shortest(
        &mut self,
        start: Point2<f64>,
        goals: &[Point2<f64>],
        radius_m: f64,
        tolerance_m: f64,
    ) -> Option<f64> {
        let mut from = Place { at: start, reach_m: 0.0 };
        goals.iter().try_fold(0.0, |length, goal| {
            let to = Place { at: *goal, reach_m: tolerance_m };
            let leg = self.leg(from, to, radius_m)?;
            from = to;
            Some(length + leg)
        })
    }

    fn leg(&mut self, from: Place, to: Place, radius_m: f64) -> Option<f64> {
        if let Some(terrain) = &mut self.terrain {
            return terrain.leg(from.at, to.at, radius_m).map(|length| (length - from.reach_m - to.reach_m).max(0.0));
        }
        let mut taken_in: Vec<usize> = Vec::new();
        while taken_in.len() <= FEW {
            let some = self.walls.only(&taken_in);
            let mut network = Network::new(&some, radius_m);
            let (length, way) = Search { walls: &some, network: &mut network, to }.leg(from)?;
            let new = (0..self.walls.capsules.len()).filter(|index| !taken_in.contains(index));
            let in_the_way: Vec<usize> =
                new.filter(|index| way.iter().any(|part| self.walls.blocks(*index, part, radius_m))).collect();
            self.walls.spend(way.len() * self.walls.capsules.len());
            if in_the_way.is_empty() {
                return Some(length);
            }
            if self.walls.looks.get() == 0 {
                return None;
            }
            taken_in.extend(in_the_way);
        }
        let known = self.networks.iter().position(|network| network.radius_m() == radius_m);
        let index = known.unwrap_or_else(|| {
            self.networks.push(Network::new(&self.walls, radius_m));
            self.networks.len() - 1
        });
        Search { walls: &self.walls, network: &mut self.networks[index], to }.leg(from).map(|(length, _)| length)
    }
}

/// What stands in the way.
pub(crate) struct Walls {
    capsules: Vec<Capsule>,
    boxes: Vec<Aabb>,
    polygons: Rc<Vec<(Aabb, Polygon)>>,
    /// Looks left.
    looks: Rc<Cell<u64>>,
    /// What was in the way last is likely to be in the way again.
    last: Cell<usize>,
}

impl Walls {
    fn new(capsules: Vec<Capsule>, polygons: Vec<Polygon>) -> Walls {
        let boxes = capsules.iter().map(|c| Aabb::around([c.a, c.b]).grown(c.radius)).collect();
        let boxed = |polygon: Polygon| (Aabb::around(polygon.corners.iter().copied()), polygon);
        let polygons = Rc::new(polygons.into_iter().map(boxed).collect());
        Walls { capsules, boxes, polygons, looks: Rc::new(Cell::new(LOOKS_MAX)), last: Cell::new(0) }
    }

    /// Some of the capsules, and all the insides of polygons.
    fn only(&self, indices: &[usize]) -> Walls {
        Walls {
            capsules: indices.iter().map(|index| self.capsules[*index]).collect(),
            boxes: indices.iter().map(|index| self.boxes[*index]).collect(),
            polygons: Rc::clone(&self.polygons),
            looks: Rc::clone(&self.looks),
            last: Cell::new(0),
        }
    }

    fn spend(&self, looks: usize) {
        self.looks.set(self.looks.get().saturating_sub(looks as u64));
    }

    /// Whether a capsule is in the way of a disc.
    fn blocks(&self, index: usize, part: &Part, radius_m: f64) -> bool {
        let (wall, around) = (&self.capsules[index], &self.boxes[index]);
        match *part {
            Part::Line([from, to]) => {
                Aabb::around([from, to]).grown(radius_m).meets(around)
                    && segment_distance(from, to, wall.a, wall.b) - wall.radius < radius_m - TOUCH_M
            }
            Part::Arc { center, radius, from, to, side } => {
                Aabb::around([center]).grown(radius + radius_m).meets(around)
                    && !Circle::new(center, radius, std::slice::from_ref(wall), radius_m)
                        .is_some_and(|circle| circle.allows(from, to, side))
            }
        }
    }

    /// Whether a disc gets straight from one point to the other without touching an edge.
    fn free(&self, from: Point2<f64>, to: Point2<f64>, radius_m: f64) -> bool {
        let line = Part::Line([from, to]);
        let last = self.last.get();
        if last < self.capsules.len() && self.blocks(last, &line, radius_m) {
            self.spend(1);
            return false;
        }
        let blocking = (0..self.capsules.len()).find(|index| self.blocks(*index, &line, radius_m));
        self.last.set(blocking.unwrap_or(last));
        self.spend(1 + blocking.unwrap_or(self.capsules.len()));
        blocking.is_none()
    }

    /// Whether a disc can be at a point.
    fn stands(&self, p: Point2<f64>, radius_m: f64) -> bool {
        self.free(p, p, radius_m)
            && !self.polygons.iter().any(|(around, polygon)| around.contains(p) && polygon.contains(p))
    }
}

/// A point, or all points within some distance of it.
#[derive(Clone, Copy)]
struct Place {
    at: Point2<f64>,
    reach_m: f64,
}

/// The search for one leg, A* over tangents. From a circle, the way goes on along it to the next tangent that leaves it.
struct Search<'a> {
    walls: &'a Walls,
    network: &'a mut Network,
    to: Place,
}

/// A piece of a way.
#[derive(Clone, Copy, Debug)]
enum Part {
    Line([Point2<f64>; 2]),
    Arc { center: Point2<f64>, radius: f64, from: f64, to: f64, side: Side },
}

/// The end of a way so far.
#[derive(Clone, Copy)]
struct Step {
    /// The step before, and the angle at which the way left the circle that it had come to.
    from: Option<(usize, f64)>,
    line: [Point2<f64>; 2],
    /// The circle that it comes to, if it is not at the goal: which, how, and where.
    to: Option<(usize, Side, f64)>,
    /// The line still has to be looked at.
    unseen: bool,
}

impl Search<'_> {
    /// The shortest way and its length.
    fn leg(&mut self, from: Place) -> Option<(f64, Vec<Part>)> {
        let radius_m = self.network.radius_m();
        let (starts, ends) = (self.places(from), self.places(self.to));
        let mut queue = Queue::default();
        for start in &starts {
            for end in &ends {
                let Some((line, length)) = between(start, end) else { return Some((0.0, Vec::new())) };
                if self.walls.stands(line[0], radius_m) && self.walls.free(line[0], line[1], radius_m) {
                    queue.push(length, 0.0, Step { from: None, line, to: None, unseen: false });
                }
            }
        }
        for start in starts.iter().filter(|start| start.reach_m > 0.0 || self.walls.stands(start.at, radius_m)) {
            for (circle, around) in self.network.circles().iter().enumerate() {
                for side in Side::BOTH {
                    let ends = [(start.at, 0.0, side), (around.center, around.radius, side)];
                    let Some(line) = tangent(ends[0], ends[1]).filter(|line| around.exposes(line.to_angle)) else {
                        continue;
                    };
                    let (begin, length) = short_of(start, line.to, line.length);
                    let to = Some((circle, side, line.to_angle));
                    let step = Step { from: None, line: [begin, line.to], to, unseen: true };
                    queue.push(length, self.ahead_m(line.to), step);
                }
            }
        }
        // By circle and side: where the way came to it before, and how long it was then.
        let mut arrived: Vec<Vec<(f64, f64)>> = vec![Vec::new(); 2 * self.network.circles().len()];
        while let Some((index, length)) = queue.pop() {
            let Step { line: [a, b], to, unseen, .. } = queue.steps[index].1;
            let Some((circle, side, angle)) = to else { return Some((length, self.way(&queue, index))) };
            if unseen && !(self.walls.stands(a, radius_m) && self.walls.free(a, b, radius_m)) {
                continue;
            }
            if self.walls.looks.get() == 0 {
                return None;
            }
            let around = &self.network.circles()[circle];
            let before = &mut arrived[2 * circle + side.index()];
            // Whoever was on this circle earlier and can go on along it is here already.
            let along = |from: f64, to: f64| around.allows(from, to, side).then(|| around.radius * arc(from, to, side));
            self.walls.spend(before.len());
            if before.iter().any(|(at, less)| along(*at, angle).is_some_and(|more| less + more <= length)) {
                continue;
            }
            before.push((angle, length));
            for end in &ends {
                let ends = [(around.center, around.radius, side), (end.at, 0.0, side)];
                let Some(line) = tangent(ends[0], ends[1]) else { continue };
                let Some(more) = along(angle, line.from_angle) else { continue };
                let (stop, rest) = short_of(end, line.from, line.length);
                if self.walls.free(line.from, stop, radius_m) {
                    let from = Some((index, line.from_angle));
                    let step = Step { from, line: [line.from, stop], to: None, unseen: false };
                    queue.push(length + more + rest, 0.0, step);
                }
            }
            self.network.leave(circle, self.walls);
            let around = &self.network.circles()[circle];
            for leaf in self.network.leaves(circle).iter().filter(|leaf| leaf.side == side) {
                self.walls.spend(1);
                if around.allows(angle, leaf.line.from_angle, side) {
                    let length = length + around.radius * arc(angle, leaf.line.from_angle, side) + leaf.line.length;
                    let from = Some((index, leaf.line.from_angle));
                    let to = Some((leaf.to, leaf.to_side, leaf.line.to_angle));
                    let step = Step { from, line: [leaf.line.from, leaf.line.to], to, unseen: false };
                    queue.push(length, self.ahead_m(leaf.line.to), step);
                }
            }
        }
        None
    }

    /// The parts of the way that ends with a step, the last one first.
    fn way(&self, queue: &Queue, mut index: usize) -> Vec<Part> {
        let mut parts = Vec::new();
        loop {
            let step = &queue.steps[index].1;
            parts.push(Part::Line(step.line));
            let Some((before, left)) = step.from else { return parts };
            if let Some((circle, side, angle)) = queue.steps[before].1.to {
                let Circle { center, radius, .. } = self.network.circles()[circle];
                parts.push(Part::Arc { center, radius, from: angle, to: left, side });
            }
            index = before;
        }
    }

    /// No way from here is shorter, m.
    fn ahead_m(&self, from: Point2<f64>) -> f64 {
        (distance(&from, &self.to.at) - self.to.reach_m).max(0.0)
    }

    /// A place, and where its edge meets grown obstacles: a way that may end anywhere in it ends on the line to its middle, or
    /// there.
    fn places(&self, place: Place) -> Vec<Place> {
        let radius_m = self.network.radius_m();
        let mut places = vec![place];
        if place.reach_m > 0.0 {
            for wall in &self.walls.capsules {
                let grown = wall.radius + radius_m;
                if wall.distance(place.at) < radius_m + place.reach_m {
                    let meets = tangents::crossings(place.at, place.reach_m, wall, grown);
                    let on_edge = meets.into_iter().map(|angle| place.at + direction(angle) * place.reach_m);
                    let corners = on_edge.filter(|p| self.walls.stands(*p, radius_m));
                    places.extend(corners.map(|at| Place { at, reach_m: 0.0 }));
                }
            }
        }
        places
    }
}

/// The straight line between two places, and its length; `None` if they meet.
fn between(a: &Place, b: &Place) -> Option<([Point2<f64>; 2], f64)> {
    let (way, whole) = (b.at - a.at, distance(&a.at, &b.at));
    let length = whole - a.reach_m - b.reach_m;
    (length > 0.0).then(|| ([a.at + way * (a.reach_m / whole), b.at - way * (b.reach_m / whole)], length))
}

/// Where a line from a point to the middle of a place, of this length, comes to the place, and its length until there.
fn short_of(place: &Place, from: Point2<f64>, length: f64) -> (Point2<f64>, f64) {
    let cut = place.reach_m.min(length);
    let share = if length > 0.0 { cut / length } else { 0.0 };
    (place.at + (from - place.at) * share, length - cut)
}

pub(crate) fn direction(angle: f64) -> Vector2<f64> {
    let (sin, cos) = angle.sin_cos();
    Vector2::new(cos, sin)
}

/// Ways, the most promising first.
#[derive(Default)]
struct Queue {
    steps: Vec<(f64, Step)>,
    // Lengths are not negative, so that their bits sort as they do.
    order: BinaryHeap<Reverse<(u64, usize)>>,
}

impl Queue {
    fn push(&mut self, length: f64, ahead: f64, step: Step) {
        self.order.push(Reverse(((length + ahead).max(0.0).to_bits(), self.steps.len())));
        self.steps.push((length, step));
    }

    /// A step by its number, and the length of the way with it.
    fn pop(&mut self) -> Option<(usize, f64)> {
        self.order.pop().map(|Reverse((_, index))| (index, self.steps[index].0))
    }
}

#[cfg(test)]
mod tests;
