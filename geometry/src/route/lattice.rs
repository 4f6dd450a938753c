//! The cells over which a way is searched, and what is known of them.

use super::Ground;
use nalgebra::{Point2, Rotation2, Vector2};

/// Most cells that a lattice can have: it becomes coarser until it has no more.
const CELLS_MAX: f64 = (1_u32 << 26) as f64;
/// A coordinate beyond this many cells is none.
const FAR: f64 = 1e9;

/// A lattice of square cells.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    /// What a way keeps from walls, m.
    pub(super) keeps_m: f64,
    /// What the middle of a cell keeps: on the line between two of them, all points keep `keeps_m` then.
    pub(super) cell_keeps_m: f64,
    origin: Point2<f64>,
    turn: Rotation2<f64>,
    cell_m: f64,
    /// The lowest cell.
    low: [i32; 2],
    columns: u32,
    rows: u32,
}

impl Lattice {
    /// A lattice over the ground and some places, with cells that are at most so wide, m.
    pub(super) fn new(ground: Ground<'_>, keeps_m: f64, cell_m_max: f64, places: [Point2<f64>; 2]) -> Lattice {
        let raster = ground.iter().find_map(|map| map.raster());
        let (origin, yaw_rad) = raster.map_or((Point2::origin(), 0.0), |raster| (raster.origin, raster.yaw_rad));
        let mut cell_m = match raster.map(|raster| raster.cell_m) {
            Some(cell_m) if cell_m <= cell_m_max => cell_m * (cell_m_max / cell_m).floor(),
            Some(cell_m) => {
                let parts = (cell_m / cell_m_max).ceil();
                // An odd number of them has the middle of the cell among its own.
                cell_m / if parts % 2.0 == 0.0 { parts + 1.0 } else { parts }
            }
            None => cell_m_max,
        };
        let turn = Rotation2::new(yaw_rad);
        let corners = ground.iter().filter(|map| !map.is_empty()).flat_map(|map| {
            let [low, high] = map.bounds_m();
            [low, Point2::new(high.x, low.y), high, Point2::new(low.x, high.y)]
        });
        let all: Vec<Vector2<f64>> = corners.chain(places).map(|p| turn.inverse() * (p - origin)).collect();
        let beyond = Vector2::repeat(4.0 * keeps_m);
        let low = all.iter().fold(all[0], |low, p| low.inf(p)) - beyond;
        let high = all.iter().fold(all[0], |high, p| high.sup(p)) + beyond;
        while ((high.x - low.x) / cell_m + 1.0) * ((high.y - low.y) / cell_m + 1.0) > CELLS_MAX {
            cell_m *= 2.0;
        }
        let index = |x: f64| (x / cell_m).floor().clamp(-FAR, FAR) as i32;
        let (low, high) = ([index(low.x), index(low.y)], [index(high.x), index(high.y)]);
        Lattice {
            keeps_m,
            cell_keeps_m: keeps_m.hypot(0.5 * cell_m * std::f64::consts::SQRT_2),
            origin,
            turn,
            cell_m,
            low,
            columns: (high[0] - low[0] + 1) as u32,
            rows: (high[1] - low[1] + 1) as u32,
        }
    }

    /// The cell that a place is in.
    pub(super) fn cell_of(&self, p: Point2<f64>) -> [i32; 2] {
        let p = self.turn.inverse() * (p - self.origin) / self.cell_m;
        [p.x.floor() as i32, p.y.floor() as i32]
    }

    /// The middle of a cell, m.
    pub(super) fn at(&self, [column, row]: [i32; 2]) -> Point2<f64> {
        self.origin + self.turn * (Vector2::new(f64::from(column) + 0.5, f64::from(row) + 0.5) * self.cell_m)
    }

    /// The number of a cell, if it is one of the lattice.
    pub(super) fn cell(&self, [column, row]: [i32; 2]) -> Option<u32> {
        let column = u32::try_from(column - self.low[0]).ok().filter(|column| *column < self.columns)?;
        let row = u32::try_from(row - self.low[1]).ok().filter(|row| *row < self.rows)?;
        Some(row * self.columns + column)
    }

    /// Column and row of a cell.
    pub(super) fn place(&self, cell: u32) -> [i32; 2] {
        [self.low[0] + (cell % self.columns) as i32, self.low[1] + (cell / self.columns) as i32]
    }

