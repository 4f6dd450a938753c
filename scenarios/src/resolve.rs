//! From a checked file to a scenario: defaults filled in, layouts placed, times turned into ticks.

use crate::arm;
use crate::check::{self, Source};
use crate::files::Files;
use crate::ground::{Ground, Surfaces};
use crate::layout::{self, Surroundings};
use crate::map;
use crate::node::Node;
use crate::obstacles;
use crate::paper::{self, Paper};
use crate::problems::{Origin, Report};
use crate::processes;
use crate::robots::{self, Layers, Place};
use crate::table::{self, KindKey, Layout, PlacedArm, Root};
use crate::timeline::{self, Stage};
use crate::types::{Arrivals, Interval};
use crate::{walk, warnings};
use geometry::{Capsule, Map};
use model::field::Table;
use model::key::{KeyName, Named, OptionalKey};
use model::kind::{FAR_M, Kind};
use model::*;
use nalgebra::Point2;
use std::collections::{HashMap, HashSet};

/// A fleet without `max_robots` has room for this many robots more than the file has.
const ROBOTS_SPARE: usize = 8;
/// Stands for a point that could not be read; checks pass over it.
const NOWHERE: Point2<f64> = Point2::new(f64::NAN, f64::NAN);

/// Resolves a walked file. A method and a filter that replace those of all robots come with `replaces`. The result counts only if nothing is in the report afterwards.
pub(crate) fn resolve(
    root: &Node,
    name: &str,
    replaces: (Option<&str>, Option<FilterKind>),
    files: &dyn Files,
    report: &mut Report,
) -> (Scenario, Paper) {
    let world = section(root, Root::world);
    let map = map::read(&world, files, report);
    let walls = map.as_ref().map(MapRef::map);
    let bounds = bounds(&world, walls);
    let clock_node = section(root, Root::clock);
    let clock = clock(&clock_node, report);
    let radio = timeline::radio(&section(root, Root::radio));
    let obstacles = obstacles::read(root, bounds, report);
    let surfaces = Surfaces::new(&obstacles, walls);
    let physics = world.get(table::World::physics);
    let layers = Layers::read(root, replaces, physics, clock.tick_hz, report);
    let template = layers.robot(None, Place::at(String::new(), Point2::origin(), Vec::new()), report);

    let ground = Ground { world: bounds, surfaces: &surfaces };
    let crew = Crew::muster(root, &layers, &template, &ground, (clock.seed, files), report);
    for (robot, source) in crew.robots.iter().zip(&crew.sources) {
        ground.check(robot, source, report);
    }
    check::starts_apart(&crew.robots, &crew.sources, report);
    if physics == Physics::Rapier && map.is_some() {
        let (at, key) = (world.at(table::World::physics), world.key(table::World::physics));
        report.add_hint(at, &key, "`rapier` has no maps yet", "leave the map out, or let physics be \"kinematic\"");
    }
    if physics == Physics::Rapier {
        check::solid(
            &crew.robots,
            &crew.sources,
            (&world.key(table::World::physics), world.at(table::World::physics)),
            report,
        );
    }
    let stage = Stage {
        robots: &crew.robots,
        all_known: crew.complete,
        radio,
        clock,
        cut_short: clock_node.has(table::Clock::duration_s)
            && matches!(clock_node.at(table::Clock::duration_s), Origin::Option(_)),
        ground,
    };
    let events = stage.events(root, report);
    warnings::check(&crew.robots, &crew.sources, &events, clock, report);
    if root.node(Root::paper).is_none() {
        warnings::of_other_sizes(&crew.robots, &crew.sources, report);
    }
    let paper = paper::read(root.node(Root::paper), &crew.robots, crew.complete, report);
    let scenario = Scenario {
        name: root.get(Root::name).unwrap_or_else(|| name.to_string()),
        description: root.get(Root::description),
        bounds,
        physics,
        fleet: fleet(&section(root, Root::fleet), &clock, &crew, report),
        processes: processes::read(root, report),
        clock,
        radio,
        obstacles,
        map,
        expect: expect(&section(root, Root::expect), &crew, report),
        robots: crew.robots,
        templates_of_others: layers.templates_but(template.kind),
        template,
        events,
        warnings: Vec::new(),
    };
    (scenario, paper)
}

/// A section of the file; if it has none, an empty one.
fn section(root: &Node, key: OptionalKey<Table>) -> Node {
    match (root.node(key), root.section.key(key.name(), None).map(|spec| spec.kind())) {
        (Some(node), _) => node.clone(),
        (None, Some(Kind::Table(section))) => Node::absent(section, key.name()),
        (None, _) => Node::absent(root.section, ""),
    }
}

