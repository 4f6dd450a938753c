//! Artificial potential field.
//!
//! O. Khatib, "Real-time obstacle avoidance for manipulators and mobile robots",
//! Int. J. Robotics Research 5(1), 1986, pp. 90-98.
//!
//! | paper | here           | unit | default | larger means                          |
//! |-------|----------------|------|---------|---------------------------------------|
//! | k_p   | `k_att`        | 1/s  | 1.0     | faster towards the goal               |
//! |       | `attract_cap_m`| m    | 2.0     | pulls harder from afar; 0 is no limit |
//! | η     | `k_rep`        | m⁴/s | 0.2     | wider around everything               |
//! | ρ₀    | `influence_m`  | m    | 1.0     | feels things sooner                   |
//! |       | `heading_gain` | 1/s  | 3.0     | a unicycle turns sharper              |
//!
//! The paper leaves η and ρ₀ to the reader. The values here are ours: among those tried in the environments of
//! [`decentralized_apf`](crate::decentralized_apf), with poses one tick old, they gave short times at clearances
//! above 0.25 m.
//!
//! Differs from the paper:
//! - The field commands a velocity, not a force on a damped mass, and is capped at the speed limit.
//! - The paper limits the speed of the free approach; here the pull itself has a limit, which comes to the same far
//!   from everything and keeps the pull from overpowering the push near things.
//! - Other robots push like obstacles, from where they were last heard.
//! - ρ is at least 1 mm, so that overlapping bodies are pushed apart by a finite amount.
//!
//! Known limits: local minima, and goals that stand within the influence of an obstacle.

use crate::drive::{Drive, Kind, steer};
use crate::geometry::Capsule;
use crate::params::{ParamError, ParamValues};
use crate::planner::{Plan, PlanInput, Planner, nearest_by_id};
use crate::registry::{Identity, Method, Symmetry};
use nalgebra::{Point2, Vector2};

/// Surfaces count as at least this far apart, so that the field stays finite, m.
const RHO_MIN_M: f64 = 0.001;

/// The line of the registry.
pub static METHOD: Method = Method {
    name: "apf",
    summary: "artificial potential field: the goal pulls, obstacles and robots push",
    source: "Khatib 1986, Int. J. Robotics Research 5(1)",
    symmetry: Symmetry::FULL,
    params: Params::specs,
    build,
};

crate::params! {
    /// What a scenario can change.
    pub struct Params {
        /// Attraction gain k_p. Larger: faster towards the goal.
        k_att: f64 = 1.0, "1/s", 0.0..=100.0;
        /// The pull grows up to this distance from the goal. Larger: pulls harder from afar; 0: grows without limit.
        attract_cap_m: f64 = 2.0, "m", 0.0..=1e6;
        /// Repulsion gain η. Larger: wider around everything.
        k_rep: f64 = 0.2, "m⁴/s", 0.0..=100.0;
        /// Influence distance ρ₀, from surface to surface. Larger: feels things sooner.
        influence_m: f64 = 1.0, "m", 0.01..=100.0;
        /// Turn rate of a unicycle per radian of heading error. Larger: turns sharper.
        heading_gain: f64 = 3.0, "1/s", 0.0..=100.0;
    }
}

/// The method at work for one robot; it remembers nothing.
#[derive(Clone, Debug)]
pub struct Khatib {
    params: Params,
    /// Own slot: settles who goes where when centres coincide.
    robot: u32,
}

fn build(values: &ParamValues, identity: Identity) -> Result<Box<dyn Planner>, ParamError> {
    Ok(Box::new(Khatib::new(Params::from_values(values)?, identity)))
}

impl Planner for Khatib {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        let x = input.position;
        let attractive = self.attraction(x, input.goal);
        let obstacles = nearest_by_id(input.obstacles, x)
            .map(|obstacle| self.firas(&obstacle.shape, x, input.radius_m, Vector2::x()));
        let robots = input.neighbors.iter().map(|neighbor| {
            // Two robots with one centre must not be pushed the same way, so the lower slot goes back.
            let apart = if self.robot < neighbor.id { -Vector2::x() } else { Vector2::x() };
            self.firas(&Capsule::disc(neighbor.position, neighbor.radius_m), x, input.radius_m, apart)
        });
        let repulsive: Vector2<f64> = obstacles.chain(robots).sum();
        let velocity = (attractive + repulsive).cap_magnitude(input.limits.speed_mps_max);
        let drive = match input.kind {
            Kind::Point => Drive::Velocity(velocity),
            Kind::Unicycle => steer(velocity, input.yaw_rad, self.params.heading_gain, &input.limits),
        };
        Plan { drive, attractive, repulsive }
    }
}

impl Khatib {
    /// The method with these parameters, for this robot.
    pub fn new(params: Params, identity: Identity) -> Khatib {
        Khatib { params, robot: identity.robot }
    }

    /// The negative gradient of the attractive potential, k_p/2 |x − x_d|², with its limit.
    fn attraction(&self, x: Point2<f64>, x_d: Point2<f64>) -> Vector2<f64> {
        let Params { k_att: k_p, attract_cap_m, .. } = self.params;
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
