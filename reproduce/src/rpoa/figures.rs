//! Data of figures: who gets where, beside whom, and how near to the goal when things move.

use super::effects::{many_particles, particle_counts};
use super::{examples, field, rpoa};
use crate::example::at_origin;
use crate::field_map::Window;
use crate::row::{Form, Series};
use crate::scene::{Scene, goal, goal_mover, mover, scene, scenes_of};
use crate::stepper::Stepper;
use model::{Mover, ParamValue};
use nalgebra::{Point2, Vector2};
use planners::Identity;
use planners::rpoa::{Params, Rpoa};
use std::f64::consts::TAU;

pub(super) fn series() -> Vec<Series> {
    let mut all: Vec<Series> = scenes_of("rpoa_").flat_map(of).collect();
    all.extend([particles(), cost(), errors(), bearings()]);
    all
}

/// J over the plane, as it would be if the robot sensed everything.
fn cost() -> Series {
    let (scene, discs) = (scene("rpoa_static"), scene("rpoa_static").discs());
    let everywhere = Params { sensor_range: f64::INFINITY, guard: false, ..Params::default() };
    let mut rpoa = Rpoa::new(everywhere, Identity { seed: 1, robot: 0, incarnation: 0 });
    let target = goal(scene.robot());
    rpoa.sense(&at_origin(target, &discs));
    let chart = Series::chart(
        Form::Surface,
        "rpoa_cost",
        "rpoa_static: cost J of all obstacles and of the target",
        ["x (m)", "y (m)"],
        Window::of(scene).surface(f64::INFINITY, |theta| rpoa.cost(theta, target)),
    );
    Series { discs: scene.drawn(), ..chart }
}

/// Both errors of a particle over the direction in which it is.
fn errors() -> Series {
    let angles = (0..=360).map(f64::from);
    let both: Vec<[f64; 3]> = angles.map(examples::errors_of_example()).collect();
    let line = |i: usize| both.iter().map(|point| [point[0], point[i]]).collect();
    Series::chart(
        Form::Lines,
        "rpoa_errors",
        "Errors of a particle 0.1 m from the robot: a disc of radius 0.3 m is 1 m ahead, the target 5 m",
        ["angle to the line of sight (degrees)", "error of distance (m) and of cost"],
        vec![("e_D".to_owned(), line(1)), ("e_J".to_owned(), line(2))],
    )
}

/// Round the target: where the field goes for ever, RPOA arrives.
fn bearings() -> Series {
    let scene = scene("rpoa_orbiter");
    let target = goal(scene.robot());
    let seen = |places: Vec<Point2<f64>>| {
        let turned = turns(places.iter().map(|place| place - target));
        turned.into_iter().enumerate().map(|(tick, turned)| [tick as f64 * 0.1, turned / TAU]).collect::<Vec<_>>()
    };
    let (field, rpoa) = (field(scene, None).run(), rpoa(scene, "random", 1).run());
    let circling = scene.scenario.obstacles.iter().zip(0..).filter_map(|(disc, i)| mover(disc, 1, i));
    let mut circling = circling.last().expect("an obstacle circles round the target");
    let obstacle = (0..field.history.len()).map(|tick| circling.at(tick as f64 * 0.1).0).collect();
    Series::chart(
        Form::Lines,
        "rpoa_orbiter_bearing",
        "rpoa_orbiter: turns round the target",
        ["time (s)", "turns"],
        vec![
            ("RPOA, random angles".to_owned(), seen(rpoa.path(0))),
            ("APF".to_owned(), seen(field.path(0))),
            ("the obstacle".to_owned(), seen(obstacle)),
        ],
    )
}

/// How far a direction has turned since the beginning, rad, with whole turns counted.
pub(super) fn turns(directions: impl Iterator<Item = Vector2<f64>>) -> Vec<f64> {
    let mut total = 0.0;
    let mut before: Option<Vector2<f64>> = None;
    let turned = |direction: Vector2<f64>| {
        total += before.map_or(0.0, |before| before.perp(&direction).atan2(before.dot(&direction)));
        before = Some(direction);
        total
    };
    directions.map(turned).collect()
}

