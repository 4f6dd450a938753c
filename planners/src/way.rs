//! Shortest ways of a disc past the obstacles of a known map.
//!
//! Obstacles are grown by the radius of the disc and a margin. Where the outline of a grown obstacle is round, a few straight
//! pieces that touch the arc stand for it (`way/outline.rs`), so that a way is a chain of straight lines between corners: at most
//! 4 % longer at a corner than round the arc. Only lines that touch the outlines at both ends can be part of a shortest way
//! (a tangent graph). From each goal one search (Dijkstra) finds how far it is from every corner; a robot then heads, at each
//! tick, for the corner in sight from which the whole way is shortest.
//!
//! A planner whose robots keep to the right of each other can ask for ways that keep to the right of obstacles as well: each
//! obstacle that a way has on its right costs a toll, and so does a turn away from an obstacle that the way touches, by which a way
//! could be had that is not shortest and pays less. Then robots go round what stands in one direction.
//!
//! Robots of one size share the graph if they are in one process: it is a function of the map and the radius alone. Processes
//! share what takes long of it, which of its corners see each other ([`find_links`]).

mod graph;
mod links;
mod outline;

use crate::planner::{Neighbor, Obstacle, PlanInput};
use graph::Graph;
use nalgebra::{Point2, Vector2, distance};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

/// Of the radius: how much room a way leaves beside obstacles.
const MARGIN: f64 = 0.03;
/// The same where that leaves no way, or one that is long.
const MARGIN_MIN: f64 = 0.002;
/// What is shorter than this share of a way is not as long as it.
const ROUND: f64 = 0.95;

pub use links::tell_links;

