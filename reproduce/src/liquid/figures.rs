//! Data of the paper's figures, for the stand-ins.

use super::drive::{Descent, Khatib, Setup};
use super::{field, words};
use crate::environment::{Environment, environment, environments_of};
use crate::row::{Form, Series};
use nalgebra::Point2;

/// Heights of a surface end here; obstacles are infinitely high.
const HEIGHT_MAX: f64 = 250.0;
/// Points of a surface along each side.
const GRID: usize = 81;

pub(super) fn series() -> Vec<Series> {
    let mut all: Vec<Series> = environments_of("liquid_").map(paths).collect();
    for name in ["liquid_two_obstacles", "liquid_u_trap"] {
        let setup = Setup::of(environment(name), &toml::Table::new());
        all.push(surface(&setup, &[], "before"));
        all.push(surface(&setup, &setup.offline().virtual_obstacles, "after"));
    }
    all.push(counts());
    all.push(sweep());
    all
}

fn line(name: &str, path: &[Point2<f64>]) -> (String, Vec<[f64; 2]>) {
    (name.to_owned(), path.iter().map(|p| [p.x, p.y]).collect())
}

/// Budget of the runs that do not arrive: more would only fill the picture.
fn runs(environment: &Environment) -> (Descent, Descent) {
    let setup = Setup { budget: Some(60), ..Setup::of(environment, &toml::Table::new()) };
    (setup.offline(), setup.online())
}

fn paths(environment: &Environment) -> Series {
    let (offline, online) = runs(environment);
    let mut lines = Vec::new();
    if offline.arrives {
        lines.push(line("liquid", &offline.path));
    }
    lines.push(line("liquid-online", &online.path));
    for (name, set) in [("Khatib, second order", "khatib_second_order"), ("Khatib, first order", "khatib_first_order")]
    {
        lines.push(line(name, &Khatib::run(environment, set).path));
    }
    let discs = environment.obstacles.iter().map(|disc| [disc.center.x, disc.center.y, disc.radius]);
    // Drawn as what they are to the method: discs of V_r' = A_r.
    let drops = offline.virtual_obstacles.iter().filter(|_| offline.arrives);
    let drops = drops.map(|p| [p.x, p.y, environment.robots[0].radius]);
    Series {
        name: environment.name.clone(),
        title: format!("{}: {}", environment.name, environment.note),
        x: "x (m)".into(),
        y: "y (m)".into(),
        form: Form::Paths,
        lines,
        discs: discs.chain(drops).collect(),
    }
}

fn surface(setup: &Setup, virtual_obstacles: &[Point2<f64>], when: &str) -> Series {
    let environment = &setup.environment;
    let (law, obstacles) = (setup.law(), setup.obstacles(0.0));
    let field = field(environment, &law, &obstacles, virtual_obstacles);
    let between = |ends: [f64; 2], i: usize| ends[0] + (ends[1] - ends[0]) * i as f64 / (GRID - 1) as f64;
    let row = |i: usize| {
        let y = between(environment.world.y, i);
        let height = |x: f64| field.at(Point2::new(x, y)).min(HEIGHT_MAX);
        let points = (0..GRID).map(|j| between(environment.world.x, j)).map(|x| [x, height(x)]);
        (format!("{y}"), points.collect())
    };
    Series {
        name: format!("{}_potential_{when}", environment.name),
        title: format!(
            "{}: potential {when} the virtual obstacles were put up (cut at {HEIGHT_MAX})",
            environment.name
        ),
        x: "x (m)".into(),
        y: "y (m)".into(),
        form: Form::Surface,
        lines: (0..GRID).map(row).collect(),
        discs: environment.obstacles.iter().map(|disc| [disc.center.x, disc.center.y, disc.radius]).collect(),
    }
}

/// Rounds and steps by environment.
fn counts() -> Series {
    let mut names = Vec::new();
    let mut bars = [const { Vec::new() }; 4];
    for environment in environments_of("liquid_") {
        let (offline, online) = runs(environment);
        if offline.arrives && online.arrives {
            let values = [offline.rounds, offline.steps(), online.rounds, online.steps()];
            for (bars, value) in bars.iter_mut().zip(values) {
                bars.push([names.len() as f64 + 1.0, value as f64]);
            }
            names.push(format!("{} {}", names.len() + 1, environment.name.trim_start_matches("liquid_")));
        }
    }
    let labels = ["liquid: rounds", "liquid: steps", "liquid-online: rounds", "liquid-online: steps"];
    Series {
        name: "liquid_counts".into(),
        title: format!("rounds and steps, where both arrive: {}", names.join(", ")),
        x: "environment".into(),
        y: "count".into(),
        form: Form::Bars,
        lines: labels.map(str::to_owned).into_iter().zip(bars).collect(),
        discs: Vec::new(),
    }
}

fn sweep() -> Series {
    let runs = words::sweep_runs();
    let of = |count: fn(&Descent) -> usize| runs.iter().map(|(k_v, run)| [*k_v, count(run) as f64]).collect::<Vec<_>>();
    Series {
        name: "liquid_k_v".into(),
        title: "liquid_u_shallow: fewer virtual obstacles or a shorter path".into(),
        x: "K_v (m²)".into(),
        y: "count".into(),
        form: Form::Lines,
        lines: vec![
            ("virtual obstacles".into(), of(|run| run.virtual_obstacles.len())),
            ("steps".into(), of(Descent::steps)),
        ],
        discs: Vec::new(),
    }
}
