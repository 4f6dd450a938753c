//! How a run is getting on, on standard error: one line that changes on a terminal, a line now and then elsewhere.

use crate::repeats::Repeats;
use crate::{out, talk};
use daemon::coordinator::News;
use std::time::{Duration, Instant};

/// On a terminal the line changes at most this often.
const TERMINAL_EVERY: Duration = Duration::from_millis(100);
/// Elsewhere there is a line at most this often.
const PLAIN_EVERY: Duration = Duration::from_secs(5);
/// The same for a bar.
const BAR_PLAIN_EVERY: Duration = Duration::from_secs(10);
/// A bar is no shorter and no longer, in characters.
const BAR_WIDTH_MIN: usize = 8;
const BAR_WIDTH_MAX: usize = 30;

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
    /// Nothing is said where there is no terminal.
    is_silent: bool,
    plain_every: Duration,
    shown: Option<Instant>,
    line: String,
}

impl Live {
    /// Nothing to say yet.
    pub fn new() -> Live {
        Live::every(PLAIN_EVERY)
    }

    /// The same; where there is no terminal, lines come no more often than this.
    fn every(plain_every: Duration) -> Live {
        let terminal = out::stderr_terminal_width().is_some();
        Live { terminal, is_silent: false, plain_every, shown: (!terminal).then(now), line: String::new() }
    }

    /// Whether it is time to say something.
    fn is_due(&self) -> bool {
        let every = if self.terminal { TERMINAL_EVERY } else { self.plain_every };
        !self.is_silent && self.shown.is_none_or(|shown| now().duration_since(shown) >= every)
    }

    /// Says what comes next, if it is time to.
    pub fn say(&mut self, what: &str) {
        if !self.is_due() {
            return;
        }
        self.shown = Some(now());
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

/// How far a long work is: a bar with an estimate of the time left, on one line of a terminal; elsewhere a line now and then.
#[derive(Debug)]
pub struct Bar {
    live: Live,
    /// When the first step was told, and how many had been done by then.
    since: Option<(Instant, u64)>,
}

impl Bar {
    /// Nothing has been done yet.
    pub fn new() -> Bar {
        Bar { live: Live::every(BAR_PLAIN_EVERY), since: None }
    }

    /// The same, and nothing is printed where there is no terminal.
    pub fn on_terminal() -> Bar {
        let mut bar = Bar::new();
        bar.live.is_silent = !bar.live.terminal;
        bar
    }

    /// Shows that this much is done, if it is time to; `what` is it that is done. It may be called as often as is convenient: a
    /// callback `|done, total| bar.at(done, total, "...")` will do.
    pub fn at(&mut self, done: u64, total: u64, what: &str) {
        if !self.live.is_due() {
            return;
        }
        let now = now();
        let (began, first) = *self.since.get_or_insert((now, done));
        let left_s = left_s(done.saturating_sub(first), total.saturating_sub(done), now.duration_since(began));
        let width = if self.live.terminal { out::stderr_terminal_width().unwrap_or(80).saturating_sub(1) } else { 0 };
        self.live.say(&bar_line(what, done, total, left_s, width));
    }

    /// Takes the line away.
    pub fn finish(&mut self) {
        self.live.finish();
    }
}

impl Default for Bar {
    fn default() -> Bar {
        Bar::new()
    }
}

/// How long the rest takes if it goes on like this, s; `None` before that can be said.
fn left_s(done: u64, left: u64, took: Duration) -> Option<f64> {
    let took_s = took.as_secs_f64();
    (done > 0 && took_s >= 0.5).then(|| took_s / done as f64 * left as f64)
}

/// The most important first: a narrow terminal cuts the end. The bar takes what is left, if that is worth it.
fn bar_line(what: &str, done: u64, total: u64, left_s: Option<f64>, width: usize) -> String {
    let share = if total == 0 { 1.0 } else { (done as f64 / total as f64).min(1.0) };
    let left = left_s.map_or_else(String::new, |seconds| format!("  {} left", duration(seconds)));
    let line = format!("{:3.0} %{left}  {what}", (share * 100.0).floor());
    let room = width.saturating_sub(line.chars().count() + 4).min(BAR_WIDTH_MAX);
    if room < BAR_WIDTH_MIN {
        return line;
    }
    let full = (share * room as f64).floor() as usize;
    format!("{line}  [{}{}]", "#".repeat(full), ".".repeat(room - full))
}

/// A length of time, to a digit or two.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 99.5 => format!("{s:.0} s"),
        s if s < 99.5 * 60.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
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
    fn a_bar_says_how_far_it_is_and_how_long_the_rest_takes() {
        let check = |done, total, left_s, width, expected: &str| {
            assert_eq!(bar_line("ring.rec", done, total, left_s, width), expected);
        };
        check(0, 100, None, 60, "  0 %  ring.rec  [..............................]");
        check(45, 100, Some(12.3), 60, " 45 %  12 s left  ring.rec  [#############.................]");
        check(999, 1000, Some(7200.0), 40, " 99 %  2.0 h left  ring.rec  [########.]");
        // It is done when all is done; and there is no bar where there is no room, or no terminal.
        check(1000, 1000, Some(0.0), 30, "100 %  0 s left  ring.rec");
        check(3, 0, Some(100.0), 0, "100 %  2 min left  ring.rec");
        assert_eq!(left_s(0, 9, Duration::from_secs(9)), None);
        assert_eq!(left_s(5, 9, Duration::from_millis(400)), None, "too early to tell");
        assert_eq!(left_s(5, 15, Duration::from_secs(10)), Some(30.0));
    }

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
