//! `shoal bench planners`: the time of one plan, of every method, against how much there is around the robot.
//!
//! Every cell is a robot that really drives: to and fro between the corners of a square of obstacles, with neighbours
//! that keep around it. So a method that plans ahead pays when its robot gets a new goal, and follows in between.

use crate::cli::{BenchPlannersArgs, Format};
use crate::exit::{self, Failure};
use crate::out;
use crate::progress::Live;
use crate::report::{Column, Page, table};
use crate::signals::Interrupted;
use crate::verbs::planners::find;
use bus::clock;
use nalgebra::{Point2, Vector2};
use planners::random::Stream;
use planners::{Capsule, Drive, Identity, Kind, Limits, METHODS, Method, Neighbor, Obstacle, PlanInput, Planner};
use serde::Serialize;

/// Neighbours and obstacles of the cells.
const NEIGHBORS: [usize; 4] = [0, 4, 16, 64];
const OBSTACLES: [usize; 2] = [10, 100];
/// Plans of one cell before it is another one's turn.
const TURN: u32 = 20;
/// A cell that has taken so long makes no more plans, s.
const CELL_S_MAX: f64 = 2.0;
const DT_S: f64 = 0.05;
/// Half the side of the square, m.
const HALF_M: f64 = 9.0;
/// Who has not arrived after so many ticks gets its next goal all the same.
const TICKS_PER_GOAL_MAX: u32 = 1000;
const LIMITS: Limits = Limits {
    speed_mps_max: 1.0,
    reverse_mps_max: 0.0,
    turn_radps_max: 2.0,
    accel_mps2_max: f64::INFINITY,
    turn_accel_radps2_max: f64::INFINITY,
};

/// What was measured of one cell, us.
#[derive(Clone, Debug, Serialize)]
struct Measured {
    planner: &'static str,
    neighbors: usize,
    obstacles: usize,
    /// How many plans were timed.
    plans: usize,
    p50_us: f64,
    p99_us: f64,
    max_us: f64,
    /// The very first plan: what a method does once.
    first_us: f64,
}

#[derive(Serialize)]
struct Document<'a> {
    schema: &'static str,
    /// What looking at the clock takes; subtracted.
    clock_ns: u64,
    cells: &'a [Measured],
    interrupted: bool,
}

pub(super) fn run(options: &BenchPlannersArgs) -> Result<i32, Failure> {
    let methods: Vec<&'static Method> = match options.names.as_slice() {
        [] => METHODS.to_vec(),
        names => names.iter().map(|name| find(name)).collect::<Result<_, _>>()?,
    };
    let interrupted = Interrupted::watch()?;
    let mut live = Live::new();
    let clock_ns = cost_of_the_clock();
    let mut cells: Vec<Cell> = methods
        .into_iter()
        .flat_map(|method| {
            OBSTACLES.map(|obstacles| NEIGHBORS.map(|n| Cell::new(method, n, obstacles))).into_iter().flatten()
        })
        .collect();
    let mut made = 0;
    while made < options.plans && !interrupted.yes() {
        live.say(&format!("{made} of {} plans of every cell", options.plans));
        let turn = TURN.min(options.plans - made);
        for cell in &mut cells {
            for _ in 0..turn {
                if cell.used_ns as f64 * 1e-9 > CELL_S_MAX || interrupted.yes() {
                    break;
                }
                cell.plan(clock_ns);
            }
        }
        made += turn;
    }
    live.finish();
    let measured: Vec<Measured> = cells.iter().filter_map(Cell::measured).collect();
    match options.format {
        Format::Json => out::json(&Document {
            schema: "shoal.bench-planners/1",
            clock_ns,
            cells: &measured,
            interrupted: interrupted.yes(),
        })?,
        Format::Text => out::data(&text(&measured, out::stdout_width()))?,
    }
    Ok(if interrupted.yes() { exit::INTERRUPTED } else { exit::OK })
}

/// The median time between two looks at the clock, ns.
fn cost_of_the_clock() -> u64 {
    let mut costs: Vec<u64> = (0..1001)
        .map(|_| {
            let before = clock::now_ns();
            clock::now_ns() - before
        })
        .collect();
    costs.sort_unstable();
    costs[costs.len() / 2]
}

/// A method at work in one world.
struct Cell {
    method: &'static Method,
    planner: Box<dyn Planner>,
    kind: Kind,
    obstacles: Vec<Obstacle>,
    neighbors: Vec<Neighbor>,
    /// Where the neighbours are, seen from the robot, and how they go round it, rad/s.
    places: Vec<(f64, f64, f64)>,
    position: Point2<f64>,
    yaw_rad: f64,
    velocity: Vector2<f64>,
    goal: Point2<f64>,
    since_goal: u32,
    tick: u64,
    took_ns: Vec<u64>,
    used_ns: u64,
}

