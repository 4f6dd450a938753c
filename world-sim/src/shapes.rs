//! The obstacles, where they are.

use crate::grid::Aabb;
use crate::moving::Moving;
use geometry::{Capsule, Polygon, segment_distance};
use model::random::Stream;
use model::{Mover, Obstacle, Shape};
use nalgebra::{Point2, Vector2};
use std::ops::Range;

/// An obstacle. Its geometry stays where the scenario has it; a motion gives it an offset.
pub(crate) struct Placed {
    /// Its pieces among all pieces.
    pub(crate) pieces: Range<usize>,
    /// Its inside, if it has one besides the insides of its pieces.
    polygon: Option<Polygon>,
    /// Around its surface, without the offset.
    bounds: Aabb,
    reference: Point2<f64>,
    mover: Option<Mover>,
    /// Where it is now, relative to the scenario, m.
    pub(crate) offset: Vector2<f64>,
    /// Where it was when the present tick opened, m.
    pub(crate) offset_before: Vector2<f64>,
    /// m/s.
    pub(crate) velocity: Vector2<f64>,
}

/// All obstacles.
pub(crate) struct Shapes {
    pub(crate) obstacles: Vec<Placed>,
    /// Their pieces without offsets.
    base: Vec<Capsule>,
    /// Which obstacle a piece belongs to.
    owners: Vec<u32>,
}

/// How near a body came to another in a tick, surface to surface, m; negative in overlap.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Approach {
    /// When the tick opened.
    pub(crate) at_first: f64,
    /// At the nearest.
    pub(crate) least: f64,
}

impl Shapes {
    /// As the scenario has them, at time 0.
    pub(crate) fn new(obstacles: &[Obstacle], seed: u64) -> Shapes {
        let mut shapes = Shapes { obstacles: Vec::new(), base: Vec::new(), owners: Vec::new() };
        for (index, obstacle) in obstacles.iter().enumerate() {
            let first = shapes.base.len();
            shapes.base.extend(obstacle.shape.pieces());
            shapes.owners.resize(shapes.base.len(), index as u32);
            let pieces = first..shapes.base.len();
            let reference = obstacle.shape.reference();
            let stream = || Stream::new(seed, index as u32, 0, "obstacle-walk");
            let capsules = &shapes.base[pieces.clone()];
            let thickest = capsules.iter().fold(0.0, |thickest: f64, capsule| thickest.max(capsule.radius));
            shapes.obstacles.push(Placed {
                bounds: Aabb::around(capsules.iter().flat_map(|c| [c.a, c.b])).grown(thickest),
                pieces,
                polygon: match &obstacle.shape {
                    Shape::Polygon(corners) => Some(Polygon { corners: corners.clone() }),
                    Shape::Capsule(_) => None,
                },
                reference,
                mover: obstacle.motion.as_ref().map(|motion| Mover::new(motion, reference, stream)),
                offset: Vector2::zeros(),
                offset_before: Vector2::zeros(),
                velocity: Vector2::zeros(),
            });
        }
        shapes.advance(0.0);
        shapes.open();
        shapes
    }

    /// A tick opens: motion during the tick is counted from here.
    pub(crate) fn open(&mut self) {
        self.obstacles.iter_mut().for_each(|obstacle| obstacle.offset_before = obstacle.offset);
    }

    /// Moves what moves to where it is at `t_s`.
    pub(crate) fn advance(&mut self, t_s: f64) {
        for obstacle in &mut self.obstacles {
            if let Some(mover) = &mut obstacle.mover {
                let (position, velocity) = mover.at(t_s);
                obstacle.offset = position - obstacle.reference;
                obstacle.velocity = velocity;
            }
        }
    }

    /// How many pieces there are.
    pub(crate) fn len(&self) -> usize {
        self.base.len()
    }

    /// The pieces of an obstacle where the scenario has them.
    pub(crate) fn base(&self, obstacle: &Placed) -> &[Capsule] {
        &self.base[obstacle.pieces.clone()]
    }

    /// The obstacle that a piece belongs to.
    pub(crate) fn owner(&self, piece: usize) -> usize {
        self.owners[piece] as usize
    }

    /// A piece where it is now.
    pub(crate) fn piece(&self, index: usize) -> Capsule {
        self.base[index].moved(self.obstacles[self.owner(index)].offset)
    }

    /// Around an obstacle where it was when the tick opened.
    pub(crate) fn bounds(&self, obstacle: &Placed) -> Aabb {
        obstacle.bounds.moved(obstacle.offset_before)
    }

    /// The pieces of an obstacle on their way through this tick.
    pub(crate) fn ways(&self, obstacle: &Placed) -> impl Iterator<Item = Moving<'static>> + use<'_> {
        let (before, now) = (obstacle.offset_before, obstacle.offset);
        let pieces = self.base[obstacle.pieces.clone()].iter();
        pieces.map(move |piece| Moving::Straight { from: piece.moved(before), to: piece.moved(now) })
    }

    /// From the core of a body to the nearest edge of an obstacle, both without offset, m.
    pub(crate) fn edge_distance(&self, obstacle: &Placed, body: &Capsule) -> f64 {
        let pieces = self.base[obstacle.pieces.clone()].iter();
        pieces
            .map(|piece| segment_distance(body.a, body.b, piece.a, piece.b) - piece.radius)
            .fold(f64::INFINITY, f64::min)
    }

    /// From a point to the surface of a piece of an obstacle where it is now, m.
    pub(crate) fn distance(&self, obstacle: &Placed, piece: usize, p: Point2<f64>) -> f64 {
        self.base[piece].distance(p - obstacle.offset)
    }

