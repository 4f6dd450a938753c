//! The forces of AMR-APF on one robot: Eqs. 1-8. Forces are in the body frame: x along the heading, y to the left.
//!
//! ψ is the heading relative to the line of sight (positive: the thing is to the right), β the goal relative to it.

use super::{Params, Rule, Side};
use nalgebra::{Point2, Vector2};
use std::f64::consts::{FRAC_PI_2, PI};

/// Centres count as at least this share of ρ apart, so that forces stay finite.
const NEARNESS_MIN: f64 = 0.01;

/// The robot that plans, as the forces see it.
#[derive(Clone, Copy, Debug)]
pub struct Own {
    /// Its position p_i, m.
    pub position: Point2<f64>,
    /// Its heading h_i, rad.
    pub heading_rad: f64,
    /// Its goal g_i, m.
    pub goal: Point2<f64>,
    /// Take sgn(0) = 0, as the reference does, instead of +1.
    pub sgn_zero: bool,
}

/// How the robot sees a thing.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// d, from centre to centre, m.
    pub distance_m: f64,
    /// θ, bearing of the thing in the world, rad.
    pub theta: f64,
    /// ψ, own heading relative to the line of sight, rad.
    pub psi: f64,
    /// β, bearing of the own goal relative to the line of sight, rad.
    pub beta: f64,
    /// γ, angle at the thing between the goal and the robot, rad; π if the thing is exactly in between.
    pub gamma: f64,
}

/// Another robot, as the robot-robot force needs it.
#[derive(Clone, Copy, Debug)]
pub struct Other {
    /// Its position p_j, m.
    pub position: Point2<f64>,
    /// Its heading h_j, rad.
    pub heading_rad: f64,
    /// It arrived, stands still on purpose, or is no robot but a virtual one.
    pub parked: bool,
    /// It has right of way.
    pub right_of_way: bool,
    /// ρ_r of the pair, m.
    pub rho_m: f64,
    /// Bearing under which it is seen if the centres coincide, rad: different for the two robots of a pair.
    pub apart_rad: f64,
}

/// What another robot does to this one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meeting {
    /// FR_ij, body frame.
    pub force: Vector2<f64>,
    /// It is right ahead, and too near to drive on.
    pub front_stop: bool,
    /// It leaves in front of us, or goes the same way with right of way: let it go first.
    pub yields: bool,
}

/// The angle in [-π, π] by way of its sine and cosine, which keeps the sign of the smallest angles.
pub fn wrap(angle: f64) -> f64 {
    let (sin, cos) = angle.sin_cos();
    sin.atan2(cos)
}

fn bearing(from: Point2<f64>, to: Point2<f64>, if_same: f64) -> f64 {
    let along = to - from;
    if along.x == 0.0 && along.y == 0.0 { if_same } else { along.y.atan2(along.x) }
}

/// μ(d, ρ) = 4 C ρ⁴ (1/d - 1/2ρ)² / d² inside 2ρ, zero outside: the squared form of Eq. 2. With x = ρ/d it is
/// C (x (2x - 1))², which is C at d = ρ.
pub fn mu(c_a: f64, d: f64, rho: f64) -> f64 {
    if d < 2.0 * rho { mu_uncut(c_a, d, rho) } else { 0.0 }
}

/// μ as it stands, also beyond 2ρ, where it grows again.
pub(crate) fn mu_uncut(c_a: f64, d: f64, rho: f64) -> f64 {
    let x = nearness(d, rho);
    c_a * (x * (2.0 * x - 1.0)).powi(2)
}

/// ρ/d, within bounds.
fn nearness(d: f64, rho: f64) -> f64 {
    rho / d.max(NEARNESS_MIN * rho).max(f64::MIN_POSITIVE)
}

impl Params {
    /// ρ as the forces count it: they reach to twice this, which is `reach` times the sum of radii and safety distance.
    pub(crate) fn zone(&self, rho: f64) -> f64 {
        rho * self.reach / 2.0
    }

