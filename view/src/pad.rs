//! A sheet of paper in pixels, y down: the one file that names plotters.

use plotters::prelude::*;
use plotters::style::FontStyle;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// plotters draws on whole pixels. The sheet is this much finer than it is shown, so that curves are smooth.
const FINE: f64 = 4.0;
const FONT: &str = "Helvetica, Arial, sans-serif";

/// A colour and how much it covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Color(RGBAColor);

impl Color {
    pub(super) const fn hex(rgb: u32) -> Color {
        Color(RGBAColor((rgb >> 16) as u8, (rgb >> 8) as u8, rgb as u8, 1.0))
    }

    /// From hue, saturation and lightness, all 0 to 1.
    pub(super) fn hue(hue: f64, saturation: f64, lightness: f64) -> Color {
        let (red, green, blue) = plotters::style::Color::to_backend_color(&HSLColor(hue, saturation, lightness)).rgb;
        Color(RGBAColor(red, green, blue, 1.0))
    }

    /// The same, covering less.
    pub(super) fn faint(self, share: f64) -> Color {
        Color(RGBAColor(self.0.0, self.0.1, self.0.2, self.0.3 * share))
    }

    /// Between this colour (0) and the other (1).
    pub(super) fn towards(self, other: Color, share: f64) -> Color {
        let mix = |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * share).round() as u8;
        let (a, b) = (self.0, other.0);
        Color(RGBAColor(mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2), a.3 + (b.3 - a.3) * share))
    }
}

/// Which point of a text stands where it is put.
#[derive(Clone, Copy, Debug)]
pub(super) enum Anchor {
    Left,
    Middle,
    Right,
    /// Turned by a quarter to read upwards, middle.
    Up,
}

/// The sheet.
pub(super) struct Pad<'a>(DrawingArea<SVGBackend<'a>, plotters::coord::Shift>);

type Shape = ShapeStyle;

