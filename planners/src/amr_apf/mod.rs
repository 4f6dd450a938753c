//! AMR-APF: a potential field in which obstacles and robots push not only away but also to one side, so that a robot
//! passes them without stopping; virtual obstacles close traps and lead round crowds.
//!
//! "AMR-APF", Modares Mechanical Engineering 24(7), 2024 (Persian), and the same first author's ECMR 2025 paper,
//! doi 10.1109/ECMR65884.2025.11163011. Equation numbers are those of the former.
//!
//! Where things are: the forces of Eqs. 1-8 in [`field`], crowds (Eq. 10) in [`clusters`], from force to command in
//! [`speed`], parameters and presets in [`Params`], one control cycle (Eq. 11) here; what the paper lacks in `brake` and
//! `detour`. The baseline is [`dapf`](crate::dapf).
//!
//! | paper         | here             | unit | default | larger means                                              |
//! |---------------|------------------|------|---------|-----------------------------------------------------------|
//! | C_a           | `c_a`            |      | 4       | all forces larger, the same path                          |
//! | s             | `safety_m`       | m    | 0.07    | ρ_o = r_rob + r_obs + s and ρ_r = 2 r_rob + s larger: wider around everything |
//! | φ of Eq. 3    | `phi_o_deg`      | °    | 20      | chooses the goal's side of an obstacle more often         |
//! |               | `phi_r_deg`      | °    | 10      | the same for parked robots                                |
//! |               | `k_o`            |      | 3       | turns aside harder from obstacles                         |
//! |               | `k_r_far`, `k_r_near` |  | 2, 4   | turns aside harder from robots                            |
//! | 1st parameter | `c_r`            | 2ρ_r | 2.5     | sees crowds sooner                                        |
//! |               | `c_g`            | 2ρ_r | 2.5     | stops looking for crowds farther from the goal            |
//! | 2nd parameter | `c_adj`          | ρ_r  | 2.2     | takes looser groups for a crowd                           |
//! |               | `margin_m`       | m    | 0       | r_rob larger than the body: wider around robots           |
//! | Eq. 2         | `reach`, `bracket_power` |  | 2, 2 | feels things sooner; a softer edge                   |
//! |               | `keep_m`         | m    | 0.02    | stops farther from everything                             |
//! |               | `patience_s`     | s    | 4       | waits longer where it is stuck                            |
//! |               | `detour_s`       | s    | 2       | drives aside for longer                                   |
//! |               | `preset`         |      | fleet   |                                                           |
//!
//! The paper leaves most numbers open; they are those of the authors' programs, of which there are three: `c1` (the
//! one behind the paper's first experiment), `p` (nearest to the paper's text) and `h` (the later, simpler one). The
//! preset sets every parameter that is not given. `fleet`, the default, is `fixed` with two things that the paper lacks:
//! - Brakes (`keep_m`): a robot drives no faster towards a thing than it can stop before it. Two robots that both have them
//!   do not touch, whatever the forces are; a body that must drive to turn (a turning radius) cannot promise it.
//! - Detours (`patience_s`, `detour_s`): a robot that comes no nearer to its goal drives aside for a while, at random.
//!
//! With these, fleets are home sooner without crowds (`clusters`) and `follow_stop`, and with `side` by the heading offsets
//! of `c1`, so that is how the default has them.
//!
//! `fixed` is `p` with what we hold to be oversights put right:
//! - sgn(0) is +1: a robot that faces an obstacle exactly turns left instead of driving into it (all presets, unless
//!   `sgn_zero`).
//! - "Stopped" is told only while it is true (`sticky_stop` off), and a crowd holds a robot for a limited time.
//! - All crowds act, each by the smallest circle around it; the rectangle of `p` is ill-defined for triangles.
//! - Nobody creeps towards something near ahead, and nobody turns beyond the direction of the force (`guarded`).
//! - Of two robots equally far from their goals the lower slot has right of way.
//!
//! `text` is `fixed` with the equations as the paper's text can be read, where the programs do something else: Eq. 2 cut
//! off at ρ and in the classical form, the sideways force as large as the push, Eq. 9 as a circle over both zones. It is
//! there to be compared: robots touch almost everywhere. Each reading is a parameter of its own (`traps` and
//! `pillar_gaps` know another one, `half`).
//!
//! Differs from the programs in every preset:
//! - Radii and the speed limit are those of the bodies, not constants; turn rates grow with the speed limit, and are the
//!   authors' at their 0.2 m/s.
//! - Walls and polygons push from their nearest point.
//! - Other robots are taken where their course has brought them since they spoke; a robot that fell silent is an
//!   obstacle for a while (`stale_s`, `drop_s`).
//! - A point robot drives as a unicycle whose heading the method remembers.
//!
//! Known limits: the tangential force jumps at the edge of its zone; nothing but the default guards against contact, and it
//! cannot flee from what drives into it; right of way needs [`Neighbor::remaining_m`].

