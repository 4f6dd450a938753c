//! The record of a run: where everything was at every tick, lossless, in one file. For pictures and replays.
//!
//! ```text
//! "SHOALREC"  version (u32)  length (u64)  header (bincode: Header)
//! frames, one per tick:   1  ticks since the frame before (varint)  bodies (varint)  then per body:
//!     name (varint: 2 slot for a robot, 2 index + 1 for a moving obstacle)  mask (u8)
//!     flags (u8), if bit 0 of the mask is set
//!     x, y, yaw, goal x, goal y, joint 1, joint 2 for bits 1 to 7, each as a varint: bits of the value xor bits of its
//!     prediction, which is 2 a - b for the last two values a, b of the body (a for goals; 0 before there are any)
//! 0           length (u64)  ending (bincode: Ending)
//! checksum of everything before (u64, FNV-1a)  "SHOALEND"
//! ```
//! Fixed-width numbers are little-endian, varints have seven bits a byte, the lowest first. What stands still costs two
//! bytes a tick, what drives a curve about fifteen. A file without its end is refused, so is one of another version: the
//! header is bincode, which knows only the types of the binary that wrote it.

use crate::codec::{self, CodecError};
use crate::world_to_observer::FrameBody;
use model::{MAX_ROBOTS, MAX_SHAPES, Outcome, Robot, RobotIndex, Scenario};
use serde::{Deserialize, Serialize};
use std::io::{self, Read, Seek, SeekFrom};

/// How every record begins.
pub const MAGIC: &[u8; 8] = b"SHOALREC";
/// How every whole record ends.
pub const MAGIC_END: &[u8; 8] = b"SHOALEND";
/// The version of the format. It goes up with every change of what is written, the types of scenarios included.
pub const VERSION: u32 = 8;

const FRAME: u8 = 1;
const END: u8 = 0;
/// Length of magic, version and the header's length.
const PREAMBLE: usize = 8 + 4 + 8;
/// Length of checksum and magic at the end.
const TAIL: usize = 8 + 8;
/// Numbers of a body: see the format.
const FIELDS: usize = 7;
/// No larger record is read, bytes: one is read into memory as a whole.
pub const LENGTH_MAX: u64 = 2 << 30;

/// What a record begins with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// The version of shoal that wrote it.
    pub shoal: String,
    /// What was run.
    pub scenario: Scenario,
}

/// What a record ends with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ending {
    /// Robots that were added while the fleet ran.
    pub added: Vec<(RobotIndex, Robot)>,
    /// What the run came to.
    pub outcome: Outcome,
}

/// A body at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Body {
    /// Slot of the robot, or index of the obstacle in the scenario.
    pub index: u32,
    /// The `FLAG_*` constants of [`FrameBody`].
    pub flags: u32,
    /// Position, m (of an arm: its tip; of an obstacle: the point that its motion carries).
    pub position_m: [f64; 2],
    /// Heading, rad.
    pub yaw_rad: f64,
    /// Where a robot's goal is, m; zero for an obstacle.
    pub goal_m: [f64; 2],
    /// Joint angles of an arm, rad; zero for everything else.
    pub joints_rad: [f64; 2],
}

impl Body {
    /// It is an obstacle, not a robot.
    pub fn is_obstacle(&self) -> bool {
        self.flags & FrameBody::FLAG_OBSTACLE != 0
    }

    fn name(&self) -> u64 {
        2 * u64::from(self.index) + u64::from(self.is_obstacle())
    }

    fn fields(&self) -> [f64; FIELDS] {
        let Body { position_m: [x, y], yaw_rad, goal_m: [goal_x, goal_y], joints_rad: [first, second], .. } = *self;
        [x, y, yaw_rad, goal_x, goal_y, first, second]
    }

    fn with_fields(self, [x, y, yaw_rad, goal_x, goal_y, first, second]: [f64; FIELDS]) -> Body {
        Body { position_m: [x, y], yaw_rad, goal_m: [goal_x, goal_y], joints_rad: [first, second], ..self }
    }
}

/// The last two states of a body, which its next one is foretold from.
#[derive(Clone, Copy, Debug, Default)]
struct Track {
    flags: u32,
    last: [f64; FIELDS],
    before: [f64; FIELDS],
    known: u8,
}

