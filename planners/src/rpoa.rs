//! Random particle optimisation: each tick, try points on a small circle and step to the one that gains most distance
//! among those that climb no obstacle's hill.
//!
//! B. Mohajer, K. Kiani, E. Samiei, M. Sharifi, "A new online random particles optimization algorithm for mobile robot
//! path planning in dynamic environments", Mathematical Problems in Engineering, 2013, article 491346.
//! Formulas also from the follow-up: H. Khan, H. S. Agha, I. Saeed, L. A. Khan, "Optimal path planning of a mobile
//! robot using quadrant based random particle optimization method", 2014.
//!
//! | paper | here           | unit | default | larger means                                                |
//! |-------|----------------|------|---------|-------------------------------------------------------------|
//! | n     | `particles`    |      | 60      | straighter ways, more to compute                            |
//! | C_t   | `step_radius`  | m    | 0.1 or more | looks further ahead, turns later; speed is at most C_t / dt |
//! | r_s   | `sensor_range` | m    | 1.0     | gives way sooner; too large: feels too many hills at once   |
//! | α_o   | `alpha_obs`    |      | 1.0     | obstacles near the target count more                        |
//! | μ_o   | `mu_obs`       | 1/m² | 1.0     | narrower hills: passes narrower gaps                        |
//! | α_T   | `alpha_target` |      | 1.0     | approaches a target beside an obstacle more boldly          |
//! | μ_T   | `mu_target`    | 1/m² | 1.0     | the target pulls against hills from less far                |
//! | λ     | `lambda`       |      | 0       | modified rule: shyer; 0 is the basic rule                   |
//! |       | `nearer_only`  |      | off     |                                                             |
//! |       | `angles`       |      | random  |                                                             |
//! |       | `guard`        |      | on      |                                                             |
//! |       | `d_safe`       | m    | 0.15    | the guard keeps further away                                |
//! |       | `heading_gain` | 1/s  | 3.0     | a unicycle turns sharper                                    |
//!
//! The numbers of the paper's tables are lost; all defaults are ours, except heights and widths, which are the
//! follow-up's.
//!
//! Differs from the paper:
//! - Hills stand on the distance to the inflated surface, clamped at zero, not to a point.
//! - An obstacle is sensed or not from where the robot is, for all particles of the tick alike: otherwise e_J jumps.
//! - With nothing sensed the particle nearest to the target is taken without looking at costs. The paper argues that
//!   the rule comes to this by itself, but the target's Gaussian underflows to 0 beyond 27 m.
//! - If no particle lowers the cost, the one that raises it least is taken.
//! - The paper can be read to ask that a particle also comes nearer to the target. Met head-on, an obstacle leaves
//!   almost no such particle; only the cost is asked, unless `nearer_only`.
//! - The clearance guard, not in the paper: particles within `d_safe` of a sensed surface are passed over unless they
//!   gain clearance. Without it the sum of the hills can fall while one of them is climbed, through an obstacle. A
//!   unicycle, which turns towards its particle while it drives, only turns if its course would be passed over so.
//! - Nearer to the target than C_t the circle shrinks to that distance, so that the robot can stand on it.
//! - The robot need not get to the particle within a tick: it drives towards it, at most at its speed limit.
//! - Other robots are hills too, where they should be by now; of what is moving, nothing is predicted.
//!
//! Known limits: concave groups of obstacles trap it (see [`Rpoa::is_stuck`]). Gaps narrower than the hills are wide do
//! too: where obstacles stand nearer to each other than 1.5 m, `mu_obs` should be about 1 / gap². The guard does not
//! foresee: what moves towards the robot may touch it.

use crate::method::{Identity, Length, Method, Symmetry};
use crate::params::ParamError;
use crate::planner::{Plan, PlanInput, Planner, solid};
use crate::steering::steer_to_goal;
use geometry::Capsule;
use model::random::Stream;
use model::{BodyKind, Drive, ParamValues};
use nalgebra::{Point2, Vector2};
use std::f64::consts::TAU;

