//! The method `liquid-online`, the paper's "modified" variant: a round whenever a step is done, with what is sensed.
//!
//! A tick has at most one round of A_nsd + 1 evaluations, so the speed is at most a step per tick. A tick whose round
//! finds a local minimum has no motion. Virtual obstacles are taken down when the goal changes.
//!
//! A point drives to the end of each step. A unicycle keeps the direction of the step until it is three quarters of it
//! farther: chasing points nearer than it can turn would make it circle. Whoever is pushed off a step begins another.

use super::common::Common;
use super::field::{Field, Law};
use super::known::{moves, parked};
use super::layer::{Layer, speed_near, stay, towards};
use crate::method::{Identity, Length, Method, Symmetry};
use crate::params::ParamError;
use crate::planner::{Obstacle, Plan, PlanInput, Planner};
use model::{BodyKind, ParamValues, PlanState};
use nalgebra::{Point2, Vector2};

/// Something that moves within this distance may be why there is a local minimum, m: the reach of a virtual obstacle.
const REACH_M: f64 = 1.5;
/// A body that does not follow at once may circle around a minimum: so many rounds without getting lower count as one.
const ROUNDS_LEVEL_MAX: u32 = 10;
/// How many robots that have arrived fit into the potential without a new allocation.
const PARKED: usize = 64;

/// Registry entry.
pub static METHOD: Method = Method {
    name: "liquid-online",
    summary: "descends a potential step by step and fills each hollow it gets into with a virtual obstacle",
    source: "Moaveni, Ghanbari Gol 2011",
    // Sixteen directions, and passing on the right.
    symmetry: Symmetry { rotation: false, translation: true, reflection: false, neighbor_order: true },
    kinds: BodyKind::MOBILE,
    params: Params::specs,
    speed_mps,
    lengths: &[
        Length::of("k_o", 2),
        Length::of("k_t", -1),
        Length::of("k_v", 2),
        Length::of("evade_gain", 3),
        Length::of("evade_range_m", 1),
    ],
    wants_filter: false,
    follows_ways: false,
    build,
};

crate::params! {
    /// Parameters that a scenario can set.
    pub struct Params {
        ..common: Common;
        /// Virtual obstacles at one time before it gives up. Larger: later.
        virtual_max: u32 = 300, "", 1..=100_000;
        /// Virtual obstacles put up near something that moves are taken down after so long; 0: never.
        lifetime_s: f64 = 5.0, "s", 0.0..=1e6;
    }
}

/// A step on its way.
#[derive(Clone, Copy, Debug)]
struct Leg {
    from: Point2<f64>,
    to: Point2<f64>,
}

/// The method at work for one robot.
#[derive(Clone, Debug)]
pub struct LiquidOnline {
    params: Params,
    /// The length of a step is nobody's choice and grows with what the body drives in a tick.
    follows_speed: bool,
    law: Law,
    layer: Layer,
    /// The goal that the virtual obstacles belong to.
    goal: Option<Point2<f64>>,
    leg: Option<Leg>,
    virtual_obstacles: Vec<Point2<f64>>,
    /// When each of them is taken down, s; infinite for never.
    until_s: Vec<f64>,
    /// What is in the potential: kept for its memory.
    around: Vec<Obstacle>,
    rounds: usize,
    steps: usize,
    planted: usize,
    gave_up: bool,
    /// The lowest potential since the last virtual obstacle was put up, and the rounds since then.
    lowest: f64,
    level: u32,
}

fn build(values: &ParamValues, identity: Identity) -> Result<Box<dyn Planner>, ParamError> {
    let follows_speed = Common::step_m.given(values).is_none();
    Ok(Box::new(LiquidOnline { follows_speed, ..LiquidOnline::new(Params::from_values(values)?, identity) }))
}

/// One step a tick.
fn speed_mps(values: &ParamValues, dt_s: f64) -> f64 {
    if Common::step_m.given(values).is_some() {
        Params::default().with(values).common.step_m / dt_s
    } else {
        f64::INFINITY
    }
}

impl Planner for LiquidOnline {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        if input.arrived || input.kind == BodyKind::TwoLinkArm {
            return stay(input);
        }
        if self.follows_speed {
            self.law.step_m = self.params.common.step_m.max(input.limits.speed_mps_max * input.dt_s);
        }
        self.begin_tick(input);
        let wanted = self.wanted(input);
        let push = self.layer.push(wanted, input);
        let state = if self.gave_up { PlanState::GaveUp } else { PlanState::Ready };
        Plan { state, ..self.layer.plan(wanted, push, &self.around, input) }
    }
}

impl LiquidOnline {
    /// The method with these parameters, for this robot.
    pub fn new(params: Params, identity: Identity) -> LiquidOnline {
        let (law, layer) = (params.common.law(), params.common.layer(identity.robot));
        let virtual_max = params.virtual_max as usize;
        LiquidOnline {
            params,
            follows_speed: false,
            law,
            layer,
            goal: None,
            leg: None,
            virtual_obstacles: Vec::with_capacity(virtual_max),
            until_s: Vec::with_capacity(virtual_max),
            around: Vec::with_capacity(PARKED),
            rounds: 0,
            steps: 0,
            planted: 0,
            gave_up: false,
            lowest: f64::INFINITY,
            level: 0,
        }
    }

