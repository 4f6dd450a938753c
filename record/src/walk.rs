//! The walk over the parts of a file: what a record says of itself, where its chunks are, and where it is cut off. It believes
//! no length before it has looked.

use crate::container::{self, Entry, HEAD, MAGIC, kind};
use crate::error::{Cut, RecordError};
use crate::header::{self, About, FORMAT};
use crate::source::Source;
use model::{MAX_ROBOTS, Scenario};
use protocol::codec;
use std::collections::HashMap;

/// How records of the format before MCAP begin.
pub(crate) const MAGIC_OLD: &[u8] = b"SHOALREC";
/// The largest parts that are read into memory, bytes.
const PART_MAX: u64 = 64 << 20;
/// Most parts of a kind that a record can have.
const CHUNKS_MAX: usize = 1 << 20;
const PARTS_MAX: usize = 64;
/// The heads of what is walked over are read in pieces of this size, bytes.
const WINDOW: usize = 16 * 1024;

/// What is in a chunk besides frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Topic {
    Frame,
    Event,
    Robot,
    Input,
    Gap,
    Map,
    Metrics,
    Other,
}

impl Topic {
    fn of(name: &str) -> Topic {
        match name {
            header::FRAME => Topic::Frame,
            header::EVENT => Topic::Event,
            header::ROBOT => Topic::Robot,
            header::INPUT => Topic::Input,
            header::GAP => Topic::Gap,
            header::MAP => Topic::Map,
            header::METRICS => Topic::Metrics,
            _ => Topic::Other,
        }
    }
}

/// A chunk and where it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chunk {
    pub(crate) at: u64,
    /// With its head.
    pub(crate) length: u64,
    pub(crate) first_ns: u64,
    /// It has events, robots or gaps, or that is not known.
    pub(crate) is_told: bool,
}

/// Reads a part of the file whose length was checked.
pub(crate) fn read_part(source: &Source, at: u64, length: u64, into: &mut Vec<u8>) -> Result<(), RecordError> {
    into.clear();
    let length = usize::try_from(length.min(PART_MAX)).map_err(|_| RecordError::Damaged(at))?;
    into.try_reserve_exact(length).map_err(|_| RecordError::Io(std::io::ErrorKind::OutOfMemory.into()))?;
    into.resize(length, 0);
    Ok(source.read(at, into)?)
}

/// The walk over the parts of a file.
pub(crate) struct Walk {
    pub(crate) source: Source,
    window: Vec<u8>,
    window_at: u64,
    pub(crate) about: Option<About>,
    pub(crate) scenario: Option<Scenario>,
    pub(crate) outcome: Option<model::Outcome>,
    pub(crate) cut: Option<Cut>,
    pub(crate) chunks: Vec<Chunk>,
    pub(crate) topics: HashMap<u16, Topic>,
    parts: usize,
}

impl Walk {
    pub(crate) fn begin(source: Source) -> Result<Walk, RecordError> {
        let mut magic = [0; MAGIC.len()];
        let there = magic.len().min(source.length() as usize);
        source.read(0, &mut magic[..there])?;
        if magic == *MAGIC_OLD {
            return Err(RecordError::Old);
        }
        if there == 0 || magic[..there] != MAGIC[..there] {
            return Err(RecordError::Foreign);
        }
        if there < magic.len() {
            return Err(RecordError::Beginning(Cut::Ends(there as u64)));
        }
        Ok(Walk {
            source,
            window: Vec::new(),
            window_at: 0,
            about: None,
            scenario: None,
            outcome: None,
            cut: None,
            chunks: Vec::new(),
            topics: HashMap::new(),
            parts: 0,
        })
    }

    /// Bytes at a place, as many as there are: some at the end of the file, none behind it.
    fn peek(&mut self, at: u64, length: usize) -> Result<&[u8], RecordError> {
        let end = self.source.length().min(at.saturating_add(length as u64));
        let there = end.saturating_sub(at) as usize;
        let inside = at >= self.window_at && at + there as u64 <= self.window_at + self.window.len() as u64;
        if !inside {
            let window = (self.source.length() - at.min(self.source.length())).min(WINDOW.max(length) as u64);
            read_part(&self.source, at, window, &mut self.window)?;
            self.window_at = at;
        }
        let from = (at - self.window_at) as usize;
        Ok(&self.window[from..from + there])
    }

