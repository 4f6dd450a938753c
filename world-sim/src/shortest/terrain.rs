//! Ways past the walls of a map.

use geometry::route::{Progress, Search};
use geometry::{Capsule, Map};
use nalgebra::Point2;

/// What all ways of a run may cost together, in steps of the search: a few seconds. Ways that would cost more are not known.
const STEPS_MAX: usize = 8_000_000;

/// The walls of the map, and the obstacles that stand before them.
pub(super) struct Terrain {
    maps: Vec<Map>,
    steps: usize,
}

impl Terrain {
    pub(super) fn new(map: &Map, standing: &[Capsule]) -> Terrain {
        let standing = Map::build(standing, false, None).ok().filter(|map| !map.is_empty());
        Terrain { maps: [Some(map.clone()), standing].into_iter().flatten().collect(), steps: STEPS_MAX }
    }

    /// Length of a way of a disc, m; `None` if there is none, or if it takes too long to find.
    pub(super) fn leg(&mut self, from: Point2<f64>, to: Point2<f64>, radius_m: f64) -> Option<f64> {
        const PORTION: usize = 1 << 16;
        let ground: Vec<&Map> = self.maps.iter().collect();
        let mut search = Search::new(radius_m, from, to);
        while self.steps > 0 {
            match search.go_on(&ground, PORTION) {
                Progress::Searching => self.steps = self.steps.saturating_sub(PORTION),
                Progress::Found(route) => {
                    self.steps = self.steps.saturating_sub(PORTION / 16);
                    return Some(route.length_m(from));
                }
                Progress::None => return None,
            }
        }
        None
    }
}
