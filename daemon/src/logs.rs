//! What the processes of a fleet print: a file each that stays small, and the newest of it on standard error.
//!
//! Processes append to a file in the root of the run: printing never waits for anybody, and goes on while the daemon is
//! stopped. The daemon looks at the files on its heartbeat. It says what is new, line by line and with the robot's
//! name, as far as a reader could follow; and it gives memory back: it punches out all but the newest part, so offsets
//! stay what they are and nobody who writes or follows the file notices.
#![expect(clippy::disallowed_methods, reason = "logs are files of the run")]

use bus::Address;
use rustix::fs::{FallocateFlags, fallocate};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::{FileExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The newest part of a log, which stays, bytes.
const KEPT: u64 = 64 << 10;
/// A log that takes more than this is cut down to the newest part, bytes.
const ROOM: u64 = 128 << 10;
const PAGE: u64 = 4096;
/// Bytes of a process's own words that are repeated when it ends badly.
const LAST_WORDS: usize = 600;
/// Of what is new at a look, this many bytes are read.
const READ_MAX: u64 = 8 << 10;
/// Of what a process prints first, so much is read, whatever comes after it.
const HEAD: u64 = 1 << 10;
/// Lines of a process that are said in a second; so many more at first.
const LINES_PER_S: f64 = 10.0;
const LINES_BURST: f64 = 20.0;
/// Longer lines are cut off.
const LINE_MAX: usize = 300;
/// How often the files are looked at, and how often it is said how much was left out.
const LOOK_EVERY: Duration = Duration::from_millis(100);
const SUM_UP_EVERY: Duration = Duration::from_secs(5);

/// A line that a process has printed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Spoken {
    /// The name of its robot, or `world`.
    pub speaker: String,
    /// The line.
    pub words: String,
}

impl std::fmt::Display for Spoken {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.speaker, self.words)
    }
}

/// The logs of a fleet.
pub(crate) struct Logs {
    root: PathBuf,
    open: BTreeMap<String, Log>,
    looked: Duration,
}

struct Log {
    /// Whose words these are.
    speaker: String,
    /// What comes before this offset has been said, or left out.
    said: u64,
    /// Bytes that were left out and not summed up yet.
    left_out: u64,
    /// Lines that may be said now.
    lines: f64,
    summed_up: Duration,
}

impl Logs {
    pub(crate) fn new(address: &Address) -> Logs {
        Logs { root: address.root().to_path_buf(), open: BTreeMap::new(), looked: Duration::ZERO }
    }

    /// Makes the log of a process; `name` is that of the file, `speaker` is for people.
    pub(crate) fn create(&mut self, name: &str, speaker: String) -> io::Result<File> {
        let path = self.path(name);
        // What an earlier one of this name has said is gone.
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let file = OpenOptions::new().append(true).create_new(true).open(path)?;
        let log = Log { speaker, said: 0, left_out: 0, lines: LINES_BURST, summed_up: Duration::ZERO };
        self.open.insert(name.to_owned(), log);
        Ok(file)
    }

    /// Goes on with the log of a process that a daemon of before has started: from what it prints now.
    pub(crate) fn take_over(&mut self, name: &str, speaker: String) {
        let said = std::fs::metadata(self.path(name)).map_or(0, |meta| meta.len());
        let log = Log { speaker, said, left_out: 0, lines: LINES_BURST, summed_up: Duration::ZERO };
        self.open.insert(name.to_owned(), log);
    }

    /// What was printed since the last look, for standard error; and memory is given back. Does something ten times a
    /// second at most.
    pub(crate) fn look(&mut self, now: Duration) -> Vec<Spoken> {
        let passed = now.saturating_sub(self.looked);
        if passed < LOOK_EVERY {
            return Vec::new();
        }
        self.looked = now;
        let mut lines = Vec::new();
        for (name, log) in &mut self.open {
            log.lines = (log.lines + passed.as_secs_f64() * LINES_PER_S).min(LINES_BURST);
            log.look(&self.root.join(file_name(name)), false, now, &mut lines);
        }
        lines
    }

    /// The process of this log has ended: the rest of what it printed.
    pub(crate) fn close(&mut self, name: &str, now: Duration) -> Vec<Spoken> {
        let mut lines = Vec::new();
        if let Some(mut log) = self.open.remove(name) {
            log.look(&self.path(name), true, now, &mut lines);
        }
        lines
    }

