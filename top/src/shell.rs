//! The terminal: raw while the fleet is shown, and what it was before as soon as this ends, however it ends.

use crate::app::{App, Wish};
use crate::eyes::{Eyes, now};
use crate::keys::keys;
use crate::{End, TopError, draw};
use bus::Address;
use ratatui::Terminal;
use ratatui::backend::CrosstermBackend;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags, open};
use rustix::io::Errno;
use rustix::termios::{OptionalActions, Termios, tcgetattr, tcsetattr};
use std::io::{self, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::time::Duration;

/// How long to wait for a key.
const KEY_WAIT: Timespec = Timespec { tv_sec: 0, tv_nsec: 100_000_000 };
/// Without news the screen is drawn again after this: its size may be another one.
const DRAW_EVERY: Duration = Duration::from_millis(500);
/// The screen beside what was there before, without a cursor; and back.
const ENTER: &str = "\x1b[?1049h\x1b[?25l\x1b[2J";
const LEAVE: &str = "\x1b[0m\x1b[?25h\x1b[?1049l";

/// Whether the end has been asked for by a signal.
pub(crate) type Interrupted<'a> = &'a dyn Fn() -> bool;

/// A raw terminal.
struct Raw {
    before: Termios,
}

impl Raw {
    fn begin() -> io::Result<Raw> {
        let stdin = rustix::stdio::stdin();
        let before = tcgetattr(stdin)?;
        let mut raw = before.clone();
        raw.make_raw();
        tcsetattr(stdin, OptionalActions::Flush, &raw)?;
        Ok(Raw { before })
    }
}

impl Drop for Raw {
    fn drop(&mut self) {
        // A terminal that has gone needs nothing any more.
        if let Ok(mut output) = Output::open(&|| true) {
            let _ = output.write_all(LEAVE.as_bytes()).and_then(|()| output.flush());
        }
        let _ = tcsetattr(rustix::stdio::stdin(), OptionalActions::Now, &self.before);
    }
}

/// Standard output, without waiting for a terminal that takes nothing for longer than nobody wants the end.
struct Output<'a> {
    terminal: OwnedFd,
    buffer: Vec<u8>,
    interrupted: Interrupted<'a>,
}

impl<'a> Output<'a> {
    fn open(interrupted: Interrupted<'a>) -> io::Result<Output<'a>> {
        // The same terminal, opened once more: only this descriptor is non-blocking.
        let flags = OFlags::WRONLY | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
        let terminal = open("/proc/self/fd/1", flags, Mode::empty())?;
        Ok(Output { terminal, buffer: Vec::new(), interrupted })
    }
}

impl Write for Output<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.buffer.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let buffer = std::mem::take(&mut self.buffer);
        let mut rest = &buffer[..];
        while !rest.is_empty() {
            match rustix::io::write(&self.terminal, rest) {
                Ok(written) => rest = &rest[written..],
                Err(Errno::INTR) => {}
                Err(Errno::AGAIN) if (self.interrupted)() => return Err(io::ErrorKind::WouldBlock.into()),
                Err(Errno::AGAIN) => _ = poll(&mut [PollFd::new(&self.terminal, PollFlags::OUT)], Some(&KEY_WAIT)),
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    }
}

/// Shows a fleet until somebody has seen enough of it, or it ends.
pub(crate) fn run(address: &Address, name: Option<&str>, interrupted: Interrupted<'_>) -> Result<End, TopError> {
    let eyes = Eyes::open(address, name)?;
    let mut app = App::new(eyes.take().fleet.ok_or(TopError::NoFleet)?);
    let raw = Raw::begin().map_err(TopError::Terminal)?;
    let ended = show(&mut app, &eyes, interrupted);
    drop(raw);
    match ended {
        // Whoever has closed the terminal needs no word about it.
        Err(_) if interrupted() => Ok(End::Interrupted),
        Err(error) => Err(TopError::Terminal(error)),
        Ok(end) => Ok(end),
    }
}

fn show(app: &mut App, eyes: &Eyes, interrupted: Interrupted<'_>) -> io::Result<End> {
    let mut output = Output::open(interrupted)?;
    output.write_all(ENTER.as_bytes())?;
    output.flush()?;
    let mut terminal = Terminal::new(CrosstermBackend::new(output))?;
    let mut drawn = None;
    let mut typed = [0; 1024];
    loop {
        if interrupted() {
            return Ok(End::Interrupted);
        }
        let news = eyes.take();
        let is_over = news.is_over;
        let mut changed = news.is_some();
        take(app, news);
        if is_over {
            return Ok(End::Over);
        }
        let stdin = rustix::stdio::stdin();
        let stdin = stdin.as_fd();
        let mut ends = [PollFd::new(&stdin, PollFlags::IN)];
        // Drawn at the end of the wait, so that frames do not wait for keys, and keys not for frames.
        let ready = poll(&mut ends, Some(&KEY_WAIT));
        if ready.is_ok_and(|ready| ready > 0) {
            let read = match rustix::io::read(stdin, &mut typed) {
                // The terminal has gone.
                Ok(0) | Err(Errno::IO) => return Ok(End::TerminalGone),
                Ok(read) => read,
                Err(Errno::INTR | Errno::AGAIN) => 0,
                Err(error) => return Err(error.into()),
            };
            for key in keys(&typed[..read]) {
                match app.press(key) {
                    Some(Wish::Quit) => return Ok(End::Quit),
                    Some(Wish::Ask(request)) if !eyes.ask(&request) => {
                        app.say(false, "the daemon has not answered the request before");
                    }
                    Some(Wish::Ask(_)) | None => {}
                }
            }
            changed = true;
        }
        if changed || drawn.is_none_or(|drawn| now() - drawn >= DRAW_EVERY) {
            terminal.draw(|frame| draw::draw(app, frame))?;
            drawn = Some(now());
        }
    }
}

fn take(app: &mut App, news: crate::eyes::News) {
    if let Some(fleet) = news.fleet {
        app.fleet = fleet;
    }
    if let Some(vitals) = news.vitals {
        app.take_vitals(vitals);
    }
    if news.blind.is_some() {
        app.blind = news.blind;
    }
    if let Some(frame) = news.frame {
        app.take_frame(frame);
    }
    for reply in news.replies {
        match reply {
            Ok(reply) => app.take_reply(&reply),
            Err(why) => app.say(false, &why),
        }
    }
}
