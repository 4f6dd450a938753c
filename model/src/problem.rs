//! What is wrong or questionable in a scenario.

use serde::{Deserialize, Serialize};
use std::fmt;

/// One thing that is wrong, or questionable, and the way out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Problem {
    /// Line of the file, counted from 1, if a line is to blame.
    pub line: Option<usize>,
    /// Option of the command line, if one is to blame.
    pub option: Option<String>,
    /// The key, as in `robot[3].planner`; empty for the whole file.
    pub key: String,
    /// What is wrong.
    pub message: String,
    /// The way out, if it is not plain from the message.
    pub hint: Option<String>,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(line) = self.line {
            write!(f, "line {line}: ")?;
        }
        if let Some(option) = &self.option {
            write!(f, "{option}: ")?;
        }
        if !self.key.is_empty() {
            write!(f, "{}: ", self.key)?;
        }
        f.write_str(&self.message)
    }
}
