//! How values are spread: a bar for each range, as wide on the paper as its neighbours whatever it spans.

use super::axes::Axes;
use super::pad::{Anchor, Color, svg, wrapped};
use super::{COLORS, FAINT_INK, INK};

/// So many values lie from here on, up to where the next bar begins.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// Where it begins, as it is to be written.
    pub from: String,
    /// How many values it has.
    pub n: u64,
}

const LEFT: f64 = 74.0;
const TOP: f64 = 64.0;
const BAR: f64 = 30.0;

/// Draws the bars, and what they are: shares of all values in per cent.
pub fn draw(title: &str, x_label: &str, bars: &[Bar]) -> String {
    let all = bars.iter().map(|bar| bar.n).sum::<u64>().max(1) as f64;
    let share = |n: u64| 100.0 * n as f64 / all;
    let highest = bars.iter().map(|bar| share(bar.n)).fold(1.0, f64::max);
    let width = (bars.len() as f64 * BAR).clamp(300.0, 1200.0);
    let axes = Axes::new([LEFT, TOP], [width, 420.0], [0.0, bars.len().max(1) as f64], [0.0, 1.08 * highest]);
    svg(axes.right() + 24.0, axes.bottom() + 56.0, |pad| {
        for (line, i) in wrapped(title, 16.0, width).iter().take(2).zip(0..) {
            pad.bold([LEFT, 24.0 + 20.0 * f64::from(i)], line, 16.0, INK, Anchor::Left);
        }
        let names: Vec<(f64, String)> = bars.iter().zip(0..).map(|(bar, i)| (f64::from(i), bar.from.clone())).collect();
        axes.draw_named(pad, &names, x_label, "share, %");
        for (bar, i) in bars.iter().zip(0..).filter(|(bar, _)| bar.n > 0) {
            let (left, right, height) = (f64::from(i) + 0.06, f64::from(i) + 0.94, share(bar.n));
            let corners = [[left, 0.0], [right, 0.0], [right, height], [left, height]];
            pad.polygon(&corners.map(|p| axes.at(p)), Color::hex(COLORS[0]).faint(0.85));
            // The tail is what one looks for, and too low to see.
            let [x, y] = axes.at([f64::from(i) + 0.5, height]);
            pad.text([x, y - 9.0], &bar.n.to_string(), 9.0, FAINT_INK, Anchor::Middle);
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bar_is_there_with_its_number() {
        let bars = [("5", 10), ("7", 0), ("10", 12_345)].map(|(from, n)| Bar { from: from.to_owned(), n });
        let text = draw("wake-up", "us", &bars);
        assert!(text.starts_with("<svg") && text.ends_with("</svg>\n"), "{text}");
        for word in ["wake-up", "share, %", "12345", ">\n10\n<", ">\n5\n<"] {
            assert!(text.contains(word), "{word}: {text}");
        }
        assert_eq!(text.matches("<polygon").count(), 2, "{text}");
        assert!(draw("nothing", "us", &[]).ends_with("</svg>\n"));
    }
}
