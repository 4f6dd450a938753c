//! Where a report goes: a file, whole or not at all.

use super::{Report, text};
use crate::cli::Format;
use crate::exit::Failure;
use crate::file::{Files, OutFile};
use crate::numbers;
use crate::out;
use std::path::Path;

/// A file that a report can be written to; found to be possible before the run starts.
#[derive(Debug)]
pub struct ReportFile(OutFile);

impl ReportFile {
    /// Checks that a report can be written there. Leaves nothing behind.
    ///
    /// # Errors
    /// With exit code 3, when the directory does not exist or is not writable, or a directory is in the way; with 2, when
    /// the command uses the file for something else.
    pub fn prepare(named: &Path, files: &mut Files) -> Result<ReportFile, Failure> {
        files.write("report", "--report", named).map(ReportFile)
    }

    /// Writes the report.
    ///
    /// # Errors
    /// With exit code 3, when it cannot be written; what was there before stays.
    pub fn write(&self, report: &Report) -> Result<(), Failure> {
        let mut text = serde_json::to_string_pretty(&numbers::json(report)).expect("reports have string keys only");
        text.push('\n');
        self.0.write(text.as_bytes())
    }
}

/// Prints the report on standard output: for people, or the JSON and nothing else.
///
/// # Errors
/// When standard output cannot be written, other than by the reader's going away.
pub fn print(report: &Report, format: Format) -> Result<(), Failure> {
    match format {
        Format::Json => out::measured(report),
        Format::Text => {
            let style = text::Style { width: out::stdout_width(), color: out::stdout_colored() };
            out::data(&text::render(report, style))
        }
    }
}
