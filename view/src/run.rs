//! A run as a picture: obstacles, courses, starts, goals, contacts.

use super::axes::Axes;
use super::pad::{Anchor, Color, Pad, svg, width_of};
use super::scene::{Scene, Thing, Trace};
use super::{CONTACT, FAINT_INK, INK, MOVING, STONE, STONE_EDGE, color};
use model::Shape;

/// So many robots have a line in the legend.
const LEGEND_MAX: usize = 20;
const PLANE_MAX: [f64; 2] = [780.0, 780.0];
const LEFT: f64 = 64.0;
const TOP: f64 = 76.0;
const TEXT: f64 = 12.0;
const LINE: f64 = 19.0;

/// The picture.
pub fn draw(scene: &Scene) -> String {
    let axes = Axes::equal([LEFT, TOP], PLANE_MAX, scene.x, scene.y).with_room();
    let listed = scene.robots.len() <= LEGEND_MAX;
    let rows = keys(scene).len() + if listed { scene.robots.len() + 1 } else { 1 };
    let names =
        scene.robots.iter().filter(|_| listed).map(|robot| width_of(&robot.id, TEXT) + width_of(&robot.fate, TEXT));
    let legend = names.fold(120.0, f64::max) + 74.0;
    let titles = width_of(&scene.title, 18.0).max(width_of(&scene.subtitle, 13.0)) + axes.left() + 20.0;
    let width = (axes.right() + legend).max(titles);
    let height = (axes.bottom() + 56.0).max(TOP + LINE * rows as f64 + 20.0);
    svg(width, height, |pad| {
        pad.bold([axes.left(), 28.0], &scene.title, 18.0, INK, Anchor::Left);
        pad.text([axes.left(), 52.0], &scene.subtitle, 13.0, FAINT_INK, Anchor::Left);
        axes.draw(pad, "x (m)", "y (m)");
        scene.walls.iter().for_each(|chain| wall(pad, &axes, chain));
        scene.obstacles.iter().for_each(|thing| obstacle(pad, &axes, thing));
        let count = scene.robots.len();
        let painted = || scene.robots.iter().enumerate().map(|(i, robot)| (robot, color(i, count)));
        painted().for_each(|(robot, color)| goals(pad, &axes, robot, color, count));
        painted().for_each(|(robot, color)| course(pad, &axes, robot, color, count));
        painted().for_each(|(robot, color)| body(pad, &axes, robot, color));
        scene.contacts.iter().for_each(|at| contact(pad, axes.at(*at)));
        let mut y = TOP + 8.0;
        let x = axes.right() + 22.0;
        if listed {
            for (robot, color) in painted() {
                pad.line(&[[x, y], [x + 22.0, y]], color, 3.0);
                pad.text([x + 30.0, y], &robot.id, TEXT, INK, Anchor::Left);
                pad.text([axes.right() + legend - 16.0, y], &robot.fate, TEXT, FAINT_INK, Anchor::Right);
                y += LINE;
            }
        } else {
            pad.text([x, y], &format!("{count} robots"), TEXT, INK, Anchor::Left);
            y += LINE;
        }
        y += if listed { LINE } else { 0.0 };
        for (key, words) in keys(scene) {
            mark(pad, [x + 11.0, y], key);
            pad.text([x + 30.0, y], &words, TEXT, FAINT_INK, Anchor::Left);
            y += LINE;
        }
    })
}

/// What a sign in the picture means.
#[derive(Clone, Copy)]
enum Key {
    Start,
    End,
    Goal,
    MovingGoal,
    Contact,
    Stone,
    Wall,
    Moving,
}

