//! A robot that is added to a running fleet.

use crate::check::{self, Source};
use crate::document::{self, Raw, RawTable, RawValue};
use crate::files::NoFiles;
use crate::ground::{Ground, Surfaces};
use crate::layout::{self, Surroundings};
use crate::problems::{Origin, Problems, Report};
use crate::table::{Layout, Root};
use crate::{arm, methods, robots, walk};
use geometry::Capsule;
use model::key::Named;
use model::kind::{LARGE, Range};
use model::{BodyKind, FilterKind, MAX_GOALS, ParamValues, Physics, Robot, Scenario};
use nalgebra::Point2;

/// What `shoal add` says about the robot; the rest comes from the scenario's defaults.
#[derive(Clone, Debug, PartialEq)]
pub struct NewRobot {
    /// Its name; `None` takes the first free one of r00, r01, ...
    pub id: Option<String>,
    /// Its name is that of a robot that has left, and is free.
    pub returns: bool,
    /// How it moves.
    pub kind: Option<BodyKind>,
    /// Body radius, m.
    pub radius_m: Option<f64>,
    /// Where it starts, m.
    pub start: Point2<f64>,
    /// Its heading at the start, rad; `None` is towards its first goal.
    pub start_yaw_rad: Option<f64>,
    /// Its goals in order, m; none means that it stays where it starts.
    pub goals: Vec<Point2<f64>>,
    /// The heading that it is to have at the last of them, rad; `None` is any.
    pub goal_yaw_rad: Option<f64>,
    /// Its method; `None` is that of the defaults, with the defaults' parameters.
    pub planner: Option<String>,
    /// Parameters of its method.
    pub params: ParamValues,
}

/// Builds a robot for a running fleet, with the checks that a robot of the file gets. `scenario.robots` are the robots
/// whose ids are taken; where they are now is for the caller to check.
pub fn add_robot(scenario: &Scenario, request: &NewRobot) -> Result<Robot, Problems> {
    let taken = |id: &str| scenario.robots.iter().any(|robot| robot.id == id);
    let free = || (0..).map(|n| format!("r{n:02}")).find(|id| !taken(id)).unwrap_or_default();
    let id = request.id.clone().unwrap_or_else(free);
    let here = Origin::Whole;
    let wrong = walk::check_id(&id, 32).err();
    // One that is not valid is only shown from here on, with whatever else is wrong.
    let id = if wrong.is_none() { id } else { id.chars().take(40).flat_map(char::escape_debug).collect() };
    let mut report = Report::new(format!("robot `{id}`"), Vec::new());
    if let Some(message) = wrong {
        report.add(here, "id", message);
    } else if taken(&id) && !request.returns {
        report.add_hint(here, "id", format!("the id `{id}` is taken"), "leave the id out to get a free one");
    }
    let kind = request.kind.unwrap_or(scenario.template.kind);
    let template = scenario.template_of(kind).unwrap_or(&scenario.template);
    if template.kind != kind && kind != BodyKind::TwoLinkArm {
        let message = format!("the defaults of the scenario do not fit a {}", kind.word());
        let hint = format!("give the scenario a [kinds.{}] with what its robots can do", kind.word());
        report.add_hint(here, "kind", message, hint);
    }
    let radius_m = request.radius_m.unwrap_or(template.radius_m);
    if !(radius_m > 0.0 && radius_m <= LARGE) {
        report.add(here, "radius_m", format!("must be above 0, is {radius_m}"));
    }
    let start_yaw_rad = request.start_yaw_rad.unwrap_or_else(|| {
        geometry::heading(request.goals.first().map_or(nalgebra::Vector2::zeros(), |goal| goal - request.start))
    });
    if !Range::ANY.contains(start_yaw_rad) {
        report.add(here, "start_yaw_rad", format!("must be a number of rad, is {start_yaw_rad}"));
    }
    let goals = if request.goals.is_empty() { vec![request.start] } else { request.goals.clone() };
    if goals.len() > MAX_GOALS {
        report.add(here, "goals", format!("there can be at most {MAX_GOALS}, there are {}", goals.len()));
    }
    for point in goals.iter().chain([&request.start]).filter(|point| !point.coords.iter().all(|x| x.is_finite())) {
        report.add(here, "", format!("[{}, {}] is not a finite position", point.x, point.y));
    }

    arm::check_added(kind, &mut report);
    let planner = request.planner.as_deref().unwrap_or(&template.planner);
    let mut params = if planner == template.planner { template.params.clone() } else { ParamValues::new() };
    params.extend(request.params.clone());
    if let Some(method) = methods::find(planner, "planner", here, &mut report) {
        if kind != BodyKind::TwoLinkArm && template.agent.is_none() {
            robots::check_kind(&[], kind, planner, ("planner", here), &mut report);
        }
        for problem in method.check(&params) {
            methods::add(method, &problem, &format!("params.{}", problem.name()), here, &mut report);
        }
    }

    // Another planner comes with what it counts on.
    let filter = if planner == template.planner {
        template.filter
    } else {
        match template.filter {
            FilterKind::SharedGap => FilterKind::SharedGap,
            FilterKind::None => robots::filter_for(planner, kind, scenario.physics),
        }
    };
    let robot = Robot {
        kind,
        filter,
        radius_m,
        start: request.start,
        start_yaw_rad,
        goals,
        goal_yaw_rad: request.goal_yaw_rad,
        rounds: Some(1),
        goal_motion: None,
        planner: planner.to_string(),
        params,
        id,
        ..template.clone()
    };
    robots::check_goal_yaw(&robot, robot.goal_yaw_rad, "goal", here, &mut report);
    let at = |key: &str| (key.to_string(), here);
    let source = Source { id: at("id"), start: at("start"), goal: at("goal"), waypoints: at("goal"), late: true };
    let surfaces = Surfaces::new(&scenario.obstacles, scenario.walls());
    Ground { world: scenario.bounds, surfaces: &surfaces }.check(&robot, &source, &mut report);
    if scenario.physics == Physics::Rapier {
        check::solid(std::slice::from_ref(&robot), std::slice::from_ref(&source), ("", here), &mut report);
    }
    report.finish().map(|_| robot)
}

