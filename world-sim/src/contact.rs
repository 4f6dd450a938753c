//! Contacts and clearances, swept: between two ticks every centre moves straight and evenly (the chord of a unicycle's
//! arc), so the closest approach within a tick is exact and nothing passes through unseen. The links of arms turn; how
//! exact their sweeps are is said in `links`.
//!
//! A contact is one entry into overlap. A straight sweep cannot leave a convex body and come back within a tick, and
//! a tick starts where the last one ended, so "overlap now, none when the tick opened" counts every entry once, without
//! a memory of who overlaps whom. An arm is in contact with a robot or an obstacle when one of its links is; its links
//! may touch each other.

use crate::arm::{self, Arm};
use crate::body::Body;
use crate::grid::{Aabb, Grid};
use crate::links::{self, Parts};
use crate::moving::OVERLAP_M_MIN;
use crate::shapes::{Approach, Shapes};
use crate::walls::Walls;
use nalgebra::Vector2;

/// Who touched what.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Contact {
    /// Two robots, by slot.
    Robots(usize, usize),
    /// A robot and an obstacle, by slot and index.
    Obstacle(usize, usize),
    /// A robot and the walls of the map, by slot.
    Map(usize),
}

/// What has been counted so far.
pub(crate) struct Contacts {
    pub(crate) robots: u64,
    pub(crate) obstacles: u64,
    /// Smallest clearance between two robots so far, m.
    pub(crate) clearance_m: f64,
    /// Smallest clearance between a robot and an obstacle so far, m.
    pub(crate) obstacle_clearance_m: f64,
    /// By slot.
    pub(crate) per_robot: Vec<u64>,
    /// The contacts of the last call, sorted.
    pub(crate) found: Vec<Contact>,
}

impl Contacts {
    pub(crate) fn new() -> Contacts {
        Contacts {
            robots: 0,
            obstacles: 0,
            clearance_m: f64::INFINITY,
            obstacle_clearance_m: f64::INFINITY,
            per_robot: Vec::new(),
            found: Vec::new(),
        }
    }

    /// From here on another robot has this slot.
    pub(crate) fn forget(&mut self, slot: usize) {
        if let Some(contacts) = self.per_robot.get_mut(slot) {
            *contacts = 0;
        }
    }

    /// Bodies that are new to the world may stand in others.
    pub(crate) fn enter(
        &mut self,
        entered: &[usize],
        bodies: &[Body],
        arms: &[Arm],
        shapes: &Shapes,
        walls: Option<&Walls>,
    ) {
        self.found.clear();
        for &slot in entered {
            let body = &bodies[slot];
            let here = body.pose.position;
            let arm = arm::of_slot(arms, slot);
            for (other_slot, other) in bodies.iter().enumerate().filter(|(other, body)| *other != slot && body.in_world)
            {
                let gap = if body.is_arm() || other.is_arm() {
                    Parts::of(body, arms).approach(&Parts::of(other, arms), f64::NEG_INFINITY).at_first
                } else {
                    (other.pose.position - here).norm() - body.radius_m - other.radius_m
                };
                // Of two newcomers the later one finds the pair.
                if gap < -OVERLAP_M_MIN && !(other_slot > slot && entered.contains(&other_slot)) {
                    self.found.push(Contact::Robots(slot.min(other_slot), slot.max(other_slot)));
                }
            }
            for (index, obstacle) in shapes.obstacles.iter().enumerate() {
                let approach = match arm {
                    Some(arm) => Some(links::approach_obstacle(arm, shapes, obstacle, f64::NEG_INFINITY)),
                    None => shapes.approach(obstacle, [here, here], body.radius_m, 0.0),
                };
                if approach.is_some_and(|approach| approach.least < -OVERLAP_M_MIN) {
                    self.found.push(Contact::Obstacle(slot, index));
                }
            }
            if let Some(walls) = walls {
                let approach = match arm {
                    Some(arm) => walls.approach_of_arm(arm, 0.0),
                    None => walls.approach([here, here], body.radius_m, 0.0),
                };
                if approach.is_some_and(|approach| approach.least < -OVERLAP_M_MIN) || walls.is_solid(here) {
                    self.found.push(Contact::Map(slot));
                }
            }
        }
    }

