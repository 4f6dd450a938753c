//! The common right-hand turn: the smallest after which no robot that is heard is on a course of contact.

use super::{KEEPS_BESIDE, Lanes, Other, SAME_WAY, SLOW, Said, Wall, cosine};
use crate::planner::{Intent, PlanInput};
use nalgebra::{Point2, Vector2};
use std::f64::consts::{FRAC_PI_2, PI};

/// Those who go the same way are beside each other if they are nearer than this, in radii, their wishes have at least this cosine, and
/// the sine of the direction to the other is at least this.
const BESIDE_WITHIN: f64 = 2.0;
const BESIDE_SAME_WAY: f64 = 0.7;
const BESIDE: f64 = 0.3;
/// Obstacles on the right-hand side that are nearer than this, in radii, are near: who turns right has no room for it there.
const NEAR_WALL: f64 = 3.0;
/// Obstacles nearer than this, in radii, have a say in the common turn.
const AT_WALL: f64 = 1.0;
/// Of the distance between two surfaces: how much of it is kept at most where there is room, and near obstacles.
const KEEPS_OPEN: f64 = 0.9;
const KEEPS_NEAR_WALL: f64 = 0.3;
/// Greatest turn of a robot that has lost all of its speed, and near obstacles; and what is turned where even that is too
/// little, rad.
const TURN_MOST: f64 = 100.0 * PI / 180.0;
const TURN_NEAR_WALL: f64 = 80.0 * PI / 180.0;
const TURN_LEAST: f64 = 32.0 * PI / 180.0;

/// A robot on its way, as the common turn sees it.
#[derive(Clone, Copy, Debug)]
struct Course {
    at: Point2<f64>,
    radius_m: f64,
    wish: Vector2<f64>,
    left_m: f64,
    corner: Option<Point2<f64>>,
}

/// How far the common turn keeps away from others.
#[derive(Clone, Copy, Debug)]
struct Keeps {
    speed_mps: f64,
    /// The way of a tick at that speed, m.
    tick_m: f64,
    /// Of the distance between two surfaces: how much of it is kept at most.
    share: f64,
}

impl Lanes {
    /// The turn to the right, rad.
    pub(super) fn common_turn(
        &mut self,
        input: &PlanInput<'_>,
        wish: Vector2<f64>,
        left_m: f64,
        corner: Option<Point2<f64>>,
    ) -> f64 {
        let (speed_mps, radius_m) = (input.limits.speed_mps_max, input.radius_m);
        let is_right = |wall: &Wall| wish.perp(&wall.offset) <= 0.0;
        let near_wall = self.walls.iter().any(|wall| wall.gap_m < NEAR_WALL * radius_m && is_right(wall));
        let share = if near_wall { KEEPS_NEAR_WALL } else { KEEPS_OPEN };
        let keeps = Keeps { speed_mps, tick_m: speed_mps * input.dt_s, share };
        let me = Course { at: input.position, radius_m, wish, left_m, corner };
        let beside = self.turn_of_those_beside(&me, &keeps);
        self.blocked.clear();
        self.block(&me, None, &keeps);
        for wall in self.walls.iter().filter(|wall| wall.gap_m < (AT_WALL * radius_m).min(left_m)) {
            self.blocked.push(blocked(
                wish - wall.velocity,
                wall.offset,
                wall.offset.norm() - wall.gap_m.max(0.0),
                false,
            ));
        }
        let slow = self.slow.clamp(0.0, 1.0);
        let most = self.params.turn_max_deg.to_radians();
        let cap = if near_wall { TURN_NEAR_WALL } else { most + slow * (TURN_MOST - most).max(0.0) };
        let (right, only_parked) = self.end_of_blocked(1.0, 0.0);
        let beside = beside.min(cap);
        if beside > right {
            let (end, _) = self.end_of_blocked(1.0, beside);
            if end <= cap {
                return end;
            }
        }
        if right == 0.0 {
            return 0.0;
        }
        let (left, _) = self.end_of_blocked(-1.0, 0.0);
        if only_parked && left < right && left <= cap {
            return -left;
        }
        if right <= cap {
            right
        } else if near_wall {
            0.0
        } else {
            TURN_LEAST + slow * (cap - TURN_LEAST).max(0.0)
        }
    }

