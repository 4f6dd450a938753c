//! Decentralised potential field: every robot adds the pull of its goal to the pushes of obstacles and of the other
//! robots, from nothing but exchanged positions.
//!
//! F. Matoui, B. Boussaid, B. Metoui, G. B. Frej et al., "Path planning of a group of robots with potential field
//! approach: decentralized architecture", IFAC World Congress 2017, doi 10.1016/j.ifacol.2017.08.1822.
//! The root is O. Khatib 1986, see [`apf`](crate::apf).
//!
//! | paper    | here            | unit  | default | larger means                                           |
//! |----------|-----------------|-------|---------|--------------------------------------------------------|
//! | ξ        | `xi`            | 1/s   | 1.0     | faster towards the goal                                |
//! | ξ, our η | `eta`           | m⁴/s  | 0.1     | wider around everything (with a squared bracket: m⁵/s) |
//! | p_oj     | `p_o`           | m     | 1.0     | feels obstacles sooner                                 |
//! | p_rk     | `p_r`           | m     | 1.0     | feels robots sooner                                    |
//! | 2        | `bracket_power` |       | 1       | softer onset at the threshold                          |
//! | p(a, b)  | `distance`      |       | surface |                                                        |
//! |          | `attract_cap`   | m     | 1.0 or more | pulls harder from afar; 0 pulls without limit      |
//! |          | `heading_gain`  | 1/s   | 3.0     | a unicycle turns sharper                               |
//! |          | `omega_max`     | rad/s | 3.0     | a unicycle may turn faster                             |
//! |          | `stale_s`       | s     | 0.3     | trusts the course of a silent robot longer             |
//! |          | `drop_s`        | s     | 2.0     | keeps away from a silent robot longer                  |
//! |          | `aid`, `aid_*`  |       | off     | see there                                              |
//!
//! The paper prints no numbers; all defaults are ours. The paper's own law is `eta = 1`, `bracket_power = 2`,
//! `distance = "centre"`, `attract_cap = 0`; with it bodies overlap, which is why it is not the default.
//!
//! Differs from the paper:
//! - (2) is printed as a scalar; here it is the vector −ξ (q − g) that it must be.
//! - (4) and (6) use the attraction's ξ as gain of the repulsion; here that has a symbol of its own, η.
//! - The squared bracket of (4) and (6) is not the gradient of the usual quadratic potential; the power is a
//!   parameter, 1 by default.
//! - Distances are between surfaces by default, and the pull has a limit.
//! - The resultant commands a velocity, capped at the speed limit; the paper only says that it gives the direction.
//! - A single push has a limit of 1000; distances count as at least 1 mm.
//! - What becomes of robots that fall silent, and the aid against deadlock, are not in the paper.
//!
//! Known limits, all of them the method's own: local minima before gaps, deadlock of exactly opposed robots, goals
//! nearer to each other than `p_r` plus both radii, and poses older than about 0.2 s at 1 m/s.

use crate::method::{Identity, Length, Method, Symmetry};
use crate::params::ParamError;
use crate::planner::{Neighbor, Obstacle, Plan, PlanInput, Planner, nearest_by_id};
use crate::steering::steer_to_goal;
use model::{BodyKind, Drive, Limits, ParamValues};
use nalgebra::{Point2, Vector2};

/// Surfaces count as at least this far apart, so that forces stay finite, m.
const P_MIN_M: f64 = 0.001;
/// Greatest size of one push, in the unit of the resultant; also the size between centres that coincide, where the law
/// has neither size nor direction. Only bodies that overlap or nearly touch get there.
const PUSH_MAX: f64 = 1000.0;

/// Ages are counted in ticks, and six ticks of 0.05 s come out as a little more than 0.3 s.
const ROUNDING_S: f64 = 1e-9;

/// Registry entry.
pub static METHOD: Method = Method {
    name: "decentralized-apf",
    summary: "potential field over goal, obstacles and the other robots' exchanged positions",
    source: "Matoui et al. 2017, doi 10.1016/j.ifacol.2017.08.1822",
    symmetry: Symmetry::FULL,
    kinds: BodyKind::MOBILE,
    params: Params::specs,
    speed_mps,
    lengths: &[Length::of("p_o", 1), Length::of("p_r", 1), Length::of("eta", 3)],
    wants_filter: false,
    follows_ways: false,
    build,
};

crate::choice! {
    /// What p(a, b) measures.
    pub enum Distance {
        /// From surface to surface: both radii are taken off.
        Surface = "surface",
        /// From centre to centre, as the paper has it; of a wall, to its centre line.
        Centre = "centre",
    }
}