/// Draws a picture of this size, px.
pub(super) fn svg(width: f64, height: f64, draw: impl FnOnce(&Pad<'_>)) -> String {
    let mut text = String::new();
    let size = ((width * FINE).round() as u32, (height * FINE).round() as u32);
    {
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        let pad = Pad(area);
        sure(pad.0.fill(&WHITE));
        draw(&pad);
        sure(pad.0.present());
    }
    let fine = format!("<svg width=\"{}\" height=\"{}\"", size.0, size.1);
    text.replacen(&fine, &format!("<svg width=\"{}\" height=\"{}\"", width.round(), height.round()), 1)
}

/// What draws into a string cannot fail.
fn sure<T, E: std::fmt::Debug>(drawn: Result<T, E>) -> T {
    drawn.expect("a picture in memory")
}

fn fine([x, y]: [f64; 2]) -> (i32, i32) {
    ((x * FINE).round() as i32, (y * FINE).round() as i32)
}

fn stroke(color: Color, width: f64) -> Shape {
    Shape { color: color.0, filled: false, stroke_width: (width * FINE).round().max(1.0) as u32 }
}

fn fill(color: Color) -> Shape {
    Shape { color: color.0, filled: true, stroke_width: 0 }
}

impl Pad<'_> {
    pub(super) fn line(&self, points: &[[f64; 2]], color: Color, width: f64) {
        let mut points: Vec<(i32, i32)> = points.iter().copied().map(fine).collect();
        points.dedup();
        if points.len() > 1 {
            sure(self.0.draw(&PathElement::new(points, stroke(color, width))));
        }
    }

    /// A line of dots and gaps of these lengths, px.
    pub(super) fn dashes(&self, points: &[[f64; 2]], color: Color, width: f64, [on, off]: [f64; 2]) {
        let (mut dash, mut drawn, mut left) = (Vec::new(), true, on);
        // What is far from the paper is not dashed: it would take forever.
        let on_paper = |p: &[f64; 2]| p.iter().all(|x| x.abs() < 1e5);
        for leg in points.windows(2).filter(|leg| leg.iter().all(on_paper)) {
            let (mut from, to) = (leg[0], leg[1]);
            loop {
                let length = (to[0] - from[0]).hypot(to[1] - from[1]);
                let share = if length > left { left / length } else { 1.0 };
                let at = [from[0] + (to[0] - from[0]) * share, from[1] + (to[1] - from[1]) * share];
                if drawn {
                    dash.extend([from, at]);
                }
                if length <= left {
                    left -= length;
                    break;
                }
                self.line(&std::mem::take(&mut dash), color, width);
                (from, drawn) = (at, !drawn);
                left = if drawn { on } else { off };
            }
        }
        self.line(&dash, color, width);
    }

    pub(super) fn polygon(&self, corners: &[[f64; 2]], color: Color) {
        sure(self.0.draw(&Polygon::new(corners.iter().copied().map(fine).collect::<Vec<_>>(), fill(color))));
    }

    /// A closed line.
    pub(super) fn outline(&self, corners: &[[f64; 2]], color: Color, width: f64) {
        let closed: Vec<[f64; 2]> = corners.iter().chain(corners.first()).copied().collect();
        self.line(&closed, color, width);
    }

    pub(super) fn disc(&self, center: [f64; 2], radius: f64, color: Color) {
        sure(self.0.draw(&Circle::new(fine(center), (radius * FINE).round().max(1.0) as i32, fill(color))));
    }

    pub(super) fn ring(&self, center: [f64; 2], radius: f64, color: Color, width: f64) {
        let radius = (radius * FINE).round().max(1.0) as i32;
        sure(self.0.draw(&Circle::new(fine(center), radius, stroke(color, width))));
    }

    pub(super) fn cross(&self, [x, y]: [f64; 2], arm: f64, color: Color, width: f64) {
        self.line(&[[x - arm, y - arm], [x + arm, y + arm]], color, width);
        self.line(&[[x - arm, y + arm], [x + arm, y - arm]], color, width);
    }

    /// A text whose middle line is at y.
    pub(super) fn text(&self, at: [f64; 2], text: &str, size: f64, color: Color, anchor: Anchor) {
        self.letters(at, text, (size, FontStyle::Normal), color, anchor);
    }

    pub(super) fn bold(&self, at: [f64; 2], text: &str, size: f64, color: Color, anchor: Anchor) {
        self.letters(at, text, (size, FontStyle::Bold), color, anchor);
    }

    fn letters(&self, at: [f64; 2], text: &str, (size, style): (f64, FontStyle), color: Color, anchor: Anchor) {
        let horizontal = match anchor {
            Anchor::Left => HPos::Left,
            Anchor::Middle | Anchor::Up => HPos::Center,
            Anchor::Right => HPos::Right,
        };
        // plotters takes sizes as those of a line; the letters come out smaller by this.
        let font = FontDesc::new(FontFamily::Name(FONT), size * FINE * 1.24, style);
        let font = if matches!(anchor, Anchor::Up) { font.transform(FontTransform::Rotate270) } else { font };
        let style = TextStyle::from(font).color(&color.0).pos(Pos::new(horizontal, VPos::Center));
        sure(self.0.draw(&Text::new(text.to_owned(), fine(at), style)));
    }
}

/// About how wide a text is, px.
pub(super) fn width_of(text: &str, size: f64) -> f64 {
    0.56 * size * text.chars().count() as f64
}

/// A text in lines of about this width, px.
pub(super) fn wrapped(text: &str, size: f64, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width_of(line, size) + width_of(word, size) + 0.5 * size < width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// A number with three digits that matter.
pub(super) fn short(x: f64) -> String {
    match x.abs() {
        size if size >= 99.95 || size == 0.0 => format!("{x:.0}"),
        size if size >= 9.995 => format!("{x:.1}"),
        _ => format!("{x:.2}"),
    }
}
