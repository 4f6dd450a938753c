//! Natural cubic spline through points of the plane; its parameter is the cumulated length of the chords.

use nalgebra::{Point2, Vector2};

/// Points nearer to the one before than this fraction of the size of their coordinates (and of a metre) are left out:
/// a chord without length has no direction.
const CHORD_MIN: f64 = 1e-12;

/// A curve through given points that is straight beyond its ends: the second derivative is zero there.
#[derive(Clone, Debug, Default)]
pub struct Spline {
    /// Parameter at each point.
    t: Vec<f64>,
    /// The points.
    x: Vec<Point2<f64>>,
    /// Second derivatives at the points.
    m: Vec<Vector2<f64>>,
    /// Upper diagonal of the elimination.
    upper: Vec<f64>,
}

impl Spline {
    /// A spline for up to so many points without further memory.
    pub fn with_capacity(points: usize) -> Spline {
        Spline {
            t: Vec::with_capacity(points),
            x: Vec::with_capacity(points),
            m: Vec::with_capacity(points),
            upper: Vec::with_capacity(points),
        }
    }

    /// The spline through these points.
    pub fn through(points: &[Point2<f64>]) -> Spline {
        let mut spline = Spline::with_capacity(points.len());
        spline.fit(points.iter().copied());
        spline
    }

    /// Replaces the points. Points that coincide with the one before are left out.
    pub fn fit(&mut self, points: impl IntoIterator<Item = Point2<f64>>) {
        self.t.clear();
        self.x.clear();
        for point in points {
            let (Some(last), Some(t)) = (self.x.last(), self.t.last()) else {
                self.t.push(0.0);
                self.x.push(point);
                continue;
            };
            let chord = (point - last).norm();
            if chord > CHORD_MIN * (1.0 + point.coords.amax()) {
                self.t.push(t + chord);
                self.x.push(point);
            }
        }
        self.solve();
    }

    /// h_(i-1) M_(i-1) + 2 (h_(i-1) + h_i) M_i + h_i M_(i+1) = 6 (slope_i − slope_(i-1)), M = 0 at both ends, by
    /// elimination from below.
    fn solve(&mut self) {
        let n = self.x.len();
        self.m.clear();
        self.m.resize(n, Vector2::zeros());
        self.upper.clear();
        self.upper.resize(n, 0.0);
        for i in 1..n.saturating_sub(1) {
            let (h_before, h) = (self.t[i] - self.t[i - 1], self.t[i + 1] - self.t[i]);
            let slopes = (self.x[i + 1] - self.x[i]) / h - (self.x[i] - self.x[i - 1]) / h_before;
            let pivot = 2.0 * (h_before + h) - h_before * self.upper[i - 1];
            self.upper[i] = h / pivot;
            self.m[i] = (6.0 * slopes - h_before * self.m[i - 1]) / pivot;
        }
        for i in (1..n.saturating_sub(1)).rev() {
            let next = self.m[i + 1];
            self.m[i] -= self.upper[i] * next;
        }
    }

    /// The parameter at the last point: the length of the chords.
    pub fn end(&self) -> f64 {
        self.t.last().copied().unwrap_or(0.0)
    }

    /// The point at parameter `t`, from 0 to [`Spline::end`].
    pub fn at(&self, t: f64) -> Point2<f64> {
        let segment = self.t.partition_point(|t_i| *t_i <= t).saturating_sub(1);
        self.on(segment.min(self.t.len().saturating_sub(2)), t)
    }

    /// The point at parameter `t` of a segment.
    fn on(&self, i: usize, t: f64) -> Point2<f64> {
        let (Some(&before), Some(&after)) = (self.x.get(i), self.x.get(i + 1)) else {
            return self.x.first().copied().unwrap_or_default();
        };
        let h = self.t[i + 1] - self.t[i];
        let a = (self.t[i + 1] - t) / h;
        let b = 1.0 - a;
        let bend = ((a * a * a - a) * self.m[i] + (b * b * b - b) * self.m[i + 1]) * (h * h / 6.0);
        after + a * (before - after) + bend
    }

    /// Replaces `samples` by `count` points, at least 2, evenly spaced in the parameter, both ends included.
    pub fn sample(&self, count: usize, samples: &mut Vec<Point2<f64>>) {
        samples.clear();
        let count = count.max(2);
        let (mut segment, step) = (0, self.end() / (count - 1) as f64);
        for j in 0..count {
            let t = step * j as f64;
            while segment + 2 < self.t.len() && t >= self.t[segment + 1] {
                segment += 1;
            }
            samples.push(self.on(segment, t));
        }
        // The last sample is the last point, not a rounding beside it.
        if let (Some(last), Some(end)) = (samples.last_mut(), self.x.last()) {
            *last = *end;
        }
    }
}

/// Length of a chain of points, m: (24), with the squares that the paper's print of it lacks.
pub fn length(points: &[Point2<f64>]) -> f64 {
    points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
}
