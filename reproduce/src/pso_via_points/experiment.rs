//! One scene of the paper, and its runs: raw paths, swarms, the arm's free space.

use crate::scene::{Scene, goal};
use geometry::arm::Room;
use geometry::spline::length;
use geometry::{ArmGeometry, Elbow};
use model::random::Stream;
use model::{ParamValues, Scenario};
use nalgebra::Point2;
use planners::Obstacle;
use planners::pso_via_points::Params;
use planners::pso_via_points::field::{Bodies, RawPath, Variant, raw_path};
use planners::pso_via_points::planning::Recipe;
use planners::pso_via_points::swarm::Swarm;
use planners::pso_via_points::terrain::{Plane, Sheet, Terrain};
use scenarios::Expectation;

/// A scene, ready to run.
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
    /// Gains and settings, as the method takes them.
    pub recipe: Recipe,
    /// As a scenario.
    pub scenario: Scenario,
    /// Inner and outer radius within which the field keeps an arm's tip, m, to the centimetre as the specification has
    /// them.
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
    /// The scene with the paper's parameters, which are the method's defaults.
    pub fn new(scene: &Scene) -> Experiment {
        Experiment::with(scene, &ParamValues::new())
    }

    /// The same with some parameters replaced.
    pub fn with(scene: &Scene, changes: &ParamValues) -> Experiment {
        let robot = scene.robot();
        let arm = robot.arm.map(|arm| arm.geometry);
        let params = if arm.is_some() { Params::arm() } else { Params::default() };
        let mut recipe = params.with(changes).recipe(robot.goal_tolerance_m);
        recipe.every_variant = false;
        recipe.fallback = false;
        let ring = arm.map(|arm| {
            let (inner_m, outer_m) = arm.reach();
            let [inner_m, outer_m] = [inner_m, outer_m].map(|radius_m| (radius_m * 100.0).round() / 100.0);
            (arm.base, inner_m, outer_m)
        });
        let (start, goal, obstacles) = (robot.start, goal(robot), scene.discs());
        Experiment { start, goal, obstacles, arm, recipe, scenario: scene.scenario.clone(), ring }
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
}

/// The variant that the scenes name so.
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
pub fn seeds(expect: &Expectation) -> u64 {
    u64::from(expect.seeds.unwrap_or(1))
}
