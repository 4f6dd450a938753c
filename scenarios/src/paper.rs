//! What a paper, or the specification made from it, says about a scenario: the table `[paper]`. A run of the scenario
//! does not depend on it; `shoal reproduce` runs the scenario in the paper's own order of updates and compares.

use crate::methods;
use crate::node::Node;
use crate::problems::Report;
use model::field::{Field, Params, Tables};
use model::key::{KeyName, Named, OptionalKey};
use model::kind::{Range, Section};
use model::value::Value;
use model::{BodyKind, MAX_ROBOTS, MAX_SHAPES, ParamValues, Radio, Robot, keys};
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
    groups: &[PaperKeys::KEYS],
};

keys! {
    /// Keys of `[paper]`.
    pub(crate) keys PaperKeys {
        /// The paper's robots are points: in its runs they have no radius, and obstacles have one larger by this.
        inflation_m: f64 => optional, "m", Range::ANY;
        /// Centres of discs that the paper's planners see besides the obstacles.
        added_discs_m: Vec<Point2<f64>> = Vec::new(), "m", 0..=MAX_SHAPES;
        /// Results, by rule set.
        expect: Tables => optional, "", (&EXPECT, MAX_EXPECTATIONS);
    }
}

static EXPECT: Section = Section {
    title: "[[paper.expect]]",
    help: "What comes of one rule set. Conditions first, then results; each result is a row of `shoal reproduce`.",
    tag: None,
    groups: &[Conditions::KEYS, Results::KEYS],
};

keys! {
    /// Under which conditions a rule set is run.
    pub(crate) keys Conditions {
        /// Name of the rule set.
        method: String => required, "", 0..=64;
        /// Parameters that differ from those of the rule set.
        params: Params => optional, "";
        /// Age of the neighbours' poses.
        delay_ticks: u32 = 0, "ticks", 0..=Radio::DELAY_TICKS_MAX;
        /// Name of the rule set whose path is the beginning.
        base: String => optional, "", 0..=64;
        /// Number of seeds that are run.
        seeds: u32 => optional, "", 1..=10_000;
        /// The run gives up after this number of virtual obstacles.
        virtual_obstacles_max: u32 => optional, "", 0..=COUNT_MAX;
    }
}

/// Largest count.
const COUNT_MAX: u32 = 1_000_000;

keys! {
    /// What may be expected. The order is that of the rows.
    pub keys Results {
        /// Whether all robots arrive.
        arrives: bool => optional, "";
        /// Time of arrival.
        time_s: f64 => optional, "s", Range::ANY;
        /// Time of arrival of each robot; -1 for never.
        arrival_times_s: Vec<f64> => optional, "s", 0..=MAX_ROBOTS;
        /// Length driven.
        path_length_m: f64 => optional, "m", Range::ANY;
        /// Smallest distance to an obstacle; negative in overlap.
        min_clearance_m: f64 => optional, "m", Range::ANY;
        /// Smallest distance between two robots, surface to surface.
        min_robot_clearance_m: f64 => optional, "m", Range::ANY;
        /// Smallest distance of a robot from an obstacle, surface to surface.
        min_obstacle_clearance_m: f64 => optional, "m", Range::ANY;
        /// Where each robot is at the end.
        end_m: Vec<Point2<f64>> => optional, "m", 1..=MAX_ROBOTS;
        /// Distance from the goal at the end.
        distance_to_goal_m: f64 => optional, "m", Range::ANY;
        /// Size of the box visited in the last 10 s.
        tail_extent_m: f64 => optional, "m", Range::ANY;
        /// Number of virtual obstacles put up.
        virtual_obstacles: u32 => optional, "", 0..=COUNT_MAX;
        /// Where they stand, in order.
        virtual_obstacle_positions_m: Vec<Point2<f64>> => optional, "m", 0..=MAX_POINTS;
        /// Number of rounds of computation.
        computation_rounds: u32 => optional, "", 0..=COUNT_MAX;
        /// Number of steps of the motion.
        motion_steps: u32 => optional, "", 0..=COUNT_MAX;
        /// Number of seeds that arrive.
        arrivals: u32 => optional, "", 0..=COUNT_MAX;
        /// Number of seeds that overlap an obstacle.
        collisions: u32 => optional, "", 0..=COUNT_MAX;
        /// Smallest `min_clearance_m` of the seeds.
        min_clearance_worst_m: f64 => optional, "m", Range::ANY;
        /// Smallest `time_s` of the seeds that arrive.
        time_min_s: f64 => optional, "s", Range::ANY;
        /// Mean `time_s` of the seeds that arrive.
        time_mean_s: f64 => optional, "s", Range::ANY;
        /// Greatest `time_s` of the seeds that arrive.
        time_max_s: f64 => optional, "s", Range::ANY;
        /// Length of the final path.
        length_m: f64 => optional, "m", Range::ANY;
        /// Smallest `length_m` of the seeds.
        length_min_m: f64 => optional, "m", Range::ANY;
        /// Mean `length_m` of the seeds.
        length_mean_m: f64 => optional, "m", Range::ANY;
        /// Greatest `length_m` of the seeds.
        length_max_m: f64 => optional, "m", Range::ANY;
        /// What the worst seed takes off the raw path, per cent.
        reduction_percent_worst: f64 => optional, "", Range::ANY;
        /// Distance from start to goal.
        straight_line_m: f64 => optional, "m", Range::ANY;
        /// Number of free positions of an arm's tip on a grid of 0.1 m, elbow up.
        elbow_up_points: u32 => optional, "", 0..=COUNT_MAX;
        /// The same, elbow down.
        elbow_down_points: u32 => optional, "", 0..=COUNT_MAX;
        /// The same, free both ways.
        both_points: u32 => optional, "", 0..=COUNT_MAX;
        /// The same, free one way or the other.
        union_points: u32 => optional, "", 0..=COUNT_MAX;
        /// Shortest 8-connected path on that grid, elbow up.
        up_m: f64 => optional, "m", Range::ANY;
        /// The same, elbow down.
        down_m: f64 => optional, "m", Range::ANY;
        /// The same, elbow up or down at every point.
        union_m: f64 => optional, "m", Range::ANY;
        /// Whether the whole path is free, elbow up.
        free_elbow_up: bool => optional, "";
        /// Whether the whole path is free, elbow down.
        free_elbow_down: bool => optional, "";
        /// Share of the path that is free, elbow up.
        fraction_free_up: f64 => optional, "", Range::ANY;
        /// Share of the path that is free, elbow down.
        fraction_free_down: f64 => optional, "", Range::ANY;
        /// Number of seeds whose final path passes the fine check for collisions.
        fine_check_ok: u32 => optional, "", 0..=COUNT_MAX;
    }
}

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
    results: Vec<(KeyName, Value)>,
}

