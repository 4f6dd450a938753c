//! The map, in Braille dots: obstacles, robots by state, goals, and the trail of the selected robot.

use crate::app::App;
use crate::rows::Row;
use model::ProcessState;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::Span;
use ratatui::widgets::canvas::{Canvas, Circle, Context, Line, Points};
use std::collections::BTreeMap;
use watch::{Body, Form, Thing};

/// Dots of a cell, across and down: with usual fonts their distances are the same.
const DOTS: [f64; 2] = [2.0, 4.0];
const OBSTACLE: Color = Color::Gray;
const GOAL: Color = Color::LightMagenta;
const SELECTED: Color = Color::LightGreen;

/// Draws it.
pub(crate) fn draw(app: &App, frame: &mut Frame<'_>, area: Rect) {
    if area.width < 4 || area.height < 2 {
        return;
    }
    let dot_m = dot_m(app.fleet.bounds_m, area);
    let [x_m, y_m] = view(app.fleet.bounds_m, area, dot_m);
    let rows: BTreeMap<u32, Row> = app.rows().into_iter().map(|row| (row.index, row)).collect();
    let selected = app.selected();
    let paint = |context: &mut Context<'_>| {
        for pair in app.fleet.walls_m.iter().flat_map(|chain| chain.windows(2)) {
            let ([x1, y1], [x2, y2]) = (pair[0], pair[1]);
            context.draw(&Line { x1, y1, x2, y2, color: OBSTACLE });
        }
        for (index, thing) in app.fleet.things.iter().enumerate() {
            draw_thing(context, thing, carried(app, index), dot_m);
        }
        border(context, app.fleet.bounds_m);
        context.layer();
        if let Some(row) = &selected {
            let trail: Vec<(f64, f64)> = app.trail(row.index).map(|[x, y]| (x, y)).collect();
            context.draw(&Points { coords: &trail, color: SELECTED });
        }
        let robots = || app.frame.bodies.iter().filter(|body| !body.is_obstacle());
        for body in robots() {
            if let Some([x, y]) = body.goal_m.filter(|_| rows.contains_key(&body.index) && !body.has_arrived()) {
                context.draw(&Points { coords: &[(x, y)], color: GOAL });
            }
        }
        for body in robots() {
            // A robot that the filter leaves out is grey.
            let color = match rows.get(&body.index) {
                _ if body.is_silent() => Color::LightRed,
                Some(row) => color(row),
                None => Color::DarkGray,
            };
            draw_robot(context, app, body, color, dot_m);
        }
        if let Some((row, body)) =
            selected.as_ref().and_then(|row| Some((row, robots().find(|b| b.index == row.index)?)))
        {
            draw_robot(context, app, body, SELECTED, dot_m);
            let bold = Style::new().fg(SELECTED).add_modifier(Modifier::BOLD);
            if let Some([x, y]) = body.goal_m.filter(|_| !body.has_arrived()) {
                context.print(x, y, Span::styled("x", bold));
            }
            let [x, y] = body.position_m;
            context.print(x + DOTS[0] * dot_m, y, Span::styled(row.id.clone(), bold));
        }
    };
    frame.render_widget(Canvas::default().marker(Marker::Braille).x_bounds(x_m).y_bounds(y_m).paint(paint), area);
}

/// The colour of a robot, here and in the table, which has its state in words, too.
pub(crate) fn color(row: &Row) -> Color {
    match row.process {
        ProcessState::Running if row.arrived => Color::LightBlue,
        ProcessState::Running => Color::Reset,
        ProcessState::Paused | ProcessState::Stopped | ProcessState::Starting | ProcessState::Awaited => {
            Color::LightYellow
        }
        ProcessState::Left | ProcessState::Ended => Color::DarkGray,
        ProcessState::Dead | ProcessState::RestartLimit | ProcessState::Refused => Color::LightRed,
    }
}

/// How far apart dots are, so that all of the world is seen, m.
fn dot_m(bounds_m: [[f64; 2]; 2], area: Rect) -> f64 {
    let [x_m, y_m] = bounds_m.map(|[low, high]| (high - low).max(1e-3));
    let across = f64::from(area.width) * DOTS[0] - 1.0;
    let down = f64::from(area.height) * DOTS[1] - 1.0;
    (x_m / across).max(y_m / down)
}

/// What the area shows, the world in its middle.
fn view(bounds_m: [[f64; 2]; 2], area: Rect, dot_m: f64) -> [[f64; 2]; 2] {
    let dots = [f64::from(area.width) * DOTS[0] - 1.0, f64::from(area.height) * DOTS[1] - 1.0];
    [0, 1].map(|axis| {
        let ([low, high], half_m) = (bounds_m[axis], dots[axis] * dot_m / 2.0);
        let middle_m = (low + high) / 2.0;
        [middle_m - half_m, middle_m + half_m]
    })
}

