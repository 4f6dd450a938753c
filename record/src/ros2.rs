//! A record as ROS 2 has it: messages in CDR, as rosbag2 keeps them in MCAP.

use crate::container::{Container, Encoding};
use crate::frame::Body;
use crate::header::{self, LIBRARY};
use crate::palette::{self, Color};
use crate::reader::{Frame, Record};
use geometry::Capsule;
use model::{Event, Robot, RobotIndex, Shape};
use std::collections::BTreeMap;
use std::io::{self, Write};

/// All definitions of messages that are used, one after the other.
const DEFINITIONS: &str = include_str!("schemas/ros2.msg");
const CDR: Encoding = Encoding { message: "cdr", schema: "ros2msg" };
/// A chunk with more than this is ended, bytes.
const CHUNK_BYTES: usize = 1 << 20;
/// Kinds of markers.
const CUBE: i32 = 1;
const CYLINDER: i32 = 3;
const LINE_STRIP: i32 = 4;
const LINE_LIST: i32 = 5;

/// A message in CDR: little-endian, every number at a multiple of its size.
struct Cdr(Vec<u8>);

impl Cdr {
    fn new() -> Cdr {
        Cdr(vec![0, 1, 0, 0])
    }

    fn align(&mut self, size: usize) -> &mut Cdr {
        let length = (self.0.len() - 4).next_multiple_of(size) + 4;
        self.0.resize(length, 0);
        self
    }

    fn byte(&mut self, value: u8) -> &mut Cdr {
        self.0.push(value);
        self
    }

    fn long(&mut self, value: u32) -> &mut Cdr {
        self.align(4).0.extend_from_slice(&value.to_le_bytes());
        self
    }

    fn int(&mut self, value: i32) -> &mut Cdr {
        self.long(value.cast_unsigned())
    }

    fn float(&mut self, value: f64) -> &mut Cdr {
        self.long((value as f32).to_bits())
    }

    fn double(&mut self, value: f64) -> &mut Cdr {
        self.align(8).0.extend_from_slice(&value.to_le_bytes());
        self
    }

    /// Its length with the zero at its end, and it.
    fn text(&mut self, value: &str) -> &mut Cdr {
        self.long(value.len() as u32 + 1).0.extend_from_slice(value.as_bytes());
        self.byte(0)
    }

    fn time(&mut self, time_ns: u64) -> &mut Cdr {
        let seconds = i32::try_from(time_ns / 1_000_000_000).unwrap_or(i32::MAX);
        self.int(seconds).long((time_ns % 1_000_000_000) as u32)
    }

    fn header(&mut self, time_ns: u64, frame: &str) -> &mut Cdr {
        self.time(time_ns).text(frame)
    }

    fn point(&mut self, [x, y, z]: [f64; 3]) -> &mut Cdr {
        self.double(x).double(y).double(z)
    }

    fn yaw(&mut self, yaw_rad: f64) -> &mut Cdr {
        self.double(0.0).double(0.0).double((0.5 * yaw_rad).sin()).double((0.5 * yaw_rad).cos())
    }

    fn color(&mut self, color: Color) -> &mut Cdr {
        color.iter().for_each(|part| _ = self.float(*part));
        self
    }
}

/// The definition of a message and of all messages in it, as `ros2msg` has them: the others follow, each behind a line.
fn definition(name: &str) -> String {
    let body = |name: &str| {
        let start = format!("MSG: {name}\n");
        let from = DEFINITIONS.find(&start).map_or(DEFINITIONS.len(), |at| at + start.len());
        DEFINITIONS[from..].split("MSG: ").next().unwrap_or_default()
    };
    let mut needed = vec![name];
    let mut next = 0;
    while let Some(name) = needed.get(next) {
        for line in body(name).lines() {
            let kind = line.split([' ', '[']).next().unwrap_or_default();
            if kind.contains('/') && !needed.contains(&kind) {
                needed.push(kind);
            }
        }
        next += 1;
    }
    let others = needed[1..].iter().map(|name| format!("{}\nMSG: {name}\n{}", "=".repeat(80), body(name)));
    body(name).to_owned() + &others.collect::<String>()
}

