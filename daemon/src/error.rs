//! Why a fleet could not be run, or what went wrong around one that ran.

use bus::BusError;

/// What an [`Error`] is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A second signal asked for the end: nothing is wrong.
    Interrupted,
    /// Open files, processes or memory: the limits leave less than the fleet needs.
    Limits,
    /// The kernel refuses a processor or a scheduling class.
    Scheduling,
    /// The executable that a robot names as its agent.
    Agent,
    /// A process cannot be started, or handlers of signals not installed.
    Process,
    /// Shared memory, or a file of the run in it.
    Memory,
    /// The gate was stopped by something else than the fleet.
    Gate,
    /// What the processes counted is missing.
    Statistics,
    /// The state directory of a fleet that is left running: its lock, its database, its log.
    State,
    /// The world ended without an outcome.
    World,
}

/// An error of the daemon. Its text is one lowercase line: the object first, then the cause.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct Error {
    /// What it is about.
    pub kind: Kind,
    /// The object and the cause.
    pub message: String,
    /// What else is known of it, a line each.
    pub details: Vec<String>,
    /// The ways out.
    pub hints: Vec<String>,
    /// What had gone wrong before.
    pub before: Vec<Error>,
}

impl Error {
    /// An error of this kind.
    pub fn new(kind: Kind, message: impl Into<String>) -> Error {
        let (details, hints, before) = (Vec::new(), Vec::new(), Vec::new());
        Error { kind, message: message.into(), details, hints, before }
    }

    /// Adds what else is known.
    #[must_use]
    pub fn detail(mut self, detail: impl Into<String>) -> Error {
        self.details.push(detail.into());
        self
    }

    /// Adds a way out.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Error {
        self.hints.push(hint.into());
        self
    }
}

impl From<BusError> for Error {
    fn from(error: BusError) -> Error {
        let hints = error.hint().map(str::to_owned).into_iter().collect();
        Error { hints, ..Error::new(Kind::Memory, error.to_string()) }
    }
}
