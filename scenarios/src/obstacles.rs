//! Obstacles and motions.

use crate::node::Node;
use crate::problems::Report;
use crate::table::{self, MotionKind, ObstacleShape, Root};
use crate::types::Interval;
use geometry::{Capsule, segment_distance, segments_cross};
use model::{Bounds, MAX_SHAPES, Motion, Obstacle, Shape};
use nalgebra::{Point2, Vector2};

/// Two points nearer than this are the same.
const SAME_M: f64 = 1e-9;

/// All obstacles of a file; wrong ones are reported and keep their place as a point far away.
pub(crate) fn read(root: &Node, world: Bounds, report: &mut Report) -> Vec<Obstacle> {
    let nodes = root.nodes(Root::obstacle);
    let obstacles: Vec<Obstacle> = nodes.iter().map(|node| obstacle(node, world, report)).collect();
    let pieces: usize = obstacles.iter().map(|obstacle| pieces(&obstacle.shape)).sum();
    if pieces > MAX_SHAPES {
        let message = format!("all obstacles together have {pieces} pieces, at most {MAX_SHAPES} are allowed");
        report.add_hint(root.at(Root::obstacle), "obstacle", message, "every edge of a polygon is a piece");
    }
    obstacles
}

fn pieces(shape: &Shape) -> usize {
    match shape {
        Shape::Capsule(_) => 1,
        Shape::Polygon(corners) => corners.len(),
    }
}

fn obstacle(node: &Node, world: Bounds, report: &mut Report) -> Obstacle {
    let shape = shape(node, report);
    let Some(mut shape) = shape else {
        // Already reported; nothing is inside of it.
        let nowhere = Point2::new(f64::NAN, f64::NAN);
        return Obstacle { shape: Shape::Capsule(Capsule::disc(nowhere, 0.0)), motion: None };
    };
    let motion = node.node(table::Obstacle::motion).and_then(|motion_node| {
        let motion = motion(motion_node, shape.reference(), world, report)?;
        shape = moved(&shape, beginning(&motion, shape.reference()) - shape.reference());
        Some(motion)
    });
    Obstacle { shape, motion }
}

fn shape(node: &Node, report: &mut Report) -> Option<Shape> {
    use table::Obstacle as Keys;
    match node.get(Keys::shape)? {
        ObstacleShape::Disc => {
            Some(Shape::Capsule(Capsule::disc(node.get(Keys::center_m)?, node.get(Keys::radius_m)?)))
        }
        shape @ (ObstacleShape::Segment | ObstacleShape::Capsule) => {
            let (a, b) = (node.get(Keys::from_m)?, node.get(Keys::to_m)?);
            let radius = if shape == ObstacleShape::Capsule { node.get(Keys::radius_m)? } else { 0.0 };
            if nalgebra::distance(&a, &b) < SAME_M {
                let message = format!("from_m and to_m are the same point, {}", show(a));
                report.add_hint(node.at(Keys::to_m), &node.key(Keys::to_m), message, "a point with a radius is a disc");
                return None;
            }
            Some(Shape::Capsule(Capsule { a, b, radius }))
        }
        ObstacleShape::Polygon => {
            let corners = node.get(Keys::corners_m)?; // missing or wrong, and reported
            if let Some(message) = polygon_problem(&corners) {
                report.add_hint(
                    node.at(Keys::corners_m),
                    &node.key(Keys::corners_m),
                    message,
                    "list the corners once, in order round the polygon; it is closed from the last to the first",
                );
                return None;
            }
            Some(Shape::Polygon(corners))
        }
    }
}

/// Why these corners make no simple polygon.
fn polygon_problem(corners: &[Point2<f64>]) -> Option<String> {
    let n = corners.len();
    let edge = |i: usize| (corners[i % n], corners[(i + 1) % n]);
    for i in 0..n {
        let (a, b) = edge(i);
        let (_, c) = edge(i + 1);
        if nalgebra::distance(&a, &b) < SAME_M {
            return Some(format!("corners {i} and {} are the same point, {}", (i + 1) % n, show(a)));
        }
        let (ab, bc) = (b - a, c - b);
        if ab.perp(&bc).abs() < SAME_M * ab.norm() * bc.norm() && ab.dot(&bc) < 0.0 {
            return Some(format!("the polygon folds back on itself at corner {}, {}", (i + 1) % n, show(b)));
        }
    }
    for i in 0..n {
        for j in i + 2..n {
            if i == 0 && j == n - 1 {
                continue; // neighbours round the corner
            }
            let ((a0, a1), (b0, b1)) = (edge(i), edge(j));
            let apart = a0.x.max(a1.x) + SAME_M < b0.x.min(b1.x) || b0.x.max(b1.x) + SAME_M < a0.x.min(a1.x);
            if !apart && (segments_cross(a0, a1, b0, b1) || segment_distance(a0, a1, b0, b1) < SAME_M) {
                return Some(format!("the edges from corner {i} and from corner {j} cross or touch"));
            }
        }
    }
    None
}

