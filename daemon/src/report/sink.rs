//! Where a report goes: a file, whole or not at all.

use super::{Report, text};
use crate::cli::Format;
use crate::exit::Failure;
use crate::out;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A file that a report can be written to; found to be possible before the run starts.
#[derive(Debug)]
pub struct ReportFile {
    /// As the user named it.
    named: PathBuf,
    /// What is written; a link is followed.
    target: PathBuf,
    /// A pipe or a device is written to as it is; a file is replaced.
    replace: bool,
}

impl ReportFile {
    /// Checks that a report can be written there. Leaves nothing behind.
    ///
    /// # Errors
    /// With exit code 3, when the directory does not exist or is not writable, or a directory is in the way.
    pub fn prepare(named: &Path) -> Result<ReportFile, Failure> {
        let target = fs::canonicalize(named).unwrap_or_else(|_| named.to_path_buf());
        let kind = match fs::metadata(&target) {
            Ok(meta) => Some(meta.file_type()),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(failure(named, error).hint("give --report another file")),
        };
        if kind.is_some_and(|kind| kind.is_dir()) {
            return Err(failure(named, "it is a directory").hint("name a file in it, as in `--report out.json`"));
        }
        let replace = kind.is_none_or(|kind| kind.is_file());
        let report = ReportFile { named: named.to_path_buf(), target, replace };
        if replace {
            let (probe, path) = report.open_beside()?;
            drop(probe);
            let _ = fs::remove_file(path);
        }
        Ok(report)
    }

    /// Writes the report: to a file beside it, which then takes its name.
    ///
    /// # Errors
    /// With exit code 3, when it cannot be written; what was there before stays.
    pub fn write(&self, report: &Report) -> Result<(), Failure> {
        let mut text = serde_json::to_string_pretty(report).expect("reports have string keys only");
        text.push('\n');
        if !self.replace {
            let written =
                OpenOptions::new().write(true).open(&self.target).and_then(|mut f| f.write_all(text.as_bytes()));
            return written.map_err(|error| self.failure(&error));
        }
        let (mut file, path) = self.open_beside()?;
        let written = (file.write_all(text.as_bytes()))
            .and_then(|()| file.sync_all())
            .and_then(|()| fs::rename(&path, &self.target));
        written.map_err(|error| {
            let _ = fs::remove_file(&path);
            self.failure(&error)
        })
    }

    fn open_beside(&self) -> Result<(File, PathBuf), Failure> {
        let name = self.target.file_name().unwrap_or_default().to_string_lossy();
        // Names have a limit of their own; a name that is just short enough must not fail for our sake.
        let short: String = name.chars().take(40).collect();
        let path = self.target.with_file_name(format!(".{short}.{}.tmp", std::process::id()));
        match OpenOptions::new().write(true).create(true).truncate(true).open(&path) {
            Ok(file) => Ok((file, path)),
            Err(error) => Err(self.failure(&error)),
        }
    }

    fn failure(&self, error: &io::Error) -> Failure {
        let folder = self.target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if !folder.is_dir() {
            let folder = folder.display();
            return failure(&self.named, format!("there is no directory `{folder}`"))
                .hint(format!("mkdir -p {folder}"));
        }
        let cause = error.to_string();
        failure(&self.named, cause).hint("give --report a file in a directory that you may write to")
    }
}

fn failure(file: &Path, cause: impl std::fmt::Display) -> Failure {
    Failure::environment(format!("report `{}`: cannot write: {cause}", file.display()))
}

/// Prints the report on standard output: for people, or the JSON and nothing else.
///
/// # Errors
/// When standard output cannot be written, other than by the reader's going away.
pub fn print(report: &Report, format: Format) -> Result<(), Failure> {
    match format {
        Format::Json => out::json(report),
        Format::Text => {
            let style = text::Style { width: out::stdout_width(), color: out::stdout_colored() };
            out::data(&text::render(report, style))
        }
    }
}
