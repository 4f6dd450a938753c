//! `shoal logs`: what a fleet that was left running has written into its log.
#![expect(clippy::disallowed_methods, reason = "the verb reads files")]

use super::fleet;
use crate::args::{Format, LevelArg, LogsArgs, parse_duration};
use crate::exit::Failure;
use crate::out;
use bus::{Address, clock};
use daemon::service::{Entry, LOG_FILE, Level, parse_time, parts, read_entry, wall_ms};
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// How often a reader who follows looks.
const LOOK_EVERY_NS: u64 = 100_000_000;

/// Prints it, and what follows.
///
/// # Errors
/// When there is no such fleet, or it keeps no log.
pub fn run(options: &LogsArgs) -> Result<(), Failure> {
    let since_ms = options.since.as_deref().map(since).transpose()?;
    let (directory, address) = place(options)?;
    let filter = Filter { about: &options.about, level: level_of(options.level), since_ms, format: options.format };
    let found = parts(&directory);
    if found.is_empty() {
        return Err(Failure::usage(format!("log: there is none in `{}`", directory.display()))
            .hint("`shoal up` writes it into the state directory of its fleet"));
    }
    let (newest, older) = found.split_last().expect("one at least");
    for part in older {
        let Ok(file) = File::open(part) else { continue };
        for line in BufReader::new(file).lines().map_while(Result::ok) {
            filter.print(&line)?;
        }
    }
    let mut reader = Follower::open(newest)?;
    reader.print_new(&filter)?;
    while options.follow && out::is_read() {
        let runs = address.as_ref().is_some_and(|address| address.root().exists());
        clock::sleep_until_ns(clock::now_ns() + LOOK_EVERY_NS);
        reader.print_new(&filter)?;
        if reader.was_turned(&directory.join(LOG_FILE)) {
            reader = Follower::open(&directory.join(LOG_FILE))?;
            reader.print_new(&filter)?;
        }
        if !runs {
            break;
        }
    }
    Ok(())
}

/// The state directory that is meant, and the fleet if it runs.
fn place(options: &LogsArgs) -> Result<(PathBuf, Option<Address>), Failure> {
    if let Some(state) = &options.state {
        let running = fleet::running()?.into_iter().map(|fleet| fleet.address);
        let is_its = |address: &Address| {
            fleet::state_of(address).and_then(|of| Some(std::fs::canonicalize(state).ok()? == of)).unwrap_or(false)
        };
        return Ok((state.clone(), running.into_iter().find(is_its)));
    }
    let address = fleet::choose(&options.fleet)
        .map_err(|failure| failure.hint("the log of a fleet that does not run any more: `shoal logs --state DIR`"))?;
    match fleet::state_of(&address) {
        Some(state) => Ok((state, Some(address))),
        None => Err(Failure::usage(format!("fleet `{}`: it keeps no log: it runs in the foreground", address.id()))
            .hint("`shoal run` says what happens on standard error; fleets of `shoal up` keep a log")),
    }
}

/// A point in time, or how long ago it was.
fn since(text: &str) -> Result<u64, Failure> {
    let ago = || parse_duration(text).ok().map(|seconds| wall_ms().saturating_sub((seconds * 1e3) as u64));
    parse_time(text).or_else(ago).ok_or_else(|| {
        Failure::usage(format!("`--since {}` is not a time", text.escape_debug()))
            .hint("write 2026-11-28T10:00:00 (UTC), or as long ago as 10m, 90s or 2h")
    })
}

fn level_of(level: LevelArg) -> Level {
    match level {
        LevelArg::Debug => Level::Debug,
        LevelArg::Info => Level::Info,
        LevelArg::Warn => Level::Warn,
        LevelArg::Error => Level::Error,
    }
}

struct Filter<'a> {
    about: &'a [String],
    level: Level,
    since_ms: Option<u64>,
    format: Format,
}

impl Filter<'_> {
    fn lets_through(&self, entry: &Entry) -> bool {
        let concerns = |about: &String| entry.robot.as_ref() == Some(about) || entry.source == *about;
        entry.level >= self.level
            && (self.about.is_empty() || self.about.iter().any(concerns))
            && self.since_ms.is_none_or(|since_ms| parse_time(&entry.time).is_some_and(|at_ms| at_ms >= since_ms))
    }

    /// Prints a line, if it is an entry and wanted. Others are what a full disk or a kill has cut off.
    fn print(&self, line: &str) -> Result<(), Failure> {
        match read_entry(line).filter(|entry| self.lets_through(entry)) {
            None => Ok(()),
            Some(_) if self.format == Format::Json => out::data(&format!("{line}\n")),
            Some(entry) => {
                let who = entry.robot.as_deref().unwrap_or(&entry.source);
                // What a robot prints must not move the cursor.
                let text: String = entry.text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
                out::data(&format!("{}  {:<5}  {who:<10}  {text}\n", entry.time, entry.level.word()))
            }
        }
    }
}

/// A file that grows, read line by line.
struct Follower {
    file: File,
    inode: u64,
    /// A line whose end has not been written yet.
    rest: Vec<u8>,
}

impl Follower {
    fn open(path: &Path) -> Result<Follower, Failure> {
        let open = || -> std::io::Result<Follower> {
            let file = File::open(path)?;
            let inode = file.metadata()?.ino();
            Ok(Follower { file, inode, rest: Vec::new() })
        };
        open().map_err(|error| Failure::environment(format!("log `{}`: cannot read: {error}", path.display())))
    }

    fn print_new(&mut self, filter: &Filter<'_>) -> Result<(), Failure> {
        let at = self.file.stream_position().unwrap_or(0);
        // A file that became shorter is read from its beginning.
        if self.file.metadata().is_ok_and(|meta| meta.len() < at) {
            let _ = self.file.seek(SeekFrom::Start(0));
        }
        let mut chunk = vec![0; 1 << 16];
        while let Ok(read @ 1..) = self.file.read(&mut chunk) {
            self.rest.extend_from_slice(&chunk[..read]);
            let whole = self.rest.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
            let lines: Vec<u8> = self.rest.drain(..whole).collect();
            for line in String::from_utf8_lossy(&lines).lines() {
                filter.print(line)?;
            }
        }
        Ok(())
    }

    /// Whether the log goes on in another file.
    fn was_turned(&self, path: &Path) -> bool {
        std::fs::metadata(path).is_ok_and(|meta| meta.ino() != self.inode)
    }
}
