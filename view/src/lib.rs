//! Pictures as SVG: what a run looked like, and the figures of the papers.
//!
//! `pad` draws lines and letters with plotters, `axes` knows where a number is on the paper, `scene` takes from a
//! record what can be seen of a run, `run`, `series`, `histogram` and `boxes` are the pictures. Everything is pure: data in, text out.

mod axes;
pub mod boxes;
pub mod histogram;
mod pad;
pub mod run;
pub mod scene;
pub mod series;
mod surface;
mod thin;

use pad::Color;

/// Colours that people can tell apart, on white. Red is not among them: it marks contacts.
const COLORS: [u32; 20] = [
    0x1f77b4, 0xff7f0e, 0x2ca02c, 0x9467bd, 0x8c564b, 0xe377c2, 0x17becf, 0xb5a300, 0x6b7280, 0x0b3c8c, 0x00876c,
    0xb8660b, 0x7b2cbf, 0x5d8a00, 0xc51b7d, 0x4cb3e0, 0xa44a3f, 0x3a5a40, 0xf2a35e, 0x264653,
];

/// The colour of the n-th thing of `count`: from the list while it lasts, else from round the colour wheel.
fn color(n: usize, count: usize) -> Color {
    if count <= COLORS.len() {
        return Color::hex(COLORS[n % COLORS.len()]);
    }
    // Steps of the golden angle put neighbours far apart, however many there are.
    let hue = (n as f64 * 0.618_034).fract();
    Color::hue(hue, [0.62, 0.8][n % 2], [0.36, 0.46, 0.56][n % 3])
}

/// Text colours and those of things that are not the subject.
const INK: Color = Color::hex(0x1f2933);
const FAINT_INK: Color = Color::hex(0x65717f);
const GRID: Color = Color::hex(0xe7eaee);
const STONE: Color = Color::hex(0xc5ccd6);
const STONE_EDGE: Color = Color::hex(0x8b95a3);
const MOVING: Color = Color::hex(0xb48a5a);
const CONTACT: Color = Color::hex(0xd61f26);
