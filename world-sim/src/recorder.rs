//! Writes the record of a run to a file, whole or not at all. The world's process has every frame, so it is the world's
//! process that writes: an observer would miss some when thousands of ticks go by in a second. A run that is killed leaves
//! nothing behind ([`WholeFile`]).

use crate::World;
use crate::whole_file::WholeFile;
use model::{Outcome, Robot, RobotIndex, Scenario};
use protocol::codec::CodecError;
use protocol::record::{Body, Encoder, Ending};
use protocol::world_to_observer::FrameBody;
use std::io::{self, Write};
use std::path::Path;

/// Bytes that are gathered before they go to the file.
const BUFFER: usize = 128 * 1024;

/// A record that is being written.
pub struct Recorder {
    file: WholeFile,
    /// What went wrong, once something has.
    encoder: Result<Encoder, io::Error>,
    buffer: Vec<u8>,
    /// Slots whose robots are known from the scenario or have been noted as added.
    slots: usize,
    added: Vec<(RobotIndex, Robot)>,
    frame: Vec<FrameBody>,
    bodies: Vec<Body>,
}

impl Recorder {
    /// Begins a record that will be `target`.
    ///
    /// # Errors
    /// When there can be no file.
    pub fn begin(target: &Path, scenario: &Scenario) -> io::Result<Recorder> {
        let file = WholeFile::begin(target)?;
        let mut buffer = Vec::with_capacity(2 * BUFFER);
        let encoder = Encoder::begin(scenario, &mut buffer).map_err(encoding)?;
        Ok(Recorder {
            file,
            encoder: Ok(encoder),
            buffer,
            slots: scenario.robots.len(),
            added: Vec::new(),
            frame: Vec::new(),
            bodies: Vec::new(),
        })
    }

    /// Adds the present tick: called when it has been opened, and once after the last one. A failure is kept for the
    /// end: the run does not suffer from it.
    pub fn frame(&mut self, world: &World) {
        let Ok(encoder) = &mut self.encoder else { return };
        self.frame.clear();
        world.frame(&mut self.frame);
        self.bodies.clear();
        self.bodies.extend(self.frame.iter().map(|body| of(body, world)));
        encoder.frame(world.tick(), &self.bodies, &mut self.buffer);
        for slot in self.slots..world.slots() {
            self.added.extend(world.robot(slot).map(|robot| (RobotIndex::of(slot), robot.clone())));
            self.slots = slot + 1;
        }
        if self.buffer.len() >= BUFFER {
            if let Err(error) = self.file.write_all(&self.buffer) {
                self.encoder = Err(error);
            }
            self.buffer.clear();
        }
    }

    /// Ends the record with what the run came to, and gives the file its name.
    ///
    /// # Errors
    /// With the first thing that went wrong; there is no file then.
    pub fn finish(mut self, outcome: &Outcome) -> io::Result<()> {
        let ending = Ending { added: self.added, outcome: outcome.clone() };
        self.encoder?.end(&ending, &mut self.buffer).map_err(encoding)?;
        self.file.write_all(&self.buffer)?;
        self.file.finish()
    }
}

fn encoding(error: CodecError) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, error)
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
