//! Reads records, from any tick, in memory that does not grow with their length.
//!
//! Opening one walks over the heads of its chunks, without their content, and reads those with events or robots that came
//! late. A record that was cut off is what there is up to its last whole chunk.

use crate::container::{self, Entry, MAGIC};
use crate::error::{Cut, RecordError};
use crate::figures::{self, Figures};
use crate::frame::{Body, Tracks};
use crate::header::{self, About, Ending};
use crate::moment::{Added, InputSource};
use crate::source::Source;
use crate::walk::{Chunk, MAGIC_OLD, Topic, Walk, read_part};
use crate::wire::{Value, fields};
use model::{Event, MAX_ROBOTS, Robot, RobotIndex, Scenario};
use protocol::codec;
use std::collections::HashMap;
use std::path::Path;

const EVENTS_MAX: usize = 100_000;
const ADDED_MAX: usize = 16 * MAX_ROBOTS;

/// A tick, and the processes by name, each with what it has counted by then.
pub type Newest = (u64, Vec<(String, Figures)>);

/// A record.
#[derive(Clone, Debug)]
pub struct Record {
    source: Source,
    about: About,
    scenario: Scenario,
    ending: Option<Ending>,
    cut: Option<Cut>,
    chunks: Vec<Chunk>,
    topics: HashMap<u16, Topic>,
    events: Vec<Event>,
    added: Vec<Added>,
    left_out: u64,
}

impl Record {
    /// Whether bytes begin as a record does, of this format or the one before.
    pub fn is_begun_by(bytes: &[u8]) -> bool {
        bytes.starts_with(MAGIC) || bytes.starts_with(MAGIC_OLD)
    }

    /// Opens a record.
    ///
    /// # Errors
    /// See [`RecordError`]. A record that is cut off or damaged behind its beginning is no error: see [`Record::cut`].
    pub fn open(path: &Path) -> Result<Record, RecordError> {
        Record::of(Source::open(path)?)
    }

    /// Opens a record that is in memory.
    ///
    /// # Errors
    /// As [`Record::open`].
    pub fn read(bytes: Vec<u8>) -> Result<Record, RecordError> {
        Record::of(Source::Memory(bytes.into()))
    }

    fn of(source: Source) -> Result<Record, RecordError> {
        let mut walk = Walk::begin(source)?;
        walk.walk_on()?;
        if let (Some(_), Some(last)) = (&walk.cut, walk.chunks.last_mut()) {
            // What a chunk has is said behind it, and that may be missing here.
            last.is_told = true;
        }
        let Walk { source, about, scenario, outcome, cut, chunks, topics, .. } = walk;
        let whole_so_far = cut.clone().unwrap_or(Cut::Ends(source.length()));
        let about = about.ok_or_else(|| RecordError::Beginning(whole_so_far.clone()))?;
        let scenario = scenario.ok_or(RecordError::Beginning(whole_so_far))?;
        let ending = outcome.map(|outcome| Ending { outcome });
        let mut record = Record {
            source,
            about,
            scenario,
            ending,
            cut,
            chunks,
            topics,
            events: Vec::new(),
            added: Vec::new(),
            left_out: 0,
        };
        record.listen()?;
        Ok(record)
    }

    /// Reads events and robots that came late.
    fn listen(&mut self) -> Result<(), RecordError> {
        let (mut events, mut added, mut left_out) = (Vec::new(), Vec::new(), 0_u64);
        let mut map = Vec::new();
        // A map is as long as its walls make it: what comes besides is not kept.
        let map_bytes = self.scenario.map.as_ref().map_or(0, |map| geometry::map::bytes_of(map.walls as usize));
        for chunk in self.chunks.iter().filter(|chunk| chunk.is_told) {
            let read = self.walk_chunk(*chunk, &mut |topic, bytes| {
                match topic {
                    Topic::Event => events.push(event_in(bytes)?),
                    Topic::Robot => added.push(robot_in(bytes)?),
                    Topic::Gap => left_out = left_out.saturating_add(number_in(bytes, 3)?),
                    Topic::Map => {
                        let part = blob_in(bytes, 1)?;
                        let room = map_bytes.saturating_sub(map.len());
                        map.extend_from_slice(&part[..part.len().min(room)]);
                    }
                    _ => {}
                }
                (events.len() <= EVENTS_MAX && added.len() <= ADDED_MAX).then_some(())
            });
            // A reader of frames there reports what is damaged.
            if let Err(error @ RecordError::Io(_)) = read {
                return Err(error);
            }
        }
        if let Some(known) = &mut self.scenario.map {
            known.attach(map).map_err(RecordError::Map)?;
        }
        (self.events, self.added, self.left_out) = (events, added, left_out);
        Ok(())
    }

    /// Which binary wrote it, of what.
    pub fn about(&self) -> &About {
        &self.about
    }

