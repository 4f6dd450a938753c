//! Data of figures: who gets where, beside whom, and how near to the goal when things move.

use super::effects::{many_particles, particle_counts};
use super::{field, rpoa, with};
use crate::environment::{Environment, environments_of};
use crate::row::{Form, Series};
use crate::simulate::Outcome;
use model::ParamValue;
use nalgebra::Point2;

pub(super) fn series() -> Vec<Series> {
    environments_of("rpoa_").flat_map(of).chain([particles()]).collect()
}

/// The figures of one environment.
fn of(environment: &'static Environment) -> Vec<Series> {
    let random = rpoa(environment, "random", 1);
    let guarded = with(random.clone(), "guard", ParamValue::Bool(true));
    let compared = [
        ("RPOA, random angles", random),
        ("RPOA, equal angles", rpoa(environment, "equal", 1)),
        ("APF", field(environment, None)),
        ("RPOA with the guard", guarded),
    ];
    let mut runs = compared.map(|(name, run)| (name, run.dt_s, run.run())).to_vec();
    // Where the guard changes nothing it is not drawn.
    if runs[3].2.paths == runs[0].2.paths {
        runs.pop();
    }
    let moves =
        environment.obstacles.iter().any(|disc| disc.motion.is_some()) || environment.robots[0].goal_motion.is_some();
    let mut all = vec![paths(environment, &runs)];
    if moves {
        all.push(distances(environment, &runs));
    }
    all
}

type Named<'a> = (&'a str, f64, Outcome);

fn paths(environment: &Environment, runs: &[Named<'_>]) -> Series {
    let mut lines: Vec<_> = runs.iter().map(|(name, _, outcome)| ((*name).to_owned(), outcome.line(0))).collect();
    // What moves is shown for as long as the first to arrive is on its way.
    let first_s = runs.iter().filter_map(|(_, _, outcome)| outcome.arrival_s[0]).fold(f64::INFINITY, f64::min);
    let shown_s = if first_s.is_finite() { first_s } else { 15.0 };
    let course = |at: &dyn Fn(f64) -> Point2<f64>, moves: bool| -> Vec<[f64; 2]> {
        let ticks = if moves { (shown_s / 0.1).round() as u32 } else { 0 };
        (0..=ticks).map(|tick| at(f64::from(tick) * 0.1)).map(|p| [p.x, p.y]).collect()
    };
    let robot = &environment.robots[0];
    lines.push(("goal".to_owned(), course(&|t| robot.goal_at(t), robot.goal_motion.is_some())));
    for (disc, i) in environment.obstacles.iter().zip(1..).filter(|(disc, _)| disc.motion.is_some()) {
        lines.push((format!("course of obstacle {i}"), course(&|t| disc.center_at(t), true)));
    }
    let outcomes: Vec<String> = runs.iter().map(|(name, _, outcome)| format!("{name} {}", words(outcome))).collect();
    Series {
        name: environment.name.clone(),
        title: format!("{}, obstacles where they start: {}", environment.name, outcomes.join("; ")),
        x: "x (m)".to_owned(),
        y: "y (m)".to_owned(),
        form: Form::Paths,
        lines,
        discs: environment.obstacles.iter().map(|disc| [disc.center.x, disc.center.y, disc.radius]).collect(),
    }
}

/// What became of a robot.
fn words(outcome: &Outcome) -> String {
    let mut words = match outcome.arrival_s[0] {
        Some(time_s) => format!("arrives after {time_s:.1} s"),
        None => format!("does not arrive, ends {:.1} m off", outcome.distance_to_goal(0)),
    };
    if outcome.obstacle_clearance < 0.0 {
        words += &format!(", {:.1} cm inside an obstacle on the way", -100.0 * outcome.obstacle_clearance);
    }
    words
}

fn distances(environment: &Environment, runs: &[Named<'_>]) -> Series {
    let robot = &environment.robots[0];
    let line = |(name, dt_s, outcome): &Named<'_>| {
        let at = |(tick, place): (usize, &Point2<f64>)| {
            let t = tick as f64 * dt_s;
            [t, (robot.goal_at(t) - place).norm()]
        };
        ((*name).to_owned(), outcome.paths[0].iter().enumerate().map(at).collect())
    };
    Series {
        name: format!("{}_distance", environment.name),
        title: format!("{}: distance to the goal, to the end of the run", environment.name),
        x: "time (s)".to_owned(),
        y: "distance (m)".to_owned(),
        form: Form::Lines,
        lines: runs.iter().map(line).collect(),
        discs: Vec::new(),
    }
}

fn particles() -> Series {
    let bars = particle_counts().map(|(n, _)| (format!("{n}"), vec![[n as f64, many_particles(n).time_mean()]]));
    Series {
        name: "rpoa_particles".to_owned(),
        title: "Mean time in rpoa_static_moved4 over the number of particles, 20 seeds each".to_owned(),
        x: "particles".to_owned(),
        y: "time (s)".to_owned(),
        form: Form::Bars,
        lines: bars.into(),
        discs: Vec::new(),
    }
}
