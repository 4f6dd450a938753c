//! How near the links of arms come to other bodies during a tick.
//!
//! Between two ticks the joints of an arm turn evenly, and its links sweep areas with round edges; everything else moves
//! straight. The distance of two bodies falls by no more than the way of their points, so the distances at the two ends
//! of a piece of the tick say how near they can come in between. Pieces that could hide something nearer than what is
//! known are halved until none is left that could hide more than [`SWEEP_M`].
//!
//! So a clearance is one that the bodies really had, at most [`SWEEP_M`] above the least; only a contact that begins and
//! ends within one tick and is less deep than that goes unseen. That two bodies which overlap when a tick opens come
//! apart and together again within it is not seen either: such a tick counts no contact.

use crate::arm::{self, Arm};
use crate::body::Body;
use crate::moving::Moving;
use crate::shapes::{Approach, Placed, Shapes};
use geometry::{Capsule, segment_distance};
use nalgebra::Vector2;

/// Clearances are the least to this, m.
const SWEEP_M: f64 = 1e-4;
/// A tick is halved at most so often: the bound for absurd speeds. Clearances are exact to 1/65536 of the way then.
const HALVINGS_MAX: u32 = 16;

/// What a body is made of.
pub(crate) struct Parts<'a>([Moving<'a>; 2], usize);

impl<'a> Parts<'a> {
    /// The disc of a robot, or the two links of an arm.
    pub(crate) fn of(body: &Body, arms: &'a [Arm]) -> Parts<'a> {
        match arm::of_slot(arms, body.instance.index.at()) {
            Some(arm) => Parts([0, 1].map(|link| Moving::Link { arm, link }), 2),
            None => {
                let at = |place| Capsule::disc(place, body.radius_m);
                Parts([Moving::Straight { from: at(body.from), to: at(body.pose.position) }; 2], 1)
            }
        }
    }

    /// Its parts.
    pub(crate) fn as_slice(&self) -> &[Moving<'a>] {
        &self.0[..self.1]
    }

    /// How near it comes to another body. What lies beyond `reach` is only told for the ends of the tick.
    pub(crate) fn approach(&self, other: &Parts<'_>, reach: f64) -> Approach {
        approaches(self.as_slice(), other.as_slice().iter().copied(), reach)
    }
}

/// How near an arm comes to an obstacle. How deep a polygon is entered is taken from the ends of the tick. What lies
/// beyond `reach` is only told for those ends.
pub(crate) fn approach_obstacle(arm: &Arm, shapes: &Shapes, obstacle: &Placed, reach: f64) -> Approach {
    let links = [0, 1].map(|link| Moving::Link { arm, link });
    let mut approach = approaches(&links, shapes.ways(obstacle), reach);
    let deep = |links: [Capsule; 2], offset: Vector2<f64>| {
        let inside = links.into_iter().filter(|link| obstacle.inside(link.a - offset));
        inside
            .map(|link| -shapes.edge_distance(obstacle, &link.moved(-offset)) - link.radius)
            .fold(f64::INFINITY, f64::min)
    };
    approach.at_first = approach.at_first.min(deep(arm.links_at(0.0), obstacle.offset_before));
    approach.least = approach.least.min(approach.at_first).min(deep(arm.links_at(1.0), obstacle.offset));
    approach
}

/// How near some parts come to some others. What lies beyond `reach` is only told for the ends of the tick.
pub(crate) fn approaches<'a>(parts: &[Moving<'_>], others: impl Iterator<Item = Moving<'a>>, reach: f64) -> Approach {
    let mut all = Approach { at_first: f64::INFINITY, least: f64::INFINITY };
    for other in others {
        for part in parts {
            // What is no nearer than what another pair of parts has come to does not matter.
            let found = approach(part, &other, reach.min(all.least));
            all.at_first = all.at_first.min(found.at_first);
            all.least = all.least.min(found.least);
        }
    }
    all
}

fn approach(a: &Moving<'_>, b: &Moving<'_>, reach: f64) -> Approach {
    let radii = a.radius_m() + b.radius_m();
    let gap = |instant: f64| {
        let (a, b) = (a.at(instant), b.at(instant));
        segment_distance(a.a, a.b, b.a, b.b) - radii
    };
    let (first, last) = (gap(0.0), gap(1.0));
    let mut search =
        Search { gap, travel_m: a.travel_m() + b.travel_m(), reach, deepest: -radii, least: first.min(last) };
    search.between([0.0, first], [1.0, last], HALVINGS_MAX);
    Approach { at_first: first, least: search.least }
}

/// The search for the least of a distance within a tick.
struct Search<F> {
    gap: F,
    /// The distance falls by no more than this in a whole tick, m.
    travel_m: f64,
    /// What is not nearer does not matter, m.
    reach: f64,
    /// No distance is less: cores that cross are at distance 0.
    deepest: f64,
    /// The least so far, m.
    least: f64,
}

impl<F: Fn(f64) -> f64> Search<F> {
    /// Looks between two instants with known distances.
    fn between(&mut self, [t0, gap0]: [f64; 2], [t1, gap1]: [f64; 2], halvings: u32) {
        let possible = 0.5 * (gap0 + gap1 - self.travel_m * (t1 - t0)).max(2.0 * self.deepest);
        if halvings == 0 || possible >= self.least.min(self.reach) - SWEEP_M {
            return;
        }
        let t = 0.5 * (t0 + t1);
        let gap = (self.gap)(t);
        self.least = self.least.min(gap);
        self.between([t0, gap0], [t, gap], halvings - 1);
        self.between([t, gap], [t1, gap1], halvings - 1);
    }
}