/// Writes a record as ROS 2 has it, frame by frame.
pub(crate) struct Ros2Writer<'a, W: Write> {
    file: Container<W>,
    record: &'a Record,
    tf: u16,
    markers: u16,
    log: u16,
    poses: BTreeMap<(u32, String), u16>,
    /// Who was drawn last.
    drawn: Vec<(u32, String)>,
    /// Events that were written.
    events: usize,
}

impl<'a, W: Write> Ros2Writer<'a, W> {
    pub(crate) fn begin(to: W, record: &'a Record) -> io::Result<Ros2Writer<'a, W>> {
        let mut file = Container::begin(to, "ros2", LIBRARY)?;
        let tf = channel(&mut file, "/tf", "tf2_msgs", "TFMessage")?;
        let markers = channel(&mut file, "/markers", "visualization_msgs", "MarkerArray")?;
        let log = channel(&mut file, "/rosout", "rcl_interfaces", "Log")?;
        Ok(Ros2Writer { file, record, tf, markers, log, poses: BTreeMap::new(), drawn: Vec::new(), events: 0 })
    }

    pub(crate) fn frame(&mut self, time_ns: u64, frame: &Frame) -> io::Result<()> {
        self.events(frame.tick)?;
        let named = |body: &Body| match body.is_obstacle() {
            true => Some(palette::obstacle_frame(body.index)),
            false => self.record.robot_at(RobotIndex(body.index), frame.tick).map(|robot| robot.id.clone()),
        };
        let bodies: Vec<(String, &Body)> = frame.bodies.iter().filter_map(|body| Some((named(body)?, body))).collect();
        let mut message = Cdr::new();
        message.long(bodies.len() as u32);
        for (name, body) in &bodies {
            let [x, y] = body.position_m;
            message.header(time_ns, palette::WORLD).text(name).point([x, y, 0.0]).yaw(body.yaw_rad);
        }
        self.file.message(self.tf, time_ns, frame.tick as u32, &message.0)?;
        for (name, body) in bodies.iter().filter(|(_, body)| !body.is_obstacle()) {
            let key = (body.index, name.clone());
            let pose = match self.poses.get(&key) {
                Some(pose) => *pose,
                None => {
                    let topic = format!("/robots/{}/pose", name.replace('-', "_"));
                    let pose = channel(&mut self.file, &topic, "geometry_msgs", "PoseStamped")?;
                    self.poses.insert(key, pose);
                    pose
                }
            };
            let [x, y] = body.position_m;
            let mut message = Cdr::new();
            message.header(time_ns, palette::WORLD).point([x, y, 0.0]).yaw(body.yaw_rad);
            self.file.message(pose, time_ns, frame.tick as u32, &message.0)?;
        }
        self.draw(time_ns, frame)?;
        if self.file.chunk_bytes() >= CHUNK_BYTES {
            self.file.end_chunk()?;
        }
        Ok(())
    }

    /// Entries of the log up to a tick.
    fn events(&mut self, tick: u64) -> io::Result<()> {
        let record = self.record;
        while let Some(event) = record.events().get(self.events).filter(|event| event.tick <= tick) {
            self.events += 1;
            let mut message = Cdr::new();
            let (who, words) = words(record, event);
            let level = 10 * palette::level(event.kind.name()) as u8;
            let time_ns = header::time_ns(event.tick, record.scenario().clock.tick_hz);
            message.time(time_ns).byte(level).text(&who).text(&words).text("").text("").long(0);
            self.file.message(self.log, time_ns, event.tick as u32, &message.0)?;
        }
        Ok(())
    }

    /// Obstacles and robots, when somebody came or left; arms always.
    fn draw(&mut self, time_ns: u64, frame: &Frame) -> io::Result<()> {
        let robots: Vec<(&Body, &Robot)> = (frame.bodies.iter().filter(|body| !body.is_obstacle()))
            .filter_map(|body| Some((body, self.record.robot_at(RobotIndex(body.index), frame.tick)?)))
            .collect();
        let drawn: Vec<(u32, String)> = robots.iter().map(|(body, robot)| (body.index, robot.id.clone())).collect();
        let arms = robots.iter().any(|(_, robot)| robot.arm.is_some());
        if drawn == self.drawn && !arms && frame.tick > 0 {
            return Ok(());
        }
        self.drawn = drawn;
        let mut markers = Markers { time_ns, message: Cdr::new(), count: 0 };
        markers.message.long(0);
        markers.begin("", "all", 0, 0, 3).point([0.0; 3]).yaw(0.0);
        markers.end([0.0; 3], [0.0; 4], &[]);
        if let Some(map) = self.record.scenario().walls() {
            let ends: Vec<_> = map.walls().flat_map(|wall| [wall.a, wall.b]).map(|end| [end.x, end.y, 0.0]).collect();
            markers.begin("", "map", 0, LINE_LIST, 0).point([0.0; 3]).yaw(0.0);
            markers.end([palette::LINE_M, 0.0, 0.0], palette::GREY, &ends);
        }
        for (obstacle, index) in self.record.scenario().obstacles.iter().zip(0..) {
            let frame = palette::obstacle_frame(index);
            match obstacle.motion.is_some() {
                true => {
                    markers.shape(&frame, index, &obstacle.shape, obstacle.shape.reference().into(), palette::MOVING);
                }
                false => markers.shape(palette::WORLD, index, &obstacle.shape, [0.0; 2], palette::GREY),
            }
        }
        for (body, robot) in &robots {
            markers.robot(body, robot);
        }
        let Markers { mut message, count, .. } = markers;
        message.0[4..8].copy_from_slice(&count.to_le_bytes());
        self.file.message(self.markers, time_ns, frame.tick as u32, &message.0)
    }

    pub(crate) fn finish(mut self) -> io::Result<W> {
        self.events(u64::MAX)?;
        self.file.finish()
    }
}

/// Who an event is about, and what happened.
fn words(record: &Record, event: &Event) -> (String, String) {
    let name =
        |robot: RobotIndex| record.robot_at(robot, event.tick).map_or_else(String::new, |robot| robot.id.clone());
    let detail = event.kind.detail(&name);
    let word = event.kind.name().word();
    let words = if detail.is_empty() { word.to_owned() } else { format!("{word}: {detail}") };
    (event.robot.map(name).unwrap_or_default(), words)
}

fn channel<W: Write>(file: &mut Container<W>, topic: &str, package: &str, name: &str) -> io::Result<u16> {
    let definition = definition(&format!("{package}/{name}"));
    // What rosbag2 asks of a topic: the quality of service that its publishers offered, here the default of each.
    let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), String::new())]);
    file.channel(topic, &format!("{package}/msg/{name}"), &CDR, definition.as_bytes(), &metadata)
}

