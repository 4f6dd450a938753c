//! From a checked file to a scenario: defaults filled in, layouts placed, times turned into ticks.

use crate::arm;
use crate::check::{self, Source};
use crate::ground::{Ground, Surfaces};
use crate::keys::{FAR_M, Type};
use crate::layout::{self, Surroundings};
use crate::node::{Node, Value};
use crate::obstacles;
use crate::paper::{self, Paper};
use crate::problems::{Origin, Report};
use crate::processes;
use crate::robots::{self, Layers, Place};
use crate::table::ROOT;
use crate::timeline::{self, Stage};
use crate::{walk, warnings};
use geometry::Capsule;
use model::BodyKind;
use model::*;
use nalgebra::Point2;
use std::collections::{HashMap, HashSet};

/// A fleet without `max_robots` has room for this many robots more than the file has.
const ROBOTS_SPARE: usize = 8;
/// Stands for a point that could not be read; checks pass over it.
const NOWHERE: Point2<f64> = Point2::new(f64::NAN, f64::NAN);

/// Resolves a walked file. The result counts only if nothing is in the report afterwards.
pub(crate) fn resolve(root: &Node, name: &str, planner: Option<&str>, report: &mut Report) -> (Scenario, Paper) {
    let bounds = bounds(&section(root, "world"));
    let clock_node = section(root, "clock");
    let clock = clock(&clock_node, report);
    let radio = timeline::radio(&section(root, "radio"), Radio::PERFECT);
    let obstacles = obstacles::read(root, bounds, report);
    let surfaces = Surfaces::new(&obstacles);
    let layers = Layers::read(root, planner, clock.tick_hz, report);
    let template = layers.robot(None, Place::at(String::new(), Point2::origin(), Vec::new()), report);

    let ground = Ground { world: bounds, surfaces: &surfaces };
    let crew = Crew::muster(root, &layers, &template, &ground, clock.seed, report);
    for (robot, source) in crew.robots.iter().zip(&crew.sources) {
        ground.check(robot, source, report);
    }
    check::starts_apart(&crew.robots, &crew.sources, report);
    let stage = Stage {
        robots: &crew.robots,
        all_known: crew.complete,
        radio,
        clock,
        cut_short: clock_node.has("duration_s") && matches!(clock_node.at("duration_s"), Origin::Option(_)),
        ground,
    };
    let events = stage.events(root, report);
    warnings::check(&crew.robots, &crew.sources, &events, clock, report);
    let paper = paper::read(root, &crew.robots, crew.complete, report);
    let scenario = Scenario {
        name: root.text("name").unwrap_or(name).to_string(),
        description: root.text("description").unwrap_or_default().to_string(),
        bounds,
        fleet: fleet(&section(root, "fleet"), &clock, &crew, report),
        processes: processes::read(root, report),
        clock,
        radio,
        obstacles,
        expect: expect(&section(root, "expect"), &crew, report),
        robots: crew.robots,
        template,
        events,
        warnings: Vec::new(),
    };
    (scenario, paper)
}

/// A section of the file; if it has none, an empty one.
fn section(root: &Node, name: &str) -> Node {
    match (root.node(name), ROOT.key(name, None).map(|key| key.ty)) {
        (Some(node), _) => node.clone(),
        (None, Some(Type::Table(section))) => Node::absent(section, name),
        (None, _) => Node::absent(&ROOT, ""),
    }
}

fn bounds(node: &Node) -> Bounds {
    // An edge that could not be read is no edge: the robots are not to blame.
    let side = |key: &str| match node.value(key) {
        Some(Value::Wrong) => [-FAR_M, FAR_M],
        _ => node.pair(key).unwrap_or_default(),
    };
    Bounds { x_m: side("x_m"), y_m: side("y_m") }
}