    /// Whether a point is inside the polygon of an obstacle where it is now.
    pub(crate) fn inside(&self, obstacle: &Placed, p: Point2<f64>) -> bool {
        obstacle.inside(p - obstacle.offset)
    }

    /// How near a disc comes that drives straight on during the tick. In the frame of the obstacle, which moves
    /// straight on too, the centre runs along a segment, so this is exact; only how deep a polygon is entered is
    /// taken from the ends of the tick. `None` if that is further than `reach`.
    pub(crate) fn approach(
        &self,
        obstacle: &Placed,
        [from, to]: [Point2<f64>; 2],
        radius_m: f64,
        reach: f64,
    ) -> Option<Approach> {
        let (from, to) = (from - obstacle.offset_before, to - obstacle.offset);
        let bounds = Aabb::around([from, to]).grown(radius_m + reach.max(0.0));
        if !bounds.meets(&obstacle.bounds) {
            return None;
        }
        let path_m = (to - from).norm();
        let pieces = &self.base[obstacle.pieces.clone()];
        let (mut at_first, mut least) = (f64::INFINITY, f64::INFINITY);
        for piece in pieces {
            let here = piece.distance(from);
            at_first = at_first.min(here);
            least = least.min(here);
            // The way is at most `path_m` nearer than its beginning: most pieces need no more than this.
            if here - path_m < least.min(radius_m + reach) {
                least = least.min(segment_distance(from, to, piece.a, piece.b) - piece.radius);
            }
        }
        if obstacle.inside(from) {
            at_first = -at_first;
        }
        if obstacle.inside(to) {
            least = least.min(-pieces.iter().fold(f64::INFINITY, |least, piece| least.min(piece.distance(to))));
        }
        least = least.min(at_first);
        Some(Approach { at_first: at_first - radius_m, least: least - radius_m }).filter(|a| a.least <= reach)
    }
}

impl Placed {
    /// Whether it moves.
    pub(crate) fn moves(&self) -> bool {
        self.mover.is_some()
    }

    /// Its polygon, if it is one, without the offset.
    pub(crate) fn polygon(&self) -> Option<&Polygon> {
        self.polygon.as_ref()
    }

    /// The point that its motion carries, where it is now.
    pub(crate) fn reference(&self) -> Point2<f64> {
        self.reference + self.offset
    }

    /// How far it moves in this tick, m.
    pub(crate) fn driven_m(&self) -> f64 {
        (self.offset - self.offset_before).norm()
    }

    /// Whether a point, without the offset, is inside its polygon.
    pub(crate) fn inside(&self, p: Point2<f64>) -> bool {
        self.polygon.as_ref().is_some_and(|polygon| self.bounds.contains(p) && polygon.contains(p))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::Motion;
    use proptest::prelude::*;

    proptest! {
        /// A polygon and a capsule on their way, and a disc on its own: the clearance against many instants of the tick.
        #[test]
        fn no_instant_of_a_tick_is_nearer_than_the_approach(
            from in (-3.0..3.0f64, -3.0..3.0f64), to in (-3.0..3.0f64, -3.0..3.0f64), radius in 0.0..0.5f64,
            drift in (-1.0..1.0f64, -1.0..1.0f64), polygon: bool
        ) {
            // An L: not convex.
            let corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 0.5], [0.5, 0.5], [0.5, 2.0], [0.0, 2.0]].map(Point2::from);
            let shape = if polygon {
                Shape::Polygon(corners.to_vec())
            } else {
                Shape::Capsule(Capsule { a: Point2::new(-1.0, 0.5), b: Point2::new(1.0, -0.3), radius: 0.3 })
            };
            let reference = shape.reference();
            let points = vec![reference, reference + Vector2::new(drift.0, drift.1)];
            let speed_mps = drift.0.hypot(drift.1);
            let motion = Some(Motion::Waypoints { points, speed_mps, then: model::AtEnd::Stop });
            let mut shapes = Shapes::new(&[Obstacle { shape: shape.clone(), motion }], 1);
            shapes.advance(1.0);
            let path = [Point2::new(from.0, from.1), Point2::new(to.0, to.1)];
            let (found, offset) = (
                shapes.approach(&shapes.obstacles[0], path, radius, f64::INFINITY).unwrap(),
                shapes.obstacles[0].offset,
            );
            prop_assert!((offset - Vector2::new(drift.0, drift.1)).norm() < 1e-9);
            let clearance = |t: f64| {
                let p = path[0] + (path[1] - path[0]) * t - offset * t;
                let edge = shape.pieces().iter().map(|piece| piece.distance(p)).fold(f64::INFINITY, f64::min);
                let inside = polygon && Polygon { corners: corners.to_vec() }.contains(p);
                if inside { -edge - radius } else { edge - radius }
            };
            let steps = 2000;
            let sampled: Vec<f64> = (0..=steps).map(|i| clearance(f64::from(i) / f64::from(steps))).collect();
            let least = sampled.iter().copied().fold(f64::INFINITY, f64::min);
            let step = (path[1] - path[0] - offset).norm() / f64::from(steps);
            prop_assert!((found.at_first - sampled[0]).abs() < 1e-9);
            prop_assert!(found.least >= least - step - 1e-9);
            // Only the depth inside a polygon is taken from the ends; whether it was entered is exact.
            let most = if polygon && least < -radius { -radius } else { least };
            prop_assert!(found.least <= most + 1e-9);
            // With a reach, the same or nothing.
            for reach in [0.0, 0.3, 1.0] {
                let near = shapes.approach(&shapes.obstacles[0], path, radius, reach).map(|a| a.least);
                prop_assert_eq!(near, Some(found.least).filter(|least| *least <= reach));
            }
        }
    }
}
