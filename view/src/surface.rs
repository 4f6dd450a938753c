//! A quantity over the plane, seen from above and aside, as the papers show their potentials.

use super::pad::{Anchor, Color, Pad, short, svg, wrapped};
use super::{FAINT_INK, INK};
use reproduce::row::Series;

/// The grid is shown with at most so many cells a side.
const CELLS_MAX: usize = 56;
const WIDTH: f64 = 900.0;
/// Height of the mountains, px.
const RISE: f64 = 250.0;
/// The highest fiftieth is cut off if it makes the picture higher by this factor.
const MUCH_HIGHER: f64 = 1.5;
/// From low to high.
const COLORS: [u32; 6] = [0x2c3e8f, 0x2f7fb8, 0x3fb8a0, 0x9bd16b, 0xf6d55c, 0xe4572e];

/// A grid of numbers.
struct Grid {
    x: Vec<f64>,
    y: Vec<f64>,
    /// By row: `z[row][column]`.
    z: Vec<Vec<f64>>,
}

impl Grid {
    /// A line for each y, with points (x, quantity); coarser if it is very fine.
    fn of(series: &Series) -> Option<Grid> {
        let columns = series.lines.iter().map(|(_, points)| points.len()).min().filter(|columns| *columns > 1)?;
        let few = |count: usize| -> Vec<usize> {
            let cells = (count - 1).min(CELLS_MAX);
            (0..=cells).map(|i| i * (count - 1) / cells).collect()
        };
        if series.lines.len() < 2 {
            return None;
        }
        let (rows, columns) = (few(series.lines.len()), few(columns));
        let y: Option<Vec<f64>> = rows.iter().map(|row| series.lines[*row].0.trim().parse().ok()).collect();
        let z = rows.iter().map(|row| columns.iter().map(|column| series.lines[*row].1[*column][1]).collect());
        Some(Grid { x: columns.iter().map(|column| series.lines[0].1[*column][0]).collect(), y: y?, z: z.collect() })
    }

    /// The span of the quantity; without the highest fiftieth if that is much higher than the rest: a potential may rise
    /// without bound at an obstacle.
    fn span(&self) -> [f64; 2] {
        let mut all: Vec<f64> = self.z.iter().flatten().copied().filter(|z| z.is_finite()).collect();
        all.sort_by(f64::total_cmp);
        match (all.first(), all.get(all.len().saturating_sub(1) * 49 / 50)) {
            (Some(low), Some(high)) if high > low => {
                let highest = all[all.len() - 1];
                [*low, if highest - low < MUCH_HIGHER * (high - low) { highest } else { *high }]
            }
            (Some(low), _) => [*low, low + 1.0],
            _ => [0.0, 1.0],
        }
    }
}

pub(super) fn draw(series: &Series) -> String {
    let Some(grid) = Grid::of(series) else {
        return svg(WIDTH, 120.0, |pad| pad.text([40.0, 60.0], "no grid to draw", 14.0, FAINT_INK, Anchor::Left));
    };
    let [low, high] = grid.span();
    let view = View::of(&grid, [low, high]);
    let height = view.bottom + 60.0;
    svg(WIDTH, height, |pad| {
        for (line, i) in wrapped(&series.title, 16.0, WIDTH - 80.0).iter().zip(0..) {
            pad.bold([40.0, 28.0 + 20.0 * f64::from(i)], line, 16.0, INK, Anchor::Left);
        }
        view.frame(pad, series);
        // From the back to the front.
        for row in (0..grid.y.len() - 1).rev() {
            for column in 0..grid.x.len() - 1 {
                let corners = [(row, column), (row, column + 1), (row + 1, column + 1), (row + 1, column)];
                let heights = corners.map(|(row, column)| view.share(grid.z[row][column]));
                let at = corners.map(|(row, column)| view.at(grid.x[column], grid.y[row], grid.z[row][column]));
                let mean = heights.iter().sum::<f64>() / 4.0;
                let color = shade(mean);
                pad.polygon(&at, color);
                pad.outline(&at, color.towards(Color::hex(0x000000), 0.22), 0.5);
            }
        }
        let cut = grid.z.iter().flatten().any(|z| *z > high);
        scale(pad, [low, high], cut);
    })
}

