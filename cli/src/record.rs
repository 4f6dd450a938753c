//! `shoal run --record FILE`: where the record goes, and what became of it. The format is [`protocol::record`]; whoever
//! has the world writes it: this process in `single`, else the world's.

use crate::exit::Failure;
use crate::file::Files;
use model::{Outcome, Scenario};
use protocol::record::{Record, RecordError};
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

    /// Why there is no record after all.
    pub fn failed(&self, cause: &dyn std::fmt::Display) -> Failure {
        Failure::environment(format!("record `{}`: cannot write: {cause}", self.0.display()))
            .hint("the report covers the whole run; only the record is missing")
    }
}

/// Reads a record.
///
/// # Errors
/// With exit code 2, when there is no such file, or it is not a record.
pub fn read(path: &Path) -> Result<Record, Failure> {
    let shown = path.display();
    let refused = |error: RecordError| {
        let hint = match error {
            RecordError::Foreign | RecordError::Io(_) => "`shoal run --record FILE` writes what this verb reads",
            RecordError::Truncated | RecordError::Damaged => "was it copied in full? else record the run again",
            RecordError::TooLarge => "record a shorter run, with `--duration`",
            RecordError::Version(_) | RecordError::Codec(_) | RecordError::Impossible => {
                "record the run again with this shoal"
            }
        };
        Failure::usage(format!("record `{shown}`: {error}")).hint(hint)
    };
    let meta = std::fs::metadata(path).map_err(|error| refused(error.into()))?;
    if !meta.is_file() {
        let kind = if meta.is_dir() { "a directory" } else { "a device or a pipe" };
        return Err(Failure::usage(format!("record `{shown}`: it is {kind}, not a file"))
            .hint("`shoal run --record FILE` writes what this verb reads"));
    }
    #[expect(clippy::disallowed_methods, reason = "the command line reads what it was given")]
    let file = std::fs::File::open(path).map_err(|error| refused(error.into()))?;
    Record::read_from(file).map_err(refused)
}