    /// Removes the log of a process that has ended.
    pub(crate) fn remove(&self, name: &str) {
        // It may never have been made.
        let _ = std::fs::remove_file(self.path(name));
    }

    /// What a process said last, in one line.
    pub(crate) fn last_words(&self, name: &str) -> Option<String> {
        let file = File::open(self.path(name)).ok()?;
        let size = file.metadata().ok()?.len();
        let text = read(&file, size.saturating_sub(LAST_WORDS as u64), size).ok()?;
        let words: Vec<String> = text.lines().map(printable).filter(|line| !line.is_empty()).collect();
        (!words.is_empty()).then(|| words.join(" / ").trim_start_matches("error: ").to_owned())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.root.join(file_name(name))
    }
}

impl Log {
    fn look(&mut self, path: &Path, ended: bool, now: Duration, lines: &mut Vec<Spoken>) {
        let Ok(meta) = std::fs::metadata(path) else { return };
        let size = meta.len();
        if size > self.said {
            // A process that empties its own log begins anew; what is more than a reader could follow is skipped.
            let Ok(file) = File::open(path) else { return };
            let from = self.said.max(size.saturating_sub(READ_MAX));
            let skipped = from > self.said;
            // How it began is worth more than all that follows of a flood.
            let head = if self.said == 0 && skipped {
                read(&file, 0, HEAD.min(from)).unwrap_or_default()
            } else {
                String::new()
            };
            self.say(&head[..head.rfind('\n').map_or(0, |end| end + 1)], false, lines);
            self.left_out += from - self.said;
            self.said = from;
            if let Ok(text) = read(&file, from, size) {
                // Of a line whose beginning is skipped, the end is as well.
                let rest = if skipped { text.find('\n').map_or(0, |end| end + 1) } else { 0 };
                (self.said, self.left_out) = (self.said + rest as u64, self.left_out + rest as u64);
                self.say(&text[rest..], ended, lines);
            }
        } else {
            self.said = size;
        }
        if meta.blocks() * 512 > ROOM {
            trim(path, size);
        }
        let due = self.summed_up == Duration::ZERO || now.saturating_sub(self.summed_up) >= SUM_UP_EVERY;
        if self.left_out > 0 && (due || ended) {
            let left_out = report::text::bytes_text(std::mem::take(&mut self.left_out));
            let words = format!("({left_out} of what it printed left out here)");
            lines.push(Spoken { speaker: self.speaker.clone(), words });
            self.summed_up = now;
        }
    }

    /// Whole lines; of a process that has ended, the rest as well.
    fn say(&mut self, text: &str, ended: bool, lines: &mut Vec<Spoken>) {
        for line in text.split_inclusive('\n') {
            if !line.ends_with('\n') && !ended && line.len() <= LINE_MAX {
                return;
            }
            self.said += line.len() as u64;
            let words = printable(line);
            if words.is_empty() {
            } else if self.lines >= 1.0 {
                self.lines -= 1.0;
                let words = report::cut(&words, LINE_MAX).to_string();
                lines.push(Spoken { speaker: self.speaker.clone(), words });
            } else {
                self.left_out += line.len() as u64;
            }
        }
    }
}

/// Gives back the memory of a log, all but its newest part.
fn trim(path: &Path, size: u64) {
    let end = size.saturating_sub(KEPT) / PAGE * PAGE;
    if end > 0
        && let Ok(file) = OpenOptions::new().write(true).open(path)
    {
        // Where it is refused (a /dev/shm that is no tmpfs), the file is the disk's business.
        let _ = fallocate(&file, FallocateFlags::PUNCH_HOLE | FallocateFlags::KEEP_SIZE, 0, end);
    }
}

/// Keeps all logs in the root of a run small, whoever looks after them.
pub(crate) fn trim_all(root: &Path) {
    let entries = std::fs::read_dir(root).into_iter().flatten().flatten();
    for path in entries.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|end| end == "log")) {
        if let Ok(meta) = std::fs::metadata(&path)
            && meta.blocks() * 512 > ROOM
        {
            trim(&path, meta.len());
        }
    }
}

fn file_name(name: &str) -> String {
    format!("{name}.log")
}