mod brake;
pub mod clusters;
mod detour;
pub mod field;
mod params;
pub mod speed;
#[cfg(test)]
mod tests;
pub(crate) mod unicycle;

pub use params::{Circle, ClusterRule, Params, PillarGaps, Preset, Rule, Side, SpeedRule, Traps, Which};

use crate::method::{Identity, Length, Method, Symmetry, any_speed};
use crate::params::ParamError;
use crate::planner::{Neighbor, Obstacle, Plan, PlanInput, Planner, nearest_by_id};
use brake::{Near, brake, reach_m};
use clusters::{Member, Scratch};
use detour::Detour;
use field::{Other, Own};
use geometry::wrap;
use model::{BodyKind, Drive, ParamValues, PlanState};
use nalgebra::{Point2, Rotation2, Vector2};
use speed::{Body, SPEED_REFERENCE_MPS, Twist};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// A course that differs more than this from the heading is that of a body that need not drive ahead, rad.
const COURSE_OFF_RAD: f64 = 0.3;
/// Below this speed a body has no course, m/s.
const COURSE_SPEED_MPS: f64 = 1e-3;
/// Ages are counted in ticks, and sums of ticks are a little off.
const ROUNDING_S: f64 = 1e-9;

/// Registry entry.
pub static METHOD: Method = Method {
    name: "amr-apf",
    summary: "potential field with sideways forces, right of way, and virtual obstacles against traps and crowds",
    source: "AMR-APF, Modares Mechanical Engineering 24(7), 2024",
    symmetry: Symmetry::FULL,
    kinds: BodyKind::MOBILE,
    params: Params::specs,
    speed_mps: any_speed,
    lengths: &[Length::of("near_goal_m", 1), Length::of("safety_m", 1), Length::of("keep_m", 1)],
    wants_filter: false,
    follows_ways: false,
    build,
};

/// The method at work for one robot.
pub struct AmrApf {
    params: Params,
    /// Own slot: settles ties of right of way, and who goes where when centres coincide.
    robot: u32,
    /// Heading of the unicycle that a point robot drives as, rad.
    heading_rad: Option<f64>,
    /// Stopped once, and told so for good (`sticky_stop`).
    stuck_flag: bool,
    /// For which goal that is.
    goal: Option<Point2<f64>>,
    /// How long a crowd has held the robot, and how long it is still to be ignored, s.
    held_s: f64,
    ignore_s: f64,
    scratch: Scratch,
    discs: Vec<(Point2<f64>, f64)>,
    near: Vec<Near>,
    detour: Detour,
}

fn build(values: &ParamValues, identity: Identity) -> Result<Box<dyn Planner>, ParamError> {
    Params::from_values(values)?;
    Ok(Box::new(AmrApf::new(Params::of_values(values), identity)))
}

/// What stands in a gap that a parked robot and a pillar close together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trap {
    /// Where, m.
    pub center: Point2<f64>,
    /// Its ρ, m.
    pub rho_m: f64,
    /// It acts like a parked robot, otherwise like an obstacle.
    pub parked: bool,
}