fn clock(node: &Node, report: &mut Report) -> Clock {
    let tick_hz = node.float("tick_hz").unwrap_or(1.0);
    let duration_s = node.float("duration_s").unwrap_or_default();
    let ticks_max = (duration_s * tick_hz).round() as u64;
    if ticks_max == 0 {
        let message = format!("{duration_s} s is shorter than half a tick");
        report.add_hint(
            node.at("duration_s"),
            &node.key("duration_s"),
            message,
            format!("a tick lasts {} s", 1.0 / tick_hz),
        );
    }
    let mode = match node.text("mode") {
        Some("realtime") => Mode::Realtime,
        Some("single") => Mode::Single,
        _ => Mode::Lockstep,
    };
    let stop = if node.text("stop") == Some("duration") { Stop::Duration } else { Stop::Arrived };
    Clock { mode, tick_hz, seed: node.int("seed").unwrap_or_default() as u64, ticks_max, stop }
}

/// Least `fleet.command_timeout_s` in ticks. A command that is on time can be as old as two ticks when the world takes it: up
/// to one until its agent reads the odometry, up to one until the world reads the command. The third is for late wake-ups.
const COMMAND_TIMEOUT_TICKS_MIN: f64 = 3.0;

fn fleet(node: &Node, clock: &Clock, crew: &Crew, report: &mut Report) -> Fleet {
    let count = crew.robots.len();
    let max_robots = match node.int("max_robots") {
        Some(max) => max as usize,
        None => (count + ROBOTS_SPARE).min(MAX_ROBOTS),
    };
    if (max_robots + 1..=MAX_ROBOTS).contains(&count) {
        let message = format!("the fleet has room for {max_robots}, the scenario has {count} robots");
        let hint = format!("make it {count} or more, or leave it out");
        report.add_hint(node.at("max_robots"), &node.key("max_robots"), message, hint);
    }
    let command_timeout_s = match node.float("command_timeout_s") {
        Some(timeout_s) => {
            let least_s = COMMAND_TIMEOUT_TICKS_MIN / clock.tick_hz;
            if timeout_s < least_s {
                let message = format!("must be at least three ticks, {least_s} s, is {timeout_s}");
                let hint =
                    format!("make it {least_s} or more, or leave it out: a command on time can be two ticks old");
                report.add_hint(node.at("command_timeout_s"), &node.key("command_timeout_s"), message, hint);
            }
            timeout_s
        }
        None => f64::max(0.25, 5.0 * clock.dt_s()),
    };
    let straggler = match node.text("straggler") {
        Some("hold") => StragglerPolicy::Hold,
        Some("drop") => StragglerPolicy::Drop,
        _ => StragglerPolicy::Wait,
    };
    Fleet {
        max_robots,
        straggler,
        straggler_limit_s: node.float("straggler_limit_s").unwrap_or_default(),
        command_timeout_s,
        start_limit_s: node.float("start_limit_s").unwrap_or_default(),
    }
}

fn expect(node: &Node, crew: &Crew, report: &mut Report) -> Expect {
    let arrived_min = match node.value("arrived") {
        Some(Value::Int(count)) => Some(*count as usize),
        _ => None,
    };
    let count = crew.robots.len();
    if let Some(arrived) = arrived_min.filter(|arrived| *arrived > count && crew.complete) {
        let message = format!("{arrived} robots cannot arrive, the scenario has {count}");
        report.add_hint(node.at("arrived"), &node.key("arrived"), message, "arrived = \"all\" fits any number");
    }
    Expect {
        arrived_min,
        contacts_max: node.int("contacts_max").unwrap_or_default() as u64,
        makespan_s_max: node.float("makespan_s_max"),
        clearance_m_min: node.float("clearance_m_min"),
    }
}

/// All robots of a file: those of the layout, then those that stand alone.
struct Crew {
    robots: Vec<Robot>,
    sources: Vec<Source>,
    /// Every robot that the file means is there, with its id. If not, that has been reported.
    complete: bool,
}

