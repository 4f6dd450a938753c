//! Records as other formats: what notebooks, spreadsheets and ROS 2 read.

use crate::error::RecordError;
use crate::header;
use crate::reader::{Frame, Record};
use crate::ros2::Ros2Writer;
use model::{Event, RobotIndex};
use protocol::world_to_observer::FrameBody;
use serde_json::{Map, Value, json};
use std::io::{self, Write};

model::choice! {
    /// What a record can be exported to.
    pub enum ExportFormat {
        /// An MCAP file as rosbag2 writes it: messages of ROS 2, in CDR.
        McapRos2 = "mcap-ros2",
        /// A table: a line for each body and tick.
        Csv = "csv",
        /// JSON lines: the run, its frames, its events and its outcome, an object each.
        Jsonl = "jsonl",
    }
}

impl ExportFormat {
    /// The usual ending of a file of this format.
    pub fn extension(self) -> &'static str {
        match self {
            ExportFormat::McapRos2 => "ros2.mcap",
            ExportFormat::Csv => "csv",
            ExportFormat::Jsonl => "jsonl",
        }
    }
}

/// Why there is no export.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The record cannot be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The export cannot be written.
    #[error("cannot write: {0}")]
    Write(#[from] io::Error),
}

/// Writes a record to `to` as another format, as far as the record goes. `progress` hears how many parts are done, of how
/// many.
///
/// # Errors
/// See [`ExportError`]; what was written then is a part.
pub fn export<W: Write>(
    record: &Record,
    format: ExportFormat,
    to: W,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<(), ExportError> {
    match format {
        ExportFormat::McapRos2 => {
            let mut writer = Ros2Writer::begin(to, record)?;
            each(record, progress, &mut |time_ns, frame| writer.frame(time_ns, frame))?;
            writer.finish()?.flush()?;
        }
        ExportFormat::Csv => {
            let mut to = io::BufWriter::new(to);
            writeln!(to, "{CSV_HEADER}")?;
            each(record, progress, &mut |_, frame| csv(record, frame, &mut to))?;
            to.flush()?;
        }
        ExportFormat::Jsonl => {
            let mut lines = Lines { to: io::BufWriter::new(to), record, events: 0 };
            lines.begin()?;
            each(record, progress, &mut |_, frame| lines.frame(frame))?;
            lines.finish()?;
        }
    }
    Ok(())
}

/// Goes through the frames, each with its time, ns.
fn each(
    record: &Record,
    progress: &mut dyn FnMut(u64, u64),
    see: &mut dyn FnMut(u64, &Frame) -> io::Result<()>,
) -> Result<(), ExportError> {
    let mut frames = record.frames();
    let mut told = None;
    while let Some(frame) = frames.next()? {
        see(header::time_ns(frame.tick, record.scenario().clock.tick_hz), &frame)?;
        let (done, total) = frames.progress();
        if told != Some(done) {
            progress(done, total);
            told = Some(done);
        }
    }
    Ok(())
}

const CSV_HEADER: &str = "tick,t_s,kind,name,x_m,y_m,yaw_rad,goal_x_m,goal_y_m,joint_1_rad,joint_2_rad,arrived,silent";

fn csv(record: &Record, frame: &Frame, to: &mut impl Write) -> io::Result<()> {
    let t_s = frame.tick as f64 / record.scenario().clock.tick_hz;
    for body in frame.bodies {
        let ([x, y], yaw) = (body.position_m, body.yaw_rad);
        if body.is_obstacle() {
            writeln!(to, "{},{t_s},obstacle,{},{x},{y},{yaw},,,,,,", frame.tick, body.index)?;
            continue;
        }
        let robot = record.robot_at(RobotIndex(body.index), frame.tick);
        let name = robot.map_or("", |robot| robot.id.as_str());
        let joints = match robot.is_some_and(|robot| robot.arm.is_some()) {
            true => format!("{},{}", body.joints_rad[0], body.joints_rad[1]),
            false => ",".to_owned(),
        };
        let [arrived, silent] =
            [FrameBody::FLAG_ARRIVED, FrameBody::FLAG_SILENT].map(|flag| u8::from(body.flags & flag != 0));
        let [goal_x, goal_y] = body.goal_m;
        writeln!(to, "{},{t_s},robot,{name},{x},{y},{yaw},{goal_x},{goal_y},{joints},{arrived},{silent}", frame.tick)?;
    }
    Ok(())
}

/// JSON lines that are being written.
struct Lines<'a, W: Write> {
    to: W,
    record: &'a Record,
    /// Events that were written.
    events: usize,
}

