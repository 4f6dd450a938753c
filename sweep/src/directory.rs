//! The directory of a sweep: its plan, the runs that have ended, and in the end the summary.
//!
//! ```text
//! sweep.json      the plan, written first; says that the directory is a sweep's, and which one
//! runs.jsonl      a line for each run, in the order in which they ended; appended when a run ends
//! summary.json    what all runs say; this and the following when all runs have ended
//! summary.txt     the same as text
//! sweep.db        all runs and robots, for SQL
//! makespan-*.svg  a box plot for each scenario
//! ```

use crate::database;
use crate::error::Error;
use crate::plan::{self, Plan};
use crate::record::Record;
use crate::row::makespans;
use crate::summary::Summary;
use crate::text;
use report::numbers::plural;
use rustix::fs::{FlockOperation, OFlags, flock};
use rustix::io::Errno;
use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use view::boxes::{self, Sample};
use world_sim::whole_file::WholeFile;

const PLAN: &str = "sweep.json";
const RUNS: &str = "runs.jsonl";
/// No plan is larger.
const PLAN_BYTES_MAX: u64 = 64 << 20;
/// Columns of `summary.txt`.
const TEXT_WIDTH: usize = 80;

/// The directory of a sweep that this process works on.
#[derive(Debug)]
pub struct Directory {
    path: PathBuf,
    runs: File,
    /// Locked while the sweep is going on.
    _lock: File,
}

impl Directory {
    /// Makes the directory, or opens that of a sweep with the same plan; with the records of the runs that have ended.
    ///
    /// # Errors
    /// Of kind `Usage`, when the directory holds something else, or a sweep of another plan; of kind `Environment`, when it
    /// cannot be made or written, another process works on it, or what is in it is damaged.
    pub fn open(path: &Path, plan: &Plan) -> Result<(Directory, Vec<Record>), Error> {
        let shown = path.display();
        let denied = |error: &io::Error| {
            Error::environment(format!("directory `{shown}`: cannot be used: {}", cause(error)))
                .hint("give --out a directory that you may write to")
        };
        fs::create_dir_all(path).map_err(|error| denied(&error))?;
        let lock = open_with(path, OpenOptions::new().read(true)).map_err(|error| denied(&error))?;
        // File systems without locks say so with other errors.
        if flock(&lock, FlockOperation::NonBlockingLockExclusive) == Err(Errno::WOULDBLOCK) {
            return Err(Error::environment(format!("directory `{shown}`: another sweep is writing to it"))
                .hint("wait for its end, or give --out another directory"));
        }
        let names = names_in(path).map_err(|error| denied(&error))?;
        if names.contains(PLAN) {
            check_plan(path, plan)?;
        } else if let Some(other) = names.iter().find(|name| !is_temporary(name)) {
            return Err(Error::usage(format!("directory `{shown}`: it is not that of a sweep: it holds `{other}`"))
                .hint("give --out a new or an empty directory; nothing was changed in this one"));
        } else {
            let mut text = serde_json::to_string_pretty(plan).expect("a plan has string keys only");
            text.push('\n');
            write_whole(&path.join(PLAN), text.as_bytes()).map_err(|error| denied(&error))?;
        }
        for name in names.iter().filter(|name| database::is_draft(name)) {
            let _ = fs::remove_file(path.join(name));
        }
        let mut options = OpenOptions::new();
        options.read(true).append(true).create(true).custom_flags(OFlags::NOFOLLOW.bits() as i32);
        let mut runs = options.open(path.join(RUNS)).map_err(|error| unwritten(&path.join(RUNS), &error))?;
        let records = read_runs(&mut runs, plan, &path.join(RUNS))?;
        Ok((Directory { path: path.to_path_buf(), runs, _lock: lock }, records))
    }