/// A part of a file; what is no text counts as a question mark a byte, so that offsets stay.
fn read(file: &File, from: u64, to: u64) -> io::Result<String> {
    let mut bytes = vec![0; (to - from) as usize];
    file.read_exact_at(&mut bytes, from)?;
    Ok(match String::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => error.into_bytes().iter().map(|byte| if byte.is_ascii() { *byte as char } else { '?' }).collect(),
    })
}

/// A line without what would move the cursor of a terminal.
fn printable(line: &str) -> String {
    let shown = line.trim().chars().map(|c| if c.is_control() { ' ' } else { c });
    shown.collect::<String>().trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    const S: Duration = Duration::from_secs(1);

    fn texts(lines: Vec<Spoken>) -> Vec<String> {
        lines.iter().map(Spoken::to_string).collect()
    }

    /// A fleet's root of its own.
    struct Home(Address);

    impl Drop for Home {
        fn drop(&mut self) {
            bus::clean::sweep(&self.0);
        }
    }

    fn home() -> (Home, Logs) {
        let home = Home(Address::create().unwrap());
        let logs = Logs::new(&home.0);
        (home, logs)
    }

    #[test]
    fn lines_are_said_whole_and_with_a_name() {
        let (_home, mut logs) = home();
        let mut file = logs.create("agent-1-0", "b".to_owned()).unwrap();
        file.write_all(b"one\n\n  \x1b[31mtwo\x07\nthr").unwrap();
        assert_eq!(texts(logs.look(S)), ["b: one", "b: [31mtwo"]);
        assert_eq!(texts(logs.look(S)), [""; 0], "once in a tenth of a second");
        file.write_all("ee\n\u{fffd}\u{e9}".as_bytes()).unwrap();
        assert_eq!(texts(logs.look(2 * S)), ["b: three"]);
        assert_eq!(texts(logs.close("agent-1-0", 3 * S)), ["b: \u{fffd}\u{e9}"]);
        assert_eq!(logs.last_words("agent-1-0").unwrap(), "one / [31mtwo / three / \u{fffd}\u{e9}");
        file.write_all(&[b'x', 0xff, b'\n']).unwrap();
        assert!(logs.last_words("agent-1-0").unwrap().ends_with("?x?"), "bytes that are no text");
        logs.remove("agent-1-0");
        assert_eq!(logs.last_words("agent-1-0"), None);
    }

    #[test]
    fn a_flood_takes_no_room_and_is_counted() {
        let (home, mut logs) = home();
        let mut file = logs.create("agent-0-0", "a".to_owned()).unwrap();
        let chunk = "0123456789abcde\n".repeat(64 << 10);
        let (mut said, mut now) = (Vec::new(), Duration::ZERO);
        file.write_all(b"how it began\n").unwrap();
        for _ in 0..20 {
            file.write_all(chunk.as_bytes()).unwrap();
            now += LOOK_EVERY;
            said.extend(texts(logs.look(now)));
            let blocks = std::fs::metadata(home.0.file("agent-0-0.log")).unwrap().blocks() * 512;
            assert!(blocks <= KEPT + PAGE, "{blocks} bytes are taken");
        }
        file.write_all(chunk.as_bytes()).unwrap();
        trim_all(home.0.root());
        let blocks = std::fs::metadata(home.0.file("agent-0-0.log")).unwrap().blocks() * 512;
        assert!(blocks <= KEPT + PAGE, "{blocks} bytes are taken while nobody listens");
        file.write_all(b"last\n").unwrap();
        said.extend(texts(logs.close("agent-0-0", now)));
        let lines = said.iter().filter(|line| *line == "a: 0123456789abcde").count();
        assert_eq!(said[0], "a: how it began");
        assert!((19..=45).contains(&lines), "{lines} lines in two seconds");
        assert!(said.last().unwrap().starts_with("a: (") && said.last().unwrap().contains("left out"), "{said:?}");
        assert!(logs.last_words("agent-0-0").unwrap().ends_with("/ last"));
    }

    #[test]
    fn a_line_without_end_is_said_in_parts() {
        let (_home, mut logs) = home();
        let mut file = logs.create("world", "world".to_owned()).unwrap();
        file.write_all(&[b'x'; 2 * LINE_MAX]).unwrap();
        let said = texts(logs.look(S));
        assert!(said.len() == 1 && said[0].starts_with("world: xxx"), "{said:?}");
        assert!(said[0].chars().count() <= LINE_MAX + "world: ".len(), "{said:?}");
    }
}