fn bounds(node: &Node, walls: Option<&Map>) -> Bounds {
    const FAR: [f64; 2] = [-FAR_M, FAR_M];
    let absent = match walls {
        Some(walls) => {
            let [low, high] = walls.bounds_m();
            [[low.x, high.x], [low.y, high.y]]
        }
        // The edges of a map that could not be read are unknown.
        None if node.has(table::World::map) => [FAR; 2],
        None => [[-10.0, 10.0]; 2],
    };
    // An edge that could not be read is no edge: the robots are not to blame.
    let side = |key: OptionalKey<Interval>, absent: [f64; 2]| {
        if node.is_wrong(key) { FAR } else { node.get(key).map_or(absent, |Interval(edges)| edges) }
    };
    Bounds { x_m: side(table::World::x_m, absent[0]), y_m: side(table::World::y_m, absent[1]) }
}

fn clock(node: &Node, report: &mut Report) -> Clock {
    let (tick_hz, duration_s) = (node.get(table::Clock::tick_hz), node.get(table::Clock::duration_s));
    let ticks_max = (duration_s * tick_hz).round() as u64;
    if ticks_max == 0 {
        let message = format!("{duration_s} s is shorter than half a tick");
        report.add_hint(
            node.at(table::Clock::duration_s),
            &node.key(table::Clock::duration_s),
            message,
            format!("a tick lasts {} s", 1.0 / tick_hz),
        );
    }
    let (mode, stop) = (node.get(table::Clock::mode), node.get(table::Clock::stop));
    Clock { mode, tick_hz, seed: node.get(table::Clock::seed), ticks_max, stop }
}

/// Least `fleet.command_timeout_s` in ticks. A command that is on time can be as old as two ticks when the world takes it: up
/// to one until its agent reads the odometry, up to one until the world reads the command. The third is for late wake-ups.
const COMMAND_TIMEOUT_TICKS_MIN: f64 = 3.0;

fn fleet(node: &Node, clock: &Clock, crew: &Crew, report: &mut Report) -> Fleet {
    let count = crew.robots.len();
    let max_robots = node.get(table::Fleet::max_robots).unwrap_or((count + ROBOTS_SPARE).min(MAX_ROBOTS));
    if (max_robots + 1..=MAX_ROBOTS).contains(&count) {
        let message = format!("the fleet has room for {max_robots}, the scenario has {count} robots");
        let hint = format!("make it {count} or more, or leave it out");
        report.add_hint(node.at(table::Fleet::max_robots), &node.key(table::Fleet::max_robots), message, hint);
    }
    let command_timeout_s = match node.get(table::Fleet::command_timeout_s) {
        Some(timeout_s) => {
            let least_s = COMMAND_TIMEOUT_TICKS_MIN / clock.tick_hz;
            if timeout_s < least_s {
                let message = format!("must be at least three ticks, {least_s} s, is {timeout_s}");
                let hint =
                    format!("make it {least_s} or more, or leave it out: a command on time can be two ticks old");
                let key = table::Fleet::command_timeout_s;
                report.add_hint(node.at(key), &node.key(key), message, hint);
            }
            timeout_s
        }
        None => f64::max(0.25, 5.0 * clock.dt_s()),
    };
    Fleet {
        max_robots,
        straggler: node.get(table::Fleet::straggler),
        straggler_limit_s: node.get(table::Fleet::straggler_limit_s),
        command_timeout_s,
        start_limit_s: node.get(table::Fleet::start_limit_s),
        stuck_limit_s: node.get(table::Fleet::stuck_limit_s),
    }
}

