//! Files that a verb leaves for people: whole or not at all, and refused before the work if they cannot be written, or
//! would replace what the same command reads or writes.

use crate::exit::Failure;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::os::fd::AsFd;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use world_sim::whole_file::WholeFile;

/// How the command line names standard input or output where a file is expected.
pub const STANDARD: &str = "-";
/// More links from one name to the next are a circle.
const LINKS_MAX: usize = 40;

/// The files of one command. None of its outputs is a file that it reads, and no two of them are one file.
pub struct Files(Vec<(Identity, String)>);

/// What tells files apart, whatever they are called.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Identity {
    /// Device and number of a file that exists.
    Existing(u64, u64),
    /// Device and number of the directory, and the name that the file will have there.
    New(u64, u64, std::ffi::OsString),
}

impl Identity {
    /// `None` for what cannot be told, and for pipes and devices: they lose nothing when they are written to twice.
    fn of(target: &Path) -> Option<Identity> {
        match fs::metadata(target) {
            Ok(meta) => meta.is_file().then(|| Identity::Existing(meta.dev(), meta.ino())),
            Err(_) => {
                let folder = fs::metadata(folder_of(target)).ok()?;
                Some(Identity::New(folder.dev(), folder.ino(), target.file_name()?.to_owned()))
            }
        }
    }
}

impl Default for Files {
    fn default() -> Files {
        Files::new()
    }
}

impl Files {
    /// The files of a command that has named none yet: its executable, and what its standard output was redirected to.
    pub fn new() -> Files {
        let mut files = Files(Vec::new());
        files.read("the executable of shoal", Path::new("/proc/self/exe"));
        if let Ok(stat) = rustix::fs::fstat(io::stdout().as_fd())
            && rustix::fs::FileType::from_raw_mode(stat.st_mode).is_file()
        {
            files.0.push((Identity::Existing(stat.st_dev, stat.st_ino), "standard output".to_owned()));
        }
        files
    }

    /// Notes a file that the command reads. `what` names it in messages.
    pub fn read(&mut self, what: impl Into<String>, path: &Path) {
        if let Some(identity) = Identity::of(path) {
            self.0.push((identity, what.into()));
        }
    }

    /// Checks that `what`, whose place was given with `option`, can be written there. Leaves nothing behind.
    ///
    /// # Errors
    /// With exit code 2, when the command reads this file, or writes something else to it. With exit code 3, when the
    /// directory does not exist or is not writable, or a directory is in the way.
    pub fn write(&mut self, what: &'static str, option: &'static str, named: &Path) -> Result<OutFile, Failure> {
        let file = OutFile::prepare(what, option, named)?;
        if let Some(identity) = Identity::of(&file.target) {
            if let Some((_, other)) = self.0.iter().find(|(known, _)| *known == identity) {
                let message = format!("{what} `{}`: this file is {other} as well", named.display());
                return Err(Failure::usage(message).hint(format!("give {option} another file")));
            }
            self.0.push((identity, format!("the {what}")));
        }
        Ok(file)
    }
}

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
    fn prepare(what: &'static str, option: &'static str, named: &Path) -> Result<OutFile, Failure> {
        let mut file = OutFile { what, option, named: named.to_path_buf(), target: target_of(named), replace: true };
        if named == Path::new(STANDARD) {
            let message = format!("{what} `-`: it cannot go to standard output");
            return Err(Failure::usage(message)
                .hint(format!("name a file, as in `{option} {}`; a file called `-` is `./-`", file.example())));
        }
        if what == "picture" && named.extension().is_some_and(|ending| !ending.eq_ignore_ascii_case("svg")) {
            let svg = named.with_extension("svg");
            return Err(Failure::usage(format!("picture `{}`: shoal draws SVG", named.display()))
                .hint(format!("`{option} {}`; `rsvg-convert` and browsers make a PNG of it", svg.display())));
        }
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
            // The attempt leaves nothing.
            WholeFile::begin(&file.target).map_err(|error| file.failure(&error))?;
        }
        Ok(file)
    }

    /// The path of a file that another process writes.
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

    /// Writes the content, whole or not at all.
    ///
    /// # Errors
    /// With exit code 3, when it cannot be written; what was there before stays.
    pub fn write(&self, content: &[u8]) -> Result<(), Failure> {
        let written = if self.replace {
            WholeFile::begin(&self.target).and_then(|mut file| file.write_all(content).and_then(|()| file.finish()))
        } else {
            OpenOptions::new().write(true).open(&self.target).and_then(|mut file| file.write_all(content))
        };
        written.map_err(|error| self.failure(&error))
    }

    /// Writes content that comes piece by piece, whole or not at all.
    ///
    /// # Errors
    /// With exit code 3, when it cannot be written; what was there before stays.
    pub fn stream(&self, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Failure> {
        let written = if self.replace {
            WholeFile::begin(&self.target).and_then(|mut file| write(&mut file).and_then(|()| file.finish()))
        } else {
            OpenOptions::new().write(true).open(&self.target).and_then(|mut file| write(&mut file))
        };
        written.map_err(|error| self.failure(&error))
    }

    /// Why it cannot be written after all.
    fn failure(&self, error: &io::Error) -> Failure {
        let folder = folder_of(&self.target);
        if !folder.is_dir() {
            let folder = folder.display();
            return self.refused(format!("directory `{folder}` does not exist")).hint(format!("mkdir -p {folder}"));
        }
        let hint = match error.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "make room, or give {} a file on another disk",
            _ => "give {} a file in a directory that you may write to",
        };
        self.refused(error).hint(hint.replace("{}", self.option))
    }

    fn refused(&self, cause: impl std::fmt::Display) -> Failure {
        Failure::environment(format!("{} `{}`: cannot write: {cause}", self.what, self.named.display()))
    }

    fn example(&self) -> &'static str {
        match self.what {
            "record" | "export" => "out.mcap",
            "picture" => "out.svg",
            _ => "out.json",
        }
    }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Where a name leads to: links are followed, those to a file that does not exist yet as well.
