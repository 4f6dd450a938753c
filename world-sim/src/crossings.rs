//! Right of way: whose ways cross, and who lets whom go first.
//!
//! Two robots cross when both drive, their directions differ by 30 to 150 degrees, each is ahead of the other, and within
//! [`HORIZON_S`] they would come nearer than [`NEAR`] times where they touch if both kept their velocities. Who has the other one on its right hand gives way: it passes
//! behind, as ships and cars do. In the frame of the other one, which keeps its way, the one that gives way begins ahead on
//! the left. If it leaves that quadrant across the course ahead, it has taken the right of way; if it falls behind, it has
//! given it. A pair that does neither within [`LIMIT_S`] (one of them arrives, leaves, or both wait) is not counted.
//!
//! The rule is for the measure alone. No planner has to know it, and a planner with another rule that is kept by all may
//! well take every right of way without a contact.

use crate::body::Body;
use nalgebra::{Point2, Vector2};
use protocol::world_to_robot::NeighborRef;
use serde::{Deserialize, Serialize};

/// Who comes near later than this does not cross yet, s.
const HORIZON_S: f64 = 5.0;
/// How near, in sums of their radii. Planners that look ahead are seldom on a course on which they would touch.
const NEAR: f64 = 2.0;
/// A crossing has an end by then, s.
const LIMIT_S: f64 = 30.0;
/// How often it is looked at, s.
const EVERY_S: f64 = 0.1;
/// Who is slower than this share of its greatest speed does not drive.
const DRIVES: f64 = 0.1;
/// Sine of the least angle between two directions that cross.
const SINE_MIN: f64 = 0.5;

/// The crossings of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Crossings {
    open: Vec<Crossing>,
    /// Crossings that came to an end: one of the two went first.
    pub(crate) passed: u64,
    /// How often the first was the one that should have given way.
    pub(crate) violations: u64,
}

/// Two slots whose ways cross.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Crossing {
    gives: usize,
    keeps: usize,
    /// Where the one that keeps its way went when this began, of length 1.
    course: Vector2<f64>,
    /// It is given up in this tick.
    until: u64,
}

/// A disc on its way.
#[derive(Clone, Copy)]
struct Way {
    at: Point2<f64>,
    velocity: Vector2<f64>,
    radius_m: f64,
}

impl Way {
    /// Of a body in the tick that was closed last, if it drives.
    fn of(body: &Body, dt_s: f64) -> Option<Way> {
        let velocity = (body.pose.position - body.from) / dt_s;
        let drives = body.takes_part && !body.is_arm() && velocity.norm() > DRIVES * body.limits.speed_mps_max;
        drives.then_some(Way { at: body.pose.position, velocity, radius_m: body.radius_m })
    }

    /// Whether it has to give way to the other one, because the two cross and the other one comes from the right.
    fn gives_way_to(&self, other: &Way) -> bool {
        let to_other = other.at - self.at;
        let sine = self.velocity.perp(&other.velocity) / (self.velocity.norm() * other.velocity.norm());
        let both_ahead = self.velocity.dot(&to_other) > 0.0 && other.velocity.dot(&to_other) < 0.0;
        sine >= SINE_MIN && both_ahead && self.comes_near(other)
    }

    fn comes_near(&self, other: &Way) -> bool {
        let (apart, closing) = (other.at - self.at, other.velocity - self.velocity);
        let nearest_s = -apart.dot(&closing) / closing.norm_squared();
        let apart_m = (apart + closing * nearest_s).norm();
        (0.0..=HORIZON_S).contains(&nearest_s) && apart_m < NEAR * (self.radius_m + other.radius_m)
    }
}

impl Crossings {
    /// Looks at the tick that was closed, `heard` by slot: only robots in radio range of each other are looked at.
    pub(crate) fn look(&mut self, tick: u64, dt_s: f64, bodies: &[Body], heard: &[Vec<NeighborRef>]) {
        let every = (EVERY_S / dt_s).round().max(1.0) as u64;
        if !tick.is_multiple_of(every) {
            return;
        }
        let (mut passed, mut violations) = (0, 0);
        self.open.retain(|crossing| {
            let [gives, keeps] = [crossing.gives, crossing.keeps].map(|slot| &bodies[slot]);
            let from_keeper = gives.pose.position - keeps.pose.position;
            let took_way = crossing.course.perp(&from_keeper) <= 0.0;
            let is_over = took_way || crossing.course.dot(&from_keeper) < 0.0;
            let counts = is_over && gives.takes_part && keeps.takes_part;
            passed += u64::from(counts);
            violations += u64::from(counts && took_way);
            !is_over && gives.takes_part && keeps.takes_part && tick < crossing.until
        });
        self.passed += passed;
        self.violations += violations;
        for (slot, others) in heard.iter().enumerate() {
            let Some(own) = bodies.get(slot).and_then(|body| Way::of(body, dt_s)) else { continue };
            for other in others.iter().map(|other| other.index as usize).filter(|other| *other < bodies.len()) {
                let Some(theirs) = Way::of(&bodies[other], dt_s) else { continue };
                let (gives, keeps, course) = if own.gives_way_to(&theirs) {
                    (slot, other, theirs.velocity)
                } else if theirs.gives_way_to(&own) {
                    (other, slot, own.velocity)
                } else {
                    continue;
                };
                // Both hear each other, as a rule.
                if !self.open.iter().any(|known| (known.gives, known.keeps) == (gives, keeps)) {
                    let until = tick + (LIMIT_S / dt_s) as u64;
                    self.open.push(Crossing { gives, keeps, course: course.normalize(), until });
                }
            }
        }
    }

