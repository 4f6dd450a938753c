//! Box plots: how the values of several samples are spread, a row for each.

use super::axes::{Axes, roomy, span};
use super::pad::{Anchor, Color, svg, width_of, wrapped};
use super::{COLORS, FAINT_INK, INK};

/// Values under a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// What they are of.
    pub name: String,
    /// The values, in any order; there may be none.
    pub values: Vec<f64>,
    /// Of how many, where some have no value.
    pub of: usize,
}

/// The marks of a box: least, first quartile, median, third quartile, greatest.
type Marks = [f64; 5];

const TOP: f64 = 64.0;
const ROW: f64 = 34.0;
const WIDTH: f64 = 620.0;
const TEXT: f64 = 12.0;
const NAME_MAX: usize = 44;

/// Draws a box from the first to the third quartile with the median in it, whiskers to the least and the greatest value,
/// and every value as a dot. At the right stands the number of values.
pub fn draw(title: &str, label: &str, samples: &[Sample]) -> String {
    let name = |sample: &Sample| report::cut(&sample.name, NAME_MAX);
    let left = samples.iter().map(|sample| width_of(&name(sample), TEXT)).fold(60.0, f64::max) + 26.0;
    let all = span(samples.iter().flat_map(|sample| sample.values.iter().copied())).unwrap_or([0.0, 1.0]);
    let height = ROW * samples.len().max(1) as f64;
    let axes = Axes::new([left, TOP], [WIDTH, height], roomy(all, 0.05), [0.0, samples.len().max(1) as f64]);
    svg(axes.right() + 84.0, axes.bottom() + 56.0, |pad| {
        for (line, i) in wrapped(title, 16.0, left + WIDTH).iter().take(2).zip(0..) {
            pad.bold([16.0, 24.0 + 20.0 * f64::from(i)], line, 16.0, INK, Anchor::Left);
        }
        axes.draw_rows(pad, label);
        for (sample, i) in samples.iter().zip(0..) {
            // The first one is on top.
            let y = samples.len() as f64 - f64::from(i) - 0.5;
            let at = |x: f64, up: f64| axes.at([x, y + up]);
            let color = Color::hex(COLORS[i as usize % COLORS.len()]);
            let middle = axes.at([0.0, y])[1];
            pad.text([left - 10.0, middle], &name(sample), TEXT, INK, Anchor::Right);
            let count = format!("{} of {}", sample.values.len(), sample.of);
            pad.text([axes.right() + 10.0, middle], &count, TEXT, FAINT_INK, Anchor::Left);
            let Some([least, low, median, high, greatest]) = marks(&sample.values) else { continue };
            let corners = [[low, -0.28], [high, -0.28], [high, 0.28], [low, 0.28]].map(|[x, up]| at(x, up));
            pad.polygon(&corners, color.faint(0.25));
            pad.outline(&corners, color, 1.2);
            for [from, to] in [[least, low], [high, greatest]] {
                pad.line(&[at(from, 0.0), at(to, 0.0)], color, 1.2);
            }
            for end in [least, greatest] {
                pad.line(&[at(end, -0.14), at(end, 0.14)], color, 1.2);
            }
            pad.line(&[at(median, -0.28), at(median, 0.28)], color, 3.0);
            sample.values.iter().for_each(|x| pad.disc(at(*x, 0.0), 1.6, color));
        }
    })
}

/// The marks of values; quartiles are linear between the two nearest values.
fn marks(values: &[f64]) -> Option<Marks> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    Some([0.0, 0.25, 0.5, 0.75, 1.0].map(|share| {
        let at = share * last as f64;
        let below = at.floor() as usize;
        sorted[below] + (at - below as f64) * (sorted[(below + 1).min(last)] - sorted[below])
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_those_of_the_values() {
        assert_eq!(marks(&[]), None);
        assert_eq!(marks(&[2.0]), Some([2.0; 5]));
        assert_eq!(marks(&[4.0, 1.0, 3.0, 2.0]), Some([1.0, 1.75, 2.5, 3.25, 4.0]));
    }

    #[test]
    fn every_sample_has_its_row_and_its_number() {
        let sample = |name: &str, values: &[f64]| Sample { name: name.to_owned(), values: values.to_vec(), of: 5 };
        let samples =
            [sample("apf", &[10.0, 11.0, 12.5]), sample("straight", &[]), sample(&"long ".repeat(30), &[9.0])];
        let text = draw("ring-15", "makespan, s", &samples);
        assert!(text.starts_with("<svg") && text.ends_with("</svg>\n"), "{text}");
        for word in ["ring-15", "makespan, s", ">\napf\n<", ">\nstraight\n<", "3 of 5", "0 of 5", "1 of 5"] {
            assert!(text.contains(word), "{word}: {text}");
        }
        assert_eq!(text.matches("<polygon").count(), 2, "{text}");
        assert!(draw("nothing", "s", &[]).ends_with("</svg>\n"));
    }
}
