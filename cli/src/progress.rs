//! How a run is getting on, on standard error: one line that changes on a terminal, a line now and then elsewhere.

use crate::repeats::Repeats;
use crate::{out, talk};
use daemon::coordinator::News;
use std::time::{Duration, Instant};

/// On a terminal the line changes at most this often.
const TERMINAL_EVERY: Duration = Duration::from_millis(100);
/// Elsewhere there is a line at most this often.
const PLAIN_EVERY: Duration = Duration::from_secs(5);

/// The run at this moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProgressState {
    /// The newest tick.
    pub tick: u64,
    /// Robots in the fleet.
    pub robots: usize,
    /// Those that have arrived.
    pub arrived: usize,
    /// Contacts so far.
    pub contacts: u64,
    /// Wall time since the first tick, s.
    pub wall_s: f64,
}

/// What does not change during a run.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Frame {
    ticks_max: u64,
    tick_hz: f64,
}

/// Shows how a run is getting on. Call [`Progress::update`] as often as is convenient.
#[derive(Debug)]
pub struct Progress {
    frame: Frame,
    terminal: bool,
    robots: usize,
    shown: Option<Instant>,
    /// The line that is on the terminal now, or was printed last, to be drawn again below an event.
    line: String,
    began: Instant,
    repeats: Repeats,
}

impl Progress {
    /// Progress of a run of so many robots, that ends after `ticks_max` ticks at the latest.
    pub fn new(total_robots: usize, ticks_max: u64, tick_hz: f64) -> Progress {
        let terminal = out::stderr_terminal_width().is_some();
        // Elsewhere short runs have no progress: the first line comes after a while.
        let shown = if terminal { None } else { Some(now()) };
        Progress {
            frame: Frame { ticks_max, tick_hz },
            terminal,
            robots: total_robots,
            shown,
            line: String::new(),
            began: now(),
            repeats: Repeats::default(),
        }
    }

    /// Shows the state, if it is time to.
    pub fn update(&mut self, state: &ProgressState) {
        let every = if self.terminal { TERMINAL_EVERY } else { PLAIN_EVERY };
        let now = now();
        if let Some(sum) = self.repeats.sum(now.duration_since(self.began)) {
            self.event(&sum);
        }
        if self.shown.is_some_and(|shown| now.duration_since(shown) < every) {
            return;
        }
        self.shown = Some(now);
        let state = ProgressState { robots: state.robots.max(self.robots), ..*state };
        let line = line(&self.frame, &state);
        if !self.terminal {
            // A fleet that is paused has no news.
            if self.line != line {
                out::talk(&line);
                self.line = line;
            }
            return;
        }
        // The size may change while the run goes on; the last column stays free, some terminals wrap when it is used.
        let width = out::stderr_terminal_width().unwrap_or(80).saturating_sub(1);
        self.line = fit(line, width);
        talk::paint(&format!("\r\x1b[2K{}", self.line));
    }

    /// Says that something happened, in a line of its own.
    pub fn event(&mut self, text: &str) {
        if self.terminal {
            talk::lines(&format!("\r\x1b[2K{text}\n"));
            talk::paint(&self.line);
        } else {
            out::talk(text);
        }
    }

    /// Says that an event of this kind happened; those that repeat are summed up.
    pub fn news(&mut self, kind: News, text: &str) {
        if self.repeats.tell(kind, now().duration_since(self.began)) {
            self.event(text);
        }
    }

    /// Takes the line away. Nothing is shown after this.
    pub fn finish(&mut self) {
        if let Some(sum) = self.repeats.rest() {
            self.event(&sum);
        }
        if self.terminal && !self.line.is_empty() {
            talk::paint("\r\x1b[2K");
        }
        self.line.clear();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.finish();
    }
}

/// What a long work is at: one line that changes on a terminal, a line now and then elsewhere.
#[derive(Debug)]
pub struct Live {
    terminal: bool,
    shown: Option<Instant>,
    line: String,
}

impl Live {
    /// Nothing to say yet.
    pub fn new() -> Live {
        let terminal = out::stderr_terminal_width().is_some();
        Live { terminal, shown: (!terminal).then(now), line: String::new() }
    }

    /// Says what comes next, if it is time to.
    pub fn say(&mut self, what: &str) {
        let every = if self.terminal { TERMINAL_EVERY } else { PLAIN_EVERY };
        let now = now();
        if self.shown.is_some_and(|shown| now.duration_since(shown) < every) {
            return;
        }
        self.shown = Some(now);
        if !self.terminal {
            return out::talk(what);
        }
        let width = out::stderr_terminal_width().unwrap_or(80).saturating_sub(1);
        self.line = fit(what.to_owned(), width);
        talk::paint(&format!("\r\x1b[2K{}", self.line));
    }

    /// Takes the line away.
    pub fn finish(&mut self) {
        if self.terminal && !self.line.is_empty() {
            talk::paint("\r\x1b[2K");
        }
        self.line.clear();
    }
}

impl Default for Live {
    fn default() -> Live {
        Live::new()
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        self.finish();
    }
}

#[expect(clippy::disallowed_methods, reason = "progress is for people, who live in real time")]
fn now() -> Instant {
    Instant::now()
}

/// The state in one line, the most important first: a narrow terminal cuts the end.
fn line(frame: &Frame, state: &ProgressState) -> String {
    let time_s = state.tick as f64 / frame.tick_hz;
    // A fleet that is left running has no end.
    let of_max = match frame.ticks_max {
        u64::MAX => String::new(),
        ticks_max => format!(" of {:.0}", ticks_max as f64 / frame.tick_hz),
    };
    let contacts = match state.contacts {
        1 => "1 contact".to_string(),
        n => format!("{n} contacts"),
    };
    let factor = time_s / state.wall_s;
    let factor = if state.wall_s > 0.0 { format!("  x{factor:.2} real time") } else { String::new() };
    format!(
        "{time_s:6.1} s{of_max}  arrived {}/{}  {contacts}{factor}  tick {}",
        state.arrived, state.robots, state.tick
    )
}

/// Cut off at the width.
fn fit(line: String, width: usize) -> String {
    report::cut(&line, width.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Frame = Frame { ticks_max: 3000, tick_hz: 50.0 };
    const STATE: ProgressState = ProgressState { tick: 610, robots: 15, arrived: 3, contacts: 0, wall_s: 12.21 };

    #[test]
    fn one_line_says_it_all() {
        let lines = [
            line(&FRAME, &ProgressState { robots: 15, ..ProgressState::default() }),
            line(&FRAME, &STATE),
            line(&FRAME, &ProgressState { contacts: 1, wall_s: 0.4, ..STATE }),
            line(&Frame { ticks_max: 1_000_000, tick_hz: 12.5 }, &ProgressState { tick: 999_999, ..STATE }),
            fit(line(&FRAME, &STATE), 39),
            fit(line(&FRAME, &STATE), 12),
        ];
        insta::assert_snapshot!(lines.join("\n"));
    }
}
