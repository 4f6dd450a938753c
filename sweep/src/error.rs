//! Why a sweep cannot be done: what is wrong, and the way out.

/// An error of a sweep.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct Error {
    /// Who can do something about it.
    pub kind: ErrorKind,
    /// Lowercase: the object, then the cause.
    pub message: String,
    /// The ways out, each a line of its own.
    pub hints: Vec<String>,
}

/// The kinds of errors, as exit codes tell them apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// What was asked for is wrong.
    Usage,
    /// The environment does not allow it.
    Environment,
}

impl Error {
    /// What was asked for is wrong.
    pub fn usage(message: impl Into<String>) -> Error {
        Error { kind: ErrorKind::Usage, message: message.into(), hints: Vec::new() }
    }

    /// The environment does not allow it.
    pub fn environment(message: impl Into<String>) -> Error {
        Error { kind: ErrorKind::Environment, message: message.into(), hints: Vec::new() }
    }

    /// Adds a way out.
    pub fn hint(mut self, hint: impl Into<String>) -> Error {
        self.hints.push(hint.into());
        self
    }
}
