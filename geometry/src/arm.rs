//! A planar arm of two links: kinematics, joint limits, its links as bodies, and which tip positions it can hold.
//!
//! Equation numbers are those of F. A. Raheem and M. M. Badr, see the planner `pso-via-points`.
//! Angles are radians, counter-clockwise; joint 1 is measured from +x, joint 2 from the first link.
//!
//! A tip position within reach is held by two poses, mirrored at the line from base to tip. They are the two *sheets*
//! of the arm's configurations. The arm passes from one to the other only where they meet, at θ₂ = 0 with the tip on
//! the outer circle, so a path must stay within one sheet: the union of the two is not a space that an arm can move in.

mod free_space;

pub use free_space::{Found, FreeSpace, GridSearch, Through, shortest_grid_path};

use crate::angle::wrap;
use crate::shapes::{Capsule, segment_distance};
use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// Joint angles count as within their limits when they exceed them by no more than this, rad.
const ANGLE_ROUNDING_RAD: f64 = 1e-9;
/// Poses that touch what they may touch count as free when rounding makes them overlap by no more than this, m.
const CLEARANCE_ROUNDING_M: f64 = 1e-9;
/// |D| of (11) may exceed 1 by this much and still be the stretched arm.
const REACH_ROUNDING: f64 = 1e-12;

/// Which way the elbow bends: the sheet of a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Elbow {
    /// θ₂ < 0: the elbow lies counter-clockwise of the line from base to tip.
    Up,
    /// θ₂ ≥ 0: the elbow lies clockwise of that line.
    Down,
}

impl Elbow {
    /// Both sheets.
    pub const BOTH: [Elbow; 2] = [Elbow::Up, Elbow::Down];

    /// The sheet of a pose.
    #[inline]
    pub fn of(joints_rad: [f64; 2]) -> Elbow {
        if joints_rad[1] < 0.0 { Elbow::Up } else { Elbow::Down }
    }

    fn bit(self) -> u8 {
        match self {
            Elbow::Up => 1,
            Elbow::Down => 2,
        }
    }
}

/// How an arm is built.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArmGeometry {
    /// Where its base stands, m.
    pub base: Point2<f64>,
    /// Lengths of its links, the one at the base first, m.
    pub links_m: [f64; 2],
    /// Half the thickness of the links, m.
    pub link_radius_m: f64,
    /// Smallest joint angles, rad.
    pub joint_min_rad: [f64; 2],
    /// Greatest joint angles, rad. A joint stops there: a range of a full turn has its ends in one place but does not
    /// let the joint pass from the one to the other.
    pub joint_max_rad: [f64; 2],
}

impl ArmGeometry {
    /// Where the elbow is.
    #[inline]
    pub fn elbow(&self, joints_rad: [f64; 2]) -> Point2<f64> {
        self.base + self.links_m[0] * direction(joints_rad[0])
    }

    /// Where the tip is: (9), (10).
    #[inline]
    pub fn tip(&self, joints_rad: [f64; 2]) -> Point2<f64> {
        self.elbow(joints_rad) + self.links_m[1] * direction(joints_rad[0] + joints_rad[1])
    }

    /// The links as bodies, the one at the base first.
    #[inline]
    pub fn bodies(&self, joints_rad: [f64; 2]) -> [Capsule; 2] {
        let (elbow, tip) = (self.elbow(joints_rad), self.tip(joints_rad));
        let link = |a, b| Capsule { a, b, radius: self.link_radius_m };
        [link(self.base, elbow), link(elbow, tip)]
    }

    /// The joints that hold the tip in a place, whatever their limits: (11) to (14). `None` out of reach. Joint 1 comes
    /// out in its range where that has an angle of this direction, else in the turn above its lower limit.
    #[inline]
    pub fn inverse(&self, tip: Point2<f64>, elbow: Elbow) -> Option<[f64; 2]> {
        let [l1, l2] = self.links_m;
        let offset = tip - self.base;
        let (cosine, sine) = self.joint2(tip, elbow)?;
        let t2 = f64::atan2(sine, cosine); // (13)
        let t1 = offset.y.atan2(offset.x) - f64::atan2(l2 * sine, l1 + l2 * cosine); // (14)
        Some([self.turned_into_range(t1), t2])
    }

