//! The method `liquid`: thinks on what it knows, in slices, then follows the path.
//!
//! While it thinks, it stands still. It thinks anew when its goal moves by more than a step, when something unknown
//! stands in the way of the rest of the path, and when it was pushed off the path. With `replan_moving` what moves is
//! planned round where it is, and again whenever it has moved by half a step. A search that fails is kept for a
//! look; the robot stays where it is until its goal or its knowledge changes.

use super::common::Common;
use super::field::{Field, Law};
use super::known::{Known, News};
use super::layer::{Layer, speed_near, stay, towards};
use super::search::{Budget, Progress, Search};
use crate::method::{Identity, Length, Method, Symmetry, any_speed};
use crate::params::ParamError;
use crate::planner::{Plan, PlanInput, Planner};
use model::{BodyKind, ParamValues, PlanState};
use nalgebra::{Point2, Vector2};

/// A robot farther than so many steps from its path thinks anew.
const STRAY_STEPS: f64 = 5.0;
/// Distances to known pieces that are computed in a tick of thinking at most, but for a first round (about a millisecond).
const LOOKS_PER_TICK: usize = 40_000;
/// How many points ahead the nearest point of the path is looked for.
const WINDOW: usize = 20;

/// Registry entry.
pub static METHOD: Method = Method {
    name: "liquid",
    summary: "descends a potential in thought, fills each hollow with a virtual obstacle, then drives the path it found",
    source: "Moaveni, Ghanbari Gol 2011",
    // Sixteen directions, and passing on the right.
    symmetry: Symmetry { rotation: false, translation: true, reflection: false, neighbor_order: true },
    kinds: BodyKind::MOBILE,
    params: Params::specs,
    speed_mps: any_speed,
    lengths: &[
        Length::of("step_m", 1),
        Length::of("k_o", 2),
        Length::of("k_t", -1),
        Length::of("k_v", 2),
        Length::of("evade_gain", 3),
        Length::of("evade_range_m", 1),
        Length::of("lookahead_m", 1),
    ],
    wants_filter: false,
    follows_ways: false,
    build,
};

crate::params! {
    /// Parameters that a scenario can set.
    pub struct Params {
        ..common: Common;
        /// Virtual obstacles before it gives up a K_v. Larger: later.
        virtual_max: u32 = 300, "", 1..=100_000;
        /// Rounds before it gives up a K_v. Larger: later.
        rounds_max: u32 = 20_000, "", 1..=10_000_000;
        /// How many smaller K_v it tries: K_v/6, K_v/60. Larger: gives up later.
        fallbacks: u32 = 2, "", 0..=2;
        /// Rounds of thinking in a tick, each of A_nsd + 1 evaluations. Larger: thinks for fewer, longer ticks. Among
        /// more than 47 known pieces there are fewer (with 16 directions): their number times that of pieces is bounded.
        rounds_per_tick: u32 = 50, "", 1..=100_000;
        /// Plan round what moves, and again whenever it has moved by half a step, as the paper asks for; otherwise what
        /// moves is only evaded. The robot stands while it thinks: raise rounds_per_tick until a plan fits into a tick.
        replan_moving: bool = false, "";
        /// How far ahead a unicycle looks along its path. Larger: cuts corners more.
        lookahead_m: f64 = 0.3, "m", 0.0..=100.0;
    }
}

/// The method at work for one robot.
#[derive(Clone, Debug)]
pub struct Liquid {
    params: Params,
    law: Law,
    layer: Layer,
    known: Known,
    search: Search,
    begun: bool,
    /// Number of the point of the path where the robot is.
    at: usize,
}

fn build(values: &ParamValues, identity: Identity) -> Result<Box<dyn Planner>, ParamError> {
    Ok(Box::new(Liquid::new(Params::from_values(values)?, identity)))
}

impl Planner for Liquid {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        if input.arrived || input.kind == BodyKind::TwoLinkArm {
            return stay(input);
        }
        let news = self.known.notice(input, self.layer.on, self.params.common.step_m / 2.0);
        if self.must_think_again(input, news) {
            self.begun = true;
            self.at = 0;
            self.search.begin(input.position, input.goal);
        }
        // A round looks at everything that is known from every direction: among many things there are fewer rounds in a tick.
        let looks = (self.law.directions.len() + 1) * self.known.obstacles().len().max(1);
        let rounds = (self.params.rounds_per_tick as usize).min((LOOKS_PER_TICK / looks).max(1));
        match self.search.advance(&self.law, input.radius_m, self.known.obstacles(), rounds) {
            Progress::Found => self.follow(input),
            Progress::Thinking => Plan { state: PlanState::Planning, ..stay(input) },
            Progress::Failed => Plan { state: PlanState::GaveUp, ..stay(input) },
        }
    }
}