impl<W: Write> Lines<'_, W> {
    fn line(&mut self, value: &Value) -> io::Result<()> {
        serde_json::to_writer(&mut self.to, value)?;
        self.to.write_all(b"\n")
    }

    fn begin(&mut self) -> io::Result<()> {
        let about = self.record.about();
        let run = json!({
            "type": "run", "shoal": about.version, "build": about.build, "scenario": about.name,
            "seed": self.record.scenario().clock.seed, "mode": about.mode,
            "tick_hz": self.record.scenario().clock.tick_hz, "whole": self.record.is_whole(),
        });
        self.line(&run)
    }

    fn frame(&mut self, frame: &Frame) -> io::Result<()> {
        self.events(frame.tick)?;
        let t_s = frame.tick as f64 / self.record.scenario().clock.tick_hz;
        let (mut robots, mut obstacles) = (Vec::new(), Vec::new());
        for body in frame.bodies {
            let mut entry = Map::new();
            if body.is_obstacle() {
                entry.insert("index".to_owned(), body.index.into());
                entry.insert("position_m".to_owned(), json!(body.position_m));
                obstacles.push(Value::Object(entry));
                continue;
            }
            let robot = self.record.robot_at(RobotIndex(body.index), frame.tick);
            entry.insert("name".to_owned(), robot.map_or("", |robot| robot.id.as_str()).into());
            entry.insert("position_m".to_owned(), json!(body.position_m));
            entry.insert("yaw_rad".to_owned(), body.yaw_rad.into());
            entry.insert("goal_m".to_owned(), json!(body.goal_m));
            if robot.is_some_and(|robot| robot.arm.is_some()) {
                entry.insert("joints_rad".to_owned(), json!(body.joints_rad));
            }
            entry.insert("arrived".to_owned(), (body.flags & FrameBody::FLAG_ARRIVED != 0).into());
            entry.insert("silent".to_owned(), (body.flags & FrameBody::FLAG_SILENT != 0).into());
            robots.push(Value::Object(entry));
        }
        let (tick, arrived, contacts) = (frame.tick, frame.arrived, frame.contacts);
        self.line(&json!({
            "type": "frame", "tick": tick, "t_s": t_s, "arrived": arrived, "contacts": contacts,
            "robots": robots, "obstacles": obstacles,
        }))
    }

    /// Entries of the log up to a tick.
    fn events(&mut self, tick: u64) -> io::Result<()> {
        let record = self.record;
        while let Some(event) = record.events().get(self.events).filter(|event| event.tick <= tick) {
            self.events += 1;
            self.event(event)?;
        }
        Ok(())
    }

    fn event(&mut self, event: &Event) -> io::Result<()> {
        let record = self.record;
        let name =
            |robot: RobotIndex| record.robot_at(robot, event.tick).map_or_else(String::new, |own| own.id.clone());
        let t_s = event.tick as f64 / record.scenario().clock.tick_hz;
        self.line(&json!({
            "type": "event", "tick": event.tick, "t_s": t_s, "robot": event.robot.map(name),
            "event": event.kind.name().word(), "detail": event.kind.detail(&name),
        }))
    }

    fn finish(mut self) -> io::Result<()> {
        self.events(u64::MAX)?;
        if let Some(ending) = self.record.ending() {
            let outcome = &ending.outcome;
            self.line(&json!({
                "type": "outcome", "ticks": outcome.ticks,
                "trajectory_hash": format!("{:016x}", outcome.trajectory_hash),
                "robot_contacts": outcome.robot_contacts, "obstacle_contacts": outcome.obstacle_contacts,
                "goals_done": outcome.goals_done,
            }))?;
        }
        self.to.flush()
    }
}