impl Track {
    fn predicted(&self) -> [f64; FIELDS] {
        let Track { last, before, known, .. } = self;
        std::array::from_fn(|i| match (known, i) {
            (0 | 1, _) | (_, 3 | 4) => last[i],
            _ => 2.0 * last[i] - before[i],
        })
    }

    fn follow(&mut self, flags: u32, fields: [f64; FIELDS]) {
        *self = Track { flags, before: self.last, last: fields, known: (self.known + 1).min(2) };
    }
}

/// The tracks of all bodies, by name: even ones are robots, odd ones obstacles.
#[derive(Debug, Default)]
struct Tracks(Vec<Track>);

impl Tracks {
    fn of(&mut self, name: u64) -> &mut Track {
        let name = name as usize;
        if self.0.len() <= name {
            self.0.resize(name + 1, Track::default());
        }
        &mut self.0[name]
    }
}

/// Writes a record piece by piece: every call appends bytes, which go to the file in this order.
#[derive(Debug)]
pub struct Encoder {
    tracks: Tracks,
    tick: u64,
    hash: u64,
}

impl Encoder {
    /// Begins a record.
    ///
    /// # Errors
    /// When the scenario cannot be encoded.
    pub fn begin(scenario: &Scenario, out: &mut Vec<u8>) -> Result<Encoder, CodecError> {
        let header = Header { shoal: env!("CARGO_PKG_VERSION").to_owned(), scenario: scenario.clone() };
        let (start, header) = (out.len(), codec::encode(&header)?);
        out.extend_from_slice(MAGIC);
        out.extend_from_slice(&VERSION.to_le_bytes());
        out.extend_from_slice(&(header.len() as u64).to_le_bytes());
        out.extend_from_slice(&header);
        Ok(Encoder { tracks: Tracks::default(), tick: 0, hash: fnv(FNV_BASIS, &out[start..]) })
    }

    /// Adds the frame of a tick. Ticks go up.
    pub fn frame(&mut self, tick: u64, bodies: &[Body], out: &mut Vec<u8>) {
        let start = out.len();
        out.push(FRAME);
        put(tick - self.tick, out);
        put(bodies.len() as u64, out);
        self.tick = tick;
        for body in bodies {
            let track = self.tracks.of(body.name());
            let (fields, predicted) = (body.fields(), track.predicted());
            let unforeseen: [u64; FIELDS] = std::array::from_fn(|i| fields[i].to_bits() ^ predicted[i].to_bits());
            let told = (body.flags != track.flags) as u8;
            let mask = (0..FIELDS).fold(told, |mask, i| mask | (u8::from(unforeseen[i] != 0) << (i + 1)));
            put(body.name(), out);
            out.push(mask);
            if told != 0 {
                out.push(body.flags as u8);
            }
            unforeseen.iter().filter(|bits| **bits != 0).for_each(|bits| put(*bits, out));
            track.follow(body.flags, fields);
        }
        self.hash = fnv(self.hash, &out[start..]);
    }

    /// Ends the record.
    ///
    /// # Errors
    /// When the ending cannot be encoded.
    pub fn end(self, ending: &Ending, out: &mut Vec<u8>) -> Result<(), CodecError> {
        let (start, ending) = (out.len(), codec::encode(ending)?);
        out.push(END);
        out.extend_from_slice(&(ending.len() as u64).to_le_bytes());
        out.extend_from_slice(&ending);
        let hash = fnv(self.hash, &out[start..]);
        out.extend_from_slice(&hash.to_le_bytes());
        out.extend_from_slice(MAGIC_END);
        Ok(())
    }
}

