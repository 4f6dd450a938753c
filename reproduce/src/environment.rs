//! The papers' environments and what is expected in them: `data/*.toml`, described in `data/README.md`, compiled in. A
//! key that is not understood is an error, so that no expectation is passed over.

use model::{ParamValue, ParamValues};
use nalgebra::{Point2, Vector2};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::sync::LazyLock;

macro_rules! files {
    ($($name:literal)+) => { &[$(($name, include_str!(concat!("../data/", $name, ".toml")))),+] };
}

/// Name and text of every file.
const FILES: &[(&str, &str)] = files! {
    "apf_antipodal8" "apf_close_goals_05" "apf_close_goals_15" "apf_cross4" "apf_dynamic" "apf_headon"
    "apf_headon_offset" "apf_two_disc_trap"
    "liquid_clogged" "liquid_corridor" "liquid_corridor_tight" "liquid_enclosed" "liquid_free" "liquid_gap"
    "liquid_near_goal" "liquid_ring_front" "liquid_ring_side" "liquid_two_obstacles" "liquid_u_resonance"
    "liquid_u_shallow" "liquid_u_trap"
    "pso_arm_1" "pso_arm_elbow_flip" "pso_mass_point_1" "pso_mass_point_2"
    "rpoa_khan2014" "rpoa_moving6" "rpoa_moving_target" "rpoa_orbiter" "rpoa_orbiter_fast" "rpoa_squeeze"
    "rpoa_static" "rpoa_static_moved4" "rpoa_u_trap"
};

static ENVIRONMENTS: LazyLock<Vec<Environment>> = LazyLock::new(|| {
    let read = |(name, text): &(&str, &str)| match Environment::parse(text) {
        Ok(environment) if environment.name == *name => environment,
        Ok(environment) => panic!("data/{name}.toml calls itself `{}`", environment.name),
        Err(problem) => panic!("data/{name}.toml: {problem}"),
    };
    FILES.iter().map(read).collect()
});

/// Every environment, by file name.
pub fn environments() -> &'static [Environment] {
    &ENVIRONMENTS
}

/// The environments whose names begin so: those of one paper, by file name.
pub fn environments_of(prefix: &str) -> impl Iterator<Item = &'static Environment> {
    environments().iter().filter(move |environment| environment.name.starts_with(prefix))
}

/// The environment of that name, which is the name of its file without ending. Panics if there is none: the names
/// stand in the code of the papers.
pub fn environment(name: &str) -> &'static Environment {
    let found = environments().iter().find(|environment| environment.name == name);
    found.unwrap_or_else(|| panic!("no environment is called `{name}`"))
}

/// One file: bodies in a plane, parameter sets, expectations.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Environment {
    /// Version of the format.
    pub schema: Schema,
    /// Name, as the file's.
    pub name: String,
    /// What it shows.
    pub note: String,
    /// The part of the plane that is shown.
    pub world: World,
    /// The robots, in the order in which results are listed.
    #[serde(rename = "robot")]
    pub robots: Vec<Robot>,
    /// The obstacles.
    #[serde(rename = "obstacle", default)]
    pub obstacles: Vec<Disc>,
    /// Parameter sets by name, as they stand in the file.
    pub params: BTreeMap<String, toml::Table>,
    /// What is expected.
    pub expect: Vec<Expect>,
}

/// The only version of the format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Schema {
    /// `papers-env/1`.
    #[serde(rename = "papers-env/1")]
    PapersEnv1,
}

/// A rectangle.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct World {
    /// From and to, m.
    pub x: [f64; 2],
    /// From and to, m.
    pub y: [f64; 2],
}

/// A robot; of an arm, `start` and `goal` are positions of its tip.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RobotKeys")]
pub struct Robot {
    /// Where it starts, m.
    pub start: Point2<f64>,
    /// Where it is to go, m; where its goal is at first if that moves.
    pub goal: Point2<f64>,
    /// Its body, m; zero for an arm.
    pub radius: f64,
    /// The goal counts as reached within this distance, m.
    pub arrival_tolerance: f64,
    /// How its goal moves.
    pub goal_motion: Option<Motion>,
    /// Its links, if it is an arm.
    pub arm: Option<Arm>,
}

