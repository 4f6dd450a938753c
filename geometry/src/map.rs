//! The walls of a map: capsules that stand still, in one block of bytes with an index over them.
//!
//! A [`Map`] is read where it lies: in memory that [`Map::build`] took, or in a file that many processes map. Its index is a
//! packed tree of boxes over the walls in Morton order, so what a question costs grows with what is near, not with the map.
//! Distances are exact: there is no field of them, because a look into the tree takes a fraction of a microsecond and a field of
//! a building takes tens of megabytes.
//!
//! ```text
//! format   the bytes: header, walls, boxes       build    walls into that form
//! ask      what is near, what is in the way      raster   cells of a picture, and their outlines
//! chains   walls one behind the other
//! ```

mod ask;
mod build;
mod chains;
mod format;
pub mod raster;

pub use raster::{Cells, Raster};

use crate::shapes::Capsule;
use format::Header;
use nalgebra::Point2;
use std::fmt;
use std::ops::Range;
use std::sync::Arc;

/// Most walls that a map can have: 72 MB.
pub const WALLS_MAX: usize = 1 << 20;
/// No coordinate of a wall is larger, m.
pub const FAR_M: f64 = 1e7;

/// How many bytes a map of this many walls has; none has more than [`WALLS_MAX`].
pub fn bytes_of(walls: usize) -> usize {
    format::length(walls.min(WALLS_MAX))
}

/// Why bytes are not a map, or walls cannot become one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MapError {
    /// They are something else, or too short for a header.
    Foreign,
    /// They are a map of this version of the format.
    Version(u32),
    /// The length that the header tells is not the length that there is, or not one that a map can have.
    Length,
    /// The checksum does not fit.
    Checksum,
    /// A number is not finite, or too large.
    Number,
    /// There are more walls than [`WALLS_MAX`].
    TooMany(usize),
}

impl fmt::Display for MapError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            MapError::Foreign => f.write_str("it is not a map"),
            MapError::Version(version) => {
                write!(f, "it is a map of format version {version}, and this shoal reads version {}", format::VERSION)
            }
            MapError::Length => f.write_str("it is damaged: its length does not fit its header"),
            MapError::Checksum => f.write_str("it is damaged: its checksum does not fit"),
            MapError::Number => f.write_str("a wall has a coordinate that is not a number of metres within 1e7"),
            MapError::TooMany(count) => write!(f, "it has {count} walls, and a map has at most {WALLS_MAX}"),
        }
    }
}

impl std::error::Error for MapError {}

/// Bytes that do not change.
trait Bytes: AsRef<[u8]> + Send + Sync {}
impl<T: AsRef<[u8]> + Send + Sync> Bytes for T {}

/// The walls of a map. A clone is the same map.
#[derive(Clone)]
pub struct Map(Arc<Body>);

struct Body {
    bytes: Box<dyn Bytes>,
    header: Header,
    /// Where the boxes of each level lie among all boxes, the lowest level first.
    levels: Vec<Range<usize>>,
}

impl Map {
    /// A map of these walls. `outside_is_solid`: what lies outside of all walls is solid, as round the picture of a building;
    /// walls that enclose something solid have it on their left.
    ///
    /// # Errors
    /// When there are too many, or a number is not finite.
    pub fn build(walls: &[Capsule], outside_is_solid: bool, raster: Option<Raster>) -> Result<Map, MapError> {
        Map::read(build::bytes(walls, outside_is_solid, raster)?)
    }

    /// A map that these bytes hold. They are checked: lengths, checksum, numbers.
    ///
    /// # Errors
    /// When they are not one.
    pub fn read(bytes: impl AsRef<[u8]> + Send + Sync + 'static) -> Result<Map, MapError> {
        let (header, levels) = format::check(bytes.as_ref())?;
        Ok(Map(Arc::new(Body { bytes: Box::new(bytes), header, levels })))
    }

    /// Its bytes, for a file.
    pub fn bytes(&self) -> &[u8] {
        (*self.0.bytes).as_ref()
    }

    /// The checksum over them.
    pub fn checksum(&self) -> u64 {
        self.0.header.checksum
    }

    /// How many walls it has.
    pub fn len(&self) -> usize {
        self.0.header.walls
    }

    /// Whether it has none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The smallest rectangle round its walls and its cells: lowest and highest corner, m; zero without both.
    pub fn bounds_m(&self) -> [Point2<f64>; 2] {
        self.0.header.bounds_m
    }

    /// The cells that it was made of, if it was.
    pub fn raster(&self) -> Option<Raster> {
        self.0.header.raster
    }

    /// What lies outside of all walls is solid.
    pub fn outside_is_solid(&self) -> bool {
        self.0.header.outside_is_solid
    }

    /// A wall.
    ///
    /// # Panics
    /// When there is no wall of this index.
    pub fn wall(&self, index: usize) -> Capsule {
        format::wall(self.parts().walls, index)
    }

    /// All walls, in the order of their indices.
    pub fn walls(&self) -> impl Iterator<Item = Capsule> + '_ {
        let walls = self.parts().walls;
        (0..self.len()).map(move |index| format::wall(walls, index))
    }

    fn parts(&self) -> format::Parts<'_> {
        format::parts(self.bytes(), &self.0.header)
    }
}

impl fmt::Debug for Map {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Map({} walls, {:016x})", self.len(), self.checksum())
    }
}

impl PartialEq for Map {
    fn eq(&self, other: &Map) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || self.bytes() == other.bytes()
    }
}