/// A `visualization_msgs/MarkerArray` that is being written.
struct Markers {
    time_ns: u64,
    message: Cdr,
    count: u32,
}

impl Markers {
    /// Begins a marker, up to its pose.
    fn begin(&mut self, frame: &str, ns: &str, id: u32, kind: i32, action: i32) -> &mut Cdr {
        self.count += 1;
        let frame = if frame.is_empty() { palette::WORLD } else { frame };
        self.message.header(self.time_ns, frame).text(ns).int(id.cast_signed()).int(kind).int(action)
    }

    /// Ends a marker, from its scale on.
    fn end(&mut self, scale: [f64; 3], color: Color, points: &[[f64; 3]]) {
        self.message.point(scale).color(color).int(0).long(0).byte(1).long(points.len() as u32);
        points.iter().for_each(|point| _ = self.message.point(*point));
        // No colours of points, no texture and no mesh.
        self.message.long(0).text("").header(0, "").text("").long(0).long(0).text("").text("").long(0).text("").byte(0);
    }

    fn cylinder(&mut self, frame: &str, ns: &str, id: u32, at: [f64; 2], [radius_m, height_m]: [f64; 2], color: Color) {
        self.begin(frame, ns, id, CYLINDER, 0).point([at[0], at[1], 0.5 * height_m]).yaw(0.0);
        self.end([2.0 * radius_m, 2.0 * radius_m, height_m], color, &[]);
    }

