//! Artificial potential field.
//!
//! O. Khatib, "Real-time obstacle avoidance for manipulators and mobile robots",
//! Int. J. Robotics Research 5(1), 1986, pp. 90-98.
//!
//! | paper | here           | unit | default | larger means                          |
//! |-------|----------------|------|---------|---------------------------------------|
//! | k_p   | `k_att`        | 1/s  | 1.0     | faster towards the goal               |
//! |       | `attract_cap_m`| m    | 2.0 or more | pulls harder from afar; 0 is no limit |
//! | η     | `k_rep`        | m⁴/s | 0.2     | wider around everything               |
//! | ρ₀    | `influence_m`  | m    | 1.0     | feels things sooner                   |
//! | k_v   | `damping`      | 1/s  | 1.0     | (second order) calmer, slower         |
//! |       | `order`        |      | first   |                                       |
//! |       | `heading_gain` | 1/s  | 3.0     | a unicycle turns sharper              |
//!
//! The paper leaves η and ρ₀ to the reader. The values here are ours: among those tried in the environments of
//! [`decentralized_apf`](crate::decentralized_apf), with poses one tick old, they gave short times at clearances
//! above 0.25 m.
//!
//! Differs from the paper:
//! - By default the field commands a velocity, capped at the speed limit. With `order = "second"` it is the force on a
//!   damped unit mass, as in the paper: v += (pull + push − k_v v) dt, also capped. A point is that mass itself; a
//!   unicycle follows one that it imagines, because its own velocity cannot go sideways.
//! - The paper limits the speed of the free approach; here the pull itself has a limit, which comes to the same far
//!   from everything and keeps the pull from overpowering the push near things.
//! - Other robots push like obstacles, from where they were last heard.
//! - ρ is at least 1 mm, so that overlapping bodies are pushed apart by a finite amount.
//!
//! Known limits: local minima, and goals that stand within the influence of an obstacle.

use crate::method::{Identity, Length, Method, Symmetry};
use crate::params::ParamError;
use crate::planner::{Plan, PlanInput, Planner, nearest_by_id};
use crate::steering::steer_to_goal;
use geometry::Capsule;
use model::{BodyKind, Drive, ParamValues};
use nalgebra::{Point2, Vector2};

/// Surfaces count as at least this far apart, so that the field stays finite, m.
const RHO_MIN_M: f64 = 0.001;

/// Registry entry.
pub static METHOD: Method = Method {
    name: "apf",
    summary: "artificial potential field: the goal pulls, obstacles and robots push",
    source: "Khatib 1986, Int. J. Robotics Research 5(1)",
    symmetry: Symmetry::FULL,
    kinds: BodyKind::MOBILE,
    params: Params::specs,
    speed_mps,
    lengths: &[Length::of("influence_m", 1), Length::of("k_rep", 3)],
    wants_filter: false,
    follows_ways: false,
    build,
};

crate::choice! {
    /// What the field commands.
    pub enum Order {
        /// A velocity.
        First = "first",
        /// A force on a damped unit mass.
        Second = "second",
    }
}

crate::params! {
    /// Parameters that a scenario can set.
    pub struct Params {
        /// Attraction gain k_p. Larger: faster towards the goal.
        k_att: f64 = 1.0, "1/s", 0.0..=100.0;
        /// The pull grows up to this distance from the goal. Larger: pulls harder from afar; 0: grows without limit. The
        /// default follows the speed limit: 2 m for every m/s, from 1 m/s on.
        attract_cap_m: f64 = 2.0, "m", 0.0..=1e6;
        /// Repulsion gain η. Larger: wider around everything.
        k_rep: f64 = 0.2, "m⁴/s", 0.0..=100.0;
        /// Influence distance ρ₀, from surface to surface. Larger: feels things sooner.
        influence_m: f64 = 1.0, "m", 0.01..=100.0;
        /// What the field commands: a velocity, or a force on a damped unit mass.
        order: Order = Order::First, "";
        /// Damping k_v of that mass. Larger: calmer, slower.
        damping: f64 = 1.0, "1/s", 0.0..=100.0;
        /// Turn rate of a unicycle per radian of heading error. Larger: turns sharper.
        heading_gain: f64 = 3.0, "1/s", 0.0..=100.0;
    }
}

/// The method at work for one robot; a unicycle of second order remembers a velocity, others nothing.
#[derive(Clone, Debug)]
pub struct Khatib {
    params: Params,
    /// The limit of the pull is nobody's choice and grows with the speed limit.
    follows_speed: bool,
    /// The velocity of the mass that a unicycle imagines, m/s.
    imagined: Option<Vector2<f64>>,
    /// Own slot: settles who goes where when centres coincide.
    robot: u32,
}