    /// How long a step to a neighbour is, m.
    pub(super) fn step_m(&self, is_diagonal: bool) -> f32 {
        (if is_diagonal { self.cell_m * std::f64::consts::SQRT_2 } else { self.cell_m }) as f32
    }

    /// No way from a cell is shorter, m: the last line to the goal may have any direction.
    pub(super) fn ahead_m(&self, cell: u32, goal: Point2<f64>) -> f32 {
        let away = self.turn.inverse() * (goal - self.at(self.place(cell)));
        let (x, y) = (away.x.abs(), away.y.abs());
        // Steps go in eight directions but for the last line, which is a few cells long and may be straighter.
        let octile = x.max(y) + (std::f64::consts::SQRT_2 - 1.0) * x.min(y);
        let slack = f64::from(super::LINKS + 1) * self.cell_m * 0.12;
        (octile - slack).max(away.norm()) as f32
    }
}

/// Cells of the lattice in blocks, so that only what is looked at takes memory.
pub(super) struct Seen {
    columns: u32,
    /// Blocks of a row.
    stride: u32,
    blocks: Vec<Option<Box<Block>>>,
}

const SIDE: u32 = 64;
const UNKNOWN: u8 = 0;
const FREE: u8 = 1;
const BLOCKED: u8 = 2;
const FREEDOM: u8 = 3;
const CLOSED: u8 = 4;
/// The direction in which the way came to a cell, plus one.
const CAME: u32 = 3;

struct Block {
    lengths: [f32; (SIDE * SIDE) as usize],
    states: [u8; (SIDE * SIDE) as usize],
}

impl Seen {
    pub(super) fn new(lattice: &Lattice) -> Seen {
        let (stride, rows) = (lattice.columns.div_ceil(SIDE), lattice.rows.div_ceil(SIDE));
        let mut blocks = Vec::new();
        blocks.resize_with(stride as usize * rows as usize, || None);
        Seen { columns: lattice.columns, stride, blocks }
    }

    fn index(&self, cell: u32) -> (usize, usize) {
        let (column, row) = (cell % self.columns, cell / self.columns);
        let block = (row / SIDE) * self.stride + column / SIDE;
        (block as usize, ((row % SIDE) * SIDE + column % SIDE) as usize)
    }

    fn block(&mut self, cell: u32) -> (&mut Block, usize) {
        let (block, place) = self.index(cell);
        let new = || {
            Box::new(Block {
                lengths: [f32::INFINITY; (SIDE * SIDE) as usize],
                states: [UNKNOWN; (SIDE * SIDE) as usize],
            })
        };
        (self.blocks[block].get_or_insert_with(new), place)
    }

    /// The shortest way to a cell so far, m.
    pub(super) fn length(&self, cell: u32) -> f32 {
        let (block, place) = self.index(cell);
        self.blocks[block].as_ref().map_or(f32::INFINITY, |block| block.lengths[place])
    }

    /// The way to a cell is this long, m, and its last step has this direction; none if it begins there.
    pub(super) fn lengthen(&mut self, cell: u32, length: f32, came: Option<u8>) {
        let (block, place) = self.block(cell);
        block.lengths[place] = length;
        let state = block.states[place] & (FREEDOM | CLOSED);
        block.states[place] = state | came.map_or(0, |direction| direction + 1) << CAME;
    }

    /// The direction of the last step to a cell.
    pub(super) fn came(&self, cell: u32) -> Option<u8> {
        let (block, place) = self.index(cell);
        (self.blocks[block].as_ref()?.states[place] >> CAME).checked_sub(1)
    }

    /// Nothing shorter leads to this cell; whether that was so before.
    pub(super) fn close(&mut self, cell: u32) -> bool {
        let (block, place) = self.block(cell);
        let was = block.states[place] & CLOSED != 0;
        block.states[place] |= CLOSED;
        was
    }

    /// Whether a disc can be in a cell; looked up once.
    pub(super) fn is_free(&mut self, cell: u32, look: impl FnOnce() -> bool) -> bool {
        let (block, place) = self.block(cell);
        if block.states[place] & FREEDOM == UNKNOWN {
            block.states[place] |= if look() { FREE } else { BLOCKED };
        }
        block.states[place] & FREEDOM == FREE
    }
}
