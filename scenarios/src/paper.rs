//! What a paper, or the specification made from it, says about a scenario: the table `[paper]`. A run of the scenario
//! does not depend on it; `shoal reproduce` runs the scenario in the paper's own order of updates and compares.

use crate::keys::Type::{Bool, Float, Floats, Int, Pairs, Params, Tables, Text};
use crate::keys::{ANY, Key, Section, Type, optional, preset, required};
use crate::methods;
use crate::node::{Node, Value};
use crate::problems::Report;
use model::{BodyKind, MAX_ROBOTS, MAX_SHAPES, ParamValues, Radio, Robot};
use nalgebra::Point2;
use planners::METHODS;

/// Most expectations of a scenario.
const MAX_EXPECTATIONS: usize = 64;
/// Most virtual obstacles whose positions are listed.
const MAX_POINTS: usize = 256;

pub(crate) static PAPER: Section = Section {
    title: "[paper]",
    help: "What a paper says about this scenario. Only `shoal reproduce` reads it, and runs the scenario in the paper's \
           own order of updates.",
    tag: None,
    groups: &[&[
        optional(
            "inflation_m",
            Float(ANY),
            "The paper's robots are points: in its runs they have no radius, and obstacles have one larger by this.",
        ),
        preset(
            "added_discs_m",
            Pairs { min: 0, max: MAX_SHAPES },
            "[]",
            "Centres of discs that the paper's planners see besides the obstacles.",
        ),
        optional("expect", Tables(&EXPECT, MAX_EXPECTATIONS), "Results, by rule set."),
    ]],
};

static EXPECT: Section = Section {
    title: "[[paper.expect]]",
    help: "What comes of one rule set. Conditions first, then results; each result is a row of `shoal reproduce`.",
    tag: None,
    groups: &[CONDITIONS, RESULTS],
};

const CONDITIONS: &[Key] = &[
    required("method", Text(64), "Name of the rule set."),
    optional("params", Params, "Parameters that differ from those of the rule set."),
    preset("delay_ticks", Int { min: 0, max: Radio::DELAY_TICKS_MAX as i128 }, "0", "Age of the neighbours' poses."),
    optional("base", Text(64), "Name of the rule set whose path is the beginning."),
    optional("seeds", Int { min: 1, max: 10_000 }, "Number of seeds that are run."),
    optional("virtual_obstacles_max", COUNT, "The run gives up after this number of virtual obstacles."),
];

const COUNT: Type = Int { min: 0, max: 1_000_000 };