fn build(values: &ParamValues, identity: Identity) -> Result<Box<dyn Planner>, ParamError> {
    let follows_speed = Params::attract_cap_m.given(values).is_none();
    Ok(Box::new(Khatib { follows_speed, ..Khatib::new(Params::from_values(values)?, identity) }))
}

/// Far from everything: what the pull comes to, of second order against the damping.
fn speed_mps(values: &ParamValues, _: f64) -> f64 {
    let Params { k_att, attract_cap_m, order, damping, .. } = Params::default().with(values);
    if attract_cap_m == 0.0 {
        return f64::INFINITY;
    }
    let pull = k_att * attract_cap_m;
    match (order, Params::attract_cap_m.given(values).is_some()) {
        (Order::First, true) => pull,
        (Order::Second, true) => pull / damping,
        // It grows with the speed limit: enough for all of it, or for none.
        (Order::First, false) if k_att * Params::default().attract_cap_m >= 1.0 => f64::INFINITY,
        (Order::Second, false) if k_att * Params::default().attract_cap_m >= damping => f64::INFINITY,
        (_, false) => pull,
    }
}

impl Planner for Khatib {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        let x = input.position;
        let attractive = self.attraction(x, input.goal, input.limits.speed_mps_max);
        let obstacles = nearest_by_id(input.obstacles, x)
            .map(|obstacle| self.firas(&obstacle.shape, x, input.radius_m, Vector2::x()));
        let robots = input.neighbors.iter().map(|neighbor| {
            // Two robots with one centre must not be pushed the same way, so the lower slot goes back.
            let apart = if self.robot < neighbor.id { -Vector2::x() } else { Vector2::x() };
            self.firas(&Capsule::disc(neighbor.position, neighbor.radius_m), x, input.radius_m, apart)
        });
        let repulsive: Vector2<f64> = obstacles.chain(robots).sum();
        let velocity = self.commanded(attractive + repulsive, input).cap_magnitude(input.limits.speed_mps_max);
        self.imagined = Some(velocity);
        let drive = match input.kind {
            BodyKind::Point => Drive::Velocity(velocity),
            BodyKind::Unicycle | BodyKind::DiffDrive => steer_to_goal(velocity, self.params.heading_gain, input),
            BodyKind::TwoLinkArm => Drive::stop(input.kind),
        };
        // The field keeps holding the robot after it arrived, and lets it be pushed away: it does not stand still.
        Plan { attractive, repulsive, ..Plan::only(drive) }
    }
}

impl Khatib {
    /// The method with these parameters, for this robot.
    pub fn new(params: Params, identity: Identity) -> Khatib {
        Khatib { params, follows_speed: false, imagined: None, robot: identity.robot }
    }

    /// What the resultant of pull and push makes of the velocity.
    fn commanded(&self, resultant: Vector2<f64>, input: &PlanInput<'_>) -> Vector2<f64> {
        match self.params.order {
            Order::First => resultant,
            Order::Second => {
                let v = match input.kind {
                    BodyKind::Point | BodyKind::TwoLinkArm => input.velocity,
                    BodyKind::Unicycle | BodyKind::DiffDrive => self.imagined.unwrap_or(input.velocity),
                };
                v + (resultant - self.params.damping * v) * input.dt_s
            }
        }
    }

    /// The negative gradient of the attractive potential, k_p/2 |x − x_d|², with its limit.
    fn attraction(&self, x: Point2<f64>, x_d: Point2<f64>, speed_mps_max: f64) -> Vector2<f64> {
        let Params { k_att: k_p, attract_cap_m, .. } = self.params;
        let attract_cap_m = if self.follows_speed { attract_cap_m * speed_mps_max.max(1.0) } else { attract_cap_m };
        let to_goal = x_d - x;
        k_p * if attract_cap_m > 0.0 { to_goal.cap_magnitude(attract_cap_m) } else { to_goal }
    }

    /// FIRAS, the negative gradient of the repulsive potential η/2 (1/ρ − 1/ρ₀)² of one body:
    /// η (1/ρ − 1/ρ₀) (1/ρ²) ∇ρ inside the influence distance ρ₀, zero outside.
    fn firas(&self, body: &Capsule, x: Point2<f64>, radius: f64, apart: Vector2<f64>) -> Vector2<f64> {
        let Params { k_rep: eta, influence_m: rho_0, .. } = self.params;
        let offset = x - body.nearest_core(x);
        let away = offset.try_normalize(0.0).unwrap_or(apart);
        let rho = (offset.norm() - body.radius - radius).max(RHO_MIN_M);
        if rho >= rho_0 {
            return Vector2::zeros();
        }
        eta * (1.0 / rho - 1.0 / rho_0) / rho.powi(2) * away
    }
}
