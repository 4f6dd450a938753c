//! Files that a verb leaves for people: whole or not at all, and refused before the work if they cannot be written.

use crate::exit::Failure;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A file that can be written; found to be possible before there is anything to write.
#[derive(Debug)]
pub struct OutFile {
    /// What it is to hold, in messages.
    what: &'static str,
    /// The option that names it.
    option: &'static str,
    /// As the user named it.
    named: PathBuf,
    /// What is written; a link is followed.
    target: PathBuf,
    /// A pipe or a device is written to as it is; a file is replaced.
    replace: bool,
}

impl OutFile {
    /// Checks that `what`, whose place was given with `option`, can be written there. Leaves nothing behind.
    ///
    /// # Errors
    /// With exit code 3, when the directory does not exist or is not writable, or a directory is in the way.
    pub fn prepare(what: &'static str, option: &'static str, named: &Path) -> Result<OutFile, Failure> {
        let target = fs::canonicalize(named).unwrap_or_else(|_| named.to_path_buf());
        let mut file = OutFile { what, option, named: named.to_path_buf(), target, replace: true };
        let kind = match fs::metadata(&file.target) {
            Ok(meta) => Some(meta.file_type()),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(file.refused(error).hint(format!("give {option} another file"))),
        };
        if kind.is_some_and(|kind| kind.is_dir()) {
            let refused = file.refused("it is a directory");
            return Err(refused.hint(format!("name a file in it, as in `{option} {}`", file.example())));
        }
        file.replace = kind.is_none_or(|kind| kind.is_file());
        if file.replace {
            let (probe, path) = file.open_beside()?;
            drop(probe);
            let _ = fs::remove_file(path);
        }
        Ok(file)
    }

    /// The path of a file that somebody else writes and renames to its place.
    ///
    /// # Errors
    /// With exit code 3, when a pipe or a device stands there.
    pub fn into_path(self) -> Result<PathBuf, Failure> {
        if !self.replace {
            let refused = self.refused("it is not a file");
            return Err(refused.hint(format!("a {} is a file, as in `{} {}`", self.what, self.option, self.example())));
        }
        std::path::absolute(&self.target).map_err(|error| self.refused(error).hint("name it by its full path"))
    }

    /// Writes the content: to a file beside it, which then takes its name.
    ///
    /// # Errors
    /// With exit code 3, when it cannot be written; what was there before stays.
    pub fn write(&self, content: &[u8]) -> Result<(), Failure> {
        if !self.replace {
            let written = OpenOptions::new().write(true).open(&self.target).and_then(|mut f| f.write_all(content));
            return written.map_err(|error| self.failure(&error));
        }
        let (mut file, path) = self.open_beside()?;
        let written =
            (file.write_all(content)).and_then(|()| file.sync_all()).and_then(|()| fs::rename(&path, &self.target));
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

    /// Why it cannot be written after all.
    pub fn failure(&self, error: &io::Error) -> Failure {
        let folder = self.target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if !folder.is_dir() {
            let folder = folder.display();
            return self.refused(format!("there is no directory `{folder}`")).hint(format!("mkdir -p {folder}"));
        }
        self.refused(error).hint(format!("give {} a file in a directory that you may write to", self.option))
    }

    fn refused(&self, cause: impl std::fmt::Display) -> Failure {
        Failure::environment(format!("{} `{}`: cannot write: {cause}", self.what, self.named.display()))
    }

    fn example(&self) -> &'static str {
        match self.what {
            "record" => "out.rec",
            "picture" => "out.svg",
            _ => "out.json",
        }
    }
}