/// Eq. 9 for a robot parked at `robot` and a pillar at `pillar`, with ρ_r and ρ_o of the planning robot.
pub fn trap(
    params: &Params,
    robot: Point2<f64>,
    pillar: Point2<f64>,
    rho_r: f64,
    rho_o: f64,
    radius_m: f64,
) -> Option<Trap> {
    let apart = (robot - pillar).norm();
    let reach = rho_r + rho_o;
    let (acts, rho_m) = match params.traps {
        Traps::Off => (false, 0.0),
        Traps::Parked => ((apart - rho_r).abs() < rho_o, rho_r / 1.5),
        Traps::Cover => (apart < reach, (apart + reach) / 2.0),
        Traps::Half => (apart < reach, apart / 2.0 + reach / 4.0),
        Traps::Obstacle => (0.75 * reach < apart && apart < reach, radius_m + apart / 3.0 + params.safety_m),
    };
    let center = nalgebra::center(&robot, &pillar);
    acts.then_some(Trap { center, rho_m, parked: params.traps == Traps::Parked })
}

/// Eq. 9 for two pillars with ρ_o of their own and their mean: ρ of what stands in the middle, if anything does.
pub fn pillar_gap(params: &Params, apart_m: f64, rho_mean_m: f64) -> Option<f64> {
    match params.pillar_gaps {
        PillarGaps::Off => None,
        // Below ρ the gap counts as closed already.
        PillarGaps::Midpoint => (rho_mean_m < apart_m && apart_m < 1.65 * rho_mean_m).then_some(rho_mean_m),
        PillarGaps::Cover => (apart_m < 2.0 * rho_mean_m).then_some(apart_m / 2.0 + rho_mean_m),
        PillarGaps::Half => (apart_m < 2.0 * rho_mean_m).then_some(apart_m / 2.0 + rho_mean_m / 2.0),
    }
}

/// What is summed up over the things around.
#[derive(Default)]
struct Sum {
    obstacles: Vector2<f64>,
    robots: Vector2<f64>,
    front_stop: bool,
    yields: bool,
    /// Some pillar within 1.5 ρ_o or robot within 1.5 ρ_r.
    near: bool,
    /// Something closer than ρ in the forward 45°.
    blocked: bool,
}

impl Planner for AmrApf {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        if self.goal != Some(input.goal) {
            self.goal = Some(input.goal);
            self.stuck_flag = false;
            self.detour.another_goal();
        }
        if input.arrived {
            return Plan { stopped: true, ..Plan::only(Drive::stop(input.kind)) };
        }
        let own = unicycle::own(input, self.heading_rad, self.params.sgn_zero);
        let aside = self.detour.step(&self.params, input);
        let mut sum = self.sum(input, &own, aside.is_some());
        let mut crowds = clusters::Crowds { force: Vector2::zeros(), stop: false };
        if aside.is_none() {
            crowds = self.crowds(input, &own, sum.near);
            if self.held_by(crowds.stop, input.dt_s) {
                self.stuck_flag = true;
                return Plan { stopped: true, ..Plan::only(Drive::stop(input.kind)) };
            }
        }
        sum.robots = self.settle(sum.robots);
        // Eq. 11, in the order in which the reference adds.
        let pull = field::attraction(&self.params, &own);
        let attraction = self.settle(aside.map_or(pull, |aside_rad| Rotation2::new(aside_rad) * pull));
        let force = attraction + self.settle(sum.obstacles) + (sum.robots + crowds.force);
        let mut twist = self.command(force, &sum, input);
        if self.params.keep_m > 0.0 {
            twist = brake(twist, &self.near, self.params.keep_m, input);
        }
        self.stuck_flag |= sum.yields;
        let heading = Rotation2::new(own.heading_rad);
        Plan {
            drive: unicycle::drive(twist, &own, input, &mut self.heading_rad),
            attractive: heading * attraction,
            repulsive: heading * (force - attraction),
            stopped: if self.params.sticky_stop { self.stuck_flag } else { sum.yields },
            state: PlanState::Ready,
            intent: None,
        }
    }
}

impl AmrApf {
    /// The method with these parameters (not only the preset's), for this robot.
    pub fn new(params: Params, identity: Identity) -> AmrApf {
        AmrApf {
            params,
            robot: identity.robot,
            heading_rad: None,
            stuck_flag: false,
            goal: None,
            held_s: 0.0,
            ignore_s: 0.0,
            scratch: Scratch::default(),
            discs: Vec::new(),
            near: Vec::new(),
            detour: Detour::new(identity),
        }
    }

