//! The swarm: every particle is one set of via points, its cost the length of the spline through them and what the
//! terrain charges for coming too near. Runs in pieces of one particle.

use super::terrain::Terrain;
use geometry::spline::{Spline, length};
use model::random::Stream;
use nalgebra::{Point2, Vector2};

/// Velocities start at up to this part of their limit.
const START_SPEED: f64 = 0.1;
/// A via point of a particle that is moved to one side goes its own way by this part of it.
const OWN_PART: f64 = 0.3;
/// The check after the swarm samples this many times finer.
pub const FINER: usize = 5;

/// What the swarm goes by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Via points of a particle.
    pub via_points: usize,
    /// Particles.
    pub particles: usize,
    /// Iterations at most.
    pub iterations: usize,
    /// w.
    pub inertia: f64,
    /// c1, the pull of a particle's own best.
    pub own_pull: f64,
    /// c2, the pull of the swarm's best.
    pub swarm_pull: f64,
    /// Limit of a velocity as a part of the side of the box, per coordinate.
    pub clamp: f64,
    /// How far the box reaches beyond the base path, m.
    pub box_m: f64,
    /// Samples of a spline.
    pub samples: usize,
    /// Standard deviation by which the first via points are moved off the base path, m.
    pub jitter_m: f64,
    /// How far the via points are moved from the base path besides, standard deviation, m. Zero for a base
    /// path that already goes round things.
    pub aside_m: f64,
    /// Ends when this many iterations gained less than `gain_m`; 0 never ends early.
    pub patience: usize,
    /// See `patience`, m.
    pub gain_m: f64,
}

/// (21) for one coordinate, before the clamp.
#[expect(clippy::too_many_arguments, reason = "the symbols of the equation")]
pub fn velocity(w: f64, c1: f64, c2: f64, v: f64, x: f64, own_best: f64, best: f64, r1: f64, r2: f64) -> f64 {
    w * v + c1 * r1 * (own_best - x) + c2 * r2 * (best - x)
}

/// A swarm at work on one base path.
#[derive(Debug, Default)]
pub struct Swarm {
    settings: Option<Settings>,
    start: Point2<f64>,
    goal: Point2<f64>,
    low: Point2<f64>,
    high: Point2<f64>,
    /// Via points per particle here: fewer than asked for when the base path has fewer points.
    via: usize,
    /// Via points, velocities and own bests, particle after particle.
    x: Vec<Point2<f64>>,
    v: Vec<Vector2<f64>>,
    own: Vec<Point2<f64>>,
    own_cost: Vec<f64>,
    /// The best of all up to the end of the last iteration, and up to now.
    best: Vec<Point2<f64>>,
    next_best: Vec<Point2<f64>>,
    next_cost: f64,
    /// Iterations ended; the first one only evaluates.
    iteration: usize,
    particle: usize,
    /// Best cost when it last improved by `gain_m`, and the iteration in which it did.
    mark: (f64, usize),
    /// Best cost after the first evaluation and after each iteration.
    history: Vec<f64>,
    spline: Spline,
    samples: Vec<Point2<f64>>,
    fine: Vec<Point2<f64>>,
}

impl Swarm {
    /// Starts with via points drawn from the base path, in its order. Memory is kept.
    pub fn begin(&mut self, settings: &Settings, base: &[Point2<f64>], stream: &mut Stream) {
        self.settings = Some(*settings);
        let inner = &base[1.min(base.len())..base.len().saturating_sub(1).max(1.min(base.len()))];
        self.via = settings.via_points.min(inner.len());
        (self.start, self.goal) = match base {
            [] => (Point2::origin(), Point2::origin()),
            [first, .., last] => (*first, *last),
            [only] => (*only, *only),
        };
        (self.low, self.high) = bounds(base);
        let margin = Vector2::new(settings.box_m, settings.box_m);
        (self.low, self.high) = (self.low - margin, self.high + margin);
        for list in [&mut self.x, &mut self.own, &mut self.best, &mut self.next_best] {
            list.clear();
        }
        self.v.clear();
        self.own_cost.clear();
        self.own_cost.resize(settings.particles, f64::INFINITY);
        self.history.clear();
        (self.iteration, self.particle, self.next_cost) = (0, 0, f64::INFINITY);
        self.mark = (f64::INFINITY, 0);
        for particle in 0..settings.particles {
            let first = self.x.len();
            self.draw(inner, stream);
            if particle > 0 {
                self.scatter(settings, particle, first, stream);
                for i in first..self.x.len() {
                    let jitter = Vector2::new(stream.normal(), stream.normal()) * settings.jitter_m;
                    self.x[i] = clip(self.x[i] + jitter, self.low, self.high);
                }
            }
        }
        let limit = self.speed_limit();
        for _ in 0..self.x.len() {
            let part = Vector2::new(stream.between(-1.0, 1.0), stream.between(-1.0, 1.0));
            self.v.push(START_SPEED * limit.component_mul(&part));
        }
        self.own.extend_from_slice(&self.x);
        self.best.extend_from_slice(&self.x[..self.via]);
        self.next_best.extend_from_slice(&self.x[..self.via]);
    }

    /// Appends `via` different points of `inner`, in their order.
    fn draw(&mut self, inner: &[Point2<f64>], stream: &mut Stream) {
        // Choosing a set of k out of n in one pass: the i-th is taken with (what is still wanted) / (what is left).
        let mut wanted = self.via;
        for (i, point) in inner.iter().enumerate() {
            if wanted == 0 {
                return;
            }
            if stream.unit() * ((inner.len() - i) as f64) < wanted as f64 {
                self.x.push(*point);
                wanted -= 1;
            }
        }
    }

