//! Standard output and standard error. Whoever reads our output may stop reading: that is no error of ours.

use crate::exit::{self, Failure};
use crate::talk;
use daemon::signals;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::termios;
use std::io::{self, ErrorKind, IsTerminal};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// The reader of standard output has gone away.
static UNREAD: AtomicBool = AtomicBool::new(false);

/// Whether anybody may still read standard output: what would be written for ever can end.
pub fn is_read() -> bool {
    let stdout = rustix::stdio::stdout();
    let mut ends = [PollFd::new(&stdout, PollFlags::empty())];
    // A pipe or a socket whose reader has closed it is in error.
    let _ = poll(&mut ends, Some(&Timespec { tv_sec: 0, tv_nsec: 0 }));
    !UNREAD.load(Relaxed) && !ends[0].revents().intersects(PollFlags::ERR | PollFlags::NVAL)
}

/// Writes data to standard output. A reader that has gone away (`| head -1`) is not an error.
pub fn data(text: &str) -> Result<(), Failure> {
    match signals::ending_at_once(exit::INTERRUPTED, || write_all(text.as_bytes())) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::environment(format!("standard output: cannot write: {error}"))
                .hint("is the disk full? give the output another place"))
        }
        written => {
            UNREAD.fetch_or(written.is_err(), Relaxed);
            Ok(())
        }
    }
}

/// Writes all of it, and waits for the reader even if another process has set the pipe to non-blocking.
fn write_all(mut text: &[u8]) -> io::Result<()> {
    let stdout = rustix::stdio::stdout();
    while !text.is_empty() {
        match rustix::io::write(stdout, text) {
            Ok(0) => return Err(ErrorKind::WriteZero.into()),
            Ok(written) => text = &text[written..],
            Err(Errno::INTR) => {}
            Err(Errno::AGAIN) => _ = poll(&mut [PollFd::new(&stdout, PollFlags::OUT)], None),
            Err(error) => return Err(error.into()),
        }
    }
    Ok(())
}

/// Writes a value as JSON, with a newline at the end, to standard output.
pub fn json(value: &impl serde::Serialize) -> Result<(), Failure> {
    let mut text = serde_json::to_string_pretty(value).expect("reports have string keys only");
    text.push('\n');
    data(&text)
}

/// Writes what was measured as JSON, with the digits that are known, to standard output.
pub fn measured(value: &impl serde::Serialize) -> Result<(), Failure> {
    json(&report::numbers::json(value))
}

/// Says something on standard error, if it can be written now.
pub fn talk(line: &str) {
    talk::lines(&format!("{line}\n"));
}

/// Whether to colour what goes to a stream.
fn colored(terminal: bool) -> bool {
    #[expect(clippy::disallowed_methods, reason = "the shell of the command line reads the environment")]
    let plain = std::env::var("NO_COLOR").is_ok_and(|value| !value.is_empty())
        || std::env::var("TERM").is_ok_and(|value| value == "dumb");
    terminal && !plain
}

/// Whether standard output wants colour: it is a terminal, and `NO_COLOR` is not set.
pub fn stdout_colored() -> bool {
    colored(io::stdout().is_terminal())
}

/// Whether standard error wants colour.
pub fn stderr_colored() -> bool {
    colored(io::stderr().is_terminal())
}

/// Columns of text on standard output: those of the terminal, 80 if it is none.
pub fn stdout_width() -> usize {
    columns(io::stdout()).unwrap_or(80)
}

/// Rows of the terminal on standard output; `None` if it is none.
pub fn stdout_rows() -> Option<usize> {
    let size = termios::tcgetwinsize(io::stdout()).ok()?;
    (size.ws_row > 0).then_some(size.ws_row as usize)
}

/// Columns of the terminal on standard error; `None` if it is none.
pub fn stderr_terminal_width() -> Option<usize> {
    io::stderr().is_terminal().then(|| columns(io::stderr()).unwrap_or(80))
}

fn columns(stream: impl std::os::fd::AsFd) -> Option<usize> {
    let size = termios::tcgetwinsize(stream).ok()?;
    (size.ws_col > 0).then_some(size.ws_col as usize)
}

/// Says why something failed, and the way out, on standard error.
pub fn fail(failure: &Failure) {
    talk::last(&failure.render(stderr_colored()));
}
