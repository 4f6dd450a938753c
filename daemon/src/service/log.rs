//! The log of a fleet that is left running: one JSON object a line, in files of a bounded size.

use super::time::{wall_ms, written};
use crate::error::{Error, Kind};
use model::choice;
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

/// Its name in the state directory; older parts have `.1` to `.3` behind it.
pub const FILE: &str = "log.jsonl";
/// A part has no more bytes, but for its last line.
const PART_MAX: u64 = 8 << 20;
/// Older parts that are kept.
const PARTS: u32 = 3;

choice! {
    /// How much an entry matters.
    #[derive(Serialize, Deserialize, PartialOrd, Ord)]
    #[serde(rename_all = "kebab-case")]
    pub enum Level {
        /// What is of interest when something is looked for.
        Debug = "debug",
        /// What happens in good order.
        Info = "info",
        /// What should not happen often.
        Warn = "warn",
        /// What needs attention.
        Error = "error",
    }
}

/// An entry.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry {
    /// When, UTC, as RFC 3339 writes it.
    pub time: String,
    /// How much it matters.
    pub level: Level,
    /// Who says so: `daemon`, `world` or `agent`.
    pub source: String,
    /// The robot that it is about, if it is about one.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub robot: Option<String>,
    /// The tick, of an event of the run.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub tick: Option<u64>,
    /// Its name, of an event.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub event: Option<String>,
    /// What is said.
    pub text: String,
}

impl Entry {
    /// Of this moment, about no robot.
    pub fn new(level: Level, source: &str, text: impl Into<String>) -> Entry {
        let (source, text) = (source.to_owned(), text.into());
        Entry { time: written(wall_ms()), level, source, robot: None, tick: None, event: None, text }
    }
}

/// The entry that a line holds, if it holds one.
pub fn read_entry(line: &str) -> Option<Entry> {
    serde_json::from_str(line).ok()
}

/// The log, open for its one writer.
pub struct LogFile {
    path: PathBuf,
    file: File,
    size: u64,
    /// Entries that could not be written since the last one that could be.
    lost: u64,
}

impl LogFile {
    /// Opens the log in a state directory; makes it if there is none.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn open(directory: &Path) -> Result<LogFile, Error> {
        let path = directory.join(FILE);
        let failed = |error: io::Error| {
            Error::new(Kind::State, format!("log `{}`: cannot write: {error}", path.display()))
                .hint("choose another directory with `--state DIR`")
        };
        let mut file = append(&path).map_err(failed)?;
        let mut size = file.metadata().map_err(failed)?.len();
        // A daemon that was killed may have left half a line.
        if size > 0 {
            size += file.write(b"\n").map_err(failed)? as u64;
        }
        Ok(LogFile { path, file, size, lost: 0 })
    }

    /// Adds an entry. What cannot be written is counted, and said as soon as something can be.
    pub fn write(&mut self, entry: &Entry) {
        if self.size >= PART_MAX {
            self.turn();
        }
        if self.lost > 0 {
            let text = format!("{} entries of this log are lost: it could not be written", self.lost);
            if self.put(&Entry::new(Level::Error, "daemon", text)).is_ok() {
                self.lost = 0;
            }
        }
        if self.put(entry).is_err() {
            self.lost += 1;
        }
    }

    fn put(&mut self, entry: &Entry) -> io::Result<()> {
        let mut line = serde_json::to_vec(entry)?;
        line.push(b'\n');
        // One call, so that a reader who follows finds whole lines; what a full disk cut off is ended with the next.
        let put = self.file.write_all(&line);
        self.size += line.len() as u64;
        put
    }

    /// Begins a new part. If that cannot be done, the old one goes on.
    fn turn(&mut self) {
        let part = |number: u32| self.path.with_extension(format!("jsonl.{number}"));
        for number in (1..PARTS).rev() {
            let _ = std::fs::rename(part(number), part(number + 1));
        }
        if std::fs::rename(&self.path, part(1)).is_ok()
            && let Ok(file) = append(&self.path)
        {
            (self.file, self.size) = (file, 0);
        }
    }
}

fn append(path: &Path) -> io::Result<File> {
    OpenOptions::new().append(true).create(true).mode(0o600).custom_flags(libc::O_NOFOLLOW).open(path)
}

/// The files of the log in a state directory, the oldest first.
pub fn parts(directory: &Path) -> Vec<PathBuf> {
    let path = directory.join(FILE);
    let older = (1..=PARTS).rev().map(|number| path.with_extension(format!("jsonl.{number}")));
    older.chain([path.clone()]).filter(|path| path.is_file()).collect()
}

#[cfg(test)]
#[expect(clippy::disallowed_methods, reason = "tests look at files")]
mod tests {
    use super::*;

    fn entries(directory: &Path) -> Vec<Entry> {
        let lines = |path: PathBuf| std::fs::read_to_string(path).unwrap();
        let text: String = parts(directory).into_iter().map(lines).collect();
        text.lines().filter_map(read_entry).collect()
    }

    #[test]
    fn what_was_written_is_read_in_order() {
        let directory = tempfile::tempdir().unwrap();
        let mut log = LogFile::open(directory.path()).unwrap();
        let first =
            Entry { robot: Some("r01".into()), tick: Some(7), ..Entry::new(Level::Warn, "agent", "a \"b\"\nc") };
        log.write(&first);
        // Half a line of one that was killed.
        log.file.write_all(b"{\"time\": \"2026").unwrap();
        drop(log);
        let mut log = LogFile::open(directory.path()).unwrap();
        let second = Entry::new(Level::Info, "daemon", "again");
        log.write(&second);
        assert_eq!(entries(directory.path()), [first, second]);
    }

    #[test]
    fn it_does_not_grow_without_end() {
        let directory = tempfile::tempdir().unwrap();
        let mut log = LogFile::open(directory.path()).unwrap();
        let long = "x".repeat(64 << 10);
        for number in 0..600 {
            log.write(&Entry::new(Level::Info, "daemon", format!("{number} {long}")));
        }
        let found = parts(directory.path());
        let sizes: Vec<u64> = found.iter().map(|path| path.metadata().unwrap().len()).collect();
        assert!(found.len() == 4 && sizes.iter().all(|size| *size <= PART_MAX + (65 << 10)), "{sizes:?}");
        let numbers: Vec<u32> = entries(directory.path())
            .iter()
            .map(|entry| entry.text.split(' ').next().unwrap().parse().unwrap())
            .collect();
        assert!(numbers.windows(2).all(|two| two[1] == two[0] + 1), "without a gap");
        assert!(numbers[0] > 0 && numbers.last() == Some(&599), "the newest");
    }
}