    fn line(&mut self, frame: &str, ns: &str, id: u32, points: &[[f64; 3]], thickness_m: f64, color: Color) {
        self.begin(frame, ns, id, LINE_STRIP, 0).point([0.0; 3]).yaw(0.0);
        self.end([thickness_m, 0.0, 0.0], color, points);
    }

    fn shape(&mut self, frame: &str, index: u32, shape: &Shape, origin: [f64; 2], color: Color) {
        let height_m = palette::OBSTACLE_HEIGHT_M;
        match shape {
            Shape::Capsule(Capsule { a, b, radius }) => {
                let radius_m = radius.max(0.5 * palette::LINE_M);
                let [a, b] = [a, b].map(|point| [point.x - origin[0], point.y - origin[1]]);
                self.cylinder(frame, "obstacles", 3 * index, a, [radius_m, height_m], color);
                if a != b {
                    self.cylinder(frame, "obstacles", 3 * index + 1, b, [radius_m, height_m], color);
                    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
                    let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * height_m];
                    self.begin(frame, "obstacles", 3 * index + 2, CUBE, 0).point(middle).yaw(dy.atan2(dx));
                    self.end([dx.hypot(dy), 2.0 * radius_m, height_m], color, &[]);
                }
            }
            Shape::Polygon(corners) => {
                let closed = corners.iter().chain(corners.first());
                let points: Vec<_> = closed.map(|point| [point.x - origin[0], point.y - origin[1], 0.0]).collect();
                self.line(frame, "obstacles", 3 * index, &points, palette::LINE_M, color);
            }
        }
    }

    fn robot(&mut self, body: &Body, robot: &Robot) {
        let (slot, color) = (body.index, palette::color_of(body.index));
        match &robot.arm {
            Some(arm) => {
                let geometry = &arm.geometry;
                let points = [geometry.base, geometry.elbow(body.joints_rad), geometry.tip(body.joints_rad)];
                let points = points.map(|point| [point.x, point.y, 0.5 * palette::ROBOT_HEIGHT_M]);
                self.line(palette::WORLD, "robots", 2 * slot, &points, 2.0 * robot.radius_m, color);
            }
            None => {
                self.cylinder(
                    &robot.id,
                    "robots",
                    2 * slot,
                    [0.0; 2],
                    [robot.radius_m, palette::ROBOT_HEIGHT_M],
                    color,
                );
                let top = palette::ROBOT_HEIGHT_M + 0.01;
                let ahead = [[0.0, 0.0, top], [robot.radius_m, 0.0, top]];
                self.line(&robot.id, "robots", 2 * slot + 1, &ahead, 0.2 * robot.radius_m, palette::DARK);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_at_multiples_of_their_size() {
        let mut message = Cdr::new();
        message.byte(1).long(2).text("ab").double(1.0);
        let expected =
            [[0, 1, 0, 0].as_slice(), &[1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, b'a', b'b', 0, 0], &1.0_f64.to_le_bytes()];
        assert_eq!(message.0, expected.concat());
    }

    #[test]
    fn a_definition_has_those_of_all_that_it_needs() {
        let text = definition("geometry_msgs/PoseStamped");
        assert!(text.starts_with("std_msgs/Header header\ngeometry_msgs/Pose pose\n===="), "{text}");
        let others: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("MSG: ")).collect();
        let expected = [
            "std_msgs/Header",
            "geometry_msgs/Pose",
            "builtin_interfaces/Time",
            "geometry_msgs/Point",
            "geometry_msgs/Quaternion",
        ];
        assert_eq!(others, expected);
    }
}