impl Liquid {
    /// The method with these parameters, for this robot.
    pub fn new(params: Params, identity: Identity) -> Liquid {
        let (law, layer) = (params.common.law(), params.common.layer(identity.robot));
        let search = Search::new(Budget {
            virtual_max: params.virtual_max as usize,
            rounds_max: params.rounds_max as usize,
            fallbacks: params.fallbacks as usize,
        });
        let known = Known::new(params.replan_moving);
        Liquid { params, law, layer, known, search, begun: false, at: 0 }
    }

    /// What it thinks, or has thought.
    pub fn search(&self) -> &Search {
        &self.search
    }

    /// What it takes to be there.
    pub fn known(&self) -> &Known {
        &self.known
    }

    /// The numbers of its potential.
    pub fn law(&self) -> &Law {
        &self.law
    }

    fn must_think_again(&self, input: &PlanInput<'_>, news: News) -> bool {
        let path = self.search.path();
        if !self.begun || (input.goal - self.search.goal()).norm() > self.law.step_m {
            return true;
        }
        match self.search.progress() {
            // Among things that never rest, a search that restarts with each of their moves would never end.
            Progress::Thinking => news.standing,
            Progress::Failed => news.standing || news.moving,
            Progress::Found => {
                let stray_m = STRAY_STEPS * self.law.step_m;
                let at = self.nearest(input.position);
                let concerns = || self.params.replan_moving || !self.is_free(at, input);
                (input.position - path[at]).norm() > stray_m || news.moving || (news.standing && concerns())
            }
        }
    }

    /// Whether the rest of the path is free of everything known.
    fn is_free(&self, from: usize, input: &PlanInput<'_>) -> bool {
        let field = self.field(input);
        self.search.path()[from..].windows(2).all(|ends| field.is_free(ends[0], ends[1]))
    }

    fn field<'a>(&'a self, input: &PlanInput<'_>) -> Field<'a> {
        Field {
            law: &self.law,
            k_v: self.law.k_v / self.search.k_v_divisor(),
            agent_radius_m: input.radius_m,
            goal: input.goal,
            obstacles: self.known.obstacles(),
            virtual_obstacles: self.search.virtual_obstacles(),
        }
    }

    /// The point of the path nearest to the robot, from where it was last.
    fn nearest(&self, position: Point2<f64>) -> usize {
        let ahead = self.search.path().iter().enumerate().skip(self.at).take(WINDOW);
        let distance = |point: &Point2<f64>| (point - position).norm_squared();
        ahead.min_by(|a, b| distance(a.1).total_cmp(&distance(b.1))).map_or(self.at, |(i, _)| i)
    }

    fn follow(&mut self, input: &PlanInput<'_>) -> Plan {
        self.at = self.nearest(input.position);
        let field = self.field(input);
        let position = input.position;
        let path = self.search.path();
        let stride_m = input.limits.speed_mps_max * input.dt_s;
        let reach_m = match input.kind {
            BodyKind::Point | BodyKind::TwoLinkArm => stride_m,
            BodyKind::Unicycle | BodyKind::DiffDrive => stride_m.max(self.params.lookahead_m),
        };
        // A robot that was pushed aside goes on beside its path, and back to it bit by bit.
        let aside_m = (path[self.at] - position).norm();
        let reach_m = if aside_m > 0.75 * self.law.step_m { reach_m.max(2.2 * aside_m) } else { reach_m };
        // The rest of the path; the goal itself comes after the last point, if the robot fits there.
        let end = Some(input.goal).filter(|goal| field.clearance(*goal) > 0.0);
        let passed =
            path.get(self.at + 1).is_none_or(|next| (path[self.at] - position).dot(&(next - path[self.at])) <= 0.0);
        let rest = path[self.at..].iter().skip(usize::from(passed)).copied().chain(end);
        let last = end.unwrap_or(path[path.len() - 1]);
        let within = reach_m * (1.0 - 1e-9);
        let mut carrot = rest.clone().find(|point| (point - position).norm() >= within).unwrap_or(last);
        if reach_m > self.law.step_m && !field.is_free(position, carrot) {
            // No short cuts through obstacles.
            let near = self.law.step_m / 4.0;
            carrot = rest.clone().find(|point| (point - position).norm() > near).unwrap_or(last);
        }
        let speed_max = speed_near((last - position).norm(), self.params.common.heading_gain, input);
        let wanted = match input.kind {
            BodyKind::Point | BodyKind::TwoLinkArm => towards(carrot, input).cap_magnitude(speed_max),
            BodyKind::Unicycle | BodyKind::DiffDrive => {
                let to_carrot = carrot - position;
                let turning = self.params.common.heading_gain * to_carrot.norm();
                let speed = input.limits.speed_mps_max.min(speed_max).min(turning);
                to_carrot.try_normalize(0.0).map_or(Vector2::zeros(), |direction| speed * direction)
            }
        };
        let push = self.layer.push(wanted, input);
        self.layer.plan(wanted, push, self.known.obstacles(), input)
    }
}
