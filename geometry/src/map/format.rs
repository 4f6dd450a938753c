//! The bytes of a map, little-endian: a header, the walls, and the boxes of the index level by level.
//!
//! | at | bytes | what |
//! |---|---|---|
//! | 0 | 8 | `SHOALMAP` |
//! | 8 | 4 | version of the format |
//! | 12 | 4 | flags: 1 what is outside of all walls is solid, 2 there are cells |
//! | 16 | 4 | number of walls |
//! | 20 | 4 | zero |
//! | 24 | 8 | checksum over everything behind it |
//! | 32 | 32 | bounds: lowest x, y, highest x, y, m |
//! | 64 | 32 | cells: origin x, y, m; yaw, rad; size, m |
//! | 96 | 8 | columns, rows |
//! | 104 | 24 | zero |
//! | 128 | 40 each | walls: ends ax, ay, bx, by, radius, m |
//! | | 32 each | boxes: lowest x, y, highest x, y, m |
//!
//! A box of the lowest level holds [`FAN`] walls, one of another level the same number of boxes of the level below. How many there are
//! follows from the number of walls.

use super::{FAR_M, MapError, Raster, WALLS_MAX};
use crate::shapes::Capsule;
use nalgebra::Point2;
use std::ops::Range;

pub(super) const MAGIC: &[u8; 8] = b"SHOALMAP";
pub(super) const VERSION: u32 = 1;
pub(super) const FLAG_OUTSIDE_IS_SOLID: u32 = 1;
pub(super) const FLAG_RASTER: u32 = 2;
/// Bytes of the header, of a wall, of a box.
pub(super) const HEADER: usize = 128;
pub(super) const WALL: usize = 40;
pub(super) const BOX: usize = 32;
/// Where what the checksum covers begins.
pub(super) const COVERED: usize = 32;
/// What a box holds.
pub(super) const FAN: usize = 8;

/// What the header says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Header {
    pub(super) outside_is_solid: bool,
    pub(super) walls: usize,
    pub(super) checksum: u64,
    pub(super) bounds_m: [Point2<f64>; 2],
    pub(super) raster: Option<Raster>,
}

/// Walls and boxes as they lie.
#[derive(Clone, Copy)]
pub(super) struct Parts<'a> {
    pub(super) walls: &'a [[u8; WALL]],
    pub(super) boxes: &'a [[u8; BOX]],
}

/// Where the boxes of each level lie among all boxes, the lowest level first; the last one is a single box. None without walls.
pub(super) fn levels(walls: usize) -> Vec<Range<usize>> {
    let (mut levels, mut begin, mut below) = (Vec::new(), 0, walls);
    while below > 1 || below == 1 && levels.is_empty() {
        let boxes = below.div_ceil(FAN);
        levels.push(begin..begin + boxes);
        (begin, below) = (begin + boxes, boxes);
    }
    levels
}

/// How long a map of this many walls is.
pub(super) fn length(walls: usize) -> usize {
    HEADER + walls * WALL + levels(walls).last().map_or(0, |last| last.end) * BOX
}

/// Splits what `check` has found whole.
#[inline]
pub(super) fn parts<'a>(bytes: &'a [u8], header: &Header) -> Parts<'a> {
    let (walls, boxes) = bytes[HEADER..].split_at(header.walls * WALL);
    Parts { walls: walls.as_chunks().0, boxes: boxes.as_chunks().0 }
}

#[inline]
fn numbers<const N: usize>(bytes: &[u8]) -> [f64; N] {
    let words = bytes.as_chunks::<8>().0;
    std::array::from_fn(|index| f64::from_le_bytes(words[index]))
}

#[inline]
pub(super) fn wall(walls: &[[u8; WALL]], index: usize) -> Capsule {
    let [ax, ay, bx, by, radius] = numbers(&walls[index]);
    Capsule { a: Point2::new(ax, ay), b: Point2::new(bx, by), radius }
}

#[inline]
pub(super) fn bounds(boxes: &[[u8; BOX]], index: usize) -> [f64; 4] {
    numbers(&boxes[index])
}

fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

/// Every bit of every word reaches all bits of the sum.
pub(super) fn checksum(covered: &[u8]) -> u64 {
    let words = covered.as_chunks::<8>().0.iter().map(|word| u64::from_le_bytes(*word));
    words.fold(0x5348_4f41_4c4d_4150, |sum, word| {
        let mixed = (sum.rotate_left(29) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        mixed ^ mixed >> 32
    })
}

/// Checks all that there is. What the header tells is believed only when the bytes are there.
pub(super) fn check(bytes: &[u8]) -> Result<(Header, Vec<Range<usize>>), MapError> {
    if bytes.len() < HEADER || !bytes.starts_with(MAGIC) {
        return Err(MapError::Foreign);
    }
    let version = word(bytes, 8);
    if version != VERSION {
        return Err(MapError::Version(version));
    }
    let (flags, walls) = (word(bytes, 12), word(bytes, 16) as usize);
    if walls > WALLS_MAX || bytes.len() != length(walls) {
        return Err(MapError::Length);
    }
    let [told] = bytes[24..32].as_chunks::<8>().0 else { return Err(MapError::Foreign) };
    let checksum = checksum(&bytes[COVERED..]) ^ u64::from(flags) << 32 ^ walls as u64;
    if u64::from_le_bytes(*told) != checksum {
        return Err(MapError::Checksum);
    }
    let numbers_of_walls = bytes[HEADER..].as_chunks::<8>().0.iter().map(|word| f64::from_le_bytes(*word));
    let [low_x, low_y, high_x, high_y] = numbers(&bytes[32..64]);
    let [x_m, y_m, yaw_rad, cell_m] = numbers(&bytes[64..96]);
    let of_header = [low_x, low_y, high_x, high_y, x_m, y_m, yaw_rad, cell_m];
    if !numbers_of_walls.chain(of_header).all(|number| number.abs() <= FAR_M) {
        return Err(MapError::Number);
    }
    let raster =
        Raster { origin: Point2::new(x_m, y_m), yaw_rad, cell_m, columns: word(bytes, 96), rows: word(bytes, 100) };
    if flags & FLAG_RASTER != 0 && raster.cell_m <= 0.0 {
        return Err(MapError::Number);
    }
    let header = Header {
        outside_is_solid: flags & FLAG_OUTSIDE_IS_SOLID != 0,
        walls,
        checksum,
        bounds_m: [Point2::new(low_x, low_y), Point2::new(high_x, high_y)],
        raster: (flags & FLAG_RASTER != 0).then_some(raster),
    };
    Ok((header, levels(walls)))
}