    /// Appends the record of a run that has ended.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn keep(&mut self, record: &Record) -> Result<(), Error> {
        let line = record.line() + "\n";
        let written = self.runs.write_all(line.as_bytes());
        written.map_err(|error| unwritten(&self.path.join(RUNS), &error))
    }

    /// Writes what all runs say; the names of the files. Each is whole or not there.
    ///
    /// # Errors
    /// When one cannot be written.
    pub fn finish(&self, plan: &Plan, records: &[Record], summary: &Summary) -> Result<Vec<String>, Error> {
        let mut files = vec![
            ("summary.json".to_owned(), json(summary)),
            ("summary.txt".to_owned(), text::render(summary, &text::Style::file(TEXT_WIDTH))),
        ];
        files.extend(pictures(plan, records));
        for (name, content) in &files {
            let path = self.path.join(name);
            write_whole(&path, content.as_bytes()).map_err(|error| unwritten(&path, &error))?;
        }
        let path = self.path.join(database::FILE);
        database::write(&path, plan, records).map_err(|cause| unwritten(&path, &io::Error::other(cause)))?;
        // A machine that loses its power later keeps what was said to be done.
        self.runs.sync_all().map_err(|error| unwritten(&self.path.join(RUNS), &error))?;
        Ok(files.into_iter().map(|(name, _)| name).chain([database::FILE.to_owned()]).collect())
    }
}

/// The summary as JSON with the digits that are known, as in `summary.json`.
pub fn json(summary: &Summary) -> String {
    let mut text = serde_json::to_string_pretty(&report::numbers::json(summary)).expect("string keys only");
    text.push('\n');
    text
}

/// The fingerprint of the executable of this process; empty where it cannot be read.
pub fn build() -> String {
    #[expect(clippy::disallowed_methods, reason = "the runs of a sweep are those of one executable")]
    fs::read("/proc/self/exe").map(|bytes| plan::fingerprint(&bytes)).unwrap_or_default()
}

/// A box plot of the makespans of each scenario: file and content.
fn pictures(plan: &Plan, records: &[Record]) -> Vec<(String, String)> {
    let of_each = plan.runs() / plan.scenarios.len().max(1);
    let mut taken = BTreeSet::new();
    let picture = |(scenario, records): (&plan::ScenarioSource, &[Record])| {
        let sample = |runs: &[Record]| Sample { name: label(&runs[0], plan), values: makespans(runs), of: runs.len() };
        let samples: Vec<Sample> = records.chunks(plan.seeds.len()).map(sample).collect();
        let seeds = plan.seeds.len();
        let title = format!("{}: makespan of successful runs, {seeds} seed{}", scenario.name, plural(seeds as u64));
        (file_name(&scenario.name, &mut taken), boxes::draw(&title, "makespan, s", &samples))
    };
    plan.scenarios.iter().zip(records.chunks(of_each.max(1))).map(picture).collect()
}

/// Planner and varied keys of a row of boxes.
fn label(record: &Record, plan: &Plan) -> String {
    let planner = record.planner.iter().filter(|_| plan.planners.len() > 1 || plan.varied.is_empty()).cloned();
    let varied = text::varied(&record.varied);
    let parts: Vec<String> = planner.chain((!varied.is_empty()).then_some(varied)).collect();
    if parts.is_empty() { "all".to_owned() } else { parts.join(" ") }
}

/// The file of a scenario's picture; no two scenarios have the same.
fn file_name(scenario: &str, taken: &mut BTreeSet<String>) -> String {
    let name = scenario.rsplit('/').next().unwrap_or(scenario);
    let name = name.strip_suffix(".toml").unwrap_or(name);
    let plain = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' };
    let name: String = name.chars().take(60).map(plain).collect();
    let numbered = |n: usize| if n == 1 { format!("makespan-{name}.svg") } else { format!("makespan-{name}-{n}.svg") };
    let free = (1..).map(numbered).find(|name| !taken.contains(name)).expect("numbers do not end");
    taken.insert(free.clone());
    free
}

