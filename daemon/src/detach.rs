//! A daemon in the background: a second process goes on, and tells the first one when its fleet runs, or why it does not.

use crate::error::{Error, Kind};
use rustix::fs::{Mode, OFlags, open};
use rustix::pipe::{PipeFlags, pipe_with};
use rustix::process::setsid;
use std::fs::File;
use std::io::{self, Read, Write};
use std::os::fd::OwnedFd;
use std::path::Path;

/// Which of the two processes this is.
pub enum Side {
    /// The one that was started: it hears what the other one says.
    Caller(Hearing),
    /// The one in the background: it has a session of its own, and nothing of the terminal.
    Daemon(Saying),
}

/// The end of the caller.
pub struct Hearing(File);

/// The end of the daemon. What is dropped without a word was killed.
pub struct Saying(File);

/// Goes on as two processes. What the one in the background writes to standard error is added to the file `errors`.
///
/// # Errors
/// When there are no processes or descriptors left.
pub fn detach() -> Result<Side, Error> {
    let failed = |what: &str, error: io::Error| {
        Error::new(Kind::Process, format!("daemon: {what}: {error}")).hint("see `shoal doctor`")
    };
    let (hears, says) = pipe_with(PipeFlags::CLOEXEC).map_err(|error| failed("cannot make a pipe", error.into()))?;
    // SAFETY: this process has one thread, so that nothing is half done in the copy.
    match unsafe { libc::fork() } {
        -1 => Err(failed("cannot be started", io::Error::last_os_error())),
        0 => {
            drop(hears);
            // It is the leader of no group: this cannot fail.
            let _ = setsid();
            Ok(Side::Daemon(Saying(says.into())))
        }
        _ => {
            drop(says);
            Ok(Side::Caller(Hearing(hears.into())))
        }
    }
}

/// Gives up the terminal: reads nothing, writes nothing, and errors go to a file.
///
/// # Errors
/// When the file cannot be opened.
pub fn leave_terminal(errors: &Path) -> Result<(), Error> {
    let failed = |path: &Path, error: rustix::io::Errno| {
        Error::new(Kind::State, format!("`{}`: cannot open: {}", path.display(), io::Error::from(error)))
    };
    let null = Path::new("/dev/null");
    let nothing = open(null, OFlags::RDWR, Mode::empty()).map_err(|error| failed(null, error))?;
    let flags = OFlags::WRONLY | OFlags::APPEND | OFlags::CREATE | OFlags::NOFOLLOW;
    let errors_fd: OwnedFd = open(errors, flags, Mode::RUSR | Mode::WUSR).map_err(|error| failed(errors, error))?;
    // These numbers are always those of an open file here.
    let _ = rustix::stdio::dup2_stdin(&nothing);
    let _ = rustix::stdio::dup2_stdout(&nothing);
    let _ = rustix::stdio::dup2_stderr(&errors_fd);
    Ok(())
}

impl Hearing {
    /// All that the daemon says until it says no more; nothing if it ended without a word.
    pub fn hear(mut self) -> Vec<u8> {
        let mut words = Vec::new();
        // What could be read is what there is.
        let _ = self.0.read_to_end(&mut words);
        words
    }
}

impl Saying {
    /// The last words to the caller; `false` if it has gone.
    pub fn say(mut self, words: &[u8]) -> bool {
        self.0.write_all(words).is_ok()
    }
}
