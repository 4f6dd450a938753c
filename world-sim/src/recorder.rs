//! Writes the record of a run to a file, whole or not at all. The world's process has every frame, so it is the world's
//! process that writes: an observer would miss some when thousands of ticks go by in a second.
//!
//! The file has no name until it is whole, so a run that is killed leaves nothing behind. On file systems that know no
//! files without a name it has a hidden one beside its place.

use crate::World;
use protocol::codec::CodecError;
use protocol::record::{Body, Encoder, Ending};
use protocol::world_to_daemon::Outcome;
use protocol::world_to_observer::FrameBody;
use rustix::fs::{AtFlags, CWD, Mode, OFlags, linkat, openat};
use scenarios::{Robot, Scenario};
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};

/// Bytes that are gathered before they go to the file.
const BUFFER: usize = 128 * 1024;

/// A record that is being written.
pub struct Recorder {
    target: PathBuf,
    file: File,
    /// The hidden name, where the file must have one.
    named: Option<PathBuf>,
    /// What went wrong, once something has.
    encoder: Result<Encoder, io::Error>,
    buffer: Vec<u8>,
    /// Slots whose robots are known from the scenario or have been noted as added.
    slots: usize,
    added: Vec<(u32, Robot)>,
    frame: Vec<FrameBody>,
    bodies: Vec<Body>,
}

impl Recorder {
    /// Begins a record that will be `target`.
    ///
    /// # Errors
    /// When there can be no file.
    pub fn begin(target: &Path, scenario: &Scenario) -> io::Result<Recorder> {
        let (file, named) = open(target)?;
        let mut buffer = Vec::with_capacity(2 * BUFFER);
        let encoder = Encoder::begin(scenario, &mut buffer).map_err(encoding)?;
        Ok(Recorder {
            target: target.to_path_buf(),
            file,
            named,
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
            self.added.extend(world.robot(slot).map(|robot| (slot as u32, robot.clone())));
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
        let finished = self.end(outcome);
        if let (Err(_), Some(named)) = (&finished, &self.named) {
            let _ = std::fs::remove_file(named);
        }
        finished
    }

    fn end(&mut self, outcome: &Outcome) -> io::Result<()> {
        let encoder = std::mem::replace(&mut self.encoder, Err(io::ErrorKind::Other.into()))?;
        let ending = Ending { added: std::mem::take(&mut self.added), outcome: outcome.clone() };
        encoder.end(&ending, &mut self.buffer).map_err(encoding)?;
        self.file.write_all(&self.buffer)?;
        let beside = match self.named.clone() {
            Some(named) => named,
            None => {
                let beside = beside(&self.target);
                let _ = std::fs::remove_file(&beside);
                let nameless = format!("/proc/self/fd/{}", self.file.as_raw_fd());
                linkat(CWD, nameless, CWD, &beside, AtFlags::SYMLINK_FOLLOW)?;
                beside
            }
        };
        std::fs::rename(&beside, &self.target).inspect_err(|_| _ = std::fs::remove_file(&beside))
    }
}

/// A file in the directory of `target`, and its name if it has one.
fn open(target: &Path) -> io::Result<(File, Option<PathBuf>)> {
    let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let nameless = openat(CWD, folder, OFlags::TMPFILE | OFlags::WRONLY | OFlags::CLOEXEC, Mode::from_raw_mode(0o666));
    match nameless {
        Ok(file) => Ok((file.into(), None)),
        Err(_) => {
            let beside = beside(target);
            let file = OpenOptions::new().write(true).create(true).truncate(true).open(&beside)?;
            Ok((file, Some(beside)))
        }
    }
}

fn beside(target: &Path) -> PathBuf {
    // Names have a limit of their own: one that is just short enough must not fail for our sake.
    let name: String = target.file_name().unwrap_or_default().to_string_lossy().chars().take(40).collect();
    target.with_file_name(format!(".{name}.{}.tmp", std::process::id()))
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