    pub(crate) fn walk_on(&mut self) -> Result<(), RecordError> {
        let mut at = MAGIC.len() as u64;
        loop {
            let Ok(head) = <[u8; HEAD]>::try_from(self.peek(at, HEAD)?) else {
                self.cut = Some(Cut::Ends(at));
                return Ok(());
            };
            let (kind, length) = container::head(&head);
            let end = at.checked_add(HEAD as u64).and_then(|body| body.checked_add(length));
            if !is_known(kind) || at == MAGIC.len() as u64 && kind != kind::HEADER {
                self.cut = Some(Cut::Damaged(at));
                return Ok(());
            }
            let Some(end) = end.filter(|end| *end <= self.source.length()) else {
                self.cut = Some(Cut::Ends(at));
                return Ok(());
            };
            if kind == kind::DATA_END {
                // What follows is an index for other readers, and the magic again.
                let magic = MAGIC.len() as u64;
                let last = self.source.length() - magic;
                if last < end || self.peek(last, MAGIC.len())? != MAGIC {
                    self.cut = Some(Cut::Ends(end));
                } else if self.outcome.is_none() {
                    self.cut = Some(Cut::Damaged(at));
                }
                return Ok(());
            }
            if self.part(kind, at, length)?.is_none() {
                self.cut = Some(Cut::Damaged(at));
                return Ok(());
            }
            at = end;
        }
    }

    /// Takes what counts of a part; `None` if it is damaged.
    fn part(&mut self, kind: u8, at: u64, length: u64) -> Result<Option<()>, RecordError> {
        if kind == kind::CHUNK {
            return self.chunk(at, length);
        }
        if kind == kind::MESSAGE_INDEX {
            let channel = self.peek(at + HEAD as u64, 2)?;
            let topic = <[u8; 2]>::try_from(channel).ok().and_then(|id| self.topics.get(&u16::from_le_bytes(id)));
            let is_told = matches!(topic, Some(Topic::Event | Topic::Robot | Topic::Gap | Topic::Map));
            if let Some(chunk) = self.chunks.last_mut() {
                chunk.is_told |= is_told;
            }
            return Ok(Some(()));
        }
        self.parts += 1;
        if length > PART_MAX || self.parts > PARTS_MAX {
            return Ok(None);
        }
        let mut bytes = Vec::new();
        read_part(&self.source, at + HEAD as u64, length, &mut bytes)?;
        match kind {
            kind::HEADER => match container::library(&bytes) {
                Some(library) if library.starts_with(header::LIBRARY_PREFIX) => Ok(Some(())),
                Some(library) => Err(RecordError::Library(library.chars().take(60).collect())),
                None => Ok(None),
            },
            kind::METADATA => self.metadata(&bytes),
            kind::ATTACHMENT => self.attachment(&bytes),
            _ => Ok(Some(())),
        }
    }

    fn chunk(&mut self, at: u64, length: u64) -> Result<Option<()>, RecordError> {
        let times = container::chunk_times(self.peek(at + HEAD as u64, 16)?);
        let Some((first_ns, _)) = times.filter(|_| length <= PART_MAX && self.chunks.len() < CHUNKS_MAX) else {
            return Ok(None);
        };
        let chunk = Chunk { at, length: length + HEAD as u64, first_ns, is_told: false };
        if self.chunks.is_empty() {
            // The first chunk says which channel is what.
            let mut bytes = Vec::new();
            read_part(&self.source, at, chunk.length, &mut bytes)?;
            let topics = &mut self.topics;
            let declared = container::chunk(&bytes, |entry| {
                if let Entry::Channel(id, name) = entry {
                    topics.insert(id, Topic::of(name));
                }
                Some(())
            });
            if declared.is_none() {
                return Ok(None);
            }
        }
        self.chunks.push(chunk);
        Ok(Some(()))
    }

    fn metadata(&mut self, bytes: &[u8]) -> Result<Option<()>, RecordError> {
        let Some((name, map)) = container::metadata(bytes) else { return Ok(None) };
        if name == header::METADATA {
            let Some((about, format)) = About::from_map(map) else { return Ok(None) };
            if format != FORMAT {
                return Err(RecordError::Version(format));
            }
            self.about = Some(about);
        }
        Ok(Some(()))
    }

    fn attachment(&mut self, bytes: &[u8]) -> Result<Option<()>, RecordError> {
        let Some((name, content)) = container::attachment(bytes) else { return Ok(None) };
        match name.as_str() {
            header::SCENARIO => {
                let scenario: Scenario = codec::decode(content)?;
                if scenario.robots.len() > MAX_ROBOTS
                    || scenario.clock.tick_hz.is_nan()
                    || scenario.clock.tick_hz <= 0.0
                {
                    return Err(RecordError::Impossible);
                }
                self.scenario = Some(scenario);
            }
            header::OUTCOME => self.outcome = Some(codec::decode(content)?),
            _ => {}
        }
        Ok(Some(()))
    }
}

/// Opcodes of MCAP that stand before the end of the data.
fn is_known(kind: u8) -> bool {
    matches!(
        kind,
        kind::HEADER | kind::CHUNK | kind::MESSAGE_INDEX | kind::METADATA | kind::ATTACHMENT | kind::DATA_END
    )
}
