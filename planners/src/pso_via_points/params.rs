//! What a scenario can change, and what a plan is made with.

use super::field::{Field, Walk};
use super::planning::Recipe;
use super::swarm::Settings;
use nalgebra::Vector2;

crate::params! {
    /// Parameters that a scenario can set. Defaults are those of a body in the plane; an arm starts from [`Params::arm`].
    pub struct Params {
        /// Attraction gain K_a of the raw path. Larger: straighter.
        k_att: f64 = 1.0, "", 0.001..=100.0;
        /// Repulsion gain K_rep of the raw path (arm: 0.2). Larger: wider around everything.
        k_rep: f64 = 0.5, "", 0.0..=100.0;
        /// Influence distance d₀ of the raw path, to the surface (arm: 0.5). Larger: turns away sooner.
        influence: f64 = 1.0, "m", 0.01..=100.0;
        /// Power n of the distance to the goal in the repulsion. Larger: weaker repulsion near the goal.
        goal_power: u32 = 0, "", 0..=4;
        /// Constant force of the last variant along x. Larger: turns aside more.
        bias_x: f64 = -0.75, "", -100.0..=100.0;
        /// Constant force of the last variant along y. Larger: turns aside more.
        bias_y: f64 = 0.5, "", -100.0..=100.0;
        /// Distance from the goal within which the bias fades. Larger: fades sooner.
        bias_fade: f64 = 1.0, "m", 0.001..=100.0;
        /// Step of the raw path. Larger: coarser.
        step: f64 = 0.05, "m", 0.001..=10.0;
        /// Steps after which a variant has failed. Larger: longer raw paths.
        steps_max: u32 = 2000, "", 10..=100000;
        /// Via points of a particle (arm: 5). Larger: more bends, slower to settle; loops beyond about 5.
        via_points: u32 = 3, "", 1..=16;
        /// Particles of the swarm (arm: 60). Larger: better paths, later.
        particles: u32 = 40, "", 1..=1000;
        /// Iterations of the swarm at most. Larger: better paths, later.
        iterations: u32 = 200, "", 1..=10000;
        /// Inertia w. Larger: more exploration.
        w: f64 = 0.7298, "", 0.0..=1.0;
        /// Pull c1 of a particle's own best. Larger: more exploration.
        c1: f64 = 1.4962, "", 0.0..=4.0;
        /// Pull c2 of the swarm's best. Larger: settles sooner.
        c2: f64 = 1.4962, "", 0.0..=4.0;
        /// Velocity limit as a part of the search box's side (arm: 0.05). Larger: particles move further at once.
        clamp: f64 = 0.1, "", 0.001..=1.0;
        /// How far the search box reaches beyond the raw path. Larger: wider detours are found.
        box_margin: f64 = 1.0, "m", 0.0..=1000.0;
        /// Samples of a spline. Larger: finer cost, slower.
        samples: u32 = 200, "", 10..=2000;
        /// Clearance wanted (arm: 0.05). Larger: keeps further away, does not fit through as much.
        margin: f64 = 0.1, "m", 0.0..=10.0;
        /// Cost per metre of missing clearance, sample and obstacle (arm: 10 per sample that is not free). Larger:
        /// keeps to the margin more strictly.
        penalty: f64 = 100.0, "", 0.0..=1e6;
        /// Spread of the first via points about the raw path. Larger: the swarm starts wider.
        jitter: f64 = 0.1, "m", 0.0..=100.0;
        /// Iterations without gain after which the swarm ends; 0: never. Larger: tries longer.
        patience: u32 = 50, "", 0..=10000;
        /// What counts as a gain. Larger: settles sooner.
        gain: f64 = 0.001, "m", 0.0..=10.0;
        /// Go on with the other force variants after the first that arrived (arm: false).
        every_variant: bool = true, "";
        /// Distance computations a tick (arm: 300000). Larger: plans in fewer, longer ticks.
        evaluations: u32 = 200000, "", 1000..=100000000;
        /// How far ahead on the path the robot heads. Larger: smoother, cuts corners.
        look_ahead: f64 = 0.2, "m", 0.01..=100.0;
        /// Gain of the push of moving robots. Larger: wider around them.
        robot_gain: f64 = 0.1, "m⁴/s", 0.0..=100.0;
        /// Distance at which that push begins. Larger: feels them sooner.
        robot_range: f64 = 1.0, "m", 0.01..=100.0;
        /// Part of that push that is turned to the left, as in (17) and (18). Larger: passes on the right sooner.
        robot_turn: f64 = 1.0, "", 0.0..=10.0;
        /// Time without progress after which the robot plans again. Larger: more patient.
        blocked: f64 = 2.0, "s", 0.1..=600.0;
        /// Turn rate of a unicycle per radian of heading error. Larger: turns sharper.
        heading_gain: f64 = 3.0, "1/s", 0.0..=100.0;
        /// Grid of an arm's free space. Larger: coarser, faster.
        grid: f64 = 0.1, "m", 0.01..=10.0;
    }
}

/// Margin of an arm's joint 2 in the swarm, rad.
const JOINT2_MARGIN_RAD: f64 = std::f64::consts::PI / 180.0;

impl Params {
    /// The values of an arm.
    pub fn arm() -> Params {
        Params {
            k_rep: 0.2,
            influence: 0.5,
            via_points: 5,
            particles: 60,
            clamp: 0.05,
            margin: 0.05,
            penalty: 10.0,
            every_variant: false,
            evaluations: 300_000,
            ..Params::default()
        }
    }

    /// What a plan is made with.
    pub fn recipe(&self, tolerance_m: f64) -> Recipe {
        Recipe {
            field: Field {
                k_att: self.k_att,
                k_rep: self.k_rep,
                influence_m: self.influence,
                goal_power: self.goal_power,
                bias: Vector2::new(self.bias_x, self.bias_y),
                bias_fade_m: self.bias_fade,
            },
            walk: Walk { step_m: self.step, tolerance_m, steps_max: self.steps_max as usize },
            swarm: Settings {
                via_points: self.via_points as usize,
                particles: self.particles as usize,
                iterations: self.iterations as usize,
                inertia: self.w,
                own_pull: self.c1,
                swarm_pull: self.c2,
                clamp: self.clamp,
                box_m: self.box_margin,
                samples: self.samples as usize,
                jitter_m: self.jitter,
                aside_m: 0.0,
                patience: self.patience as usize,
                gain_m: self.gain,
            },
            margin_m: self.margin,
            penalty: self.penalty,
            joint2_margin_rad: JOINT2_MARGIN_RAD,
            grid_m: self.grid,
            every_variant: self.every_variant,
            fallback: true,
        }
    }
}
