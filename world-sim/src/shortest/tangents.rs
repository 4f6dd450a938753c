//! Circles around the ends of obstacles, and the straight lines that touch two of them.

use super::{TOUCH_M, Walls, direction};
use geometry::Capsule;
use nalgebra::{Point2, distance};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Angles that are no further apart count as equal, rad.
const SAME_RAD: f64 = 1e-7;

/// Which way a path goes round a circle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// Counter-clockwise: the centre is to the left.
    Left,
    /// Clockwise.
    Right,
}

impl Side {
    pub(super) const BOTH: [Side; 2] = [Side::Left, Side::Right];

    pub(super) fn index(self) -> usize {
        self as usize
    }

    fn sign(self) -> f64 {
        match self {
            Side::Left => 1.0,
            Side::Right => -1.0,
        }
    }
}

/// The angle turned on a circle between two angles, in [0, 2π) rad.
pub(super) fn arc(from: f64, to: f64, side: Side) -> f64 {
    let turned = (side.sign() * (to - from)).rem_euclid(TAU);
    // Rounding must not send anybody once round.
    if turned > TAU - SAME_RAD { 0.0 } else { turned }
}

/// A line that leaves one circle and comes to another, both in their sense; angles are those of its ends as seen from the
/// centres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub(super) from: Point2<f64>,
    pub(super) to: Point2<f64>,
    pub(super) from_angle: f64,
    pub(super) to_angle: f64,
    pub(super) length: f64,
}

/// The line from one circle (centre, radius, side) to another; a point is a circle of radius zero.
pub(super) fn tangent(a: (Point2<f64>, f64, Side), b: (Point2<f64>, f64, Side)) -> Option<Line> {
    let apart = b.0 - a.0;
    let (whole, rise) = (apart.norm(), b.2.sign() * b.1 - a.2.sign() * a.1);
    // Who stands at the surface may be in it by rounding.
    if whole < rise.abs() - 2.0 * TOUCH_M || whole <= 0.0 {
        return None;
    }
    let heading = apart.y.atan2(apart.x) - (rise / whole).clamp(-1.0, 1.0).asin();
    let (from_angle, to_angle) = (heading - a.2.sign() * FRAC_PI_2, heading - b.2.sign() * FRAC_PI_2);
    let (from, to) = (a.0 + direction(from_angle) * a.1, b.0 + direction(to_angle) * b.1);
    Some(Line { from, to, from_angle, to_angle, length: (whole * whole - rise * rise).max(0.0).sqrt() })
}

/// A circle that a path may follow where nothing else is in the way.
pub(super) struct Circle {
    pub(super) center: Point2<f64>,
    pub(super) radius: f64,
    /// Where something is, as angles from and to, counter-clockwise.
    blocked: Vec<[f64; 2]>,
}

impl Circle {
    /// The circle with what is in its way; `None` if that is everywhere.
    pub(super) fn new(center: Point2<f64>, radius: f64, walls: &[Capsule], radius_m: f64) -> Option<Circle> {
        let mut circle = Circle { center, radius, blocked: Vec::new() };
        for wall in walls {
            let grown = wall.radius + radius_m - TOUCH_M;
            if wall.distance(center) + wall.radius >= radius + grown {
                continue;
            }
            let inside = |angle: f64| wall.distance(center + direction(angle) * radius) + wall.radius < grown;
            let mut angles = crossings(center, radius, wall, grown);
            angles.sort_unstable_by(f64::total_cmp);
            let Some(first) = angles.first().copied() else {
                if inside(0.0) {
                    return None;
                }
                continue;
            };
            angles.push(first + TAU);
            let gaps = angles.windows(2).filter(|gap| inside(0.5 * (gap[0] + gap[1])));
            circle.blocked.extend(gaps.map(|gap| [gap[0], gap[1]]));
        }
        Some(circle)
    }

    /// Whether a path may be at this angle.
    pub(super) fn exposes(&self, angle: f64) -> bool {
        let inside = |[low, high]: &[f64; 2]| {
            let into = (angle - low).rem_euclid(TAU);
            into > SAME_RAD && into < high - low - SAME_RAD
        };
        !self.blocked.iter().any(inside)
    }

    /// Whether a path may go from one angle to the other.
    pub(super) fn allows(&self, from: f64, to: f64, side: Side) -> bool {
        let (length, begin) = (arc(from, to, side), if side == Side::Left { from } else { to });
        let meets = |[low, high]: &[f64; 2]| {
            let (into, until) = ((begin - low).rem_euclid(TAU), (low - begin).rem_euclid(TAU));
            into < high - low - SAME_RAD && (into > SAME_RAD || length > SAME_RAD) || until < length - SAME_RAD
        };
        !self.blocked.iter().any(meets)
    }
}

