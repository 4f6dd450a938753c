//! Checks of places: free of obstacles, inside the world, apart from each other.

use crate::arm;
use crate::obstacles::{contains, show};
use crate::problems::{Origin, Report};
use geometry::{Capsule, Polygon, segment_distance};
use model::{BodyKind, Bounds, Obstacle, Robot, Shape};
use nalgebra::Point2;

/// Bodies that overlap by less than this touch, m.
const TOUCH_M: f64 = 1e-9;

/// The surfaces of all obstacles at the start, with boxes round them.
pub(crate) struct Surfaces(Vec<Surface>);

struct Surface {
    /// Index of the obstacle.
    obstacle: usize,
    moving: bool,
    low: Point2<f64>,
    high: Point2<f64>,
    pieces: Vec<Capsule>,
    solid: Option<Polygon>,
}

impl Surfaces {
    /// Obstacles that could not be read have no surface.
    pub(crate) fn new(obstacles: &[Obstacle]) -> Surfaces {
        let surface = |(index, obstacle): (usize, &Obstacle)| {
            let pieces = obstacle.shape.pieces();
            let (mut low, mut high) = (Point2::from([f64::MAX; 2]), Point2::from([f64::MIN; 2]));
            for piece in &pieces {
                for end in [piece.a, piece.b] {
                    low = low.inf(&(end - nalgebra::Vector2::repeat(piece.radius)));
                    high = high.sup(&(end + nalgebra::Vector2::repeat(piece.radius)));
                }
            }
            let solid = match &obstacle.shape {
                Shape::Polygon(corners) => Some(Polygon { corners: corners.clone() }),
                Shape::Capsule(_) => None,
            };
            let readable = obstacle.shape.reference().coords.iter().all(|x| x.is_finite());
            readable.then_some(Surface { obstacle: index, moving: obstacle.motion.is_some(), low, high, pieces, solid })
        };
        Surfaces(obstacles.iter().enumerate().filter_map(surface).collect())
    }

    /// How many pieces they have in all.
    pub(crate) fn pieces(&self) -> usize {
        self.0.iter().map(|surface| surface.pieces.len()).sum()
    }

    /// Whether every surface is at least this far from `p`.
    pub(crate) fn clearance_at_least(&self, p: Point2<f64>, distance_m: f64) -> bool {
        self.0.iter().all(|surface| surface.clearance_below(p, distance_m).is_none())
    }

    /// The first obstacle that a disc overlaps, and by how much.
    fn overlap(&self, p: Point2<f64>, radius_m: f64, with_moving: bool) -> Option<(usize, f64)> {
        (self.0.iter().filter(|surface| with_moving || !surface.moving))
            .find_map(|surface| Some((surface.obstacle, radius_m - surface.clearance_below(p, radius_m - TOUCH_M)?)))
    }

    /// The first obstacle that one of these bodies overlaps, and by how much.
    pub(crate) fn overlap_of(&self, bodies: &[Capsule], with_moving: bool) -> Option<(usize, f64)> {
        let surfaces = self.0.iter().filter(|surface| with_moving || !surface.moving);
        surfaces.into_iter().find_map(|surface| {
            let clearance = bodies.iter().map(|body| surface.clearance_of(body)).fold(f64::INFINITY, f64::min);
            (clearance < -TOUCH_M).then_some((surface.obstacle, -clearance))
        })
    }
}

impl Surface {
    /// The distance from the surface of a body, negative in overlap.
    fn clearance_of(&self, body: &Capsule) -> f64 {
        let to_edge = (self.pieces.iter())
            .map(|piece| segment_distance(body.a, body.b, piece.a, piece.b) - piece.radius)
            .fold(f64::INFINITY, f64::min);
        let inside = self.solid.as_ref().is_some_and(|solid| solid.contains(body.a));
        (if inside { -to_edge } else { to_edge }) - body.radius
    }

    /// The distance from `p`, negative inside, if it is below `limit_m`.
    fn clearance_below(&self, p: Point2<f64>, limit_m: f64) -> Option<f64> {
        let near = p.x > self.low.x - limit_m
            && p.x < self.high.x + limit_m
            && p.y > self.low.y - limit_m
            && p.y < self.high.y + limit_m;
        if !near {
            return None;
        }
        let to_edge = self.pieces.iter().map(|piece| piece.distance(p)).fold(f64::INFINITY, f64::min);
        let inside = self.solid.as_ref().is_some_and(|solid| solid.contains(p));
        let clearance = if inside { -to_edge } else { to_edge };
        (clearance < limit_m).then_some(clearance)
    }
}

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

/// What places are checked against.
pub(crate) struct Ground<'a> {
    pub(crate) world: Bounds,
    pub(crate) surfaces: &'a Surfaces,
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

    /// Reports a place that is not in the world.
    pub(crate) fn outside(&self, p: Point2<f64>, what: &str, key: &str, origin: Origin, report: &mut Report) {
        let Bounds { x_m, y_m } = self.world;
        let message = format!("{what}, {}, is outside the world", show(p));
        let hint = format!("[world] has x_m = [{}, {}], y_m = [{}, {}]", x_m[0], x_m[1], y_m[0], y_m[1]);
        report.add_hint(origin, key, message, hint);
    }

    /// Checks one place for a disc to be.
    #[expect(clippy::too_many_arguments, reason = "a place, and how to name it; a struct would only be unpacked again")]
    fn place(
        &self,
        p: Point2<f64>,
        radius_m: f64,
        with_moving: bool,
        what: &str,
        key: &str,
        origin: Origin,
        report: &mut Report,
    ) {
        if !p.coords.iter().all(|x| x.is_finite()) {
            return; // wrong, and reported
        }
        if !contains(self.world, p) {
            self.outside(p, what, key, origin, report);
        }
        if let Some((obstacle, overlap_m)) = self.surfaces.overlap(p, radius_m, with_moving) {
            let message = format!("{what}, {}, overlaps obstacle[{obstacle}] by {overlap_m:.3} m", show(p));
            report.add_hint(
                origin,
                key,
                message,
                format!("keep it {radius_m} m, the robot's radius, from every surface"),
            );
        }
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
