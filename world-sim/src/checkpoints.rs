//! The files in which a world of a fleet that is left running leaves its state, for another process to go on from.
//!
//! Two files take turns, so that one of them is whole at any time: a process that is killed leaves a part of the other. Each
//! begins with a header that says what follows, and with its check sum. The log grows, and so has a file of its own, to which
//! new entries are appended before a checkpoint counts them.
//!
//! What the daemon is to be told is kept first. For the rest, writing takes at most a share of the time: a large fleet leaves
//! its state less often than every tick.

use crate::{Checkpoint, World};
use bus::Address;
use model::Event;
use protocol::codec;
use rustix::fs::{FallocateFlags, Mode, OFlags, fallocate, open};
use rustix::io::{Errno, pwrite};
use std::io;
use std::os::fd::OwnedFd;

const FILES: [&str; 2] = ["checkpoint.0", "checkpoint.1"];
const EVENTS: &str = "events";
const MAGIC: [u8; 8] = *b"shoalCk3";
/// Magic, length and check sum of what follows: the number of the checkpoint, and the state.
const HEADER: usize = 24;
/// Room for the state of a robot, bytes: a usual one takes half of it.
const ROBOT_BYTES: u64 = 2048;
/// Writing takes at most this part of the time.
const SHARE: u64 = 50;

/// Whether a checkpoint has to be written now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Haste {
    /// The daemon is about to be told what is in it.
    Now,
    /// A later one is as good.
    MayWait,
}

/// The files, open for writing.
pub(crate) struct Checkpoints {
    files: [OwnedFd; 2],
    events: OwnedFd,
    /// The number of entries of the log that are in its file, and its length, bytes.
    kept: (usize, u64),
    /// The number of the next checkpoint: even ones are in the first file, odd ones in the second.
    number: u64,
    buffer: Vec<u8>,
    /// No checkpoint is written before this time, monotonic clock, ns.
    not_before_ns: u64,
}

impl Checkpoints {
    /// Makes the files, or goes on with those of the world before, whose log holds `events`.
    ///
    /// # Errors
    /// When there is no room for them.
    pub(crate) fn open(address: &Address, max_robots: usize, events: &[Event]) -> io::Result<Checkpoints> {
        let flags = OFlags::RDWR | OFlags::CREATE | OFlags::CLOEXEC | OFlags::NOFOLLOW;
        let file = |name: &str| open(address.file(name), flags, Mode::RUSR | Mode::WUSR);
        let files = [file(FILES[0])?, file(FILES[1])?];
        for file in &files {
            let room = HEADER as u64 + ROBOT_BYTES * max_robots as u64;
            rustix::io::retry_on_intr(|| fallocate(file, FallocateFlags::empty(), 0, room))?;
        }
        let number = read_newest(address).map_or(0, |newest| newest.number + 1);
        let (events_file, buffer) = (file(EVENTS)?, Vec::new());
        let mut checkpoints =
            Checkpoints { files, events: events_file, kept: (0, 0), number, buffer, not_before_ns: 0 };
        // The same bytes once more, and then an end: the checkpoint that counts them is whole all the time.
        checkpoints.append(events)?;
        rustix::fs::ftruncate(&checkpoints.events, checkpoints.kept.1)?;
        Ok(checkpoints)
    }

    /// Leaves the state of a world: with [`Haste::MayWait`] unless it did so a moment ago. `clock_ns` looks at the clock.
    ///
    /// # Errors
    /// When there is no room: then the newest that could be written stays.
    pub(crate) fn leave(&mut self, world: &World, haste: Haste, clock_ns: &mut dyn FnMut() -> u64) -> io::Result<()> {
        let begun_ns = clock_ns();
        if haste == Haste::MayWait && begun_ns < self.not_before_ns {
            return Ok(());
        }
        let written = self.write(world);
        let done_ns = clock_ns();
        self.not_before_ns = done_ns + (done_ns - begun_ns) * SHARE;
        written
    }

