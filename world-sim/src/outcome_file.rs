//! The file in which the world leaves what a run came to.
//!
//! The daemon makes it before anything is started, with its room reserved, and keeps it open; the world opens it when it
//! starts, and writes it when it ends. So neither a full tmpfs, nor a removed directory, nor a lack of descriptors at the
//! end costs the result. The header is written last: a file without one holds a part, or nothing.

use bus::Address;
use protocol::codec;
use protocol::world_to_daemon::WorldEnd;
use rustix::fs::{FallocateFlags, Mode, OFlags, fallocate, fstat, open};
use rustix::io::{Errno, pread, pwrite};
use std::io;
use std::os::fd::OwnedFd;

const NAME: &str = "outcome";
const MAGIC: [u8; 8] = *b"shoalOc1";
/// Magic and length of what follows.
const HEADER: u64 = 16;
/// Room for a usual outcome, bytes: some thousand events, or a thousand robots.
const ROOM: u64 = 256 * 1024;

/// The file, open.
#[derive(Debug)]
pub struct OutcomeFile(OwnedFd);

impl OutcomeFile {
    /// Makes it, for the daemon.
    ///
    /// # Errors
    /// When there is no room for it.
    pub fn create(address: &Address) -> io::Result<OutcomeFile> {
        let flags = OFlags::RDWR | OFlags::CREATE | OFlags::EXCL | OFlags::CLOEXEC | OFlags::NOFOLLOW;
        let file = open(address.file(NAME), flags, Mode::RUSR | Mode::WUSR)?;
        rustix::io::retry_on_intr(|| fallocate(&file, FallocateFlags::empty(), 0, ROOM))?;
        Ok(OutcomeFile(file))
    }

    /// Opens it, for the world.
    ///
    /// # Errors
    /// When it is not there.
    pub fn open(address: &Address) -> io::Result<OutcomeFile> {
        let flags = OFlags::RDWR | OFlags::CLOEXEC | OFlags::NOFOLLOW;
        Ok(OutcomeFile(open(address.file(NAME), flags, Mode::empty())?))
    }

    /// Writes how the world ended. If that does not fit, because memory has run out meanwhile, the log becomes shorter:
    /// its newer half is counted as lost, until the rest fits.
    ///
    /// # Errors
    /// When it cannot be written at all.
    pub fn write(&self, mut end: WorldEnd) -> io::Result<()> {
        loop {
            let bytes = codec::encode(&end).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))?;
            match self.put(&bytes) {
                Err(Errno::NOSPC | Errno::FBIG | Errno::DQUOT) if !end.outcome.events.is_empty() => {
                    let kept = end.outcome.events.len() / 2;
                    end.outcome.events_lost += (end.outcome.events.len() - kept) as u64;
                    end.outcome.events.truncate(kept);
                }
                written => return Ok(written?),
            }
        }
    }

    fn put(&self, bytes: &[u8]) -> Result<(), Errno> {
        let mut header = [0; HEADER as usize];
        header[..8].copy_from_slice(&MAGIC);
        header[8..].copy_from_slice(&(bytes.len() as u64).to_le_bytes());
        self.put_at(bytes, HEADER)?;
        self.put_at(&header, 0)
    }

    fn put_at(&self, mut bytes: &[u8], mut at: u64) -> Result<(), Errno> {
        while !bytes.is_empty() {
            match rustix::io::retry_on_intr(|| pwrite(&self.0, bytes, at))? {
                0 => return Err(Errno::NOSPC),
                written => (bytes, at) = (&bytes[written..], at + written as u64),
            }
        }
        Ok(())
    }

    /// How the world ended; `None` if it did not come to write that.
    pub fn read(&self) -> Option<WorldEnd> {
        let mut header = [0; HEADER as usize];
        self.get_at(&mut header, 0)?;
        let length = u64::from_le_bytes(header[8..].try_into().ok()?);
        let room = u64::try_from(fstat(&self.0).ok()?.st_size).ok()?.checked_sub(HEADER)?;
        if header[..8] != MAGIC || length > room {
            return None;
        }
        let mut bytes = vec![0; usize::try_from(length).ok()?];
        self.get_at(&mut bytes, HEADER)?;
        codec::decode(&bytes).ok()
    }

    fn get_at(&self, mut bytes: &mut [u8], mut at: u64) -> Option<()> {
        while !bytes.is_empty() {
            let read = rustix::io::retry_on_intr(|| pread(&self.0, &mut *bytes, at)).ok().filter(|read| *read > 0)?;
            (bytes, at) = (&mut bytes[read..], at + read as u64);
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::{Event, EventKind, Outcome};

    fn end(events: usize) -> WorldEnd {
        let event =
            |tick: usize| Event { tick: tick as u64, robot: None, kind: EventKind::Deaf { why: "x".repeat(40) } };
        let outcome = Outcome { ticks: 7, events: (0..events).map(event).collect(), ..Outcome::default() };
        WorldEnd { outcome, record_failed: None, finished: true }
    }

    #[test]
    fn what_was_written_is_read_by_the_one_who_made_the_file_though_its_directory_is_gone() {
        let address = Address::create().unwrap();
        let daemon = OutcomeFile::create(&address).unwrap();
        let world = OutcomeFile::open(&address).unwrap();
        bus::clean::sweep(&address);
        assert_eq!(daemon.read(), None, "nothing was written");
        world.write(end(20_000)).unwrap();
        assert_eq!(daemon.read(), Some(end(20_000)));
    }

    #[test]
    fn a_part_is_no_outcome() {
        let address = Address::create().unwrap();
        let file = OutcomeFile::create(&address).unwrap();
        bus::clean::sweep(&address);
        let bytes = codec::encode(&end(3)).unwrap();
        file.put_at(&bytes, HEADER).unwrap();
        assert_eq!(file.read(), None, "the header comes last");
        file.put(&bytes).unwrap();
        assert_eq!(file.read(), Some(end(3)));
        for length in [bytes.len() as u64 - 1, ROOM, u64::MAX] {
            file.put_at(&length.to_le_bytes(), 8).unwrap();
            assert_eq!(file.read(), None, "{length}");
        }
    }
}
