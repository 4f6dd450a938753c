//! Data of the paper's figures: paths, convergence, reductions, and the arm's motion.

use super::experiment::{Experiment, Optimised, reduction_percent};
use super::{claims, fleet, maps};
use crate::row::{Form, Series};
use crate::scene::scene;
use crate::stepper::line;
use geometry::Elbow;
use geometry::spline::length;
use planners::pso_via_points::field::Variant;

fn name_of(variant: Variant) -> &'static str {
    match variant {
        Variant::Plain => "plain field",
        Variant::Left => "(17), (18)",
        Variant::Right => "(15), (16)",
        Variant::FadedBias => "faded bias",
        Variant::LiteralBias => "literal bias",
    }
}

pub(super) fn series() -> Vec<Series> {
    let mut all = Vec::new();
    let mut reductions = Vec::new();
    for (name, base) in [("pso_mass_point_1", Variant::Plain), ("pso_mass_point_2", Variant::FadedBias)] {
        point(name, base, &mut all, &mut reductions);
    }
    for (name, elbow) in [
        ("pso_arm_1", Elbow::Up),
        ("pso_arm_1", Elbow::Down),
        ("pso_arm_2", Elbow::Up),
        ("pso_arm_elbow_flip", Elbow::Down),
        ("pso_arm_elbow_flip", Elbow::Up),
    ] {
        arm(name, elbow, &mut all, &mut reductions);
    }
    let bars = |get: fn(&(f64, f64)) -> f64| {
        reductions.iter().enumerate().map(|(i, both)| [(i + 1) as f64, get(both)]).collect()
    };
    all.push(Series::chart(
        Form::Bars,
        "pso_reductions",
        "What the swarm takes off the raw path; the paper's four cases are in its own environments",
        ["mass point 1, mass point 2, arm 1, arm 2", "reduction (%)"],
        vec![("here".to_owned(), bars(|both| both.0)), ("paper".to_owned(), bars(|both| both.1))],
    ));
    maps::series(&mut all);
    all
}

fn point(name: &str, base: Variant, all: &mut Vec<Series>, reductions: &mut Vec<(f64, f64)>) {
    let experiment = Experiment::new(scene(name));
    let raws: Vec<_> = Variant::ORDER.iter().chain([&Variant::LiteralBias]).map(|v| (*v, experiment.raw(*v))).collect();
    let raw = experiment.raw(base);
    let runs: Vec<_> = (0..10).map(|seed| experiment.optimise(&raw.points, None, seed)).collect();
    let mut lines: Vec<_> = raws.iter().map(|(v, raw)| (name_of(*v).to_owned(), line(&raw.points))).collect();
    lines.push((format!("swarm on {}", name_of(base)), line(&runs[0].path)));
    lines.push(("via points".to_owned(), line(&runs[0].via)));
    all.push(Series::paths(
        format!("{name}_paths"),
        format!("{name}: raw paths and the swarm's path"),
        lines,
        scene(name).drawn(),
    ));
    all.push(convergence(name, &runs));
    let longest = runs.iter().map(|run| run.length_m).fold(0.0, f64::max);
    let paper = if name == "pso_mass_point_1" { 5.87 } else { 3.44 };
    reductions.push((reduction_percent(length(&raw.points), longest), paper));
}

/// Best cost over the iterations.
fn convergence(name: &str, runs: &[Optimised]) -> Series {
    let curve = |history: &[f64]| history.iter().enumerate().map(|(i, cost)| [i as f64, *cost]).collect();
    Series::chart(
        Form::Lines,
        format!("{name}_convergence"),
        format!("{name}: best cost over the iterations, ten seeds"),
        ["iteration", "best cost (m)"],
        runs.iter().enumerate().map(|(seed, run)| (format!("seed {seed}"), curve(&run.history))).collect(),
    )
}

fn arm(name: &str, elbow: Elbow, all: &mut Vec<Series>, reductions: &mut Vec<(f64, f64)>) {
    let experiment = Experiment::new(scene(name));
    let run = fleet::run_arm(&experiment, elbow);
    let geometry = experiment.arm.expect("an arm");
    let tips: Vec<_> = run.joints_rad.iter().map(|joints| geometry.tip(*joints)).collect();
    let plain = experiment.raw(Variant::Plain);
    let mut lines = vec![("plain field".to_owned(), line(&plain.points)), ("tip as driven".to_owned(), line(&tips))];
    let swarm = claims::SWARMS.iter().find(|(scene, _, sheet)| (*scene, *sheet) == (name, Some(elbow)));
    if let Some((_, base, _)) = swarm {
        let raw = experiment.raw(*base);
        if *base != Variant::Plain {
            lines.push((name_of(*base).to_owned(), line(&raw.points)));
        }
        let runs: Vec<_> = (0..10).map(|seed| experiment.optimise(&raw.points, Some(elbow), seed)).collect();
        let longest = runs.iter().map(|run| run.length_m).fold(0.0, f64::max);
        let paper = if name == "pso_arm_1" { 4.02 } else { 4.23 };
        reductions.push((reduction_percent(length(&raw.points), longest), paper));
        lines.push((format!("swarm on {}", name_of(*base)), line(&runs[0].path)));
        all.push(convergence(name, &runs));
    }
    let outcome = match run.arrival_s {
        Some(time_s) => format!("arrives after {time_s:.1} s, links {:.2} m clear", run.clearance_m),
        None if run.tip_path_m == 0.0 => "stays put, there is no way in this sheet".to_owned(),
        None => "does not arrive".to_owned(),
    };
    let sheet = if elbow == Elbow::Up { "up" } else { "down" };
    let file = format!("{name}_{sheet}");
    // Ten poses on the way; of an arm that stays put, the one it has.
    let every = if run.tip_path_m == 0.0 { run.joints_rad.len() } else { (run.joints_rad.len() / 10).max(1) };
    for (i, joints) in run.joints_rad.iter().enumerate().step_by(every) {
        let at = [geometry.base, geometry.elbow(*joints), geometry.tip(*joints)];
        lines.push((format!("pose {:.1} s", i as f64 * 0.05), line(&at)));
    }
    all.push(Series::paths(
        format!("{file}_paths"),
        format!("{name}, elbow {sheet}: {outcome}"),
        lines,
        scene(name).drawn(),
    ));
    let end_s = (run.joints_rad.len() - 1) as f64 * 0.05;
    let limits = [geometry.joint_min_rad, geometry.joint_max_rad].into_iter().zip(["least", "most"]);
    let limits = limits.flat_map(|(both, which)| [0, 1].map(|i| (format!("{which} of joint {}", i + 1), both[i])));
    let limits = limits.map(|(name, rad)| (name, vec![[0.0, rad.to_degrees()], [end_s, rad.to_degrees()]]));
    let joint = |i: usize| {
        let at = |(tick, joints): (usize, &[f64; 2])| [tick as f64 * 0.05, joints[i].to_degrees()];
        run.joints_rad.iter().enumerate().map(at).collect()
    };
    all.push(Series::chart(
        Form::Lines,
        format!("{file}_joints"),
        format!("{name}: joint angles as driven, elbow {sheet}"),
        ["time (s)", "angle (degrees)"],
        [("joint 1".to_owned(), joint(0)), ("joint 2".to_owned(), joint(1))].into_iter().chain(limits).collect(),
    ));
}
