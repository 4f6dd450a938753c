//! Where a number is on the paper, and the frame that says so.

use super::pad::{Anchor, Pad};
use super::{FAINT_INK, GRID, INK};

const LABEL: f64 = 12.0;

/// Between the frame and the label of y, where the numbers leave room.
const LABEL_OFFSET: f64 = 46.0;

/// Numbers of an axis, and how they are written.
type Ticks = Vec<(f64, String)>;

/// From the smallest number to the largest.
pub(super) type Span = [f64; 2];

/// A rectangle on the paper and what part of the plane it shows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axes {
    left: f64,
    top: f64,
    width: f64,
    height: f64,
    x: Span,
    y: Span,
}

impl Axes {
    /// Shows `x` and `y` in a rectangle.
    pub(super) fn new([left, top]: [f64; 2], [width, height]: [f64; 2], x: Span, y: Span) -> Axes {
        Axes { left, top, width, height, x, y }
    }

    /// Shows `x` and `y` with equal scales in a rectangle of at most this size; what has an odd shape gets some more
    /// plane around it.
    pub(super) fn equal(corner: [f64; 2], [width_max, height_max]: [f64; 2], x: Span, y: Span) -> Axes {
        const SIDE_MIN: f64 = 260.0;
        let scale = (width_max / (x[1] - x[0])).min(height_max / (y[1] - y[0]));
        let grown = |[low, high]: Span| {
            let more = (0.5 * (SIDE_MIN / scale - (high - low))).max(0.0);
            [low - more, high + more]
        };
        let (x, y) = (grown(x), grown(y));
        Axes::new(corner, [scale * (x[1] - x[0]), scale * (y[1] - y[0])], x, y)
    }

    /// The same, lower on the paper.
    pub(super) fn lowered(self, by: f64) -> Axes {
        Axes { top: self.top + by, ..self }
    }

    pub(super) fn top(&self) -> f64 {
        self.top
    }

    pub(super) fn right(&self) -> f64 {
        self.left + self.width
    }

    pub(super) fn bottom(&self) -> f64 {
        self.top + self.height
    }

    pub(super) fn left(&self) -> f64 {
        self.left
    }