    /// The obstacles and the robots, real and virtual (Eqs. 5, 8 and 9); during a detour only what is real, and only
    /// straight away from it. Also collects what is there to brake for.
    fn sum(&mut self, input: &PlanInput<'_>, own: &Own, detour: bool) -> Sum {
        let mut sum = Sum::default();
        let mut near = std::mem::take(&mut self.near);
        near.clear();
        let keep_m = self.params.keep_m;
        let brakes = keep_m > 0.0;
        for obstacle in nearest_by_id(input.obstacles, own.position) {
            let at = obstacle.shape.nearest_core(own.position);
            if detour {
                sum.obstacles += self.push_away(own, at, self.rho_o(input, &obstacle), own.heading_rad);
            } else {
                self.add_obstacle(&mut sum, input, own, &obstacle, at);
            }
            if brakes {
                let clear_m = (at - own.position).norm() - obstacle.shape.radius - input.radius_m;
                if clear_m <= reach_m(keep_m, obstacle.velocity.norm(), input) {
                    near.push(Near::thing(own, at, clear_m, obstacle.velocity));
                }
            }
        }
        if !detour && self.params.pillar_gaps != PillarGaps::Off {
            self.add_pillar_gaps(&mut sum, input, own);
        }
        let robots_within_m = reach_m(keep_m, 0.0, input);
        for neighbor in input.neighbors {
            let Some(other) = self.other(neighbor, input) else { continue };
            if detour {
                sum.robots += self.push_away(own, other.position, other.rho_m, other.apart_rad);
            } else {
                self.add_robot(&mut sum, own, &other);
                // Eq. 9 asks for fixed things: a robot that only waits is not one.
                if neighbor.arrived && self.params.traps != Traps::Off {
                    self.add_traps(&mut sum, input, own, neighbor, &other);
                }
            }
            if brakes {
                let clear_m = (other.position - own.position).norm() - neighbor.radius_m - input.radius_m;
                if clear_m <= robots_within_m {
                    near.push(match neighbor.arrived {
                        true => Near::thing(own, other.position, clear_m, Vector2::zeros()),
                        false => Near::robot(own, other.position, clear_m),
                    });
                }
            }
        }
        self.near = near;
        sum
    }

    /// The push of Eq. 2 straight away from a thing at `at`, without a side.
    fn push_away(&self, own: &Own, at: Point2<f64>, rho: f64, apart_rad: f64) -> Vector2<f64> {
        let sight = own.sight(at, apart_rad);
        own.away(self.params.push(sight.distance_m, self.params.zone(rho)), &sight)
    }

    /// `at` is the point of its core that is nearest to the robot.
    fn add_obstacle(&self, sum: &mut Sum, input: &PlanInput<'_>, own: &Own, obstacle: &Obstacle, at: Point2<f64>) {
        let rho = self.rho_o(input, obstacle);
        let apart = own.heading_rad;
        sum.obstacles += self.settle(field::obstacle(&self.params, own, at, rho, apart, false));
        let distance = (at - own.position).norm();
        sum.near |= distance < 1.5 * rho;
        if distance < rho {
            sum.blocked |= own.sight(at, apart).psi.abs() < FRAC_PI_4;
        }
    }

    fn add_robot(&self, sum: &mut Sum, own: &Own, other: &Other) {
        let meeting = field::robot(&self.params, own, other);
        // The later program rounds only the sum.
        let rule = self.params.robot_rule;
        sum.robots += if rule == Rule::Rings { self.settle(meeting.force) } else { meeting.force };
        sum.front_stop |= meeting.front_stop;
        sum.yields |= meeting.yields;
        let distance = (other.position - own.position).norm();
        sum.near |= distance < 1.5 * other.rho_m;
        if distance < other.rho_m {
            sum.blocked |= own.sight(other.position, other.apart_rad).psi.abs() < FRAC_PI_4;
        }
    }