/// How something at `reference` moves.
pub(crate) fn motion(node: &Node, reference: Point2<f64>, world: Bounds, report: &mut Report) -> Option<Motion> {
    use table::Motion as Keys;
    match node.get(Keys::kind)? {
        MotionKind::Orbit => {
            let center = node.get(Keys::center_m)?;
            let from_center = reference - center;
            let radius_m = node.given(Keys::radius_m).or(from_center.norm())?;
            if radius_m < SAME_M {
                let message = "it stands at the centre of its orbit, so the circle has no radius";
                report.add_hint(
                    node.at(Keys::center_m),
                    &node.key(Keys::center_m),
                    message,
                    "give radius_m, or move one of them",
                );
                return None;
            }
            let phase_rad = node.get(Keys::phase_rad).unwrap_or_else(|| geometry::heading(from_center));
            Some(Motion::Orbit { center, radius_m, omega_radps: node.get(Keys::omega_radps)?, phase_rad })
        }
        MotionKind::Bounce => {
            let velocity_mps = node.get(Keys::velocity_mps)?;
            Some(Motion::Bounce { velocity_mps, within: within(node, reference, world, report)? })
        }
        MotionKind::RandomWalk => Some(Motion::RandomWalk {
            speed_mps: node.get(Keys::speed_mps)?,
            turn_every_s: node.get(Keys::turn_every_s),
            within: within(node, reference, world, report)?,
        }),
        MotionKind::Waypoints => {
            let points = node.get(Keys::points_m)?; // missing or wrong, and reported
            if let Some(i) = points.windows(2).position(|pair| nalgebra::distance(&pair[0], &pair[1]) < SAME_M) {
                let message = format!("points {i} and {} are the same, {}", i + 1, show(points[i]));
                report.add(node.at(Keys::points_m), &node.key(Keys::points_m), message);
                return None;
            }
            Some(Motion::Waypoints { points, speed_mps: node.get(Keys::speed_mps)?, then: node.get(Keys::then) })
        }
    }
}

/// The rectangle of a motion, which must hold the thing that moves.
fn within(node: &Node, reference: Point2<f64>, world: Bounds, report: &mut Report) -> Option<Bounds> {
    let Interval(x_m) = node.given(table::Motion::x_m).or(Interval(world.x_m))?;
    let Interval(y_m) = node.given(table::Motion::y_m).or(Interval(world.y_m))?;
    let bounds = Bounds { x_m, y_m };
    if !contains(bounds, reference) {
        let message = format!("it starts at {}, outside the rectangle that it moves in", show(reference));
        report.add_hint(
            node.origin,
            &node.path,
            message,
            "x_m and y_m say where it is turned back; by default the world's",
        );
        return None;
    }
    Some(bounds)
}

/// Where a motion that carries something from `reference` begins.
pub(crate) fn beginning(motion: &Motion, reference: Point2<f64>) -> Point2<f64> {
    match motion {
        Motion::Orbit { center, radius_m, phase_rad, .. } => {
            center + Vector2::new(phase_rad.cos(), phase_rad.sin()) * *radius_m
        }
        Motion::Waypoints { points, .. } => points.first().copied().unwrap_or(reference),
        Motion::Bounce { .. } | Motion::RandomWalk { .. } => reference,
    }
}

fn moved(shape: &Shape, offset: Vector2<f64>) -> Shape {
    match shape {
        Shape::Capsule(capsule) => Shape::Capsule(capsule.moved(offset)),
        Shape::Polygon(corners) => Shape::Polygon(corners.iter().map(|corner| corner + offset).collect()),
    }
}

/// Whether a point is inside a rectangle, its edges included.
pub(crate) fn contains(bounds: Bounds, p: Point2<f64>) -> bool {
    (bounds.x_m[0]..=bounds.x_m[1]).contains(&p.x) && (bounds.y_m[0]..=bounds.y_m[1]).contains(&p.y)
}

/// A point as TOML writes it, to the millimetre.
pub(crate) fn show(p: Point2<f64>) -> String {
    let round = |x: f64| (x * 1000.0).round() / 1000.0 + 0.0;
    format!("[{}, {}]", round(p.x), round(p.y))
}
