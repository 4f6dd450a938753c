//! Robots in a pattern: where each starts and where it goes. Every random number comes from the seed of the scenario
//! and the number of the robot, so adding robots moves no other, except where they have to make way (`random`).

use crate::files::Files;
use crate::ground::Surfaces;
use crate::map;
use crate::node::Node;
use crate::problems::Report;
use crate::table::{Layout, LayoutKind};
use crate::types::Interval;
use geometry::Capsule;
use model::Bounds;
use model::random::Stream;
use nalgebra::{Point2, Vector2};
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

/// A place of a random layout is given up after this many tries.
const TRIES_MAX: usize = 300;

/// What a random layout has to keep clear of.
pub(crate) struct Surroundings<'a> {
    pub(crate) world: Bounds,
    pub(crate) seed: u64,
    /// Radius of the robots to be placed.
    pub(crate) radius_m: f64,
    pub(crate) obstacles: &'a Surfaces,
    /// Other robots where they start.
    pub(crate) starts: &'a [Capsule],
    /// Other robots that drive about, at their last goals.
    pub(crate) goals: &'a [Capsule],
    /// The files that a layout may name.
    pub(crate) files: &'a dyn Files,
}

/// Start and goal of every robot of a layout; nothing if the layout cannot be placed, which has been reported then.
pub(crate) fn places(node: &Node, around: &Surroundings<'_>, report: &mut Report) -> Option<Vec<[Point2<f64>; 2]>> {
    let count = node.get(Layout::robots)?;
    let kind = node.get(Layout::kind)?;
    let center = node.get(Layout::center_m).coords;
    let places: Vec<[Point2<f64>; 2]> = match kind {
        LayoutKind::Random => return random(node, count, around, report),
        LayoutKind::CircleSwap | LayoutKind::Ring => {
            let (radius, phase) = (node.get(Layout::radius_m)?, node.get(Layout::phase_rad));
            let at = |i: usize, turn: f64| {
                let angle = phase + TAU * i as f64 / count as f64 + turn;
                Point2::from(center + Vector2::new(angle.cos(), angle.sin()) * radius)
            };
            if kind == LayoutKind::CircleSwap {
                (0..count).map(|i| [at(i, 0.0), at(i, PI)]).collect()
            } else {
                let shift = node.get(Layout::shift).unwrap_or((count / 2).max(1));
                if shift.is_multiple_of(count) && count > 1 {
                    let message = format!("{shift} places further round {count} is where each robot already is");
                    report.add(node.at(Layout::shift), &node.key(Layout::shift), message);
                    return None;
                }
                (0..count).map(|i| [at(i, 0.0), at(i + shift, 0.0)]).collect()
            }
        }
        LayoutKind::List => listed(node, count, report)?,
        LayoutKind::Scen => return of_scen(node, count, around, report),
        LayoutKind::Grid => {
            let spacing = node.get(Layout::spacing_m);
            let columns = node.get(Layout::columns).unwrap_or((count as f64).sqrt().ceil() as usize);
            let columns = columns.min(count).max(1);
            let rows = count.div_ceil(columns);
            let offset = Vector2::from(node.get(Layout::offset_m)?);
            let middle = Vector2::new((columns - 1) as f64, (rows - 1) as f64) / 2.0;
            let at = |i: usize| {
                let cell = Vector2::new((i % columns) as f64, (i / columns) as f64);
                Point2::from(center + (cell - middle) * spacing)
            };
            (0..count).map(|i| [at(i), at(i) + offset]).collect()
        }
        LayoutKind::Line => {
            let (spacing, gap) = (node.get(Layout::spacing_m), node.get(Layout::gap_m)?);
            let in_line = count.div_ceil(2);
            let at = |row: usize, side: f64| {
                let along = (row as f64 - (in_line - 1) as f64 / 2.0) * spacing;
                Point2::from(center + Vector2::new(side * gap / 2.0, along))
            };
            let place = |i: usize| {
                let side = if i.is_multiple_of(2) { -1.0 } else { 1.0 };
                [at(i / 2, side), at(i / 2, -side)]
            };
            (0..count).map(place).collect()
        }
    };
    let jitter = node.get(Layout::jitter_m);
    let shake = |(i, [start, goal]): (usize, [Point2<f64>; 2])| {
        let mut stream = Stream::new(around.seed, i as u32, 0, "layout");
        let (distance, angle) = (jitter * stream.unit().sqrt(), TAU * stream.unit());
        [start + Vector2::new(angle.cos(), angle.sin()) * distance, goal]
    };
    Some(places.into_iter().enumerate().map(shake).collect())
}

