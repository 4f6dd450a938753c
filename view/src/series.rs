//! The figures of the papers: the same data as in the CSV files beside them.

use super::axes::{Axes, roomy, span};
use super::pad::{Anchor, Color, Pad, short, svg, width_of, wrapped};
use super::thin::thin;
use super::{FAINT_INK, INK, STONE, STONE_EDGE, color, surface};
use reproduce::row::{Form, Series};

const LEFT: f64 = 74.0;
const TOP: f64 = 64.0;
const TEXT: f64 = 12.0;
const LINE: f64 = 19.0;
const TITLE: f64 = 16.0;
const TITLE_LINE: f64 = 22.0;
/// Lines with such names are an arm at one instant after the other.
const POSE: &str = "pose ";
/// More lines have no legend of their own.
const LEGEND_MAX: usize = 24;

/// The picture of a series.
pub fn draw(series: &Series) -> String {
    match series.form {
        Form::Surface => surface::draw(series),
        Form::Paths => paths(series),
        Form::Arrows => arrows(series),
        Form::Dots => dots(series),
        Form::Lines => lines(series),
        Form::Bars => bars(series),
    }
}

/// The numbers of a series: one line per point, the discs at the end.
pub fn csv(series: &Series) -> String {
    let quoted = |name: &str| match name.contains([',', '"', '\n']) {
        true => format!("\"{}\"", name.replace('"', "\"\"")),
        false => name.to_owned(),
    };
    let mut text = format!("line,{},{}\n", quoted(&series.x), quoted(&series.y));
    for (name, points) in &series.lines {
        let name = quoted(name);
        points.iter().for_each(|[x, y]| text += &format!("{name},{x},{y}\n"));
    }
    if !series.discs.is_empty() {
        text += "\ndisc,x,y,radius\n";
        series.discs.iter().enumerate().for_each(|(i, [x, y, r])| text += &format!("{i},{x},{y},{r}\n"));
    }
    text
}

/// A line of the legend.
type Entry = (Color, String);