    /// Cosine and sine of joint 2: (11), (12). The printed factor -1/4 of (12) is a misprint of the sign.
    fn joint2(&self, tip: Point2<f64>, elbow: Elbow) -> Option<(f64, f64)> {
        let [l1, l2] = self.links_m;
        let d = ((tip - self.base).norm_squared() - l1 * l1 - l2 * l2) / (2.0 * l1 * l2);
        if d.is_nan() || d.abs() > 1.0 + REACH_ROUNDING {
            return None;
        }
        let d = d.clamp(-1.0, 1.0);
        let sine = (1.0 - d * d).sqrt();
        Some((d, if elbow == Elbow::Up { -sine } else { sine }))
    }

    /// An angle in the turn above the lower limit of joint 1.
    fn turned_into_range(&self, t1: f64) -> f64 {
        let low = self.joint_min_rad[0] - ANGLE_ROUNDING_RAD;
        low + ANGLE_ROUNDING_RAD.max((t1 - low).rem_euclid(TAU))
    }

    /// The same pose with joint 1 turned by whole turns to where it is nearest to `near_rad`, of those within its range.
    #[inline]
    pub fn nearest_in_range(&self, joints_rad: [f64; 2], near_rad: f64) -> [f64; 2] {
        let (low, high) = (self.joint_min_rad[0] - ANGLE_ROUNDING_RAD, self.joint_max_rad[0] + ANGLE_ROUNDING_RAD);
        let turns = |t1: f64| [t1 - TAU, t1, t1 + TAU];
        let nearest = turns(near_rad + wrap(joints_rad[0] - near_rad))
            .into_iter()
            .filter(|t1| (low..=high).contains(t1))
            .min_by(|a, b| (a - near_rad).abs().total_cmp(&(b - near_rad).abs()));
        [nearest.unwrap_or(joints_rad[0]), joints_rad[1]]
    }

    /// Whether the joints are within their limits, joint 2 by at least `margin_rad`.
    #[inline]
    pub fn within_limits(&self, joints_rad: [f64; 2], margin_rad: f64) -> bool {
        let margins = [0.0, margin_rad];
        (0..2).all(|i| within(joints_rad[i], self.joint_min_rad[i], self.joint_max_rad[i], margins[i]))
    }

    /// Smallest distance between the links and the obstacles, m; negative in contact, infinite without obstacles.
    #[inline]
    pub fn clearance(&self, joints_rad: [f64; 2], obstacles: impl IntoIterator<Item = Capsule>) -> f64 {
        let links = self.bodies(joints_rad);
        let nearest = |obstacle: Capsule| gap(&links[0], &obstacle).min(gap(&links[1], &obstacle));
        obstacles.into_iter().map(nearest).fold(f64::INFINITY, f64::min)
    }

    /// The joints that hold the tip in a place and in a sheet, if the tip is free there.
    #[inline]
    pub fn free_pose(
        &self,
        tip: Point2<f64>,
        elbow: Elbow,
        obstacles: impl IntoIterator<Item = Capsule>,
        room: Room,
    ) -> Option<[f64; 2]> {
        if self.is_free(tip, elbow, obstacles, room) { self.inverse(tip, elbow) } else { None }
    }

    /// Whether the tip can be held in a place and in a sheet: joints exist, keep their limits, and keep the links at
    /// least `clearance_m` from all obstacles. Swarms ask this a million times, so it gets along with one angle.
    #[inline]
    pub fn is_free(
        &self,
        tip: Point2<f64>,
        elbow: Elbow,
        obstacles: impl IntoIterator<Item = Capsule>,
        room: Room,
    ) -> bool {
        let Some((cosine, sine)) = self.joint2(tip, elbow) else { return false };
        let bend = cosine.acos();
        let t2 = if elbow == Elbow::Up { -bend } else { bend };
        if bend < room.joint2_rad || !within(t2, self.joint_min_rad[1], self.joint_max_rad[1], room.joint2_rad) {
            return false;
        }
        // (14) for directions instead of angles: the direction of the first link is that of the tip, turned back by
        // the direction of (l1 + l2 cos t2, l2 sin t2), whose length is the tip's distance.
        let [l1, l2] = self.links_m;
        let (along, across) = (l1 + l2 * cosine, l2 * sine);
        let (offset, square) = (tip - self.base, along * along + across * across);
        if square <= 0.0 {
            return false;
        }
        let turned = Vector2::new(offset.x * along + offset.y * across, offset.y * along - offset.x * across);
        let first = turned / square;
        if self.joint_max_rad[0] - self.joint_min_rad[0] < TAU - ANGLE_ROUNDING_RAD {
            let t1 = self.turned_into_range(first.y.atan2(first.x));
            if !within(t1, self.joint_min_rad[0], self.joint_max_rad[0], 0.0) {
                return false;
            }
        }
        let at = self.base + l1 * first;
        let link = |a, b| Capsule { a, b, radius: self.link_radius_m };
        let links = [link(self.base, at), link(at, tip)];
        let wanted = room.clearance_m - CLEARANCE_ROUNDING_M;
        obstacles.into_iter().all(|obstacle| links.iter().all(|link| gap(link, &obstacle) >= wanted))
    }