/// Finds what ways of discs of these radii (m) need of this map, once for all processes of a fleet: a block for [`tell_links`]. It
/// uses all processors, with 1024 pieces for some tenths of a second a radius.
pub fn find_links(map: &[Obstacle], radii_m: &[f64]) -> Vec<u8> {
    graph::find_links(
        map,
        radii_m.iter().flat_map(|radius_m| [MARGIN, MARGIN_MIN].map(|margin| radius_m * (1.0 + margin))),
    )
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

/// The way that is left from a corner.
#[derive(Clone, Copy)]
struct Left {
    /// Its length and its tolls, m.
    cost_m: f64,
    length_m: f64,
    /// The corner that comes next; none if it is the goal.
    next: Option<u32>,
}

/// The shortest ways to one goal.
#[derive(Clone)]
pub struct Way {
    graph: Arc<Graph>,
    goal: Point2<f64>,
    /// What a way keeps from obstacles at the goal, m.
    goal_keeps_m: f64,
    /// By corner.
    left: Vec<Left>,
    /// What an obstacle on the right costs, m.
    toll_m: f64,
    /// What the robot heads for: a corner, or the goal.
    heads_for: Option<Option<u32>>,
}

impl Way {
    /// Ways to a goal of a disc of this radius (m) past the obstacles of a map, where an obstacle on the right costs a toll (m).
    /// `from` (m) is where the first way begins: if it is a long way round, and one that passes obstacles more closely is not, that
    /// one counts.
    pub fn new(map: &[Obstacle], radius_m: f64, from: Point2<f64>, goal: Point2<f64>, toll_m: f64) -> Way {
        let mut usual = Way::with_margin(map, radius_m * (1.0 + MARGIN), goal, toll_m);
        let usual_m = usual.ahead(from).map_or(f64::INFINITY, |ahead| ahead.left_m);
        if usual_m * ROUND < distance(&from, &goal) {
            return usual;
        }
        let mut close = Way::with_margin(map, radius_m * (1.0 + MARGIN_MIN), goal, toll_m);
        let is_shorter = close.ahead(from).is_some_and(|ahead| ahead.left_m < ROUND * usual_m);
        if is_shorter { close } else { usual }
    }

    fn with_margin(map: &[Obstacle], keeps_m: f64, goal: Point2<f64>, toll_m: f64) -> Way {
        let graph = Graph::of(map, keeps_m);
        let nowhere = Left { cost_m: f64::INFINITY, length_m: f64::INFINITY, next: None };
        let left = vec![nowhere; graph.corners.len()];
        let mut way = Way { goal_keeps_m: graph.keeps(goal), graph, goal, left, toll_m, heads_for: None };
        way.search();
        way
    }

    /// Finds what is left from every corner, from the goal on.
    fn search(&mut self) {
        let graph = Arc::clone(&self.graph);
        // Costs are not negative, so that their bits sort as they do.
        let mut queue: BinaryHeap<Reverse<(u64, u32)>> = BinaryHeap::new();
        for (index, corner) in (0..).zip(&graph.corners) {
            let way = self.goal - corner.at;
            if corner.is_touched_by(way) && graph.sees(self.goal, corner.at, self.goal_keeps_m) {
                let cost_m = way.norm() + self.toll(corner.is_left_of(way));
                self.left[index as usize] = Left { cost_m, length_m: way.norm(), next: None };
                queue.push(Reverse((cost_m.to_bits(), index)));
            }
        }
        while let Some(Reverse((bits, index))) = queue.pop() {
            let Left { cost_m, length_m, next } = self.left[index as usize];
            if f64::from_bits(bits) > cost_m {
                continue;
            }
            let (at, next) = (&graph.corners[index as usize], self.place(next));
            for (other, link_m) in graph.links(index) {
                let from = &graph.corners[other as usize];
                let mut cost_m = cost_m + link_m;
                if self.toll_m > 0.0 {
                    // An obstacle is paid for once, where the way leaves it.
                    cost_m += self.toll(from.obstacle != at.obstacle && from.is_left_of(at.at - from.at));
                    cost_m += self.toll(at.is_turned_from(from.at, next));
                }
                if cost_m < self.left[other as usize].cost_m {
                    self.left[other as usize] = Left { cost_m, length_m: length_m + link_m, next: Some(index) };
                    queue.push(Reverse((cost_m.to_bits(), other)));
                }
            }
        }
    }

    /// The toll, if there is one to pay.
    fn toll(&self, is_due: bool) -> f64 {
        if is_due { self.toll_m } else { 0.0 }
    }

    /// What a robot heads for now: along the shortest way if it knows the map, else straight to its goal; `None` if there is
    /// no way. `way` is what it knows of the ways to its goal, and is made when the goal is a new one; an obstacle on the right costs
    /// a toll (m).
    pub fn follow(way: &mut Option<Way>, input: &PlanInput<'_>, toll_m: f64) -> Option<Ahead> {
        let (from, goal) = (input.position, input.goal);
        if input.map.is_empty() {
            return Some(Ahead { at: goal, is_goal: true, left_m: distance(&from, &goal) });
        }
        if way.as_ref().is_none_or(|way| way.goal != goal) {
            *way = Some(Way::new(input.map, input.radius_m, from, goal, toll_m));
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
            let known = way.get_or_insert_with(|| Way::new(&sketch.pieces, input.radius_m, from, goal, 0.0));
            if let Some(ahead) = known.ahead(from) {
                return ahead;
            }
            (*way, sketch.pieces) = (None, Vec::new());
        }
        Ahead { at: goal, is_goal: true, left_m: distance(&from, &goal) }
    }

    /// What a robot heads for that is here (m); `None` if no way leads to the goal.
    pub fn ahead(&mut self, at: Point2<f64>) -> Option<Ahead> {
        let (from, keeps_m) = self.graph.outlook(at);
        // What comes after that for which it headed may have come into sight; nothing else does in a tick, as a rule.
        if let Some(Some(index)) = self.heads_for {
            let next = self.left[index as usize].next;
            if self.sees(from, next, keeps_m) {
                self.heads_for = Some(next);
            }
        }
        if let Some(heads_for) = self.heads_for.filter(|heads_for| self.sees(from, *heads_for, keeps_m)) {
            return Some(self.to(at, heads_for));
        }
        self.heads_for = self.best(from, keeps_m);
        self.heads_for.map(|heads_for| self.to(at, heads_for))
    }

    /// Looks at all corners.
    fn best(&self, from: Point2<f64>, keeps_m: f64) -> Option<Option<u32>> {
        if self.sees(from, None, keeps_m) {
            return Some(None);
        }
        let mut best: Option<(f64, u32)> = None;
        for (index, (corner, left)) in self.graph.corners.iter().zip(&self.left).enumerate() {
            let turns = self.toll_m > 0.0 && corner.is_turned_from(from, self.place(left.next));
            let cost_m = distance(&from, &corner.at) + left.cost_m + self.toll(turns);
            let is_better = cost_m.is_finite() && best.is_none_or(|(least, _)| cost_m < least);
            if is_better && self.graph.sees(from, corner.at, keeps_m) {
                best = Some((cost_m, index as u32));
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
        let rest_m = heads_for.map_or(0.0, |index| self.left[index as usize].length_m);
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
