//! The executable in a directory of its own.

use shoal_tests::process::{Ended, Run};
use std::path::Path;
use tempfile::TempDir;

pub(crate) const SHOAL: &str = env!("CARGO_BIN_EXE_shoal");

/// A directory for scenarios; names in it are short, and the same in every run.
pub(crate) struct Here(TempDir);

impl Here {
    pub(crate) fn new() -> Here {
        Here(tempfile::tempdir().expect("a temporary directory"))
    }

    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }

    /// Writes a file.
    pub(crate) fn file(&self, name: &str, content: impl AsRef<[u8]>) -> &Here {
        std::fs::write(self.path().join(name), content).expect("it can be written");
        self
    }

    /// `shoal` with these words, in this directory, not started yet.
    pub(crate) fn run(&self, line: &str) -> Run {
        Run::new(SHOAL).words(line).within(self.path())
    }

    /// Runs `shoal` with these words to its end.
    pub(crate) fn shoal(&self, line: &str) -> Ended {
        let ended = self.run(line).end();
        assert!(!ended.stderr.contains("panicked"), "{ended}");
        ended
    }
}

/// Runs `shoal` with these words, anywhere.
pub(crate) fn shoal(line: &str) -> Ended {
    Here::new().shoal(line)
}