crate::params! {
    /// Parameters that a scenario can set.
    pub struct Params {
        /// Attraction gain ξ. Larger: faster towards the goal.
        xi: f64 = 1.0, "1/s", 0.0..=100.0;
        /// Repulsion gain η. Larger: wider around everything.
        eta: f64 = 0.1, "m⁴/s", 0.0..=100.0;
        /// Threshold distance of obstacles. Larger: feels them sooner.
        p_o: f64 = 1.0, "m", 0.01..=100.0;
        /// Threshold distance of robots. Larger: feels them sooner.
        p_r: f64 = 1.0, "m", 0.01..=100.0;
        /// Power of the bracket in (4) and (6). Larger: softer onset at the threshold.
        bracket_power: u32 = 1, "", 1..=2;
        /// Distance between surfaces, or between centres as in the paper.
        distance: Distance = Distance::Surface, "";
        /// The pull grows up to this distance from the goal. Larger: pulls harder from afar; 0: grows without limit. The
        /// default follows the speed limit: 1 m for every m/s, from 1 m/s on.
        attract_cap: f64 = 1.0, "m", 0.0..=1e6;
        /// Turn rate of a unicycle per radian of heading error. Larger: turns sharper.
        heading_gain: f64 = 3.0, "1/s", 0.0..=100.0;
        /// Greatest turn rate asked of a unicycle, within what its body can do. Larger: may turn faster.
        omega_max: f64 = 3.0, "rad/s", 0.0..=100.0;
        /// Age up to which a robot is taken to have kept its course. Larger: trusts the course longer.
        stale_s: f64 = 0.3, "s", 0.0..=60.0;
        /// Age from which a silent robot is forgotten; until then it is an obstacle that grows with its age. Larger:
        /// keeps away from it longer.
        drop_s: f64 = 2.0, "s", 0.0..=60.0;
        /// Push to the left of the goal after standing still on the way. Not in the paper.
        aid: bool = false, "";
        /// Size of that push. Larger: leaves wider traps.
        aid_force: f64 = 0.2, "m/s", 0.0..=100.0;
        /// How long the push lasts. Larger: leaves deeper traps.
        aid_push_s: f64 = 1.0, "s", 0.0..=60.0;
        /// How long to stand still before it. Larger: more patient.
        aid_wait_s: f64 = 1.0, "s", 0.0..=60.0;
        /// Below this speed a robot stands still. Larger: more impatient.
        aid_speed: f64 = 0.02, "m/s", 0.0..=100.0;
    }
}

/// The method at work for one robot.
#[derive(Clone, Debug)]
pub struct DecentralizedApf {
    params: Params,
    /// The limit of the pull is nobody's choice and grows with the speed limit.
    follows_speed: bool,
    /// Own slot: settles who goes where when centres coincide.
    robot: u32,
    aid: Aid,
}

fn build(values: &ParamValues, identity: Identity) -> Result<Box<dyn Planner>, ParamError> {
    let follows_speed = Params::attract_cap.given(values).is_none();
    Ok(Box::new(DecentralizedApf { follows_speed, ..DecentralizedApf::new(Params::from_values(values)?, identity) }))
}

/// Far from everything: what the pull comes to.
fn speed_mps(values: &ParamValues, _: f64) -> f64 {
    let Params { xi, attract_cap, .. } = Params::default().with(values);
    let follows = Params::attract_cap.given(values).is_none() && xi * attract_cap >= 1.0;
    if follows || attract_cap == 0.0 { f64::INFINITY } else { xi * attract_cap }
}

impl Planner for DecentralizedApf {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        let q = input.position;
        let mut attractive = self.attraction(q, input.goal, input.limits.speed_mps_max);
        // (5), (7) and (8). The sum over robots skips the own one because nobody hears itself.
        let mut repulsive = Vector2::zeros();
        for obstacle in nearest_by_id(input.obstacles, q) {
            repulsive += self.obstacle_push(&obstacle, input);
        }
        for neighbor in input.neighbors {
            repulsive += self.neighbor_push(neighbor, input);
        }
        if self.params.aid {
            attractive += self.aid.step(&self.params, input, attractive + repulsive);
        }
        let velocity = (attractive + repulsive).cap_magnitude(input.limits.speed_mps_max);
        let drive = match input.kind {
            BodyKind::Point => Drive::Velocity(velocity),
            BodyKind::Unicycle | BodyKind::DiffDrive => {
                let turn_radps_max = input.limits.turn_radps_max.min(self.params.omega_max);
                let limits = Limits { turn_radps_max, ..input.limits };
                steer_to_goal(velocity, self.params.heading_gain, &PlanInput { limits, ..*input })
            }
            BodyKind::TwoLinkArm => Drive::stop(input.kind),
        };
        // Also after arrival the field may move the robot: it does not stand still on purpose.
        Plan { attractive, repulsive, ..Plan::only(drive) }
    }
}

