//! What a method is told of an obstacle: its nearest piece, and that the inside of a polygon is solid.

use geometry::{Capsule, Polygon};
use nalgebra::{Point2, Vector2};
use shoal_planners::{Obstacle, nearest_by_id};

fn p(x: f64, y: f64) -> Point2<f64> {
    Point2::new(x, y)
}

#[test]
fn every_obstacle_answers_with_its_nearest_piece() {
    let piece = |id: u32, x: f64| Obstacle { id, shape: Capsule::disc(p(x, 0.0), 0.5), velocity: Vector2::zeros() };
    let obstacles = [piece(1, 9.0), piece(2, 5.0), piece(2, 3.0), piece(2, 4.0), piece(7, 1.0), piece(7, -1.5)];
    let nearest: Vec<(u32, f64)> = nearest_by_id(&obstacles, p(0.0, 0.0)).map(|o| (o.id, o.shape.a.x)).collect();
    assert_eq!(nearest, [(1, 9.0), (2, 3.0), (7, 1.0)]);
    assert_eq!(nearest_by_id(&[], p(0.0, 0.0)).count(), 0);
}

#[test]
fn the_inside_of_a_polygon_is_solid() {
    // An L, whose corner at (1, 1) goes inwards.
    let corners = [p(0.0, 0.0), p(4.0, 0.0), p(4.0, 1.0), p(1.0, 1.0), p(1.0, 4.0), p(0.0, 4.0)];
    let polygon = Polygon { corners: corners.to_vec() };
    let edges = polygon.edges().map(|shape| Obstacle { id: 5, shape, velocity: Vector2::new(1.0, 0.0) });
    let mut edges: Vec<Obstacle> = edges.collect();
    let nearest = |edges: &[Obstacle], q: Point2<f64>| nearest_by_id(edges, q).next().unwrap();
    for _ in 0..edges.len() {
        // In whatever order the edges were seen.
        edges.rotate_left(1);
        edges.swap(1, 4);
        for (inside, depth, out) in [
            (p(3.0, 0.8), 0.2, Vector2::y()),
            (p(0.1, 2.0), 0.1, -Vector2::x()),
            (p(2.0, 0.25), 0.25, -Vector2::y()),
            (p(2.0, 1e-6), 1e-6, -Vector2::y()),
        ] {
            let found = nearest(&edges, inside);
            assert!((found.shape.distance(inside) + depth).abs() < 1e-12, "{inside}");
            let away = inside - found.shape.nearest_core(inside);
            assert!((away.normalize() - out).norm() < 1e-9, "{inside}: {away}");
            assert_eq!((found.id, found.velocity), (5, Vector2::new(1.0, 0.0)));
        }
        for outside in [p(2.0, 2.0), p(-0.1, 1.0), p(1.2, 1.2), p(5.0, 0.5), p(2.0, 0.0)] {
            let expected = edges.iter().map(|edge| edge.shape.distance(outside)).fold(f64::INFINITY, f64::min);
            assert_eq!(nearest(&edges, outside).shape.distance(outside), expected);
            assert!(edges.iter().any(|edge| edge.shape == nearest(&edges, outside).shape), "{outside}");
        }
        // Not all of it in sight: walls.
        let some = &edges[1..];
        assert!(some.iter().any(|edge| edge.shape == nearest(some, p(3.0, 0.8)).shape));
    }
}
