//! Checks of places: free of obstacles, inside the world, apart from each other.

use crate::model::{Bounds, Obstacle, Robot, Shape};
use crate::obstacles::{contains, show};
use crate::problems::{Origin, Report};
use nalgebra::Point2;
use planners::Capsule;
use planners::geometry::Polygon;

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

    /// Whether every surface is at least this far from `p`.
    pub(crate) fn clearance_at_least(&self, p: Point2<f64>, distance_m: f64) -> bool {
        self.0.iter().all(|surface| surface.clearance_below(p, distance_m).is_none())
    }

    /// The first obstacle that a disc overlaps, and by how much.
    fn overlap(&self, p: Point2<f64>, radius_m: f64, with_moving: bool) -> Option<(usize, f64)> {
        (self.0.iter().filter(|surface| with_moving || !surface.moving))
            .find_map(|surface| Some((surface.obstacle, radius_m - surface.clearance_below(p, radius_m - TOUCH_M)?)))
    }
}

impl Surface {
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
        self.place(robot.start, robot.radius_m, !source.late, &format!("the start of `{id}`"), key, *origin, report);
        for (index, goal) in robot.goals.iter().enumerate() {
            let last = index + 1 == robot.goals.len();
            let (key, origin) = if last { &source.goal } else { &source.waypoints };
            let what = if last { format!("the goal of `{id}`") } else { format!("waypoint {index} of `{id}`") };
            self.place(*goal, robot.radius_m, false, &what, key, *origin, report);
        }
    }

    /// Checks one place for a robot to be.
    #[expect(clippy::too_many_arguments, reason = "a place, and how to name it; a struct would only be unpacked again")]
    pub(crate) fn place(
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
            let Bounds { x_m, y_m } = self.world;
            let message = format!("{what}, {}, is outside the world", show(p));
            report.add_hint(
                origin,
                key,
                message,
                format!("[world] has x_m = [{}, {}], y_m = [{}, {}]", x_m[0], x_m[1], y_m[0], y_m[1]),
            );
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
    let mut order: Vec<usize> = (0..robots.len()).filter(|slot| !sources[*slot].late).filter(finite).collect();
    let left = |slot: usize| robots[slot].start.x - robots[slot].radius_m;
    order.sort_by(|a, b| left(*a).total_cmp(&left(*b)).then(a.cmp(b)));
    for (index, &slot) in order.iter().enumerate() {
        let robot = &robots[slot];
        let right = robot.start.x + robot.radius_m;
        let hit = order[index + 1..].iter().take_while(|other| left(**other) < right).find(|other| {
            let other = &robots[**other];
            nalgebra::distance(&robot.start, &other.start) < robot.radius_m + other.radius_m - TOUCH_M
        });
        let Some(&other) = hit else { continue };
        // Told at the later of the two, about the earlier.
        let (first, second) = (slot.min(other), slot.max(other));
        let (a, b) = (&robots[first], &robots[second]);
        let apart_m = nalgebra::distance(&a.start, &b.start);
        let needed_m = a.radius_m + b.radius_m;
        let (key, origin) = &sources[second].start;
        let message = format!("`{}` overlaps `{}` at the start by {:.3} m", b.id, a.id, needed_m - apart_m);
        let way_out = match key.as_str() {
            "layout" => "; a larger radius_m or spacing_m, a smaller jitter_m, or fewer robots",
            _ => "",
        };
        let hint = format!("their centres need {needed_m:.3} m, they are {apart_m:.3} m apart{way_out}");
        report.add_hint(*origin, key, message, hint);
    }
}
