//! The potential, and one round of evaluations: equations (1) to (12).

use crate::planner::{Obstacle, nearest_by_id};
use geometry::segment_distance;
use nalgebra::{Point2, Vector2};
use std::f64::consts::{PI, TAU};

/// Candidates whose potentials differ by no more than this are tied; the smallest m wins.
const TIE: f64 = 1e-12;

/// The numbers of the law.
#[derive(Clone, Debug, PartialEq)]
pub struct Law {
    /// Step, m.
    pub step_m: f64,
    /// Unit vectors of the directions m = 0 .. A_nsd − 1, counter-clockwise from +x.
    pub directions: Box<[Vector2<f64>]>,
    /// K_O, m².
    pub k_o: f64,
    /// K_t, 1/m.
    pub k_t: f64,
    /// K_v, m².
    pub k_v: f64,
    /// V_r, m.
    pub v_r_m: f64,
    /// V_r' is at most so many steps; 0 is no limit.
    pub v_r_cap_steps: f64,
    /// The descent ends within so many steps of the goal; [`Law::tolerance_m`] has the lower bound.
    pub tolerance_steps: f64,
    /// Steps that touch a body thinner than themselves are not candidates.
    pub no_jumping: bool,
}

/// One of the points that an agent may step to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Its direction's number.
    pub m: usize,
    /// Where it is, m.
    pub point: Point2<f64>,
    /// P there.
    pub potential: f64,
}

/// The potential of one moment.
#[derive(Clone, Copy, Debug)]
pub struct Field<'a> {
    /// The numbers.
    pub law: &'a Law,
    /// K_v in use: that of the law, or what a search fell back to, m².
    pub k_v: f64,
    /// A_r, m.
    pub agent_radius_m: f64,
    /// T, m.
    pub goal: Point2<f64>,
    /// The obstacles, the pieces of each standing together.
    pub obstacles: &'a [Obstacle],
    /// Where the virtual obstacles are, m.
    pub virtual_obstacles: &'a [Point2<f64>],
}

impl Law {
    /// The directions (cos, sin)(2 π m / A_nsd) of (12).
    pub fn directions(a_nsd: u32) -> Box<[Vector2<f64>]> {
        let angle = |m: u32| TAU * f64::from(m) / f64::from(a_nsd);
        (0..a_nsd).map(|m| Vector2::new(angle(m).cos(), angle(m).sin())).collect()
    }

    /// The descent ends within this distance of the goal, m: at least Step / (2 cos(π / A_nsd)).
    pub fn tolerance_m(&self) -> f64 {
        self.step_m * self.tolerance_steps.max(0.5 / (PI / self.directions.len() as f64).cos())
    }

    /// V_r' of an agent of this radius, m.
    pub fn virtual_radius_m(&self, agent_radius_m: f64) -> f64 {
        let inflated = self.v_r_m + agent_radius_m;
        if self.v_r_cap_steps > 0.0 { inflated.min(self.v_r_cap_steps * self.step_m) } else { inflated }
    }
}

/// (1) and (8): K / r², infinite inside the body and on it, (2). `r` is the distance to the inflated body, (3), (4).
fn hill(gain: f64, r: f64) -> f64 {
    if r > 0.0 { gain / (r * r) } else { f64::INFINITY }
}

impl Field<'_> {
    /// (5): P_t at `q`.
    pub fn of_goal(&self, q: Point2<f64>) -> f64 {
        self.law.k_t * (self.goal - q).norm()
    }

    /// (1): P_o of one obstacle at `q`.
    pub fn of_obstacle(&self, obstacle: &Obstacle, q: Point2<f64>) -> f64 {
        hill(self.law.k_o, obstacle.shape.distance(q) - self.agent_radius_m)
    }

    /// (8): P_v at `q` of a virtual obstacle at `center`.
    pub fn of_virtual(&self, center: Point2<f64>, q: Point2<f64>) -> f64 {
        hill(self.k_v, (q - center).norm() - self.law.virtual_radius_m(self.agent_radius_m))
    }

    /// (6): the potential without virtual obstacles at `q`.
    pub fn bar(&self, q: Point2<f64>) -> f64 {
        Field { virtual_obstacles: &[], ..*self }.at(q)
    }

    /// (10): the potential at `q`.
    pub fn at(&self, q: Point2<f64>) -> f64 {
        self.at_below(q, f64::INFINITY)
    }

    /// The potential if it is below `limit`, else anything not below it: the terms are not negative, so the sum need
    /// not be finished.
    fn at_below(&self, q: Point2<f64>, limit: f64) -> f64 {
        let mut sum = self.of_goal(q);
        for obstacle in nearest_by_id(self.obstacles, q) {
            sum += self.of_obstacle(&obstacle, q);
            if sum >= limit {
                return sum;
            }
        }
        let v_r = self.law.virtual_radius_m(self.agent_radius_m);
        for center in self.virtual_obstacles {
            sum += hill(self.k_v, (q - center).norm() - v_r);
            if sum >= limit {
                return sum;
            }
        }
        sum
    }

    /// (12): the candidate of direction m.
    pub fn candidate(&self, q: Point2<f64>, m: usize) -> Candidate {
        let point = q + self.law.step_m * self.law.directions[m];
        Candidate { m, point, potential: self.at(point) }
    }

    /// The lowest candidate; none if all are infinite.
    pub fn best(&self, q: Point2<f64>) -> Option<Candidate> {
        let mut best: Option<Candidate> = None;
        for (m, direction) in self.law.directions.iter().enumerate() {
            let point = q + self.law.step_m * direction;
            let limit = best.map_or(f64::INFINITY, |best| best.potential - TIE);
            let potential = self.at_below(point, limit);
            if potential < limit && !(self.law.no_jumping && self.jumps(q, point)) {
                best = Some(Candidate { m, point, potential });
            }
        }
        best
    }

    /// (13), one round: the point to step to, or nothing in a local minimum. It takes A_nsd + 1 evaluations.
    pub fn descend(&self, q: Point2<f64>) -> Option<Point2<f64>> {
        self.best(q).filter(|best| best.potential < self.at(q)).map(|best| best.point)
    }

    /// Whether a step touches a body so thin that both its ends may be free.
    fn jumps(&self, from: Point2<f64>, to: Point2<f64>) -> bool {
        self.obstacles.iter().map(|obstacle| &obstacle.shape).any(|shape| {
            let inflated = shape.radius + self.agent_radius_m;
            inflated < self.law.step_m && segment_distance(from, to, shape.a, shape.b) <= inflated
        })
    }

    /// Distance from `q` to the nearest inflated obstacle, m; negative inside one.
    pub fn clearance(&self, q: Point2<f64>) -> f64 {
        clearance(self.obstacles, self.agent_radius_m, q)
    }

    /// Whether the agent can drive straight from one point to another.
    pub fn is_free(&self, from: Point2<f64>, to: Point2<f64>) -> bool {
        self.obstacles.iter().map(|obstacle| &obstacle.shape).all(|shape| {
            let inflated = shape.radius + self.agent_radius_m;
            segment_distance(from, to, shape.a, shape.b) > inflated
        })
    }
}

/// Distance from `q` to the nearest of the obstacles, inflated by an agent's radius, m; infinite if there is none.
pub fn clearance(obstacles: &[Obstacle], agent_radius_m: f64, q: Point2<f64>) -> f64 {
    nearest_by_id(obstacles, q)
        .map(|obstacle| obstacle.shape.distance(q) - agent_radius_m)
        .fold(f64::INFINITY, f64::min)
}
