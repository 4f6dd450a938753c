//! One environment of the paper, and its runs: raw paths, swarms, the arm's free space.

use crate::environment::{Environment, Expect, take};
use geometry::arm::Room;
use geometry::spline::length;
use geometry::{ArmGeometry, ArmState, Capsule, Elbow};
use model::random::Stream;
use nalgebra::{Point2, Vector2};
use planners::Obstacle;
use planners::pso_via_points::Params;
use planners::pso_via_points::field::{Bodies, RawPath, Variant, raw_path};
use planners::pso_via_points::planning::Recipe;
use planners::pso_via_points::swarm::Swarm;
use planners::pso_via_points::terrain::{Plane, Sheet, Terrain};

/// An environment, ready to run.
#[derive(Debug)]
pub struct Experiment {
    /// Where the path begins, m.
    pub start: Point2<f64>,
    /// Where it ends, m.
    pub goal: Point2<f64>,
    /// The discs.
    pub obstacles: Vec<Obstacle>,
    /// The arm, if it is one.
    pub arm: Option<ArmGeometry>,
    /// Gains and settings of the file.
    pub params: Params,
    /// The same, as the method takes them.
    pub recipe: Recipe,
    /// Inner and outer radius within which the field keeps an arm's tip, m, as the file rounds them.
    ring: Option<(Point2<f64>, f64, f64)>,
}

/// What a swarm came to.
#[derive(Debug)]
pub struct Optimised {
    /// The best spline, finely sampled.
    pub path: Vec<Point2<f64>>,
    /// Its length, m.
    pub length_m: f64,
    /// Smallest distance to an obstacle along it, m; of an arm, of the tip.
    pub clearance_m: f64,
    /// Best cost after the first evaluation and after each iteration.
    pub history: Vec<f64>,
    /// Whether it passed the fine check.
    pub accepted: bool,
    /// Via points of the best particle.
    pub via: Vec<Point2<f64>>,
}

impl Experiment {
    /// The environment with the parameters of its file. Panics at a key that is not known.
    pub fn new(environment: &Environment) -> Experiment {
        Experiment::with(environment, &toml::Table::new())
    }

    /// The same with some parameters of the swarm replaced.
    pub fn with(environment: &Environment, overrides: &toml::Table) -> Experiment {
        let robot = &environment.robots[0];
        let disc = |(id, disc): (usize, &crate::environment::Disc)| Obstacle {
            id: id as u32,
            shape: Capsule::disc(disc.center, disc.radius),
            velocity: Vector2::zeros(),
        };
        let arm = robot.arm.map(|arm| {
            let [low, high] = [0, 1].map(|end| [arm.joint1_degrees[end], arm.joint2_degrees[end]].map(f64::to_radians));
            ArmGeometry {
                base: arm.base,
                links_m: arm.links,
                link_radius_m: 0.0,
                joint_min_rad: low,
                joint_max_rad: high,
            }
        });
        let (mut apf, mut pso) = (environment.params("apf").clone(), environment.params("pso").clone());
        pso.extend(overrides.clone());
        let mut params = if arm.is_some() { Params::arm() } else { Params::default() };
        params.k_att = take(&mut apf, "K_a");
        params.k_rep = take(&mut apf, "K_rep");
        params.influence = take(&mut apf, "d0");
        params.step = take(&mut apf, "step");
        params.steps_max = take(&mut apf, "max_steps") as u32;
        let tolerance_m = take(&mut apf, "arrival_tolerance");
        let ring = arm.map(|arm| (arm.base, take(&mut apf, "inner_disc_radius"), take(&mut apf, "outer_radius")));
        if arm.is_none() {
            params.goal_power = take(&mut apf, "n") as u32;
            params.bias_fade = take(&mut apf, "bias_fade_distance");
            let bias = apf.remove("bias").and_then(|bias| bias.try_into::<[f64; 2]>().ok());
            [params.bias_x, params.bias_y] = bias.unwrap_or_else(|| panic!("`bias` is not two numbers"));
            params.jitter = take(&mut pso, "init_jitter");
        }
        params.via_points = take(&mut pso, "via_points") as u32;
        params.particles = take(&mut pso, "particles") as u32;
        params.iterations = take(&mut pso, "iterations") as u32;
        params.w = take(&mut pso, "w");
        params.c1 = take(&mut pso, "c1");
        params.c2 = take(&mut pso, "c2");
        params.clamp = take(&mut pso, "v_clamp_fraction");
        params.samples = take(&mut pso, "samples") as u32;
        params.margin = take(&mut pso, "clearance_margin");
        params.penalty = take(&mut pso, "penalty");
        assert!(apf.is_empty() && pso.is_empty(), "{}: unknown keys {apf:?} {pso:?}", environment.name);
        let mut recipe = params.recipe(tolerance_m);
        recipe.every_variant = false;
        recipe.fallback = false;
        let obstacles = environment.obstacles.iter().enumerate().map(disc).collect();
        Experiment { start: robot.start, goal: robot.goal, obstacles, arm, params, recipe, ring }
    }