fn target_of(named: &Path) -> PathBuf {
    let mut target = named.to_path_buf();
    for _ in 0..LINKS_MAX {
        let Ok(next) = fs::read_link(&target) else { break };
        // Links of /proc/self/fd name pipes that have no path.
        let next = folder_of(&target).join(next);
        if fs::symlink_metadata(&next).is_err() && fs::metadata(&target).is_ok() {
            break;
        }
        target = next;
    }
    target
}

#[cfg(test)]
mod tests {
    #![expect(clippy::disallowed_methods, reason = "tests of files")]
    use super::*;
    use crate::exit;
    use std::os::unix::fs::symlink;

    /// In a directory with `scenario.toml`, `record.mcap` and links of all kinds to them.
    fn check(read: &[&str], written: &[&str], refused: Option<&str>) {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("sub")).unwrap();
        fs::write(at("scenario.toml"), "the scenario").unwrap();
        fs::hard_link(at("scenario.toml"), at("sub/hard")).unwrap();
        symlink("../scenario.toml", at("sub/soft")).unwrap();
        symlink("new", at("to-new")).unwrap();
        symlink("sub", at("other-sub")).unwrap();
        let mut files = Files::new();
        read.iter().for_each(|name| files.read("the scenario", &at(name)));
        let mut last = Ok(());
        for name in written {
            last = files.write("report", "--report", &at(name)).map(drop);
        }
        match (last, refused) {
            (Ok(()), None) => {}
            (Err(failure), Some(words)) => {
                let text = failure.to_string();
                assert!(text.contains(words) && text.contains("hint: give --report another file"), "{text}");
                assert_eq!(failure.code, exit::USAGE, "{text}");
            }
            (last, _) => panic!("{read:?} {written:?}: {last:?}"),
        }
        assert_eq!(fs::read_to_string(at("scenario.toml")).unwrap(), "the scenario");
        assert!(!at("new").exists() && fs::symlink_metadata(at("to-new")).is_ok(), "a check makes nothing");
    }

    #[test]
    fn no_output_is_an_input_or_another_output_whatever_the_names() {
        for name in ["scenario.toml", "sub/../scenario.toml", "sub/hard", "sub/soft"] {
            check(&["scenario.toml"], &[name], Some("is the scenario as well"));
            check(&[], &["scenario.toml", name], Some("is the report as well"));
        }
        for name in ["new", "sub/../new", "to-new"] {
            check(&["scenario.toml"], &["new", name], Some("is the report as well"));
        }
        check(&[], &["sub/new", "other-sub/new"], Some("is the report as well"));
        check(&["scenario.toml"], &["new", "sub/new"], None);
        check(&["scenario.toml", "no-such-file"], &["scenario.tom"], None);
        let mut files = Files::new();
        for _ in 0..2 {
            files.write("report", "--report", Path::new("/dev/null")).unwrap();
        }
        let failure = files.write("report", "--report", Path::new("/proc/self/exe")).unwrap_err();
        assert!(failure.to_string().contains("the executable of shoal"), "{failure}");
    }

    #[test]
    fn a_link_to_a_file_stays_a_link() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        symlink("new", at("link")).unwrap();
        for content in ["first", "second"] {
            let file = Files::new().write("report", "--report", &at("link")).unwrap();
            file.write(content.as_bytes()).unwrap();
            assert_eq!(fs::read_to_string(at("new")).unwrap(), content);
        }
        assert!(fs::read_link(at("link")).is_ok());
        symlink("circle", at("circle")).unwrap();
        assert_eq!(Files::new().write("report", "--report", &at("circle")).unwrap_err().code, exit::ENVIRONMENT);
    }

    #[test]
    fn a_picture_is_called_svg() {
        let folder = tempfile::tempdir().unwrap();
        let prepare = |name: &str| Files::new().write("picture", "--out", &folder.path().join(name));
        for name in ["a.png", "a.mcap", "a.svg.gz"] {
            let failure = prepare(name).unwrap_err();
            assert!(failure.code == exit::USAGE && failure.to_string().contains(".svg`"), "{failure}");
        }
        for name in ["a.svg", "a.SVG", "a"] {
            assert!(prepare(name).is_ok(), "{name}");
        }
    }

    #[test]
    fn a_directory_that_is_removed_meanwhile_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sub/out.json");
        fs::create_dir(folder.path().join("sub")).unwrap();
        let file = Files::new().write("report", "--report", &path).unwrap();
        fs::remove_dir(folder.path().join("sub")).unwrap();
        let failure = file.write(b"{}").unwrap_err();
        assert!(failure.code == exit::ENVIRONMENT && failure.to_string().contains("does not exist"), "{failure}");
    }
}