/// Whether the directory's plan is this one.
fn check_plan(path: &Path, plan: &Plan) -> Result<(), Error> {
    let shown = path.display();
    let foreign = |cause: String| {
        Error::usage(format!("directory `{shown}`: its {PLAN} is not that of a sweep: {cause}"))
            .hint("give --out a new or an empty directory; nothing was changed in this one")
    };
    let mut text = String::new();
    let file = open_with(&path.join(PLAN), OpenOptions::new().read(true));
    let read = file.and_then(|file| file.take(PLAN_BYTES_MAX).read_to_string(&mut text));
    read.map_err(|error| foreign(error.to_string()))?;
    let before: Plan = serde_json::from_str(&text).map_err(|error| foreign(error.to_string()))?;
    let differences = plan.differences(&before);
    if differences.is_empty() {
        return Ok(());
    }
    let error = Error::usage(format!("directory `{shown}`: it holds another sweep: {}", differences.join("; ")));
    Err(error.hint("give --out another directory, or repeat the arguments of the sweep that is there"))
}

/// Reads the runs that have ended, and drops a last line that was cut off.
fn read_runs(file: &mut File, plan: &Plan, path: &Path) -> Result<Vec<Record>, Error> {
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(|error| {
        Error::environment(format!("file `{}`: cannot read: {error}", path.display())).hint("check its permissions")
    })?;
    let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
    if whole < bytes.len() {
        file.set_len(whole as u64).map_err(|error| unwritten(path, &error))?;
    }
    let (mut records, mut seen) = (Vec::new(), vec![false; plan.runs()]);
    for (line, number) in bytes[..whole].split_inclusive(|byte| *byte == b'\n').zip(1..) {
        let record = std::str::from_utf8(line).map_err(|error| error.to_string()).and_then(Record::parse);
        let checked = record.and_then(|record| match seen.get_mut(record.run) {
            Some(seen) if record.is_of(&plan.run(record.run)) => {
                let twice = std::mem::replace(seen, true);
                if twice { Err(format!("run {} is there twice", record.run)) } else { Ok(record) }
            }
            _ => Err(format!("it is not run {} of this sweep", record.run)),
        });
        records.push(checked.map_err(|cause: String| {
            let shown = path.display();
            Error::environment(format!("file `{shown}`: line {number} cannot be used: {cause}"))
                .hint(format!("`sed -i {number}d {shown}` deletes the line, and the run is done again"))
        })?);
    }
    Ok(records)
}

fn names_in(path: &Path) -> io::Result<BTreeSet<String>> {
    fs::read_dir(path)?.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned())).collect()
}

/// What a sweep that was killed at the very beginning may have left: the plan, before it had its name.
fn is_temporary(name: &str) -> bool {
    name.starts_with(&format!(".{PLAN}.")) && name.ends_with(".tmp")
}

fn open_with(path: &Path, options: &OpenOptions) -> io::Result<File> {
    options.open(path)
}

fn write_whole(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut file = WholeFile::begin(path)?;
    file.write_all(content)?;
    file.finish()
}

fn cause(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::AlreadyExists | io::ErrorKind::NotADirectory => "a file is in its place".to_owned(),
        _ => error.to_string(),
    }
}

fn unwritten(path: &Path, error: &io::Error) -> Error {
    Error::environment(format!("file `{}`: cannot write: {error}", path.display()))
        .hint("the runs that have ended are kept: make room, and give the same command again")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_have_names_of_their_own() {
        let mut taken = BTreeSet::new();
        let names =
            ["ring-15", "a/ring-15.toml", "b/ring-15.toml", "c d.toml", "/"].map(|name| file_name(name, &mut taken));
        let expected = ["ring-15", "ring-15-2", "ring-15-3", "c-d", ""].map(|name| format!("makespan-{name}.svg"));
        assert_eq!(names, expected);
    }
}