/// The first of the starts and goals that the file lists.
fn listed(node: &Node, count: usize, report: &mut Report) -> Option<Vec<[Point2<f64>; 2]>> {
    let (starts, goals) = (node.get(Layout::starts_m)?, node.get(Layout::goals_m)?); // missing or wrong, and reported
    if starts.len() != goals.len() {
        let message = format!("{} goals for {} starts", goals.len(), starts.len());
        report.add(node.at(Layout::goals_m), &node.key(Layout::goals_m), message);
        return None;
    }
    if count > starts.len() {
        let message = format!("{count} robots, but only {} are listed", starts.len());
        let hint = format!("at most {} robots, or more starts_m and goals_m", starts.len());
        report.add_hint(node.at(Layout::robots), &node.key(Layout::robots), message, hint);
        return None;
    }
    Some(starts.into_iter().zip(goals).take(count).map(|(start, goal)| [start, goal]).collect())
}

/// Starts and goals of the first problems of a file of the Moving AI lab.
fn of_scen(node: &Node, count: usize, around: &Surroundings<'_>, report: &mut Report) -> Option<Vec<[Point2<f64>; 2]>> {
    let path = node.get(Layout::scen)?; // missing or wrong, and reported
    let (at, key) = (node.at(Layout::scen), node.key(Layout::scen));
    let Some(raster) = around.obstacles.raster() else {
        let hint = "give the scenario [world] map = \"NAME.map\", whose problems are in the .scen";
        report.add_hint(at, &key, "its places are cells, and there is no map of cells", hint);
        return None;
    };
    match map::scen(&path, count, &raster, &map::Source::of(around.files, at)) {
        Ok(places) => Some(places),
        Err((message, hint)) => {
            report.add_hint(at, &key, message, hint);
            None
        }
    }
}

/// Starts and goals anywhere, with room round each: drawn again until they fit.
fn random(node: &Node, count: usize, around: &Surroundings<'_>, report: &mut Report) -> Option<Vec<[Point2<f64>; 2]>> {
    let Interval(x) = node.given(Layout::x_m).or(Interval(around.world.x_m))?;
    let Interval(y) = node.given(Layout::y_m).or(Interval(around.world.y_m))?;
    let (spread, distance_min) = (node.get(Layout::spread_m), node.get(Layout::goal_distance_m_min));
    let mut starts = Crowd::new(around.radius_m, spread, around.starts);
    let mut goals = Crowd::new(around.radius_m, spread, around.goals);
    let mut places: Vec<[Point2<f64>; 2]> = Vec::with_capacity(count);
    for i in 0..count {
        let mut stream = Stream::new(around.seed, i as u32, 0, "layout");
        let mut draw = |fits: &dyn Fn(Point2<f64>) -> bool| {
            (0..TRIES_MAX)
                .map(|_| Point2::new(stream.between(x[0], x[1]), stream.between(y[0], y[1])))
                .find(|p| around.obstacles.clearance_at_least(*p, around.radius_m + spread) && fits(*p))
        };
        let start = draw(&|p| starts.has_room(p));
        let goal =
            start.and_then(|start| draw(&|p| goals.has_room(p) && nalgebra::distance(&p, &start) >= distance_min));
        let (Some(start), Some(goal)) = (start, goal) else {
            let what = if start.is_none() { "start" } else { "goal" };
            let message = format!("no room for the {what} of robot {i} of {count} after {TRIES_MAX} tries");
            let hint = "fewer robots, a larger area (x_m, y_m), or a smaller spread_m or goal_distance_m_min";
            report.add_hint(node.at(Layout::robots), &node.path, message, hint);
            return None;
        };
        starts.add(start);
        goals.add(goal);
        places.push([start, goal]);
    }
    Some(places)
}

/// Discs of one radius that keep apart, in cells at least as wide as the distance that they keep; and a few other bodies.
struct Crowd<'a> {
    cell_m: f64,
    apart_m: f64,
    radius_m: f64,
    spread_m: f64,
    cells: HashMap<(i64, i64), Vec<Point2<f64>>>,
    others: &'a [Capsule],
}

impl<'a> Crowd<'a> {
    fn new(radius_m: f64, spread_m: f64, others: &'a [Capsule]) -> Crowd<'a> {
        let apart_m = 2.0 * radius_m + spread_m;
        Crowd { cell_m: apart_m.max(0.001), apart_m, radius_m, spread_m, cells: HashMap::new(), others }
    }

    fn cell(&self, p: Point2<f64>) -> (i64, i64) {
        ((p.x / self.cell_m).floor() as i64, (p.y / self.cell_m).floor() as i64)
    }

    fn has_room(&self, p: Point2<f64>) -> bool {
        let (x, y) = self.cell(p);
        let near = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| (x, y)));
        let mut near = near.filter_map(|cell| self.cells.get(&cell)).flatten();
        near.all(|q| nalgebra::distance(&p, q) >= self.apart_m)
            && (self.others.iter()).all(|other| {
                nalgebra::distance(&p, &other.nearest_core(p)) >= other.radius + self.radius_m + self.spread_m
            })
    }

    fn add(&mut self, p: Point2<f64>) {
        self.cells.entry(self.cell(p)).or_default().push(p);
    }
}
