//! The directory of a fleet that is left running: `$XDG_STATE_HOME/shoal/NAME`, for its owner only.

use crate::error::{Error, Kind};
use rustix::fs::{FlockOperation, Mode, OFlags, flock, open};
use rustix::io::Errno;
use std::ffi::OsString;
use std::io::{self, ErrorKind};
use std::os::fd::OwnedFd;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

/// Held by the daemon for as long as it lives.
const LOCK: &str = "lock";
/// Names of fleets have no more characters.
const NAME_MAX: usize = 64;

/// The directory, which no other process has while this lives.
#[derive(Debug)]
pub struct StateDir {
    path: PathBuf,
    _lock: OwnedFd,
}

impl StateDir {
    /// Takes the directory, and makes it if it is not there.
    ///
    /// # Errors
    /// When it cannot be made, belongs to another user or is open to others, or when another daemon has it.
    pub fn take(path: &Path) -> Result<StateDir, Error> {
        make(path)?;
        let lock = path.join(LOCK);
        let flags = OFlags::RDWR | OFlags::CREATE | OFlags::CLOEXEC | OFlags::NOFOLLOW;
        let failed = |errno: Errno| failure(&lock, "cannot be opened", &errno.into());
        let file = open(&lock, flags, Mode::RUSR | Mode::WUSR).map_err(failed)?;
        match flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => {
                // Absolute: its readers may be in other directories.
                let path = std::fs::canonicalize(path).map_err(|error| failure(path, "cannot be opened", &error))?;
                Ok(StateDir { path, _lock: file })
            }
            Err(Errno::WOULDBLOCK) => Err(Error::new(
                Kind::State,
                format!("state directory `{}`: another daemon runs a fleet with it", path.display()),
            )
            .hint("`shoal ps` lists the fleets that run; another one needs another `--name` or `--state`")),
            Err(errno) => Err(failed(errno)),
        }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

fn make(path: &Path) -> Result<(), Error> {
    match std::fs::DirBuilder::new().recursive(true).mode(0o700).create(path) {
        Err(error) if error.kind() != ErrorKind::AlreadyExists => return Err(failure(path, "cannot be made", &error)),
        _ => {}
    }
    let meta = std::fs::symlink_metadata(path).map_err(|error| failure(path, "cannot be opened", &error))?;
    let problem = match meta.mode() & 0o077 {
        _ if !meta.is_dir() => "it is not a directory",
        _ if meta.uid() != rustix::process::geteuid().as_raw() => "it belongs to another user",
        0 => return Ok(()),
        _ => "others may read it",
    };
    let hint = match problem {
        "others may read it" => format!("`chmod 700 {}`, or choose another one with `--state DIR`", path.display()),
        _ => "choose another one with `--state DIR`".to_owned(),
    };
    Err(Error::new(Kind::State, format!("state directory `{}`: {problem}", path.display())).hint(hint))
}

fn failure(path: &Path, what: &str, error: &io::Error) -> Error {
    Error::new(Kind::State, format!("state directory: `{}` {what}: {error}", path.display()))
        .hint("choose another one with `--state DIR`")
}

/// Where the directory of a fleet is, if nothing else is said; `var` gives variables of the environment.
///
/// # Errors
/// When neither variable is there.
pub fn default_state(name: &str, var: &dyn Fn(&str) -> Option<OsString>) -> Result<PathBuf, Error> {
    let absolute = |name: &str| var(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let home = || absolute("HOME").map(|home| home.join(".local/state"));
    let Some(base) = absolute("XDG_STATE_HOME").or_else(home) else {
        return Err(Error::new(
            Kind::State,
            "state directory: neither XDG_STATE_HOME nor HOME is set to an absolute path",
        )
        .hint("name it with `--state DIR`"));
    };
    Ok(base.join("shoal").join(name))
}

/// What is wrong with the name of a fleet, if anything is. Names become parts of paths.
///
/// # Errors
/// What is wrong with it.
pub fn check_name(name: &str) -> Result<(), String> {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_".contains(&byte);
    match name.as_bytes() {
        [] => Err("it is empty".to_owned()),
        bytes if bytes.len() > NAME_MAX => Err(format!("it is longer than {NAME_MAX} characters")),
        bytes if !bytes.iter().copied().all(is_plain) => {
            Err("only letters, digits, `-` and `_` are allowed".to_owned())
        }
        [b'-', ..] => Err("it begins with `-`".to_owned()),
        _ => Ok(()),
    }
}

#[cfg(test)]
#[expect(clippy::disallowed_methods, reason = "tests look at files")]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn a_directory_has_one_daemon() {
        let base = tempfile::tempdir().unwrap();
        let path = base.path().join("a/b");
        let taken = StateDir::take(&path).unwrap();
        assert_eq!(std::fs::metadata(&path).unwrap().mode() & 0o777, 0o700);
        let error = StateDir::take(&path).unwrap_err();
        assert!(error.message.contains("another daemon") && error.message.contains("a/b"), "{error}");
        assert!(taken.path().is_absolute());
        drop(taken);
        StateDir::take(&path).unwrap();
        std::fs::set_permissions(&path, PermissionsExt::from_mode(0o750)).unwrap();
        let error = StateDir::take(&path).unwrap_err();
        assert!(error.message.contains("others may read it") && error.hints[0].contains("chmod 700"), "{error:?}");
        std::fs::write(base.path().join("file"), "").unwrap();
        let error = StateDir::take(&base.path().join("file")).unwrap_err();
        assert!(error.message.contains("not a directory"), "{error}");
        let error = StateDir::take(&base.path().join("file/below")).unwrap_err();
        assert!(error.message.contains("cannot be made"), "{error}");
    }

    #[test]
    fn the_usual_place_is_that_of_the_desktop() {
        let with = |xdg: Option<&str>, home: Option<&str>| {
            let of = |name: &str| if name == "HOME" { home } else { xdg };
            default_state("lab", &|name| of(name).map(OsString::from))
        };
        assert_eq!(with(Some("/x"), Some("/h")).unwrap(), Path::new("/x/shoal/lab"));
        assert_eq!(with(None, Some("/h")).unwrap(), Path::new("/h/.local/state/shoal/lab"));
        assert_eq!(with(Some("relative"), Some("/h")).unwrap(), Path::new("/h/.local/state/shoal/lab"));
        assert!(with(None, None).unwrap_err().hints[0].contains("--state"));
    }

    #[test]
    fn names_stay_within_their_directory() {
        for name in ["lab", "demo-15", "a_B-9"] {
            assert_eq!(check_name(name), Ok(()));
        }
        for name in ["", "..", ".", "a/b", "../x", "a b", "-x", "a\n", "ä", &"x".repeat(65)] {
            assert!(check_name(name).is_err(), "{name:?}");
        }
    }
}