/// Looks along y, from above.
struct View {
    x: [f64; 2],
    y: [f64; 2],
    z: [f64; 2],
    /// px per unit of x.
    scale: f64,
    base: f64,
    bottom: f64,
}

/// How much of the depth is seen as height, and how much as shift to the right.
const DEPTH: [f64; 2] = [0.30, 0.42];

impl View {
    fn of(grid: &Grid, z: [f64; 2]) -> View {
        let ends = |v: &[f64]| [v[0], v[v.len() - 1]];
        let (x, y) = (ends(&grid.x), ends(&grid.y));
        let (width, depth) = (x[1] - x[0], y[1] - y[0]);
        let scale = (WIDTH - 190.0) / (width + DEPTH[0] * depth);
        let base = 64.0 + RISE + DEPTH[1] * depth * scale;
        View { x, y, z, scale, base, bottom: base + 20.0 }
    }

    /// 0 at the lowest, 1 at the highest; what is higher is cut off.
    fn share(&self, z: f64) -> f64 {
        if z.is_finite() { ((z - self.z[0]) / (self.z[1] - self.z[0])).clamp(0.0, 1.0) } else { 1.0 }
    }

    fn at(&self, x: f64, y: f64, z: f64) -> [f64; 2] {
        let (x, y) = ((x - self.x[0]) * self.scale, (y - self.y[0]) * self.scale);
        [70.0 + x + DEPTH[0] * y, self.base - DEPTH[1] * y - RISE * self.share(z)]
    }

    /// The floor with its numbers.
    fn frame(&self, pad: &Pad<'_>, series: &Series) {
        let floor = self.z[0];
        let corner = |x: usize, y: usize| self.at(self.x[x], self.y[y], floor);
        pad.outline(&[corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)], super::STONE, 1.0);
        for (x, text) in super::axes::ticks(self.x, 8) {
            let [px, py] = self.at(x, self.y[0], floor);
            pad.line(&[[px, py], [px, py + 5.0]], super::STONE, 1.0);
            pad.text([px, py + 16.0], &text, 12.0, FAINT_INK, Anchor::Middle);
        }
        for (y, text) in super::axes::ticks(self.y, 6) {
            let [px, py] = self.at(self.x[1], y, floor);
            pad.line(&[[px, py], [px + 5.0, py]], super::STONE, 1.0);
            pad.text([px + 10.0, py], &text, 12.0, FAINT_INK, Anchor::Left);
        }
        let [px, py] = self.at(0.5 * (self.x[0] + self.x[1]), self.y[0], floor);
        pad.text([px, py + 38.0], &series.x, 13.0, INK, Anchor::Middle);
        let [px, py] = self.at(self.x[1], 0.5 * (self.y[0] + self.y[1]), floor);
        pad.text([px + 40.0, py + 8.0], &series.y, 13.0, INK, Anchor::Left);
    }
}

fn shade(share: f64) -> Color {
    let at = share * (COLORS.len() - 1) as f64;
    let low = (at as usize).min(COLORS.len() - 2);
    Color::hex(COLORS[low]).towards(Color::hex(COLORS[low + 1]), at - low as f64)
}

/// What the colours mean.
fn scale(pad: &Pad<'_>, [low, high]: [f64; 2], cut: bool) {
    let (x, top, height) = (24.0, 70.0, 150.0);
    for i in 0..50 {
        let y = top + height * (1.0 - f64::from(i + 1) / 50.0);
        let side = height / 50.0 + 0.3;
        pad.polygon(&[[x, y], [x + 14.0, y], [x + 14.0, y + side], [x, y + side]], shade(f64::from(i) / 49.0));
    }
    let more = if cut { " and more" } else { "" };
    pad.text([x + 20.0, top + 4.0], &format!("{}{more}", short(high)), 11.0, FAINT_INK, Anchor::Left);
    pad.text([x + 20.0, top + height - 4.0], &short(low), 11.0, FAINT_INK, Anchor::Left);
}