    /// The push of Eq. 2 within a zone, zero outside.
    pub fn push(&self, d: f64, rho: f64) -> f64 {
        if d < 2.0 * rho { self.push_uncut(d, rho) } else { 0.0 }
    }

    /// The push as it stands, also outside. With the first power of the bracket it is the classical one, of which the
    /// potential is a square.
    pub(crate) fn push_uncut(&self, d: f64, rho: f64) -> f64 {
        if self.bracket_power == 2 {
            return mu_uncut(self.c_a, d, rho);
        }
        let x = nearness(d, rho);
        self.c_a * x * x * (2.0 * x - 1.0)
    }
}

impl Own {
    /// A push of this size straight away from what is seen so.
    pub(crate) fn away(&self, size: f64, sight: &Sight) -> Vector2<f64> {
        -self.along(size, sight.theta)
    }

    /// How the robot sees a thing at `at`.
    pub fn sight(&self, at: Point2<f64>, apart_rad: f64) -> Sight {
        let theta = bearing(self.position, at, apart_rad);
        let to_goal = bearing(self.position, self.goal, self.heading_rad);
        let onward = bearing(at, self.goal, theta);
        Sight {
            distance_m: (at - self.position).norm(),
            theta,
            psi: wrap(self.heading_rad - theta),
            beta: wrap(to_goal - theta),
            gamma: wrap(onward - (theta - PI)).abs(),
        }
    }

    /// A force of this size towards `direction` (world), in the body frame.
    pub fn along(&self, size: f64, direction: f64) -> Vector2<f64> {
        let (sin, cos) = (direction - self.heading_rad).sin_cos();
        Vector2::new(size * cos, size * sin)
    }

    /// The sign of `x`.
    pub fn sgn(&self, x: f64) -> f64 {
        if x < 0.0 {
            -1.0
        } else if x > 0.0 || !self.sgn_zero {
            1.0
        } else {
            0.0
        }
    }

    /// The side rule S(ψ, β, φ), +1 for left of the line of sight: nearly dead ahead the side of the goal, else the
    /// side of the heading. T of Eq. 3 is the second factor.
    pub fn side(&self, sight: &Sight, phi: f64) -> f64 {
        let Sight { psi, beta, .. } = *sight;
        if psi.abs() >= phi {
            self.sgn(psi)
        } else if self.sgn_zero {
            self.sgn(psi) * self.sgn(beta * psi)
        } else {
            self.sgn(beta)
        }
    }
}

/// Eq. 1: the pull of the goal has a constant size, doubled close to the goal.
pub fn attraction(params: &Params, own: &Own) -> Vector2<f64> {
    let near = (own.goal - own.position).norm() < params.near_goal_m;
    let size = if near { 2.0 * params.c_a } else { params.c_a };
    own.along(size, bearing(own.position, own.goal, own.heading_rad))
}

/// Eqs. 2-4: FO_ij of an obstacle with precaution radius ρ. `uncut` keeps the tangential part beyond 2ρ, which the
/// reference does for one kind of virtual obstacle.
pub fn obstacle(params: &Params, own: &Own, at: Point2<f64>, rho: f64, apart_rad: f64, uncut: bool) -> Vector2<f64> {
    let rho = params.zone(rho);
    if !uncut && (at - own.position).norm_squared() >= (2.0 * rho).powi(2) {
        return Vector2::zeros();
    }
    let sight = own.sight(at, apart_rad);
    let Sight { distance_m: d, theta, .. } = sight;
    let size = params.push(d, rho);
    let radial = own.away(size, &sight);
    let acts = match params.obstacle_rule {
        Rule::Rings => {
            let in_ring = d > rho && (d < 1.5 * rho || sight.psi.abs() < FRAC_PI_2);
            in_ring && sight.gamma > 45f64.to_radians()
        }
        Rule::HalfPlane => sight.beta.abs() <= FRAC_PI_2,
    };
    if !acts {
        return radial;
    }
    let turned = theta + own.side(&sight, params.phi_o_deg.to_radians()) * FRAC_PI_2;
    radial + own.along(size + params.k_o, turned)
}

