//! Where the paper's robots start, where they go, and where the pillars stand.

use nalgebra::Point2;
use serde::Deserialize;
use std::sync::LazyLock;

/// One robot's job.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Job {
    /// Where it starts, m.
    pub start: Point2<f64>,
    /// How it is turned there, rad.
    pub heading_rad: f64,
    /// Where it goes, m.
    pub goal: Point2<f64>,
}

/// A map with jobs.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// Short name.
    pub name: String,
    /// Corner opposite the origin, m.
    pub size_m: Point2<f64>,
    /// Centres of the pillars, m. Those of case 2 include the extra ones in gaps that are too narrow, which the authors
    /// added for all methods.
    pub pillars: Vec<Point2<f64>>,
    /// How many of them really stand there: the others, at the end of the list, close gaps.
    pub real_pillars: usize,
    /// The jobs.
    pub jobs: Vec<Job>,
}

/// Radii with which the authors' programs plan, m: (robot, pillar). `late` is the program of 2025.
pub fn radii_m(late: bool) -> (f64, f64) {
    if late { (0.20, 0.17) } else { (0.22, 0.11) }
}

#[derive(Deserialize)]
struct Case1 {
    world_m: [f64; 4],
    obstacles: Vec<Point2<f64>>,
    initial_heading_rad: f64,
    robots: Vec<Task>,
    demos: Vec<Demo>,
}

#[derive(Deserialize)]
struct Task {
    start: Point2<f64>,
    goal: Point2<f64>,
    heading: Option<f64>,
}

#[derive(Deserialize)]
struct Demo {
    name: String,
    obstacles: Vec<Point2<f64>>,
    robots: Vec<Task>,
}

#[derive(Deserialize)]
struct Case2 {
    world_m: [f64; 4],
    initial_heading_rad: f64,
    layouts: Vec<Case2Layout>,
}

#[derive(Deserialize)]
struct Case2Layout {
    layout: usize,
    obstacles: Vec<Point2<f64>>,
    virtual_obstacles: Vec<Gap>,
    robots: Vec<Task>,
}

#[derive(Deserialize)]
struct Gap {
    centre: Point2<f64>,
    #[serde(rename = "in_1.65_rule")]
    closed: bool,
}

static CASE1: LazyLock<Case1> = LazyLock::new(|| {
    serde_json::from_str(include_str!("../../data/amr-apf-case1.json")).expect("the data file has this form")
});

fn job(task: &Task, heading_rad: f64) -> Job {
    Job { start: task.start, heading_rad: task.heading.unwrap_or(heading_rad), goal: task.goal }
}

/// Case 1: twenty pillars in rows; the first `robots` of fifteen robots.
pub fn case1(robots: usize) -> Layout {
    let data = &*CASE1;
    Layout {
        name: "case 1".to_owned(),
        size_m: Point2::new(data.world_m[2], data.world_m[3]),
        pillars: data.obstacles.clone(),
        real_pillars: data.obstacles.len(),
        jobs: data.robots[..robots].iter().map(|task| job(task, data.initial_heading_rad)).collect(),
    }
}

/// Case 2: twelve layouts of fifteen random pillars and eight robots.
pub fn case2() -> Vec<Layout> {
    read_random(include_str!("../../data/amr-apf-case2-o15.json"), "case 2 layout")
}

/// The layouts with 22 pillars that the authors also ran.
pub fn extra22() -> Vec<Layout> {
    read_random(include_str!("../../data/amr-apf-o22.json"), "extra layout")
}

fn read_random(text: &str, name: &str) -> Vec<Layout> {
    let data: Case2 = serde_json::from_str(text).expect("the data file has this form");
    let layout = |layout: &Case2Layout| {
        let gaps = layout.virtual_obstacles.iter().filter(|gap| gap.closed).map(|gap| gap.centre);
        Layout {
            name: format!("{name} {}", layout.layout),
            size_m: Point2::new(data.world_m[2], data.world_m[3]),
            pillars: layout.obstacles.iter().copied().chain(gaps).collect(),
            real_pillars: layout.obstacles.len(),
            jobs: layout.robots.iter().map(|task| job(task, data.initial_heading_rad)).collect(),
        }
    };
    data.layouts.iter().map(layout).collect()
}

/// The demonstrations of the paper's figures 4, 6, 7 and 8, exactly symmetrical as they are drawn.
pub fn demos() -> Vec<Layout> {
    let data = &*CASE1;
    let demo = |demo: &Demo| Layout {
        name: demo.name.clone(),
        size_m: Point2::new(4.9, 4.9),
        pillars: demo.obstacles.clone(),
        real_pillars: demo.obstacles.len(),
        jobs: demo.robots.iter().map(|task| job(task, 0.0)).collect(),
    };
    data.demos.iter().map(demo).collect()
}