impl DecentralizedApf {
    /// The method with these parameters, for this robot.
    pub fn new(params: Params, identity: Identity) -> DecentralizedApf {
        DecentralizedApf { params, follows_speed: false, robot: identity.robot, aid: Aid::default() }
    }

    /// (2), with its limit: −ξ (q − g) min(1, d_c / |q − g|).
    fn attraction(&self, q: Point2<f64>, g: Point2<f64>, speed_mps_max: f64) -> Vector2<f64> {
        let Params { xi, attract_cap, .. } = self.params;
        let attract_cap = if self.follows_speed { attract_cap * speed_mps_max.max(1.0) } else { attract_cap };
        let to_goal = g - q;
        xi * if attract_cap > 0.0 { to_goal.cap_magnitude(attract_cap) } else { to_goal }
    }

    /// (4)
    fn obstacle_push(&self, obstacle: &Obstacle, input: &PlanInput<'_>) -> Vector2<f64> {
        let delta = input.position - obstacle.shape.nearest_core(input.position);
        let radii = self.counted(obstacle.shape.radius + input.radius_m);
        self.repulsion(delta, self.params.p_o, radii, Vector2::x())
    }

    /// (6), with what the age of the message makes of the other robot.
    pub(crate) fn neighbor_push(&self, neighbor: &Neighbor, input: &PlanInput<'_>) -> Vector2<f64> {
        let Params { p_o, p_r, stale_s, drop_s, .. } = self.params;
        let age_s = neighbor.age_s.max(0.0);
        let radii = self.counted(neighbor.radius_m + input.radius_m);
        // Two robots with one centre must not be pushed the same way, so the lower slot goes back.
        let apart = if self.robot < neighbor.id { -Vector2::x() } else { Vector2::x() };
        if age_s <= stale_s + ROUNDING_S {
            let position = neighbor.position + neighbor.velocity * age_s;
            self.repulsion(input.position - position, p_r, radii, apart)
        } else if age_s <= drop_s + ROUNDING_S {
            // It may be anywhere that it could have driven to; its speed limit is taken to be the own one. That
            // reach is not a body, so it counts with distances between centres too.
            let reach = input.limits.speed_mps_max * age_s;
            self.repulsion(input.position - neighbor.position, p_o, radii + reach, apart)
        } else {
            Vector2::zeros()
        }
    }

    /// The radii as the distance counts them: not at all from centre to centre.
    fn counted(&self, radii: f64) -> f64 {
        match self.params.distance {
            Distance::Surface => radii,
            Distance::Centre => 0.0,
        }
    }

    /// η (1/p − 1/p₀)ᵇ (1/p²) ∇p up to the threshold p₀, zero beyond; `delta` points from the other to this robot.
    fn repulsion(&self, delta: Vector2<f64>, p_0: f64, radii: f64, apart: Vector2<f64>) -> Vector2<f64> {
        let Params { eta, bracket_power, .. } = self.params;
        let norm = delta.norm();
        if norm == 0.0 {
            return PUSH_MAX * apart;
        }
        let p = (norm - radii).max(P_MIN_M);
        if p > p_0 {
            return Vector2::zeros();
        }
        let bracket = 1.0 / p - 1.0 / p_0;
        let size = eta * bracket.powi(bracket_power as i32) / p.powi(2);
        size.min(PUSH_MAX) * (delta / norm)
    }
}

/// The aid against deadlock: after standing still for a while short of the goal, a push to the left for a while.
#[derive(Clone, Debug, Default)]
struct Aid {
    /// Ticks spent standing still.
    still: u32,
    /// Ticks of push still to come.
    push: u32,
}

impl Aid {
    fn step(&mut self, params: &Params, input: &PlanInput<'_>, resultant: Vector2<f64>) -> Vector2<f64> {
        let ticks = |seconds: f64| (seconds / input.dt_s).round().max(1.0) as u32;
        let to_goal = input.goal - input.position;
        if to_goal.norm() <= input.goal_tolerance_m {
            *self = Aid::default();
            return Vector2::zeros();
        }
        if self.push == 0 {
            self.still = if resultant.norm() < params.aid_speed { self.still + 1 } else { 0 };
            if self.still < ticks(params.aid_wait_s) {
                return Vector2::zeros();
            }
            *self = Aid { still: 0, push: ticks(params.aid_push_s) };
        }
        self.push -= 1;
        let left = Vector2::new(-to_goal.y, to_goal.x);
        left.try_normalize(0.0).map_or(Vector2::zeros(), |left| params.aid_force * left)
    }
}