/// Eqs. 6-7: FR_ij of another robot, and whether it makes us wait.
pub fn robot(params: &Params, own: &Own, other: &Other) -> Meeting {
    let rho = params.zone(other.rho_m);
    let none = Meeting { force: Vector2::zeros(), front_stop: false, yields: false };
    if (other.position - own.position).norm_squared() >= (2.0 * rho).powi(2) {
        return none;
    }
    let sight = own.sight(other.position, other.apart_rad);
    let Sight { distance_m: d, theta, psi, .. } = sight;
    // a_ij = -ψ: how we see the other; a_ji: how it sees us.
    let (a_ij, a_ji) = (-psi, wrap(theta - PI - other.heading_rad));
    let size = params.push(d, rho);
    let radial = own.away(size, &sight);
    let phi_r = params.phi_r_deg.to_radians();
    match params.robot_rule {
        Rule::HalfPlane => {
            if sight.beta.abs() > FRAC_PI_2 || a_ji.abs() > FRAC_PI_2 {
                return Meeting { force: radial, ..none };
            }
            let force = radial + own.along(size + params.k_r_far, theta + own.side(&sight, phi_r) * FRAC_PI_2);
            // The reference tests only how the other sees us; meant is that the two would turn into each other.
            let conflict = if own.sgn_zero { a_ji < 0.0 } else { a_ij * a_ji < 0.0 };
            Meeting { force, yields: !other.parked && other.right_of_way && conflict, ..none }
        }
        Rule::Rings => {
            let front_stop = d < rho && psi.abs() < params.front_half_angle_deg.to_radians();
            let leaving = d < rho && psi.abs() < FRAC_PI_2 && a_ji.abs() > FRAC_PI_2;
            let yields = !other.parked && (leaving || (params.follow_stop && follows(own, &sight, other)));
            if yields && leaving && params.yield_without_force {
                return Meeting { force: Vector2::zeros(), front_stop, yields };
            }
            let far = d > 1.5 * rho;
            let k = if far { params.k_r_far } else { params.k_r_near };
            let mut acts = d > rho && sight.gamma > 60f64.to_radians();
            let turned = if other.parked {
                acts &= !far || psi.abs() < FRAC_PI_2;
                theta + own.side(&sight, phi_r) * FRAC_PI_2
            } else {
                acts &= psi.abs() < FRAC_PI_2 && a_ji.abs() < FRAC_PI_2;
                // Eq. 6. If both see the other on the same hand, both turn away from it. If not, they would turn into
                // each other, and one of them has to take the other side.
                let tie = match params.side {
                    Side::RightOfWay => other.right_of_way,
                    Side::Offsets => a_ij.abs() > a_ji.abs(),
                };
                let s = if a_ij * a_ji < 0.0 && tie { -1.0 } else { 1.0 };
                theta - own.sgn(s * a_ji) * FRAC_PI_2
            };
            let tangential = if acts { own.along(size + k, turned) } else { Vector2::zeros() };
            Meeting { force: radial + tangential, front_stop, yields }
        }
    }
}

/// Whether the other drives ahead of us to where we want to go, and has right of way.
fn follows(own: &Own, sight: &Sight, other: &Other) -> bool {
    let to_goal = sight.beta + sight.theta;
    other.right_of_way
        && wrap(bearing(other.position, own.goal, sight.theta) - to_goal).abs() < 30f64.to_radians()
        && (own.goal - other.position).norm() < (own.goal - own.position).norm()
        && wrap(own.heading_rad - to_goal).abs() < 40f64.to_radians()
        && wrap(own.heading_rad - other.heading_rad).abs() < FRAC_PI_2
}
