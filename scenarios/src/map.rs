//! Maps: the file that `[world] map` names becomes walls.
//!
//! ```text
//! server    ROS map_server: a YAML file and a picture     picture   PGM and PNG
//! movingai  the format of the Moving AI lab, and its scenarios of starts and goals
//! geojson   polygons
//! ```
//!
//! No size that a file tells is believed before the bytes are there; sizes are bounded.

mod geojson;
mod movingai;
mod picture;
mod server;

pub(crate) use movingai::scen;

use crate::files::{Files, NamedIn};
use crate::node::Node;
use crate::problems::{Origin, Report};
use crate::table::{UnknownCells, World};
use geometry::Map;
use geometry::map::{Cells, MapError, Raster, WALLS_MAX};
use model::MapRef;
use model::key::Named;

/// What is wrong with a file, and the way out.
#[derive(Debug, PartialEq)]
pub(crate) struct Bad {
    message: String,
    hint: String,
}

impl Bad {
    fn new(message: impl Into<String>, hint: impl Into<String>) -> Bad {
        Bad { message: message.into(), hint: hint.into() }
    }

    /// The same, found in a file that the first one names.
    fn within(self, file: &str) -> Bad {
        Bad { message: format!("`{file}`: {}", self.message), ..self }
    }
}

impl From<MapError> for Bad {
    fn from(error: MapError) -> Bad {
        let hint = match error {
            MapError::TooMany(_) => "use a coarser map, or one with less noise in it",
            _ => "positions are metres, and within 1e7 m",
        };
        Bad::new(error.to_string(), hint)
    }
}

/// A file beside the scenario.
pub(crate) struct Source<'a> {
    pub(crate) files: &'a dyn Files,
    pub(crate) named_in: NamedIn,
}

impl<'a> Source<'a> {
    /// Files that a value from here names.
    pub(crate) fn of(files: &'a dyn Files, origin: Origin) -> Source<'a> {
        let named_in = if matches!(origin, Origin::Option(_)) { NamedIn::Option } else { NamedIn::Scenario };
        Source { files, named_in }
    }

    pub(crate) fn read(&self, path: &str, bytes_max: u64) -> Result<Vec<u8>, Bad> {
        let hint = "a path is relative to the scenario's file; one in an option, to where the command runs";
        self.files.read(path, self.named_in, bytes_max).map_err(|cause| Bad::new(cause, hint))
    }
}

/// The map of a scenario, if it has one. What is wrong is reported.
pub(crate) fn read(world: &Node, files: &dyn Files, report: &mut Report) -> Option<MapRef> {
    let Some(path) = world.get(World::map) else {
        for name in [World::map_unknown.any(), World::map_cell_m.any()] {
            if world.has(name) && !world.has(World::map) {
                report.add_hint(world.at(name), &world.key(name), "there is no map", "it goes with `map`");
            }
        }
        return None;
    };
    let source = Source::of(files, world.at(World::map));
    match map_of(&path, &source, world) {
        Ok(map) => Some(MapRef::new(path, map)),
        Err(Bad { message, hint }) => {
            report.add_hint(world.at(World::map), &world.key(World::map), format!("`{path}`: {message}"), hint);
            None
        }
    }
}

fn map_of(path: &str, source: &Source<'_>, world: &Node) -> Result<Map, Bad> {
    let ending = path.rsplit(['/', '.']).next().unwrap_or_default().to_ascii_lowercase();
    let unknown_is_solid = world.get(World::map_unknown) == UnknownCells::Obstacle;
    let cell_m = world.get(World::map_cell_m);
    if cell_m.is_some() && ending != "map" {
        return Err(Bad::new(
            "`map_cell_m` is for MovingAI maps",
            "leave it out: this file says itself how large it is",
        ));
    }
    match ending.as_str() {
        "yaml" | "yml" => server::read(path, source, unknown_is_solid),
        "map" => movingai::read(path, source, cell_m.unwrap_or(1.0)),
        "geojson" | "json" => geojson::read(path, source),
        "pgm" | "png" => Err(Bad::new(
            "a picture alone does not say where it lies",
            "name the YAML file of the map, which names the picture",
        )),
        _ => Err(Bad::new(
            "its ending says nothing of its format",
            "a map is a .yaml of ROS map_server, a .map of MovingAI, or a .geojson",
        )),
    }
}

/// The map of cells.
fn map_of_cells(cells: &Cells, raster: Raster) -> Result<Map, Bad> {
    let free = raster.columns as usize * raster.rows as usize - cells.solid_count();
    if free == 0 {
        return Err(Bad::new("it has no free cell", "are `negate` and the thresholds right?"));
    }
    let walls = cells.outlines(&raster, WALLS_MAX);
    Ok(Map::build(&walls, true, Some(raster))?)
}
