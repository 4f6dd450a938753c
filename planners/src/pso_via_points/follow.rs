//! Following a path: a point a little further along it than the robot, in constant time per tick.

use geometry::Capsule;
use nalgebra::Point2;

/// How far ahead along the path the nearest point is looked for, m: a robot that was pushed finds on, and a path that
/// comes back near itself is not cut short.
const SEARCH_M: f64 = 1.0;
/// Segments looked at in one tick while looking for it.
const SEARCH_SEGMENTS: usize = 200;

/// A path and how far along it the robot is.
#[derive(Debug, Default)]
pub struct Follower {
    points: Vec<Point2<f64>>,
    /// Length up to each point, m.
    along: Vec<f64>,
    /// Segment and length of the point of the path nearest to the robot.
    index: usize,
    at_m: f64,
}

impl Follower {
    /// Takes the memory for a path of so many points.
    pub fn reserve(&mut self, points: usize) {
        self.points.reserve(points.saturating_sub(self.points.len()));
        self.along.reserve(points.saturating_sub(self.along.len()));
    }

    /// Takes a new path, and looks for the robot on all of it.
    pub fn take(&mut self, path: &[Point2<f64>], position: Point2<f64>) {
        self.points.clear();
        self.points.extend_from_slice(path);
        self.along.clear();
        let mut length = 0.0;
        for (i, point) in path.iter().enumerate() {
            length += if i > 0 { (point - path[i - 1]).norm() } else { 0.0 };
            self.along.push(length);
        }
        (self.index, self.at_m) = (0, 0.0);
        self.find(position, f64::INFINITY, usize::MAX);
    }

    /// Forgets the path.
    pub fn clear(&mut self) {
        self.points.clear();
        self.along.clear();
        (self.index, self.at_m) = (0, 0.0);
    }

    /// Whether there is a path.
    pub fn has_path(&self) -> bool {
        self.points.len() > 1
    }

    /// Moves on to the nearest point of the path, never back.
    pub fn advance(&mut self, position: Point2<f64>) {
        self.find(position, SEARCH_M, SEARCH_SEGMENTS);
    }

    fn find(&mut self, position: Point2<f64>, range_m: f64, segments: usize) {
        let end = self.points.len().saturating_sub(1);
        let mut nearest = f64::INFINITY;
        let (from_m, first) = (self.at_m, self.index);
        for i in first..end.min(first.saturating_add(segments)) {
            if self.along[i] > from_m + range_m {
                break;
            }
            let on = Capsule::segment(self.points[i], self.points[i + 1]).nearest_core(position);
            let at_m = self.along[i] + (on - self.points[i]).norm();
            let distance = (position - on).norm();
            if distance < nearest && at_m >= from_m {
                (nearest, self.index, self.at_m) = (distance, i, at_m);
            }
        }
    }

    /// The point of the path that lies so far ahead, or its end.
    pub fn ahead(&self, look_ahead_m: f64) -> Option<Point2<f64>> {
        let last = *self.points.last()?;
        let wanted = self.at_m + look_ahead_m;
        let mut i = self.index;
        while i + 1 < self.points.len() {
            if self.along[i + 1] >= wanted {
                let (from, to) = (self.points[i], self.points[i + 1]);
                let part = (wanted - self.along[i]) / (self.along[i + 1] - self.along[i]).max(f64::MIN_POSITIVE);
                return Some(from + part.clamp(0.0, 1.0) * (to - from));
            }
            i += 1;
        }
        Some(last)
    }

    /// How far along the path the robot is, m.
    pub fn at_m(&self) -> f64 {
        self.at_m
    }

    /// What is left of the path, m.
    pub fn remaining_m(&self) -> f64 {
        self.along.last().map_or(0.0, |length| length - self.at_m)
    }

    /// The points from where the robot is to the end.
    pub fn rest(&self) -> &[Point2<f64>] {
        &self.points[self.index.min(self.points.len())..]
    }

    /// Where the path ends.
    pub fn end(&self) -> Option<Point2<f64>> {
        self.points.last().copied()
    }
}