/// A pattern of robots for a running fleet, with the keys of `[layout]`.
#[derive(Clone, Debug, PartialEq)]
pub struct NewLayout {
    /// The word of the pattern.
    pub kind: String,
    /// Number of robots.
    pub robots: usize,
    /// Its other keys, each as `key=TOML-value`.
    pub set: Vec<String>,
    /// Seed of what is random in it; `None` is that of the scenario.
    pub seed: Option<u64>,
}

/// Start and goal of each robot of a pattern. `bodies` are where robots are now, which is what a random pattern keeps clear of; of
/// others, only the daemon knows whether a start is free.
///
/// # Errors
/// With all problems of the pattern.
pub fn places(scenario: &Scenario, layout: &NewLayout, bodies: &[Capsule]) -> Result<Vec<[Point2<f64>; 2]>, Problems> {
    let mut options = vec![format!("--layout {}", layout.kind), format!("--count {}", layout.robots)];
    options.extend(layout.set.iter().map(|assignment| format!("--set {assignment}")));
    let mut report = Report::new("layout".to_owned(), options);
    let (mut document, section) = (RawTable::default(), Root::layout.name());
    let values = [
        (Layout::kind.name(), RawValue::Text(layout.kind.clone())),
        (Layout::robots.name(), RawValue::Int(layout.robots as i128)),
    ];
    for (index, (key, value)) in values.into_iter().enumerate() {
        document.put(&[section, key], Raw { origin: Origin::Option(index), value });
    }
    for (index, assignment) in layout.set.iter().enumerate() {
        document::set(&mut document, &format!("{section}.{assignment}"), Origin::Option(2 + index), &mut report);
    }
    let root = walk::walk(document, &mut report);
    let around = Surroundings {
        world: scenario.bounds,
        seed: layout.seed.unwrap_or(scenario.clock.seed),
        radius_m: scenario.template.radius_m,
        obstacles: &Surfaces::new(&scenario.obstacles, scenario.walls()),
        starts: bodies,
        goals: &[],
        files: &NoFiles,
    };
    let places = root.node(Root::layout).and_then(|node| layout::places(node, &around, &mut report));
    report.finish().map(|_| places.unwrap_or_default())
}

/// What is wrong with a goal for a robot of a running fleet, if anything is.
pub fn goal_problem(scenario: &Scenario, robot: &Robot, goal: Point2<f64>, yaw_rad: Option<f64>) -> Option<String> {
    let mut report = Report::new(format!("robot `{}`", robot.id), Vec::new());
    if !goal.coords.iter().all(|x| x.is_finite()) {
        return Some(format!("[{}, {}] is not a finite position", goal.x, goal.y));
    }
    let surfaces = Surfaces::new(&scenario.obstacles, scenario.walls());
    let ground = Ground { world: scenario.bounds, surfaces: &surfaces };
    ground.goal(robot, goal, "the goal", "", Origin::Whole, &mut report);
    robots::check_goal_yaw(robot, yaw_rad, "", Origin::Whole, &mut report);
    report.finish().err().and_then(|problems| Some(problems.shown.first()?.to_string()))
}