    /// Where a point is.
    pub(super) fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let share = |value: f64, [low, high]: Span| (value - low) / (high - low);
        [self.left + self.width * share(x, self.x), self.top + self.height * (1.0 - share(y, self.y))]
    }

    /// How long a length along x is.
    pub(super) fn length(&self, length: f64) -> f64 {
        length * self.width / (self.x[1] - self.x[0])
    }

    /// The same, further to the right where the numbers at its left are long.
    pub(super) fn with_room(self) -> Axes {
        Axes { left: self.left + (self.label_offset() - LABEL_OFFSET).max(0.0), ..self }
    }

    /// How far the label of y is from the frame: beyond the numbers.
    fn label_offset(&self) -> f64 {
        (widest(&self.y_ticks()) + 24.0).max(LABEL_OFFSET)
    }

    /// Numbers along x, so few that there is room between them.
    fn x_ticks(&self) -> Ticks {
        let mut about = (self.width / 70.0) as usize;
        loop {
            let found = ticks(self.x, about);
            let apart = found.windows(2).map(|pair| self.length(pair[1].0 - pair[0].0)).fold(f64::INFINITY, f64::min);
            if widest(&found) + 10.0 <= apart || about <= 2 {
                return found;
            }
            about -= 1;
        }
    }

    fn y_ticks(&self) -> Ticks {
        ticks(self.y, (self.height / 70.0) as usize)
    }

    /// Grid lines, numbers at them, and labels.
    pub(super) fn draw(&self, pad: &Pad<'_>, x_label: &str, y_label: &str) {
        let x_ticks = self.x_ticks();
        self.grid(pad, &x_ticks, &self.y_ticks());
        for (x, text) in &x_ticks {
            pad.text([self.at([*x, 0.0])[0], self.bottom() + 14.0], text, LABEL, FAINT_INK, Anchor::Middle);
        }
        self.labels(pad, x_label, y_label);
    }

    /// The same, where the x axis has names at places.
    pub(super) fn draw_named(&self, pad: &Pad<'_>, names: &[(f64, String)], x_label: &str, y_label: &str) {
        self.grid(pad, &[], &self.y_ticks());
        let room = self.width / names.len().max(1) as f64;
        let widest = names.iter().map(|(_, name)| super::pad::width_of(name, LABEL)).fold(0.0, f64::max);
        let every = (widest / room).ceil().max(1.0) as usize;
        for (x, name) in names.iter().step_by(every) {
            pad.text([self.at([*x, 0.0])[0], self.bottom() + 14.0], name, LABEL, FAINT_INK, Anchor::Middle);
        }
        self.labels(pad, x_label, y_label);
    }

    /// The same, where the y axis has rows: their names are for the caller to draw.
    pub(super) fn draw_rows(&self, pad: &Pad<'_>, x_label: &str) {
        let x_ticks = self.x_ticks();
        self.grid(pad, &x_ticks, &[]);
        for (x, text) in &x_ticks {
            pad.text([self.at([*x, 0.0])[0], self.bottom() + 14.0], text, LABEL, FAINT_INK, Anchor::Middle);
        }
        self.labels(pad, x_label, "");
    }

    fn grid(&self, pad: &Pad<'_>, x_ticks: &[(f64, String)], y_ticks: &[(f64, String)]) {
        for (x, _) in x_ticks {
            let x = self.at([*x, 0.0])[0];
            pad.line(&[[x, self.top], [x, self.bottom()]], GRID, 1.0);
        }
        for (y, text) in y_ticks {
            let y = self.at([0.0, *y])[1];
            pad.line(&[[self.left, y], [self.right(), y]], GRID, 1.0);
            pad.text([self.left - 8.0, y], text, LABEL, FAINT_INK, Anchor::Right);
        }
        let (right, bottom) = (self.right(), self.bottom());
        let corners = [[self.left, self.top], [right, self.top], [right, bottom], [self.left, bottom]];
        pad.outline(&corners, super::STONE, 1.0);
    }

    fn labels(&self, pad: &Pad<'_>, x_label: &str, y_label: &str) {
        let (x_middle, y_middle) = (self.left + 0.5 * self.width, self.top + 0.5 * self.height);
        pad.text([x_middle, self.bottom() + 34.0], x_label, LABEL + 1.0, INK, Anchor::Middle);
        pad.text([self.left - self.label_offset(), y_middle], y_label, LABEL + 1.0, INK, Anchor::Up);
    }
}

/// The span of all numbers; `None` if there is none, or one is not finite.
pub(super) fn span(numbers: impl Iterator<Item = f64>) -> Option<Span> {
    let all = numbers.fold(None, |span: Option<Span>, x| {
        let [low, high] = span.unwrap_or([x, x]);
        Some([low.min(x), high.max(x)])
    });
    all.filter(|[low, high]| low.is_finite() && high.is_finite())
}

/// The same with some room on both sides.
pub(super) fn roomy([low, high]: Span, share: f64) -> Span {
    let room = if high > low { share * (high - low) } else { 0.5 * low.abs().max(1.0) };
    [low - room, high + room]
}

/// The width of the longest, px.
fn widest(ticks: &Ticks) -> f64 {
    ticks.iter().map(|(_, text)| super::pad::width_of(text, LABEL)).fold(0.0, f64::max)
}

