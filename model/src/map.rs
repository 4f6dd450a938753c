//! The map of a scenario: which one it is, and its walls.

use geometry::{Map, MapError};
use serde::{Deserialize, Serialize};

/// The map of a scenario. Where a scenario is kept, its map is kept beside it: what is read says which map it was, and that has to
/// be [attached](MapRef::attach) before the scenario is used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapRef {
    /// The file that it was read from, as the scenario names it.
    pub file: String,
    /// How many walls it has.
    pub walls: u32,
    /// The checksum over its bytes.
    pub checksum: u64,
    #[serde(skip)]
    map: Option<Map>,
}

/// Why a map cannot be attached to a scenario.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MapProblem {
    /// The bytes are not a map.
    Bad(MapError),
    /// They are another map.
    Other,
}

impl MapRef {
    /// A map that was read from this file.
    pub fn new(file: String, map: Map) -> MapRef {
        MapRef { file, walls: map.len() as u32, checksum: map.checksum(), map: Some(map) }
    }

    /// The walls.
    ///
    /// # Panics
    /// When they have not been attached: the reader of a scenario does that first.
    pub fn map(&self) -> &Map {
        self.map.as_ref().expect("the map of a scenario that was read has been attached")
    }

    /// Attaches the map that this scenario was kept with, from its bytes.
    ///
    /// # Errors
    /// When they are not a map, or are another map.
    pub fn attach(&mut self, bytes: impl AsRef<[u8]> + Send + Sync + 'static) -> Result<(), MapProblem> {
        let map = Map::read(bytes).map_err(MapProblem::Bad)?;
        if (map.len() as u32, map.checksum()) != (self.walls, self.checksum) {
            return Err(MapProblem::Other);
        }
        self.map = Some(map);
        Ok(())
    }
}

impl std::fmt::Display for MapProblem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            MapProblem::Bad(error) => error.fmt(f),
            MapProblem::Other => f.write_str("it is not the map of this scenario"),
        }
    }
}

impl std::error::Error for MapProblem {}