impl Crew {
    fn muster(
        root: &Node,
        layers: &Layers<'_>,
        template: &Robot,
        ground: &Ground<'_>,
        seed: u64,
        report: &mut Report,
    ) -> Crew {
        let late = timeline::late(root);
        let pattern = root.node("layout").map(Pattern::of);
        // Of entries with one id, the first is that of the layout's robot.
        let mut of_layout: HashMap<usize, &Node> = HashMap::new();
        let mut alone: Vec<(Robot, Source)> = Vec::new();
        for node in root.nodes("robot") {
            let index = pattern.as_ref().and_then(|pattern| pattern.index_of(node.text("id")?));
            match index.filter(|index| !of_layout.contains_key(index)) {
                Some(index) => drop(of_layout.insert(index, node)),
                None => alone.push(single(node, None, layers, ground, &late, report)),
            }
        }
        let mut complete = alone.iter().all(|(robot, _)| !robot.id.is_empty())
            && !matches!(root.value("robot"), Some(Value::Wrong))
            && !matches!(root.value("layout"), Some(Value::Wrong));
        let mut members: Vec<(Robot, Source)> = Vec::new();
        if let Some(node) = root.node("layout") {
            if arm::check_layout(node, template.kind, report) {
                layers.check_layout(template, node, report);
            } else {
                complete = false;
            }
            let around = Surroundings {
                world: ground.world,
                seed,
                radius_m: template.radius_m,
                obstacles: ground.surfaces,
                starts: &alone.iter().flat_map(|(robot, _)| arm::body_at_start(robot)).collect::<Vec<_>>(),
                goals: &(alone.iter())
                    .filter(|(robot, _)| robot.kind != BodyKind::TwoLinkArm)
                    .filter_map(|(robot, _)| Some(Capsule::disc(*robot.goals.last()?, robot.radius_m)))
                    .collect::<Vec<_>>(),
            };
            match layout::places(node, &around, report).filter(|_| template.kind != BodyKind::TwoLinkArm) {
                Some(places) => {
                    let at = |(index, place): (usize, [Point2<f64>; 2])| {
                        let id = pattern.as_ref().map(|pattern| pattern.id(index)).unwrap_or_default();
                        match of_layout.get(&index) {
                            Some(own) => single(own, Some(place), layers, ground, &late, report),
                            None => in_layout(node, id, place, layers, &late, report),
                        }
                    };
                    members = places.into_iter().enumerate().map(at).collect();
                }
                None => complete = false,
            }
        }
        members.extend(alone);
        if members.is_empty() && complete {
            let hint = "add a [[robot]] with id, start_m and goal_m, or a [layout]";
            report.add_hint(Origin::Whole, "", "the scenario has no robots", hint);
        }
        if members.len() > MAX_ROBOTS {
            let message = format!("layout and robots together are {}, at most {MAX_ROBOTS} are allowed", members.len());
            report.add(root.at("robot"), "robot", message);
        }
        let (robots, sources): (Vec<Robot>, Vec<Source>) = members.into_iter().unzip();
        let arms = robots.iter().filter(|robot| robot.arm.is_some()).count();
        if ground.surfaces.pieces() + arms > MAX_SHAPES && arms > 0 {
            let message = format!(
                "obstacles and arms together have {} pieces, at most {MAX_SHAPES} are allowed",
                ground.surfaces.pieces() + arms
            );
            report.add_hint(
                root.at("robot"),
                "robot",
                message,
                "every edge of a polygon is a piece, and so is every arm",
            );
        }
        unique(&robots, &sources, report);
        Crew { robots, sources, complete }
    }
}

/// The ids of a layout.
struct Pattern<'a> {
    prefix: &'a str,
    count: usize,
}

