//! What a path must keep clear of: obstacles in the plane, or what an arm in one sheet cannot do.

use super::swarm::bounds;
use crate::planner::Obstacle;
use geometry::arm::Room;
use geometry::{ArmGeometry, Capsule, Elbow, segment_distance};
use nalgebra::Point2;

/// The part of the margin that the check after the swarm asks for: the penalty holds a path at its margin only nearly,
/// and through a gap that is a little too narrow in the middle.
const MARGIN_KEPT: f64 = 0.5;

/// Distance computations that inverse kinematics takes as long as.
pub(super) const POSE_COST: u64 = 24;
/// A path may be nearer by this than its own end points are, m.
const ROUNDING_M: f64 = 1e-9;

/// A judge of paths.
pub trait Terrain {
    /// What coming too near costs a sampled path, and how many distances were computed for it.
    fn penalty(&self, samples: &[Point2<f64>]) -> (f64, u64);

    /// Whether a finely sampled path can be driven.
    fn passes(&self, path: &[Point2<f64>]) -> bool;
}

/// A disc-shaped robot among obstacles.
#[derive(Clone, Copy, Debug)]
pub struct Plane<'a> {
    /// The obstacles; every piece counts.
    pub obstacles: &'a [Obstacle],
    /// Robot's radius, m.
    pub radius_m: f64,
    /// Clearance wanted between surfaces, m.
    pub margin_m: f64,
    /// Cost per metre of missing clearance, sample and obstacle.
    pub penalty: f64,
}

impl Terrain for Plane<'_> {
    fn penalty(&self, samples: &[Point2<f64>]) -> (f64, u64) {
        let (low, high) = bounds(samples);
        let (mut missing, mut evaluations) = (0.0, self.obstacles.len() as u64);
        for Obstacle { shape, .. } in self.obstacles {
            if self.is_apart(shape, low, high, self.margin_m) {
                continue;
            }
            evaluations += samples.len() as u64;
            let reach = self.radius_m + self.allowed(shape, samples, self.margin_m);
            missing += if shape.a == shape.b {
                let reach = (shape.radius + reach).max(0.0);
                let inside = samples.iter().map(|p| (p - shape.a).norm_squared()).filter(|d2| *d2 < reach * reach);
                inside.map(|d2| reach - d2.sqrt()).sum::<f64>()
            } else {
                samples.iter().map(|p| (reach - shape.distance(*p)).max(0.0)).sum()
            };
        }
        (self.penalty * missing, evaluations)
    }

    /// Measured between the segments of the path and the obstacles, so that nothing slips between two samples.
    fn passes(&self, path: &[Point2<f64>]) -> bool {
        let (low, high) = bounds(path);
        let shapes = self.obstacles.iter().map(|obstacle| &obstacle.shape);
        shapes.filter(|shape| !self.is_apart(shape, low, high, self.margin_m)).all(|shape| {
            let wanted = self.allowed(shape, path, MARGIN_KEPT * self.margin_m);
            path.windows(2).all(|pair| self.gap(pair, shape) >= wanted - ROUNDING_M)
        })
    }
}

impl Plane<'_> {
    /// The margin for one obstacle: less where an end of the path is nearer than that, as after a push or with a goal
    /// close to a wall. A path need not be further away than its own ends; with a penalty for what it cannot change, a
    /// longer path would cost less, for fewer of its samples are near its ends.
    fn allowed(&self, shape: &Capsule, path: &[Point2<f64>], margin_m: f64) -> f64 {
        let ends = path.first().into_iter().chain(path.last());
        ends.map(|end| shape.distance(*end) - self.radius_m).fold(margin_m, f64::min)
    }

    /// Whether an obstacle is certainly further than `margin_m` from everything in a box.
    fn is_apart(&self, shape: &Capsule, low: Point2<f64>, high: Point2<f64>, margin_m: f64) -> bool {
        let reach = shape.radius + self.radius_m + margin_m;
        let apart = |a: f64, b: f64, low: f64, high: f64| a.max(b) + reach < low || a.min(b) - reach > high;
        apart(shape.a.x, shape.b.x, low.x, high.x) || apart(shape.a.y, shape.b.y, low.y, high.y)
    }

    /// Distance between the surfaces of an obstacle and of a robot anywhere on a segment, m.
    fn gap(&self, pair: &[Point2<f64>], shape: &Capsule) -> f64 {
        let core = if shape.a == shape.b {
            (shape.a - Capsule::segment(pair[0], pair[1]).nearest_core(shape.a)).norm()
        } else {
            segment_distance(pair[0], pair[1], shape.a, shape.b)
        };
        core - shape.radius - self.radius_m
    }
}

/// An arm in one of its sheets.
#[derive(Clone, Copy, Debug)]
pub struct Sheet<'a> {
    /// The arm.
    pub geometry: &'a ArmGeometry,
    /// The sheet.
    pub elbow: Elbow,
    /// What its links must not touch.
    pub obstacles: &'a [Obstacle],
    /// What the swarm keeps free; the check after it asks only for what the arm can do at all.
    pub room: Room,
    /// Cost of a sample that is not free.
    pub penalty: f64,
    /// Joint 1 where the path begins, if the path is to be driven from there: then joint 1 must not pass its stops.
    pub joint1_rad: Option<f64>,
}

impl Sheet<'_> {
    /// The pose at a place, if it is free with this much room.
    pub fn pose(&self, tip: Point2<f64>, room: Room) -> Option<[f64; 2]> {
        self.geometry.free_pose(tip, self.elbow, self.obstacles.iter().map(|obstacle| obstacle.shape), room)
    }
}

impl Terrain for Sheet<'_> {
    fn penalty(&self, samples: &[Point2<f64>]) -> (f64, u64) {
        let shapes = || self.obstacles.iter().map(|obstacle| obstacle.shape);
        let free = |tip: &Point2<f64>| self.geometry.is_free(*tip, self.elbow, shapes(), self.room);
        let bad = samples.iter().filter(|tip| !free(tip)).count();
        (self.penalty * bad as f64, samples.len() as u64 * (POSE_COST + 4 * self.obstacles.len() as u64))
    }

    fn passes(&self, path: &[Point2<f64>]) -> bool {
        let mut joint1 = self.joint1_rad;
        path.iter().all(|tip| {
            let Some(pose) = self.pose(*tip, Room::default()) else { return false };
            let Some(before) = joint1 else { return true };
            let here = self.geometry.nearest_in_range(pose, before)[0];
            joint1 = Some(here);
            (here - before).abs() < STOP_JUMP_RAD
        })
    }
}

/// Joint 1 does not turn this far between two samples of a path, unless a stop lies between them, rad.
const STOP_JUMP_RAD: f64 = 1.0;
