//! What places are checked against: the surfaces of obstacles and of the map, and the edges of the world.

use crate::obstacles::{contains, show};
use crate::problems::{Origin, Report};
use geometry::{Capsule, Map, Polygon, Raster, segment_distance};
use model::{Bounds, Obstacle, Shape};
use nalgebra::Point2;
use std::fmt;

/// Bodies that overlap by less than this touch, m.
pub(crate) const TOUCH_M: f64 = 1e-9;

/// The surfaces of all obstacles at the start, with boxes round them, and the walls of the map.
pub(crate) struct Surfaces {
    obstacles: Vec<Surface>,
    walls: Option<Map>,
}

/// What a body overlaps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Solid {
    /// An obstacle, by its index.
    Obstacle(usize),
    /// The map.
    Map,
}

impl fmt::Display for Solid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Solid::Obstacle(index) => write!(f, "obstacle[{index}]"),
            Solid::Map => f.write_str("the map"),
        }
    }
}

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
    pub(crate) fn new(obstacles: &[Obstacle], walls: Option<&Map>) -> Surfaces {
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
        Surfaces { obstacles: obstacles.iter().enumerate().filter_map(surface).collect(), walls: walls.cloned() }
    }

    /// The cells of the map, if it has any.
    pub(crate) fn raster(&self) -> Option<Raster> {
        self.walls.as_ref()?.raster()
    }

    /// How many pieces they have in all, the walls of the map apart.
    pub(crate) fn pieces(&self) -> usize {
        self.obstacles.iter().map(|surface| surface.pieces.len()).sum()
    }

    /// Whether every surface is at least this far from `p`.
    pub(crate) fn clearance_at_least(&self, p: Point2<f64>, distance_m: f64) -> bool {
        self.obstacles.iter().all(|surface| surface.clearance_below(p, distance_m).is_none())
            && self.walls.as_ref().is_none_or(|walls| !walls.is_near(p, distance_m) && !walls.is_solid(p))
    }

    /// The first that a disc overlaps, and by how much.
    fn overlap(&self, p: Point2<f64>, radius_m: f64, with_moving: bool) -> Option<(Solid, f64)> {
        let by = |surface: &Surface| Some(radius_m - surface.clearance_below(p, radius_m - TOUCH_M)?);
        (self.obstacles.iter().filter(|surface| with_moving || !surface.moving))
            .find_map(|surface| Some((Solid::Obstacle(surface.obstacle), by(surface)?)))
            .or_else(|| Some((Solid::Map, self.overlap_of_map(&Capsule::disc(p, radius_m))?)))
    }

    /// By how much a body overlaps the map, m, if it does. What is deep inside of something solid overlaps it to its surface.
    fn overlap_of_map(&self, body: &Capsule) -> Option<f64> {
        let walls = self.walls.as_ref()?;
        let is_inside = walls.is_solid(body.a);
        let limit_m = if is_inside { f64::INFINITY } else { body.radius - TOUCH_M };
        let to_wall = walls.distance_of_line([body.a, body.b], limit_m);
        if is_inside {
            return Some(body.radius + if to_wall.is_finite() { to_wall } else { 0.0 });
        }
        (to_wall < limit_m).then_some(body.radius - to_wall)
    }

    /// The first that one of these bodies overlaps, and by how much.
    pub(crate) fn overlap_of(&self, bodies: &[Capsule], with_moving: bool) -> Option<(Solid, f64)> {
        let surfaces = self.obstacles.iter().filter(|surface| with_moving || !surface.moving);
        let found = surfaces.into_iter().find_map(|surface| {
            let clearance = bodies.iter().map(|body| surface.clearance_of(body)).fold(f64::INFINITY, f64::min);
            (clearance < -TOUCH_M).then_some((Solid::Obstacle(surface.obstacle), -clearance))
        });
        found.or_else(|| {
            let deepest = bodies.iter().filter_map(|body| self.overlap_of_map(body)).fold(0.0, f64::max);
            (deepest > 0.0).then_some((Solid::Map, deepest))
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

/// What places are checked against.
pub(crate) struct Ground<'a> {
    pub(crate) world: Bounds,
    pub(crate) surfaces: &'a Surfaces,
}

impl Ground<'_> {
    /// Reports a place that is not in the world.
    pub(crate) fn outside(&self, p: Point2<f64>, what: &str, key: &str, origin: Origin, report: &mut Report) {
        let Bounds { x_m, y_m } = self.world;
        let message = format!("{what}, {}, is outside the world", show(p));
        let hint = format!("[world] has x_m = [{}, {}], y_m = [{}, {}]", x_m[0], x_m[1], y_m[0], y_m[1]);
        report.add_hint(origin, key, message, hint);
    }

    /// Checks one place for a disc to be.
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
            self.outside(p, what, key, origin, report);
        }
        if let Some((solid, overlap_m)) = self.surfaces.overlap(p, radius_m, with_moving) {
            let message = format!("{what}, {}, overlaps {solid} by {overlap_m:.3} m", show(p));
            report.add_hint(
                origin,
                key,
                message,
                format!("keep it {radius_m} m, the robot's radius, from every surface"),
            );
        }
    }
}
