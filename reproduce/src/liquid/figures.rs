//! Data of the paper's figures, for the stand-ins.

use super::drive::{Descent, Order, Setup, khatib};
use super::{field, words};
use crate::field_map::Window;
use crate::row::{Form, Series};
use crate::scene::{Scene, scene, scenes_of};
use crate::stepper::line;
use model::ParamValues;
use nalgebra::Point2;

/// Heights of a surface end here; obstacles are infinitely high.
const HEIGHT_MAX: f64 = 250.0;

pub(super) fn series() -> Vec<Series> {
    let mut all: Vec<Series> = scenes_of("liquid_").map(paths).collect();
    for name in ["liquid_two_obstacles", "liquid_u_trap"] {
        let setup = Setup::of(scene(name), &ParamValues::new());
        all.push(surface(&setup, &[], "before"));
        all.push(surface(&setup, &setup.offline().virtual_obstacles, "after"));
    }
    all.push(counts());
    all.push(sweep());
    all
}

fn named(name: &str, path: &[Point2<f64>]) -> (String, Vec<[f64; 2]>) {
    (name.to_owned(), line(path))
}

/// Budget of the runs that do not arrive: more would only fill the picture.
fn runs(scene: &Scene) -> (Descent, Descent) {
    let setup = Setup { budget: 60, ..Setup::of(scene, &ParamValues::new()) };
    (setup.offline(), setup.online())
}

fn paths(scene: &Scene) -> Series {
    let (offline, online) = runs(scene);
    let mut lines = Vec::new();
    if offline.arrives {
        lines.push(named("liquid", &offline.path));
    }
    lines.push(named("liquid-online", &online.path));
    for (name, order) in [("Khatib, second order", Order::Second), ("Khatib, first order", Order::First)] {
        lines.push(named(name, &khatib(scene, order).path(0)));
    }
    // Drawn as what they are to the method: discs of V_r' = A_r.
    let drops = offline.virtual_obstacles.iter().filter(|_| offline.arrives);
    let drops = drops.map(|p| [p.x, p.y, scene.robot().radius_m]);
    Series::paths(
        scene.name.clone(),
        format!("{}: {}", scene.name, scene.scenario.description),
        lines,
        scene.drawn().into_iter().chain(drops).collect(),
    )
}

fn surface(setup: &Setup, virtual_obstacles: &[Point2<f64>], when: &str) -> Series {
    let (scene, law, obstacles) = (&setup.scene, setup.law(), setup.scene.discs());
    let field = field(scene, &law, &obstacles, virtual_obstacles);
    Series {
        discs: scene.drawn(),
        ..Series::chart(
            Form::Surface,
            format!("{}_potential_{when}", scene.name),
            format!("{}: potential {when} the virtual obstacles were put up (cut at {HEIGHT_MAX})", scene.name),
            ["x (m)", "y (m)"],
            Window::of(scene).surface(HEIGHT_MAX, |p| field.at(p)),
        )
    }
}

/// Rounds and steps by scene.
fn counts() -> Series {
    let mut names = Vec::new();
    let mut bars = [const { Vec::new() }; 4];
    for scene in scenes_of("liquid_") {
        let (offline, online) = runs(scene);
        if offline.arrives && online.arrives {
            let values = [offline.rounds, offline.steps(), online.rounds, online.steps()];
            for (bars, value) in bars.iter_mut().zip(values) {
                bars.push([names.len() as f64 + 1.0, value as f64]);
            }
            names.push(format!("{} {}", names.len() + 1, scene.name.trim_start_matches("liquid_")));
        }
    }
    let labels = ["liquid: rounds", "liquid: steps", "liquid-online: rounds", "liquid-online: steps"];
    Series::chart(
        Form::Bars,
        "liquid_counts",
        format!("rounds and steps, where both arrive: {}", names.join(", ")),
        ["environment", "count"],
        labels.map(str::to_owned).into_iter().zip(bars).collect(),
    )
}

fn sweep() -> Series {
    let runs = words::sweep_runs();
    let of = |count: fn(&Descent) -> usize| runs.iter().map(|(k_v, run)| [*k_v, count(run) as f64]).collect::<Vec<_>>();
    Series::chart(
        Form::Lines,
        "liquid_k_v",
        "liquid_u_shallow: fewer virtual obstacles or a shorter path",
        ["K_v (m²)", "count"],
        vec![("virtual obstacles".into(), of(|run| run.virtual_obstacles.len())), ("steps".into(), of(Descent::steps))],
    )
}