    /// Moves the via points of a particle from `first` on: every second particle as a whole to one side, which finds the
    /// way round things; the others each where it will, which finds the way out of pockets.
    fn scatter(&mut self, settings: &Settings, particle: usize, first: usize, stream: &mut Stream) {
        if settings.aside_m <= 0.0 {
            return;
        }
        let along = (self.goal - self.start).try_normalize(0.0).unwrap_or_default();
        let left = Vector2::new(-along.y, along.x);
        let side = stream.normal();
        for i in first..self.x.len() {
            self.x[i] += settings.aside_m
                * if particle % 2 == 1 {
                    (side + OWN_PART * stream.normal()) * left
                } else {
                    Vector2::new(stream.normal(), stream.normal())
                };
        }
    }

    fn speed_limit(&self) -> Vector2<f64> {
        self.settings.map_or(0.0, |settings| settings.clamp) * (self.high - self.low)
    }

    /// Moves and evaluates particles until `budget` distance computations are spent; what is begun is ended, so that it
    /// may be overdrawn by one particle. True when the swarm has ended.
    pub fn advance(&mut self, terrain: &impl Terrain, stream: &mut Stream, budget: &mut i64) -> bool {
        let Some(settings) = self.settings else { return true };
        while !self.ended(&settings) {
            if *budget <= 0 {
                return false;
            }
            if self.iteration > 0 {
                self.step_particle(&settings, stream);
            }
            let own = self.particle * self.via..(self.particle + 1) * self.via;
            let via = &self.x[own.clone()];
            self.spline.fit([self.start].into_iter().chain(via.iter().copied()).chain([self.goal]));
            self.spline.sample(settings.samples, &mut self.samples);
            let (penalty, evaluations) = terrain.penalty(&self.samples);
            let cost = length(&self.samples) + penalty;
            *budget -= (evaluations + 2 * self.samples.len() as u64) as i64;
            if cost < self.own_cost[self.particle] {
                self.own_cost[self.particle] = cost;
                self.own[own.clone()].copy_from_slice(&self.x[own.clone()]);
                if cost < self.next_cost {
                    self.next_cost = cost;
                    self.next_best.copy_from_slice(&self.x[own]);
                }
            }
            self.particle += 1;
            if self.particle == settings.particles {
                self.end_iteration(&settings);
            }
        }
        true
    }

    /// (21) with the clamp, (22) with the box.
    fn step_particle(&mut self, settings: &Settings, stream: &mut Stream) {
        let limit = self.speed_limit();
        let Settings { inertia: w, own_pull: c1, swarm_pull: c2, .. } = *settings;
        for j in 0..self.via {
            let i = self.particle * self.via + j;
            for axis in 0..2 {
                let (r1, r2) = (stream.unit(), stream.unit());
                let (v, x, own, best) = (self.v[i][axis], self.x[i][axis], self.own[i][axis], self.best[j][axis]);
                self.v[i][axis] = velocity(w, c1, c2, v, x, own, best, r1, r2).clamp(-limit[axis], limit[axis]);
            }
            self.x[i] = clip(self.x[i] + self.v[i], self.low, self.high);
        }
    }

    fn end_iteration(&mut self, settings: &Settings) {
        self.particle = 0;
        self.best.copy_from_slice(&self.next_best);
        self.history.push(self.next_cost);
        if self.next_cost < self.mark.0 - settings.gain_m {
            self.mark = (self.next_cost, self.iteration);
        }
        self.iteration += 1;
    }

    fn ended(&self, settings: &Settings) -> bool {
        let tired = settings.patience > 0 && self.iteration > self.mark.1 + settings.patience;
        self.particle == 0 && (self.iteration > settings.iterations || tired || (self.via == 0 && self.iteration > 0))
    }

    /// Iterations so far, without the first evaluation.
    pub fn iterations(&self) -> usize {
        self.history.len().saturating_sub(1)
    }

    /// Best cost after the first evaluation and after each iteration.
    pub fn history(&self) -> &[f64] {
        &self.history
    }

    /// Via points of the best particle so far.
    pub fn best(&self) -> &[Point2<f64>] {
        &self.best
    }

    /// The spline of the best particle sampled [`FINER`] times finer, if the terrain lets it pass.
    pub fn fine_path(&mut self, terrain: &impl Terrain) -> Option<&[Point2<f64>]> {
        let samples = self.settings.map_or(2, |settings| settings.samples);
        self.spline.fit([self.start].into_iter().chain(self.best.iter().copied()).chain([self.goal]));
        self.spline.sample(FINER * samples, &mut self.fine);
        terrain.passes(&self.fine).then_some(self.fine.as_slice())
    }

    /// The spline that was last checked, whether it passed or not.
    pub fn fine(&self) -> &[Point2<f64>] {
        &self.fine
    }

    /// Takes all the memory that a swarm of these settings will need.
    pub fn reserve(&mut self, settings: &Settings) {
        let Settings { via_points, particles, samples, iterations, .. } = *settings;
        let coordinates = via_points * particles;
        self.x.reserve(coordinates);
        self.v.reserve(coordinates);
        self.own.reserve(coordinates);
        self.own_cost.reserve(particles);
        self.best.reserve(via_points);
        self.next_best.reserve(via_points);
        self.history.reserve(iterations + 1);
        self.spline = Spline::with_capacity(via_points + 2);
        self.samples.reserve(samples.max(2));
        self.fine.reserve(FINER * samples.max(2));
    }
}

/// Lowest and greatest coordinates.
pub(super) fn bounds(points: &[Point2<f64>]) -> (Point2<f64>, Point2<f64>) {
    let first = points.first().copied().unwrap_or_default();
    points.iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)))
}

fn clip(p: Point2<f64>, low: Point2<f64>, high: Point2<f64>) -> Point2<f64> {
    p.sup(&low).inf(&high)
}