/// What may be expected. The order is that of the rows.
const RESULTS: &[Key] = &[
    optional("arrives", Bool, "Whether all robots arrive."),
    optional("time_s", Float(ANY), "Time of arrival."),
    optional("arrival_times_s", Floats(MAX_ROBOTS), "Time of arrival of each robot; -1 for never."),
    optional("path_length_m", Float(ANY), "Length driven."),
    optional("min_clearance_m", Float(ANY), "Smallest distance to an obstacle; negative in overlap."),
    optional("min_robot_clearance_m", Float(ANY), "Smallest distance between two robots, surface to surface."),
    optional(
        "min_obstacle_clearance_m",
        Float(ANY),
        "Smallest distance of a robot from an obstacle, surface to surface.",
    ),
    optional("end_m", Pairs { min: 1, max: MAX_ROBOTS }, "Where each robot is at the end."),
    optional("distance_to_goal_m", Float(ANY), "Distance from the goal at the end."),
    optional("tail_extent_m", Float(ANY), "Size of the box visited in the last 10 s."),
    optional("virtual_obstacles", COUNT, "Number of virtual obstacles put up."),
    optional("virtual_obstacle_positions_m", Pairs { min: 0, max: MAX_POINTS }, "Where they stand, in order."),
    optional("computation_rounds", COUNT, "Number of rounds of computation."),
    optional("motion_steps", COUNT, "Number of steps of the motion."),
    optional("arrivals", COUNT, "Number of seeds that arrive."),
    optional("collisions", COUNT, "Number of seeds that overlap an obstacle."),
    optional("min_clearance_worst_m", Float(ANY), "Smallest `min_clearance_m` of the seeds."),
    optional("time_min_s", Float(ANY), "Smallest `time_s` of the seeds that arrive."),
    optional("time_mean_s", Float(ANY), "Mean `time_s` of the seeds that arrive."),
    optional("time_max_s", Float(ANY), "Greatest `time_s` of the seeds that arrive."),
    optional("length_m", Float(ANY), "Length of the final path."),
    optional("length_min_m", Float(ANY), "Smallest `length_m` of the seeds."),
    optional("length_mean_m", Float(ANY), "Mean `length_m` of the seeds."),
    optional("length_max_m", Float(ANY), "Greatest `length_m` of the seeds."),
    optional("reduction_percent_worst", Float(ANY), "What the worst seed takes off the raw path, per cent."),
    optional("straight_line_m", Float(ANY), "Distance from start to goal."),
    optional("elbow_up_points", COUNT, "Number of free positions of an arm's tip on a grid of 0.1 m, elbow up."),
    optional("elbow_down_points", COUNT, "The same, elbow down."),
    optional("both_points", COUNT, "The same, free both ways."),
    optional("union_points", COUNT, "The same, free one way or the other."),
    optional("up_m", Float(ANY), "Shortest 8-connected path on that grid, elbow up."),
    optional("down_m", Float(ANY), "The same, elbow down."),
    optional("union_m", Float(ANY), "The same, elbow up or down at every point."),
    optional("free_elbow_up", Bool, "Whether the whole path is free, elbow up."),
    optional("free_elbow_down", Bool, "Whether the whole path is free, elbow down."),
    optional("fraction_free_up", Float(ANY), "Share of the path that is free, elbow up."),
    optional("fraction_free_down", Float(ANY), "Share of the path that is free, elbow down."),
    optional("fine_check_ok", COUNT, "Number of seeds whose final path passes the fine check for collisions."),
];

/// The table `[paper]` of a scenario.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Paper {
    /// The paper's robots are points, among obstacles whose radii are larger by this, m.
    pub inflation_m: Option<f64>,
    /// Centres of discs that the paper's planners see besides the obstacles, m.
    pub added_discs: Vec<Point2<f64>>,
    /// Results, in the order of the file.
    pub expectations: Vec<Expectation>,
}

/// What comes of one rule set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Expectation {
    /// Name of the rule set.
    pub method: String,
    /// Parameters that differ from those of the rule set.
    pub params: ParamValues,
    /// Age of the neighbours' poses, ticks.
    pub delay_ticks: u32,
    /// Name of the rule set whose path is the beginning.
    pub base: Option<String>,
    /// Number of seeds that are run.
    pub seeds: Option<u32>,
    /// The run gives up after this number of virtual obstacles.
    pub virtual_obstacles_max: Option<u32>,
    results: Vec<(&'static str, Result)>,
}

#[derive(Clone, Debug, PartialEq)]
enum Result {
    Flag(bool),
    Count(u32),
    Number(f64),
    Numbers(Vec<f64>),
    Points(Vec<Point2<f64>>),
}

