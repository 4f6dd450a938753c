//! What is looked at: robots and obstacles as the messages that viewers know. Everything is flat on the ground; heights are
//! only there to be seen.

use crate::frame::Body;
use crate::palette::{
    Color, DARK, GREY, LINE_M, MOVING, OBSTACLE_HEIGHT_M, ROBOT_HEIGHT_M, WORLD, color_of, level, obstacle_frame,
};
use crate::wire::Message;
use geometry::{Capsule, Map};
use model::{ArmSetup, EventName, Obstacle, Robot, Shape};
use nalgebra::Point2;

fn put_time(out: &mut Message, field: u32, time_ns: u64) {
    out.message(field, |time| {
        time.uint(1, time_ns / 1_000_000_000).uint(2, time_ns % 1_000_000_000);
    });
}

fn put_vector(out: &mut Message, field: u32, [x, y, z]: [f64; 3]) {
    out.message(field, |vector| {
        vector.double(1, x).double(2, y).double(3, z);
    });
}

fn put_yaw(out: &mut Message, field: u32, yaw_rad: f64) {
    out.message(field, |quaternion| {
        quaternion.double(3, (0.5 * yaw_rad).sin()).double(4, (0.5 * yaw_rad).cos());
    });
}

fn put_pose(out: &mut Message, field: u32, at: [f64; 3], yaw_rad: f64) {
    out.message(field, |pose| {
        put_vector(pose, 1, at);
        put_yaw(pose, 2, yaw_rad);
    });
}

fn put_color(out: &mut Message, field: u32, [r, g, b, a]: Color) {
    out.message(field, |color| {
        color.double(1, r).double(2, g).double(3, b).double(4, a);
    });
}

/// A `foxglove.PoseInFrame`.
pub(crate) fn pose(time_ns: u64, body: &Body) -> Message {
    let mut out = Message::default();
    put_time(&mut out, 1, time_ns);
    out.text(2, WORLD);
    put_pose(&mut out, 3, [body.position_m[0], body.position_m[1], 0.0], body.yaw_rad);
    out
}

/// A transform of a `foxglove.FrameTransforms`.
pub(crate) fn put_transform(out: &mut Message, time_ns: u64, frame: &str, body: &Body) {
    out.message(1, |transform| {
        put_time(transform, 1, time_ns);
        transform.text(2, WORLD).text(3, frame);
        put_vector(transform, 4, [body.position_m[0], body.position_m[1], 0.0]);
        put_yaw(transform, 5, body.yaw_rad);
    });
}

/// A `foxglove.Log`.
pub(crate) fn log(time_ns: u64, name: EventName, robot: &str, words: &str) -> Message {
    let mut out = Message::default();
    put_time(&mut out, 1, time_ns);
    out.uint(2, level(name)).text(3, words).text(4, robot);
    out
}

/// Begins an entity of a `foxglove.SceneUpdate`.
fn put_entity(out: &mut Message, frame: &str, id: &str, locked: bool, draw: impl FnOnce(&mut Message)) {
    out.message(2, |entity| {
        // The time of a locked entity does not matter, and what stands was always there.
        put_time(entity, 1, 0);
        entity.text(2, frame).text(3, id).uint(5, locked.into());
        draw(entity);
    });
}

fn put_cylinder(entity: &mut Message, at: [f64; 2], radius_m: f64, height_m: f64, color: Color) {
    entity.message(10, |cylinder| {
        put_pose(cylinder, 1, [at[0], at[1], 0.5 * height_m], 0.0);
        put_vector(cylinder, 2, [2.0 * radius_m, 2.0 * radius_m, height_m]);
        cylinder.double(3, 1.0).double(4, 1.0);
        put_color(cylinder, 5, color);
    });
}

/// A line through points; `kind` 0 is open, 1 closed, 2 a line for each two points.
fn put_line(entity: &mut Message, kind: u64, points: impl Iterator<Item = [f64; 3]>, thickness_m: f64, color: Color) {
    entity.message(11, |line| {
        line.uint(1, kind);
        put_pose(line, 2, [0.0; 3], 0.0);
        line.double(3, thickness_m);
        points.for_each(|point| put_vector(line, 5, point));
        put_color(line, 6, color);
    });
}

fn put_shape(entity: &mut Message, shape: &Shape, origin: [f64; 2], color: Color) {
    let moved = |point: &Point2<f64>| [point.x - origin[0], point.y - origin[1]];
    match shape {
        Shape::Capsule(capsule) => put_capsule(entity, &moved, capsule, color),
        Shape::Polygon(corners) => {
            for height in [0.0, OBSTACLE_HEIGHT_M] {
                let points = corners.iter().map(moved).map(|[x, y]| [x, y, height]);
                put_line(entity, 1, points, LINE_M, color);
            }
        }
    }
}

