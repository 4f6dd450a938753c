//! Records for the page: what stays, and frames by windows.

use crate::json;
use model::{Event, RobotIndex};
use record::{Record, RecordError};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use watch::{Body, Fleet, Frame, Member};

/// Maximum number of frames in an answer.
const FRAMES_MAX: usize = 512;
/// Maximum number of events that are shown: the newest ones.
const EVENTS_MAX: usize = 5000;

/// A record that is played.
#[derive(Debug)]
pub struct Tape {
    path: PathBuf,
    record: Record,
    first: u64,
    last: u64,
}

impl Tape {
    /// Looks where a record begins and ends; `path` is its name.
    ///
    /// # Errors
    /// When its beginning is damaged.
    pub fn of(path: &Path, record: Record) -> Result<Tape, RecordError> {
        let mut frames = record.frames();
        let first = frames.next()?.map_or(0, |frame| frame.tick);
        let mut last = first;
        match record.ending() {
            Some(ending) => last = ending.outcome.ticks,
            // Only the frames know how far a record goes that is cut off. What is damaged further on ends it as well.
            None => {
                while let Ok(Some(frame)) = frames.next() {
                    last = frame.tick;
                }
            }
        }
        drop(frames);
        Ok(Tape { path: path.to_path_buf(), record, first, last })
    }

    /// Where it is, for people.
    pub(crate) fn name(&self) -> String {
        self.path.display().to_string()
    }

    /// All but the frames.
    pub(crate) fn about(&self) -> Value {
        let scenario = self.record.scenario();
        let mut fleet = Fleet::of(&self.name(), None, scenario);
        for (index, robot) in self.record.robots() {
            let member = Member::of(robot);
            match fleet.members.get_mut(index.at()) {
                Some(place) => *place = member,
                None => fleet.members.push(member),
            }
        }
        let mut planners: Vec<&str> = fleet.members.iter().map(|member| member.planner.as_str()).collect();
        planners.sort_unstable();
        planners.dedup();
        let planners = planners.join(" + ");
        let events = self.record.events();
        let from = events.len().saturating_sub(EVENTS_MAX);
        let events: Vec<Value> = events[from..].iter().map(|event| self.event(event, fleet.tick_hz)).collect();
        let mut value = json!({ "first": self.first, "last": self.last, "events": events });
        value["cut"] = self.record.cut().map(|cut| format!("{}: {cut}", self.name())).into();
        value["fleet"] = json!(fleet);
        value["fleet"]["planners"] = planners.into();
        value
    }

    fn event(&self, event: &Event, tick_hz: f64) -> Value {
        let name = |index: RobotIndex| {
            let robot = self.record.robot_at(index, event.tick).or_else(|| self.record.robot(index));
            robot.map_or_else(|| format!("slot-{index}"), |robot| robot.id.clone())
        };
        json::event(event, event.robot.map(name).as_deref(), &event.kind.detail(&name), tick_hz)
    }

    /// The frames of every `step`th tick from one to another, as JSON; no more than [`FRAMES_MAX`].
    ///
    /// # Errors
    /// When the record is damaged there.
    pub(crate) fn frames(&self, from: u64, to: u64, step: u64) -> Result<String, RecordError> {
        let tick_hz = self.record.scenario().clock.tick_hz;
        let mut texts = Vec::new();
        let mut frames = self.record.frames_from(from);
        while texts.len() < FRAMES_MAX
            && let Some(frame) = frames.next()?
            && frame.tick <= to
        {
            if (frame.tick - from).is_multiple_of(step.max(1)) || frame.tick == self.last {
                texts.push(json::frame(&Frame {
                    tick: frame.tick,
                    time_s: frame.tick as f64 / tick_hz,
                    arrived: frame.arrived,
                    contacts: u32::try_from(frame.contacts).unwrap_or(u32::MAX),
                    bodies: frame.bodies.iter().map(body).collect(),
                }));
            }
        }
        Ok(format!("{{\"frames\":[{}]}}", texts.join(",")))
    }
}

fn body(recorded: &record::Body) -> Body {
    let body = Body {
        index: recorded.index,
        flags: recorded.flags,
        position_m: recorded.position_m,
        yaw_rad: recorded.yaw_rad,
        joints_rad: recorded.joints_rad,
        ..Body::default()
    };
    Body { goal_m: (!body.is_obstacle()).then_some(recorded.goal_m), ..body }
}
