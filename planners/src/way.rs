//! Shortest ways of a disc past the obstacles of a known map.
//!
//! Obstacles are grown by the radius of the disc and a margin. Where the outline of a grown obstacle is round, a few straight
//! pieces that touch the arc stand for it (`way/outline.rs`), so that a way is a chain of straight lines between corners: at most
//! 4 % longer at a corner than round the arc. Only lines that touch the outlines at both ends can be part of a shortest way
//! (a tangent graph). From each goal one search (Dijkstra) finds how far it is from every corner; a robot then heads, at each
//! tick, for the corner in sight from which the whole way is shortest.
//!
//! Robots of one size share a [`Graph`] if they are in one process: it is a function of the map and the radius alone.

mod outline;

use crate::planner::{Neighbor, Obstacle, PlanInput};
use geometry::{Capsule, segment_distance};
use nalgebra::{Point2, Vector2, distance};
use outline::{Corner, corners};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::{Arc, Mutex, OnceLock, Weak};

/// Of the radius: how much room a way leaves beside obstacles.
const MARGIN: f64 = 0.03;
/// The same where that leaves no way, or one that is long.
const MARGIN_MIN: f64 = 0.002;
/// What is shorter than this share of a way is not as long as it.
const ROUND: f64 = 0.95;
/// Rounding decides neither for nor against a line, as a share of the radius.
const TOUCH: f64 = 1e-6;
/// Graphs that are kept for robots that come later.
const KEPT: usize = 16;

/// The corners of a map for one radius.
pub struct Graph {
    key: u64,
    /// What the centre keeps from every obstacle, m.
    keeps_m: f64,
    pieces: Vec<Capsule>,
    corners: Vec<Corner>,
    /// From each corner, once it was asked for: the corners that a way can go on to, and how far they are, m.
    links: Vec<OnceLock<Vec<(u32, f64)>>>,
}

static GRAPHS: Mutex<Vec<Weak<Graph>>> = Mutex::new(Vec::new());

impl Graph {
    /// The graph of this map for a disc that keeps this distance (m) from everything.
    fn of(map: &[Obstacle], keeps_m: f64) -> Arc<Graph> {
        let key = key(map, keeps_m);
        let mut graphs = GRAPHS.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        graphs.retain(|graph| graph.strong_count() > 0);
        if let Some(graph) = graphs.iter().filter_map(Weak::upgrade).find(|graph| graph.is_of(key, map, keeps_m)) {
            return graph;
        }
        let graph = Arc::new(Graph::new(key, map, keeps_m));
        if graphs.len() < KEPT {
            graphs.push(Arc::downgrade(&graph));
        }
        graph
    }

    fn is_of(&self, key: u64, map: &[Obstacle], keeps_m: f64) -> bool {
        let same = self.pieces.len() == map.len() && self.pieces.iter().zip(map).all(|(a, b)| *a == b.shape);
        self.key == key && self.keeps_m == keeps_m && same
    }

    fn new(key: u64, map: &[Obstacle], keeps_m: f64) -> Graph {
        let pieces: Vec<Capsule> = map.iter().map(|obstacle| obstacle.shape).collect();
        let least_m = keeps_m * (1.0 - TOUCH);
        let corners = corners(map, keeps_m, &|at| {
            let stands = pieces.iter().all(|piece| piece.distance(at) >= least_m);
            stands && !map.chunk_by(|a, b| a.id == b.id).any(|all| crate::planner::solid(all, at).is_some())
        });
        let links = corners.iter().map(|_| OnceLock::new()).collect();
        Graph { key, keeps_m, pieces, corners, links }
    }

    /// What the disc can keep from obstacles on its way from or to a point: less than usual where that is nearer to one, m.
    fn keeps(&self, at: Point2<f64>) -> f64 {
        let near = self.pieces.iter().filter(|piece| !is_apart(piece, self.keeps_m, at, at));
        near.map(|piece| piece.distance(at)).fold(self.keeps_m, f64::min) * (1.0 - TOUCH)
    }

    /// Whether a disc that keeps this distance (m) from everything gets straight from one point to the other.
    fn sees(&self, from: Point2<f64>, to: Point2<f64>, keeps_m: f64) -> bool {
        self.pieces.iter().all(|piece| {
            is_apart(piece, keeps_m, from, to) || segment_distance(from, to, piece.a, piece.b) - piece.radius >= keeps_m
        })
    }

    fn links(&self, index: usize) -> &[(u32, f64)] {
        self.links[index].get_or_init(|| {
            let from = &self.corners[index];
            let all = self.corners.iter().enumerate().filter(|(other, _)| *other != index);
            let fits = |(other, to): (usize, &Corner)| {
                let way = to.at - from.at;
                let touches = from.is_touched_by(way) && to.is_touched_by(way);
                (touches && self.sees(from.at, to.at, self.keeps_m * (1.0 - TOUCH))).then(|| (other as u32, way.norm()))
            };
            all.filter_map(fits).collect()
        })
    }
}