    /// Tip distances from the base between which joint 2 keeps its limits, m: the ring of what can be reached.
    #[inline]
    pub fn reach(&self) -> (f64, f64) {
        let [l1, l2] = self.links_m;
        let radius = |t2: f64| (l1 * l1 + l2 * l2 + 2.0 * l1 * l2 * t2.cos()).max(0.0).sqrt();
        let (low, high) = (self.joint_min_rad[1], self.joint_max_rad[1]);
        let straightest = if low <= 0.0 && high >= 0.0 { 0.0 } else { low.abs().min(high.abs()) };
        (radius(low.abs().max(high.abs()).min(PI)), radius(straightest))
    }
}

/// How far a pose must stay away from what limits it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Room {
    /// Of joint 2 from its limits and from the stretched arm, where the sheets meet, rad.
    pub joint2_rad: f64,
    /// Of the links from obstacles, m.
    pub clearance_m: f64,
}

/// An arm as it stands.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArmState {
    /// How it is built.
    pub geometry: ArmGeometry,
    /// Its joint angles, rad.
    pub joints_rad: [f64; 2],
}

impl ArmState {
    /// The sheet that it is in.
    #[inline]
    pub fn elbow(&self) -> Elbow {
        Elbow::of(self.joints_rad)
    }

    /// Where its tip is.
    #[inline]
    pub fn tip(&self) -> Point2<f64> {
        self.geometry.tip(self.joints_rad)
    }

    /// Velocity of the tip at these joint rates, m/s.
    #[inline]
    pub fn tip_velocity(&self, rate_radps: [f64; 2]) -> Vector2<f64> {
        let turned = |arm: Vector2<f64>, rate: f64| rate * Vector2::new(-arm.y, arm.x);
        let (tip, elbow) = (self.tip(), self.geometry.elbow(self.joints_rad));
        turned(tip - self.geometry.base, rate_radps[0]) + turned(tip - elbow, rate_radps[1])
    }

    /// The arm after a time at these rates. Joints stop at their limits.
    #[inline]
    pub fn moved(&self, rate_radps: [f64; 2], dt_s: f64) -> ArmState {
        let ArmGeometry { joint_min_rad: low, joint_max_rad: high, .. } = self.geometry;
        let joint = |i: usize| (self.joints_rad[i] + rate_radps[i] * dt_s).clamp(low[i], high[i].max(low[i]));
        ArmState { joints_rad: [joint(0), joint(1)], ..*self }
    }

    /// The rates that bring the joints to a pose in the same sheet within `dt_s`. Joint 1 does not pass its stops: the
    /// way round may be the long one.
    #[inline]
    pub fn rates_to(&self, joints_rad: [f64; 2], dt_s: f64) -> [f64; 2] {
        [0, 1].map(|i| (joints_rad[i] - self.joints_rad[i]) / dt_s)
    }
}

fn within(angle_rad: f64, low: f64, high: f64, margin: f64) -> bool {
    let slack = margin - ANGLE_ROUNDING_RAD;
    angle_rad >= low + slack && angle_rad <= high - slack
}

/// Distance between the surfaces of a link and an obstacle, m.
fn gap(link: &Capsule, obstacle: &Capsule) -> f64 {
    let core = if obstacle.a == obstacle.b {
        (obstacle.a - link.nearest_core(obstacle.a)).norm()
    } else {
        segment_distance(link.a, link.b, obstacle.a, obstacle.b)
    };
    core - link.radius - obstacle.radius
}

fn direction(angle_rad: f64) -> Vector2<f64> {
    let (sin, cos) = angle_rad.sin_cos();
    Vector2::new(cos, sin)
}