    /// Eq. 9 between a parked robot and a pillar, which close a gap together.
    fn add_traps(&self, sum: &mut Sum, input: &PlanInput<'_>, own: &Own, parked: &Neighbor, other: &Other) {
        if (other.position - own.position).norm() >= 2.0 * other.rho_m {
            return;
        }
        for obstacle in nearest_by_id(input.obstacles, other.position) {
            let at = obstacle.shape.nearest_core(other.position);
            let widest_m = parked.radius_m.max(input.radius_m) + self.params.margin_m;
            let rho_o = widest_m + obstacle.shape.radius + self.params.safety_m;
            let own_m = self.radius_m(input);
            let Some(trap) = trap(&self.params, other.position, at, other.rho_m, rho_o, own_m) else {
                continue;
            };
            if trap.parked {
                let virtual_robot = Other { position: trap.center, rho_m: trap.rho_m, parked: true, ..*other };
                self.add_robot(sum, own, &virtual_robot);
            } else {
                let uncut = self.params.exact;
                let force = field::obstacle(&self.params, own, trap.center, trap.rho_m, own.heading_rad, uncut);
                sum.obstacles += self.settle(force);
            }
        }
    }

    /// Eq. 9 between two pillars: the gap between them is too narrow to drive through.
    fn add_pillar_gaps(&mut self, sum: &mut Sum, input: &PlanInput<'_>, own: &Own) {
        let s = self.params.safety_m;
        let own_m = self.radius_m(input);
        let rho = |radius: f64| own_m + radius + s;
        self.discs.clear();
        // A pillar farther away than this has no middle within reach.
        let near = |obstacle: &&Obstacle| {
            obstacle.shape.a == obstacle.shape.b
                && (obstacle.shape.a - own.position).norm() < 4.0 * rho(obstacle.shape.radius)
        };
        self.discs.extend(input.obstacles.iter().filter(near).map(|o| (o.shape.a, o.shape.radius)));
        for (i, (a, radius_a)) in self.discs.iter().enumerate() {
            for (b, radius_b) in &self.discs[i + 1..] {
                let middle = nalgebra::center(a, b);
                let Some(rho_a) = pillar_gap(&self.params, (b - a).norm(), rho((radius_a + radius_b) / 2.0)) else {
                    continue;
                };
                sum.obstacles += self.settle(field::obstacle(&self.params, own, middle, rho_a, own.heading_rad, false));
            }
        }
    }

    /// The neighbour as it is now, or nothing if it has been silent for too long.
    fn other(&self, neighbor: &Neighbor, input: &PlanInput<'_>) -> Option<Other> {
        let Params { stale_s, drop_s, .. } = self.params;
        let age_s = neighbor.age_s.max(0.0);
        if age_s > drop_s + ROUNDING_S {
            return None;
        }
        let silent = age_s > stale_s + ROUNDING_S;
        let known_s = if silent { stale_s } else { age_s };
        Some(Other {
            position: neighbor.position + neighbor.velocity * known_s,
            heading_rad: course(neighbor),
            parked: neighbor.arrived || neighbor.stopped || silent,
            right_of_way: !silent && self.right_of_way(neighbor, input),
            rho_m: self.radius_m(input) + neighbor.radius_m + self.params.margin_m + self.params.safety_m,
            // Two robots with one centre must not be pushed the same way, so the lower slot goes back.
            apart_rad: if self.robot < neighbor.id { 0.0 } else { PI },
        })
    }

    /// Whoever has the longer way to go, and has not arrived.
    fn right_of_way(&self, neighbor: &Neighbor, input: &PlanInput<'_>) -> bool {
        let (mine, theirs) = ((input.goal - input.position).norm(), neighbor.remaining_m);
        let longer = theirs > mine || (theirs == mine && neighbor.id < self.robot && !self.params.exact);
        self.params.right_of_way && longer && !neighbor.arrived && (self.params.stopped_keeps_way || !neighbor.stopped)
    }