/// Round numbers in a span, about so many, and how they are written.
pub(super) fn ticks([low, high]: Span, about: usize) -> Ticks {
    let rough = (high - low) / about.clamp(2, 12) as f64;
    // Numbers that differ in digits that a number does not have cannot be told apart.
    if !(rough.is_finite() && rough > 1e-12 * low.abs().max(high.abs())) {
        return Vec::new();
    }
    let power = 10f64.powi(rough.log10().floor() as i32);
    let step =
        [1.0, 2.0, 5.0, 10.0].into_iter().map(|n| n * power).find(|step| *step >= 0.75 * rough).unwrap_or(10.0 * power);
    let digits = (-(step * 1.000_001).log10().floor()).max(0.0) as usize;
    let first = (low / step - 1e-9).ceil() as i64;
    let numbers = (first..).map(|n| n as f64 * step).take_while(|x| *x <= high + 1e-9 * step).take(50);
    numbers.map(|x| (x, format!("{:.digits$}", if x == 0.0 { 0.0 } else { x }))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let check = |span: Span, about: usize, expected: &[&str]| {
            let found: Vec<String> = ticks(span, about).into_iter().map(|(_, text)| text).collect();
            assert_eq!(found, expected, "{span:?}");
        };
        check([-10.0, 10.0], 5, &["-10", "-5", "0", "5", "10"]);
        check([0.03, 0.21], 4, &["0.05", "0.10", "0.15", "0.20"]);
        check([0.0, 132.0], 6, &["0", "20", "40", "60", "80", "100", "120"]);
        check([-0.4, 0.3], 3, &["-0.4", "-0.2", "0.0", "0.2"]);
        check([3.0, 3.0], 5, &[]);
        check([1e300, 1.000_000_000_000_000_2e300], 5, &[]);
        check([f64::NAN, 1.0], 5, &[]);
    }

    #[test]
    fn long_numbers_have_room_on_both_axes() {
        let spans = [[388_080.0, 388_110.0], [948_980.0, 948_980.4], [-1e6, 1e6], [999_999.9, 1_000_000.0], [0.0, 1e9]];
        for (x, y) in spans.into_iter().flat_map(|x| spans.map(|y| (x, y))) {
            for size in [[260.0, 780.0], [780.0, 260.0]] {
                let axes = Axes::new([64.0, 76.0], size, x, y).with_room();
                let ticks = axes.x_ticks();
                assert!(ticks.len() >= 2, "{x:?}: {ticks:?}");
                for pair in ticks.windows(2) {
                    let [left, right] = [0, 1].map(|i| (axes.at([pair[i].0, 0.0])[0], widest(&pair[i..=i].to_vec())));
                    assert!(left.0 + 0.5 * left.1 < right.0 - 0.5 * right.1, "{size:?} {x:?}: {ticks:?}");
                }
                let (numbers, label) = (axes.left - 8.0 - widest(&axes.y_ticks()), axes.left - axes.label_offset());
                assert!(label + 8.0 <= numbers && label >= 18.0, "{y:?}: numbers from {numbers}, label at {label}");
            }
        }
        // Short ones stay where they were.
        let axes = Axes::new([64.0, 76.0], [780.0, 780.0], [-10.0, 10.0], [-10.0, 10.0]).with_room();
        assert_eq!((axes.left, axes.label_offset()), (64.0, LABEL_OFFSET));
    }

    #[test]
    fn equal_scales_are_equal_and_fit() {
        for (x, y) in [([0.0, 10.0], [0.0, 10.0]), ([-50.0, 50.0], [-0.1, 0.1]), ([0.0, 1.0], [0.0, 30.0])] {
            let axes = Axes::equal([10.0, 20.0], [760.0, 760.0], x, y);
            let [left, bottom] = axes.at([x[0], y[0]]);
            let [right, top] = axes.at([x[1], y[1]]);
            let scales = [(right - left) / (x[1] - x[0]), (bottom - top) / (y[1] - y[0])];
            assert!((scales[0] / scales[1] - 1.0).abs() < 1e-9, "{scales:?}");
            assert!(axes.width <= 760.001 && axes.height <= 760.001 && axes.height >= 259.999, "{axes:?}");
        }
    }
}
