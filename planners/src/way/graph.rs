//! The tangent graph of a map: corners of grown obstacles, and the lines between them that a way can follow.

use super::links::{self, Key, Targets};
use super::outline::{Corner, corners};
use crate::planner::{Obstacle, solid};
use geometry::route::{is_open, keeps_at};
use geometry::{Capsule, Map};
use nalgebra::{Point2, distance};
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};

/// Rounding decides neither for nor against a line, as a share of the radius.
const TOUCH: f64 = 1e-6;
/// How far a corner of an outline is from the middle of its arc, by radius: 1 / cos 22.5 degrees.
const CORNER: f64 = 1.082_392_200_292_394;
/// Graphs that are kept for robots that come later.
const KEPT: usize = 16;

/// The corners of a map for one radius.
pub(super) struct Graph {
    key: Key,
    pieces: Vec<Capsule>,
    /// The same, in an index.
    index: Map,
    pub(super) corners: Vec<Corner>,
    /// From each corner, once it was asked for: the corners that a way can go on to.
    found: Vec<OnceLock<Vec<u32>>>,
    /// The same of all corners, where another process has found them.
    told: Option<Targets<'static>>,
}

static GRAPHS: Mutex<Vec<Weak<Graph>>> = Mutex::new(Vec::new());

impl Graph {
    /// The graph of this map for a disc that keeps this distance (m) from everything.
    pub(super) fn of(map: &[Obstacle], keeps_m: f64) -> Arc<Graph> {
        let key = Key::of(map, keeps_m);
        let mut graphs = GRAPHS.lock().unwrap_or_else(PoisonError::into_inner);
        graphs.retain(|graph| graph.strong_count() > 0);
        if let Some(graph) = graphs.iter().filter_map(Weak::upgrade).find(|graph| graph.is_of(key, map)) {
            return graph;
        }
        let mut graph = Graph::new(key, map);
        graph.told = links::told(key, graph.corners.len());
        let graph = Arc::new(graph);
        if graphs.len() < KEPT {
            graphs.push(Arc::downgrade(&graph));
        }
        graph
    }

    fn is_of(&self, key: Key, map: &[Obstacle]) -> bool {
        let same = self.pieces.len() == map.len() && self.pieces.iter().zip(map).all(|(a, b)| *a == b.shape);
        self.key == key && same
    }

    /// The graph, without any links yet.
    fn new(key: Key, map: &[Obstacle]) -> Graph {
        let keeps_m = key.keeps_m();
        let pieces: Vec<Capsule> = map.iter().map(|obstacle| obstacle.shape).collect();
        let index = Map::build(&pieces, false, None).expect("pieces are finite, and far fewer than an index can hold");
        let least_m = keeps_m * (1.0 - TOUCH);
        let corners = corners(map, keeps_m, &|at| {
            !index.is_near(at, least_m) && !map.chunk_by(|a, b| a.id == b.id).any(|all| solid(all, at).is_some())
        });
        let found = corners.iter().map(|_| OnceLock::new()).collect();
        Graph { key, pieces, index, corners, found, told: None }
    }

    /// What the disc can keep from obstacles on its way from or to a point: less than usual where that is nearer to one, m.
    pub(super) fn keeps(&self, at: Point2<f64>) -> f64 {
        keeps_at(&[&self.index], at, self.key.keeps_m())
    }

    /// From where a disc looks for its way, and what it can keep from obstacles on it, m. Nearer to an obstacle than ways are it looks
    /// from a corner's distance to that: between an arc and its straight outline only the two next corners are in sight, and the way
    /// would lead back to one of them.
    pub(super) fn outlook(&self, at: Point2<f64>) -> (Point2<f64>, f64) {
        let keeps_m = self.key.keeps_m();
        let usual_m = keeps_m * (1.0 - TOUCH);
        let mut nearest = Vec::new();
        self.index.nearest(at, keeps_m, 1, &mut nearest);
        let Some((distance_m, wall)) = nearest.first().copied() else { return (at, usual_m) };
        let here = (at, distance_m * (1.0 - TOUCH));
        if distance_m >= usual_m {
            return here;
        }
        let Some(away) = (at - self.index.wall(wall as usize).nearest_core(at)).try_normalize(0.0) else { return here };
        let out = at + away * (keeps_m * CORNER - distance_m);
        if self.index.is_near(out, keeps_m) { here } else { (out, usual_m) }
    }

