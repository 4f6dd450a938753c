//! The walls of the map, as bodies come near them. What a body costs is its neighbourhood.
//!
//! A contact with the map is an entry into overlap with any of its walls, and all of them are one partner: one that slides from
//! one wall along the next has one contact. What walls enclose is solid, so who has come in through one of them and leaves
//! through another has one contact as well.

use crate::arm::Arm;
use crate::links;
use crate::moving::{Moving, OVERLAP_M_MIN};
use crate::shapes::Approach;
use geometry::{Capsule, Map};
use nalgebra::{Point2, Vector2};

/// The walls of the map.
#[derive(Clone, Debug)]
pub(crate) struct Walls(pub(crate) Map);

impl Walls {
    /// How near a disc comes that goes straight on during the tick, from one place to another; `None` if it comes no nearer than
    /// `reach`. How deep it is inside of what is solid is not told: at most its radius.
    pub(crate) fn approach(&self, [from, to]: [Point2<f64>; 2], radius_m: f64, reach: f64) -> Option<Approach> {
        let path_m = (to - from).norm();
        // The way is at most `path_m` nearer than its beginning.
        let limit_m = radius_m + reach + path_m;
        let here = self.0.distance(from, limit_m);
        if here >= limit_m && here.is_finite() || here.is_infinite() {
            return None;
        }
        let least = if path_m > 0.0 { self.0.distance_of_line([from, to], here) } else { here };
        let approach = Approach { at_first: here - radius_m, least: least.min(here) - radius_m };
        (approach.least <= reach).then(|| self.entered(approach, from))
    }

    /// The same of the links of an arm; `None` also if no wall is near.
    pub(crate) fn approach_of_arm(&self, arm: &Arm, reach: f64) -> Option<Approach> {
        let links = [0, 1].map(|link| Moving::Link { arm, link });
        // No wall that is further than the nearest one now can matter.
        let now = arm.links_at(0.0);
        let nearest = now.map(|link| self.0.distance_of_line([link.a, link.b], f64::INFINITY) - link.radius);
        let travel_m = links.iter().map(Moving::travel_m).fold(0.0, f64::max);
        let near = nearest[0].min(nearest[1]).min(reach.max(0.0)) + travel_m + now[0].radius;
        if !near.is_finite() {
            return None;
        }
        let mut walls = Vec::new();
        for link in now {
            self.0.each_in(around(&[link.a, link.b], near), |_, wall| walls.push(standing(wall)));
        }
        let approach = links::approaches(&links, walls.into_iter(), reach);
        (approach.least <= reach).then(|| self.entered(approach, now[0].a))
    }

    /// The walls that a disc can have touched on its way through the tick, for the place of the touch.
    pub(crate) fn on_way(&self, parts: &[Moving<'_>]) -> Vec<Moving<'static>> {
        let mut walls = Vec::new();
        for part in parts {
            let (first, last) = (part.at(0.0), part.at(1.0));
            let by = part.radius_m() + part.travel_m();
            self.0.each_in(around(&[first.a, first.b, last.a, last.b], by), |_, wall| walls.push(standing(wall)));
        }
        walls
    }

    /// Whether a place is inside of what is solid.
    pub(crate) fn is_solid(&self, p: Point2<f64>) -> bool {
        self.0.is_solid(p)
    }

    /// A body that was inside of what is solid when the tick opened did not enter it now. Looked at only where it seems so, which
    /// is seldom.
    fn entered(&self, approach: Approach, from: Point2<f64>) -> Approach {
        let seems_so = approach.least < -OVERLAP_M_MIN && approach.at_first >= -OVERLAP_M_MIN;
        if seems_so && self.is_solid(from) {
            return Approach { at_first: approach.least, ..approach };
        }
        approach
    }
}

/// The rectangle round points, grown by a distance: its lowest and highest corner.
fn around(points: &[Point2<f64>], by_m: f64) -> [Point2<f64>; 2] {
    let grown = Vector2::repeat(by_m);
    let low = points.iter().fold(points[0], |low, p| low.inf(p));
    let high = points.iter().fold(points[0], |high, p| high.sup(p));
    [low - grown, high + grown]
}

fn standing(wall: &Capsule) -> Moving<'static> {
    Moving::Straight { from: *wall, to: *wall }
}