impl<'a> Pattern<'a> {
    fn of(node: &'a Node) -> Pattern<'a> {
        let count = node.int("robots").and_then(|count| usize::try_from(count).ok()).unwrap_or(0);
        Pattern { prefix: node.text("id_prefix").unwrap_or_default(), count }
    }

    fn id(&self, index: usize) -> String {
        let digits = (self.count.max(1) - 1).to_string().len().max(2);
        format!("{}{index:0digits$}", self.prefix)
    }

    /// Which robot of the layout has this id.
    fn index_of(&self, id: &str) -> Option<usize> {
        let index = id.strip_prefix(self.prefix)?.parse().ok()?;
        (index < self.count && self.id(index) == id).then_some(index)
    }
}

/// A robot that stands alone, or one of a layout about which something is different.
fn single(
    node: &Node,
    layout: Option<[Point2<f64>; 2]>,
    layers: &Layers<'_>,
    ground: &Ground<'_>,
    late: &HashSet<&str>,
    report: &mut Report,
) -> (Robot, Source) {
    let id = node.text("id").unwrap_or_default();
    if layout.is_none() {
        let unplaced = !node.has("start_m") && !node.has("start_joints_rad");
        for name in [("start_m", unplaced), ("goal_m", !node.has("goal_m"))].iter().filter(|(_, lacks)| *lacks) {
            let hint = node.section.key(name.0, None).map(walk::describe_key).unwrap_or_default();
            report.add_hint(node.origin, &node.path, format!("needs `{}`", name.0), format!("{}: {hint}", name.0));
        }
    }
    let place = |name: &str, of_layout: Option<Point2<f64>>| match of_layout.filter(|_| !node.has(name)) {
        Some(place) => place,
        None => node.point(name).unwrap_or(NOWHERE),
    };
    let mut goal = place("goal_m", layout.map(|[_, goal]| goal));
    let goal_motion = match node.node("goal_motion") {
        Some(motion) if goal != NOWHERE => obstacles::motion(motion, goal, ground.world, report),
        _ => None,
    };
    if let Some(motion) = &goal_motion {
        goal = obstacles::beginning(motion, goal);
    }
    let mut goals = node.points("waypoints_m");
    goals.push(goal);
    let start = place("start_m", layout.map(|[start, _]| start));
    let goal_yaw_rad = node.yaw("goal_m");
    let place = Place { id: id.to_string(), start, goals, goal_yaw_rad, goal_motion };
    let at = |key: &str| (node.key(key), node.at(key));
    let source = Source {
        id: at("id"),
        start: at(if node.has("start_joints_rad") { "start_joints_rad" } else { "start_m" }),
        goal: at("goal_m"),
        waypoints: at("waypoints_m"),
        late: late.contains(id),
    };
    let mut robot = layers.robot(Some(node), place, report);
    robots::check_goal_yaw(&robot, goal_yaw_rad, &node.key("goal_m"), node.at("goal_m"), report);
    robots::check_rounds(&robot, node, report);
    if robot.kind == BodyKind::TwoLinkArm && layout.is_some() {
        let message = "a robot of the layout cannot be an arm";
        report.add_hint(node.at("kind"), &node.key("kind"), message, "give the arm an id of its own, and base_m");
    } else if robot.kind == BodyKind::TwoLinkArm {
        arm::stand(&mut robot, node, layers.arm, ground.surfaces, report);
    }
    (robot, source)
}

/// A robot of a layout.
fn in_layout(
    node: &Node,
    id: String,
    [start, goal]: [Point2<f64>; 2],
    layers: &Layers<'_>,
    late: &HashSet<&str>,
    report: &mut Report,
) -> (Robot, Source) {
    let at = || (node.path.clone(), node.origin);
    let source = Source { id: at(), start: at(), goal: at(), waypoints: at(), late: late.contains(id.as_str()) };
    (layers.robot(None, Place::at(id, start, vec![goal]), report), source)
}

fn unique(robots: &[Robot], sources: &[Source], report: &mut Report) {
    let mut seen: HashMap<&str, usize> = HashMap::new();
    for (slot, robot) in robots.iter().enumerate().filter(|(_, robot)| !robot.id.is_empty()) {
        if let Some(first) = seen.insert(&robot.id, slot) {
            let (key, origin) = &sources[slot].id;
            let message = format!("the id `{}` is taken by {}", robot.id, owner(&sources[first]));
            report.add_hint(*origin, key, message, "ids must be unique");
        }
    }
}

/// How to name the robot that an id belongs to.
fn owner(source: &Source) -> String {
    let (key, origin) = &source.id;
    let key = key.trim_end_matches(".id");
    match origin {
        Origin::Line(line) => format!("{key} (line {line})"),
        _ => key.to_string(),
    }
}