/// The angles at which a circle crosses the surface of a capsule, if it were `grown` thick.
pub(super) fn crossings(center: Point2<f64>, radius: f64, core: &Capsule, grown: f64) -> Vec<f64> {
    let mut angles: Vec<f64> = Vec::new();
    let mut around = |axis: f64, cosine: f64| {
        if cosine.abs() <= 1.0 {
            let half = cosine.acos();
            angles.extend([axis - half, axis + half].map(|angle: f64| angle.rem_euclid(TAU)));
        }
    };
    for end in [core.a, core.b] {
        let to = end - center;
        let apart = to.norm();
        if apart > 0.0 {
            around(to.y.atan2(to.x), (apart * apart + radius * radius - grown * grown) / (2.0 * apart * radius));
        }
    }
    let along = core.b - core.a;
    if along.norm() > 0.0 {
        // A side is a line; its normal is the axis.
        let normal = nalgebra::Vector2::new(-along.y, along.x) / along.norm();
        let offset = (core.a - center).dot(&normal);
        for side in [offset - grown, offset + grown] {
            around(normal.y.atan2(normal.x), side / radius);
        }
    }
    // Where the lines of sides go on beyond the core there is no surface, nor inside the capsule.
    let rounding = 1e-9 * (1.0 + radius + grown);
    angles.retain(|angle| {
        let p = center + direction(*angle) * radius;
        (distance(&p, &core.nearest_core(p)) - grown).abs() <= rounding.max(1e-12 * center.coords.norm())
    });
    angles
}

/// A line that leaves a circle.
#[derive(Clone, Copy)]
pub(super) struct Leaf {
    pub(super) side: Side,
    pub(super) to: usize,
    pub(super) to_side: Side,
    pub(super) line: Line,
}

/// The circles of one radius of robots, and the free lines between them as far as they have been looked for.
pub(super) struct Network {
    radius_m: f64,
    circles: Vec<Circle>,
    leaves: Vec<Option<Vec<Leaf>>>,
}

impl Network {
    pub(super) fn new(walls: &Walls, radius_m: f64) -> Network {
        let ends = walls.capsules.iter().flat_map(|wall| [wall.a, wall.b].map(|end| (end, wall.radius + radius_m)));
        let mut ends: Vec<(Point2<f64>, f64)> = ends.collect();
        let order = |a: &(Point2<f64>, f64), b: &(Point2<f64>, f64)| {
            [a.0.x, a.0.y, a.1].into_iter().zip([b.0.x, b.0.y, b.1]).map(|(a, b)| a.total_cmp(&b)).find(|o| o.is_ne())
        };
        ends.sort_by(|a, b| order(a, b).unwrap_or(std::cmp::Ordering::Equal));
        ends.dedup();
        let circles: Vec<Circle> = ends
            .into_iter()
            .filter_map(|(center, radius)| Circle::new(center, radius, &walls.capsules, radius_m))
            .collect();
        let leaves = circles.iter().map(|_| None).collect();
        Network { radius_m, circles, leaves }
    }

    pub(super) fn radius_m(&self) -> f64 {
        self.radius_m
    }

    pub(super) fn circles(&self) -> &[Circle] {
        &self.circles
    }

    /// The lines that leave a circle, once [`leave`](Network::leave) has looked for them.
    pub(super) fn leaves(&self, circle: usize) -> &[Leaf] {
        self.leaves[circle].as_deref().unwrap_or_default()
    }

    /// Looks for the lines that leave a circle.
    pub(super) fn leave(&mut self, circle: usize, walls: &Walls) {
        if self.leaves[circle].is_some() {
            return;
        }
        let mut found = Vec::new();
        let a = &self.circles[circle];
        for (to, b) in self.circles.iter().enumerate().filter(|(to, _)| *to != circle) {
            for (side, to_side) in Side::BOTH.into_iter().flat_map(|side| Side::BOTH.map(|to_side| (side, to_side))) {
                let Some(line) = tangent((a.center, a.radius, side), (b.center, b.radius, to_side)) else { continue };
                if a.exposes(line.from_angle)
                    && b.exposes(line.to_angle)
                    && walls.free(line.from, line.to, self.radius_m)
                {
                    found.push(Leaf { side, to, to_side, line });
                }
            }
        }
        self.leaves[circle] = Some(found);
    }
}
