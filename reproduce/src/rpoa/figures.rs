//! Data of figures: who gets where, beside whom, and how near to the goal when things move.

use super::effects::{many_particles, particle_counts};
use super::{field, rpoa};
use crate::row::{Form, Series};
use crate::scene::{Scene, goal, goal_mover, mover, scenes_of};
use crate::stepper::Stepper;
use model::{Mover, ParamValue};
use nalgebra::Point2;

pub(super) fn series() -> Vec<Series> {
    scenes_of("rpoa_").flat_map(of).chain([particles()]).collect()
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
