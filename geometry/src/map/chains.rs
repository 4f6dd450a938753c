//! Walls one behind the other, for drawing: most of them are parts of outlines.

use super::Map;
use nalgebra::Point2;
use std::collections::HashMap;

/// A point by its bits, which are equal where one wall goes on from another.
type Corner = (u64, u64);

impl Map {
    /// All walls as lines of corners, each wall once: a line goes on for as long as a wall begins where the last one ends. m.
    pub fn chains(&self) -> Vec<Vec<Point2<f64>>> {
        let corner = |p: Point2<f64>| -> Corner { (p.x.to_bits(), p.y.to_bits()) };
        let walls: Vec<[Point2<f64>; 2]> = self.walls().map(|wall| [wall.a, wall.b]).collect();
        // By corner, the walls that begin there, the last one first; which of them are left is what it is asked for.
        let mut beginning: HashMap<Corner, Vec<u32>> = HashMap::with_capacity(walls.len());
        for (index, [a, _]) in (0..walls.len() as u32).zip(&walls).rev() {
            beginning.entry(corner(*a)).or_default().push(index);
        }
        let mut taken = vec![false; walls.len()];
        let mut chains = Vec::new();
        for first in 0..walls.len() {
            if std::mem::replace(&mut taken[first], true) {
                continue;
            }
            let mut chain = walls[first].to_vec();
            loop {
                let end = corner(chain[chain.len() - 1]);
                let Some(next) = beginning.get_mut(&end).and_then(|walls| {
                    while let Some(next) = walls.pop() {
                        if !taken[next as usize] {
                            return Some(next as usize);
                        }
                    }
                    None
                }) else {
                    break;
                };
                taken[next] = true;
                chain.push(walls[next][1]);
            }
            chains.push(chain);
        }
        chains
    }
}