fn put_capsule(entity: &mut Message, moved: &dyn Fn(&Point2<f64>) -> [f64; 2], capsule: &Capsule, color: Color) {
    let (a, b) = (moved(&capsule.a), moved(&capsule.b));
    let radius_m = capsule.radius.max(0.5 * LINE_M);
    put_cylinder(entity, a, radius_m, OBSTACLE_HEIGHT_M, color);
    if a == b {
        return;
    }
    put_cylinder(entity, b, radius_m, OBSTACLE_HEIGHT_M, color);
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    entity.message(8, |cube| {
        put_pose(cube, 1, [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * OBSTACLE_HEIGHT_M], dy.atan2(dx));
        put_vector(cube, 2, [dx.hypot(dy), 2.0 * radius_m, OBSTACLE_HEIGHT_M]);
        put_color(cube, 3, color);
    });
}

/// A `foxglove.SceneUpdate` with everything that there is: obstacles, and these robots. Viewers that jump to a time take
/// the newest one before it, so each holds the whole scene.
pub(crate) fn scene<'a>(obstacles: &[Obstacle], robots: impl Iterator<Item = (u32, &'a Robot)>) -> Message {
    let mut out = Message::default();
    // Everything that was there before goes.
    out.message(1, |deletion| {
        put_time(deletion, 1, 0);
        deletion.uint(2, 1);
    });
    for (obstacle, index) in obstacles.iter().zip(0..) {
        let id = obstacle_frame(index);
        let moves = obstacle.motion.is_some();
        let (frame, origin) = if moves { (id.as_str(), obstacle.shape.reference().into()) } else { (WORLD, [0.0; 2]) };
        let color = if moves { MOVING } else { GREY };
        put_entity(&mut out, frame, &id, true, |entity| put_shape(entity, &obstacle.shape, origin, color));
    }
    for (slot, robot) in robots.filter(|(_, robot)| robot.arm.is_none()) {
        let radius_m = robot.radius_m;
        put_entity(&mut out, &robot.id, &robot.id, true, |entity| {
            put_cylinder(entity, [0.0; 2], radius_m, ROBOT_HEIGHT_M, color_of(slot));
            let ahead = [[0.0, 0.0, ROBOT_HEIGHT_M + 0.01], [radius_m, 0.0, ROBOT_HEIGHT_M + 0.01]];
            put_line(entity, 0, ahead.into_iter(), 0.2 * radius_m, DARK);
        });
    }
    out
}

/// A `foxglove.SceneUpdate` with the walls of a map.
pub(crate) fn walls(map: &Map) -> Message {
    let mut out = Message::default();
    put_entity(&mut out, WORLD, "map", false, |entity| {
        let ends = map.walls().flat_map(|wall| [wall.a, wall.b]).map(|end| [end.x, end.y, 0.0]);
        put_line(entity, 2, ends, LINE_M, GREY);
    });
    out
}

/// A `foxglove.SceneUpdate` with the goals of robots.
pub(crate) fn goals<'a>(robots: impl Iterator<Item = (u32, &'a Robot, [f64; 2])>) -> Message {
    let mut out = Message::default();
    for (slot, robot, [x, y]) in robots {
        let id = format!("goal-{}", robot.id);
        let r = 0.5 * robot.radius_m;
        put_entity(&mut out, WORLD, &id, false, |entity| {
            let corners = [[x - r, y - r, 0.0], [x + r, y - r, 0.0], [x + r, y + r, 0.0], [x - r, y + r, 0.0]];
            put_line(entity, 1, corners.into_iter(), LINE_M, color_of(slot));
        });
    }
    out
}

/// A `foxglove.SceneUpdate` with arms as they stand.
pub(crate) fn arms<'a>(arms: impl Iterator<Item = (u32, &'a Robot, &'a ArmSetup, [f64; 2])>) -> Message {
    let mut out = Message::default();
    for (slot, robot, arm, joints) in arms {
        let geometry = &arm.geometry;
        let points = [geometry.base, geometry.elbow(joints), geometry.tip(joints)];
        put_entity(&mut out, WORLD, &robot.id, false, |entity| {
            let points = points.iter().map(|point| [point.x, point.y, 0.5 * ROBOT_HEIGHT_M]);
            put_line(entity, 0, points, 2.0 * robot.radius_m, color_of(slot));
        });
    }
    out
}