    fn write(&mut self, world: &World) -> io::Result<()> {
        self.append(world.events())?;
        let state =
            codec::encode(&world.checkpoint()).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))?;
        self.buffer.clear();
        self.buffer.extend_from_slice(&MAGIC);
        self.buffer.extend_from_slice(&(state.len() as u64).to_le_bytes());
        self.buffer.extend_from_slice(&sum(self.number, &state).to_le_bytes());
        self.buffer.extend_from_slice(&self.number.to_le_bytes());
        self.buffer.extend_from_slice(&state);
        put(&self.files[(self.number % 2) as usize], &self.buffer, 0)?;
        self.number += 1;
        Ok(())
    }

    /// Appends the entries of the log that are not in its file yet.
    fn append(&mut self, events: &[Event]) -> io::Result<()> {
        let (count, length) = self.kept;
        let mut bytes = Vec::new();
        for event in events.iter().skip(count) {
            let entry = codec::encode(event).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))?;
            bytes.extend_from_slice(&(entry.len() as u32).to_le_bytes());
            bytes.extend_from_slice(&entry);
        }
        if !bytes.is_empty() {
            put(&self.events, &bytes, length)?;
            self.kept = (events.len(), length + bytes.len() as u64);
        }
        Ok(())
    }
}

fn put(file: &OwnedFd, mut bytes: &[u8], mut at: u64) -> Result<(), Errno> {
    while !bytes.is_empty() {
        match rustix::io::retry_on_intr(|| pwrite(file, bytes, at))? {
            0 => return Err(Errno::NOSPC),
            written => (bytes, at) = (&bytes[written..], at + written as u64),
        }
    }
    Ok(())
}

/// The newest whole checkpoint of a fleet, and its log.
pub(crate) fn newest(address: &Address) -> Option<(Checkpoint<'static>, Vec<Event>)> {
    let newest = codec::decode(&read_newest(address)?.state).ok()?;
    Some((newest, events(address)))
}

/// A whole checkpoint, as bytes.
struct Read {
    number: u64,
    state: Vec<u8>,
}

fn read_newest(address: &Address) -> Option<Read> {
    FILES.iter().filter_map(|name| read(address, name)).max_by_key(|read| read.number)
}

fn read(address: &Address, name: &str) -> Option<Read> {
    #[expect(
        clippy::disallowed_methods,
        reason = "the shell reads the state of an earlier world once, before the loop"
    )]
    let bytes = std::fs::read(address.file(name)).ok()?;
    let word = |at: usize| Some(u64::from_le_bytes(bytes.get(at..at + 8)?.try_into().ok()?));
    let length = usize::try_from(word(8)?).ok()?;
    let (number, begin) = (word(HEADER)?, HEADER + 8);
    let state = bytes.get(begin..begin.checked_add(length)?)?;
    let is_whole = bytes[..8] == MAGIC && word(16)? == sum(number, state);
    is_whole.then(|| Read { number, state: state.to_vec() })
}

/// The log, as far as it is whole.
fn events(address: &Address) -> Vec<Event> {
    #[expect(clippy::disallowed_methods, reason = "the shell reads the log of an earlier world once, before the loop")]
    let bytes = std::fs::read(address.file(EVENTS)).unwrap_or_default();
    let (mut events, mut rest) = (Vec::new(), bytes.as_slice());
    while let Some((length, more)) = rest.split_first_chunk() {
        let Some((entry, more)) = more.split_at_checked(u32::from_le_bytes(*length) as usize) else { break };
        let Ok(event) = codec::decode(entry) else { break };
        events.push(event);
        rest = more;
    }
    events
}

/// FNV-1a over words of eight bytes: the number of a checkpoint, and its state.
fn sum(number: u64, state: &[u8]) -> u64 {
    let number = number.to_le_bytes();
    number.chunks(8).chain(state.chunks(8)).fold(0xcbf2_9ce4_8422_2325, |sum, chunk| {
        let mut word = [0; 8];
        word[..chunk.len()].copy_from_slice(chunk);
        (sum ^ u64::from_le_bytes(word)).wrapping_mul(0x0100_0000_01b3)
    })
}

#[cfg(test)]
#[expect(clippy::disallowed_methods, reason = "tests damage files")]
mod tests {
    use super::*;
    use model::{EventKind, RobotIndex, RobotInstance, Scenario};
    use protocol::daemon_to_world::{Absence, Order};

    fn scenario() -> Scenario {
        let entry = scenarios::find_catalog("demo-15").unwrap();
        scenarios::parse(entry.name, entry.text, &scenarios::Overrides::default()).unwrap()
    }

    fn tick(world: &mut World) {
        world.open(&mut |_| true);
        world.close(&mut |_| None);
    }

