//! Maps of ROS map_server: a YAML file that says where a picture lies and what its shades mean.
//!
//! The occupancy of a cell is one less its brightness (with `negate`, its brightness). Above `occupied_thresh` it is an
//! obstacle, below `free_thresh` it is free, and in between it is unknown. The modes differ in what they make of a transparent cell
//! and of the numbers, as in Nav2: in `trinary` opacity counts as one more colour; in `scale` a transparent cell is unknown; in `raw`
//! the shade is the occupancy in percent, and what is above 100 is unknown. Nav2 keeps degrees of occupancy in the last two; a
//! world of solid bodies has none, so the thresholds decide there as well.

use super::picture::{self, Pixel};
use super::{Bad, Source, map_of_cells};
use crate::files::beside;
use geometry::Map;
use geometry::map::raster::CELLS_MAX;
use geometry::map::{Cells, Raster};
use nalgebra::Point2;
use std::f64::consts::TAU;

const YAML_BYTES_MAX: u64 = 64 << 10;
/// A PGM in ASCII may take four characters a cell.
const PICTURE_BYTES_MAX: u64 = 4 * CELLS_MAX as u64 + (64 << 10);
/// Cells of another size are a mistake, m.
const CELL_M: std::ops::RangeInclusive<f64> = 1e-4..=1e3;

/// How a shade is to be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Trinary,
    Scale,
    Raw,
}

/// What the YAML file says.
#[derive(Debug, PartialEq)]
struct Server {
    image: String,
    cell_m: f64,
    origin: [f64; 3],
    negate: bool,
    occupied_thresh: f64,
    free_thresh: f64,
    mode: Mode,
}

/// Reads a map.
pub(super) fn read(path: &str, source: &Source<'_>, unknown_is_solid: bool) -> Result<Map, Bad> {
    let bytes = source.read(path, YAML_BYTES_MAX)?;
    let text = std::str::from_utf8(&bytes).map_err(|_| Bad::new("it is not a text in UTF-8", "is it a YAML file?"))?;
    let server = Server::parse(text)?;
    let image = beside(path, &server.image);
    let bytes = source.read(&image, PICTURE_BYTES_MAX).map_err(|bad| bad.within(&server.image))?;
    server.map(&bytes, unknown_is_solid).map_err(|bad| bad.within(&server.image))
}

impl Server {
    fn parse(text: &str) -> Result<Server, Bad> {
        let entries = entries(text)?;
        let known = ["image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode"];
        let hint = || format!("its keys are {}", known.join(", "));
        if let Some((key, _, line)) = entries.iter().find(|(key, ..)| !known.contains(&key.as_str())) {
            return Err(Bad::new(format!("line {line}: unknown key `{key}`"), hint()));
        }
        let find = |key: &str| entries.iter().find(|(name, ..)| name == key);
        let needed = |key: &str| find(key).ok_or_else(|| Bad::new(format!("it has no `{key}`"), hint()));
        let number = |(key, value, line): &Entry| {
            let found = value.first().filter(|_| value.len() == 1).and_then(|word| word.parse::<f64>().ok());
            found.filter(|number| number.is_finite()).ok_or_else(|| {
                Bad::new(format!("line {line}: `{key}` is not a number"), "write it as in `resolution: 0.05`")
            })
        };
        let or = |key: &str, default: f64| find(key).map_or(Ok(default), number);
        let (_, image, line) = needed("image")?;
        let [image] = image.as_slice() else {
            return Err(Bad::new(
                format!("line {line}: `image` is not a path"),
                "it names the picture, a PGM or a PNG",
            ));
        };
        let cell_m = number(needed("resolution")?)?;
        if !CELL_M.contains(&cell_m) {
            let message = format!("`resolution` is {cell_m} m, and cells are {} to {} m", CELL_M.start(), CELL_M.end());
            return Err(Bad::new(message, "it is the side of a pixel in metres"));
        }
        let (_, origin, line) = needed("origin")?;
        let numbers: Vec<f64> = origin.iter().filter_map(|word| word.parse().ok()).collect();
        let is_origin = |numbers: &[f64]| {
            numbers.len() == 3 && origin.len() == 3 && numbers.iter().all(|number| number.abs() <= geometry::map::FAR_M)
        };
        if !is_origin(&numbers) {
            let message = format!("line {line}: `origin` is not [x, y, yaw]");
            return Err(Bad::new(message, "it is the lower left corner of the picture, m, m and rad"));
        }
        let negate = match or("negate", 0.0)? {
            0.0 => false,
            1.0 => true,
            other => return Err(Bad::new(format!("`negate` is {other}"), "it is 0 or 1")),
        };
        let (occupied_thresh, free_thresh) = (or("occupied_thresh", 0.65)?, or("free_thresh", 0.196)?);
        if !(0.0..=1.0).contains(&free_thresh) || !(free_thresh..=1.0).contains(&occupied_thresh) {
            let message = format!("the thresholds are free {free_thresh}, occupied {occupied_thresh}");
            return Err(Bad::new(message, "both are 0 to 1, and `free_thresh` is not above `occupied_thresh`"));
        }
        let mode = match find("mode").map(|(_, value, line)| (value.join(" "), line)) {
            None => Mode::Trinary,
            Some((word, _)) if word == "trinary" => Mode::Trinary,
            Some((word, _)) if word == "scale" => Mode::Scale,
            Some((word, _)) if word == "raw" => Mode::Raw,
            Some((word, line)) => {
                return Err(Bad::new(format!("line {line}: unknown mode `{word}`"), "modes: trinary, scale, raw"));
            }
        };
        let origin = [numbers[0], numbers[1], numbers[2] % TAU];
        Ok(Server { image: image.clone(), cell_m, origin, negate, occupied_thresh, free_thresh, mode })
    }