/// Why bytes are not a record.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// They are something else.
    #[error("it is not a record")]
    Foreign,
    /// They are a record of another version.
    #[error("it is a record of format version {0}, and this shoal reads version {VERSION}")]
    Version(u32),
    /// It is larger than [`LENGTH_MAX`].
    #[error("it is larger than {} GiB", LENGTH_MAX >> 30)]
    TooLarge,
    /// The end is missing.
    #[error("it is cut off: a record has an end, and this one ends in the middle")]
    Truncated,
    /// Something in it was changed.
    #[error("it is damaged: its checksum does not fit")]
    Damaged,
    /// The checksum fits, but the content does not.
    #[error("it holds what no run writes")]
    Impossible,
    /// It cannot be read at all.
    #[error("cannot read: {0}")]
    Io(#[from] io::Error),
    /// Its parts are not what this binary writes.
    #[error("it is a record that another build of shoal wrote: {0}")]
    Codec(#[from] CodecError),
}

/// A whole record, in memory.
#[derive(Debug)]
pub struct Record {
    /// What it begins with.
    pub header: Header,
    /// What it ends with.
    pub ending: Ending,
    frames: Vec<u8>,
}

impl Record {
    /// Whether bytes begin as a record does.
    pub fn is_begun_by(bytes: &[u8]) -> bool {
        bytes.starts_with(MAGIC)
    }

    /// Reads a record from a file. Anything else is refused after a look at its beginning and its end, before it is read
    /// into memory.
    ///
    /// # Errors
    /// See [`RecordError`].
    pub fn read_from(mut file: impl Read + Seek) -> Result<Record, RecordError> {
        let mut bytes = Vec::new();
        file.by_ref().take(PREAMBLE as u64).read_to_end(&mut bytes)?;
        Record::check_beginning(&bytes)?;
        let length = file.seek(SeekFrom::End(0))?;
        if length > LENGTH_MAX {
            return Err(RecordError::TooLarge);
        }
        let mut end = [0; MAGIC_END.len()];
        file.seek(SeekFrom::Start(length.saturating_sub(end.len() as u64)))?;
        file.read_exact(&mut end)?;
        if end != *MAGIC_END {
            return Err(RecordError::Truncated);
        }
        bytes.clear();
        bytes.try_reserve_exact(length as usize + 1).map_err(|_| RecordError::Io(io::ErrorKind::OutOfMemory.into()))?;
        file.seek(SeekFrom::Start(0))?;
        file.take(length).read_to_end(&mut bytes)?;
        Record::read(bytes)
    }

    /// Refuses what does not begin as a record of this version does.
    fn check_beginning(bytes: &[u8]) -> Result<(), RecordError> {
        if !Record::is_begun_by(bytes) {
            let begun = MAGIC.starts_with(bytes) && !bytes.is_empty();
            return Err(if begun { RecordError::Truncated } else { RecordError::Foreign });
        }
        let version = bytes.get(8..12).ok_or(RecordError::Truncated)?;
        let version = u32::from_le_bytes(version.try_into().map_err(|_| RecordError::Truncated)?);
        if version == VERSION { Ok(()) } else { Err(RecordError::Version(version)) }
    }

    /// Reads a record from memory. Its frames are checked here, and decoded when they are asked for.
    ///
    /// # Errors
    /// See [`RecordError`].
    pub fn read(mut bytes: Vec<u8>) -> Result<Record, RecordError> {
        Record::check_beginning(&bytes)?;
        let number = |at: usize| Some(u64::from_le_bytes(bytes.get(at..at + 8)?.try_into().ok()?));
        if bytes.len() < PREAMBLE + TAIL || !bytes.ends_with(MAGIC_END) {
            return Err(RecordError::Truncated);
        }
        let body = bytes.len() - TAIL;
        if number(body) != Some(fnv(FNV_BASIS, &bytes[..body])) {
            return Err(RecordError::Damaged);
        }
        // From here on the bytes are as they were written, by whoever it was.
        let begin = number(12).and_then(|length| PREAMBLE.checked_add(usize::try_from(length).ok()?));
        let begin = begin.filter(|begin| *begin <= body).ok_or(RecordError::Impossible)?;
        let header: Header = codec::decode(&bytes[PREAMBLE..begin])?;
        let mut frames = Frames::new(&bytes[begin..body]);
        while frames.advance().ok_or(RecordError::Impossible)? {}
        let end = begin + frames.at;
        let ending: Ending = codec::decode(bytes.get(end + 8..body).ok_or(RecordError::Impossible)?)?;
        if header.scenario.robots.len() + ending.added.len() > MAX_ROBOTS {
            return Err(RecordError::Impossible);
        }
        bytes.truncate(end);
        bytes.drain(..begin);
        Ok(Record { header, ending, frames: bytes })
    }

    /// The frames, from the first on.
    pub fn frames(&self) -> Frames<'_> {
        Frames::new(&self.frames)
    }

    /// A robot, if there was one of this index.
    pub fn robot(&self, index: RobotIndex) -> Option<&Robot> {
        let added = self.ending.added.iter().find(|(at, _)| *at == index).map(|(_, robot)| robot);
        added.or_else(|| self.header.scenario.robots.get(index.at()))
    }
}