impl Cell {
    fn new(method: &'static Method, neighbors: usize, obstacles: usize) -> Cell {
        let identity = Identity { seed: 1, robot: 0, incarnation: 0 };
        let planner = (method.build)(&planners::ParamValues::new(), identity);
        let planner = planner.unwrap_or_else(|problem| panic!("{}: defaults fit: {problem}", method.name));
        let mut random = Stream::new(1, obstacles as u32, 0, "bench-obstacles");
        let corners = [[-1.0, -1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, 1.0]].map(|[x, y]| Point2::new(x, y) * HALF_M);
        let mut discs: Vec<Point2<f64>> = Vec::new();
        while discs.len() < obstacles {
            let at = Point2::new(random.between(-HALF_M, HALF_M), random.between(-HALF_M, HALF_M));
            let free = |other: &Point2<f64>, room: f64| (at - other).norm() > room;
            if corners.iter().all(|corner| free(corner, 2.0)) && discs.iter().all(|disc| free(disc, 1.2)) {
                discs.push(at);
            }
        }
        let obstacle = |(center, id): (Point2<f64>, u32)| Obstacle {
            id,
            shape: Capsule::disc(center, 0.15),
            velocity: Vector2::zeros(),
        };
        let mut random = Stream::new(1, neighbors as u32, 0, "bench-neighbours");
        let places = (0..neighbors)
            .map(|_| (random.between(1.0, 5.0), random.between(0.0, std::f64::consts::TAU), random.between(-0.3, 0.3)))
            .collect();
        Cell {
            method,
            planner,
            kind: method.kinds[0],
            obstacles: discs.into_iter().zip(0..).map(obstacle).collect(),
            neighbors: Vec::with_capacity(neighbors),
            places,
            position: corners[0],
            yaw_rad: std::f64::consts::FRAC_PI_4,
            velocity: Vector2::zeros(),
            goal: corners[1],
            since_goal: 0,
            tick: 0,
            took_ns: Vec::new(),
            used_ns: 0,
        }
    }

    /// Plans a tick, and drives.
    fn plan(&mut self, clock_ns: u64) {
        self.gather_neighbors();
        let input = PlanInput {
            tick: self.tick,
            dt_s: DT_S,
            position: self.position,
            yaw_rad: self.yaw_rad,
            velocity: self.velocity,
            radius_m: 0.2,
            kind: self.kind,
            limits: LIMITS,
            goal: self.goal,
            goal_tolerance_m: 0.2,
            arrived: false,
            obstacles: &self.obstacles,
            neighbors: &self.neighbors,
            map: &self.obstacles,
            arm: None,
        };
        let before = clock::now_ns();
        let plan = std::hint::black_box(self.planner.plan(std::hint::black_box(&input)));
        let took_ns = (clock::now_ns() - before).saturating_sub(clock_ns);
        self.took_ns.push(took_ns);
        self.used_ns += took_ns;
        self.drive(plan.drive.within(&LIMITS));
    }

    fn gather_neighbors(&mut self) {
        let time_s = self.tick as f64 * DT_S;
        self.neighbors.clear();
        self.neighbors.extend(self.places.iter().zip(1..).map(|(&(distance, angle, turn), id)| {
            let (sin, cos) = (angle + turn * time_s).sin_cos();
            let along = Vector2::new(-sin, cos) * (distance * turn);
            Neighbor {
                id,
                position: self.position + Vector2::new(cos, sin) * distance,
                yaw_rad: along.y.atan2(along.x),
                velocity: self.velocity + along,
                radius_m: 0.2,
                age_s: DT_S,
                remaining_m: 5.0 + distance,
                arrived: id % 8 == 0,
                stopped: false,
            }
        }));
    }

    fn drive(&mut self, drive: Drive) {
        match drive {
            Drive::Velocity(velocity) => self.velocity = velocity,
            Drive::Twist { speed_mps, turn_radps } => {
                self.yaw_rad += turn_radps * DT_S;
                self.velocity = Vector2::new(self.yaw_rad.cos(), self.yaw_rad.sin()) * speed_mps;
            }
            Drive::Joints { .. } => {}
        }
        self.position += self.velocity * DT_S;
        self.tick += 1;
        self.since_goal += 1;
        if (self.goal - self.position).norm() < 0.2 || self.since_goal >= TICKS_PER_GOAL_MAX {
            // From corner to corner: across, along, across, along.
            self.goal = Point2::new(self.goal.y, -self.goal.x);
            self.since_goal = 0;
        }
    }