/// The figures of one scene.
fn of(scene: &'static Scene) -> Vec<Series> {
    let random = rpoa(scene, "random", 1);
    let guarded = random.clone().with("guard", ParamValue::Bool(true));
    let compared = [
        ("RPOA, random angles", random),
        ("RPOA, equal angles", rpoa(scene, "equal", 1)),
        ("APF", field(scene, None)),
        ("RPOA with the guard", guarded),
    ];
    let mut runs: Vec<Named<'_>> = compared.map(|(name, run)| (name, run.run())).into();
    // Where the guard changes nothing it is not drawn.
    if runs[3].1.path(0) == runs[0].1.path(0) {
        runs.pop();
    }
    let moves =
        scene.scenario.obstacles.iter().any(|disc| disc.motion.is_some()) || scene.robot().goal_motion.is_some();
    let mut all = vec![paths(scene, &runs)];
    if moves {
        all.push(distances(scene, &runs));
    }
    all
}

type Named<'a> = (&'a str, Stepper);

/// A place as a function of time.
fn course(mover: Option<Mover>, fixed: Point2<f64>) -> impl FnMut(f64) -> Point2<f64> {
    let mut mover = mover;
    move |t| mover.as_mut().map_or(fixed, |mover| mover.at(t).0)
}

fn paths(scene: &Scene, runs: &[Named<'_>]) -> Series {
    let mut lines: Vec<_> = runs.iter().map(|(name, outcome)| ((*name).to_owned(), outcome.line(0))).collect();
    // What moves is shown for as long as the first to arrive is on its way.
    let first_s = runs.iter().filter_map(|(_, outcome)| outcome.arrival_s(0)).fold(f64::INFINITY, f64::min);
    let shown_s = if first_s.is_finite() { first_s } else { 15.0 };
    let drawn = |mut at: Box<dyn FnMut(f64) -> Point2<f64>>, moves: bool| -> Vec<[f64; 2]> {
        let ticks = if moves { (shown_s / 0.1).round() as u32 } else { 0 };
        (0..=ticks).map(|tick| at(f64::from(tick) * 0.1)).map(|p| [p.x, p.y]).collect()
    };
    let robot = scene.robot();
    let at_goal = course(goal_mover(robot), goal(robot));
    lines.push(("goal".to_owned(), drawn(Box::new(at_goal), robot.goal_motion.is_some())));
    for (disc, i) in scene.scenario.obstacles.iter().zip(1..).filter(|(disc, _)| disc.motion.is_some()) {
        let at = course(mover(disc, scene.scenario.clock.seed, i - 1), disc.shape.reference());
        lines.push((format!("course of obstacle {i}"), drawn(Box::new(at), true)));
    }
    let outcomes: Vec<String> = runs.iter().map(|(name, outcome)| format!("{name} {}", words(outcome))).collect();
    Series::paths(
        scene.name.clone(),
        format!("{}, obstacles where they start: {}", scene.name, outcomes.join("; ")),
        lines,
        scene.drawn(),
    )
}

/// What became of a robot.
fn words(outcome: &Stepper) -> String {
    let mut words = match outcome.arrival_s(0) {
        Some(time_s) => format!("arrives after {time_s:.1} s"),
        None => format!("does not arrive, ends {:.1} m off", outcome.distance_to_goal(0)),
    };
    if outcome.obstacles.clearance_m < 0.0 {
        words += &format!(", {:.1} cm inside an obstacle on the way", -100.0 * outcome.obstacles.clearance_m);
    }
    words
}

fn distances(scene: &Scene, runs: &[Named<'_>]) -> Series {
    let robot = scene.robot();
    let line = |(name, outcome): &Named<'_>| {
        let mut at_goal = course(goal_mover(robot), goal(robot));
        let mut at = |(tick, place): (usize, Point2<f64>)| {
            let t = tick as f64 * outcome.rules.dt_s;
            [t, (at_goal(t) - place).norm()]
        };
        ((*name).to_owned(), outcome.path(0).into_iter().enumerate().map(&mut at).collect())
    };
    Series::chart(
        Form::Lines,
        format!("{}_distance", scene.name),
        format!("{}: distance to the goal, to the end of the run", scene.name),
        ["time (s)", "distance (m)"],
        runs.iter().map(line).collect(),
    )
}

fn particles() -> Series {
    let bars = particle_counts().map(|(n, _)| (format!("{n}"), vec![[n as f64, many_particles(n).time_mean()]]));
    Series::chart(
        Form::Bars,
        "rpoa_particles",
        "Mean time in rpoa_static_moved4 over the number of particles, 20 seeds each",
        ["particles", "time (s)"],
        bars.into(),
    )
}
