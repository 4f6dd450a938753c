//! Polygons of a GeoJSON file (RFC 7946), with positions in metres. The inside of a polygon is solid, but for its holes; what lies
//! outside of all polygons is free.

use super::{Bad, Source};
use geometry::map::FAR_M;
use geometry::{Capsule, Map};
use nalgebra::Point2;
use serde_json::Value;

/// A parsed file takes up to fifty times its size.
const BYTES_MAX: u64 = 8 << 20;

/// Reads a map.
pub(super) fn read(path: &str, source: &Source<'_>) -> Result<Map, Bad> {
    let bytes = source.read(path, BYTES_MAX)?;
    let value: Value = serde_json::from_slice(&bytes)
        .map_err(|error| Bad::new(format!("it is not JSON: {error}"), "is it a GeoJSON file, and whole?"))?;
    let mut walls = Vec::new();
    take(&value, &mut walls)?;
    if walls.is_empty() {
        return Err(Bad::new("it has no polygon", "walls are geometries of type Polygon or MultiPolygon"));
    }
    Ok(Map::build(&walls, false, None)?)
}

/// Takes the polygons of an object.
fn take(object: &Value, walls: &mut Vec<Capsule>) -> Result<(), Bad> {
    let list = |key: &str| {
        let list = object.get(key).and_then(Value::as_array);
        list.ok_or_else(|| Bad::new(format!("an object has no list `{key}`"), "see RFC 7946"))
    };
    match object.get("type").and_then(Value::as_str) {
        Some("FeatureCollection") => list("features")?.iter().try_for_each(|feature| take(feature, walls)),
        Some("GeometryCollection") => list("geometries")?.iter().try_for_each(|geometry| take(geometry, walls)),
        // A feature may have no place.
        Some("Feature") => match object.get("geometry") {
            None | Some(Value::Null) => Ok(()),
            Some(geometry) => take(geometry, walls),
        },
        Some("Polygon") => polygon(list("coordinates")?, walls),
        Some("MultiPolygon") => list("coordinates")?.iter().try_for_each(|rings| match rings.as_array() {
            Some(rings) => polygon(rings, walls),
            None => Err(Bad::new("a polygon of a MultiPolygon is not a list", "see RFC 7946")),
        }),
        Some(other) => {
            let other: String = other.chars().take(40).flat_map(char::escape_debug).collect();
            Err(Bad::new(
                format!("a geometry of type `{other}` is not a wall"),
                "leave only Polygon and MultiPolygon in the file",
            ))
        }
        None => Err(Bad::new("an object has no `type`", "is it a GeoJSON file?")),
    }
}

/// Takes the rings of a polygon: the first is its outline, the others are holes.
fn polygon(rings: &[Value], walls: &mut Vec<Capsule>) -> Result<(), Bad> {
    for (place, ring) in rings.iter().enumerate() {
        let positions = ring.as_array().map(Vec::as_slice).unwrap_or_default();
        let mut corners: Vec<Point2<f64>> = Vec::with_capacity(positions.len());
        for position in positions {
            let numbers = position.as_array().map(Vec::as_slice).unwrap_or_default();
            let number =
                |index: usize| numbers.get(index).and_then(Value::as_f64).filter(|number| number.abs() <= FAR_M);
            let (Some(x), Some(y)) = (number(0), number(1)) else {
                return Err(Bad::new(
                    "a position is not a pair of metres within 1e7",
                    "write positions as in [12.5, -3.0]",
                ));
            };
            let corner = Point2::new(x, y);
            if corners.last() != Some(&corner) {
                corners.push(corner);
            }
        }
        if corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        if corners.len() < 3 {
            return Err(Bad::new(
                "a ring has fewer than three corners",
                "a ring lists its corners, and the first again",
            ));
        }
        let next = |index: usize| (index + 1) % corners.len();
        let area: f64 = (0..corners.len()).map(|i| corners[i].coords.perp(&corners[next(i)].coords)).sum();
        // What is solid is on the left of a wall: outlines go counter-clockwise, holes clockwise.
        let turned = (area > 0.0) != (place == 0);
        walls.extend((0..corners.len()).map(|i| {
            let (a, b) = (corners[i], corners[next(i)]);
            if turned { Capsule::segment(b, a) } else { Capsule::segment(a, b) }
        }));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(text: &str) -> Result<Map, Bad> {
        let mut walls = Vec::new();
        take(&serde_json::from_str(text).unwrap(), &mut walls)?;
        Ok(Map::build(&walls, false, None)?)
    }

    #[test]
    fn polygons_are_solid_but_for_their_holes_however_they_turn() {
        let outline = ["[0,0],[4,0],[4,4],[0,4],[0,0]", "[0,0],[0,4],[4,4],[4,0],[0,0]"];
        let hole = ["[1,1],[3,1],[3,3],[1,3],[1,1]", "[1,1],[1,3],[3,3],[3,1],[1,1]"];
        for (outline, hole) in outline.iter().flat_map(|outline| hole.iter().map(move |hole| (outline, hole))) {
            let text = format!(
                r#"{{"type":"FeatureCollection","features":[{{"type":"Feature","properties":{{}},"geometry":
                {{"type":"Polygon","coordinates":[[{outline}],[{hole}]]}}}},{{"type":"Feature","geometry":null}}]}}"#
            );
            let map = map(&text).unwrap();
            let solid = |x: f64, y: f64| map.is_solid(Point2::new(x, y));
            assert_eq!(map.len(), 8);
            assert!(solid(0.5, 0.5) && solid(3.5, 2.0) && !solid(2.0, 2.0) && !solid(5.0, 2.0) && !solid(-1.0, 0.5));
        }
        // Two that overlap are one.
        let two = r#"{"type":"MultiPolygon","coordinates":[[[[0,0],[2,0],[2,2],[0,2]]],[[[1,1],[3,1],[3,3],[1,3]]]]}"#;
        let map = map(two).unwrap();
        assert!([0.5, 1.5, 2.5].into_iter().all(|x| map.is_solid(Point2::new(x, x))));
        assert!(!map.is_solid(Point2::new(3.5, 1.5)));
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (text, cause) in [
            ("[]", "an object has no `type`"),
            (r#"{"type":"LineString","coordinates":[]}"#, "a geometry of type `LineString` is not a wall"),
            (r#"{"type":"Polygon"}"#, "an object has no list `coordinates`"),
            (r#"{"type":"Polygon","coordinates":[[[0,0],[1,0],[0,0]]]}"#, "a ring has fewer than three corners"),
            (r#"{"type":"Polygon","coordinates":[[[0,0],[1,1e9],[1,0]]]}"#, "a position is not a pair"),
            (r#"{"type":"Polygon","coordinates":[[[0,0],["a",1],[1,0]]]}"#, "a position is not a pair"),
        ] {
            let error = map(text).unwrap_err();
            assert!(error.message.starts_with(cause), "{text}: {}", error.message);
        }
    }
}
