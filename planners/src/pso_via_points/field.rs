//! The field and the raw path: section 2 of the paper, its force variants, and following them step by step.

use crate::planner::{Obstacle, nearest_by_id};
use geometry::Capsule;
use nalgebra::{Point2, Vector2};

/// Surfaces count as at least this far away, so that forces stay finite, m.
const D_MIN_M: f64 = 0.001;

/// Gains of the field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    /// K_a.
    pub k_att: f64,
    /// K_rep.
    pub k_rep: f64,
    /// d₀, to the obstacle's surface, m.
    pub influence_m: f64,
    /// n, the power of the distance to the goal in the repulsion.
    pub goal_power: u32,
    /// The constant force of (19) and (20).
    pub bias: Vector2<f64>,
    /// Within this distance of the goal the faded bias fades, m.
    pub bias_fade_m: f64,
}

/// How attraction and repulsion are put together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variant {
    /// (7), (8): their sum.
    Plain,
    /// (17), (18): the sum and the repulsion turned by +90 degrees.
    Left,
    /// (15), (16): the sum and the repulsion turned by -90 degrees.
    Right,
    /// (19), (20), with the constant force fading near the goal.
    FadedBias,
    /// (19), (20) as printed: it comes to rest beside the goal, so it is for comparison only.
    LiteralBias,
}

impl Variant {
    /// Those that can arrive, in the order in which they are tried.
    pub const ORDER: [Variant; 4] = [Variant::Plain, Variant::Left, Variant::Right, Variant::FadedBias];
}

/// What pushes.
#[derive(Clone, Copy, Debug)]
pub struct Bodies<'a> {
    /// Obstacles; of those with one id only the nearest piece pushes.
    pub obstacles: &'a [Obstacle],
    /// The ring that an arm reaches: centre, inner and outer radius. Both of its edges push.
    pub ring: Option<(Point2<f64>, f64, f64)>,
    /// What the robot's own radius takes off every distance to an obstacle, m.
    pub radius_m: f64,
}

impl Bodies<'_> {
    /// Calls `visit` with the distance to each body, m, and the direction away from it.
    fn each(&self, q: Point2<f64>, mut visit: impl FnMut(f64, Vector2<f64>)) {
        for obstacle in nearest_by_id(self.obstacles, q) {
            let (distance, away) = surface(&obstacle.shape, q);
            visit(distance - self.radius_m, away);
        }
        if let Some((center, inner, outer)) = self.ring {
            let (distance, away) = surface(&Capsule::disc(center, inner), q);
            visit(distance, away);
            visit(outer - inner - distance, -away);
        }
    }

    /// Distance computations that one force takes.
    pub fn evaluations(&self) -> u64 {
        self.obstacles.len() as u64 + 2 * u64::from(self.ring.is_some()) + 1
    }
}

/// Distance to the surface and direction away from it; a fixed direction in the very centre.
pub(super) fn surface(body: &Capsule, q: Point2<f64>) -> (f64, Vector2<f64>) {
    let offset = q - body.nearest_core(q);
    (offset.norm() - body.radius, offset.try_normalize(0.0).unwrap_or(Vector2::x()))
}

impl Field {
    /// (1): K_a/2 d(q, goal)².
    pub fn attractive_potential(&self, q: Point2<f64>, goal: Point2<f64>) -> f64 {
        self.k_att / 2.0 * (q - goal).norm_squared()
    }

    /// (2): −K_a (q − goal), a vector.
    pub fn attraction(&self, q: Point2<f64>, goal: Point2<f64>) -> Vector2<f64> {
        self.k_att * (goal - q)
    }

    /// (3), (4): the sum of K_rep/2 (1/d − 1/d₀)² Dⁿ over the bodies nearer than d₀.
    pub fn repulsive_potential(&self, q: Point2<f64>, goal: Point2<f64>, bodies: &Bodies<'_>) -> f64 {
        let to_goal = (q - goal).norm();
        let mut potential = 0.0;
        bodies.each(q, |d, _| {
            let bracket = self.bracket(d);
            potential += self.k_rep / 2.0 * bracket * bracket * to_goal.powi(self.goal_power as i32);
        });
        potential
    }

