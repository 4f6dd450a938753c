//! How the agent of a robot is started, if it is not shoal's own.

use crate::field::{Field, Typed};
use crate::kind::Kind;
use crate::value::Value;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Longest path, and longest word of a command, bytes.
pub const WORD_MAX: usize = 4096;
/// Maximum number of words of a command.
pub const WORDS_MAX: usize = 64;

/// The program that is started as the agent of a robot. shoal appends its own arguments: `--root` and what follows.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum AgentCommand {
    /// The path of an executable, relative to where shoal is started. PATH is not searched.
    Path(String),
    /// A program and its arguments, at least the program. A program without a `/` is looked up in PATH.
    Words(Vec<String>),
}

impl AgentCommand {
    /// The program, as it is named.
    pub fn program(&self) -> &str {
        match self {
            AgentCommand::Path(path) => path,
            AgentCommand::Words(words) => words.first().map_or("", String::as_str),
        }
    }

    /// Its own arguments.
    pub fn arguments(&self) -> &[String] {
        match self {
            AgentCommand::Path(_) => &[],
            AgentCommand::Words(words) => words.get(1..).unwrap_or_default(),
        }
    }

    /// Whether the program is looked up in PATH.
    pub fn searches_path(&self) -> bool {
        matches!(self, AgentCommand::Words(_)) && !self.program().contains('/')
    }
}

/// As a shell reads it.
impl fmt::Display for AgentCommand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = match self {
            AgentCommand::Path(path) => return f.write_str(path),
            AgentCommand::Words(words) => words,
        };
        let plain =
            |word: &str| !word.is_empty() && word.chars().all(|c| c.is_alphanumeric() || "-_./=:,+@%~".contains(c));
        for (index, word) in words.iter().enumerate() {
            let space = if index == 0 { "" } else { " " };
            match plain(word) {
                true => write!(f, "{space}{word}")?,
                false => write!(f, "{space}'{}'", word.replace('\'', r"'\''"))?,
            }
        }
        Ok(())
    }
}

impl Typed for AgentCommand {
    const KIND: Kind = Kind::Command;
}

impl Field for AgentCommand {
    fn from_value(value: &Value) -> Option<AgentCommand> {
        match value {
            Value::Text(path) => Some(AgentCommand::Path(path.clone())),
            Value::List(words) => words.iter().map(String::from_value).collect::<Option<_>>().map(AgentCommand::Words),
            _ => None,
        }
    }

    fn to_value(&self) -> Value {
        match self {
            AgentCommand::Path(path) => Value::Text(path.clone()),
            AgentCommand::Words(words) => Value::List(words.iter().map(String::to_value).collect()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_shown_as_a_shell_reads_it() {
        let words = |words: &[&str]| AgentCommand::Words(words.iter().map(|word| (*word).to_owned()).collect());
        let check = |command: AgentCommand, shown: &str, searches: bool| {
            assert_eq!((command.to_string().as_str(), command.searches_path()), (shown, searches));
            assert_eq!(AgentCommand::from_value(&command.to_value()), Some(command));
        };
        check(words(&["python3", "my.py", "--gain=0.5"]), "python3 my.py --gain=0.5", true);
        check(words(&["./run me", "it's", ""]), r"'./run me' 'it'\''s' ''", false);
        check(AgentCommand::Path("own agent".to_owned()), "own agent", false);
    }
}
