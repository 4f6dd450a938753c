//! What of a world is recorded. The world's process has every frame, so it is the world's process that records: an observer
//! would miss some when thousands of ticks go by in a second. What is written, and how, is the business of [`record`].

use crate::{World, figures};
use bus::Address;
use model::{Outcome, Robot, RobotInstance, Scenario};
use protocol::codec;
use protocol::world_to_observer::FrameBody;
use record::{Added, Body, Count, Ending, InputSource, Moment, Sink};
use std::io;
use std::path::Path;

/// Who has a slot, as far as the record says.
#[derive(Default)]
struct Known {
    instance: Option<RobotInstance>,
    robot: Option<Robot>,
}

/// A record that is being written.
pub struct Recorder {
    sink: Sink,
    /// What will be handed over with the next frame.
    next: Moment,
    /// Who has each slot, as far as the record knows.
    known: Vec<Known>,
    /// Entries of the log that were handed over.
    events: usize,
    frame: Vec<FrameBody>,
}

impl Recorder {
    /// Begins a record that will be `target`. From now on there is a file of this name that can be read.
    ///
    /// # Errors
    /// When there can be no file.
    pub fn begin(target: &Path, scenario: &Scenario) -> io::Result<Recorder> {
        Recorder::of(Sink::begin(target, scenario)?, scenario)
    }

    /// The same for a fleet of processes: what they count at `address` is recorded about once a second.
    ///
    /// # Errors
    /// As [`Recorder::begin`].
    pub fn begin_counting(target: &Path, scenario: &Scenario, address: &Address) -> io::Result<Recorder> {
        let address = address.clone();
        let count: Count = Box::new(move || figures::count(&address));
        Recorder::of(Sink::begin_counting(target, scenario, Some(count))?, scenario)
    }

    fn of(sink: Sink, scenario: &Scenario) -> io::Result<Recorder> {
        Ok(Recorder {
            sink,
            next: Moment::default(),
            known: scenario.robots.iter().map(|robot| Known { instance: None, robot: Some(robot.clone()) }).collect(),
            events: 0,
            frame: Vec::new(),
        })
    }

    /// Notes what a process was told at a tick, for a replay. It goes to the file with the next frame.
    pub fn input(&mut self, tick: u64, source: InputSource, bytes: &[u8]) {
        self.next.input(tick, source, bytes);
    }

    /// Adds the present tick, and what the world was told since the one before, if it keeps that: called when it has been
    /// opened, and once after the last one. A failure is kept for the end: the run does not suffer from it.
    pub fn frame(&mut self, world: &mut World) {
        if let Some(bytes) = world.take_inputs().and_then(|inputs| codec::encode(&inputs).ok()) {
            self.input(world.tick(), InputSource::World, &bytes);
        }
        self.next.tick = world.tick();
        self.next.arrived = world.arrived_count() as u32;
        self.next.contacts = world.contacts();
        self.next.bodies.clear();
        bodies(world, &mut self.frame, &mut self.next.bodies);
        let events = world.events();
        self.next.events.extend_from_slice(&events[self.events.min(events.len())..]);
        self.events = events.len();
        for slot in 0..world.slots() {
            self.meet(world, slot);
        }
        self.sink.take(&mut self.next);
    }

    /// Notes a robot that came to a slot while the fleet ran. A new incarnation is mostly the robot that was there.
    fn meet(&mut self, world: &World, slot: usize) {
        let Some((instance, _)) = world.state(slot) else { return };
        if self.known.len() <= slot {
            self.known.resize_with(slot + 1, Known::default);
        }
        let known = &mut self.known[slot];
        if known.instance == Some(instance) {
            return;
        }
        let Some(robot) = world.robot(slot) else { return };
        known.instance = Some(instance);
        if known.robot.as_ref() != Some(robot) {
            known.robot = Some(robot.clone());
            self.next.added.push(Added { tick: world.tick(), index: instance.index, robot: robot.clone() });
        }
    }

    /// Ends the record with what the run came to. What was left out, because the disk did not keep up, is told in it.
    ///
    /// # Errors
    /// With the first thing that went wrong. What was written before can be read.
    pub fn finish(self, outcome: &Outcome) -> io::Result<()> {
        self.sink.finish(Ending { outcome: outcome.clone() })
    }
}

/// What a record holds of every body at the present tick.
pub fn bodies_of(world: &World) -> Vec<Body> {
    let mut out = Vec::new();
    bodies(world, &mut Vec::new(), &mut out);
    out
}

/// The same, appended to `out`; `frame` is memory that is used again.
fn bodies(world: &World, frame: &mut Vec<FrameBody>, out: &mut Vec<Body>) {
    frame.clear();
    world.frame(frame);
    out.extend(frame.iter().map(|body| of(body, world)));
}

fn of(body: &FrameBody, world: &World) -> Body {
    let is_robot = body.flags & FrameBody::FLAG_OBSTACLE == 0;
    let goal_m = is_robot.then(|| world.odometry(body.index as usize)).map(|own| [own.goal_x_m, own.goal_y_m]);
    Body {
        index: body.index,
        flags: body.flags,
        position_m: [body.x_m, body.y_m],
        yaw_rad: body.yaw_rad,
        goal_m: goal_m.unwrap_or_default(),
        joints_rad: body.joints_rad,
    }
}