    fn measured(&self) -> Option<Measured> {
        let mut sorted = self.took_ns.clone();
        sorted.sort_unstable();
        let us = |ns: u64| ns as f64 * 1e-3;
        let at = |share: f64| Some(us(*sorted.get(((sorted.len().checked_sub(1)?) as f64 * share).round() as usize)?));
        Some(Measured {
            planner: self.method.name,
            neighbors: self.neighbors.len(),
            obstacles: self.obstacles.len(),
            plans: sorted.len(),
            p50_us: at(0.5)?,
            p99_us: at(0.99)?,
            max_us: at(1.0)?,
            first_us: us(*self.took_ns.first()?),
        })
    }
}

/// What a table shows of a cell.
type Figure = fn(&Measured) -> f64;

fn text(cells: &[Measured], width: usize) -> String {
    let mut page = Page::new(width);
    let mut names: Vec<&str> = cells.iter().map(|cell| cell.planner).collect();
    names.dedup();
    let most = cells.iter().map(|cell| cell.plans).max().unwrap_or(0);
    let columns = [
        Column::left("method", 0, 24),
        Column::right("10 | 0", 0),
        Column::right("4", 0),
        Column::right("16", 0),
        Column::right("64", 0),
        Column::right("100 | 0", 0),
        Column::right("4", 0),
        Column::right("16", 0),
        Column::right("64", 0),
    ];
    let figures: [(&str, Figure); 2] = [
        ("median time of a plan, us; by obstacles | neighbours", |cell| cell.p50_us),
        ("99 of 100 plans take at most, us", |cell| cell.p99_us),
    ];
    for (title, figure) in figures {
        page.words(title, 0);
        let rows: Vec<Vec<String>> = (names.iter())
            .map(|name| {
                let own = cells.iter().filter(|cell| cell.planner == *name);
                let mut row: Vec<String> =
                    std::iter::once((*name).to_owned()).chain(own.map(|c| short(figure(c)))).collect();
                row.resize(columns.len(), "-".to_owned());
                row
            })
            .collect();
        table(&columns, &rows, 2, page.width()).iter().for_each(|line| page.line(line));
        page.gap();
    }
    let build = if cfg!(debug_assertions) { " This is a debug build: a release build is faster." } else { "" };
    page.words(&format!("{most} plans a cell.{build}"), 0);
    for name in names {
        let own = || cells.iter().filter(|cell| cell.planner == name);
        let fewest = own().map(|cell| cell.plans).min().unwrap_or(0);
        if fewest < most {
            page.words(&format!("{name}: {fewest} at least; it ran for {CELL_S_MAX} s a cell."), 2);
        }
        let longest = own().map(|cell| cell.max_us).fold(0.0, f64::max);
        let usual = own().map(|cell| cell.p99_us).fold(0.0, f64::max);
        if longest > 10_000.0 && longest > 10.0 * usual {
            page.words(&format!("{name}: some plans take up to {:.0} ms.", longest * 1e-3), 2);
        }
    }
    page.into_text()
}

/// Three digits.
fn short(us: f64) -> String {
    match us {
        us if us >= 99.95 => format!("{us:.0}"),
        us if us >= 9.995 => format!("{us:.1}"),
        us => format!("{us:.2}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_drives_in_every_cell() {
        for method in METHODS {
            let mut cell = Cell::new(method, 4, 10);
            let start = cell.position;
            (0..30).for_each(|_| cell.plan(0));
            assert!(cell.position.x.is_finite() && (cell.position - start).norm() > 0.1, "{}", method.name);
            assert_eq!(cell.measured().map(|measured| measured.plans), Some(30));
        }
    }

    #[test]
    fn the_tables_fit_the_terminal() {
        let cells: Vec<Measured> = METHODS
            .iter()
            .flat_map(|method| OBSTACLES.map(|o| NEIGHBORS.map(|n| (method, n, o))).into_iter().flatten())
            .map(|(method, neighbors, obstacles)| Measured {
                planner: method.name,
                neighbors,
                obstacles,
                plans: 3000,
                p50_us: 0.25,
                p99_us: 1234.5,
                max_us: 50_000.0,
                first_us: 10.0,
            })
            .collect();
        let text = text(&cells, 80);
        assert!(text.lines().all(|line| line.chars().count() <= 80 && !line.contains('…')), "{text}");
        assert!(METHODS.iter().all(|method| text.contains(method.name)), "{text}");
    }
}
