//! Which tip positions are free, on a grid, and the shortest way over it.

use super::{ArmGeometry, Elbow, Room};
use crate::shapes::Capsule;
use nalgebra::{Point2, Vector2};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f64::consts::PI;

/// Most points along one side of a grid; the spacing grows beyond the wanted one when the arm reaches further.
const GRID_SIDE_MAX: usize = 401;

/// The sheets in which each tip position of a square grid around the base is free.
#[derive(Clone, Debug, Default)]
pub struct FreeSpace {
    base: Point2<f64>,
    /// Points along one side; odd, so that the base is one of them.
    side: usize,
    spacing_m: f64,
    /// [`Elbow::bit`]s by point, row by row.
    sheets: Vec<u8>,
    /// Joint 1 by point, for each sheet: whether a stop lies between two points.
    joint1_rad: [Vec<f64>; 2],
    /// Points classified so far.
    done: usize,
}

impl FreeSpace {
    /// Starts anew with every point unknown. Memory is kept.
    pub fn begin(&mut self, geometry: &ArmGeometry, spacing_m: f64) {
        let reach = geometry.links_m[0] + geometry.links_m[1];
        self.base = geometry.base;
        self.spacing_m = spacing_m.max(reach / (GRID_SIDE_MAX / 2) as f64);
        // Sums of links do not come out as whole numbers of spacings: the last row is not lost to that.
        let half = (reach / self.spacing_m - 1e-9).ceil().max(1.0) as usize;
        self.side = 2 * half + 1;
        let points = self.side * self.side;
        self.sheets.clear();
        self.sheets.resize(points, 0);
        for joint1 in &mut self.joint1_rad {
            joint1.clear();
            joint1.resize(points, 0.0);
        }
        self.done = 0;
    }

    /// Classifies up to `points` more points; true when all are done.
    pub fn advance(&mut self, geometry: &ArmGeometry, obstacles: &[Capsule], room: Room, points: usize) -> bool {
        let end = self.sheets.len().min(self.done.saturating_add(points));
        for i in self.done..end {
            let tip = self.point(i);
            for (sheet, elbow) in Elbow::BOTH.into_iter().enumerate() {
                if let Some(joints) = geometry.free_pose(tip, elbow, obstacles.iter().copied(), room) {
                    self.sheets[i] |= elbow.bit();
                    self.joint1_rad[sheet][i] = joints[0];
                }
            }
        }
        self.done = end;
        end == self.sheets.len()
    }

    /// The whole grid at once.
    pub fn of(geometry: &ArmGeometry, obstacles: &[Capsule], spacing_m: f64, room: Room) -> FreeSpace {
        let mut space = FreeSpace::default();
        space.begin(geometry, spacing_m);
        space.advance(geometry, obstacles, room, usize::MAX);
        space
    }

    /// Points in the grid.
    pub fn len(&self) -> usize {
        self.sheets.len()
    }

    /// Whether there is no grid yet.
    pub fn is_empty(&self) -> bool {
        self.sheets.is_empty()
    }

    /// How many points are free in each of these sheets: `[up, down, both, union]`.
    pub fn counts(&self) -> [usize; 4] {
        let count = |fits: fn(u8) -> bool| self.sheets.iter().filter(|sheets| fits(**sheets)).count();
        [count(|s| s & 1 != 0), count(|s| s & 2 != 0), count(|s| s == 3), count(|s| s != 0)]
    }

    /// Every point, and whether it is free with the elbow up and with the elbow down.
    pub fn points(&self) -> impl Iterator<Item = (Point2<f64>, [bool; 2])> {
        let free = |sheets: u8| Elbow::BOTH.map(|elbow| sheets & elbow.bit() != 0);
        self.sheets.iter().enumerate().map(move |(i, sheets)| (self.point(i), free(*sheets)))
    }

    /// Place of a point.
    fn point(&self, index: usize) -> Point2<f64> {
        let half = (self.side / 2) as f64;
        let offset = Vector2::new((index % self.side) as f64 - half, (index / self.side) as f64 - half);
        self.base + offset * self.spacing_m
    }

    /// The point nearest to a place, if the place is on the grid.
    fn nearest(&self, place: Point2<f64>) -> Option<usize> {
        let half = (self.side / 2) as f64;
        let cell = ((place - self.base) / self.spacing_m).map(|x| x.round() + half);
        let on = |x: f64| x >= 0.0 && x < self.side as f64;
        (on(cell.x) && on(cell.y)).then(|| cell.y as usize * self.side + cell.x as usize)
    }
}

/// Where a grid path may go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Through {
    /// Within one sheet, as if joint 1 could turn for ever.
    Sheet(Elbow),
    /// Within one sheet, and never from one stop of joint 1 to the other: what an arm can do.
    SheetWithStops(Elbow),
    /// Through points that are free in either sheet. Shorter than what an arm can do: for comparison only.
    Union,
}