    /// What was run, without robots that were added while it ran.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// What the run came to; `None` if the record is cut off.
    pub fn ending(&self) -> Option<&Ending> {
        self.ending.as_ref()
    }

    /// It is there to its end.
    pub fn is_whole(&self) -> bool {
        self.cut.is_none()
    }

    /// Why it is not.
    pub fn cut(&self) -> Option<&Cut> {
        self.cut.as_ref()
    }

    /// Frames that are missing in it, because the disk did not keep up with the run.
    pub fn left_out(&self) -> u64 {
        self.left_out
    }

    /// The log, as far as the record goes.
    pub fn events(&self) -> &[Event] {
        &self.events
    }

    /// Robots that came while the fleet ran, in the order in which they did.
    pub fn added(&self) -> &[Added] {
        &self.added
    }

    /// Who has a slot at a tick.
    pub fn robot_at(&self, index: RobotIndex, tick: u64) -> Option<&Robot> {
        let came = self.added.iter().rev().find(|added| added.index == index && added.tick <= tick);
        came.map(|added| &added.robot).or_else(|| self.scenario.robots.get(index.at()))
    }

    /// Who had a slot last, if it ever was taken.
    pub fn robot(&self, index: RobotIndex) -> Option<&Robot> {
        self.robot_at(index, u64::MAX)
    }

    /// Everybody who had a slot last, by slot.
    pub fn robots(&self) -> impl Iterator<Item = (RobotIndex, &Robot)> {
        let own = self.scenario.robots.len();
        let slots = self.added.iter().map(|added| added.index.at() + 1).max().unwrap_or(0).max(own);
        (0..slots.min(MAX_ROBOTS)).map(RobotIndex::of).filter_map(|index| Some((index, self.robot(index)?)))
    }

    /// The frames, from the first on.
    pub fn frames(&self) -> Frames<'_> {
        Frames { record: self, next: 0, queue: Queue::default(), tracks: Tracks::default(), bodies: Vec::new() }
    }

    /// The frames, from the first that is not before `tick` on.
    pub fn frames_from(&self, tick: u64) -> Frames<'_> {
        let time_ns = header::time_ns(tick, self.scenario.clock.tick_hz);
        let mut frames = self.frames();
        frames.next = self.chunks.partition_point(|chunk| chunk.first_ns <= time_ns).saturating_sub(1);
        frames.queue.from_tick = tick;
        frames
    }

    /// What processes were told, in the order in which it was written.
    pub fn inputs(&self) -> Inputs<'_> {
        Inputs { record: self, next: 0, queue: Vec::new().into_iter() }
    }

    /// The newest figures in it: at which tick, and each process with what it has counted since the start. `fleet` is all of
    /// them together. `None` for a run in one thread, or one that was cut off in its first second.
    ///
    /// # Errors
    /// When the record is damaged there, or cannot be read.
    pub fn figures(&self) -> Result<Option<Newest>, RecordError> {
        for chunk in self.chunks.iter().rev() {
            let mut newest = None;
            self.walk_chunk(*chunk, &mut |topic, bytes| {
                if topic == Topic::Metrics {
                    newest = Some(figures::read(bytes)?);
                }
                Some(())
            })?;
            if newest.is_some() {
                return Ok(newest);
            }
        }
        Ok(None)
    }

    /// Reads the chunk and goes through its messages of known topics.
    fn walk_chunk(&self, chunk: Chunk, see: &mut dyn FnMut(Topic, &[u8]) -> Option<()>) -> Result<(), RecordError> {
        let mut bytes = Vec::new();
        read_part(&self.source, chunk.at, chunk.length, &mut bytes)?;
        let walked = container::chunk(&bytes, |entry| match entry {
            Entry::Channel(..) => Some(()),
            Entry::Message(channel, message) => match self.topics.get(&channel) {
                None | Some(Topic::Other) => Some(()),
                Some(topic) => see(*topic, message),
            },
        });
        walked.ok_or(RecordError::Damaged(chunk.at))
    }
}

fn number_in(bytes: &[u8], wanted: u32) -> Option<u64> {
    let mut found = 0;
    fields(bytes, |field, value| {
        if field == wanted {
            found = value.number()?;
        }
        Some(())
    })?;
    Some(found)
}

fn blob_in(bytes: &[u8], wanted: u32) -> Option<&[u8]> {
    let mut found: &[u8] = &[];
    fields(bytes, |field, value| {
        if field == wanted {
            found = value.bytes()?;
        }
        Some(())
    })?;
    Some(found)
}

fn event_in(bytes: &[u8]) -> Option<Event> {
    codec::decode(blob_in(bytes, 5)?).ok()
}

fn robot_in(bytes: &[u8]) -> Option<Added> {
    let index = u32::try_from(number_in(bytes, 2)?).ok().filter(|index| (*index as usize) < MAX_ROBOTS)?;
    let robot = codec::decode(blob_in(bytes, 5)?).ok()?;
    Some(Added { tick: number_in(bytes, 1)?, index: RobotIndex(index), robot })
}