/// The signs that are in the picture.
fn keys(scene: &Scene) -> Vec<(Key, String)> {
    let say = |key, words: &str| (key, words.to_owned());
    let mut keys = vec![say(Key::Start, "start"), say(Key::End, "end"), say(Key::Goal, "goal")];
    if scene.robots.iter().any(|robot| !robot.goal_course.is_empty()) {
        keys.push(say(Key::MovingGoal, "moving goal"));
    }
    match scene.contacts_more {
        _ if scene.contacts.is_empty() => {}
        0 => keys.push(say(Key::Contact, "contact")),
        more => keys.push((Key::Contact, format!("contact (+ {more} more)"))),
    }
    if scene.obstacles.iter().any(|thing| thing.course.is_empty()) {
        keys.push(say(Key::Stone, "obstacle"));
    }
    if !scene.walls.is_empty() {
        keys.push(say(Key::Wall, "wall of the map"));
    }
    if scene.obstacles.iter().any(|thing| !thing.course.is_empty()) {
        keys.push(say(Key::Moving, "moving obstacle"));
    }
    keys
}

fn mark(pad: &Pad<'_>, at: [f64; 2], key: Key) {
    let [x, y] = at;
    match key {
        Key::Start => pad.ring(at, 5.0, FAINT_INK, 1.4),
        Key::End => {
            pad.disc(at, 5.0, FAINT_INK.faint(0.45));
            pad.ring(at, 5.0, FAINT_INK, 1.4);
        }
        Key::Goal => goal(pad, at, FAINT_INK),
        Key::MovingGoal => pad.dashes(&[[x - 11.0, y], [x + 11.0, y]], FAINT_INK, 1.5, [2.0, 4.0]),
        Key::Contact => contact(pad, at),
        Key::Stone => {
            let corners = [[x - 8.0, y - 5.0], [x + 8.0, y - 5.0], [x + 8.0, y + 5.0], [x - 8.0, y + 5.0]];
            pad.polygon(&corners, STONE);
            pad.outline(&corners, STONE_EDGE, 1.0);
        }
        Key::Wall => pad.line(&[[x - 9.0, y], [x + 9.0, y]], STONE_EDGE, 1.4),
        Key::Moving => {
            pad.dashes(&[[x - 11.0, y], [x + 11.0, y]], MOVING, 1.5, [6.0, 4.0]);
            pad.disc(at, 4.0, MOVING);
        }
    }
}

fn obstacle(pad: &Pad<'_>, axes: &Axes, thing: &Thing) {
    let reference = thing.shape.reference();
    let shift = |to: &[f64; 2]| [to[0] - reference.x, to[1] - reference.y];
    match (thing.course.first(), thing.course.last()) {
        (Some(first), Some(last)) => {
            shape(pad, axes, &thing.shape, shift(first), MOVING.faint(0.25), MOVING.faint(0.5));
            let course: Vec<[f64; 2]> = thing.course.iter().map(|at| axes.at(*at)).collect();
            pad.dashes(&course, MOVING.faint(0.75), 1.2, [6.0, 5.0]);
            shape(pad, axes, &thing.shape, shift(last), MOVING.faint(0.7), MOVING);
        }
        _ => shape(pad, axes, &thing.shape, [0.0; 2], STONE, STONE_EDGE),
    }
}

/// Walls of the map, one behind the other.
fn wall(pad: &Pad<'_>, axes: &Axes, chain: &[[f64; 2]]) {
    let points: Vec<[f64; 2]> = chain.iter().map(|at| axes.at(*at)).collect();
    pad.line(&points, STONE_EDGE, 1.2);
}

/// A shape, moved by an offset.
fn shape(pad: &Pad<'_>, axes: &Axes, shape: &Shape, offset: [f64; 2], inside: Color, edge: Color) {
    let at = |p: nalgebra::Point2<f64>| axes.at([p.x + offset[0], p.y + offset[1]]);
    match shape {
        Shape::Polygon(corners) => {
            let corners: Vec<[f64; 2]> = corners.iter().map(|corner| at(*corner)).collect();
            pad.polygon(&corners, inside);
            pad.outline(&corners, edge, 1.0);
        }
        Shape::Capsule(capsule) => {
            let (a, b, radius) = (at(capsule.a), at(capsule.b), axes.length(capsule.radius));
            if capsule.a == capsule.b {
                pad.disc(a, radius, inside);
                pad.ring(a, radius, edge, 1.0);
            } else if radius < 1.5 {
                pad.line(&[a, b], edge, 3.0);
            } else {
                let rim = rim(a, b, radius);
                pad.polygon(&rim, inside);
                pad.outline(&rim, edge, 1.0);
            }
        }
    }
}

