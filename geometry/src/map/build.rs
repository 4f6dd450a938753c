//! Walls into the bytes of a map.

use super::format::{self, BOX, COVERED, FAN, FLAG_OUTSIDE_IS_SOLID, FLAG_RASTER, HEADER, MAGIC, VERSION, WALL};
use super::{FAR_M, MapError, Raster, WALLS_MAX};
use crate::shapes::Capsule;
use nalgebra::{Point2, Vector2};

/// A box: lowest x, y, highest x, y.
type Bounds = [f64; 4];

const NOTHING: Bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];

pub(super) fn bytes(walls: &[Capsule], outside_is_solid: bool, raster: Option<Raster>) -> Result<Vec<u8>, MapError> {
    if walls.len() > WALLS_MAX {
        return Err(MapError::TooMany(walls.len()));
    }
    let numbers = |wall: &Capsule| [wall.a.x, wall.a.y, wall.b.x, wall.b.y, wall.radius];
    if !walls.iter().all(|wall| numbers(wall).iter().all(|number| number.abs() <= FAR_M) && wall.radius >= 0.0) {
        return Err(MapError::Number);
    }
    let all = walls.iter().map(around).fold(NOTHING, union);
    let mut order: Vec<(u32, u32)> = walls.iter().zip(0..).map(|(wall, index)| (place(wall, &all), index)).collect();
    order.sort_unstable();

    let levels = format::levels(walls.len());
    let mut out = vec![0; HEADER];
    out.reserve_exact(format::length(walls.len()) - HEADER);
    let mut below: Vec<Bounds> = Vec::with_capacity(walls.len());
    for (_, index) in order {
        let wall = &walls[index as usize];
        numbers(wall).iter().for_each(|number| out.extend_from_slice(&number.to_le_bytes()));
        below.push(around(wall));
    }
    for _ in levels {
        below = below.chunks(FAN).map(|some| some.iter().copied().fold(NOTHING, union)).collect();
        below.iter().flatten().for_each(|number| out.extend_from_slice(&number.to_le_bytes()));
    }
    debug_assert_eq!((WALL, BOX), (5 * 8, 4 * 8), "what is written above");

    let corners = raster.map(|raster| raster.corners()).into_iter().flatten();
    let bounds = corners.map(|p| [p.x, p.y, p.x, p.y]).fold(all, union);
    let bounds = if bounds[0] > bounds[2] { [0.0; 4] } else { bounds };
    let flags = u32::from(outside_is_solid) * FLAG_OUTSIDE_IS_SOLID + u32::from(raster.is_some()) * FLAG_RASTER;
    let mut put = |at: usize, bytes: &[u8]| out[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, MAGIC);
    put(8, &VERSION.to_le_bytes());
    put(12, &flags.to_le_bytes());
    put(16, &(walls.len() as u32).to_le_bytes());
    bounds.iter().zip((32..).step_by(8)).for_each(|(number, at)| put(at, &number.to_le_bytes()));
    if let Some(Raster { origin, yaw_rad, cell_m, columns, rows }) = raster {
        [origin.x, origin.y, yaw_rad, cell_m]
            .iter()
            .zip((64..).step_by(8))
            .for_each(|(number, at)| put(at, &number.to_le_bytes()));
        put(96, &columns.to_le_bytes());
        put(100, &rows.to_le_bytes());
    }
    let checksum = format::checksum(&out[COVERED..]) ^ u64::from(flags) << 32 ^ walls.len() as u64;
    out[24..32].copy_from_slice(&checksum.to_le_bytes());
    Ok(out)
}

/// The box round a wall.
fn around(wall: &Capsule) -> Bounds {
    let by = Vector2::repeat(wall.radius);
    let (low, high): (Point2<f64>, Point2<f64>) = (wall.a.inf(&wall.b) - by, wall.a.sup(&wall.b) + by);
    [low.x, low.y, high.x, high.y]
}

fn union(a: Bounds, b: Bounds) -> Bounds {
    [a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])]
}

/// Where the middle of a wall comes on a curve that keeps near what is near (Morton order).
fn place(wall: &Capsule, all: &Bounds) -> u32 {
    let share = |middle: f64, low: f64, high: f64| (((middle - low) / (high - low).max(1e-9)) * 65535.0) as u32;
    let x = share(0.5 * (wall.a.x + wall.b.x), all[0], all[2]);
    let y = share(0.5 * (wall.a.y + wall.b.y), all[1], all[3]);
    spread(x.min(0xffff)) | spread(y.min(0xffff)) << 1
}

/// The lower 16 bits with a zero before each.
fn spread(mut bits: u32) -> u32 {
    for (shift, mask) in [(8, 0x00ff_00ff), (4, 0x0f0f_0f0f), (2, 0x3333_3333), (1, 0x5555_5555)] {
        bits = (bits | bits << shift) & mask;
    }
    bits
}