    /// Whether a disc that keeps this distance (m) from everything gets straight from one point to the other.
    pub(super) fn sees(&self, from: Point2<f64>, to: Point2<f64>, keeps_m: f64) -> bool {
        is_open(&[&self.index], [from, to], keeps_m)
    }

    /// The corners that a way can go on to from this one, and how far they are, m.
    pub(super) fn links(&self, corner: u32) -> impl Iterator<Item = (u32, f64)> {
        let from = self.corners[corner as usize].at;
        let (found, told) = match self.told {
            Some(told) => (&[][..], told.of(corner)),
            None => (self.found(corner), &[][..]),
        };
        let all = found.iter().copied().chain(told.iter().copied().map(u32::from_le_bytes));
        all.map(move |other| (other, distance(&from, &self.corners[other as usize].at)))
    }

    /// The corners that a way can go on to from this one.
    fn found(&self, corner: u32) -> &[u32] {
        self.found[corner as usize].get_or_init(|| {
            let from = &self.corners[corner as usize];
            let keeps_m = self.key.keeps_m() * (1.0 - TOUCH);
            let fits = |(other, to): (u32, &Corner)| {
                let way = to.at - from.at;
                let touches = other != corner && from.is_touched_by(way) && to.is_touched_by(way);
                (touches && self.sees(from.at, to.at, keeps_m)).then_some(other)
            };
            (0..).zip(&self.corners).filter_map(fits).collect()
        })
    }
}

