//! Ways of a disc past many walls: a search over a lattice (A*), and the line that a taut string takes along what it found.
//!
//! The lattice covers the ground, and only what the search looks at is kept. Its cells are at most half as wide as the radius,
//! and are those of the map or an even part of them, so that the middle of a corridor of cells is among them. A step between two
//! cells keeps its distance from walls because both cells keep a little more (`Lattice::cell_keeps_m`); nothing else is asked
//! of a step. The search can stop after any number of steps and go on later, so that a robot need not think for longer than a
//! tick. A way is found wherever there is one that keeps this much room; it is as short as the string can make it, which
//! is mostly within a few percent of the shortest.

mod lattice;
mod string;

use crate::map::Map;
use lattice::{Lattice, Seen};
use nalgebra::{Point2, distance};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The lattices that are tried one after the other: how much more than the radius a way keeps from walls, as a share of it, and
/// how many cells the radius has.
const ATTEMPTS: [(f64, f64); 2] = [(0.03, 2.0), (0.002, 4.0)];
/// Rounding decides neither for nor against a line, as a share of the distance that it keeps.
const TOUCH: f64 = 1e-6;
/// A search that has looked at this many cells gives up.
const CELLS_MAX: usize = 1 << 24;
/// Cells in each direction from a start or a goal over which a way may come to the lattice.
const LINKS: i32 = 6;

/// Everything that stands: walls in one or more maps.
pub type Ground<'a> = &'a [&'a Map];

/// A way: the corners that come, the goal last, and how long it is from each of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// Corners, m; at least the goal.
    pub corners: Vec<Point2<f64>>,
    /// From each corner to the goal, m.
    pub left_m: Vec<f64>,
    /// What it keeps from walls, m, but near a start or a goal that are nearer to one.
    pub keeps_m: f64,
}

impl Route {
    fn new(corners: Vec<Point2<f64>>, keeps_m: f64) -> Route {
        let mut left_m = vec![0.0; corners.len()];
        for index in (1..corners.len()).rev() {
            left_m[index - 1] = left_m[index] + distance(&corners[index - 1], &corners[index]);
        }
        Route { corners, left_m, keeps_m }
    }

    /// How long it is for one who begins here, m.
    pub fn length_m(&self, from: Point2<f64>) -> f64 {
        distance(&from, &self.corners[0]) + self.left_m[0]
    }
}

/// What a search has come to.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    /// It is not done.
    Searching,
    /// There is a way.
    Found(Route),
    /// There is none, or none within the bounds of the search.
    None,
}

/// What a disc can keep from walls at a place: this much, or less where it is nearer to one, m.
pub fn keeps_at(ground: Ground<'_>, p: Point2<f64>, keeps_m: f64) -> f64 {
    ground.iter().fold(keeps_m, |keeps, map| map.distance(p, keeps)) * (1.0 - TOUCH)
}

/// Whether a disc that keeps this distance (m) gets straight from one point to the other.
pub fn is_open(ground: Ground<'_>, line: [Point2<f64>; 2], keeps_m: f64) -> bool {
    !ground.iter().any(|map| map.blocks(line, keeps_m))
}

/// A search for a way of a disc from one place to another.
pub struct Search {
    radius_m: f64,
    from: Point2<f64>,
    goal: Point2<f64>,
    attempt: usize,
    run: Option<Run>,
}

/// A search on one lattice.
struct Run {
    lattice: Lattice,
    seen: Seen,
    queue: BinaryHeap<Reverse<Step>>,
    /// Cells from which the goal can be reached in a line, and how far it is, m.
    ends: Vec<(u32, f32)>,
    /// The shortest way to the goal so far, m, and its last cell.
    best: Option<(f32, u32)>,
    steps: usize,
}

/// A cell to look at: length of the way over it at least, as bits that sort as the length does; then the longest way so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Step {
    whole: u32,
    to_come: u32,
    cell: u32,
}

/// The eight directions, and whether each is a diagonal.
const AROUND: [([i32; 2], bool); 8] = [
    ([1, 0], false),
    ([0, 1], false),
    ([-1, 0], false),
    ([0, -1], false),
    ([1, 1], true),
    ([-1, 1], true),
    ([-1, -1], true),
    ([1, -1], true),
];

impl Search {
    /// A search that has not begun.
    pub fn new(radius_m: f64, from: Point2<f64>, goal: Point2<f64>) -> Search {
        Search { radius_m, from, goal, attempt: 0, run: None }
    }

    /// Where it leads, m.
    pub fn goal(&self) -> Point2<f64> {
        self.goal
    }