/// A two-link arm in the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arm {
    /// Where it is fixed, m.
    pub base: Point2<f64>,
    /// Lengths of its links, from the base, m.
    pub links: [f64; 2],
    /// Range of the joint at the base, degrees.
    pub joint1_degrees: [f64; 2],
    /// Range of the joint between the links, degrees.
    pub joint2_degrees: [f64; 2],
}

/// An obstacle.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Disc {
    /// Its centre at time 0, m.
    pub center: Point2<f64>,
    /// Its own radius, not grown by a robot's, m.
    pub radius: f64,
    /// How it moves.
    pub motion: Option<Motion>,
}

/// A course.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum Motion {
    /// Straight from `a` to `b` and back at constant speed, again and again.
    Pingpong {
        /// Where it starts, m.
        a: Point2<f64>,
        /// Where it turns, m.
        b: Point2<f64>,
        /// m/s.
        speed: f64,
    },
    /// On a circle.
    Orbit {
        /// Centre of the circle, m.
        center: Point2<f64>,
        /// Radius of the circle, m.
        radius: f64,
        /// rad/s, counter-clockwise.
        omega: f64,
        /// Angle at time 0, rad.
        phase: f64,
    },
}

/// Declares [`Expect`]: the keys that say what is run, and those that say what comes of it.
macro_rules! expect {
    ($( $(#[doc = $help:literal])+ $key:ident: $type:ty, )*) => {
        /// What a rule set is expected to do; of the results, the keys that the file has.
        #[derive(Clone, Debug, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct Expect {
            /// Which rule set is run.
            pub method: String,
            /// Parameters that differ from the parameter set.
            #[serde(rename = "override", default)]
            pub overrides: toml::Table,
            /// Age of the neighbours' poses, ticks.
            #[serde(default)]
            pub neighbour_pose_delay_ticks: usize,
            /// The force variant of the raw path.
            pub base: Option<String>,
            /// How many seeds are run.
            pub seeds: Option<u32>,
            /// The run gives up after so many virtual obstacles.
            pub virtual_obstacle_budget: Option<usize>,
            $( $(#[doc = $help])+ pub $key: Option<$type>, )*
        }

        impl Expect {
            /// The results that are given, by key: what a paper must have a row for.
            pub fn results(&self) -> Vec<&'static str> {
                let mut keys = Vec::new();
                $( if self.$key.is_some() { keys.push(stringify!($key)); } )*
                keys
            }
        }
    };
}

expect! {
    /// Whether (all) goals are reached.
    arrives: bool,
    /// When the goal is reached, s.
    time: f64,
    /// When each robot reaches its goal, s; -1 for never.
    arrival_times: Vec<f64>,
    /// Length driven, m.
    path_length: f64,
    /// Smallest distance to an inflated surface, m; negative for overlap.
    min_clearance: f64,
    /// Smallest distance between the surfaces of two robots, m.
    min_robot_clearance: f64,
    /// Smallest distance between the surfaces of a robot and an obstacle, m.
    min_obstacle_clearance: f64,
    /// Where it ends: one point a robot, m.
    end: Points,
    /// Distance to the goal at the end, m.
    distance_to_goal: f64,
    /// Size of the box visited in the last 10 s, m.
    tail_extent: f64,
    /// How many virtual obstacles are put up.
    virtual_obstacles: usize,
    /// Where they stand, in order, m.
    virtual_obstacle_positions: Vec<Point2<f64>>,
    /// Rounds of computation.
    computation_rounds: usize,
    /// Steps of the motion.
    motion_steps: usize,
    /// Of the seeds, how many arrive.
    arrivals: u32,
    /// Of the seeds, how many overlap an obstacle.
    collisions: u32,
    /// Smallest `min_clearance` of the seeds, m.
    min_clearance_worst: f64,
    /// Smallest `time` of the seeds that arrive, s.
    time_min: f64,
    /// Mean `time` of the seeds that arrive, s.
    time_mean: f64,
    /// Greatest `time` of the seeds that arrive, s.
    time_max: f64,
    /// Length of the final path, m.
    length: f64,
    /// Smallest `length` of the seeds, m.
    length_min: f64,
    /// Mean `length` of the seeds, m.
    length_mean: f64,
    /// Greatest `length` of the seeds, m.
    length_max: f64,
    /// What the worst seed takes off the raw path, %.
    reduction_percent_worst: f64,
    /// Distance from start to goal, m.
    straight_line: f64,
    /// Free tip positions on a 0.1 m grid, elbow up.
    elbow_up_points: usize,
    /// The same, elbow down.
    elbow_down_points: usize,
    /// The same, free both ways.
    both_points: usize,
    /// The same, free one way or the other.
    union_points: usize,
    /// Shortest 8-connected grid path, elbow up, m.
    up: f64,
    /// The same, elbow down, m.
    down: f64,
    /// The same within the union of both, m.
    union: f64,
    /// Whether the whole path is free, elbow up.
    free_elbow_up: bool,
    /// Whether the whole path is free, elbow down.
    free_elbow_down: bool,
    /// Share of the path that is free, elbow up.
    fraction_free_up: f64,
    /// Share of the path that is free, elbow down.
    fraction_free_down: f64,
    /// Of the seeds, how many final paths pass the fine collision check.
    fine_check_ok: u32,
}

/// One point a robot; a file with one robot may leave out the outer brackets.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(from = "OneOrMany")]
pub struct Points(pub Vec<Point2<f64>>);

impl Environment {
    /// Reads a file.
    pub fn parse(text: &str) -> Result<Environment, toml::de::Error> {
        toml::from_str(text)
    }

    /// The parameter set of that name. Panics if the file has none.
    pub fn params(&self, set: &str) -> &toml::Table {
        self.params.get(set).unwrap_or_else(|| panic!("{} has no parameter set `{set}`", self.name))
    }
}

/// A number of a parameter set; a whole number counts too. Panics if it is missing: the files are compiled in.
pub fn number(table: &toml::Table, key: &str) -> f64 {
    match table.get(key) {
        Some(toml::Value::Float(x)) => *x,
        Some(toml::Value::Integer(n)) => *n as f64,
        other => panic!("`{key}` is not a number: {other:?}"),
    }
}

/// Takes a number out of a parameter set, so that the rest can be handed on.
pub fn take(table: &mut toml::Table, key: &str) -> f64 {
    let value = number(table, key);
    table.remove(key);
    value
}

/// A table as the values of a method's parameters. Panics at a value of a type that no parameter has.
pub fn values(table: &toml::Table) -> ParamValues {
    let value = |value: &toml::Value| match value {
        toml::Value::Float(x) => ParamValue::Float(*x),
        toml::Value::Integer(n) => ParamValue::Int(*n),
        toml::Value::Boolean(b) => ParamValue::Bool(*b),
        toml::Value::String(word) => ParamValue::Choice(word.clone()),
        other => panic!("no parameter has the type of {other:?}"),
    };
    table.iter().map(|(name, v)| (name.clone(), value(v))).collect()
}

impl Disc {
    /// Where its centre is at time `t` (s).
    pub fn center_at(&self, t: f64) -> Point2<f64> {
        self.motion.map_or(self.center, |motion| motion.at(t))
    }
}

impl Robot {
    /// Where its goal is at time `t` (s).
    pub fn goal_at(&self, t: f64) -> Point2<f64> {
        self.goal_motion.map_or(self.goal, |motion| motion.at(t))
    }
}

impl Motion {
    /// The position at time `t` (s).
    pub fn at(&self, t: f64) -> Point2<f64> {
        match *self {
            Motion::Pingpong { a, b, speed } => {
                let length = (b - a).norm();
                let along = (speed * t).rem_euclid(2.0 * length);
                a + (b - a) * (along.min(2.0 * length - along) / length)
            }
            Motion::Orbit { center, radius, omega, phase } => {
                let (sin, cos) = (omega * t + phase).sin_cos();
                center + radius * Vector2::new(cos, sin)
            }
        }
    }
}

/// A robot as the file has it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RobotKeys {
    start: Point2<f64>,
    goal: Point2<f64>,
    radius: Option<f64>,
    arrival_tolerance: f64,
    goal_motion: Option<Motion>,
    kind: Option<RobotKind>,
    base: Option<Point2<f64>>,
    links: Option<[f64; 2]>,
    joint1_degrees: Option<[f64; 2]>,
    joint2_degrees: Option<[f64; 2]>,
}

#[derive(Deserialize)]
enum RobotKind {
    #[serde(rename = "two-link-arm")]
    TwoLinkArm,
}

impl TryFrom<RobotKeys> for Robot {
    type Error = &'static str;

    fn try_from(keys: RobotKeys) -> Result<Robot, &'static str> {
        let RobotKeys { start, goal, radius, arrival_tolerance, goal_motion, .. } = keys;
        let parts = (keys.kind, radius, keys.base, keys.links, keys.joint1_degrees, keys.joint2_degrees);
        let (radius, arm) = match parts {
            (None, Some(radius), None, None, None, None) => (radius, None),
            (
                Some(RobotKind::TwoLinkArm),
                None,
                Some(base),
                Some(links),
                Some(joint1_degrees),
                Some(joint2_degrees),
            ) => (0.0, Some(Arm { base, links, joint1_degrees, joint2_degrees })),
            _ => return Err("a robot has a radius, an arm has kind, base, links and the ranges of its joints"),
        };
        Ok(Robot { start, goal, radius, arrival_tolerance, goal_motion, arm })
    }
}