    /// One tick. The grid holds the bodies where they were when it opened.
    ///
    /// The smallest clearance only falls, so only pairs that can come nearer than it (or into contact) matter. While
    /// there has been no pair it is infinite, and so is the reach.
    pub(crate) fn sweep(&mut self, bodies: &[Body], arms: &[Arm], shapes: &Shapes, walls: Option<&Walls>, grid: &Grid) {
        self.found.clear();
        let discs = || bodies.iter().filter(|body| body.in_world && !body.is_arm());
        let radius_max = discs().fold(0.0, |most: f64, body| most.max(body.radius_m));
        let driven_max = discs().fold(0.0, |most: f64, body| most.max(body.driven_m()));
        for body in discs() {
            let reach = body.radius_m + radius_max + self.clearance_m.max(0.0) + body.driven_m() + driven_max;
            grid.visit(Aabb::around([body.from]).grown(reach), |item| {
                let other = &bodies[item.robot.at()];
                if item.robot > body.instance.index && !other.is_arm() {
                    self.sweep_pair(body, other);
                }
            });
        }
        for (index, obstacle) in shapes.obstacles.iter().enumerate() {
            let reach = radius_max + self.obstacle_clearance_m.max(0.0) + driven_max + obstacle.driven_m();
            grid.visit(shapes.bounds(obstacle).grown(reach), |item| {
                let body = &bodies[item.robot.at()];
                if body.is_arm() {
                    return;
                }
                let reach = self.obstacle_clearance_m.max(0.0);
                let path = [body.from, body.pose.position];
                let Some(approach) = shapes.approach(obstacle, path, body.radius_m, reach) else { return };
                self.judge(Contact::Obstacle(item.robot.at(), index), approach);
            });
        }
        if let Some(walls) = walls {
            for body in discs() {
                let reach = self.obstacle_clearance_m.max(0.0);
                if let Some(approach) = walls.approach([body.from, body.pose.position], body.radius_m, reach) {
                    self.judge(Contact::Map(body.instance.index.at()), approach);
                }
            }
        }
        for (index, arm) in arms.iter().enumerate().filter(|(_, arm)| bodies[arm.slot].in_world) {
            let parts = Parts::of(&bodies[arm.slot], arms);
            let reach = arm.reach_m() + radius_max + self.clearance_m.max(0.0) + driven_max;
            grid.visit(Aabb::around([arm.base()]).grown(reach), |item| {
                let other = &bodies[item.robot.at()];
                if !other.is_arm() {
                    self.sweep_parts(arm.slot, &parts, other, arms);
                }
            });
            for other in arms[index + 1..].iter().filter(|other| bodies[other.slot].in_world) {
                let near = arm.reach_m() + other.reach_m() + self.clearance_m.max(0.0);
                if (other.base() - arm.base()).norm_squared() <= near * near {
                    self.sweep_parts(arm.slot, &parts, &bodies[other.slot], arms);
                }
            }
            for (index, obstacle) in shapes.obstacles.iter().enumerate() {
                let reach = self.obstacle_clearance_m.max(0.0);
                let near = arm.reach_m() + reach + obstacle.driven_m();
                if shapes.bounds(obstacle).grown(near).contains(arm.base()) {
                    let approach = links::approach_obstacle(arm, shapes, obstacle, reach);
                    self.judge(Contact::Obstacle(arm.slot, index), approach);
                }
            }
            if let Some(walls) = walls
                && let Some(approach) = walls.approach_of_arm(arm, self.obstacle_clearance_m.max(0.0))
            {
                self.judge(Contact::Map(arm.slot), approach);
            }
        }
    }

    /// An arm and another robot.
    fn sweep_parts(&mut self, slot: usize, parts: &Parts<'_>, other: &Body, arms: &[Arm]) {
        let other_slot = other.instance.index.at();
        let approach = parts.approach(&Parts::of(other, arms), self.clearance_m.max(0.0));
        self.judge(Contact::Robots(slot.min(other_slot), slot.max(other_slot)), approach);
    }

    /// How near two bodies came, and whether they began to overlap.
    fn judge(&mut self, contact: Contact, approach: Approach) {
        let least = match contact {
            Contact::Robots(..) => &mut self.clearance_m,
            Contact::Obstacle(..) | Contact::Map(_) => &mut self.obstacle_clearance_m,
        };
        *least = least.min(approach.least);
        if approach.least < -OVERLAP_M_MIN && approach.at_first >= -OVERLAP_M_MIN {
            self.found.push(contact);
        }
    }

    fn sweep_pair(&mut self, a: &Body, b: &Body) {
        let radii = a.radius_m + b.radius_m;
        let (before, after) = (b.from - a.from, b.pose.position - a.pose.position);
        let near = radii + self.clearance_m.max(0.0) + (after - before).norm();
        if before.norm_squared() > near * near {
            return;
        }
        let approach = Approach { at_first: before.norm() - radii, least: swept(before, after) - radii };
        self.judge(Contact::Robots(a.instance.index.at(), b.instance.index.at()), approach);
    }

    /// What has been found counts.
    pub(crate) fn count(&mut self) {
        self.found.sort_unstable();
        for contact in &self.found {
            let (slot, other) = match *contact {
                Contact::Robots(a, b) => (a, Some(b)),
                Contact::Obstacle(slot, _) | Contact::Map(slot) => (slot, None),
            };
            *(if other.is_some() { &mut self.robots } else { &mut self.obstacles }) += 1;
            for slot in [Some(slot), other].into_iter().flatten() {
                if self.per_robot.len() <= slot {
                    self.per_robot.resize(slot + 1, 0);
                }
                self.per_robot[slot] += 1;
            }
        }
    }
}

/// Smallest distance from the origin on the way from `before` to `after`. At the ends it is their exact norm, so that
/// a tick ends with the very number that the next one starts with.
fn swept(before: Vector2<f64>, after: Vector2<f64>) -> f64 {
    let way = after - before;
    let t = -before.dot(&way) / way.norm_squared();
    if t > 0.0 && t < 1.0 {
        (before + way * t).norm().min(before.norm()).min(after.norm())
    } else {
        before.norm().min(after.norm())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn no_instant_of_a_tick_is_nearer_than_the_sweep(
            before in (-3.0..3.0f64, -3.0..3.0f64), after in (-3.0..3.0f64, -3.0..3.0f64)
        ) {
            let (before, after) = (Vector2::new(before.0, before.1), Vector2::new(after.0, after.1));
            let least = swept(before, after);
            let steps = 1000;
            let at = |i: u32| before.lerp(&after, f64::from(i) / f64::from(steps)).norm();
            let sampled = (0..=steps).map(at).fold(f64::INFINITY, f64::min);
            prop_assert!(least <= sampled + 1e-12);
            // Between two samples lies at most half a step.
            prop_assert!(least >= sampled - (after - before).norm() / f64::from(steps));
        }
    }

    #[test]
    fn a_rest_is_swept_too() {
        let v = Vector2::new(3.0, 4.0);
        assert_eq!(swept(v, v), 5.0);
        assert_eq!(swept(v, -v), 0.0);
    }
}
