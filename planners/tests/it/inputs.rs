//! Inputs for a planner: an owned scene, and short ways to write its parts.

use geometry::Capsule;
use model::{BodyKind, Limits, ParamValue, ParamValues, Wheels};
use nalgebra::{Point2, Vector2};
use shoal_planners::{Identity, METHODS, Method, Neighbor, Obstacle, PlanInput, Planner};

/// A robot and all it knows; what [`PlanInput`] borrows.
#[derive(Clone, Debug)]
pub(crate) struct Scene {
    pub(crate) position: Point2<f64>,
    pub(crate) yaw_rad: f64,
    pub(crate) velocity: Vector2<f64>,
    pub(crate) turn_radps: f64,
    pub(crate) radius_m: f64,
    pub(crate) kind: BodyKind,
    pub(crate) limits: Limits,
    pub(crate) wheels: Option<Wheels>,
    pub(crate) goal: Point2<f64>,
    pub(crate) arrived: bool,
    pub(crate) obstacles: Vec<Obstacle>,
    pub(crate) neighbors: Vec<Neighbor>,
}

pub(crate) const LIMITS: Limits = Limits {
    speed_mps_max: 1.0,
    reverse_mps_max: 0.0,
    turning_radius_m_min: 0.0,
    turn_radps_max: 3.0,
    accel_mps2_max: f64::INFINITY,
    turn_accel_radps2_max: f64::INFINITY,
};

pub(crate) const IDENTITY: Identity = Identity { seed: 1, robot: 0, incarnation: 0 };

impl Scene {
    /// A point robot of radius 0.2 m between two points, alone.
    pub(crate) fn new(position: [f64; 2], goal: [f64; 2]) -> Scene {
        Scene {
            position: position.into(),
            yaw_rad: 0.0,
            velocity: Vector2::zeros(),
            turn_radps: 0.0,
            radius_m: 0.2,
            kind: BodyKind::Point,
            limits: LIMITS,
            wheels: None,
            goal: goal.into(),
            arrived: false,
            obstacles: Vec::new(),
            neighbors: Vec::new(),
        }
    }

    pub(crate) fn input(&self, tick: u64, dt_s: f64) -> PlanInput<'_> {
        PlanInput {
            tick,
            dt_s,
            position: self.position,
            yaw_rad: self.yaw_rad,
            velocity: self.velocity,
            turn_radps: self.turn_radps,
            radius_m: self.radius_m,
            kind: self.kind,
            limits: self.limits,
            goal: self.goal,
            goal_tolerance_m: 0.1,
            goal_yaw_rad: None,
            goal_yaw_tolerance_rad: 0.1,
            arrived: self.arrived,
            obstacles: &self.obstacles,
            neighbors: &self.neighbors,
            map: &self.obstacles,
            walls: None,
            arm: None,
            wheels: self.wheels,
            allowed: &[],
        }
    }
}

/// A disc that stands still.
pub(crate) fn disc(id: u32, center: [f64; 2], radius: f64) -> Obstacle {
    Obstacle { id, shape: Capsule::disc(center.into(), radius), velocity: Vector2::zeros() }
}

/// A robot of radius 0.2 m that stands still and spoke just now.
pub(crate) fn robot(id: u32, position: [f64; 2]) -> Neighbor {
    Neighbor {
        id,
        position: position.into(),
        yaw_rad: 0.0,
        velocity: Vector2::zeros(),
        radius_m: 0.2,
        age_s: 0.0,
        remaining_m: 1.0,
        arrived: false,
        stopped: false,
        next: None,
        intent: None,
    }
}

/// Parameter values from a table as scenarios have it.
pub(crate) fn values(table: &toml::Table) -> ParamValues {
    let value = |value: &toml::Value| match value {
        toml::Value::Float(x) => ParamValue::Float(*x),
        toml::Value::Integer(n) => ParamValue::Int(*n),
        toml::Value::Boolean(b) => ParamValue::Bool(*b),
        toml::Value::String(word) => ParamValue::Choice(word.clone()),
        other => panic!("no parameter has the type of {other:?}"),
    };
    table.iter().map(|(name, v)| (name.clone(), value(v))).collect()
}

/// The method with parameters written as in a scenario: `xi = 1.0`, one a line.
pub(crate) fn build(method: &str, params: &str, identity: Identity) -> Box<dyn Planner> {
    let table: toml::Table = params.parse().expect("parameters are TOML");
    let method = shoal_planners::find(method).expect("the method exists");
    (method.build)(&values(&table), identity).expect("the parameters fit")
}

/// Every method with its default parameters.
pub(crate) fn every_method() -> impl Iterator<Item = (&'static Method, Box<dyn Planner>)> {
    METHODS.iter().map(|method| (*method, (method.build)(&ParamValues::new(), IDENTITY).expect("defaults fit")))
}
