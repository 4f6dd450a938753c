//! `shoal bench planners`: the time of one plan, of every method, against how much there is around the robot.
//!
//! Every cell is a robot that really drives: to and fro between the corners of a square of obstacles, with neighbours
//! that keep around it. So a method that plans ahead pays when its robot gets a new goal, and follows in between.
//! Cells take turns in batches, each with a few plans that are not counted: what is measured is a warm plan. The longest
//! plan is one of all.

mod cell;
pub mod course;
mod text;

use crate::args::{BenchPlannersArgs, Format};
use crate::exit::{self, Failure};
use crate::out;
use crate::progress::Bar;
use crate::verbs::planners::find;
use bus::clock;
use cell::Cell;
use daemon::signals::Interrupted;
use planners::{METHODS, Method};
use serde::Serialize;

/// Neighbours and obstacles of the cells.
const NEIGHBORS: [usize; 4] = [0, 4, 16, 64];
const OBSTACLES: [usize; 2] = [10, 100];
/// Neighbours and obstacles of the cell that the targets are about.
const TARGET_CELL: (usize, usize) = (16, 20);
/// Plans of one cell before it is another one's turn.
const BATCH: u32 = 20;
/// Plans before each batch that are not counted.
const WARM_UP: u32 = 3;
/// A cell that has taken so long makes no more plans, s.
const CELL_S_MAX: f64 = 2.0;

/// What a method is to keep within in the target cell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Target {
    /// The median plan, us.
    MedianUs(f64),
    /// The longest plan, processor time, us: its slice of work takes less than half a period at 50 Hz.
    SliceUs(f64),
}

/// The target of a method. Those that plan ahead do so in slices, whose size is a parameter of theirs.
fn target(method: &str) -> Target {
    match method {
        "liquid" | "pso-via-points" => Target::SliceUs(10_000.0),
        "rpoa" => Target::MedianUs(25.0),
        _ => Target::MedianUs(10.0),
    }
}

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
    /// The longest, with whatever the machine did meanwhile.
    max_us: f64,
    /// The longest in time of the processor, for methods whose target is that.
    cpu_max_us: Option<f64>,
    /// The very first plan: what a method does once.
    first_us: f64,
}

/// A method against its target.
#[derive(Clone, Debug, Serialize)]
struct Verdict {
    planner: &'static str,
    neighbors: usize,
    obstacles: usize,
    target: Target,
    measured_us: f64,
    holds: bool,
}

impl Verdict {
    fn of(cell: &Measured) -> Option<Verdict> {
        let &Measured { planner, neighbors, obstacles, p50_us, cpu_max_us, .. } = cell;
        if (neighbors, obstacles) != TARGET_CELL {
            return None;
        }
        let target = target(planner);
        let (measured_us, limit_us) = match target {
            Target::MedianUs(limit_us) => (p50_us, limit_us),
            Target::SliceUs(limit_us) => (cpu_max_us?, limit_us),
        };
        Some(Verdict { planner, neighbors, obstacles, target, measured_us, holds: measured_us < limit_us })
    }
}

#[derive(Serialize)]
struct Document<'a> {
    schema: &'static str,
    /// What looking at the clock takes; subtracted.
    clock_ns: u64,
    cells: &'a [Measured],
    verdicts: &'a [Verdict],
    interrupted: bool,
}

pub(super) fn run(options: &BenchPlannersArgs) -> Result<i32, Failure> {
    let methods: Vec<&'static Method> = match options.names.as_slice() {
        [] => METHODS.to_vec(),
        names => names.iter().map(|name| find(name)).collect::<Result<_, _>>()?,
    };
    let interrupted = Interrupted::watch(exit::INTERRUPTED)?;
    let mut bar = Bar::new();
    let clock_ns = cost_of_the_clock();
    let mut cells: Vec<Cell> =
        methods.iter().flat_map(|method| places().map(|(n, obstacles)| Cell::new(method, n, obstacles))).collect();
    let mut made = 0;
    while made < options.plans && !interrupted.yes() {
        let batch = BATCH.min(options.plans - made);
        let places = cells.len() as u64;
        for (place, cell) in cells.iter_mut().enumerate() {
            let done = made as u64 * places + place as u64 * batch as u64;
            bar.at(done, options.plans as u64 * places, &format!("{made} of {} plans of every cell", options.plans));
            for i in 0..WARM_UP + batch {
                if cell.used_s() > CELL_S_MAX || interrupted.yes() {
                    break;
                }
                cell.plan(clock_ns, i >= WARM_UP);
            }
        }
        made += batch;
    }
    bar.finish();
    let measured: Vec<Measured> = cells.iter().filter_map(Cell::measured).collect();
    let verdicts: Vec<Verdict> = measured.iter().filter_map(Verdict::of).collect();
    match options.format {
        Format::Json => out::measured(&Document {
            schema: "shoal.bench-planners/1",
            clock_ns,
            cells: &measured,
            verdicts: &verdicts,
            interrupted: interrupted.yes(),
        })?,
        Format::Text => out::data(&text::render(&measured, &verdicts, out::stdout_width()))?,
    }
    Ok(if interrupted.yes() { exit::INTERRUPTED } else { exit::OK })
}

/// Neighbours and obstacles of every cell, in the order of the tables.
fn places() -> impl Iterator<Item = (usize, usize)> {
    OBSTACLES.into_iter().flat_map(|obstacles| NEIGHBORS.map(|n| (n, obstacles))).chain([TARGET_CELL])
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
