//! Maps of the Moving AI lab (N. R. Sturtevant, "Benchmarks for grid-based pathfinding", IEEE T-CIAIG 4(2), 2012), and their lists
//! of problems: a start, a goal, and the length of the shortest way between them in octile steps.
//!
//! `.`, `G` and `S` can be driven on; everything else (`@`, `O` out of bounds, `T` trees, `W` water) is solid. The formats count rows
//! from above; here y goes up, so the cell in column x and row y has its middle at `(x + 0.5, height - y - 0.5)` cells.

use super::{Bad, Source, map_of_cells};
use geometry::Map;
use geometry::map::raster::CELLS_MAX;
use geometry::map::{Cells, Raster};
use nalgebra::Point2;

const MAP_BYTES_MAX: u64 = CELLS_MAX as u64 + (1 << 20);
const SCEN_BYTES_MAX: u64 = 16 << 20;

/// Reads a map, whose cells have this side, m.
pub(super) fn read(path: &str, source: &Source<'_>, cell_m: f64) -> Result<Map, Bad> {
    let bytes = source.read(path, MAP_BYTES_MAX)?;
    let (cells, [columns, rows]) = parse(&bytes)?;
    map_of_cells(&cells, Raster { origin: Point2::origin(), yaw_rad: 0.0, cell_m, columns, rows })
}

fn parse(bytes: &[u8]) -> Result<(Cells, [u32; 2]), Bad> {
    let hint = "it begins with `type octile`, `height H`, `width W`, `map`";
    let mut lines = bytes.split(|byte| *byte == b'\n').map(|line| line.strip_suffix(b"\r").unwrap_or(line));
    let (mut height, mut width, mut number) = (None, None, 0);
    loop {
        number += 1;
        let line = lines.next().ok_or_else(|| Bad::new("it has no line `map`", hint))?;
        let line = String::from_utf8_lossy(&line[..line.len().min(80)]).into_owned();
        let mut words = line.split_whitespace();
        match (words.next(), words.next(), words.next()) {
            (Some("type"), Some(_), None) => {}
            (Some("height"), Some(count), None) => height = count.parse::<u32>().ok(),
            (Some("width"), Some(count), None) => width = count.parse::<u32>().ok(),
            (Some("map"), None, _) => break,
            _ => return Err(Bad::new(format!("line {number} is not one of its header"), hint)),
        }
    }
    let (Some(height), Some(width)) = (height, width) else {
        return Err(Bad::new("its header has no height and width", hint));
    };
    let size = format!("it says that it has {width} x {height} cells");
    // Each cell is a byte: what is not there is not taken memory for.
    if u64::from(width) * u64::from(height) > bytes.len() as u64 {
        return Err(Bad::new(format!("{size}, and has {} bytes", bytes.len()), "is it cut off?"));
    }
    let mut cells = Cells::new(width, height)
        .ok_or_else(|| Bad::new(format!("{size}, and a map has at most {CELLS_MAX}"), "is it damaged?"))?;
    for row in 0..height as usize {
        let line = lines.next().filter(|line| line.len() == width as usize).ok_or_else(|| {
            Bad::new(format!("line {}: it does not have {width} cells", number + 1 + row), "is it cut off?")
        })?;
        for (column, cell) in line.iter().enumerate() {
            match cell {
                b'.' | b'G' | b'S' => {}
                b'@' | b'O' | b'T' | b'W' => cells.fill(column, height as usize - 1 - row),
                other => {
                    let cell = char::from(*other).escape_debug();
                    let message = format!("line {}: unknown cell `{cell}`", number + 1 + row);
                    return Err(Bad::new(message, "cells are . G S, which are free, and @ O T W"));
                }
            }
        }
    }
    Ok((cells, [width, height]))
}

/// Start and goal of the first problems of a list for a map with these cells, m.
pub(crate) fn scen(
    path: &str,
    count: usize,
    raster: &Raster,
    source: &Source<'_>,
) -> Result<Vec<[Point2<f64>; 2]>, (String, String)> {
    let read = || {
        let bytes = source.read(path, SCEN_BYTES_MAX)?;
        let text = std::str::from_utf8(&bytes).map_err(|_| Bad::new("it is not a text in UTF-8", "is it a .scen?"))?;
        problems(text, count, raster)
    };
    read().map_err(|Bad { message, hint }| (format!("`{path}`: {message}"), hint))
}