    /// Step 1 of Eq. 10: who may belong to a crowd; then the crowds.
    fn crowds(&mut self, input: &PlanInput<'_>, own: &Own, near: bool) -> clusters::Crowds {
        let none = clusters::Crowds { force: Vector2::zeros(), stop: false };
        let own_m = self.radius_m(input);
        let reach = 2.0 * (2.0 * own_m + self.params.safety_m);
        let params = &self.params;
        if params.clusters == Which::Off || (own.goal - own.position).norm() < params.c_g * reach {
            return none;
        }
        let mut candidates = std::mem::take(&mut self.scratch.candidates);
        candidates.clear();
        for neighbor in input.neighbors {
            let Some(other) = self.other(neighbor, input) else { continue };
            let distance = (other.position - own.position).norm();
            let counts = match params.cluster_rule {
                ClusterRule::Tangent => {
                    distance < params.c_r * reach
                        && !other.parked
                        && own.sight(other.position, other.apart_rad).beta.abs() < FRAC_PI_2
                }
                _ => distance < if neighbor.arrived { reach } else { params.c_r * reach },
            };
            if counts {
                candidates.push(Member { position: other.position, arrived: neighbor.arrived });
            }
        }
        self.scratch.candidates = candidates;
        let exact = params.exact;
        clusters::crowds(params, own, own_m, near, &mut self.scratch, |force| rounded(force, exact))
    }

    /// Whether a crowd stops the robot. Nothing else guarantees that a crowd opens, so there is an end to waiting.
    fn held_by(&mut self, inside: bool, dt_s: f64) -> bool {
        let wait_s = self.params.crowd_wait_s;
        if self.ignore_s > ROUNDING_S {
            self.ignore_s -= dt_s;
            return false;
        }
        self.held_s = if inside { self.held_s + dt_s } else { 0.0 };
        if wait_s > 0.0 && self.held_s > wait_s + ROUNDING_S {
            (self.held_s, self.ignore_s) = (0.0, wait_s);
            return false;
        }
        inside
    }

    /// From the force to the command, with what the flags make of it.
    fn command(&self, force: Vector2<f64>, sum: &Sum, input: &PlanInput<'_>) -> Twist {
        let params = &self.params;
        let body = Body {
            c_a: params.c_a,
            speed_mps_max: input.limits.speed_mps_max,
            dt_s: input.dt_s,
            blocked: sum.blocked,
            sgn_zero: params.sgn_zero,
        };
        let creep_mps = params.creep * body.speed_mps_max;
        if sum.yields && params.robot_rule == Rule::HalfPlane {
            return Twist { speed_mps: creep_mps, turn_radps: 0.0 };
        }
        let mut twist = params.speed_law().twist(force, &body);
        let pace = body.speed_mps_max / SPEED_REFERENCE_MPS;
        if sum.front_stop {
            twist.speed_mps = 0.0;
            if twist.turn_radps.abs() < 2f64.to_radians() * pace && !params.guarded {
                twist.speed_mps = creep_mps;
            }
        }
        if sum.yields {
            twist.speed_mps = 0.0;
        }
        twist
    }

    /// r_rob of the robot itself.
    fn radius_m(&self, input: &PlanInput<'_>) -> f64 {
        input.radius_m + self.params.margin_m
    }

    /// ρ_o of an obstacle.
    fn rho_o(&self, input: &PlanInput<'_>, obstacle: &Obstacle) -> f64 {
        self.radius_m(input) + obstacle.shape.radius + self.params.safety_m
    }

    fn settle(&self, force: Vector2<f64>) -> Vector2<f64> {
        rounded(force, self.params.exact)
    }
}

/// A force to three decimals, as the reference has it.
pub(crate) fn rounded(force: Vector2<f64>, exact: bool) -> Vector2<f64> {
    if exact { force.map(|x| (x * 1000.0).round_ties_even() / 1000.0) } else { force }
}

/// Where the other robot faces: its heading, unless its course shows that it need not drive ahead.
fn course(neighbor: &Neighbor) -> f64 {
    let velocity = neighbor.velocity;
    if velocity.norm() < COURSE_SPEED_MPS {
        return neighbor.yaw_rad;
    }
    let course = velocity.y.atan2(velocity.x);
    if wrap(course - neighbor.yaw_rad).abs() > COURSE_OFF_RAD { course } else { neighbor.yaw_rad }
}