fn border(context: &mut Context<'_>, [[left, right], [low, high]]: [[f64; 2]; 2]) {
    let corners = [[left, low], [right, low], [right, high], [left, high]];
    outline(context, &corners, Color::DarkGray);
}

fn outline(context: &mut Context<'_>, corners: &[[f64; 2]], color: Color) {
    for (index, [x1, y1]) in corners.iter().copied().enumerate() {
        let [x2, y2] = corners[(index + 1) % corners.len()];
        context.draw(&Line { x1, y1, x2, y2, color });
    }
}

/// How far an obstacle has moved, m.
fn carried(app: &App, index: usize) -> [f64; 2] {
    let at = app.fleet.things[index].carried_at_m;
    let body = app.frame.bodies.iter().find(|body| body.is_obstacle() && body.index as usize == index);
    match (at, body) {
        (Some([x, y]), Some(body)) => [body.position_m[0] - x, body.position_m[1] - y],
        _ => [0.0; 2],
    }
}

fn draw_thing(context: &mut Context<'_>, thing: &Thing, by_m: [f64; 2], dot_m: f64) {
    let moved = |[x, y]: [f64; 2]| [x + by_m[0], y + by_m[1]];
    match &thing.form {
        Form::Polygon { corners_m } => {
            let corners: Vec<[f64; 2]> = corners_m.iter().copied().map(moved).collect();
            outline(context, &corners, OBSTACLE);
        }
        Form::Capsule { ends_m, radius_m } => {
            let [[x1, y1], [x2, y2]] = ends_m.map(moved);
            let length_m = (x2 - x1).hypot(y2 - y1);
            if *radius_m < dot_m {
                return context.draw(&Line { x1, y1, x2, y2, color: OBSTACLE });
            }
            for (x, y) in [(x1, y1), (x2, y2)] {
                context.draw(&Circle { x, y, radius: *radius_m, color: OBSTACLE });
            }
            if length_m > 0.0 {
                let (across, along) = ((y2 - y1) / length_m * radius_m, (x2 - x1) / length_m * radius_m);
                for side in [-1.0, 1.0] {
                    let (dx, dy) = (-side * across, side * along);
                    context.draw(&Line { x1: x1 + dx, y1: y1 + dy, x2: x2 + dx, y2: y2 + dy, color: OBSTACLE });
                }
            }
        }
    }
}

fn draw_robot(context: &mut Context<'_>, app: &App, body: &Body, color: Color, dot_m: f64) {
    let [x, y] = body.position_m;
    let member = app.fleet.members.get(body.index as usize);
    if let Some(arm) = member.and_then(|member| member.arm) {
        let [first, second] = body.joints_rad;
        let [x1, y1] = arm.base_m;
        let (x2, y2) = (x1 + arm.links_m[0] * first.cos(), y1 + arm.links_m[0] * first.sin());
        let (x3, y3) = (x2 + arm.links_m[1] * (first + second).cos(), y2 + arm.links_m[1] * (first + second).sin());
        context.draw(&Line { x1, y1, x2, y2, color });
        context.draw(&Line { x1: x2, y1: y2, x2: x3, y2: y3, color });
        return;
    }
    let radius = member.map_or(0.0, |member| member.radius_m);
    if radius < 1.5 * dot_m {
        // Four dots: one alone is hard to see.
        let half_m = dot_m / 2.0;
        let coords =
            [(x - half_m, y - half_m), (x + half_m, y - half_m), (x - half_m, y + half_m), (x + half_m, y + half_m)];
        return context.draw(&Points { coords: &coords, color });
    }
    context.draw(&Circle { x, y, radius, color });
    if member.is_some_and(|member| member.heads) {
        let (x2, y2) = (x + radius * body.yaw_rad.cos(), y + radius * body.yaw_rad.sin());
        context.draw(&Line { x1: x, y1: y, x2, y2, color });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_metre_is_as_long_across_as_down_and_all_of_the_world_is_seen() {
        for (bounds, width, height) in [([[-10.0, 10.0], [-5.0, 5.0]], 40, 10), ([[0.0, 1.0], [0.0, 30.0]], 80, 9)] {
            let area = Rect { x: 0, y: 0, width, height };
            let dot = dot_m(bounds, area);
            let [x_m, y_m] = view(bounds, area, dot);
            let dots = |[low, high]: [f64; 2], cells: u16, of: f64| (high - low) / (f64::from(cells) * of - 1.0);
            assert!((dots(x_m, width, DOTS[0]) - dots(y_m, height, DOTS[1])).abs() < 1e-12);
            for (shown, whole) in [x_m, y_m].into_iter().zip(bounds) {
                assert!(shown[0] <= whole[0] + 1e-9 && shown[1] >= whole[1] - 1e-9, "{shown:?} {whole:?}");
            }
        }
    }
}