    #[test]
    fn the_newest_whole_checkpoint_counts() {
        let address = Address::create().unwrap();
        let scenario = scenario();
        let mut world = World::new(&scenario);
        assert!(newest(&address).is_none(), "there is none");
        let mut files = Checkpoints::open(&address, scenario.fleet.max_robots, &[]).unwrap();
        assert!(newest(&address).is_none(), "nor in empty files");
        for _ in 0..3 {
            tick(&mut world);
            files.write(&world).unwrap();
        }
        let (newest_tick, log) = newest(&address).map(|(found, log)| (found.tick(), log)).unwrap();
        assert_eq!((newest_tick, log.as_slice()), (3, world.events()));
        assert!(!log.is_empty());
        // A process that was killed while it wrote: the other file counts, whatever is cut off.
        let whole = std::fs::read(address.file(FILES[0])).unwrap();
        for length in [0, 7, HEADER, HEADER + 100] {
            std::fs::write(address.file(FILES[0]), &whole[..length]).unwrap();
            assert_eq!(newest(&address).unwrap().0.tick(), 2, "{length}");
        }
        let mut damaged = whole;
        damaged[HEADER + 50] ^= 1;
        std::fs::write(address.file(FILES[0]), &damaged).unwrap();
        assert_eq!(newest(&address).unwrap().0.tick(), 2, "a bit is not what it was");
        // The next world does not write over what it came from.
        let (from, log) = newest(&address).unwrap();
        let cause = Absence::Died { signal: Some(9), code: None, words: String::new() };
        let mut world = World::resume(&scenario, from, log).unwrap();
        let mut files = Checkpoints::open(&address, scenario.fleet.max_robots, world.events()).unwrap();
        files.buffer.clear();
        assert_eq!(files.number % 2, 0, "the damaged one is next");
        // Of two checkpoints of one tick the later one counts: the tick was opened in between.
        files.write(&world).unwrap();
        assert_eq!(newest(&address).unwrap().0.tick(), 2);
        world.order(Order::Absent { instance: RobotInstance { index: RobotIndex(0), incarnation: 0 }, cause });
        world.open(&mut |_| true);
        files.write(&world).unwrap();
        let (opened, log) = newest(&address).unwrap();
        assert_eq!((opened.tick(), opened.events()), (2, log.len()));
        assert!(log.iter().any(|event| matches!(event.kind, EventKind::Died { .. })), "{log:?}");
        world.close(&mut |_| None);
        files.write(&world).unwrap();
        assert_eq!(newest(&address).unwrap().0.tick(), 3);
        // The log grows with the world, and a part of an entry is no entry.
        world.went_on(1, 2);
        files.write(&world).unwrap();
        let log = std::fs::read(address.file(EVENTS)).unwrap();
        std::fs::write(address.file(EVENTS), [&log[..], &[9, 0, 0, 0, 1]].concat()).unwrap();
        let (_, events) = newest(&address).unwrap();
        assert_eq!(events.last().map(|event| &event.kind), Some(&EventKind::WorldRestarted { ticks: 1, away_ms: 2 }));
        bus::clean::sweep(&address);
    }

    #[test]
    fn writing_takes_a_bounded_share_of_the_time() {
        let address = Address::create().unwrap();
        let scenario = scenario();
        let mut world = World::new(&scenario);
        let mut files = Checkpoints::open(&address, scenario.fleet.max_robots, &[]).unwrap();
        bus::clean::sweep(&address);
        // A clock by which every write takes 3 and a tick 20.
        let mut writes_of = |haste: &dyn Fn(u32) -> Haste| {
            let (mut now, mut writes) = (0, 0);
            files.not_before_ns = 0;
            for number in 0..100 {
                tick(&mut world);
                let before = now;
                files
                    .leave(&world, haste(number), &mut || {
                        now += 3;
                        now - 3
                    })
                    .unwrap();
                if now - before > 3 {
                    writes += 1;
                }
                now = before + 20;
            }
            writes
        };
        let writes = writes_of(&|_| Haste::MayWait);
        assert!((10..=14).contains(&writes), "{writes} of 100 ticks");
        assert_eq!(writes_of(&|_| Haste::Now), 100, "what the daemon is told is kept, whatever it takes");
        let writes = writes_of(&|tick| if tick % 2 == 0 { Haste::Now } else { Haste::MayWait });
        assert_eq!(writes, 50, "and counts");
    }
}
