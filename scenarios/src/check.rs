//! Checks of places: free of obstacles, inside the world, apart from each other.

use crate::arm;
use crate::ground::{Ground, TOUCH_M};
use crate::problems::{Origin, Report};
use geometry::{Capsule, segment_distance};
use model::{BodyKind, Robot};
use nalgebra::Point2;

/// Smaller bodies than this slip through what should stop them, m.
const SOLID_RADIUS_M_MIN: f64 = 0.01;

/// Where a robot's places stand in the file.
#[derive(Clone, Debug)]
pub(crate) struct Source {
    /// Key and origin of its id.
    pub(crate) id: (String, Origin),
    /// Key and origin of its start.
    pub(crate) start: (String, Origin),
    /// Key and origin of its last goal.
    pub(crate) goal: (String, Origin),
    /// Key and origin of its other goals.
    pub(crate) waypoints: (String, Origin),
    /// It enters later: where others start does not matter to it.
    pub(crate) late: bool,
}

impl Ground<'_> {
    /// Checks the start and the goals of one robot.
    pub(crate) fn check(&self, robot: &Robot, source: &Source, report: &mut Report) {
        let id = &robot.id;
        let (key, origin) = &source.start;
        match &robot.arm {
            Some(setup) => arm::check_start(self, robot, setup, source.late, (key, *origin), report),
            None => {
                let what = format!("the start of `{id}`");
                self.place(robot.start, robot.radius_m, !source.late, &what, key, *origin, report);
            }
        }
        for (index, goal) in robot.goals.iter().enumerate() {
            let last = index + 1 == robot.goals.len();
            let (key, origin) = if last { &source.goal } else { &source.waypoints };
            let what = if last { format!("the goal of `{id}`") } else { format!("waypoint {index} of `{id}`") };
            self.goal(robot, *goal, &what, key, *origin, report);
        }
    }

    /// Checks one goal of a robot.
    pub(crate) fn goal(
        &self,
        robot: &Robot,
        p: Point2<f64>,
        what: &str,
        key: &str,
        origin: Origin,
        report: &mut Report,
    ) {
        match &robot.arm {
            Some(setup) => arm::check_goal(self, setup, p, what, (key, origin), report),
            None if robot.kind == BodyKind::TwoLinkArm => {} // it is wrong, and reported
            None => self.place(p, robot.radius_m, false, what, key, origin, report),
        }
    }
}

/// Reports what cannot be in a world of solid bodies with weight, at its key `physics`.
pub(crate) fn solid(robots: &[Robot], sources: &[Source], physics: (&str, Origin), report: &mut Report) {
    let (key, origin) = physics;
    if let Some(arm) = robots.iter().find(|robot| robot.kind == BodyKind::TwoLinkArm) {
        let message = format!("`rapier` has no arms yet, and `{}` is one", arm.id);
        report.add_hint(origin, key, message, "leave the arms out, or let physics be \"kinematic\"".to_owned());
    }
    for (robot, source) in
        robots.iter().zip(sources).filter(|(robot, _)| robot.arm.is_none() && robot.radius_m < SOLID_RADIUS_M_MIN)
    {
        let message =
            format!("`{}` has a radius of {} m, a solid body needs {SOLID_RADIUS_M_MIN}", robot.id, robot.radius_m);
        report.add_hint(
            source.id.1,
            source.id.0.trim_end_matches(".id"),
            message,
            "raise radius_m, or let physics be \"kinematic\"".to_owned(),
        );
    }
}

/// Reports robots that overlap at the start, each with one other. A sweep along x: only robots that overlap in x are
/// compared.
pub(crate) fn starts_apart(robots: &[Robot], sources: &[Source], report: &mut Report) {
    let finite = |slot: &usize| robots[*slot].start.coords.iter().all(|x| x.is_finite());
    let bodies: Vec<Vec<Capsule>> = robots.iter().map(arm::body_at_start).collect();
    let left = |slot: usize| bodies[slot].iter().map(|b| b.a.x.min(b.b.x) - b.radius).fold(f64::INFINITY, f64::min);
    let right = |slot: usize| bodies[slot].iter().map(|b| b.a.x.max(b.b.x) + b.radius).fold(-f64::INFINITY, f64::max);
    let gap = |slot: usize, other: usize| {
        let pairs = bodies[slot].iter().flat_map(|a| bodies[other].iter().map(move |b| (a, b)));
        pairs.map(|(a, b)| segment_distance(a.a, a.b, b.a, b.b) - (a.radius + b.radius)).fold(f64::INFINITY, f64::min)
    };
    let mut order: Vec<usize> = (0..robots.len()).filter(|slot| !sources[*slot].late).filter(finite).collect();
    order.sort_by(|a, b| left(*a).total_cmp(&left(*b)).then(a.cmp(b)));
    for (index, &slot) in order.iter().enumerate() {
        let right = right(slot);
        let near = order[index + 1..].iter().take_while(|other| left(**other) < right);
        let Some(&other) = near.into_iter().find(|other| gap(slot, **other) < -TOUCH_M) else { continue };
        // Told at the later of the two, about the earlier.
        let (first, second) = (slot.min(other), slot.max(other));
        let (a, b) = (&robots[first], &robots[second]);
        let (key, origin) = &sources[second].start;
        let message = format!("`{}` overlaps `{}` at the start by {:.3} m", b.id, a.id, -gap(slot, other));
        let way_out = match key.as_str() {
            "layout" => "; a larger radius_m or spacing_m, a smaller jitter_m, or fewer robots",
            _ => "",
        };
        let hint = if a.arm.is_some() || b.arm.is_some() {
            format!("keep starts clear of the links of arms{way_out}")
        } else {
            let (needed_m, apart_m) = (a.radius_m + b.radius_m, nalgebra::distance(&a.start, &b.start));
            format!("their centres need {needed_m:.3} m, they are {apart_m:.3} m apart{way_out}")
        };
        report.add_hint(*origin, key, message, hint);
    }
}
