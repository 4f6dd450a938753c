//! The one error: something about this machine's shared memory, its limits, or another process of the fleet.

use crate::descriptors;
use std::path::Path;

/// An operation on something shared that the machine, or another process of the fleet, did not let happen.
///
/// The `Display` form names the object and the cause; [`BusError::hint`] names the way out. All of these are errors of
/// the environment (exit code 3), never of a scenario.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{object}: cannot {action}: {cause}")]
pub struct BusError {
    object: String,
    action: &'static str,
    cause: String,
    hint: String,
    missing: bool,
    exhausted: bool,
}

impl BusError {
    /// An error about `object`, with the way out.
    pub(crate) fn new(
        object: impl Into<String>,
        action: &'static str,
        cause: impl Into<String>,
        hint: impl Into<String>,
    ) -> BusError {
        BusError {
            object: object.into(),
            action,
            cause: cause.into(),
            hint: hint.into(),
            missing: false,
            exhausted: false,
        }
    }

    /// An error of a system call on a file.
    pub(crate) fn io(path: &Path, action: &'static str, cause: impl Into<std::io::Error>) -> BusError {
        let cause = cause.into();
        let hint = match cause.raw_os_error().map(rustix::io::Errno::from_raw_os_error) {
            Some(rustix::io::Errno::NOENT) => "the fleet may have ended: see `shoal ps`",
            Some(rustix::io::Errno::NOSPC | rustix::io::Errno::DQUOT) => {
                "shared memory is full: `shoal clean` removes what dead fleets left, or enlarge /dev/shm"
            }
            Some(rustix::io::Errno::FBIG) => "raise the limit on the size of files (`ulimit -f`)",
            Some(rustix::io::Errno::MFILE | rustix::io::Errno::NFILE) => "raise the limit on open files (`ulimit -n`)",
            Some(rustix::io::Errno::ACCESS | rustix::io::Errno::PERM | rustix::io::Errno::ROFS) => {
                "shared memory must be writable for this user: see `shoal doctor`"
            }
            _ => "see `shoal doctor`",
        };
        let missing = cause.kind() == std::io::ErrorKind::NotFound;
        BusError {
            object: format!("`{}`", path.display()),
            action,
            cause: cause.to_string(),
            hint: hint.into(),
            missing,
            exhausted: false,
        }
    }

    /// An error that iceoryx2 gave for a port or a service. Its errors are enums whose names say what is wrong.
    pub(crate) fn port(object: impl Into<String>, action: &'static str, cause: impl std::fmt::Debug) -> BusError {
        let cause = format!("{cause:?}");
        // iceoryx2 has a dozen names for this, and some of them say that the object does not exist.
        if let Some(errno) = descriptors::exhausted() {
            return BusError {
                object: object.into(),
                action,
                cause: std::io::Error::from(errno).to_string(),
                hint: "raise the limit on open files (`ulimit -n`, `ulimit -Hn`); `shoal doctor` says what it allows"
                    .into(),
                missing: false,
                exhausted: true,
            };
        }
        let hint = if cause.contains("ExceedsMax") || cause.contains("DoesNotSupportRequestedAmount") {
            "the fleet was made for fewer participants: dead ones are cleared by the daemon's janitor, or start it larger"
        } else if cause.contains("DoesNotExist") {
            "its owner has not made it yet, or has ended: see `shoal ps`"
        } else if cause.contains("VersionMismatch") || cause.contains("Incompatible") {
            "all processes of a fleet must come from the same build"
        } else if cause.contains("Permission") {
            "a fleet belongs to the user who started it"
        } else {
            "shared memory or open files may have run out: see `shoal doctor`, `ulimit -n` and `df /dev/shm`"
        };
        let missing = cause.contains("DoesNotExist") || cause.contains("IsMarkedForDestruction");
        BusError { object: object.into(), action, cause, hint: hint.into(), missing, exhausted: false }
    }

    /// The fleet has ended.
    pub(crate) fn gone(root: &Path) -> BusError {
        BusError::io(root, "join the fleet", rustix::io::Errno::NOENT)
    }

    /// The way out.
    pub fn hint(&self) -> Option<&str> {
        (!self.hint.is_empty()).then_some(self.hint.as_str())
    }

    /// The object is not there (not yet, or no more), as opposed to there and unusable.
    pub fn is_missing(&self) -> bool {
        self.missing
    }

    /// Whether another attempt may go better: something is there, and nothing has run out. So it is while its owner makes
    /// it, or somebody clears it away.
    pub(crate) fn may_pass(&self) -> bool {
        !self.missing && !self.exhausted
    }
}
