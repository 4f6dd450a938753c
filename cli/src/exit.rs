//! Exit codes, and the failures that lead to them.

use std::fmt;

pub use report::exit::{ENVIRONMENT, EXPECTATIONS, INTERRUPTED, OK, TIME_OUT, USAGE};

/// Why a verb could not do what it was asked: an exit code, and what to tell people.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// The exit code.
    pub code: i32,
    /// What is wrong, in order.
    pub lines: Vec<Line>,
}

/// One line of a failure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Line {
    /// What is wrong: the object first, then the cause, lowercase.
    Error(String),
    /// The way out.
    Hint(String),
}

impl Failure {
    /// A failure with this exit code.
    pub fn new(code: i32, message: impl Into<String>) -> Failure {
        Failure { code, lines: vec![Line::Error(message.into())] }
    }

    /// The command line or the scenario is wrong.
    pub fn usage(message: impl Into<String>) -> Failure {
        Failure::new(USAGE, message)
    }

    /// The environment does not allow it.
    pub fn environment(message: impl Into<String>) -> Failure {
        Failure::new(ENVIRONMENT, message)
    }

    /// What is wrong first of all.
    pub fn message(&self) -> &str {
        let of = |line: &Line| matches!(line, Line::Error(_));
        match self.lines.iter().find(|line| of(line)) {
            Some(Line::Error(text) | Line::Hint(text)) => text,
            None => "",
        }
    }

    /// A failure told by a text that may have several lines, some of which begin with `error: ` or `hint: `.
    pub fn from_text(code: i32, text: &str) -> Failure {
        let lines = (text.lines())
            .map(|line| match line.strip_prefix("hint: ") {
                Some(hint) => Line::Hint(hint.to_owned()),
                None => Line::Error(line.strip_prefix("error: ").unwrap_or(line).to_owned()),
            })
            .collect();
        Failure { code, lines }
    }

    /// Adds what else is wrong.
    pub fn error(mut self, message: impl Into<String>) -> Failure {
        self.lines.push(Line::Error(message.into()));
        self
    }

    /// Everything that failed, with the exit code of the first failure.
    ///
    /// # Errors
    /// When one of them is a failure.
    pub fn first_of(results: impl IntoIterator<Item = Result<(), Failure>>) -> Result<(), Failure> {
        let failures = results.into_iter().filter_map(Result::err);
        let all = failures.reduce(|first, next| Failure { lines: [first.lines, next.lines].concat(), ..first });
        all.map_or(Ok(()), Err)
    }

    /// Adds the way out.
    pub fn hint(mut self, hint: impl Into<String>) -> Failure {
        self.lines.push(Line::Hint(hint.into()));
        self
    }

    /// Adds the way out, if there is one.
    pub fn hints(mut self, hints: impl IntoIterator<Item = String>) -> Failure {
        self.lines.extend(hints.into_iter().map(Line::Hint));
        self
    }

    /// The text for standard error, a newline at the end of every line.
    pub fn render(&self, color: bool) -> String {
        let (red, cyan, plain) = if color { ("\x1b[1;31m", "\x1b[1;36m", "\x1b[0m") } else { ("", "", "") };
        (self.lines.iter())
            .map(|line| match line {
                Line::Error(text) => format!("{red}error:{plain} {text}\n"),
                Line::Hint(text) => format!("{cyan}hint:{plain} {text}\n"),
            })
            .collect()
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.render(false).trim_end())
    }
}

impl std::error::Error for Failure {}

impl From<daemon::Error> for Failure {
    fn from(error: daemon::Error) -> Failure {
        let daemon::Error { kind, message, details, hints, before } = error;
        if kind == daemon::Kind::Interrupted {
            return Failure { code: INTERRUPTED, lines: Vec::new() };
        }
        let own = details.into_iter().fold(Failure::environment(message), Failure::error).hints(hints);
        let before = before.into_iter().flat_map(|error| Failure::from(error).lines);
        Failure { lines: before.chain(own.lines).collect(), ..own }
    }
}

impl From<bus::BusError> for Failure {
    fn from(error: bus::BusError) -> Failure {
        Failure::environment(error.to_string()).hints(error.hint().map(str::to_owned))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_is_only_paint() {
        let failure = Failure::usage("scenario `x`: it is empty").hint("write one");
        assert_eq!(failure.render(false), "error: scenario `x`: it is empty\nhint: write one\n");
        let painted = failure.render(true);
        let mut plain = String::new();
        let mut escape = false;
        for c in painted.chars() {
            escape |= c == '\x1b';
            if !escape {
                plain.push(c);
            }
            escape &= c != 'm';
        }
        assert_eq!(plain, failure.render(false));
    }
}