/// Goes through the frames of a record.
#[derive(Debug)]
pub struct Frames<'a> {
    bytes: &'a [u8],
    at: usize,
    tracks: Tracks,
    tick: u64,
    bodies: Vec<Body>,
}

impl<'a> Frames<'a> {
    fn new(bytes: &'a [u8]) -> Frames<'a> {
        Frames { bytes, at: 0, tracks: Tracks::default(), tick: 0, bodies: Vec::new() }
    }

    /// The next frame: its tick and its bodies, robots by slot and then moving obstacles.
    #[expect(clippy::should_implement_trait, reason = "the bodies are lent, which an iterator cannot do")]
    pub fn next(&mut self) -> Option<(u64, &[Body])> {
        let more = self.advance().unwrap_or(false);
        more.then_some((self.tick, self.bodies.as_slice()))
    }

    /// Decodes a frame; `Some(false)` at the end, `None` for what is no frame.
    fn advance(&mut self) -> Option<bool> {
        match self.byte()? {
            FRAME => {}
            END => return Some(false),
            _ => return None,
        }
        self.tick = self.tick.checked_add(self.varint()?)?;
        self.bodies.clear();
        for _ in 0..self.varint().filter(|count| *count <= (MAX_ROBOTS + MAX_SHAPES) as u64)? {
            let name = self.varint().filter(|name| *name < 2 * MAX_ROBOTS.max(MAX_SHAPES) as u64)?;
            let mask = self.byte()?;
            let track = *self.tracks.of(name);
            let flags = if mask & 1 != 0 { self.byte()?.into() } else { track.flags };
            let mut fields = track.predicted();
            for (i, field) in fields.iter_mut().enumerate() {
                if mask >> (i + 1) & 1 != 0 {
                    *field = f64::from_bits(field.to_bits() ^ self.varint()?);
                }
            }
            if !fields.iter().all(|field| field.is_finite()) {
                return None;
            }
            self.tracks.of(name).follow(flags, fields);
            self.bodies.push(Body { index: (name / 2) as u32, flags, ..Body::default() }.with_fields(fields));
        }
        Some(true)
    }

    fn byte(&mut self) -> Option<u8> {
        let byte = *self.bytes.get(self.at)?;
        self.at += 1;
        Some(byte)
    }

    fn varint(&mut self) -> Option<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(value);
            }
        }
        None
    }
}

fn put(mut value: u64, out: &mut Vec<u8>) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

const FNV_BASIS: u64 = 0xcbf2_9ce4_8422_2325;