impl Expectation {
    /// Keys of the results that the file gives, in the order of `shoal schema`.
    pub fn results(&self) -> impl Iterator<Item = &'static str> {
        self.results.iter().map(|(key, _)| *key)
    }

    /// A result that is true or false.
    pub fn flag(&self, key: &str) -> Option<bool> {
        self.find(key, |result| if let Result::Flag(flag) = result { Some(*flag) } else { None })
    }

    /// A result that is a count.
    pub fn count(&self, key: &str) -> Option<u32> {
        self.find(key, |result| if let Result::Count(count) = result { Some(*count) } else { None })
    }

    /// A result that is a number, in the unit of its key; counts too.
    pub fn number(&self, key: &str) -> Option<f64> {
        self.find(key, |result| match result {
            Result::Number(number) => Some(*number),
            Result::Count(count) => Some(f64::from(*count)),
            _ => None,
        })
    }

    /// A result that is a list of numbers, in the unit of its key; empty if the file does not give it.
    pub fn numbers(&self, key: &str) -> &[f64] {
        self.find(key, |result| if let Result::Numbers(list) = result { Some(list.as_slice()) } else { None })
            .unwrap_or_default()
    }

    /// A result that is a list of points, m.
    pub fn points(&self, key: &str) -> Option<&[Point2<f64>]> {
        self.find(key, |result| if let Result::Points(list) = result { Some(list.as_slice()) } else { None })
    }

    fn find<'a, T>(&'a self, key: &str, read: impl Fn(&'a Result) -> Option<T>) -> Option<T> {
        debug_assert!(RESULTS.iter().any(|known| known.name == key), "`{key}` is not a result");
        self.results.iter().find(|(known, _)| *known == key).and_then(|(_, result)| read(result))
    }
}

/// Reads the table; what is wrong is reported.
pub(crate) fn read(root: &Node, robots: &[Robot], all_known: bool, report: &mut Report) -> Paper {
    let Some(node) = root.node("paper") else { return Paper::default() };
    let inflation_m = node.float("inflation_m");
    if inflation_m.is_some() && robots.iter().any(|robot| robot.kind == BodyKind::TwoLinkArm) {
        report.add(node.at("inflation_m"), &node.key("inflation_m"), "an arm has links: it is not a point");
    }
    let expectations = node.nodes("expect").iter().map(|node| expectation(node, report)).collect();
    let paper = Paper { inflation_m, added_discs: node.points("added_discs_m"), expectations };
    for (node, expectation) in node.nodes("expect").iter().zip(&paper.expectations).filter(|_| all_known) {
        let ends = expectation.points("end_m").map(<[_]>::len);
        let times = Some(expectation.numbers("arrival_times_s").len()).filter(|count| *count > 0);
        for (key, count) in [("end_m", ends), ("arrival_times_s", times)] {
            if let Some(count) = count.filter(|count| *count != robots.len()) {
                let message = format!("has {count} entries, the scenario has {} robots", robots.len());
                report.add(node.at(key), &node.key(key), message);
            }
        }
    }
    paper
}

fn expectation(node: &Node, report: &mut Report) -> Expectation {
    let count = |key: &str| node.int(key).map(|count| count as u32);
    let result = |key: &'static Key| {
        let result = match node.value(key.name)? {
            Value::Bool(flag) => Result::Flag(*flag),
            Value::Int(count) => Result::Count(*count as u32),
            Value::Float(number) => Result::Number(*number),
            Value::Floats(numbers) => Result::Numbers(numbers.clone()),
            Value::Pairs(_) => Result::Points(node.points(key.name)),
            _ => return None, // wrong, and reported
        };
        Some((key.name, result))
    };
    Expectation {
        method: node.text("method").unwrap_or_default().to_string(),
        params: params(node, report),
        delay_ticks: count("delay_ticks").unwrap_or_default(),
        base: node.text("base").map(str::to_string),
        seeds: count("seeds"),
        virtual_obstacles_max: count("virtual_obstacles_max"),
        results: RESULTS.iter().filter_map(result).collect(),
    }
}

/// The parameters of an expectation. Rule sets are the papers', so they may be those of any planner.
fn params(node: &Node, report: &mut Report) -> ParamValues {
    let Some(Value::Params(block)) = node.value("params") else { return ParamValues::new() };
    let values = methods::values(block);
    if values.len() < block.fields.len() || !METHODS.iter().any(|method| method.check(&values).is_empty()) {
        let hint = "`shoal planners NAME` lists those of a planner";
        report.add_hint(node.at("params"), &block.path, "no planner has these parameters, with these values", hint);
    }
    values
}