/// A robot that was heard is taken to have kept its course up to this age of its message, s.
const COURSE_S_MAX: f64 = 0.3;
/// A robot that gets no nearer to its target than this, m ...
const PROGRESS_M: f64 = 0.1;
/// ... in this time is stuck, s.
const PATIENCE_S: f64 = 5.0;
/// A target that is further away from where it was a tick ago is another one, m.
const SAME_TARGET_M: f64 = 0.5;

/// Registry entry.
pub static METHOD: Method = Method {
    name: "rpoa",
    summary: "random particles: the step that gains most distance without climbing an obstacle's hill",
    source: "Mohajer et al. 2013, doi 10.1155/2013/491346",
    // Particles stand at angles from +x, whichever way the world is turned.
    symmetry: Symmetry { rotation: false, reflection: false, ..Symmetry::FULL },
    kinds: BodyKind::MOBILE,
    params: Params::specs,
    speed_mps,
    lengths: &[
        Length::of("sensor_range", 1),
        Length::of("d_safe", 1),
        Length::of("mu_obs", -2),
        Length::of("mu_target", -2),
    ],
    wants_filter: false,
    follows_ways: false,
    build,
};

crate::choice! {
    /// Where the particles jump to.
    pub enum Angles {
        /// To random points of the circle, as in the paper.
        Random = "random",
        /// To equal parts of the circle, from +x on; of equals, the first. The follow-up does so.
        Equal = "equal",
    }
}

crate::params! {
    /// Parameters that a scenario can set.
    pub struct Params {
        /// Number of particles n. Larger: straighter paths, more computation.
        particles: u32 = 60, "", 1..=1000;
        /// Radius C_t of the particles' circle. Larger: looks further ahead, turns later. Limits the speed to one radius
        /// a tick; the default follows the speed limit: it is at least what the body drives in a tick.
        step_radius: f64 = 0.1, "m", 0.001..=10.0;
        /// Sensor range r_s to an inflated surface. Larger: gives way sooner; too large: many hills overlap.
        sensor_range: f64 = 1.0, "m", 0.0..=100.0;
        /// Height α_o of an obstacle's Gaussian. Larger: obstacles near the target count more.
        alpha_obs: f64 = 1.0, "", 0.0..=1e6;
        /// Width parameter μ_o of an obstacle's Gaussian. Larger: narrower hills, passes narrower gaps.
        mu_obs: f64 = 1.0, "1/m²", 0.0..=1e6;
        /// Height α_T of the target's Gaussian. Larger: approaches a target beside an obstacle more boldly.
        alpha_target: f64 = 1.0, "", 0.0..=1e6;
        /// Width parameter μ_T of the target's Gaussian. Larger: pulls against hills from less far.
        mu_target: f64 = 1.0, "1/m²", 0.0..=1e6;
        /// Weight λ of the cost in the modified rule, which takes the smallest e_D + λ e_J. Larger: shyer; 0: the basic
        /// rule.
        lambda: f64 = 0.0, "", 0.0..=1e6;
        /// Take only particles that are nearer to the target than the robot is (e_D < 0), as the paper's text can be read: then
        /// it hardly gets round an obstacle that it meets head-on.
        nearer_only: bool = false, "";
        /// Random particles, or equal parts of the circle for repeatable examples.
        angles: Angles = Angles::Random, "";
        /// Reject particles that are too near to a surface. Not in the paper.
        guard: bool = true, "";
        /// Minimum distance to a surface for the guard. Larger: keeps further away.
        d_safe: f64 = 0.15, "m", 0.0..=100.0;
        /// Turn rate of a unicycle per radian of heading error. Larger: turns sharper.
        heading_gain: f64 = 3.0, "1/s", 0.0..=100.0;
    }
}

