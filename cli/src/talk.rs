//! Standard error, which is never waited for. Its reader may be slow, stopped, or a pipe that was forgotten; a daemon
//! that waits for it restarts no robots and answers no operators. What cannot be written now is left out and counted.

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{FileType, Mode, OFlags, fstat, open};
use rustix::io::Errno;
use std::os::fd::{AsFd, OwnedFd};
use std::sync::{Mutex, PoisonError};

/// A pipe takes as much in one piece or not at all (`PIPE_BUF`), and takes it now if it can be written to.
const PIECE: usize = 4096;
/// How long the last words may wait for a reader who reads nothing.
const LAST_WAIT: Timespec = Timespec { tv_sec: 1, tv_nsec: 0 };
/// And how often, if it then takes nothing all the same.
const WAITS_MAX: u32 = 10;
const NOW: Timespec = Timespec { tv_sec: 0, tv_nsec: 0 };

/// How to write without waiting.
enum Way {
    /// A file never waits for a reader.
    File,
    /// The same pipe or terminal, opened once more: only this descriptor is non-blocking.
    Own(OwnedFd),
    /// A socket, or a terminal of another user, cannot be opened again: it is asked first.
    Ask,
}

struct Talk {
    way: Option<Way>,
    /// Lines that were left out and not mentioned yet.
    left_out: u64,
    /// The last line has no end.
    cut: bool,
}

static TALK: Mutex<Talk> = Mutex::new(Talk { way: None, left_out: 0, cut: false });

fn with<T>(talk: impl FnOnce(&mut Talk) -> T) -> T {
    talk(&mut TALK.lock().unwrap_or_else(PoisonError::into_inner))
}

/// Says whole lines, or leaves them out.
pub fn lines(text: &str) {
    with(|talk| {
        if !talk.say(text, NOW) {
            talk.left_out += text.lines().count() as u64;
        }
    });
}

/// Changes what stands on a terminal. If that cannot be done now, the next change does it.
pub fn paint(text: &str) {
    with(|talk| talk.put(text, NOW));
}

/// Says the last words: a reader who is only slow is waited for, one who reads nothing at all is not.
pub fn last(text: &str) {
    with(|talk| _ = talk.say(text, LAST_WAIT));
}

impl Talk {
    fn say(&mut self, text: &str, patience: Timespec) -> bool {
        let mut heard = true;
        if self.cut {
            heard = self.put("\n", patience);
            self.cut = !heard;
        }
        if heard && self.left_out > 0 {
            let lines = if self.left_out == 1 { "line was" } else { "lines were" };
            heard =
                self.put(&format!("({} {lines} left out here: the reader was too slow)\n", self.left_out), patience);
            self.left_out = if heard { 0 } else { self.left_out };
        }
        heard && self.put(text, patience)
    }

    /// Writes all of it, or as much as can be written without waiting for longer than `patience`; whether it was all.
    fn put(&mut self, text: &str, patience: Timespec) -> bool {
        let way = self.way.get_or_insert_with(Way::find);
        let (mut rest, mut waited) = (text.as_bytes(), 0);
        while !rest.is_empty() {
            match way.write(&rest[..rest.len().min(PIECE)]) {
                Ok(written) => (rest, waited) = (&rest[written..], 0),
                Err(Errno::INTR) => {}
                Err(Errno::AGAIN) if patience != NOW && waited < WAITS_MAX && Way::takes_some(patience) => waited += 1,
                Err(Errno::AGAIN) => {
                    self.cut |= rest.len() < text.len();
                    return false;
                }
                // A reader who has gone away misses nothing.
                Err(_) => return true,
            }
        }
        true
    }
}

impl Way {
    fn find() -> Way {
        let stderr = rustix::stdio::stderr();
        match fstat(stderr).map(|stat| FileType::from_raw_mode(stat.st_mode)) {
            Ok(FileType::RegularFile) => Way::File,
            Ok(FileType::Fifo | FileType::CharacterDevice) => {
                let flags = OFlags::WRONLY | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
                open("/proc/self/fd/2", flags, Mode::empty()).map_or(Way::Ask, Way::Own)
            }
            _ => Way::Ask,
        }
    }

    fn write(&self, piece: &[u8]) -> Result<usize, Errno> {
        match self {
            Way::Own(own) => rustix::io::write(own, piece),
            Way::Ask if !Way::takes_some(NOW) => Err(Errno::AGAIN),
            Way::File | Way::Ask => rustix::io::write(rustix::stdio::stderr(), piece),
        }
    }

    fn takes_some(within: Timespec) -> bool {
        let stderr = rustix::stdio::stderr();
        poll(&mut [PollFd::new(&stderr.as_fd(), PollFlags::OUT)], Some(&within)).is_ok_and(|ready| ready > 0)
    }
}