/// Whether a line is so far from a piece that its distance need not be computed.
fn is_apart(piece: &Capsule, keeps_m: f64, from: Point2<f64>, to: Point2<f64>) -> bool {
    let reach_m = piece.radius + keeps_m;
    let beside =
        |a: f64, b: f64, from: f64, to: f64| a.min(b) - reach_m > from.max(to) || a.max(b) + reach_m < from.min(to);
    beside(piece.a.x, piece.b.x, from.x, to.x) || beside(piece.a.y, piece.b.y, from.y, to.y)
}

fn key(map: &[Obstacle], keeps_m: f64) -> u64 {
    let numbers = map.iter().flat_map(|obstacle| {
        let Capsule { a, b, radius } = obstacle.shape;
        [a.x, a.y, b.x, b.y, radius]
    });
    numbers
        .chain([keeps_m])
        .fold(map.len() as u64, |sum, x| (sum.rotate_left(29) ^ x.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

/// What to head for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ahead {
    /// The next corner, or the goal, m.
    pub at: Point2<f64>,
    /// It is the goal.
    pub is_goal: bool,
    /// Length of the whole way from here, m.
    pub left_m: f64,
}

/// The shortest ways to one goal.
#[derive(Clone)]
pub struct Way {
    graph: Arc<Graph>,
    goal: Point2<f64>,
    /// What a way keeps from obstacles at the goal, m.
    goal_keeps_m: f64,
    /// By corner: how far the goal is, m, and the corner that comes next; none if it is the goal.
    left: Vec<(f64, Option<u32>)>,
    /// What the robot heads for: a corner, or the goal.
    heads_for: Option<Option<u32>>,
}

impl Way {
    /// Ways to a goal of a disc of this radius (m) past the obstacles of a map. `from` (m) is where the first way begins: if
    /// it is a long way round, and one that passes obstacles more closely is not, that one counts.
    pub fn new(map: &[Obstacle], radius_m: f64, from: Point2<f64>, goal: Point2<f64>) -> Way {
        let mut usual = Way::with_margin(map, radius_m * (1.0 + MARGIN), goal);
        let usual_m = usual.ahead(from).map_or(f64::INFINITY, |ahead| ahead.left_m);
        if usual_m * ROUND < distance(&from, &goal) {
            return usual;
        }
        let mut close = Way::with_margin(map, radius_m * (1.0 + MARGIN_MIN), goal);
        let is_shorter = close.ahead(from).is_some_and(|ahead| ahead.left_m < ROUND * usual_m);
        if is_shorter { close } else { usual }
    }

    fn with_margin(map: &[Obstacle], keeps_m: f64, goal: Point2<f64>) -> Way {
        let graph = Graph::of(map, keeps_m);
        let mut left = vec![(f64::INFINITY, None); graph.corners.len()];
        let goal_keeps_m = graph.keeps(goal);
        let mut queue: BinaryHeap<Reverse<(u64, u32)>> = BinaryHeap::new();
        for (index, corner) in graph.corners.iter().enumerate() {
            let way = corner.at - goal;
            if corner.is_touched_by(way) && graph.sees(goal, corner.at, goal_keeps_m) {
                left[index] = (way.norm(), None);
                // Lengths are not negative, so that their bits sort as they do.
                queue.push(Reverse((way.norm().to_bits(), index as u32)));
            }
        }
        while let Some(Reverse((bits, index))) = queue.pop() {
            let so_far = f64::from_bits(bits);
            if so_far > left[index as usize].0 {
                continue;
            }
            for (other, length) in graph.links(index as usize) {
                let sum = so_far + length;
                if sum < left[*other as usize].0 {
                    left[*other as usize] = (sum, Some(index));
                    queue.push(Reverse((sum.to_bits(), *other)));
                }
            }
        }
        Way { graph, goal, goal_keeps_m, left, heads_for: None }
    }

    /// What a robot heads for now: along the shortest way if it knows the map, else straight to its goal; `None` if there is
    /// no way. `way` is what it knows of the ways to its goal, and is made when the goal is a new one.
    pub fn follow(way: &mut Option<Way>, input: &PlanInput<'_>) -> Option<Ahead> {
        let (from, goal) = (input.position, input.goal);
        if input.map.is_empty() {
            return Some(Ahead { at: goal, is_goal: true, left_m: distance(&from, &goal) });
        }
        if way.as_ref().is_none_or(|way| way.goal != goal) {
            *way = Some(Way::new(input.map, input.radius_m, from, goal));
        }
        way.as_mut().and_then(|way| way.ahead(from))
    }

    /// The same for a robot without a map, along the shortest way past what it has seen so far. Where that leaves none it heads
    /// straight for its goal, and forgets what it has seen.
    pub fn explore(way: &mut Option<Way>, sketch: &mut Sketch, input: &PlanInput<'_>) -> Ahead {
        let has_changed = sketch.look(input);
        Way::past(way, sketch, has_changed, input)
    }

    /// The same with a sketch that has been brought up to date; `has_changed` says whether anything of it is new.
    pub(crate) fn past(way: &mut Option<Way>, sketch: &mut Sketch, has_changed: bool, input: &PlanInput<'_>) -> Ahead {
        let (from, goal) = (input.position, input.goal);
        if has_changed || way.as_ref().is_some_and(|way| way.goal != goal) {
            *way = None;
        }
        if !sketch.pieces.is_empty() {
            let known = way.get_or_insert_with(|| Way::new(&sketch.pieces, input.radius_m, from, goal));
            if let Some(ahead) = known.ahead(from) {
                return ahead;
            }
            (*way, sketch.pieces) = (None, Vec::new());
        }
        Ahead { at: goal, is_goal: true, left_m: distance(&from, &goal) }
    }

    /// What a robot heads for that is here (m); `None` if no way leads to the goal.
    pub fn ahead(&mut self, from: Point2<f64>) -> Option<Ahead> {
        let keeps_m = self.graph.keeps(from);
        // What comes after that for which it headed may have come into sight; nothing else does in a tick, as a rule.
        if let Some(Some(index)) = self.heads_for {
            let next = self.left[index as usize].1;
            if self.sees(from, next, keeps_m) {
                self.heads_for = Some(next);
            }
        }
        if let Some(heads_for) = self.heads_for.filter(|heads_for| self.sees(from, *heads_for, keeps_m)) {
            return Some(self.to(from, heads_for));
        }
        self.heads_for = self.best(from, keeps_m);
        self.heads_for.map(|heads_for| self.to(from, heads_for))
    }

    /// Looks at all corners.
    fn best(&self, from: Point2<f64>, keeps_m: f64) -> Option<Option<u32>> {
        if self.sees(from, None, keeps_m) {
            return Some(None);
        }
        let mut best: Option<(f64, u32)> = None;
        for (index, (corner, (left_m, _))) in self.graph.corners.iter().zip(&self.left).enumerate() {
            let length = distance(&from, &corner.at) + left_m;
            let is_better = length.is_finite() && best.is_none_or(|(least, _)| length < least);
            if is_better && self.graph.sees(from, corner.at, keeps_m) {
                best = Some((length, index as u32));
            }
        }
        best.map(|(_, index)| Some(index))
    }

    fn place(&self, heads_for: Option<u32>) -> Point2<f64> {
        heads_for.map_or(self.goal, |index| self.graph.corners[index as usize].at)
    }

    fn sees(&self, from: Point2<f64>, heads_for: Option<u32>, keeps_m: f64) -> bool {
        let keeps_m = if heads_for.is_none() { keeps_m.min(self.goal_keeps_m) } else { keeps_m };
        self.graph.sees(from, self.place(heads_for), keeps_m)
    }

    fn to(&self, from: Point2<f64>, heads_for: Option<u32>) -> Ahead {
        let at = self.place(heads_for);
        let rest_m = heads_for.map_or(0.0, |index| self.left[index as usize].0);
        Ahead { at, is_goal: heads_for.is_none(), left_m: distance(&from, &at) + rest_m }
    }
}

/// What a robot without a map has seen so far of what stands.
#[derive(Clone, Debug, Default)]
pub struct Sketch {
    /// Sorted by id; the pieces of one obstacle stand together.
    pieces: Vec<Obstacle>,
}

impl Sketch {
    /// Takes in what is seen and heard; whether anything of it is new.
    pub(crate) fn look(&mut self, input: &PlanInput<'_>) -> bool {
        self.see(input.obstacles) | self.recognise(input.neighbors)
    }

    /// What stands, as far as it has been seen.
    pub(crate) fn pieces(&self) -> &[Obstacle] {
        &self.pieces
    }

    /// Takes out what turns out to be a robot: one that is heard to be where something stands. Whether there was any.
    fn recognise(&mut self, heard: &[Neighbor]) -> bool {
        let before = self.pieces.len();
        let is_robot = |piece: &Obstacle| heard.iter().any(|robot| piece.shape.distance(robot.position) < 0.0);
        self.pieces.retain(|piece| piece.is_wall() || !is_robot(piece));
        self.pieces.len() < before
    }

    /// Adds what is seen, and takes out what turns out to move; whether anything was new.
    fn see(&mut self, seen: &[Obstacle]) -> bool {
        let mut has_changed = false;
        for pieces in seen.chunk_by(|a, b| a.id == b.id) {
            let id = pieces[0].id;
            let first = self.pieces.partition_point(|known| known.id < id);
            let mut last = self.pieces.partition_point(|known| known.id <= id);
            let moves = pieces.iter().any(|piece| piece.velocity != Vector2::zeros());
            // A disc that is somewhere else now has been moved meanwhile.
            let was_moved = pieces.len() == 1
                && pieces[0].shape.a == pieces[0].shape.b
                && last == first + 1
                && self.pieces[first].shape != pieces[0].shape;
            if (moves || was_moved) && last > first {
                self.pieces.drain(first..last);
                (last, has_changed) = (first, true);
            }
            for piece in pieces.iter().filter(|_| !moves) {
                if !self.pieces[first..last].iter().any(|known| known.shape == piece.shape) {
                    self.pieces.insert(last, *piece);
                    (last, has_changed) = (last + 1, true);
                }
            }
        }
        has_changed
    }
}

#[cfg(test)]
mod tests;