fn expect(node: &Node, crew: &Crew, report: &mut Report) -> Expect {
    let Arrivals(arrived_min) = node.get(table::Expect::arrived);
    let count = crew.robots.len();
    if let Some(arrived) = arrived_min.filter(|arrived| *arrived > count && crew.complete) {
        let message = format!("{arrived} robots cannot arrive, the scenario has {count}");
        report.add_hint(
            node.at(table::Expect::arrived),
            &node.key(table::Expect::arrived),
            message,
            "arrived = \"all\" fits any number",
        );
    }
    Expect {
        arrived_min,
        contacts_max: node.get(table::Expect::contacts_max),
        makespan_s_max: node.get(table::Expect::makespan_s_max),
        clearance_m_min: node.get(table::Expect::clearance_m_min),
        no_contact_s: node.get(table::Expect::no_contact_s).map(|Interval(times)| times),
        rejoin_s_max: node.get(table::Expect::rejoin_s_max),
        tasks_done_by_s: node.get(table::Expect::tasks_done_by_s),
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
        (seed, files): (u64, &dyn Files),
        report: &mut Report,
    ) -> Crew {
        let late = timeline::late(root);
        let pattern = root.node(Root::layout).map(Pattern::of);
        // Of entries with one id, the first is that of the layout's robot.
        let mut of_layout: HashMap<usize, &Node> = HashMap::new();
        let mut alone: Vec<(Robot, Source)> = Vec::new();
        for node in root.nodes(Root::robot) {
            let index = pattern.as_ref().and_then(|pattern| pattern.index_of(&node.get(table::Robot::id)?.0));
            match index.filter(|index| !of_layout.contains_key(index)) {
                Some(index) => drop(of_layout.insert(index, node)),
                None => alone.push(single(node, None, layers, ground, &late, report)),
            }
        }
        let mut complete = alone.iter().all(|(robot, _)| !robot.id.is_empty())
            && !root.is_wrong(Root::robot)
            && !root.is_wrong(Root::layout);
        let mut members: Vec<(Robot, Source)> = Vec::new();
        if let Some(node) = root.node(Root::layout) {
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
                files,
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
            report.add(root.at(Root::robot), "robot", message);
        }
        let (robots, sources): (Vec<Robot>, Vec<Source>) = members.into_iter().unzip();
        let arms = robots.iter().filter(|robot| robot.arm.is_some()).count();
        if ground.surfaces.pieces() + arms > MAX_SHAPES && arms > 0 {
            let message = format!(
                "obstacles and arms together have {} pieces, at most {MAX_SHAPES} are allowed",
                ground.surfaces.pieces() + arms
            );
            report.add_hint(
                root.at(Root::robot),
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
struct Pattern {
    prefix: String,
    count: usize,
}

impl Pattern {
    fn of(node: &Node) -> Pattern {
        Pattern { prefix: node.get(Layout::id_prefix).0, count: node.get(Layout::robots).unwrap_or(0) }
    }

    fn id(&self, index: usize) -> String {
        let digits = (self.count.max(1) - 1).to_string().len().max(2);
        format!("{}{index:0digits$}", self.prefix)
    }

    /// Which robot of the layout has this id.
    fn index_of(&self, id: &str) -> Option<usize> {
        let index = id.strip_prefix(&self.prefix)?.parse().ok()?;
        (index < self.count && self.id(index) == id).then_some(index)
    }
}

/// A robot that stands alone, or one of a layout about which something is different.
fn single(
    node: &Node,
    layout: Option<[Point2<f64>; 2]>,
    layers: &Layers<'_>,
    ground: &Ground<'_>,
    late: &HashSet<String>,
    report: &mut Report,
) -> (Robot, Source) {
    use table::Robot as Keys;
    let id = node.get(Keys::id).map(|id| id.0).unwrap_or_default();
    if layout.is_none() {
        let unplaced = !node.has(Keys::start_m) && !node.has(PlacedArm::start_joints_rad);
        let needed = [(Keys::start_m.any(), unplaced), (Keys::goal_m.any(), !node.has(Keys::goal_m))];
        for name in needed.into_iter().filter(|(_, lacks)| *lacks).map(|(key, _)| key.name()) {
            let hint = node.section.key(name, None).map(walk::describe_key).unwrap_or_default();
            report.add_hint(node.origin, &node.path, format!("needs `{name}`"), format!("{name}: {hint}"));
        }
    }
    let place = |key: KeyName, given: Option<Point2<f64>>, of_layout: Option<Point2<f64>>| {
        of_layout.filter(|_| !node.has(key)).or(given).unwrap_or(NOWHERE)
    };
    let pose = node.get(Keys::goal_m);
    let mut goal = place(Keys::goal_m.any(), pose.map(|pose| pose.at), layout.map(|[_, goal]| goal));
    let goal_motion = match node.node(Keys::goal_motion) {
        Some(motion) if goal.coords.iter().all(|x| x.is_finite()) => {
            obstacles::motion(motion, goal, ground.world, report)
        }
        _ => None,
    };
    if let Some(motion) = &goal_motion {
        goal = obstacles::beginning(motion, goal);
    }
    let mut goals = node.get(Keys::waypoints_m);
    goals.push(goal);
    let start = place(Keys::start_m.any(), node.get(Keys::start_m), layout.map(|[start, _]| start));
    let goal_yaw_rad = pose.and_then(|pose| pose.yaw_rad);
    let at = |key: KeyName| (node.key(key), node.at(key));
    let source = Source {
        id: at(Keys::id.any()),
        start: at(if node.has(PlacedArm::start_joints_rad) {
            PlacedArm::start_joints_rad.any()
        } else {
            Keys::start_m.any()
        }),
        goal: at(Keys::goal_m.any()),
        waypoints: at(Keys::waypoints_m.any()),
        late: late.contains(&id),
    };
    let place = Place { id, start, goals, goal_yaw_rad, goal_motion };
    let mut robot = layers.robot(Some(node), place, report);
    robots::check_goal_yaw(&robot, goal_yaw_rad, &node.key(Keys::goal_m), node.at(Keys::goal_m), report);
    robots::check_rounds(&robot, node, report);
    if robot.kind == BodyKind::TwoLinkArm && layout.is_some() {
        let message = "a robot of the layout cannot be an arm";
        report.add_hint(
            node.at(KindKey::kind),
            &node.key(KindKey::kind),
            message,
            "give the arm an id of its own, and base_m",
        );
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
    late: &HashSet<String>,
    report: &mut Report,
) -> (Robot, Source) {
    let at = || (node.path.clone(), node.origin);
    let source = Source { id: at(), start: at(), goal: at(), waypoints: at(), late: late.contains(&id) };
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
