//! The cells of a map that was a picture, and the outlines of those that are solid.

use crate::shapes::Capsule;
use nalgebra::{Point2, Rotation2, Vector2};

/// Most cells of a picture: 8192 x 8192.
pub const CELLS_MAX: usize = 1 << 26;

/// Where the cells of a map lie. Column 0, row 0 is the cell at the origin; rows go up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Raster {
    /// The outer corner of the first cell, m.
    pub origin: Point2<f64>,
    /// The direction of the rows, rad.
    pub yaw_rad: f64,
    /// How long the side of a cell is, m.
    pub cell_m: f64,
    /// Cells of a row.
    pub columns: u32,
    /// Rows.
    pub rows: u32,
}

impl Raster {
    /// A place that is counted in cells from the origin: `(0.5, 0.5)` is the middle of the first cell. m.
    pub fn at(&self, column: f64, row: f64) -> Point2<f64> {
        let along = Vector2::new(column, row) * self.cell_m;
        // Most maps are not turned, and then nothing is rounded.
        self.origin + if self.yaw_rad == 0.0 { along } else { Rotation2::new(self.yaw_rad) * along }
    }

    /// Its corners, m.
    pub fn corners(&self) -> [Point2<f64>; 4] {
        let (columns, rows) = (f64::from(self.columns), f64::from(self.rows));
        [self.at(0.0, 0.0), self.at(columns, 0.0), self.at(columns, rows), self.at(0.0, rows)]
    }
}

/// Which cells are solid, row by row from the origin on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cells {
    columns: usize,
    rows: usize,
    /// Words of a row. Behind its last cell, each row has one that stands for what lies outside, and is solid.
    stride: usize,
    words: Vec<u64>,
}

impl Cells {
    /// Cells of which none is solid; `None` with more than [`CELLS_MAX`], or without any.
    pub fn new(columns: u32, rows: u32) -> Option<Cells> {
        let (columns, rows) = (columns as usize, rows as usize);
        columns.checked_mul(rows).filter(|count| (1..=CELLS_MAX).contains(count))?;
        let stride = columns / 64 + 1;
        let mut cells = Cells { columns, rows, stride, words: vec![0; stride * rows] };
        (0..rows).for_each(|row| cells.words[row * stride + columns / 64] |= 1 << (columns % 64));
        Some(cells)
    }

    fn index(&self, column: usize, row: usize) -> (usize, u64) {
        assert!(column < self.columns && row < self.rows, "cell {column}, {row} of {} x {}", self.columns, self.rows);
        (row * self.stride + column / 64, 1 << (column % 64))
    }

    /// Makes a cell solid.
    ///
    /// # Panics
    /// When there is no such cell.
    pub fn fill(&mut self, column: usize, row: usize) {
        let (word, bit) = self.index(column, row);
        self.words[word] |= bit;
    }

    /// Whether a cell is solid.
    ///
    /// # Panics
    /// When there is no such cell.
    pub fn is_solid(&self, column: usize, row: usize) -> bool {
        let (word, bit) = self.index(column, row);
        self.words[word] & bit != 0
    }

    /// How many are solid.
    pub fn solid_count(&self) -> usize {
        self.words.iter().map(|bits| bits.count_ones() as usize).sum::<usize>() - self.rows
    }

    /// The borders between solid and free cells as walls, each as long as it goes straight on; what is solid is on their left.
    /// What lies outside of the cells counts as solid. Stops soon after there are more than `most`.
    pub fn outlines(&self, raster: &Raster, most: usize) -> Vec<Capsule> {
        let mut walls = Vec::new();
        let mut outside = vec![u64::MAX; self.stride];
        outside[self.stride - 1] = u64::MAX >> (63 - self.columns % 64);
        let at = |column: usize, row: usize| raster.at(column as f64, row as f64);
        // Walls across end where the row above them has none there: where each began, and what is solid of its sides.
        let mut across: Vec<Option<(usize, bool)>> = vec![None; self.columns + 1];
        let mut borders_below = vec![0; self.stride];
        for row in 0..=self.rows {
            let words = |row: usize| self.words.get(row * self.stride..(row + 1) * self.stride).unwrap_or(&outside);
            let (below, above) = (if row > 0 { words(row - 1) } else { &outside }, words(row));
            along(below, above, &mut |from, to, is_above_solid| {
                let ends = if is_above_solid { [from, to] } else { [to, from] };
                walls.push(Capsule::segment(at(ends[0], row), at(ends[1], row)));
            });
            let mut before = 1;
            for (place, bits) in above.iter().enumerate() {
                let left = bits << 1 | before;
                before = bits >> 63;
                // Outside of the picture, below and above, nothing has a border across.
                let borders = if row < self.rows { (bits ^ left) & outside[place] } else { 0 };
                each_bit(borders | std::mem::replace(&mut borders_below[place], borders), &mut |bit| {
                    let (column, mask) = (place * 64 + bit, 1 << bit);
                    let border = (borders & mask != 0).then_some(left & mask != 0);
                    let open = &mut across[column];
                    if open.is_some_and(|(_, is_left_solid)| border == Some(is_left_solid)) {
                        return;
                    }
                    if let Some((begin, is_left_solid)) = open.take() {
                        let ends = if is_left_solid { [begin, row] } else { [row, begin] };
                        walls.push(Capsule::segment(at(column, ends[0]), at(column, ends[1])));
                    }
                    *open = border.map(|is_left_solid| (row, is_left_solid));
                });
            }
            if walls.len() > most {
                break;
            }
        }
        walls
    }
}

/// The borders between two rows, each as long as one side of it is solid: from where to where, and whether that is the upper
/// one.
fn along(below: &[u64], above: &[u64], found: &mut impl FnMut(usize, usize, bool)) {
    let mut open: Option<(usize, usize, bool)> = None;
    for (place, (below, above)) in below.iter().zip(above).enumerate() {
        each_bit(below ^ above, &mut |bit| {
            let (column, is_above_solid) = (place * 64 + bit, above >> bit & 1 != 0);
            match &mut open {
                Some((_, end, of_above)) if *end == column && *of_above == is_above_solid => *end += 1,
                _ => {
                    if let Some((from, to, of_above)) = open.replace((column, column + 1, is_above_solid)) {
                        found(from, to, of_above);
                    }
                }
            }
        });
    }
    if let Some((from, to, of_above)) = open {
        found(from, to, of_above);
    }
}

/// The bits that are set, the lowest first.
fn each_bit(mut bits: u64, see: &mut impl FnMut(usize)) {
    while bits != 0 {
        see(bits.trailing_zeros() as usize);
        bits &= bits - 1;
    }
}