    /// Goes on for at most this many steps. The ground must be the same each time.
    pub fn go_on(&mut self, ground: Ground<'_>, mut steps: usize) -> Progress {
        while let Some((margin, cells)) = ATTEMPTS.get(self.attempt) {
            let keeps_m = self.radius_m * (1.0 + margin);
            let run = match &mut self.run {
                Some(run) => run,
                None => {
                    if self.is_straight(ground, keeps_m) {
                        return Progress::Found(Route::new(vec![self.goal], keeps_m));
                    }
                    let lattice = Lattice::new(ground, keeps_m, self.radius_m / cells, [self.from, self.goal]);
                    self.run.insert(Run::new(lattice, ground, self.from, self.goal))
                }
            };
            match run.go_on(ground, self.goal, &mut steps) {
                None => return Progress::Searching,
                Some(Some(last)) => {
                    let cells = run.path(last);
                    let line = string::pull(ground, self.from, &cells, self.goal, keeps_m);
                    return Progress::Found(Route::new(line, keeps_m));
                }
                Some(None) => (self.attempt, self.run) = (self.attempt + 1, None),
            }
        }
        Progress::None
    }

    fn is_straight(&self, ground: Ground<'_>, keeps_m: f64) -> bool {
        let keeps_m = keeps_at(ground, self.from, keeps_m).min(keeps_at(ground, self.goal, keeps_m));
        is_open(ground, [self.from, self.goal], keeps_m)
    }
}

impl Run {
    fn new(lattice: Lattice, ground: Ground<'_>, from: Point2<f64>, goal: Point2<f64>) -> Run {
        let seen = Seen::new(&lattice);
        let mut run = Run { lattice, seen, queue: BinaryHeap::new(), ends: Vec::new(), best: None, steps: 0 };
        run.ends = run.links(ground, goal);
        run.ends.sort_unstable_by_key(|(cell, _)| *cell);
        for (cell, length) in run.links(ground, from) {
            run.seen.lengthen(cell, length, None);
            run.push(cell, length, goal);
        }
        run
    }

    /// The cells from which a place can be reached in a line, and how far they are, m.
    fn links(&self, ground: Ground<'_>, p: Point2<f64>) -> Vec<(u32, f32)> {
        let keeps_m = keeps_at(ground, p, self.lattice.keeps_m);
        let [column, row] = self.lattice.cell_of(p);
        let near = (-LINKS..=LINKS).flat_map(|y| (-LINKS..=LINKS).map(move |x| [column + x, row + y]));
        let cells = near.filter_map(|place| Some((self.lattice.cell(place)?, self.lattice.at(place))));
        let open = cells.filter(|(_, at)| {
            !ground.iter().any(|map| map.is_near(*at, self.lattice.cell_keeps_m)) && is_open(ground, [p, *at], keeps_m)
        });
        open.map(|(cell, at)| (cell, distance(&p, &at) as f32)).collect()
    }

    fn push(&mut self, cell: u32, length: f32, goal: Point2<f64>) {
        let whole = length + self.lattice.ahead_m(cell, goal);
        // Of two that promise as much the one that has come further goes first.
        self.queue.push(Reverse(Step { whole: whole.to_bits(), to_come: !length.to_bits(), cell }));
    }

    /// The last cell of the shortest way, or that there is none; nothing if the steps are used up before.
    fn go_on(&mut self, ground: Ground<'_>, goal: Point2<f64>, steps: &mut usize) -> Option<Option<u32>> {
        loop {
            let Some(Reverse(Step { whole, cell, .. })) = self.queue.peek().copied() else {
                return Some(self.best.map(|(_, cell)| cell));
            };
            if let Some((best, last)) = self.best.filter(|(best, _)| *best <= f32::from_bits(whole)) {
                debug_assert!(best.is_finite());
                return Some(Some(last));
            }
            if *steps == 0 {
                return None;
            }
            if self.steps >= CELLS_MAX {
                return Some(self.best.map(|(_, cell)| cell));
            }
            self.queue.pop();
            if self.seen.close(cell) {
                continue;
            }
            (*steps, self.steps) = (*steps - 1, self.steps + 1);
            let length = self.seen.length(cell);
            if let Ok(index) = self.ends.binary_search_by_key(&cell, |(end, _)| *end) {
                let all = length + self.ends[index].1;
                if self.best.is_none_or(|(best, _)| all < best) {
                    self.best = Some((all, cell));
                }
            }
            let [column, row] = self.lattice.place(cell);
            for (direction, ([x, y], is_diagonal)) in AROUND.iter().enumerate() {
                let place = [column + x, row + y];
                let Some(next) = self.lattice.cell(place) else { continue };
                let further = length + self.lattice.step_m(*is_diagonal);
                if further >= self.seen.length(next) {
                    continue;
                }
                let keeps_m = self.lattice.cell_keeps_m;
                let lattice = &self.lattice;
                let is_free = || !ground.iter().any(|map| map.is_near(lattice.at(place), keeps_m));
                if self.seen.is_free(next, is_free) {
                    self.seen.lengthen(next, further, Some(direction as u8));
                    self.push(next, further, goal);
                }
            }
        }
    }

    /// The places of the cells of a way, from its first to this one, m.
    fn path(&self, last: u32) -> Vec<Point2<f64>> {
        let (mut cells, mut place) = (Vec::new(), self.lattice.place(last));
        loop {
            cells.push(self.lattice.at(place));
            let came = self.lattice.cell(place).and_then(|cell| self.seen.came(cell));
            let Some(([x, y], _)) = came.map(|direction| AROUND[usize::from(direction)]) else { break };
            place = [place[0] - x, place[1] - y];
        }
        cells.reverse();
        cells
    }
}