/// Steps to the eight neighbours of a point: columns, rows.
const STEPS: [(isize, isize); 8] = [(1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1)];

/// Dijkstra's search for the shortest 8-connected path over the free points, in as many pieces as one likes. Corners
/// may be cut: a diagonal step asks only for its two ends.
#[derive(Clone, Debug, Default)]
pub struct GridSearch {
    /// Length so far by point, in steps and diagonals: exact, so that no rounding decides between equal ways.
    length: Vec<u64>,
    parent: Vec<u32>,
    open: BinaryHeap<Reverse<(u64, u32)>>,
    start: u32,
    goal: u32,
}

/// What a piece of a search came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// Not at the end yet.
    NotYet,
    /// The goal has been reached.
    Path,
    /// There is no path.
    Nothing,
}

/// One step, in the unit of [`GridSearch::length`], and one diagonal step.
const STRAIGHT: u64 = 1_000_000_000;
const DIAGONAL: u64 = 1_414_213_562;

impl GridSearch {
    /// Starts a search between the grid points nearest to two places. Memory is kept.
    pub fn begin(&mut self, space: &FreeSpace, start: Point2<f64>, goal: Point2<f64>, through: Through) -> Found {
        self.length.clear();
        self.length.resize(space.len(), u64::MAX);
        self.parent.clear();
        self.parent.resize(space.len(), u32::MAX);
        self.open.clear();
        let (Some(start), Some(goal)) = (space.nearest(start), space.nearest(goal)) else { return Found::Nothing };
        if !through.open(space, start) || !through.open(space, goal) {
            return Found::Nothing;
        }
        (self.start, self.goal) = (start as u32, goal as u32);
        self.length[start] = 0;
        self.open.push(Reverse((0, self.start)));
        Found::NotYet
    }

    /// Settles up to `points` more points.
    pub fn advance(&mut self, space: &FreeSpace, through: Through, points: usize) -> Found {
        for _ in 0..points {
            let Some(Reverse((length, at))) = self.open.pop() else { return Found::Nothing };
            if at == self.goal {
                return Found::Path;
            }
            let here = at as usize;
            if length > self.length[here] {
                continue;
            }
            let (column, row) = ((here % space.side) as isize, (here / space.side) as isize);
            for (dx, dy) in STEPS {
                let (x, y) = (column + dx, row + dy);
                let side = space.side as isize;
                if x < 0 || y < 0 || x >= side || y >= side {
                    continue;
                }
                let there = (y * side + x) as usize;
                let longer = length + if dx != 0 && dy != 0 { DIAGONAL } else { STRAIGHT };
                if longer < self.length[there] && through.step(space, here, there) {
                    self.length[there] = longer;
                    self.parent[there] = at;
                    self.open.push(Reverse((longer, there as u32)));
                }
            }
        }
        Found::NotYet
    }

    /// Length of the path that was found, m.
    pub fn length_m(&self, space: &FreeSpace) -> f64 {
        let (mut at, mut straight, mut diagonal) = (self.goal as usize, 0u32, 0u32);
        while at != self.start as usize {
            let from = self.parent[at] as usize;
            let apart = from.abs_diff(at);
            *if apart == 1 || apart == space.side { &mut straight } else { &mut diagonal } += 1;
            at = from;
        }
        (f64::from(straight) + f64::from(diagonal) * std::f64::consts::SQRT_2) * space.spacing_m
    }

    /// The grid points of the path that was found, from start to goal, at the end of `path`.
    pub fn path(&self, space: &FreeSpace, path: &mut Vec<Point2<f64>>) {
        let (first, mut at) = (path.len(), self.goal as usize);
        path.push(space.point(at));
        while at != self.start as usize {
            at = self.parent[at] as usize;
            path.push(space.point(at));
        }
        path[first..].reverse();
    }
}

impl Through {
    fn open(self, space: &FreeSpace, point: usize) -> bool {
        match self {
            Through::Sheet(elbow) | Through::SheetWithStops(elbow) => space.sheets[point] & elbow.bit() != 0,
            Through::Union => space.sheets[point] != 0,
        }
    }

    fn step(self, space: &FreeSpace, from: usize, to: usize) -> bool {
        if !self.open(space, to) {
            return false;
        }
        let Through::SheetWithStops(elbow) = self else { return true };
        let joint1 = &space.joint1_rad[usize::from(elbow == Elbow::Down)];
        (joint1[from] - joint1[to]).abs() < PI
    }
}

/// Length of the shortest 8-connected grid path between two places, m.
pub fn shortest_grid_path(space: &FreeSpace, start: Point2<f64>, goal: Point2<f64>, through: Through) -> Option<f64> {
    let mut search = GridSearch::default();
    let found = match search.begin(space, start, goal, through) {
        Found::NotYet => search.advance(space, through, usize::MAX),
        found => found,
    };
    (found == Found::Path).then(|| search.length_m(space))
}