/// Finds the links of all corners of this map for discs that keep these distances (m) from everything: a block for
/// [`tell_links`](super::tell_links). It uses all processors.
pub(super) fn find_links(map: &[Obstacle], keep_m: impl Iterator<Item = f64>) -> Vec<u8> {
    let graphs: Vec<Graph> = keep_m.map(|keeps_m| Graph::new(Key::of(map, keeps_m), map)).collect();
    let corners = |graph: &Graph| 0..graph.corners.len() as u32;
    let all: Vec<(&Graph, u32)> =
        graphs.iter().flat_map(|graph| corners(graph).map(move |corner| (graph, corner))).collect();
    let next = AtomicUsize::new(0);
    let work = || {
        while let Some((graph, corner)) = all.get(next.fetch_add(1, Ordering::Relaxed)) {
            graph.found(*corner);
        }
    };
    let workers = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    std::thread::scope(|scope| (0..workers).for_each(|_| drop(scope.spawn(work))));
    let found = graphs.iter().map(|graph| (graph.key, corners(graph).map(|corner| graph.found(corner)).collect()));
    links::block(&found.collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;
    use proptest::prelude::*;

    /// Squares on a lattice, moved and turned; discs and walls among them.
    fn maps() -> impl Strategy<Value = Vec<Obstacle>> {
        let place = (-0.4..0.4f64, -0.4..0.4f64, 0.2..0.5f64, 0.0..1.5f64);
        prop::collection::vec(place, 20..40).prop_map(|places| {
            let made = |(id, (x, y, size, yaw)): (u32, &(f64, f64, f64, f64))| {
                let at = Point2::new(1.6 * f64::from(id % 6) + x, 1.6 * f64::from(id / 6) + y);
                let corner = |k: u32| {
                    let angle = yaw + f64::from(k) * std::f64::consts::FRAC_PI_2;
                    at + Vector2::new(angle.cos(), angle.sin()) * *size
                };
                let shapes = match id % 5 {
                    0 => vec![Capsule::disc(at, *size)],
                    1 => vec![Capsule::segment(corner(0), corner(2))],
                    _ => (0..4).map(|k| Capsule::segment(corner(k), corner((k + 1) % 4))).collect(),
                };
                shapes.into_iter().map(move |shape| Obstacle { id, shape, velocity: Vector2::zeros() })
            };
            (0..).zip(&places).flat_map(made).collect()
        })
    }

    fn graph(map: &[Obstacle], keeps_m: f64) -> Graph {
        Graph::new(Key::of(map, keeps_m), map)
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 40, ..ProptestConfig::default() })]

        /// The index answers as a look at all pieces does, to the last bit.
        #[test]
        fn pieces_are_looked_at_through_an_index(
            map in maps(), lines in prop::collection::vec(prop::array::uniform4(-2.0..11.0f64), 50)
        ) {
            let graph = graph(&map, 0.2);
            prop_assert_eq!(graph.index.len(), map.len());
            for [x, y, to_x, to_y] in lines {
                let (from, to) = (Point2::new(x, y), Point2::new(to_x, to_y));
                let least_m = map.iter().map(|piece| piece.shape.distance(from)).fold(0.2, f64::min);
                prop_assert_eq!(graph.keeps(from), least_m * (1.0 - TOUCH));
                prop_assert_eq!(graph.index.is_near(from, 0.2), least_m < 0.2);
                let sees = map.iter().all(|piece| {
                    let Capsule { a, b, radius } = piece.shape;
                    geometry::segment_distance(from, to, a, b) - radius >= 0.2
                });
                prop_assert_eq!(graph.sees(from, to, 0.2), sees);
            }
        }

        /// What one process has found is what each would find, and a block that is not whole is refused.
        #[test]
        fn links_are_shared_as_a_block(map in maps(), at in any::<prop::sample::Index>()) {
            let block = find_links(&map, [0.2, 0.1].into_iter());
            let told = links::read(&block).expect("it is whole");
            prop_assert_eq!(told.len(), 2);
            for ((key, targets), keeps_m) in told.iter().zip([0.2, 0.1]) {
                let graph = graph(&map, keeps_m);
                prop_assert_eq!(*key, graph.key);
                prop_assert!(!graph.corners.is_empty());
                for corner in 0..graph.corners.len() as u32 {
                    let targets: Vec<u32> = targets.of(corner).iter().copied().map(u32::from_le_bytes).collect();
                    prop_assert_eq!(&targets[..], graph.found(corner));
                }
            }
            prop_assert!(links::read(&block[..at.index(block.len())]).is_none(), "it was cut");
            prop_assert!(links::read(&[&block[..], &[0; 4]].concat()).is_none(), "something comes behind it");
            let mut far = block.clone();
            *far.last_mut().unwrap() = 1;
            prop_assert!(links::read(&far).is_none(), "there is no such corner");
        }
    }

    #[test]
    fn graphs_take_the_links_that_the_process_was_told() {
        let side = |a: [f64; 2], b: [f64; 2]| Obstacle {
            id: 0,
            shape: Capsule::segment(a.into(), b.into()),
            velocity: Vector2::zeros(),
        };
        let map = [side([-0.71, 0.0], [0.37, 0.0]), side([0.37, 0.0], [0.0, 0.73]), side([0.0, 0.73], [-0.71, 0.0])];
        let links = |graph: &Graph| -> Vec<Vec<(u32, f64)>> {
            (0..graph.corners.len() as u32).map(|corner| graph.links(corner).collect()).collect()
        };
        let alone = links(&Graph::of(&map, 0.2));
        assert!(alone.iter().all(|links| !links.is_empty()), "{alone:?}");
        assert!(links::tell_links(find_links(&map, std::iter::once(0.2)).leak()));
        let told = Graph::of(&map, 0.2);
        assert!(told.told.is_some());
        assert_eq!(links(&told), alone);
        assert!(told.found.iter().all(|found| found.get().is_none()), "it looked for them again");
        assert!(Graph::of(&map, 0.3).told.is_none(), "a disc of another size has other links");
        assert!(!links::tell_links(b"not a block"));
    }
}