/// The method at work for one robot. Of the past it keeps only the random stream and the progress to the target.
pub struct Rpoa {
    params: Params,
    /// C_t is nobody's choice and grows with what the body drives in a tick.
    follows_speed: bool,
    stream: Stream,
    sensed: Sensed,
    progress: Progress,
}

fn build(values: &ParamValues, identity: Identity) -> Result<Box<dyn Planner>, ParamError> {
    let follows_speed = Params::step_radius.given(values).is_none();
    Ok(Box::new(Rpoa { follows_speed, ..Rpoa::new(Params::from_values(values)?, identity) }))
}

/// One radius a tick.
fn speed_mps(values: &ParamValues, dt_s: f64) -> f64 {
    let given = Params::step_radius.given(values).is_some();
    if given { Params::default().with(values).step_radius / dt_s } else { f64::INFINITY }
}

impl Planner for Rpoa {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        if self.follows_speed {
            self.params.step_radius = Params::default().step_radius.max(input.limits.speed_mps_max * input.dt_s);
        }
        self.progress.note(input);
        if input.arrived {
            return Plan { stopped: true, ..Plan::only(Drive::stop(input.kind)) };
        }
        self.sense(input);
        let Step { offset, nearest, .. } = self.choose(input.position, input.goal);
        let velocity = offset.cap_magnitude(input.limits.speed_mps_max * input.dt_s) / input.dt_s;
        let drive = match input.kind {
            BodyKind::Point => Drive::Velocity(velocity),
            BodyKind::Unicycle | BodyKind::DiffDrive => {
                let twist = steer_to_goal(velocity, self.params.heading_gain, input);
                if self.guards_against(twist, input) { turn_only(twist) } else { twist }
            }
            BodyKind::TwoLinkArm => Drive::stop(input.kind),
        };
        Plan { attractive: nearest, repulsive: offset - nearest, ..Plan::only(drive) }
    }
}

/// The particle of one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Its number in the order of drawing.
    pub index: usize,
    /// From the robot to it, m.
    pub offset: Vector2<f64>,
    /// From the robot to the particle that is nearest to the target, m.
    pub nearest: Vector2<f64>,
    /// Which rule took it.
    pub rule: Rule,
}

/// How a particle came to be taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// Nothing sensed: the nearest to the target.
    Glide,
    /// The nearest to the target of those that lower the cost.
    Avoid,
    /// None lowers the cost: the one that raises it least.
    Fallback,
    /// All are too near to a surface and gain no clearance: the one with the largest clearance.
    Guard,
    /// Modified rule: the smallest weighted sum.
    Weighted,
}

impl Rpoa {
    /// The method with these parameters, for this robot.
    pub fn new(params: Params, identity: Identity) -> Rpoa {
        let stream = Stream::new(identity.seed, identity.robot, identity.incarnation, "rpoa");
        Rpoa { params, follows_speed: false, stream, sensed: Sensed::default(), progress: Progress::default() }
    }

    /// Whether the robot came no nearer to its target than 0.1 m in the last 5 s although it has not arrived: it sits in
    /// a trap, or circles.
    pub fn is_stuck(&self) -> bool {
        self.progress.stuck
    }

    /// Forgets what was sensed before and takes in what is within range now.
    pub fn sense(&mut self, input: &PlanInput<'_>) {
        let Params { sensor_range, step_radius, .. } = self.params;
        self.sensed.hills.clear();
        self.sensed.surfaces.clear();
        // Beyond this, a piece is nowhere on the circle the nearest of its obstacle: both distances may change by C_t.
        let reach = 2.0 * step_radius;
        for pieces in input.obstacles.chunk_by(|a, b| a.id == b.id) {
            match solid(pieces, input.position) {
                Some(inside) => self.sensed.add([inside].into_iter(), input, sensor_range, reach),
                None => self.sensed.add(pieces.iter().map(|piece| piece.shape), input, sensor_range, reach),
            }
        }
        for neighbor in input.neighbors {
            let position = neighbor.position + neighbor.velocity * neighbor.age_s.clamp(0.0, COURSE_S_MAX);
            let body = Capsule::disc(position, neighbor.radius_m);
            self.sensed.add([body].into_iter(), input, sensor_range, reach);
        }
    }

