//! Plane geometry that the methods, the world and the validator share. All lengths are in metres.
//!
//! Every obstacle is made of capsules: a disc is a capsule whose ends coincide, a wall is one with radius zero,
//! a polygon is a closed chain of walls (plus its inside, which only [`Polygon`] knows).

use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};

/// All points within `radius` of the segment from `a` to `b`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Capsule {
    /// One end of the core segment, m.
    pub a: Point2<f64>,
    /// The other end; equal to `a` for a disc, m.
    pub b: Point2<f64>,
    /// Distance from the core to the surface, m.
    pub radius: f64,
}

impl Capsule {
    /// A disc.
    #[inline]
    pub fn disc(center: Point2<f64>, radius: f64) -> Capsule {
        Capsule { a: center, b: center, radius }
    }

    /// A wall without thickness.
    #[inline]
    pub fn segment(a: Point2<f64>, b: Point2<f64>) -> Capsule {
        Capsule { a, b, radius: 0.0 }
    }

    /// The point of the core segment nearest to `p`.
    #[inline]
    pub fn nearest_core(&self, p: Point2<f64>) -> Point2<f64> {
        let along = self.b - self.a;
        let length_squared = along.norm_squared();
        if length_squared <= 0.0 {
            return self.a;
        }
        let t = ((p - self.a).dot(&along) / length_squared).clamp(0.0, 1.0);
        self.a + along * t
    }

    /// Distance from `p` to the surface, m; negative inside.
    #[inline]
    pub fn distance(&self, p: Point2<f64>) -> f64 {
        (p - self.nearest_core(p)).norm() - self.radius
    }

    /// The same shape moved by `offset`.
    #[inline]
    pub fn moved(&self, offset: Vector2<f64>) -> Capsule {
        Capsule { a: self.a + offset, b: self.b + offset, radius: self.radius }
    }
}

/// A simple polygon: corners in order, closed from the last to the first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Polygon {
    /// Its corners, m.
    pub corners: Vec<Point2<f64>>,
}

impl Polygon {
    /// Its edges as walls, in order.
    #[inline]
    pub fn edges(&self) -> impl Iterator<Item = Capsule> + '_ {
        let n = self.corners.len();
        (0..n).map(move |i| Capsule::segment(self.corners[i], self.corners[(i + 1) % n]))
    }

    /// Whether `p` is inside (even-odd rule).
    #[inline]
    pub fn contains(&self, p: Point2<f64>) -> bool {
        let n = self.corners.len();
        let mut inside = false;
        for i in 0..n {
            let (a, b) = (self.corners[i], self.corners[(i + 1) % n]);
            if (a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x {
                inside = !inside;
            }
        }
        inside
    }
}

/// Smallest distance between two segments, m; zero where they cross.
#[inline]
pub fn segment_distance(a0: Point2<f64>, a1: Point2<f64>, b0: Point2<f64>, b1: Point2<f64>) -> f64 {
    if segments_cross(a0, a1, b0, b1) {
        return 0.0;
    }
    let (a, b) = (Capsule::segment(a0, a1), Capsule::segment(b0, b1));
    a.distance(b0).min(a.distance(b1)).min(b.distance(a0)).min(b.distance(a1))
}

/// The way from one segment to another where they are nearest, m; zero where they cross. If the two change places, it is the
/// opposite to the last bit, unless two ways are equally short.
#[inline]
pub fn between_segments(a0: Point2<f64>, a1: Point2<f64>, b0: Point2<f64>, b1: Point2<f64>) -> Vector2<f64> {
    if segments_cross(a0, a1, b0, b1) {
        return Vector2::zeros();
    }
    let (a, b) = (Capsule::segment(a0, a1), Capsule::segment(b0, b1));
    let ways = [b.nearest_core(a0) - a0, b.nearest_core(a1) - a1, b0 - a.nearest_core(b0), b1 - a.nearest_core(b1)];
    ways.into_iter().min_by(|p, q| p.norm_squared().total_cmp(&q.norm_squared())).expect("there are four")
}

/// Whether two segments cross at a point inside both.
#[inline]
pub fn segments_cross(a0: Point2<f64>, a1: Point2<f64>, b0: Point2<f64>, b1: Point2<f64>) -> bool {
    let side = |p: Point2<f64>, q: Point2<f64>, r: Point2<f64>| (q - p).perp(&(r - p));
    let (d1, d2) = (side(b0, b1, a0), side(b0, b1, a1));
    let (d3, d4) = (side(a0, a1, b0), side(a0, a1, b1));
    d1 * d2 < 0.0 && d3 * d4 < 0.0
}

/// Closest approach of two points that both move straight and evenly during one tick, m: the distance of the
/// origin from the segment of their relative positions.
#[inline]
pub fn swept_distance(p0: Point2<f64>, p1: Point2<f64>, q0: Point2<f64>, q1: Point2<f64>) -> f64 {
    let origin = Point2::origin();
    Capsule::segment(origin + (q0 - p0), origin + (q1 - p1)).distance(origin)
}
