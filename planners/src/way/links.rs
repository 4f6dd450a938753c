//! The links of the graphs of one map as a block of bytes, so that the processes of a fleet share what one of them has found.
//!
//! A process computes the corners of its graphs on its own: they take a moment. Which of them see each other takes long where
//! there are many, and depends on the map and the radius alone.
//!
//! The block consists of 32-bit words, lowest byte first: [`MAGIC`] and the number of graphs; then for each graph its key (four
//! words), the number of its corners n, n + 1 numbers that say which of its targets are those of which corner, and the targets.

use crate::planner::Obstacle;
use std::sync::OnceLock;

/// First word of a block.
const MAGIC: u32 = u32::from_le_bytes(*b"way1");
/// Words of a key.
const KEY: usize = 4;

type Word = [u8; 4];

/// What a graph is a function of: the map, and what the disc keeps from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Key {
    map: u64,
    keeps_bits: u64,
}

impl Key {
    pub(super) fn of(map: &[Obstacle], keeps_m: f64) -> Key {
        let numbers = map.iter().flat_map(|obstacle| {
            let geometry::Capsule { a, b, radius } = obstacle.shape;
            [f64::from(obstacle.id), a.x, a.y, b.x, b.y, radius]
        });
        let mix = |sum: u64, x: f64| (sum.rotate_left(29) ^ x.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        Key { map: numbers.fold(map.len() as u64, mix), keeps_bits: keeps_m.to_bits() }
    }

    /// What the centre keeps from every obstacle, m.
    pub(super) fn keeps_m(self) -> f64 {
        f64::from_bits(self.keeps_bits)
    }

    fn words(self) -> [u32; KEY] {
        [self.map as u32, (self.map >> 32) as u32, self.keeps_bits as u32, (self.keeps_bits >> 32) as u32]
    }
}

/// The links of one graph, in a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Targets<'a> {
    /// One more than there are corners.
    begins: &'a [Word],
    targets: &'a [Word],
}

impl<'a> Targets<'a> {
    /// Those of a corner.
    pub(super) fn of(self, corner: u32) -> &'a [Word] {
        let begin = |index: u32| u32::from_le_bytes(self.begins[index as usize]) as usize;
        &self.targets[begin(corner)..begin(corner + 1)]
    }

    /// Takes the links of a graph with so many corners from the beginning of some words; none if they are not whole.
    fn take(words: &mut &'a [Word], corners: usize) -> Option<Targets<'a>> {
        let (begins, rest) = words.split_at_checked(corners.checked_add(1)?)?;
        let numbers = || begins.iter().copied().map(u32::from_le_bytes);
        let count = numbers().next_back()? as usize;
        let (targets, rest) = rest.split_at_checked(count)?;
        *words = rest;
        let is_whole = numbers().next() == Some(0)
            && numbers().is_sorted()
            && targets.iter().all(|target| (u32::from_le_bytes(*target) as usize) < corners);
        is_whole.then_some(Targets { begins, targets })
    }
}

/// The block of these graphs: of each its key, and for each of its corners those that it is linked to.
pub(super) fn block(graphs: &[(Key, Vec<&[u32]>)]) -> Vec<u8> {
    let mut words = vec![MAGIC, graphs.len() as u32];
    for (key, links) in graphs {
        words.extend(key.words());
        words.push(links.len() as u32);
        let ends = links.iter().scan(0, |end, targets| {
            *end += targets.len() as u32;
            Some(*end)
        });
        words.extend(std::iter::once(0).chain(ends));
        words.extend(links.concat());
    }
    words.into_iter().flat_map(u32::to_le_bytes).collect()
}

/// Blocks that this process was told of.
static TOLD: OnceLock<Vec<(Key, Targets<'static>)>> = OnceLock::new();

/// Tells this process of a block that [`find_links`](super::find_links) has made: graphs of that map take their links from there.
/// Only the first block counts. Whether it is whole.
pub fn tell_links(block: &'static [u8]) -> bool {
    let Some(graphs) = read(block) else { return false };
    TOLD.get_or_init(|| graphs);
    true
}

/// What this process was told of a graph.
pub(super) fn told(key: Key, corners: usize) -> Option<Targets<'static>> {
    let (_, targets) = TOLD.get()?.iter().find(|(of, targets)| *of == key && targets.begins.len() == corners + 1)?;
    Some(*targets)
}

pub(super) fn read(block: &[u8]) -> Option<Vec<(Key, Targets<'_>)>> {
    let (mut words, []) = block.as_chunks::<4>() else { return None };
    let [magic, count] = head(&mut words)?;
    if magic != MAGIC {
        return None;
    }
    let mut graphs = Vec::new();
    for _ in 0..count {
        let [map, map_high, keeps, keeps_high, corners] = head(&mut words)?;
        let wide = |low: u32, high: u32| u64::from(high) << 32 | u64::from(low);
        let key = Key { map: wide(map, map_high), keeps_bits: wide(keeps, keeps_high) };
        graphs.push((key, Targets::take(&mut words, corners as usize)?));
    }
    words.is_empty().then_some(graphs)
}

/// Takes as many words from the beginning.
fn head<const N: usize>(words: &mut &[Word]) -> Option<[u32; N]> {
    let (first, rest) = words.split_first_chunk::<N>()?;
    *words = rest;
    Some(first.map(u32::from_le_bytes))
}