/// The outline of everything within `radius` of the segment from a to b.
pub(super) fn rim(a: [f64; 2], b: [f64; 2], radius: f64) -> Vec<[f64; 2]> {
    let along = (b[1] - a[1]).atan2(b[0] - a[0]);
    let half = |center: [f64; 2], from: f64| {
        (0..=16).map(move |i| from + std::f64::consts::PI * f64::from(i) / 16.0).map(move |angle| {
            let (sin, cos) = angle.sin_cos();
            [center[0] + radius * cos, center[1] + radius * sin]
        })
    };
    let quarter = std::f64::consts::FRAC_PI_2;
    half(b, along - quarter).chain(half(a, along + quarter)).collect()
}

fn goals(pad: &Pad<'_>, axes: &Axes, robot: &Trace, color: Color, count: usize) {
    let course: Vec<[f64; 2]> = robot.goal_course.iter().map(|at| axes.at(*at)).collect();
    pad.dashes(&course, color.faint(0.8), 1.4, [2.0, 5.0]);
    for at in &robot.goals {
        match count {
            0..=60 => goal(pad, axes.at(*at), color),
            _ => pad.cross(axes.at(*at), 2.5, color, 1.0),
        }
    }
}

fn goal(pad: &Pad<'_>, [x, y]: [f64; 2], color: Color) {
    let arm = 5.5;
    pad.line(&[[x - arm, y], [x + arm, y]], color, 1.6);
    pad.line(&[[x, y - arm], [x, y + arm]], color, 1.6);
    pad.outline(&[[x - arm, y], [x, y - arm], [x + arm, y], [x, y + arm]], color, 1.2);
}

fn course(pad: &Pad<'_>, axes: &Axes, robot: &Trace, color: Color, count: usize) {
    let course: Vec<[f64; 2]> = robot.course.iter().map(|at| axes.at(*at)).collect();
    let poses = robot.poses.len();
    for (i, pose) in robot.poses.iter().enumerate() {
        let [base, elbow, tip] = pose.map(|at| axes.at(at));
        let late = (i + 1) as f64 / poses as f64;
        let (width, shade) = ((2.0 * axes.length(robot.radius)).max(3.0), color.faint(0.12 + 0.45 * late.powi(3)));
        pad.line(&[base, elbow], shade, width);
        pad.line(&[elbow, tip], shade, width);
        pad.disc(elbow, 0.5 * width + 1.0, shade);
        pad.disc(base, 0.5 * width + 3.0, INK);
    }
    let width = match count {
        0..=20 => 2.2,
        21..=60 => 1.5,
        _ => 0.9,
    };
    pad.line(&course, color.faint(if count > 60 { 0.75 } else { 0.95 }), width);
}

fn body(pad: &Pad<'_>, axes: &Axes, robot: &Trace, color: Color) {
    let radius = axes.length(robot.radius).max(2.0);
    let thin = if radius < 4.0 { 0.8 } else { 1.4 };
    if let (Some(first), Some(last), true) = (robot.course.first(), robot.course.last(), robot.poses.is_empty()) {
        pad.ring(axes.at(*first), radius, color, thin);
        pad.disc(axes.at(*last), radius, color.faint(0.4));
        pad.ring(axes.at(*last), radius, color, thin);
    }
    if let (Some(first), Some(last), false) = (robot.course.first(), robot.course.last(), robot.poses.is_empty()) {
        pad.ring(axes.at(*first), 5.0, color, 1.6);
        pad.disc(axes.at(*last), 5.0, color);
    }
}

fn contact(pad: &Pad<'_>, at: [f64; 2]) {
    pad.cross(at, 5.0, Color::hex(0xffffff).faint(0.8), 4.0);
    pad.cross(at, 5.0, CONTACT, 2.0);
}