    /// Another robot has this slot now.
    pub(crate) fn forget(&mut self, slot: usize) {
        self.open.retain(|crossing| crossing.gives != slot && crossing.keeps != slot);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::testing::disc_at;

    const DT_S: f64 = 0.1;

    /// Drives discs at constant velocities, each from a place, and counts: crossings that ended, and violations.
    fn drive(ways: &[([f64; 2], [f64; 2])], time_s: f64) -> (u64, u64) {
        let mut crossings = Crossings::default();
        let hears = |slot: usize| (0..ways.len()).filter(move |other| *other != slot);
        let refer = |other: usize| NeighborRef { index: other as u32, ..NeighborRef::default() };
        let heard: Vec<Vec<NeighborRef>> = (0..ways.len()).map(|slot| hears(slot).map(refer).collect()).collect();
        for tick in 0..(time_s / DT_S) as u64 {
            let body = |(slot, (start, velocity)): (usize, &([f64; 2], [f64; 2]))| {
                let at = |tick: f64| Point2::from(*start) + Vector2::from(*velocity) * tick * DT_S;
                let mut body = disc_at(slot, at(tick as f64 + 1.0), 0.3);
                body.from = at(tick as f64);
                body
            };
            let bodies: Vec<Body> = ways.iter().enumerate().map(body).collect();
            crossings.look(tick, DT_S, &bodies, &heard);
        }
        assert!(crossings.open.len() < ways.len());
        (crossings.passed, crossings.violations)
    }

    /// One drives to the east through the origin, one to the north; each is early by this, m.
    fn cross(east_m: f64, north_m: f64) -> (u64, u64) {
        drive(&[([-4.0 + east_m, 0.0], [1.0, 0.0]), ([0.0, -4.0 + north_m], [0.0, 1.0])], 10.0)
    }

    #[test]
    fn who_comes_from_the_right_goes_first() {
        // The one to the east has the one to the north on its right hand.
        assert_eq!(cross(0.0, 0.2), (1, 0));
        assert_eq!(cross(0.2, 0.0), (1, 1));
        // They do not come near each other.
        assert_eq!((cross(0.0, 2.0), cross(2.0, 0.0)), ((0, 0), (0, 0)));
    }

    #[test]
    fn only_ways_that_cross_are_counted() {
        // Head on, behind each other, from behind at a sharp angle.
        assert_eq!(drive(&[([-4.0, 0.0], [1.0, 0.0]), ([4.0, 0.1], [-1.0, 0.0])], 10.0), (0, 0));
        assert_eq!(drive(&[([-4.0, 0.0], [1.0, 0.0]), ([-2.0, 0.0], [0.5, 0.0])], 10.0), (0, 0));
        assert_eq!(drive(&[([-4.0, 0.0], [1.0, 0.0]), ([-2.0, -0.5], [0.5, 0.125])], 10.0), (0, 0));
        // One stands in the way.
        assert_eq!(drive(&[([-4.0, 0.0], [1.0, 0.0]), ([0.0, 0.0], [0.0, 0.0])], 10.0), (0, 0));
    }

    #[test]
    fn each_pair_counts_once_for_each_time_that_it_crosses() {
        // Three to the north one after the other, each early enough for one to the east that comes with it.
        let ways: Vec<_> = (0..3)
            .flat_map(|row| {
                let far = f64::from(row) * 100.0;
                [([-4.0 + far, 0.1], [1.0, 0.0]), ([far, -4.0], [0.0, 1.0])]
            })
            .collect();
        assert_eq!(drive(&ways, 10.0).0, 3);
    }

    #[test]
    fn a_slot_that_another_robot_has_now_does_not_cross() {
        let mut crossings = Crossings::default();
        let course = Vector2::x();
        crossings.open =
            vec![Crossing { gives: 1, keeps: 2, course, until: 9 }, Crossing { gives: 3, keeps: 0, course, until: 9 }];
        crossings.forget(2);
        assert_eq!(crossings.open.len(), 1);
    }
}