    /// The negative gradient of (4), which (5) is only for n = 0 and obstacles without extent:
    /// K_rep (1/d − 1/d₀) Dⁿ/d² e_o − n/2 K_rep (1/d − 1/d₀)² Dⁿ⁻¹ e_g.
    pub fn repulsion(&self, q: Point2<f64>, goal: Point2<f64>, bodies: &Bodies<'_>) -> Vector2<f64> {
        let from_goal = q - goal;
        let to_goal = from_goal.norm();
        let e_g = from_goal.try_normalize(0.0).unwrap_or_default();
        let n = self.goal_power as i32;
        let mut force = Vector2::zeros();
        bodies.each(q, |d, e_o| {
            let bracket = self.bracket(d);
            let d = d.max(D_MIN_M);
            force += self.k_rep * bracket * to_goal.powi(n) / (d * d) * e_o;
            if n > 0 {
                force -= 0.5 * f64::from(n) * self.k_rep * bracket * bracket * to_goal.powi(n - 1) * e_g;
            }
        });
        force
    }

    /// 1/d − 1/d₀ inside the influence distance, zero outside.
    fn bracket(&self, d: f64) -> f64 {
        if d < self.influence_m { 1.0 / d.max(D_MIN_M) - 1.0 / self.influence_m } else { 0.0 }
    }

    /// The force of a variant.
    pub fn force(&self, variant: Variant, q: Point2<f64>, goal: Point2<f64>, bodies: &Bodies<'_>) -> Vector2<f64> {
        let (att, rep) = (self.attraction(q, goal), self.repulsion(q, goal, bodies));
        let turned = match variant {
            Variant::Plain => Vector2::zeros(),
            Variant::Left => Vector2::new(-rep.y, rep.x),
            Variant::Right => Vector2::new(rep.y, -rep.x),
            Variant::FadedBias => self.bias * ((q - goal).norm() / self.bias_fade_m).min(1.0),
            Variant::LiteralBias => self.bias,
        };
        att + rep + turned
    }
}

/// A raw path in the making: steps of one length along the force until the goal is near.
#[derive(Clone, Debug, Default)]
pub struct RawPath {
    /// The points so far; of a path that arrived, with the goal itself at the end.
    pub points: Vec<Point2<f64>>,
    /// Whether it ended at the goal.
    pub arrived: bool,
}

/// What a raw path goes by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walk {
    /// Length of a step, m.
    pub step_m: f64,
    /// Within this distance the goal is appended, m.
    pub tolerance_m: f64,
    /// Steps after which the variant has failed.
    pub steps_max: usize,
}

impl RawPath {
    /// A path that starts here. Memory is kept.
    pub fn begin(&mut self, start: Point2<f64>) {
        self.points.clear();
        self.points.push(start);
        self.arrived = false;
    }

    /// Takes up to `steps` more steps. True when the path has ended: at the goal, or because it has failed.
    pub fn advance(
        &mut self,
        force: impl Fn(Point2<f64>) -> Vector2<f64>,
        goal: Point2<f64>,
        walk: &Walk,
        steps: usize,
    ) -> bool {
        for _ in 0..=steps {
            let Some(&q) = self.points.last() else { return true };
            if (q - goal).norm() <= walk.tolerance_m {
                self.points.push(goal);
                self.arrived = true;
                return true;
            }
            if self.points.len() > walk.steps_max {
                return true;
            }
            // Where no force is, there is no way on.
            let Some(along) = force(q).try_normalize(0.0) else { return true };
            self.points.push(q + walk.step_m * along);
        }
        false
    }
}

/// The raw path of one force variant, whole; where it ends if it does not arrive is its last point.
pub fn raw_path(
    field: &Field,
    variant: Variant,
    bodies: &Bodies<'_>,
    start: Point2<f64>,
    goal: Point2<f64>,
    walk: &Walk,
) -> RawPath {
    let mut path = RawPath::default();
    path.begin(start);
    path.advance(|q| field.force(variant, q, goal, bodies), goal, walk, usize::MAX - 1);
    path
}