    /// What pushes the raw path.
    pub fn bodies(&self) -> Bodies<'_> {
        Bodies { obstacles: &self.obstacles, ring: self.ring, radius_m: 0.0 }
    }

    /// The raw path of a force variant.
    pub fn raw(&self, variant: Variant) -> RawPath {
        raw_path(&self.recipe.field, variant, &self.bodies(), self.start, self.goal, &self.recipe.walk)
    }

    /// Smallest distance between the points and the obstacles, m.
    pub fn clearance(&self, points: &[Point2<f64>]) -> f64 {
        let shapes = || self.obstacles.iter().map(|obstacle| obstacle.shape);
        points.iter().flat_map(|p| shapes().map(|shape| shape.distance(*p))).fold(f64::INFINITY, f64::min)
    }

    /// Straight-line distance, m.
    pub fn straight(&self) -> f64 {
        (self.goal - self.start).norm()
    }

    /// The swarm on a base path, for a point or in a sheet of the arm.
    pub fn optimise(&self, base: &[Point2<f64>], elbow: Option<Elbow>, seed: u64) -> Optimised {
        match self.arm.zip(elbow) {
            None => {
                let Recipe { margin_m, penalty, .. } = self.recipe;
                self.swarm(base, &Plane { obstacles: &self.obstacles, radius_m: 0.0, margin_m, penalty }, seed)
            }
            Some((geometry, elbow)) => self.swarm(base, &self.sheet(&geometry, elbow), seed),
        }
    }

    /// The terrain of the arm in a sheet.
    pub fn sheet<'a>(&'a self, geometry: &'a ArmGeometry, elbow: Elbow) -> Sheet<'a> {
        let room = Room { joint2_rad: self.recipe.joint2_margin_rad, clearance_m: self.recipe.margin_m };
        Sheet { geometry, elbow, obstacles: &self.obstacles, room, penalty: self.recipe.penalty, joint1_rad: None }
    }

    fn swarm(&self, base: &[Point2<f64>], terrain: &impl Terrain, seed: u64) -> Optimised {
        let mut stream = Stream::new(seed, 0, 0, "pso");
        let mut swarm = Swarm::default();
        swarm.begin(&self.recipe.swarm, base, &mut stream);
        let mut budget = i64::MAX;
        swarm.advance(terrain, &mut stream, &mut budget);
        let accepted = swarm.fine_path(terrain).is_some();
        let path = swarm.fine().to_vec();
        Optimised {
            length_m: length(&path),
            clearance_m: self.clearance(&path),
            history: swarm.history().to_vec(),
            accepted,
            via: swarm.best().to_vec(),
            path,
        }
    }

    /// The arm at a tip position in a sheet. Panics if it is not an arm or cannot be there.
    pub fn arm_at(&self, tip: Point2<f64>, elbow: Elbow) -> ArmState {
        let geometry = self.arm.expect("the environment has an arm");
        let joints_rad = geometry.inverse(tip, elbow).expect("the tip is within reach");
        ArmState { geometry, joints_rad }
    }
}

/// The variant that the environments name so.
pub fn variant(name: &str) -> Variant {
    match name {
        "apf-plain" => Variant::Plain,
        "apf-eq15-16" => Variant::Right,
        "apf-eq17-18" => Variant::Left,
        "apf-bias-faded" => Variant::FadedBias,
        "apf-bias-literal" => Variant::LiteralBias,
        other => panic!("no force variant is called `{other}`"),
    }
}

/// A share of the raw path in per cent.
pub fn reduction_percent(raw_m: f64, optimised_m: f64) -> f64 {
    100.0 * (1.0 - optimised_m / raw_m)
}

/// The number of seeds that an expectation asks for.
pub fn seeds(expect: &Expect) -> u64 {
    u64::from(expect.seeds.unwrap_or(1))
}