    /// Whether a cell is an obstacle; nothing if that is unknown.
    fn is_solid(&self, pixel: Pixel) -> Option<bool> {
        let Pixel { shade, opacity } = pixel;
        let occupancy = match self.mode {
            Mode::Raw => {
                let percent = (shade * 255.0).round();
                if percent > 100.0 {
                    return None;
                }
                percent / 100.0
            }
            Mode::Scale if opacity.is_some_and(|opacity| opacity < 1.0) => return None,
            Mode::Trinary | Mode::Scale => {
                let shade = match opacity {
                    Some(opacity) if self.mode == Mode::Trinary => (3.0 * shade + opacity) / 4.0,
                    _ => shade,
                };
                if self.negate { shade } else { 1.0 - shade }
            }
        };
        if occupancy > self.occupied_thresh {
            Some(true)
        } else if occupancy < self.free_thresh {
            Some(false)
        } else {
            None
        }
    }

    fn map(&self, bytes: &[u8], unknown_is_solid: bool) -> Result<Map, Bad> {
        let mut cells = None;
        let [columns, rows] = picture::read(bytes, &mut |[columns, rows], row, pixels| {
            let cells = cells.get_or_insert_with(|| Cells::new(columns, rows).expect("the size was checked"));
            // The first row of a picture is the upper one.
            let up = rows as usize - 1 - row;
            for (column, pixel) in pixels.iter().enumerate() {
                if self.is_solid(*pixel).unwrap_or(unknown_is_solid) {
                    cells.fill(column, up);
                }
            }
        })?;
        let [x, y, yaw_rad] = self.origin;
        let raster = Raster { origin: Point2::new(x, y), yaw_rad, cell_m: self.cell_m, columns, rows };
        let cells = cells.ok_or_else(|| Bad::new("it has no pixel", "is it the right picture?"))?;
        map_of_cells(&cells, raster)
    }
}

/// A key, the words of its value, and its line.
type Entry = (String, Vec<String>, usize);

/// The entries of a flat YAML file: words and lists of words. That is all that map_server writes.
fn entries(text: &str) -> Result<Vec<Entry>, Bad> {
    let hint = "map_server writes lines such as `resolution: 0.05` and `origin: [0.0, 0.0, 0.0]`";
    let mut entries: Vec<Entry> = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let number = index + 1;
        let bad = |what: &str| Bad::new(format!("line {number}: {what}"), hint);
        let line = without_comment(line);
        if line.trim().is_empty() || line.trim() == "---" {
            continue;
        }
        if let Some(item) = line.trim_start().strip_prefix("- ") {
            let (_, words, _) = entries.last_mut().ok_or_else(|| bad("a list without a key"))?;
            words.push(unquoted(item));
            continue;
        }
        let (key, value) = line.split_once(':').ok_or_else(|| bad("it has no `:`"))?;
        if key.starts_with(char::is_whitespace) || key.contains(['{', '[']) {
            return Err(bad("an entry in an entry"));
        }
        let value = value.trim();
        let words = match value.strip_prefix('[') {
            Some(list) => {
                let list = list.strip_suffix(']').ok_or_else(|| bad("a list that does not end on its line"))?;
                list.split(',').map(unquoted).filter(|word| !word.is_empty()).collect()
            }
            None if value.is_empty() => Vec::new(),
            None => vec![unquoted(value)],
        };
        if entries.iter().any(|(known, ..)| known == key.trim()) {
            return Err(bad(&format!("`{}` is there twice", key.trim())));
        }
        entries.push((key.trim().to_owned(), words, number));
    }
    Ok(entries)
}

