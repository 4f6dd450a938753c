//! The corners of grown obstacles.

use crate::planner::Obstacle;
use geometry::{Capsule, wrap};
use nalgebra::{Point2, Vector2};
use std::f64::consts::{FRAC_PI_4, PI, TAU};

/// Sine of an angle below which a line counts as touching.
const TOUCHES: f64 = 1e-9;

/// How often a part of an arc is halved whose corner is not free: the last parts are an eighth of the first.
const HALVINGS: u32 = 3;

/// A corner of an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Corner {
    /// m.
    pub(super) at: Point2<f64>,
    /// Which obstacle it is a corner of.
    pub(super) obstacle: u32,
    /// Directions in which the outline goes on, back and ahead.
    sides: [Vector2<f64>; 2],
}

impl Corner {
    /// Whether a line in this direction through the corner has the obstacle on one side of it.
    pub(super) fn is_touched_by(&self, line: Vector2<f64>) -> bool {
        let slack = TOUCHES * line.norm();
        let [back, ahead] = self.sides.map(|side| line.perp(&side));
        back <= slack && ahead <= slack || back >= -slack && ahead >= -slack
    }

    /// Whether such a line has the obstacle on its right.
    pub(super) fn is_left_of(&self, line: Vector2<f64>) -> bool {
        self.sides.iter().map(|side| line.perp(side)).sum::<f64>() < 0.0
    }

    /// Whether a way that comes from one place and goes on to the next turns away from the obstacle here, as no shortest way does.
    pub(super) fn is_turned_from(&self, from: Point2<f64>, next: Point2<f64>) -> bool {
        let (into, on) = (self.at - from, next - self.at);
        let (turn, slack) = (into.perp(&on), TOUCHES * into.norm() * on.norm());
        if self.is_left_of(on) { turn > slack } else { turn < -slack }
    }
}

/// The convex corners of all obstacles that are grown by a distance, m. Where a corner of a round outline is not free, as in a
/// narrow gap, finer ones take its place.
pub(super) fn corners(map: &[Obstacle], by_m: f64, is_free: &dyn Fn(Point2<f64>) -> bool) -> Vec<Corner> {
    let mut found = Found { corners: Vec::new(), obstacle: 0, is_free };
    for pieces in map.chunk_by(|a, b| a.id == b.id) {
        found.obstacle = pieces[0].id;
        match polygon(pieces) {
            Some(points) => around_polygon(&points, by_m, &mut found),
            None => pieces.iter().for_each(|piece| around_capsule(&piece.shape, by_m, &mut found)),
        }
    }
    found.corners
}

/// The corners of a polygon, counter-clockwise, if these pieces are its edges in order.
fn polygon(pieces: &[Obstacle]) -> Option<Vec<Point2<f64>>> {
    let next = pieces.iter().cycle().skip(1);
    let is_chain =
        pieces.len() > 2 && pieces.iter().zip(next).all(|(a, b)| a.shape.b == b.shape.a && a.shape.radius == 0.0);
    is_chain.then(|| {
        let mut points: Vec<Point2<f64>> = pieces.iter().map(|piece| piece.shape.a).collect();
        let area: f64 = pieces.iter().map(|piece| piece.shape.a.coords.perp(&piece.shape.b.coords)).sum();
        if area < 0.0 {
            points.reverse();
        }
        points
    })
}

fn around_polygon(points: &[Point2<f64>], by_m: f64, found: &mut Found<'_>) {
    let count = points.len();
    for (index, at) in points.iter().enumerate() {
        let (back, ahead) = (at - points[(index + count - 1) % count], points[(index + 1) % count] - at);
        let [from, to] = [back, ahead].map(|edge| edge.y.atan2(edge.x) - 0.5 * PI);
        let turn = wrap(to - from);
        if turn > 0.0 {
            around(*at, by_m, from, turn, found);
        }
    }
}

/// A disc, or a wall with round ends.
fn around_capsule(capsule: &Capsule, by_m: f64, found: &mut Found<'_>) {
    let along = capsule.b - capsule.a;
    let by_m = by_m + capsule.radius;
    if along.norm() == 0.0 {
        return around(capsule.a, by_m, 0.0, TAU, found);
    }
    let side = along.y.atan2(along.x) - 0.5 * PI;
    around(capsule.b, by_m, side, PI, found);
    around(capsule.a, by_m, side + PI, PI, found);
}

/// The arc around a point from the angle `from` (rad) on, counter-clockwise by `turn`, as straight pieces that touch it: their
/// corners lie in the middle between the angles at which they touch.
fn around(center: Point2<f64>, by_m: f64, from: f64, turn: f64, found: &mut Found<'_>) {
    // Rounding does not make a third piece of a right angle.
    let pieces = (turn / FRAC_PI_4 - 1e-9).ceil().max(1.0);
    let step = turn / pieces;
    for piece in 0..pieces as u32 {
        found.add(center, by_m, from + f64::from(piece) * step, step, HALVINGS);
    }
}

/// The corners found so far, the obstacle whose corners come next, and what tells whether a place is free.
struct Found<'a> {
    corners: Vec<Corner>,
    obstacle: u32,
    is_free: &'a dyn Fn(Point2<f64>) -> bool,
}

impl Found<'_> {
    /// The corner in the middle of this part of an arc, if it is free; else those of its halves, as often as this.
    fn add(&mut self, center: Point2<f64>, by_m: f64, touched: f64, step: f64, halvings: u32) {
        let direction = |angle: f64| Vector2::new(angle.cos(), angle.sin());
        let at = center + direction(touched + 0.5 * step) * (by_m / (0.5 * step).cos());
        if (self.is_free)(at) {
            // The outline touches the arc before and after the corner, at a right angle to the radius.
            let (back, ahead) = (direction(touched - 0.5 * PI), direction(touched + step + 0.5 * PI));
            self.corners.push(Corner { at, obstacle: self.obstacle, sides: [back, ahead] });
        } else if halvings > 0 {
            for half in [0.0, 0.5] {
                self.add(center, by_m, touched + half * step, 0.5 * step, halvings - 1);
            }
        }
    }
}
