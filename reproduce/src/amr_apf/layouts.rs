//! The paper's maps and jobs, as scenes.

use crate::scene::{Scene, scene};
use scenarios::Overrides;
use std::sync::LazyLock;

/// Radii with which the authors' programs plan, m: (robot, pillar). `late` is the program of 2025.
pub fn radii_m(late: bool) -> (f64, f64) {
    if late { (0.20, 0.17) } else { (0.22, 0.11) }
}

static CASE1: LazyLock<Vec<Scene>> = LazyLock::new(|| {
    let fleet = |robots| Overrides { robots: Some(robots), ..Overrides::default() };
    (1..=15).map(|robots| Scene::of_catalog("case 1", "amr-case1", &fleet(robots))).collect()
});

/// Case 1: twenty pillars in rows; the first `robots` of fifteen robots.
pub fn case1(robots: usize) -> Scene {
    CASE1[robots - 1].clone()
}

/// Case 2: twelve layouts of fifteen random pillars and eight robots, with the discs by which the authors closed gaps
/// that are too narrow, for all methods.
pub fn case2() -> Vec<Scene> {
    let layout = |i| {
        let name = format!("case 2 layout {i}");
        Scene::of_catalog(&name, &format!("amr-case2-{i:02}"), &Overrides::default())
    };
    (1..=12).map(layout).collect()
}

/// The layouts with 22 pillars that the authors also ran.
pub fn extra22() -> Vec<Scene> {
    let layout = |i| Scene { name: format!("extra layout {i}"), ..scene(&format!("amr_extra_{i:02}")).clone() };
    (1..=12).map(layout).collect()
}

/// The demonstrations of the paper's figures 4, 6, 7 and 8, exactly symmetrical as they are drawn.
pub fn demos() -> Vec<Scene> {
    let demo = |name| {
        let demo = scene(name).clone();
        Scene { name: demo.scenario.name.clone(), ..demo }
    };
    ["amr_demo_single", "amr_demo_head_on", "amr_demo_crossing", "amr_demo_gate"].map(demo).into()
}