/// A line up to a `#` that is not in quotes.
fn without_comment(line: &str) -> &str {
    let mut quote = None;
    let end = line.char_indices().find(|(at, c)| match (quote, c) {
        (None, '#') => *at == 0 || line[..*at].ends_with(char::is_whitespace),
        (None, '"' | '\'') => {
            quote = Some(*c);
            false
        }
        (Some(open), c) if open == *c => {
            quote = None;
            false
        }
        _ => false,
    });
    end.map_or(line, |(at, _)| &line[..at])
}

fn unquoted(word: &str) -> String {
    let word = word.trim();
    let inner = |quote: char| word.strip_prefix(quote).and_then(|word| word.strip_suffix(quote));
    inner('"').or_else(|| inner('\'')).unwrap_or(word).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    const YAML: &str = "image: a.pgm\nresolution: 0.05\norigin: [-1.0, 2.5, 0.5]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n";

    #[test]
    fn a_file_as_map_server_writes_it_is_read() {
        let server = Server::parse(YAML).unwrap();
        let expected = Server {
            image: "a.pgm".to_owned(),
            cell_m: 0.05,
            origin: [-1.0, 2.5, 0.5],
            negate: false,
            occupied_thresh: 0.65,
            free_thresh: 0.25,
            mode: Mode::Trinary,
        };
        assert_eq!(server, expected);
        let other = "---\n# a map\nimage: \"my # map.png\"  # here\nresolution: 5e-2\norigin:\n  - -1.0\n- 2.5\n  - 0.5\nmode: raw\n";
        let server = Server::parse(other).unwrap();
        assert_eq!((server.image.as_str(), server.origin, server.mode), ("my # map.png", [-1.0, 2.5, 0.5], Mode::Raw));
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        for (from, to, cause) in [
            ("resolution: 0.05", "resolution: zero", "line 2: `resolution` is not a number"),
            ("resolution: 0.05", "resolution: 0", "`resolution` is 0 m"),
            ("resolution: 0.05", "resolution: nan", "line 2: `resolution` is not a number"),
            ("origin: [-1.0, 2.5, 0.5]", "origin: [-1.0, 2.5]", "line 3: `origin` is not [x, y, yaw]"),
            ("origin: [-1.0, 2.5, 0.5]", "origin: [1e300, 2.5, 0]", "line 3: `origin` is not [x, y, yaw]"),
            ("origin: [-1.0, 2.5, 0.5]", "origin: [-1.0, 2.5", "line 3: a list that does not end on its line"),
            ("negate: 0", "negate: 2", "`negate` is 2"),
            ("negate: 0", "mode: trinity", "line 4: unknown mode `trinity`"),
            ("negate: 0", "negat: 0", "line 4: unknown key `negat`"),
            ("negate: 0", "negate 0", "line 4: it has no `:`"),
            ("negate: 0", "image: b.pgm", "line 4: `image` is there twice"),
            ("free_thresh: 0.25", "free_thresh: 0.9", "the thresholds are free 0.9, occupied 0.65"),
            ("image: a.pgm\n", "", "it has no `image`"),
        ] {
            let error = Server::parse(&YAML.replace(from, to)).unwrap_err();
            assert!(error.message.starts_with(cause), "{to}: {}", error.message);
        }
    }

    #[test]
    fn shades_are_read_as_the_mode_says() {
        let server = |mode: Mode, negate: bool| Server { mode, negate, ..Server::parse(YAML).unwrap() };
        let (black, grey, white) = (Some(0.0), Some(0.5), Some(1.0));
        let see = |server: &Server, shade: Option<f64>, opacity: Option<f64>| {
            server.is_solid(Pixel { shade: shade.unwrap(), opacity })
        };
        let trinary = server(Mode::Trinary, false);
        assert_eq!([black, grey, white].map(|shade| see(&trinary, shade, None)), [Some(true), None, Some(false)]);
        let negated = server(Mode::Trinary, true);
        assert_eq!([black, grey, white].map(|shade| see(&negated, shade, None)), [Some(false), None, Some(true)]);
        // Opacity is one more colour: a black pixel that is opaque is at a quarter of the brightness.
        assert_eq!(see(&trinary, black, Some(1.0)), Some(true));
        assert_eq!(see(&trinary, white, Some(0.0)), None);
        let scale = server(Mode::Scale, false);
        assert_eq!([black, grey, white].map(|shade| see(&scale, shade, Some(1.0))), [Some(true), None, Some(false)]);
        assert_eq!(see(&scale, black, Some(0.5)), None);
        let raw = server(Mode::Raw, true);
        let percent = |percent: f64| see(&raw, Some(percent / 255.0), None);
        assert_eq!(
            [0.0, 24.0, 50.0, 66.0, 100.0, 101.0, 255.0].map(percent),
            [Some(false), Some(false), None, Some(true), Some(true), None, None]
        );
    }
}