fn problems(text: &str, count: usize, raster: &Raster) -> Result<Vec<[Point2<f64>; 2]>, Bad> {
    let hint = "a line has bucket, map, width, height, start x, y, goal x, y, and the length of the shortest way";
    let mut lines = text.lines().zip(1..).filter(|(line, _)| !line.trim().is_empty());
    if !lines.next().is_some_and(|(line, _)| line.trim_start().starts_with("version")) {
        return Err(Bad::new("it does not begin with `version`", "is it a .scen of MovingAI?"));
    }
    let mut places = Vec::new();
    for (line, number) in lines.take(count) {
        let words: Vec<&str> = line.split(['\t', ' ']).filter(|word| !word.is_empty()).collect();
        let bad = || Bad::new(format!("line {number} is not a problem"), hint);
        // The name of a map may have spaces in it.
        let tail = words.len().checked_sub(7).filter(|before| *before >= 2).map(|before| &words[before..]);
        let [cells @ .., _] = tail.ok_or_else(bad)? else { return Err(bad()) };
        let numbers: Vec<u32> = cells.iter().filter_map(|word| word.parse().ok()).collect();
        let [width, height, from_x, from_y, to_x, to_y] = numbers[..] else { return Err(bad()) };
        if (width, height) != (raster.columns, raster.rows) {
            let message = format!("line {number}: it is for a map of {width} x {height} cells");
            return Err(Bad::new(message, format!("the map has {} x {}", raster.columns, raster.rows)));
        }
        if from_x.max(to_x) >= width || from_y.max(to_y) >= height {
            return Err(Bad::new(format!("line {number}: a place outside of the map"), hint));
        }
        let at = |x: u32, y: u32| raster.at(f64::from(x) + 0.5, f64::from(height - y) - 0.5);
        places.push([at(from_x, from_y), at(to_x, to_y)]);
    }
    if places.len() < count {
        let message = format!("it has {} problems, and the layout {count} robots", places.len());
        return Err(Bad::new(message, "lower `robots`"));
    }
    Ok(places)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAP: &str = "type octile\nheight 3\nwidth 4\nmap\n....\n.@TW\nOGS.\n";

    #[test]
    fn rows_go_down_in_the_file_and_up_in_the_world() {
        let (cells, size) = parse(MAP.as_bytes()).unwrap();
        assert_eq!((size, cells.solid_count()), ([4, 3], 4));
        assert!(cells.is_solid(0, 0) && cells.is_solid(1, 1) && !cells.is_solid(0, 2));
        let raster = Raster { origin: Point2::origin(), yaw_rad: 0.0, cell_m: 2.0, columns: 4, rows: 3 };
        let text = "version 1.0\n0\tmaps/my map.map\t4\t3\t0\t0\t3\t2\t5.0\n0\ta.map\t4\t3\t1\t2\t2\t2\t1\n";
        let places = problems(text, 2, &raster).unwrap();
        assert_eq!(places[0], [Point2::new(1.0, 5.0), Point2::new(7.0, 1.0)]);
        assert_eq!(places[1], [Point2::new(3.0, 1.0), Point2::new(5.0, 1.0)]);
        for (text, count, cause) in [
            (text, 3, "it has 2 problems, and the layout 3 robots"),
            (&text.replace("\t4\t3\t0", "\t5\t3\t0"), 1, "line 2: it is for a map of 5 x 3 cells"),
            (&text.replace("\t3\t2\t5.0", "\t4\t2\t5.0"), 1, "line 2: a place outside of the map"),
            ("version 1\nnonsense\n", 1, "line 2 is not a problem"),
            ("", 1, "it does not begin with `version`"),
        ] {
            assert_eq!(problems(text, count, &raster).unwrap_err().message, cause);
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (from, to, cause) in [
            ("height 3", "height 4", "line 8: it does not have 4 cells"),
            ("width 4", "width 5", "line 5: it does not have 5 cells"),
            ("height 3", "height 4000000000", "it says that it has 4 x 4000000000 cells, and has"),
            ("height 3", "height -3", "its header has no height and width"),
            ("map\n", "", "line 4 is not one of its header"),
            ("....", "..x.", "line 5: unknown cell `x`"),
            ("....", "..\u{ff}.", "line 5: it does not have 4 cells"),
        ] {
            let error = parse(MAP.replace(from, to).as_bytes()).unwrap_err();
            assert!(error.message.starts_with(cause), "{to}: {}", error.message);
        }
        assert_eq!(parse(b"").unwrap_err().message, "line 1 is not one of its header");
    }
}