impl Expectation {
    /// Keys of the results that the file gives, in the order of `shoal schema`.
    pub fn results(&self) -> impl Iterator<Item = KeyName> {
        self.results.iter().map(|(key, _)| *key)
    }

    /// A result, in the unit of its key.
    pub fn get<T: Field>(&self, key: OptionalKey<T>) -> Option<T> {
        self.plain(key).and_then(T::from_value)
    }

    /// A result that is a number, in the unit of its key; counts too.
    pub fn number(&self, key: impl Named) -> Option<f64> {
        self.plain(key).and_then(f64::from_value)
    }

    fn plain(&self, key: impl Named) -> Option<&Value> {
        self.results.iter().find(|(known, _)| known.is(key)).map(|(_, value)| value)
    }
}

/// Reads the table; what is wrong is reported.
pub(crate) fn read(node: Option<&Node>, robots: &[Robot], all_known: bool, report: &mut Report) -> Paper {
    let Some(node) = node else { return Paper::default() };
    let inflation_m = node.get(PaperKeys::inflation_m);
    if inflation_m.is_some() && robots.iter().any(|robot| robot.kind == BodyKind::TwoLinkArm) {
        let key = PaperKeys::inflation_m;
        report.add(node.at(key), &node.key(key), "an arm has links: it is not a point");
    }
    let nodes = node.nodes(PaperKeys::expect);
    let expectations = nodes.iter().map(|node| expectation(node, report)).collect();
    for node in nodes.iter().filter(|_| all_known) {
        let ends = node.get(Results::end_m).map(|ends| ends.len());
        let times = node.get(Results::arrival_times_s).map(|times| times.len()).filter(|count| *count > 0);
        for (key, count) in [(Results::end_m.any(), ends), (Results::arrival_times_s.any(), times)] {
            if let Some(count) = count.filter(|count| *count != robots.len()) {
                let message = format!("has {count} entries, the scenario has {} robots", robots.len());
                report.add(node.at(key), &node.key(key), message);
            }
        }
    }
    Paper { inflation_m, added_discs: node.get(PaperKeys::added_discs_m), expectations }
}

fn expectation(node: &Node, report: &mut Report) -> Expectation {
    let results = Results::KEYS.iter().filter_map(|key| Some((key.any(), node.plain(key)?.clone()))).collect();
    Expectation {
        method: node.get(Conditions::method).unwrap_or_default(),
        params: params(node, report),
        delay_ticks: node.get(Conditions::delay_ticks),
        base: node.get(Conditions::base),
        seeds: node.get(Conditions::seeds),
        virtual_obstacles_max: node.get(Conditions::virtual_obstacles_max),
        results,
    }
}

/// The parameters of an expectation. Rule sets are the papers', so they may be those of any planner.
fn params(node: &Node, report: &mut Report) -> ParamValues {
    let key = Conditions::params;
    let Some(block) = node.params(key) else { return ParamValues::new() };
    let values = methods::values(block);
    if values.len() < block.fields.len() || !METHODS.iter().any(|method| method.check(&values).is_empty()) {
        let hint = "`shoal planners NAME` lists those of a planner";
        report.add_hint(node.at(key), &block.path, "no planner has these parameters, with these values", hint);
    }
    values
}
