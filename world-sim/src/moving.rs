//! Capsules on their way through a tick.

use crate::arm::Arm;
use geometry::Capsule;

/// Bodies count as overlapping when they overlap by more than this, m: robots that are placed or come to rest exactly
/// at each other's surface must not be in contact by rounding.
pub(crate) const OVERLAP_M_MIN: f64 = 1e-9;

/// A capsule on its way through a tick.
#[derive(Clone, Copy)]
pub(crate) enum Moving<'a> {
    /// Straight and evenly, without turning.
    Straight { from: Capsule, to: Capsule },
    /// A link of an arm.
    Link { arm: &'a Arm, link: usize },
}

impl Moving<'_> {
    pub(crate) fn at(&self, instant: f64) -> Capsule {
        match *self {
            Moving::Straight { to, .. } if instant == 1.0 => to,
            Moving::Straight { from, to } => from.moved((to.a - from.a) * instant),
            Moving::Link { arm, link } => arm.links_at(instant)[link],
        }
    }

    /// No point of it goes further, m.
    pub(crate) fn travel_m(&self) -> f64 {
        match *self {
            Moving::Straight { from, to } => (to.a - from.a).norm(),
            Moving::Link { arm, link } => arm.travel_m(link),
        }
    }

    pub(crate) fn radius_m(&self) -> f64 {
        match *self {
            Moving::Straight { from, .. } => from.radius,
            Moving::Link { arm, .. } => arm.state.geometry.link_radius_m,
        }
    }
}
