//! Where a scenario comes from: a file, or the catalog that ships with shoal.

use crate::exit::{Failure, USAGE};
use crate::file::STANDARD;
use model::{Problem, Scenario};
use scenarios::{NamedIn, Overrides, Problems};
use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// No scenario is larger: there is room for the largest fleet with all its waypoints. A device or a wrong file must not
/// fill the memory, and checking a hostile one takes up to a hundred and fifty times its size.
const BYTES_MAX: u64 = 1 << 20;

/// Reads and validates a scenario.
///
/// # Errors
/// Exit code 2: there is no such scenario, or it has problems; all of them.
pub fn load(name: &OsStr, overrides: &Overrides) -> Result<Scenario, Failure> {
    load_beside(name, overrides, None)
}

/// The same with another folder for the files that the scenario names.
///
/// # Errors
/// As [`load`].
pub fn load_beside(name: &OsStr, overrides: &Overrides, beside: Option<&Path>) -> Result<Scenario, Failure> {
    let (shown, text) = read(name)?;
    let files = beside.map_or_else(|| Folder::of(name), |folder| Folder(folder.to_owned()));
    scenarios::parse_with_files(&shown, &text, overrides, &files).map_err(|problems| failure(&problems))
}

/// The files that a scenario names, beside its own.
#[derive(Clone, Debug)]
pub struct Folder(PathBuf);

impl Folder {
    /// Those of the scenario of this name.
    pub fn of(name: &OsStr) -> Folder {
        Folder(file_of(name).and_then(Path::parent).unwrap_or(Path::new("")).to_owned())
    }

    /// Where a file is that a scenario names.
    pub fn path_of(&self, path: &str, named_in: NamedIn) -> PathBuf {
        match named_in {
            NamedIn::Scenario => self.0.join(path),
            NamedIn::Option => PathBuf::from(path),
        }
    }
}

impl scenarios::Files for Folder {
    fn read(&self, path: &str, named_in: NamedIn, bytes_max: u64) -> Result<Vec<u8>, String> {
        let path = self.path_of(path, named_in);
        #[expect(clippy::disallowed_methods, reason = "the command line reads what the scenario names")]
        let file = File::open(&path);
        let bytes = file.and_then(|file| {
            // A device has no size, and is read up to the bound.
            if file.metadata()?.len() > bytes_max {
                return Err(ErrorKind::FileTooLarge.into());
            }
            read_bounded(file, bytes_max)
        });
        bytes.map_err(|error| match error.kind() {
            ErrorKind::NotFound => format!("file not found (`{}`)", path.display()),
            ErrorKind::IsADirectory => "it is a directory".to_owned(),
            ErrorKind::FileTooLarge => format!("it is larger than {} KiB", bytes_max >> 10),
            ErrorKind::PermissionDenied => "it may not be read".to_owned(),
            _ => error.to_string(),
        })
    }
}

/// The file that a name means: one with a `/`, one that ends in `.toml`, or one that exists. Any other name is looked up
/// in the catalog, and `-` is standard input.
pub fn file_of(name: &OsStr) -> Option<&Path> {
    let (path, bytes) = (Path::new(name), name.as_encoded_bytes());
    let is_file = bytes.contains(&b'/') || bytes.ends_with(b".toml") || path.is_file();
    (is_file && path != Path::new(STANDARD)).then_some(path)
}

/// The text of a scenario, and the name to call it by.
///
/// # Errors
/// Exit code 2: it is not there, or cannot be read.
pub fn read(name: &OsStr) -> Result<(String, String), Failure> {
    let path = file_of(name);
    let standard = name == OsStr::new(STANDARD);
    let shown = if standard { "stdin".to_owned() } else { name.to_string_lossy().into_owned() };
    if path.is_none() && !standard {
        return match scenarios::find_catalog(&shown) {
            Ok(entry) => Ok((entry.name.to_owned(), entry.text.to_owned())),
            Err(unknown) => Err(Failure::usage(unknown.to_string())
                .hint(unknown.hint())
                .hint("a file is named with its path, as in `./my.toml`")),
        };
    }
    let bytes = match path {
        #[expect(clippy::disallowed_methods, reason = "the command line reads the scenario")]
        Some(path) => File::open(path).and_then(|file| read_bounded(file, BYTES_MAX)),
        None => read_bounded(io::stdin().lock(), BYTES_MAX),
    };
    let bytes = bytes.map_err(|error| {
        let (cause, hint) = match error.kind() {
            ErrorKind::NotFound => ("file not found".to_owned(), "`shoal validate` lists the catalog"),
            ErrorKind::IsADirectory => ("it is a directory".to_owned(), "name a file in it"),
            ErrorKind::FileTooLarge => (format!("it is larger than {} MiB", BYTES_MAX >> 20), "is it a scenario?"),
            ErrorKind::PermissionDenied => ("it may not be read".to_owned(), "check its permissions"),
            _ => (error.to_string(), "can the file be read with other tools?"),
        };
        Failure::usage(format!("scenario `{shown}`: {cause}")).hint(hint)
    })?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        Failure::usage(format!("scenario `{shown}`: byte {at} is not UTF-8")).hint("a scenario is a TOML text")
    })?;
    Ok((shown, text))
}

fn read_bounded(from: impl Read, bytes_max: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    from.take(bytes_max + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > bytes_max { Err(ErrorKind::FileTooLarge.into()) } else { Ok(bytes) }
}

/// All problems of a scenario as one failure.
pub fn failure(problems: &Problems) -> Failure {
    Failure::from_text(USAGE, &problems.to_string())
}

/// The warnings of a scenario as text: one line each, followed by its hint unless the same hint stands above already; no
/// newline at the end.
pub fn warnings(shown: &str, warnings: &[Problem], color: bool) -> String {
    let (yellow, cyan, plain) = if color { ("\x1b[1;33m", "\x1b[1;36m", "\x1b[0m") } else { ("", "", "") };
    let mut lines: Vec<String> = Vec::new();
    for warning in warnings {
        lines.push(format!("{yellow}warning:{plain} scenario `{shown}`: {warning}"));
        let hint = warning.hint.as_ref().map(|hint| format!("{cyan}hint:{plain} {hint}"));
        lines.extend(hint.filter(|hint| !lines.contains(hint)));
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_read_names_the_file_the_cause_and_the_way_out() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            #[expect(clippy::disallowed_methods, reason = "a test of files")]
            std::fs::write(&path, bytes).unwrap();
            path.into_os_string()
        };
        let check = |name: &OsStr, cause: &str| {
            let failure = load(name, &Overrides::default()).unwrap_err();
            let text = failure.to_string();
            assert_eq!(failure.code, USAGE, "{text}");
            assert!(text.contains(cause), "{cause}: {text}");
            assert!(text.starts_with("error: ") && text.contains("\nhint: "), "{text}");
        };
        check(OsStr::new("no/such.toml"), "scenario `no/such.toml`: file not found");
        check(OsStr::new("such.toml"), "scenario `such.toml`: file not found");
        check(folder.path().as_os_str(), "it is a directory");
        check(OsStr::new("/dev/zero"), "it is larger than 1 MiB");
        check(&file("bytes.toml", b"name = \"\xff\""), "byte 8 is not UTF-8");
        check(&file("empty.toml", b""), "empty.toml`: ");
        check(OsStr::new("demo-16"), "unknown scenario `demo-16`");
        check(OsStr::new(""), "unknown scenario ``");
    }

    #[test]
    fn the_catalog_is_there_without_a_file() {
        assert_eq!(load(OsStr::new("demo-15"), &Overrides::default()).unwrap().name, "demo-15");
    }
}
