//! How a robot's process and the driver talk: lines over a unix stream socket, nothing while the loop runs.
//!
//! ```text
//! robot   hello ROBOT PID              its process runs
//! robot   connected NS                 it has heard everybody, at this time of the monotonic clock
//! driver  start NS TICKS               the loop begins; this many ticks are recorded after the warm-up
//! robot   done                         the loop has ended
//! driver  report                       memory has been looked at
//! robot   counts, added, late, age, end     see `Samples`; then it goes
//! ```

use crate::Failure;
use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;

/// Name of the driver's socket in the directory of a run.
pub const SOCKET: &str = "driver";

/// A robot's end.
pub struct Link {
    stream: UnixStream,
    unread: Vec<u8>,
}

/// What a look at the link found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Heard {
    /// Nothing yet.
    Nothing,
    /// A line.
    Line(String),
    /// The driver has gone, so this process has nothing left to do.
    Gone,
}

impl Link {
    /// Reaches the driver of the run in this directory.
    ///
    /// # Errors
    /// When it is not there.
    pub fn open(directory: &Path) -> Result<Link, Failure> {
        Ok(Link { stream: UnixStream::connect(directory.join(SOCKET))?, unread: Vec::new() })
    }

    /// Says a line, or several.
    ///
    /// # Errors
    /// When the driver has gone.
    pub fn say(&mut self, lines: &str) -> Result<(), Failure> {
        self.stream.set_nonblocking(false)?;
        Ok(self.stream.write_all(lines.as_bytes()).and_then(|()| self.stream.write_all(b"\n"))?)
    }

    /// Waits for a line, or only looks whether there is one.
    ///
    /// # Errors
    /// When the socket fails.
    pub fn hear(&mut self, wait: bool) -> Result<Heard, Failure> {
        self.stream.set_nonblocking(!wait)?;
        loop {
            if let Some(end) = self.unread.iter().position(|byte| *byte == b'\n') {
                let line: Vec<u8> = self.unread.drain(..=end).collect();
                return Ok(Heard::Line(String::from_utf8_lossy(&line[..end]).into_owned()));
            }
            let mut bytes = [0; 256];
            match self.stream.read(&mut bytes) {
                Ok(0) => return Ok(Heard::Gone),
                Ok(count) => self.unread.extend_from_slice(&bytes[..count]),
                Err(e) if e.kind() == ErrorKind::WouldBlock => return Ok(Heard::Nothing),
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) if e.kind() == ErrorKind::ConnectionReset => return Ok(Heard::Gone),
                Err(e) => return Err(e.into()),
            }
        }
    }
}
