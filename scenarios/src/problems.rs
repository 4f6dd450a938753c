//! What is wrong with a scenario: collected while checking, shown all at once.

use model::Problem;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

/// Of problems that differ only in names and numbers, this many are shown.
const SHOWN_OF_A_KIND: usize = 5;
/// So many kinds of problems are told apart.
const KINDS: usize = 30;
/// No part of a problem is longer, characters.
const TEXT_MAX: usize = 2000;

/// Where a value comes from. The order is the order of the report.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Origin {
    /// Nowhere in particular.
    Whole,
    /// The option of the command line with this index.
    Option(usize),
    /// This line of the file, counted from 1.
    Line(usize),
}

/// Everything that is wrong with a scenario, or with a request to add a robot. Never empty.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problems {
    /// What it is that has them, as in "scenario `ring.toml`".
    pub subject: String,
    /// The problems, in the order of the file.
    pub shown: Vec<Problem>,
    /// Problems that were left out because there are many like them: how many, and an example.
    pub more: Vec<(usize, String)>,
}

impl Problems {
    /// How many problems there are, those left out included.
    pub fn count(&self) -> usize {
        self.shown.len() + self.more.iter().map(|(count, _)| count).sum::<usize>()
    }
}

/// One line `error: ...` per problem, followed by its `hint: ...` unless the same hint stands above already; no newline
/// at the end.
impl fmt::Display for Problems {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        let mut hints = BTreeSet::new();
        for problem in &self.shown {
            write!(f, "{separator}error: {}: {problem}", self.subject)?;
            separator = "\n";
            if let Some(hint) = problem.hint.as_ref().filter(|hint| hints.insert(*hint)) {
                write!(f, "\nhint: {hint}")?;
            }
        }
        for (count, example) in &self.more {
            write!(f, "{separator}error: {}: and {count} more like `{example}`", self.subject)?;
            separator = "\n";
        }
        Ok(())
    }
}

impl std::error::Error for Problems {}

/// Collects problems and warnings. It keeps a few of each kind and counts the rest, so that a file with a hundred
/// thousand mistakes costs no more to report than one with ten.
pub(crate) struct Report {
    subject: String,
    options: Vec<String>,
    problems: Collection,
    warnings: Collection,
}

#[derive(Default)]
struct Collection {
    kept: Vec<(Origin, Problem)>,
    kinds: BTreeMap<String, Kind>,
}

struct Kind {
    count: usize,
    example: String,
}

impl Report {
    /// `options` are the options of the command line that [`Origin::Option`] points to.
    pub(crate) fn new(subject: String, options: Vec<String>) -> Report {
        Report { subject, options, problems: Collection::default(), warnings: Collection::default() }
    }

    /// Adds a problem that is its own way out.
    pub(crate) fn add(&mut self, origin: Origin, key: &str, message: impl Into<String>) {
        let problem = self.problem(origin, key, message.into(), None);
        self.problems.push(origin, problem);
    }

    /// Adds a problem with the way out.
    pub(crate) fn add_hint(&mut self, origin: Origin, key: &str, message: impl Into<String>, hint: impl Into<String>) {
        let problem = self.problem(origin, key, message.into(), Some(hint.into()));
        self.problems.push(origin, problem);
    }

    /// Adds a warning: the scenario can be run, but hardly means this.
    pub(crate) fn warn(&mut self, origin: Origin, key: &str, message: impl Into<String>, hint: impl Into<String>) {
        let warning = self.problem(origin, key, message.into(), Some(hint.into()));
        self.warnings.push(origin, warning);
    }

    fn problem(&self, origin: Origin, key: &str, message: String, hint: Option<String>) -> Problem {
        let (line, option) = match origin {
            Origin::Whole => (None, None),
            Origin::Option(index) => (None, self.options.get(index).cloned()),
            Origin::Line(line) => (Some(line), None),
        };
        let [option, hint] = [option, hint].map(|text| text.map(|text| cut(&text)));
        Problem { line, option, key: cut(key), message: cut(&message), hint }
    }

    /// The warnings in order of the file, or the problems if there are any.
    pub(crate) fn finish(self) -> Result<Vec<Problem>, Problems> {
        if self.problems.kept.is_empty() {
            let (mut warnings, more) = self.warnings.sorted();
            warnings.extend(more.into_iter().map(|(count, example)| Problem {
                line: None,
                option: None,
                key: String::new(),
                message: format!("and {count} more like `{example}`"),
                hint: None,
            }));
            return Ok(warnings);
        }
        let (shown, more) = self.problems.sorted();
        Err(Problems { subject: self.subject, shown, more })
    }
}

impl Collection {
    fn push(&mut self, origin: Origin, problem: Problem) {
        // Robots that share a layer share its mistakes.
        if self.kept.contains(&(origin, problem.clone())) {
            return;
        }
        // Too many kinds to tell apart: the rest is one kind.
        let mut shape = shape(&format!("{}: {}", problem.key, problem.message));
        if self.kinds.len() >= KINDS && !self.kinds.contains_key(&shape) {
            shape.clear();
        }
        let kind = self.kinds.entry(shape).or_insert_with(|| Kind { count: 0, example: problem.to_string() });
        kind.count += 1;
        if kind.count <= SHOWN_OF_A_KIND {
            self.kept.push((origin, problem));
        }
    }

    /// Those that are kept in order of the file, and how many more there are of which kind.
    fn sorted(mut self) -> (Vec<Problem>, Vec<(usize, String)>) {
        self.kept.sort_by_key(|(origin, _)| *origin);
        let more = (self.kinds.into_values())
            .filter(|kind| kind.count > SHOWN_OF_A_KIND)
            .map(|kind| (kind.count - SHOWN_OF_A_KIND, kind.example))
            .collect();
        (self.kept.into_iter().map(|(_, problem)| problem).collect(), more)
    }
}

/// A text as it is, or the beginning of one that nobody would read.
fn cut(text: &str) -> String {
    match text.char_indices().nth(TEXT_MAX) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_string(),
    }
}

/// A message without its names and numbers: what it has in common with others of its kind.
fn shape(message: &str) -> String {
    let mut quoted = false;
    let mut shape = String::new();
    for c in message.chars() {
        if c == '`' {
            quoted = !quoted;
        } else if !quoted && !c.is_ascii_digit() && c != '-' && c != '.' {
            shape.push(c);
        }
    }
    shape
}

/// Longer words are like no name: comparing takes the product of the lengths.
const NAME_MAX: usize = 100;

/// The candidate that looks most like `word`, if one looks like it at all.
pub(crate) fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let plain = |word: &str| word.to_lowercase().replace('-', "_");
    if word.len() > NAME_MAX {
        return None;
    }
    let word = plain(word);
    let mut best: Option<(f64, &str)> = None;
    for candidate in candidates {
        let likeness = strsim::jaro_winkler(&word, &plain(candidate));
        if likeness > 0.82 && best.is_none_or(|(most, _)| likeness > most) {
            best = Some((likeness, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// "known WHAT: a, b, c (did you mean `b`?)"
pub(crate) fn known(what: &str, word: &str, candidates: &[&str]) -> String {
    let list = candidates.join(", ");
    match nearest(word, candidates.iter().copied()) {
        Some(near) => format!("known {what}: {list} (did you mean `{near}`?)"),
        None => format!("known {what}: {list}"),
    }
}
