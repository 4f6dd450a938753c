//! Grey pictures: PGM (P2 and P5), read by hand, and PNG.

use super::Bad;
use geometry::map::raster::CELLS_MAX;

/// A pixel: its brightness, and its opacity if the picture has one; both 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Pixel {
    pub(super) shade: f64,
    pub(super) opacity: Option<f64>,
}

/// Is shown columns and rows of the picture, the number of a row from above, and its pixels.
pub(super) type See<'a> = dyn FnMut([u32; 2], usize, &[Pixel]) + 'a;

/// Reads a picture row by row from above, and gives back columns and rows.
pub(super) fn read(bytes: &[u8], see: &mut See<'_>) -> Result<[u32; 2], Bad> {
    match bytes {
        [b'P', b'2', ..] => pgm(bytes, false, see),
        [b'P', b'5', ..] => pgm(bytes, true, see),
        [0x89, b'P', b'N', b'G', ..] => png(bytes, see),
        [] => Err(Bad::new("the file is empty", "is it the right picture?")),
        _ => Err(Bad::new("it is neither a PGM (P2, P5) nor a PNG", "convert it, as in `convert map.jpg map.pgm`")),
    }
}

/// Refuses a size that no map has.
fn check([columns, rows]: [u32; 2]) -> Result<[u32; 2], Bad> {
    let cells = u64::from(columns) * u64::from(rows);
    if cells == 0 {
        return Err(Bad::new(format!("it says that it has {columns} x {rows} pixels"), "is it damaged?"));
    }
    if cells > CELLS_MAX as u64 {
        let message = format!("it says that it has {columns} x {rows} pixels, and a map has at most {CELLS_MAX}");
        return Err(Bad::new(message, "scale it down, and raise `resolution`"));
    }
    Ok([columns, rows])
}

fn cut_off() -> Bad {
    Bad::new("it ends before its last pixel", "is it cut off?")
}

fn pgm(bytes: &[u8], is_binary: bool, see: &mut See<'_>) -> Result<[u32; 2], Bad> {
    let mut words = Words { bytes, at: 2 };
    let mut next = |what: &str| {
        words
            .number()
            .ok_or_else(|| Bad::new(format!("its header has no {what}"), "a PGM begins as in `P5 640 480 255`"))
    };
    let size = check([next("width")?, next("height")?])?;
    let most = next("greatest shade")?;
    if !(1..=65535).contains(&most) {
        return Err(Bad::new(format!("its greatest shade is {most}"), "it is 1 to 65535, and mostly 255"));
    }
    let [columns, rows] = size.map(|side| side as usize);
    // One whitespace ends the header; then there are pixels, whatever they look like.
    let pixels = bytes.get(words.at + 1..).unwrap_or_default();
    let width = if most > 255 { 2 } else { 1 };
    // A shade in ASCII takes a digit and a space at least.
    if pixels.len() < (columns * rows).saturating_mul(if is_binary { width } else { 2 }).saturating_sub(1) {
        return Err(cut_off());
    }
    let scale = 1.0 / f64::from(most);
    let mut row_of = vec![Pixel::default(); columns];
    for row in 0..rows {
        for (column, pixel) in row_of.iter_mut().enumerate() {
            let shade = if is_binary {
                let at = (row * columns + column) * width;
                let shade = pixels.get(at..at + width).ok_or_else(cut_off)?;
                shade.iter().fold(0, |sum, byte| sum << 8 | u32::from(*byte))
            } else {
                words.number().ok_or_else(cut_off)?
            };
            if shade > most {
                return Err(Bad::new(
                    format!("a pixel of row {row} is {shade}, and the greatest shade {most}"),
                    "is it damaged?",
                ));
            }
            pixel.shade = f64::from(shade) * scale;
        }
        see(size, row, &row_of);
    }
    Ok(size)
}

/// The numbers of a PGM. A `#` begins a comment, to the end of its line.
struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Words<'_> {
    fn number(&mut self) -> Option<u32> {
        loop {
            match self.bytes.get(self.at)? {
                b'#' => self.at += self.bytes[self.at..].iter().position(|byte| *byte == b'\n')?,
                byte if byte.is_ascii_whitespace() => self.at += 1,
                _ => break,
            }
        }
        let rest = &self.bytes[self.at..];
        let digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
        self.at += digits;
        std::str::from_utf8(&rest[..digits]).ok()?.parse().ok()
    }
}

fn png(bytes: &[u8], see: &mut See<'_>) -> Result<[u32; 2], Bad> {
    let damaged =
        |error: png::DecodingError| Bad::new(format!("it is not a PNG that can be read: {error}"), "is it cut off?");
    // What its header tells takes no memory before it has been looked at; a row is all that is kept.
    let mut decoder = png::Decoder::new_with_limits(std::io::Cursor::new(bytes), png::Limits { bytes: 64 << 20 });
    decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
    let mut reader = decoder.read_info().map_err(damaged)?;
    let size = check([reader.info().width, reader.info().height])?;
    if reader.info().interlaced {
        return Err(Bad::new(
            "it is interlaced",
            "save it without interlacing, as in `convert in.png -interlace none out.png`",
        ));
    }
    let (color, _) = reader.output_color_type();
    let (colors, has_opacity) = match color {
        png::ColorType::Grayscale => (1, false),
        png::ColorType::GrayscaleAlpha => (1, true),
        png::ColorType::Rgb => (3, false),
        png::ColorType::Rgba => (3, true),
        png::ColorType::Indexed => return Err(Bad::new("its palette cannot be read", "save it in shades of grey")),
    };
    let mut pixels = Vec::with_capacity(size[0] as usize);
    for row in 0..size[1] as usize {
        let line = reader.next_row().map_err(damaged)?.ok_or_else(cut_off)?;
        pixels.clear();
        pixels.extend(line.data().chunks_exact(colors + usize::from(has_opacity)).map(|channels| {
            let sum: u32 = channels[..colors].iter().map(|channel| u32::from(*channel)).sum();
            let opacity = has_opacity.then(|| f64::from(channels[colors]) / 255.0);
            Pixel { shade: f64::from(sum) / (255.0 * colors as f64), opacity }
        }));
        if pixels.len() != size[0] as usize {
            return Err(cut_off());
        }
        see(size, row, &pixels);
    }
    Ok(size)
}