    /// J(θ) over what was sensed, for this target.
    pub fn cost(&mut self, theta: Point2<f64>, target: Point2<f64>) -> f64 {
        self.sensed.measure(theta);
        self.cost_of_measured(theta, target)
    }

    /// Draws particles round the robot and takes one.
    pub fn choose(&mut self, position: Point2<f64>, target: Point2<f64>) -> Step {
        let Params { particles, step_radius, lambda, nearer_only, .. } = self.params;
        let to_target = (target - position).norm();
        let radius = step_radius.min(to_target);
        let clearance_now = self.sensed.measure(position);
        let cost_now = self.cost_of_measured(position, target);
        let sees_nothing = self.sensed.hills.is_empty();
        let (mut nearest, mut avoid, mut shy, mut clear) = (Best::NONE, Best::NONE, Best::NONE, Best::NONE);
        for index in 0..particles {
            let offset = radius * self.direction(index);
            let theta = position + offset;
            let candidate = |score: f64| Best { score, index: index as usize, offset };
            let e_d = (target - theta).norm() - to_target;
            nearest.improve(candidate(e_d));
            // Further from the target than one that will do: whatever its cost, it is not taken.
            if sees_nothing || (lambda == 0.0 && e_d >= avoid.score) {
                continue;
            }
            let clearance = self.sensed.measure(theta);
            clear.improve(candidate(-clearance));
            if self.too_near(clearance, clearance_now) || (nearer_only && e_d >= 0.0) {
                continue;
            }
            let e_j = self.cost_of_measured(theta, target) - cost_now;
            if lambda > 0.0 {
                avoid.improve(candidate(e_d + lambda * e_j));
            } else if e_j < 0.0 {
                avoid.improve(candidate(e_d));
            }
            shy.improve(candidate(e_j));
        }
        let (best, rule) = if sees_nothing {
            (nearest, Rule::Glide)
        } else if avoid.is_some() {
            (avoid, if lambda > 0.0 { Rule::Weighted } else { Rule::Avoid })
        } else if shy.is_some() {
            (shy, Rule::Fallback)
        } else {
            (clear, Rule::Guard)
        };
        Step { index: best.index, offset: best.offset, nearest: nearest.offset, rule }
    }

    /// Whether the guard forbids where a unicycle gets with this twist: on its way to a particle it may drive elsewhere.
    fn guards_against(&mut self, drive: Drive, input: &PlanInput<'_>) -> bool {
        let Drive::Twist { speed_mps, turn_radps } = drive else { return false };
        let (sin, cos) = (input.yaw_rad + turn_radps * input.dt_s).sin_cos();
        let next = input.position + speed_mps * input.dt_s * Vector2::new(cos, sin);
        let (clearance_now, clearance) = (self.sensed.measure(input.position), self.sensed.measure(next));
        self.too_near(clearance, clearance_now)
    }

    /// The guard: too near to a surface, and no further from it than now.
    fn too_near(&self, clearance: f64, clearance_now: f64) -> bool {
        let Params { guard, d_safe, .. } = self.params;
        guard && clearance < d_safe && clearance <= clearance_now
    }

    /// φ_i
    fn direction(&mut self, index: u32) -> Vector2<f64> {
        let angle = match self.params.angles {
            Angles::Random => TAU * self.stream.unit(),
            Angles::Equal => TAU * f64::from(index) / f64::from(self.params.particles),
        };
        let (sin, cos) = angle.sin_cos();
        Vector2::new(cos, sin)
    }