#[derive(Deserialize)]
#[serde(untagged)]
enum OneOrMany {
    One(Point2<f64>),
    Many(Vec<Point2<f64>>),
}

impl From<OneOrMany> for Points {
    fn from(points: OneOrMany) -> Points {
        match points {
            OneOrMany::One(point) => Points(vec![point]),
            OneOrMany::Many(points) => Points(points),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_is_read() {
        assert_eq!(environments().len(), 34);
        let expectations: usize = environments().iter().map(|environment| environment.expect.len()).sum();
        assert_eq!(expectations, 143);
        let results: usize = environments().iter().flat_map(|e| &e.expect).map(|expect| expect.results().len()).sum();
        assert_eq!(results, RESULTS);
        assert_eq!(environments_of("rpoa_").count(), 9);
    }

    /// Counted in the files: keys of all `[[expect]]` that are not conditions of the run.
    const RESULTS: usize = 568;

    #[test]
    fn what_moves_starts_where_it_is_said_to_be() {
        for environment in environments() {
            for disc in &environment.obstacles {
                assert!((disc.center_at(0.0) - disc.center).norm() < 1e-6, "{}: {disc:?}", environment.name);
            }
            for robot in &environment.robots {
                assert!((robot.goal_at(0.0) - robot.goal).norm() < 1e-6, "{}: {robot:?}", environment.name);
            }
        }
        let there_and_back = Motion::Pingpong { a: [0.0, 0.0].into(), b: [2.0, 0.0].into(), speed: 1.0 };
        for (t, x) in [(0.5, 0.5), (2.0, 2.0), (3.5, 0.5), (4.0, 0.0), (4.5, 0.5)] {
            assert_eq!(there_and_back.at(t), Point2::new(x, 0.0));
        }
    }

    #[test]
    fn unknown_keys_are_errors() {
        let text = FILES[0].1;
        assert!(Environment::parse(text).is_ok());
        for (old, new) in [
            ("arrives = true", "arives = true"),
            ("radius = 0.2", "radius = 0.2\nmass = 1.0"),
            ("radius = 0.2", ""),
            ("papers-env/1", "papers-env/2"),
        ] {
            assert!(text.contains(old));
            assert!(Environment::parse(&text.replacen(old, new, 1)).is_err(), "{new}");
        }
    }
}
