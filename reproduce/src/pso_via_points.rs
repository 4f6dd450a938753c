//! Via points optimised by a particle swarm: worked examples, every expectation of its scenes, the claims in words,
//! and the same method as a robot runs it.
//!
//! The paper prints lengths of its own environments, whose coordinates are only in its figures. The scenes here
//! are stand-ins, so the paper's values stand beside ours for their size; what is held to a tolerance is the
//! specification's reference implementation.
//!
//! Tolerances, from section 5 of the specification: all printed digits of worked examples; 0.1 m for raw lengths; ten
//! grid points; the reductions and clearances in its last paragraph. It gives none for the rest: resting places one step
//! of the raw path (0.05 m), clearances of raw paths and shares of free points 0.01, grid lengths the printed digits,
//! lengths that depend on random numbers 0.5 %, which is about the spread of the seeds, their reduction half a
//! percentage point, since 0.5 % of a length moves it that far, their clearance 0.01 m as in section 5. Where this was
//! written, everything that is not random agrees to all printed digits, except two counts by one or two points.
//!
//! Map of the folder: `experiment` how the scenes are run; `examples` the worked examples;
//! `expectations` the scenes; `claims` the claims in words; `fleet` the method as a robot runs it; `maps`
//! forces, potentials and free space over the plane; `series` the figures.

pub mod experiment;

mod claims;
mod examples;
mod expectations;
pub mod fleet;
mod maps;
mod series;

use crate::row::{Paper, Rows};
use crate::scene::scenes_of;
use scenarios::Expectation;
use std::ops::ControlFlow;

/// The paper.
pub static PAPER: Paper = Paper {
    name: "pso-via-points",
    citation: "F. A. Raheem, M. M. Badr, Smoothed artificial potential field (APF) via points path planning algorithm \
               based on PSO, Al-Yarmouk journal, about 2017",
    silence: "the coordinates of the paper's environments are only in its figures: its lengths are shown, not compared",
    differs: &[
        (
            "pso_mass_point_2 Right: seeds with a reduction of at least 5 %",
            "cannot hold: even the straight line, 11.336 m, is only 4.89 % shorter than the raw path of 11.918 m",
        ),
        (
            "600 random maps of 8 discs: arrivals of FadedBias",
            "the specification's maps are not given, and ours are drawn otherwise: the share depends on the kind of maps",
        ),
    ],
    rows,
    steps: 35,
    series: series::series,
};

fn rows(rows: &mut Rows<'_>) -> ControlFlow<()> {
    rows.begin("claims of the paper")?;
    claims::headlines(rows);
    rows.begin("worked examples")?;
    examples::rows(rows);
    for scene in scenes_of("pso_") {
        for expect in scene.expectations() {
            rows.about(
                "specification, section 4 and the scene's file",
                format!("scene {}: {}", scene.name, method(expect)),
                "the specification's: 0.1 m for raw lengths, ten grid points",
            );
            rows.begin(&format!("{} {}", scene.name, expect.method))?;
            expectations::rows(rows, scene, expect);
        }
    }
    claims::rows(rows)?;
    rows.begin("maps")?;
    maps::rows(rows);
    rows.begin("as a robot runs it")?;
    fleet::rows(rows);
    ControlFlow::Continue(())
}

/// What is run for an expectation, in words.
fn method(expect: &Expectation) -> String {
    let changes: Vec<String> = expect.params.iter().map(|(key, value)| format!("{key} = {value}")).collect();
    let changes = if changes.is_empty() { String::new() } else { format!(" with {}", changes.join(", ")) };
    let seeds = expect.seeds.map_or(String::new(), |seeds| format!("; seeds 0 to {}", seeds - 1));
    format!("{}{changes}, planner pso-via-points with the paper's gains{seeds}", expect.method)
}

/// Half of the sixth digit after the point, and a little for what lies on the half.
const PRINTED: f64 = 0.501e-6;
