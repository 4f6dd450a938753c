//! What the walker makes of a document: tables with known keys and values of the right type.

use crate::document;
use crate::problems::Origin;
use model::field::{Field, Params, ParamsByPlanner, Table, Tables};
use model::key::{Asked, Named, OptionalKey};
use model::kind::Section;
use model::value::Value;

/// A table of a file, checked.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) section: &'static Section,
    /// How to name it, as in `robot[3]`; empty for the whole file.
    pub(crate) path: String,
    pub(crate) origin: Origin,
    /// The word of its tag, if it has one.
    pub(crate) tag: Option<&'static str>,
    entries: Vec<(&'static str, Origin, Entry)>,
}

/// What a file gives for a key of the table.
#[derive(Clone, Debug)]
pub(crate) enum Entry {
    Value(Value),
    Node(Node),
    Nodes(Vec<Node>),
    Params(Block),
    ParamsByPlanner(Vec<(String, Origin, Block)>),
    /// It was given, and it is wrong, and that has been reported.
    Wrong,
}

/// Parameters of a planner, not yet checked against it.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    pub(crate) path: String,
    pub(crate) fields: Vec<document::Field>,
}

/// What a file says about a key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Given<T> {
    Absent,
    /// It was given, and it is wrong, and that has been reported.
    Wrong,
    Value(T),
}

impl<T> Given<T> {
    /// The value; where none is given this one, where it is wrong none.
    pub(crate) fn or(self, absent: T) -> Option<T> {
        match self {
            Given::Absent => Some(absent),
            Given::Wrong => None,
            Given::Value(value) => Some(value),
        }
    }
}

/// Typed access, with declared keys only. A key that is not there, or is there and wrong, is what its declaration says.
impl Node {
    pub(crate) fn new(
        section: &'static Section,
        path: String,
        origin: Origin,
        tag: Option<&'static str>,
        entries: Vec<(&'static str, Origin, Entry)>,
    ) -> Node {
        Node { section, path, origin, tag, entries }
    }

    /// A section that the file does not have.
    pub(crate) fn absent(section: &'static Section, path: &str) -> Node {
        Node { section, path: path.to_string(), origin: Origin::Whole, tag: None, entries: Vec::new() }
    }

    /// The value of a key.
    pub(crate) fn get<K: Asked>(&self, key: K) -> K::Answer {
        let name = key.name();
        debug_assert!(self.section.key(name, self.tag).is_some(), "{} has no `{name}`", self.section.title);
        match self.entry(key) {
            Some(Entry::Value(value)) => key.answer(Some(value)),
            _ => key.answer(None),
        }
    }

    /// The value of a key, where it matters whether it was given.
    pub(crate) fn given<K: Asked>(&self, key: K) -> Given<K::Value> {
        match self.entry(key) {
            None => Given::Absent,
            Some(Entry::Value(value)) => K::Value::from_value(value).map_or(Given::Wrong, Given::Value),
            Some(_) => Given::Wrong,
        }
    }

    /// The value of a key as data, if the file gives a right one.
    pub(crate) fn plain(&self, key: impl Named) -> Option<&Value> {
        match self.entry(key) {
            Some(Entry::Value(value)) => Some(value),
            _ => None,
        }
    }

    /// Whether the file gives this key, right or wrong.
    pub(crate) fn has(&self, key: impl Named) -> bool {
        self.entry(key).is_some()
    }

    /// Whether the file gives this key a wrong value, which has been reported.
    pub(crate) fn is_wrong(&self, key: impl Named) -> bool {
        matches!(self.entry(key), Some(Entry::Wrong))
    }

    /// Where a key is, or where it would be.
    pub(crate) fn at(&self, key: impl Named) -> Origin {
        self.entries.iter().find(|(name, ..)| *name == key.name()).map_or(self.origin, |(_, origin, _)| *origin)
    }

    /// How to name a key.
    pub(crate) fn key(&self, key: impl Named) -> String {
        join(&self.path, key.name())
    }

    pub(crate) fn node(&self, key: OptionalKey<Table>) -> Option<&Node> {
        match self.entry(key) {
            Some(Entry::Node(node)) => Some(node),
            _ => None,
        }
    }

    pub(crate) fn nodes(&self, key: OptionalKey<Tables>) -> &[Node] {
        match self.entry(key) {
            Some(Entry::Nodes(nodes)) => nodes,
            _ => &[],
        }
    }

    pub(crate) fn params(&self, key: OptionalKey<Params>) -> Option<&Block> {
        match self.entry(key) {
            Some(Entry::Params(block)) => Some(block),
            _ => None,
        }
    }

    pub(crate) fn params_by_planner(&self, key: OptionalKey<ParamsByPlanner>) -> &[(String, Origin, Block)] {
        match self.entry(key) {
            Some(Entry::ParamsByPlanner(blocks)) => blocks,
            _ => &[],
        }
    }

    fn entry(&self, key: impl Named) -> Option<&Entry> {
        self.entries.iter().find(|(name, ..)| *name == key.name()).map(|(.., entry)| entry)
    }
}

/// The path of a key in the table of that path.
pub(crate) fn join(path: &str, name: &str) -> String {
    if path.is_empty() { name.to_string() } else { format!("{path}.{name}") }
}