    /// The greatest turn to the right that one needs who is close to its left and goes the same way, rad.
    fn turn_of_those_beside(&mut self, me: &Course, keeps: &Keeps) -> f64 {
        let mut most = 0.0f64;
        for index in 0..self.others.len() {
            let Other { at, radius_m, tells, said } = self.others[index];
            let Intent { wish, left_m, corner, .. } = said.intent;
            let offset = at - me.at;
            let (distance_m, wishes) = (offset.norm(), me.wish.norm());
            let is_beside = tells
                && !said.arrived
                && distance_m - me.radius_m - radius_m <= BESIDE_WITHIN * me.radius_m
                && me.wish.perp(&offset) >= BESIDE * wishes * distance_m
                && cosine(me.wish, wish) >= BESIDE_SAME_WAY;
            if !is_beside {
                continue;
            }
            self.blocked.clear();
            self.block(&Course { at, radius_m, wish, left_m, corner }, Some(index), keeps);
            let (turn, _) = self.end_of_blocked(1.0, 0.0);
            if turn < self.params.turn_max_deg.to_radians() {
                most = most.max(turn);
            }
        }
        most
    }

    /// Notes the turns that are blocked for a robot on this course, by all that are heard but `itself`.
    fn block(&mut self, course: &Course, itself: Option<usize>, keeps: &Keeps) {
        for (_, other) in self.others.iter().enumerate().filter(|(index, _)| Some(*index) != itself) {
            let Said { arrived, intent, .. } = other.said;
            let relative = course.wish - intent.wish;
            let offset = other.at - course.at;
            let (distance_m, closes) = (offset.norm(), relative.norm());
            let reach_m = course.radius_m + other.radius_m;
            if closes < SLOW * keeps.speed_mps || distance_m <= 0.0 {
                continue;
            }
            let same = cosine(course.wish, intent.wish);
            if let (Some(mine), Some(theirs)) = (course.corner, intent.corner)
                && same > SAME_WAY
                && (mine - theirs).norm() < reach_m
            {
                continue;
            }
            let contact_s = (distance_m - reach_m) / closes;
            let theirs_s =
                if arrived { f64::INFINITY } else { intent.left_m / intent.wish.norm().max(SLOW * keeps.speed_mps) };
            if contact_s > course.left_m / keeps.speed_mps || contact_s > theirs_s {
                continue;
            }
            let kept_m = (KEEPS_BESIDE * reach_m + keeps.tick_m * same.max(0.0))
                .min(reach_m + keeps.share * (distance_m - reach_m).max(0.0));
            self.blocked.push(blocked(relative, offset, kept_m, arrived));
        }
    }

    /// How far to turn to this side (right: 1), and at least `from`, until no more of what is blocked is in the way, rad; and whether all
    /// that is in the way stands at its goal.
    fn end_of_blocked(&self, side: f64, from: f64) -> (f64, bool) {
        const SLACK: f64 = 1e-6;
        let (mut turn, mut only_parked) = (from, true);
        loop {
            let mut grew = false;
            for (middle, half, parked) in &self.blocked {
                let (low, high) = (side * middle - half, side * middle + half);
                if low < turn + SLACK && high > turn + SLACK {
                    (turn, grew) = (high, true);
                    only_parked &= parked;
                }
            }
            if !grew || turn > PI {
                return (turn, only_parked);
            }
        }
    }
}

/// Turns to the right, as middle and half width, rad, after which the relative wish still comes within `kept_m` of the other.
fn blocked(relative: Vector2<f64>, offset: Vector2<f64>, kept_m: f64, parked: bool) -> (f64, f64, bool) {
    let middle = offset.perp(&relative).atan2(offset.dot(&relative));
    let sine = kept_m / offset.norm();
    (middle, if sine < 1.0 { sine.asin() } else { FRAC_PI_2 }, parked)
}