fn fnv(hash: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(hash, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scenario() -> Scenario {
        let entry = scenarios::find_catalog("head-on").unwrap();
        scenarios::parse(entry.name, entry.text, &scenarios::Overrides::default()).unwrap()
    }

    /// Robots that come, drive, stand, and stop being there; numbers of all sizes.
    fn frame(tick: u64) -> Vec<Body> {
        let t = tick as f64 * 0.02;
        let curve =
            Body { index: 0, position_m: [t.sin(), t.cos()], yaw_rad: t, goal_m: [4.0, -1.0], ..Body::default() };
        let stands = Body { index: 3, flags: 2, position_m: [-7.1, 1e-300], ..Body::default() };
        let odd = Body { index: 700, joints_rad: [f64::MAX, -t], yaw_rad: -0.0, ..Body::default() };
        let moves = Body { index: 3, flags: 1, position_m: [0.1 * t, 0.0], ..Body::default() };
        let mut bodies = vec![curve];
        bodies.extend((10..40).contains(&tick).then_some(stands));
        bodies.extend((!tick.is_multiple_of(7)).then_some(odd));
        bodies.push(moves);
        bodies
    }

    fn ending() -> Ending {
        Ending {
            added: vec![(RobotIndex(9), scenario().template)],
            outcome: Outcome { ticks: 50, ..Outcome::default() },
        }
    }

    fn record() -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::begin(&scenario(), &mut bytes).unwrap();
        (0..=50).for_each(|tick| encoder.frame(tick, &frame(tick), &mut bytes));
        encoder.end(&ending(), &mut bytes).unwrap();
        bytes
    }

    #[test]
    fn what_is_written_is_read_to_the_last_bit() {
        let record = Record::read(record()).unwrap();
        assert_eq!((&record.header.scenario, &record.ending), (&scenario(), &ending()));
        assert_eq!(record.robot(RobotIndex(9)), Some(&scenario().template));
        assert_eq!(record.robot(RobotIndex(0)), scenario().robots.first());
        assert_eq!(record.robot(RobotIndex(8)), None);
        let mut frames = record.frames();
        for tick in 0..=50 {
            assert_eq!(frames.next().map(|(tick, bodies)| (tick, bodies.to_vec())), Some((tick, frame(tick))));
        }
        assert_eq!(frames.next(), None);
    }

    #[test]
    fn what_stands_costs_two_bytes_a_tick() {
        let (mut bytes, stands) = (Vec::new(), Body { position_m: [1.2345, -0.1], ..Body::default() });
        let mut encoder = Encoder::begin(&scenario(), &mut bytes).unwrap();
        (0..2).for_each(|tick| encoder.frame(tick, &[stands], &mut bytes));
        let before = bytes.len();
        (2..102).for_each(|tick| encoder.frame(tick, &[stands], &mut bytes));
        assert_eq!(bytes.len() - before, 100 * (3 + 2));
    }

    /// A file of any length that holds these bytes at its ends and nothing between, and counts what is read of it.
    struct Sparse {
        begin: Vec<u8>,
        end: Vec<u8>,
        length: u64,
        at: u64,
        read: u64,
    }

    impl Read for Sparse {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            let count = (self.length - self.at).min(into.len() as u64) as usize;
            for byte in &mut into[..count] {
                let from_end = self.at + self.end.len() as u64;
                let held = if from_end >= self.length { self.end.get((from_end - self.length) as usize) } else { None };
                *byte = held.or(self.begin.get(self.at as usize)).copied().unwrap_or(0);
                self.at += 1;
            }
            self.read += count as u64;
            Ok(count)
        }
    }

    impl Seek for Sparse {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.at = match to {
                SeekFrom::Start(at) => at,
                SeekFrom::End(by) => self.length.saturating_add_signed(by),
                SeekFrom::Current(by) => self.at.saturating_add_signed(by),
            };
            Ok(self.at)
        }
    }

    #[test]
    fn a_large_file_that_is_not_a_record_is_refused_by_its_ends() {
        let whole = record();
        let check = |begin: &[u8], end: &[u8], length: u64, expected: &str| {
            let mut file = Sparse { begin: begin.to_vec(), end: end.to_vec(), length, at: 0, read: 0 };
            let error = Record::read_from(&mut file).unwrap_err().to_string();
            assert!(error.contains(expected) && file.read <= 64, "{expected}: {error}, {} bytes read", file.read);
        };
        check(&[], &[], 20 << 30, "not a record");
        check(&whole[..2048], &[], 1 << 30, "cut off");
        check(&whole[..2048], MAGIC_END, 20 << 30, "larger than 2 GiB");
    }

    #[test]
    fn what_is_not_a_whole_record_is_refused() {
        let whole = record();
        let check = |bytes: &[u8], expected: &str| {
            let from_file = Record::read_from(io::Cursor::new(bytes)).unwrap_err().to_string();
            let error = Record::read(bytes.to_vec()).unwrap_err().to_string();
            assert!(error.contains(expected) && from_file == error, "{expected}: {error}, {from_file}");
        };
        check(b"", "not a record");
        check(b"{ \"schema\": \"shoal.report/1\" }", "not a record");
        for length in [1, 8, 11, 30, whole.len() / 2, whole.len() - 1] {
            check(&whole[..length], "cut off");
        }
        let changed = |at: usize| {
            let mut bytes = whole.clone();
            bytes[at] ^= 4;
            bytes
        };
        check(&[MAGIC.as_slice(), &[0; 64]].concat(), "version 0");
        check(&changed(8), &format!("version {}", VERSION ^ 4));
        for at in [12, 40, whole.len() / 2, whole.len() - 9] {
            check(&changed(at), "damaged");
        }
    }
}
