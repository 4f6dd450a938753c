//! Maps of a force or a potential over a part of the plane, for figures.

use crate::row::Line;
use crate::scene::Scene;
use nalgebra::{Point2, Vector2};

/// Points of a surface along each side.
const SURFACE: usize = 81;

/// A rectangle of the plane, m.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    /// From left to right.
    pub x_m: [f64; 2],
    /// From bottom to top.
    pub y_m: [f64; 2],
}

impl Window {
    /// The whole world of a scene.
    pub fn of(scene: &Scene) -> Window {
        let bounds = scene.scenario.bounds;
        Window { x_m: bounds.x_m, y_m: bounds.y_m }
    }

    /// Places of a square grid, row by row from the lower left corner.
    pub fn places(&self, pitch_m: f64) -> impl Iterator<Item = Point2<f64>> {
        let count = |[low, high]: [f64; 2]| ((high - low) / pitch_m + 1e-9).floor() as u32;
        let (corner, columns) = (Point2::new(self.x_m[0], self.y_m[0]), count(self.x_m));
        let place = move |row: u32, column: u32| corner + pitch_m * Vector2::new(f64::from(column), f64::from(row));
        (0..=count(self.y_m)).flat_map(move |row| (0..=columns).map(move |column| place(row, column)))
    }

    /// Arrows at the places of a grid, as pairs of where each begins and ends. A force of `size_max`, or of more, has the
    /// length of a grid's cell, less a gap; a smaller one is as much shorter. Where there is no force, there is no arrow.
    pub fn arrows(
        &self,
        pitch_m: f64,
        size_max: f64,
        force: impl Fn(Point2<f64>) -> Option<Vector2<f64>>,
    ) -> Vec<[f64; 2]> {
        let arrow = |place: Point2<f64>| {
            let force = force(place).filter(|force| *force != Vector2::zeros())?;
            let tip = place + force.cap_magnitude(size_max) * (0.9 * pitch_m / size_max);
            Some([[place.x, place.y], [tip.x, tip.y]])
        };
        self.places(pitch_m).filter_map(arrow).flatten().collect()
    }

    /// A surface, cut off at `height_max`.
    pub fn surface(&self, height_max: f64, mut height: impl FnMut(Point2<f64>) -> f64) -> Vec<Line> {
        let between = |ends: [f64; 2], i: usize| ends[0] + (ends[1] - ends[0]) * i as f64 / (SURFACE - 1) as f64;
        let row = |i: usize| {
            let y = between(self.y_m, i);
            let mut point = |x: f64| [x, height(Point2::new(x, y)).min(height_max)];
            (format!("{y}"), (0..SURFACE).map(|j| point(between(self.x_m, j))).collect())
        };
        (0..SURFACE).map(row).collect()
    }
}
