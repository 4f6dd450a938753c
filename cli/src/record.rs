//! `shoal run --record FILE`: where the record goes, and what became of it. The format is that of [`record`]; the process that has
//! the world writes it: this one in `single`, the world-sim process otherwise.

use crate::exit::Failure;
use crate::file::Files;
use model::{Outcome, Scenario};
use record::{Record, RecordError};
use std::path::{Path, PathBuf};
use world_sim::recorder::Recorder;

/// The place of a record that can be written.
#[derive(Clone, Debug)]
pub struct RecordPlace(PathBuf);

impl RecordPlace {
    /// Checks that a record can be written there. Leaves nothing behind.
    ///
    /// # Errors
    /// With exit code 3, when it cannot; with 2, when the command uses the file for something else.
    pub fn prepare(named: &Path, files: &mut Files) -> Result<RecordPlace, Failure> {
        files.write("record", "--record", named)?.into_path().map(RecordPlace)
    }

    /// Where it will be.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Begins a record in this process.
    ///
    /// # Errors
    /// With exit code 3, when the file cannot be made.
    pub fn begin(&self, scenario: &Scenario) -> Result<Recorder, Failure> {
        Recorder::begin(&self.0, scenario).map_err(|error| self.failed(&error))
    }

    /// Ends a record of this process.
    ///
    /// # Errors
    /// With exit code 3, when it could not be written.
    pub fn finish(&self, recorder: Recorder, outcome: &Outcome) -> Result<(), Failure> {
        recorder.finish(outcome).map_err(|error| self.failed(&error))
    }

    /// Looks whether the record of a run that has ended is there, and all of it.
    ///
    /// # Errors
    /// With exit code 3, when it is not, or when frames are left out.
    pub fn check(&self) -> Result<(), Failure> {
        let record = Record::open(&self.0).map_err(|error| self.failed(&error))?;
        if let Some(cut) = record.cut() {
            return Err(self.failed(&cut));
        }
        match record.left_out() {
            0 => Ok(()),
            n => {
                let (shown, s) = (self.0.display(), if n == 1 { "" } else { "s" });
                let problem =
                    format!("record `{shown}`: the disk did not keep up, and {n} frame{s} had to be left out");
                Err(Failure::environment(problem)
                    .hint("the run was not held up; record to a faster disk, or in lockstep, which waits for the disk"))
            }
        }
    }

    /// Why there is no record after all.
    pub fn failed(&self, cause: &dyn std::fmt::Display) -> Failure {
        Failure::environment(format!("record `{}`: cannot write: {cause}", self.0.display()))
            .hint("the report covers the whole run; the record holds what was written before")
    }
}

/// Opens a record.
///
/// # Errors
/// With exit code 2, when there is no such file, or it is not a record.
pub fn open(path: &Path) -> Result<Record, Failure> {
    let meta = std::fs::metadata(path).map_err(|error| refused(path, &error.into()))?;
    if !meta.is_file() {
        let kind = if meta.is_dir() { "a directory" } else { "a device or a pipe" };
        return Err(Failure::usage(format!("record `{}`: it is {kind}, not a file", path.display()))
            .hint("`shoal run --record FILE` writes what this verb reads"));
    }
    Record::open(path).map_err(|error| refused(path, &error))
}

/// Why a record cannot be used.
pub fn refused(path: &Path, error: &RecordError) -> Failure {
    let hint = match error {
        RecordError::Foreign | RecordError::Library(_) | RecordError::Io(_) => {
            "`shoal run --record FILE` writes what this verb reads"
        }
        RecordError::Beginning(_) | RecordError::Damaged(_) | RecordError::Map(_) => {
            "was it copied in full? else record the run again"
        }
        RecordError::Old | RecordError::Version(_) | RecordError::Codec(_) | RecordError::Impossible => {
            "record the run again with this shoal"
        }
    };
    Failure::usage(format!("record `{}`: {error}", path.display())).hint(hint)
}

/// Says where a record ends, if it is not there to its end, and what is missing in it.
pub fn tell_gaps(path: &Path, record: &Record) {
    let shown = path.display();
    if let Some(cut) = record.cut() {
        crate::out::talk(&format!("warning: record `{shown}`: {cut}; what comes before is used"));
    }
    match record.left_out() {
        0 => {}
        1 => crate::out::talk(&format!(
            "warning: record `{shown}`: 1 frame was left out, because the disk did not keep up"
        )),
        n => crate::out::talk(&format!(
            "warning: record `{shown}`: {n} frames were left out, because the disk did not keep up"
        )),
    }
}
