//! What is near on a map, and what is in the way: questions that look at the neighbourhood alone.

use super::Map;
use super::format::{self, FAN, Parts};
use crate::shapes::{Capsule, segment_distance};
use nalgebra::Point2;
use std::ops::Range;

/// A part of the tree: parts of the file, and where its levels begin.
struct Tree<'a> {
    parts: Parts<'a>,
    levels: &'a [Range<usize>],
    walls: usize,
}

impl Tree<'_> {
    /// Goes to all walls of boxes that `enter` lets in, by index, until `see` says that it is enough. Whether it went to the end.
    fn visit(&self, enter: &mut impl FnMut(&[f64; 4]) -> bool, see: &mut impl FnMut(usize, &Capsule) -> bool) -> bool {
        match self.levels.len().checked_sub(1) {
            Some(top) => self.descend(top, 0, enter, see),
            None => true,
        }
    }

    fn descend(
        &self,
        level: usize,
        place: usize,
        enter: &mut impl FnMut(&[f64; 4]) -> bool,
        see: &mut impl FnMut(usize, &Capsule) -> bool,
    ) -> bool {
        if !enter(&format::bounds(self.parts.boxes, self.levels[level].start + place)) {
            return true;
        }
        let below = if level == 0 { self.walls } else { self.levels[level - 1].len() };
        let mut held = place * FAN..((place + 1) * FAN).min(below);
        match level.checked_sub(1) {
            None => held.all(|index| see(index, &format::wall(self.parts.walls, index))),
            Some(next) => held.all(|child| self.descend(next, child, enter, see)),
        }
    }

    /// Looks for the least of what `exact` says of walls, below `least`; `bound` is at most that for all walls of a box. Boxes
    /// that promise the least come first.
    fn search(
        &self,
        level: usize,
        place: usize,
        bound: &impl Fn(&[f64; 4]) -> f64,
        see: &mut impl FnMut(usize, &Capsule) -> f64,
        least: &mut f64,
    ) {
        let below = if level == 0 { self.walls } else { self.levels[level - 1].len() };
        let held = place * FAN..((place + 1) * FAN).min(below);
        let Some(next) = level.checked_sub(1) else {
            for index in held {
                *least = see(index, &format::wall(self.parts.walls, index)).min(*least);
            }
            return;
        };
        let (mut order, mut count) = ([(0.0, 0); FAN], 0);
        for child in held {
            let promise = bound(&format::bounds(self.parts.boxes, self.levels[next].start + child));
            if promise < *least {
                let mut at = count;
                while at > 0 && order[at - 1].0 > promise {
                    order[at] = order[at - 1];
                    at -= 1;
                }
                (order[at], count) = ((promise, child), count + 1);
            }
        }
        for (promise, child) in order.into_iter().take(count) {
            if promise < *least {
                self.search(next, child, bound, see, least);
            }
        }
    }

    fn least(&self, limit: f64, bound: impl Fn(&[f64; 4]) -> f64, mut see: impl FnMut(usize, &Capsule) -> f64) -> f64 {
        let mut least = limit;
        if let Some(top) = self.levels.len().checked_sub(1) {
            self.search(top, 0, &bound, &mut see, &mut least);
        }
        least
    }
}

