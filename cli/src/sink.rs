//! Where a report goes: a file, whole or not at all.

use crate::args::Format;
use crate::exit::Failure;
use crate::file::{Files, OutFile};
use crate::out;
use report::{Report, numbers, text};
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exit;
    use model::Mode;
    use report::{RunFacts, assemble};
    use scenarios::Overrides;

    /// A report without a run.
    fn report_of(mode: Mode) -> Report {
        let overrides = Overrides { mode: Some(mode), ..Overrides::default() };
        let scenario = crate::source::load("head-on".as_ref(), &overrides).unwrap();
        assemble(RunFacts::new(scenario, Default::default(), 1.0))
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_report_is_written_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.json");
        let file = ReportFile::prepare(&path, &mut Files::new()).unwrap();
        assert!(names(folder.path()).is_empty(), "checking leaves nothing behind");
        file.write(&report_of(Mode::Single)).unwrap();
        file.write(&report_of(Mode::Lockstep)).unwrap();
        assert_eq!(names(folder.path()), ["out.json"]);
        #[expect(clippy::disallowed_methods, reason = "a test of files")]
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(serde_json::from_str::<Report>(&text).unwrap().mode, Mode::Lockstep);
    }

    #[test]
    fn what_cannot_be_written_is_said_before_the_run() {
        let folder = tempfile::tempdir().unwrap();
        let check = |path: &Path, cause: &str| {
            let failure = ReportFile::prepare(path, &mut Files::new()).unwrap_err();
            assert_eq!(failure.code, exit::ENVIRONMENT);
            let text = failure.to_string();
            assert!(text.contains(cause) && text.contains("hint: "), "{text}");
        };
        check(folder.path(), "it is a directory");
        check(&folder.path().join("no/such/out.json"), "does not exist");
        check(&folder.path().join("x".repeat(300)), "name too long");
        check(Path::new("/proc/out.json"), "report `/proc/out.json`: cannot write");
    }

    #[test]
    fn a_device_is_written_to_and_not_replaced() {
        let file = ReportFile::prepare(Path::new("/dev/null"), &mut Files::new()).unwrap();
        file.write(&report_of(Mode::Single)).unwrap();
        assert!(!std::fs::metadata("/dev/null").unwrap().is_file());
    }
}