    /// The virtual obstacles that stand, m.
    pub fn virtual_obstacles(&self) -> &[Point2<f64>] {
        &self.virtual_obstacles
    }

    /// How many were put up for this goal.
    pub fn planted(&self) -> usize {
        self.planted
    }

    /// Rounds for this goal.
    pub fn rounds(&self) -> usize {
        self.rounds
    }

    /// Steps begun for this goal.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// It would need more virtual obstacles than it may have, and stays until its goal changes or one is taken down.
    pub fn gave_up(&self) -> bool {
        self.gave_up
    }

    /// The numbers of its potential.
    pub fn law(&self) -> &Law {
        &self.law
    }

    fn begin_tick(&mut self, input: &PlanInput<'_>) {
        if self.goal.is_none_or(|goal| (input.goal - goal).norm() > self.law.tolerance_m()) {
            self.goal = Some(input.goal);
            self.leg = None;
            self.virtual_obstacles.clear();
            self.until_s.clear();
            (self.rounds, self.steps, self.planted) = (0, 0, 0);
            self.gave_up = false;
            (self.lowest, self.level) = (f64::INFINITY, 0);
        }
        let now_s = input.tick as f64 * input.dt_s;
        let mut stands = self.until_s.iter().map(|until_s| *until_s > now_s);
        self.virtual_obstacles.retain(|_| stands.next().unwrap_or(false));
        self.until_s.retain(|until_s| *until_s > now_s);
        self.gave_up &= self.virtual_obstacles.len() >= self.params.virtual_max as usize;

        self.around.clear();
        self.around.extend_from_slice(input.obstacles);
        if self.layer.on {
            self.around.extend(input.neighbors.iter().filter(|other| other.arrived).map(parked));
        }
    }

    fn wanted(&mut self, input: &PlanInput<'_>) -> Vector2<f64> {
        let field = Field {
            law: &self.law,
            k_v: self.law.k_v,
            agent_radius_m: input.radius_m,
            goal: input.goal,
            obstacles: &self.around,
            virtual_obstacles: &self.virtual_obstacles,
        };
        let (position, to_goal) = (input.position, input.goal - input.position);
        let distance = to_goal.norm();
        if distance <= self.law.tolerance_m() {
            let fits = field.is_free(position, input.goal);
            let speed_max = speed_near(distance, self.params.common.heading_gain, input);
            return if fits { towards(input.goal, input).cap_magnitude(speed_max) } else { Vector2::zeros() };
        }
        if self.gave_up {
            return Vector2::zeros();
        }
        if self
            .leg
            .is_none_or(|leg| leg.is_over(position, input.kind, self.law.step_m) || !field.is_free(position, leg.to))
        {
            self.rounds += 1;
            let follows = input.kind == BodyKind::Point && input.limits.accel_mps2_max.is_infinite();
            let here = if follows { f64::NEG_INFINITY } else { field.at(position) };
            (self.lowest, self.level) = if here < self.lowest { (here, 0) } else { (self.lowest, self.level + 1) };
            let circles = !follows && self.level >= ROUNDS_LEVEL_MAX;
            let lower = field.descend(position).filter(|_| !circles);
            self.leg = lower.map(|to| Leg { from: position, to });
            if lower.is_some() {
                self.steps += 1;
            } else {
                self.put_up(input);
            }
        }
        let Some(leg) = self.leg else { return Vector2::zeros() };
        let speed_max = speed_near(distance, self.params.common.heading_gain, input);
        match input.kind {
            BodyKind::Point | BodyKind::TwoLinkArm => towards(leg.to, input).cap_magnitude(speed_max),
            BodyKind::Unicycle | BodyKind::DiffDrive => {
                let speed = input.limits.speed_mps_max.min(self.law.step_m / input.dt_s).min(speed_max);
                speed * (leg.to - leg.from) / self.law.step_m
            }
        }
    }

    /// (13): a drop stays behind.
    fn put_up(&mut self, input: &PlanInput<'_>) {
        let position = input.position;
        if self.virtual_obstacles.len() >= self.params.virtual_max as usize {
            self.gave_up = true;
            return;
        }
        let thing = input.obstacles.iter().any(|thing| moves(thing) && thing.shape.distance(position) <= REACH_M);
        let mut robots = input.neighbors.iter().filter(|other| !other.arrived);
        let robot = self.layer.on && robots.any(|other| (other.position - position).norm() <= REACH_M);
        (self.lowest, self.level) = (f64::INFINITY, 0);
        let lives_on = self.params.lifetime_s == 0.0 || !(thing || robot);
        let now_s = input.tick as f64 * input.dt_s;
        self.virtual_obstacles.push(position);
        self.until_s.push(if lives_on { f64::INFINITY } else { now_s + self.params.lifetime_s });
        self.planted += 1;
    }
}

impl Leg {
    /// At its end, or far enough along it, or pushed off it.
    fn is_over(&self, position: Point2<f64>, kind: BodyKind, step_m: f64) -> bool {
        let (along, driven) = ((self.to - self.from) / step_m, position - self.from);
        let off = match kind {
            BodyKind::Unicycle | BodyKind::DiffDrive => driven.norm() > 1.5 * step_m,
            _ => along.perp(&driven).abs().max(-along.dot(&driven)) > step_m / 4.0,
        };
        along.dot(&driven) >= 0.75 * step_m || off
    }
}