    /// J = J_obs + J_T of the point measured last.
    fn cost_of_measured(&self, theta: Point2<f64>, target: Point2<f64>) -> f64 {
        let Params { alpha_obs, mu_obs, alpha_target, mu_target, .. } = self.params;
        let hills: f64 = self.sensed.hills.iter().map(|hill| gaussian(alpha_obs, mu_obs, hill.distance.max(0.0))).sum();
        hills - gaussian(alpha_target, mu_target, (theta - target).norm())
    }
}

fn turn_only(drive: Drive) -> Drive {
    match drive {
        Drive::Twist { turn_radps, .. } => Drive::Twist { speed_mps: 0.0, turn_radps },
        other => other,
    }
}

/// α exp(−μ d²)
pub fn gaussian(alpha: f64, mu: f64, d: f64) -> f64 {
    alpha * (-mu * d * d).exp()
}

/// The candidate with the smallest score so far; of equals, the first.
#[derive(Clone, Copy)]
struct Best {
    score: f64,
    index: usize,
    offset: Vector2<f64>,
}

impl Best {
    const NONE: Best = Best { score: f64::INFINITY, index: 0, offset: Vector2::new(0.0, 0.0) };

    fn improve(&mut self, candidate: Best) {
        if candidate.score < self.score {
            *self = candidate;
        }
    }

    fn is_some(&self) -> bool {
        self.score < f64::INFINITY
    }
}

/// What is within sensor range: one hill an obstacle or robot, over one or more surfaces.
#[derive(Default)]
struct Sensed {
    hills: Vec<Hill>,
    surfaces: Vec<Capsule>,
}

struct Hill {
    /// Its surfaces end here; they begin where those of the hill before end.
    end: usize,
    /// From the point measured last to its nearest inflated surface, m; negative inside.
    distance: f64,
}

impl Sensed {
    /// Adds an obstacle if its inflated surface is in range, but none of its pieces that are further away than the
    /// nearest by more than `reach`.
    fn add(&mut self, pieces: impl Iterator<Item = Capsule> + Clone, input: &PlanInput<'_>, range: f64, reach: f64) {
        let inflated = pieces.map(|piece| Capsule { radius: piece.radius + input.radius_m, ..piece });
        let distance = inflated.clone().map(|piece| piece.distance(input.position)).fold(f64::INFINITY, f64::min);
        if distance <= range {
            self.surfaces.extend(inflated.filter(|piece| piece.distance(input.position) <= distance + reach));
            self.hills.push(Hill { end: self.surfaces.len(), distance });
        }
    }

    /// Measures the distance to every hill and returns the smallest.
    fn measure(&mut self, theta: Point2<f64>) -> f64 {
        let (mut begin, mut smallest) = (0, f64::INFINITY);
        for hill in &mut self.hills {
            let surfaces = &self.surfaces[begin..hill.end];
            hill.distance = surfaces.iter().map(|surface| surface.distance(theta)).fold(f64::INFINITY, f64::min);
            smallest = smallest.min(hill.distance);
            begin = hill.end;
        }
        smallest
    }
}

/// Keeps an eye on whether the target comes nearer.
#[derive(Default)]
struct Progress {
    target: Option<Point2<f64>>,
    /// Smallest distance that counted as progress, m, and when it was reached, s.
    best_m: f64,
    since_s: f64,
    stuck: bool,
}

impl Progress {
    fn note(&mut self, input: &PlanInput<'_>) {
        let now_s = input.tick as f64 * input.dt_s;
        let distance = (input.goal - input.position).norm();
        let same_target = self.target.is_some_and(|target| (input.goal - target).norm() <= SAME_TARGET_M);
        self.target = Some(input.goal);
        if !same_target || input.arrived || distance <= self.best_m - PROGRESS_M {
            (self.best_m, self.since_s) = (distance, now_s);
        }
        self.stuck = now_s - self.since_s >= PATIENCE_S;
    }
}