impl Map {
    fn tree(&self) -> Tree<'_> {
        Tree { parts: self.parts(), levels: &self.0.levels, walls: self.len() }
    }

    /// From a point to the surface of the nearest wall, m; `limit_m` if none is nearer than that.
    pub fn distance(&self, p: Point2<f64>, limit_m: f64) -> f64 {
        self.tree().least(limit_m, |around| to_box([p, p], around), |_, wall| wall.distance(p))
    }

    /// From a straight line to the surface of the nearest wall, m; `limit_m` if none is nearer than that.
    pub fn distance_of_line(&self, [from, to]: [Point2<f64>; 2], limit_m: f64) -> f64 {
        let exact = |wall: &Capsule| segment_distance(from, to, wall.a, wall.b) - wall.radius;
        self.tree().least(limit_m, |around| to_box([from, to], around), |_, wall| exact(wall))
    }

    /// Whether a wall is nearer to a point than this, m.
    pub fn is_near(&self, p: Point2<f64>, distance_m: f64) -> bool {
        let near = |around: &[f64; 4]| to_box([p, p], around) < distance_m;
        !self.tree().visit(&mut |around| near(around), &mut |_, wall| wall.distance(p) >= distance_m)
    }

    /// Whether a disc that keeps this distance (m) from walls cannot go straight from one point to the other.
    pub fn blocks(&self, [from, to]: [Point2<f64>; 2], keeps_m: f64) -> bool {
        let mut enter = |around: &[f64; 4]| meets([from, to], around, keeps_m);
        let mut passes = |_: usize, wall: &Capsule| segment_distance(from, to, wall.a, wall.b) - wall.radius >= keeps_m;
        !self.tree().visit(&mut enter, &mut passes)
    }

    /// All walls that a rectangle touches, given its lowest and its highest corner, by index; and perhaps some beside it.
    pub fn each_in(&self, [low, high]: [Point2<f64>; 2], mut see: impl FnMut(usize, &Capsule)) {
        let touches = |a: &[f64; 4]| a[0] <= high.x && a[1] <= high.y && a[2] >= low.x && a[3] >= low.y;
        self.tree().visit(&mut |around| touches(around), &mut |index, wall| {
            see(index, wall);
            true
        });
    }

    /// The walls within this distance (m) of a point, surfaces that touch it included, sorted by index; of more than `most` the
    /// nearest, and of those that are as near the first. What was in `found` goes.
    pub fn nearest(&self, p: Point2<f64>, range_m: f64, most: usize, found: &mut Vec<(f64, u32)>) {
        found.clear();
        // Distances below the least number above the range are those in range.
        let limit = range_m.next_up();
        if most > 0 {
            self.tree().least(
                limit,
                |around| to_box([p, p], around),
                |index, wall| {
                    let new = (wall.distance(p), index as u32);
                    let worst =
                        |found: &Vec<(f64, u32)>| if found.len() < most { limit } else { found[most - 1].0.next_up() };
                    if new.0 < worst(found) {
                        let at = found.partition_point(|known| (known.0, known.1) < new);
                        found.insert(at, new);
                        found.truncate(most);
                    }
                    // Of the boxes that are as near as the worst of them, one may have an earlier wall.
                    worst(found)
                },
            );
        }
        found.sort_unstable_by_key(|(_, index)| *index);
    }

    /// Whether a point is where nothing can be: in what walls enclose, or outside of all where that is solid. On a wall it may
    /// be either.
    pub fn is_solid(&self, p: Point2<f64>) -> bool {
        // How often the walls go round it, counter-clockwise: those that a ray to the right crosses upwards, less the others.
        let mut rounds = i64::from(self.outside_is_solid());
        let crosses = |a: &[f64; 4]| a[1] <= p.y && a[3] >= p.y && a[2] >= p.x;
        self.tree().visit(&mut |around| crosses(around), &mut |_, wall| {
            let (a, b) = (wall.a, wall.b);
            if wall.radius == 0.0 && (a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x {
                // What is solid is on the left of a wall: on the way up it is where the point is.
                rounds += if b.y > a.y { 1 } else { -1 };
            }
            true
        });
        rounds > 0
    }
}

/// From the rectangle round two points to a box, m.
#[inline]
fn to_box([from, to]: [Point2<f64>; 2], around: &[f64; 4]) -> f64 {
    let apart = |from: f64, to: f64, low: f64, high: f64| (low - from.max(to)).max(from.min(to) - high).max(0.0);
    let x = apart(from.x, to.x, around[0], around[2]);
    let y = apart(from.y, to.y, around[1], around[3]);
    // The root is not rounded up: what is beyond the least is left out for sure.
    (x * x + y * y).sqrt() * (1.0 - 1e-12)
}

/// Whether a line comes to a box that is grown by a distance on all sides.
#[inline]
fn meets([from, to]: [Point2<f64>; 2], around: &[f64; 4], by: f64) -> bool {
    let (mut enters, mut leaves) = (0.0f64, 1.0f64);
    for (from, to, low, high) in [(from.x, to.x, around[0], around[2]), (from.y, to.y, around[1], around[3])] {
        // A little more, so that rounding leaves out nothing.
        let by = by + 1e-9 * (1.0 + from.abs() + to.abs());
        let (low, high, along) = (low - by, high + by, to - from);
        if along == 0.0 {
            if from < low || from > high {
                return false;
            }
            continue;
        }
        let (at_low, at_high) = ((low - from) / along, (high - from) / along);
        enters = enters.max(at_low.min(at_high));
        leaves = leaves.min(at_low.max(at_high));
    }
    // Division rounds as well.
    enters <= leaves + 1e-9
}