/// The sheet of a chart: title, legend at the right, and the rest for the chart.
fn sheet(series: &Series, axes: Axes, legend: &[Entry], draw: impl FnOnce(&Pad<'_>, &Axes)) -> String {
    let axes = axes.with_room();
    let legend = if legend.len() > LEGEND_MAX { &[] } else { legend };
    let widest = legend.iter().map(|(_, name)| width_of(name, TEXT)).fold(0.0, f64::max);
    let legend_width = if legend.is_empty() { 24.0 } else { widest + 66.0 };
    let width = (axes.right() + legend_width).max(520.0);
    let title = wrapped(&series.title, TITLE, width - axes.left() - 30.0);
    let axes = axes.lowered(TITLE_LINE * title.len().saturating_sub(1) as f64);
    let height = (axes.bottom() + 56.0).max(axes.top() + LINE * legend.len() as f64 + 20.0);
    svg(width, height, |pad| {
        for (line, i) in title.iter().zip(0..) {
            pad.bold([axes.left(), 32.0 + TITLE_LINE * f64::from(i)], line, TITLE, INK, Anchor::Left);
        }
        draw(pad, &axes);
        let x = axes.right() + 20.0;
        for ((color, name), i) in legend.iter().zip(0..) {
            let y = axes.top() + 8.0 + LINE * f64::from(i);
            pad.line(&[[x, y], [x + 22.0, y]], *color, 3.0);
            pad.text([x + 30.0, y], name, TEXT, INK, Anchor::Left);
        }
    })
}

/// A legend with a line for each line.
fn names(series: &Series) -> Vec<Entry> {
    let count = series.lines.len();
    series.lines.iter().enumerate().map(|(i, (name, _))| (color(i, count), name.clone())).collect()
}

fn places(series: &Series) -> impl Iterator<Item = [f64; 2]> {
    series.lines.iter().flat_map(|(_, points)| points.iter().copied()).filter(|p| p[0].is_finite() && p[1].is_finite())
}

/// The part of the plane that a series shows, with equal scales.
fn plane(series: &Series) -> Axes {
    let rims = series.discs.iter().flat_map(|[x, y, r]| [[x - r, y - r], [x + r, y + r]]);
    let all: Vec<[f64; 2]> = places(series).chain(rims).collect();
    let side = |i: usize| roomy(span(all.iter().map(|p| p[i])).unwrap_or([0.0, 1.0]), 0.04);
    Axes::equal([LEFT, TOP], [720.0, 720.0], side(0), side(1))
}

fn discs(series: &Series, pad: &Pad<'_>, axes: &Axes) {
    for [x, y, r] in &series.discs {
        // Some papers have obstacles that are points.
        let radius = axes.length(*r).max(3.0);
        pad.disc(axes.at([*x, *y]), radius, STONE);
        pad.ring(axes.at([*x, *y]), radius, STONE_EDGE, 1.0);
    }
}

fn arrows(series: &Series) -> String {
    sheet(series, plane(series), &names(series), |pad, axes| {
        axes.draw(pad, &series.x, &series.y);
        discs(series, pad, axes);
        let count = series.lines.len();
        for (i, (_, points)) in series.lines.iter().enumerate() {
            let color = color(i, count);
            match &points[..] {
                // A single arrow without length is a place that the legend names.
                [from, to] if from == to => pad.ring(axes.at(*from), 5.0, color, 2.5),
                _ => points.chunks_exact(2).for_each(|ends| arrow(pad, axes.at(ends[0]), axes.at(ends[1]), color)),
            }
        }
    })
}

/// An arrow on the paper; a dot where it has no length.
fn arrow(pad: &Pad<'_>, from: [f64; 2], to: [f64; 2], color: Color) {
    let along = [to[0] - from[0], to[1] - from[1]];
    let length = along[0].hypot(along[1]);
    if length < 1.0 {
        return pad.disc(from, 2.0, color);
    }
    let head = (0.4 * length).min(6.0) / length;
    let barb =
        |aside: f64| [to[0] - head * (along[0] - aside * along[1]), to[1] - head * (along[1] + aside * along[0])];
    pad.line(&[from, to], color, 1.4);
    pad.polygon(&[to, barb(0.5), barb(-0.5)], color);
}

fn dots(series: &Series) -> String {
    sheet(series, plane(series), &names(series), |pad, axes| {
        axes.draw(pad, &series.x, &series.y);
        let count = series.lines.len();
        for (i, (_, points)) in series.lines.iter().enumerate() {
            points.iter().for_each(|p| pad.disc(axes.at(*p), 1.75, color(i, count)));
        }
        discs(series, pad, axes);
    })
}

fn paths(series: &Series) -> String {
    let axes = plane(series);
    let poses = series.lines.iter().filter(|(name, _)| name.starts_with(POSE)).count();
    let others: Vec<&(String, Vec<[f64; 2]>)> =
        series.lines.iter().filter(|(name, _)| !name.starts_with(POSE)).collect();
    let mut legend: Vec<Entry> =
        others.iter().enumerate().map(|(i, (name, _))| (color(i, others.len()), name.clone())).collect();
    if poses > 0 {
        let name = if poses == 1 { "the arm".to_owned() } else { format!("the arm at {poses} instants") };
        legend.push((pose_color(0.5), name));
    }
    sheet(series, axes, &legend, |pad, axes| {
        axes.draw(pad, &series.x, &series.y);
        discs(series, pad, axes);
        for ((_, points), i) in series.lines.iter().filter(|(name, _)| name.starts_with(POSE)).zip(1..) {
            let drawn: Vec<[f64; 2]> = points.iter().map(|p| axes.at(*p)).collect();
            let color = pose_color(f64::from(i) / poses as f64);
            pad.line(&drawn, color, 5.0);
            drawn.iter().for_each(|at| pad.disc(*at, 3.5, color));
        }
        for (i, (_, points)) in others.iter().enumerate() {
            let drawn: Vec<[f64; 2]> = points.iter().map(|p| axes.at(*p)).collect();
            let color = color(i, others.len());
            pad.line(&thin(&drawn, 0.2), color, 2.0);
            if let (Some(first), Some(last)) = (drawn.first(), drawn.last()) {
                pad.ring(*first, 4.0, color, 1.5);
                pad.disc(*last, 3.5, color);
            }
        }
    })
}

/// From light (early) to dark (late).
fn pose_color(late: f64) -> Color {
    Color::hex(0xd5dbe3).towards(Color::hex(0x3d4b5c), late * late)
}

fn lines(series: &Series) -> String {
    let side = |i: usize, share| roomy(span(places(series).map(|p| p[i])).unwrap_or([0.0, 1.0]), share);
    let axes = Axes::new([LEFT, TOP], [720.0, 420.0], side(0, 0.02), from_zero(side(1, 0.05), series));
    sheet(series, axes, &names(series), |pad, axes| {
        axes.draw(pad, &series.x, &series.y);
        let count = series.lines.len();
        for (i, (_, points)) in series.lines.iter().enumerate() {
            let color = color(i, count);
            // What is not a number is a gap.
            for part in points.split(|p| !(p[0].is_finite() && p[1].is_finite())) {
                let drawn: Vec<[f64; 2]> = part.iter().map(|p| axes.at(*p)).collect();
                pad.line(&thin(&drawn, 0.15), color, 2.0);
                if part.len() <= 40 {
                    drawn.iter().for_each(|at| pad.disc(*at, 3.2, color));
                }
            }
        }
    })
}

/// A quantity that is never negative and comes near to zero has its zero in the picture.
fn from_zero([low, high]: [f64; 2], series: &Series) -> [f64; 2] {
    let positive = places(series).all(|p| p[1] >= 0.0);
    if positive && low < 0.45 * high { [0.0, high] } else { [low, high] }
}

fn bars(series: &Series) -> String {
    let mut groups: Vec<f64> = places(series).map(|p| p[0]).collect();
    groups.sort_by(f64::total_cmp);
    groups.dedup();
    let place = |x: f64| groups.iter().position(|group| *group == x).unwrap_or(0) as f64;
    let high = span(places(series).map(|p| p[1])).unwrap_or([0.0, 1.0]);
    let y = [high[0].min(0.0) * 1.06, if high[1] > 0.0 { high[1] * 1.06 } else { 1.0 }];
    // Lines of one bar each are bars side by side, not groups.
    let alone = series.lines.iter().all(|(_, points)| points.len() <= 1);
    let members = if alone { 1 } else { series.lines.len().max(1) };
    let width = (groups.len() as f64 * (members as f64 * 22.0 + 18.0)).clamp(300.0, 900.0);
    let axes = Axes::new([LEFT, TOP], [width, 420.0], [-0.5, groups.len().max(1) as f64 - 0.5], y);
    // A legend that repeats the axis is none.
    let repeats =
        |(name, points): &(String, Vec<[f64; 2]>)| points.first().is_some_and(|p| format!("{}", p[0]) == *name);
    let legend = if alone && series.lines.iter().all(repeats) { Vec::new() } else { names(series) };
    sheet(series, axes, &legend, |pad, axes| {
        let names: Vec<(f64, String)> = groups.iter().map(|x| (place(*x), format!("{x}"))).collect();
        axes.draw_named(pad, &names, &series.x, &series.y);
        let thick = 0.74 / members as f64;
        let count = series.lines.len();
        for (i, (_, points)) in series.lines.iter().enumerate() {
            for [x, y] in points.iter().filter(|p| p[1].is_finite()) {
                let member = if alone { 0 } else { i };
                let from = place(*x) - 0.37 + thick * member as f64;
                bar(pad, axes, [from, from + 0.92 * thick], *y, color(i, count));
                let [center, top] = axes.at([from + 0.46 * thick, y.max(0.0)]);
                if axes.length(thick) > 26.0 {
                    pad.text([center, top - 9.0], &short(*y), 10.0, FAINT_INK, Anchor::Middle);
                }
            }
        }
    })
}

fn bar(pad: &Pad<'_>, axes: &Axes, [from, to]: [f64; 2], height: f64, color: Color) {
    pad.polygon(&[[from, 0.0], [to, 0.0], [to, height], [from, height]].map(|p| axes.at(p)), color.faint(0.85));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(series: &Series, tag: &str) -> usize {
        draw(series).matches(tag).count()
    }

    #[test]
    fn an_arrow_has_a_head_and_a_place_has_a_ring() {
        let of = |form: Form, points: &[[f64; 2]]| {
            let frame = ("frame".to_owned(), vec![[0.0, 0.0]; 2]);
            Series::chart(form, "a", "a", ["x (m)", "y (m)"], vec![frame, ("points".to_owned(), points.to_vec())])
        };
        let arrows = |points: &[[f64; 2]]| of(Form::Arrows, points);
        let (none, two) = (arrows(&[]), arrows(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 0.5]]));
        assert_eq!(count(&two, "<polygon") - count(&none, "<polygon"), 2);
        assert_eq!(count(&two, "<circle"), count(&none, "<circle"));
        // Without length it is a dot; alone it is a place.
        let (dots, place) = (arrows(&[[0.0, 0.0], [0.0, 0.0], [1.0, 1.0], [1.0, 1.0]]), arrows(&[[1.0, 1.0]; 2]));
        assert_eq!(count(&dots, "<circle") - count(&none, "<circle"), 2);
        assert_eq!(count(&place, "r=\"20\"") - count(&none, "r=\"20\""), 1);
        let dots = of(Form::Dots, &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]);
        assert_eq!(count(&dots, "<circle"), 5);
    }
}