/// A frame before its bodies are decoded.
#[derive(Debug, Default)]
struct Packed {
    tick: u64,
    key: bool,
    arrived: u32,
    contacts: u64,
    bodies: Vec<u8>,
}

impl Packed {
    fn of(bytes: &[u8]) -> Option<Packed> {
        let mut packed = Packed::default();
        fields(bytes, |field, value| {
            match (field, value) {
                (1, Value::Number(tick)) => packed.tick = tick,
                (2, Value::Number(key)) => packed.key = key != 0,
                (3, Value::Number(arrived)) => packed.arrived = u32::try_from(arrived).ok()?,
                (4, Value::Number(contacts)) => packed.contacts = contacts,
                (5, Value::Bytes(bodies)) => packed.bodies = bodies.to_vec(),
                _ => {}
            }
            Some(())
        })?;
        Some(packed)
    }
}

/// The frames of one chunk that have not been given out yet.
#[derive(Debug, Default)]
struct Queue {
    frames: std::vec::IntoIter<Packed>,
    from_tick: u64,
}

/// A frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame<'a> {
    /// The tick.
    pub tick: u64,
    /// Robots that have arrived.
    pub arrived: u32,
    /// Contacts so far.
    pub contacts: u64,
    /// Robots by slot, then moving obstacles.
    pub bodies: &'a [Body],
}

/// Goes through the frames of a record. One chunk of it is in memory.
#[derive(Debug)]
pub struct Frames<'a> {
    record: &'a Record,
    next: usize,
    queue: Queue,
    tracks: Tracks,
    bodies: Vec<Body>,
}

impl Frames<'_> {
    /// The next frame; `None` at the end of the record, or where it is cut off. Ticks go up; those that were left out are
    /// missing.
    ///
    /// # Errors
    /// When the record is damaged there, or cannot be read.
    #[expect(clippy::should_implement_trait, reason = "the bodies are lent, which an iterator cannot do")]
    pub fn next(&mut self) -> Result<Option<Frame<'_>>, RecordError> {
        loop {
            let Some(packed) = self.queue.frames.next() else {
                if !self.fill()? {
                    return Ok(None);
                }
                continue;
            };
            if packed.key {
                self.tracks.restart();
            }
            self.tracks.decode(&packed.bodies, &mut self.bodies).ok_or(RecordError::Impossible)?;
            if packed.tick >= self.queue.from_tick {
                let Packed { tick, arrived, contacts, .. } = packed;
                return Ok(Some(Frame { tick, arrived, contacts, bodies: &self.bodies }));
            }
        }
    }

    /// How many parts of the record have been read, and how many there are.
    pub fn progress(&self) -> (u64, u64) {
        (self.next as u64, self.record.chunks.len() as u64)
    }

    /// Reads the next chunk; `false` if there is none.
    fn fill(&mut self) -> Result<bool, RecordError> {
        let Some(chunk) = self.record.chunks.get(self.next) else { return Ok(false) };
        self.next += 1;
        let mut frames = Vec::new();
        self.record.walk_chunk(*chunk, &mut |topic, bytes| {
            if topic == Topic::Frame {
                frames.push(Packed::of(bytes)?);
            }
            Some(())
        })?;
        self.queue.frames = frames.into_iter();
        Ok(true)
    }
}

/// What a process was told.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Input {
    /// The tick.
    pub tick: u64,
    /// The process.
    pub source: InputSource,
    /// What it was told, as its writer encodes it.
    pub bytes: Vec<u8>,
}

/// Goes through what processes were told. One chunk is in memory.
#[derive(Debug)]
pub struct Inputs<'a> {
    record: &'a Record,
    next: usize,
    queue: std::vec::IntoIter<Input>,
}

impl Inputs<'_> {
    fn fill(&mut self) -> Result<bool, RecordError> {
        let Some(chunk) = self.record.chunks.get(self.next) else { return Ok(false) };
        self.next += 1;
        let mut inputs = Vec::new();
        self.record.walk_chunk(*chunk, &mut |topic, bytes| {
            if topic == Topic::Input {
                let source = InputSource::from_numbers(number_in(bytes, 2)?, number_in(bytes, 3)?)?;
                inputs.push(Input { tick: number_in(bytes, 1)?, source, bytes: blob_in(bytes, 4)?.to_vec() });
            }
            Some(())
        })?;
        self.queue = inputs.into_iter();
        Ok(true)
    }
}

impl Iterator for Inputs<'_> {
    type Item = Result<Input, RecordError>;

    fn next(&mut self) -> Option<Result<Input, RecordError>> {
        loop {
            if let Some(input) = self.queue.next() {
                return Some(Ok(input));
            }
            match self.fill() {
                Ok(true) => {}
                Ok(false) => return None,
                Err(error) => {
                    self.next = usize::MAX;
                    return Some(Err(error));
                }
            }
        }
    }
}
