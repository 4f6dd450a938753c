//! What the walker makes of a document: tables with known keys and values of the right type.

use crate::document::Field;
use crate::keys::{Key, Preset, Section};
use crate::problems::Origin;
use nalgebra::Point2;

/// A table of a file, checked.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) section: &'static Section,
    /// How to name it, as in `robot[3]`; empty for the whole file.
    pub(crate) path: String,
    pub(crate) origin: Origin,
    /// The word of its tag, if it has one.
    pub(crate) tag: Option<&'static str>,
    entries: Vec<(&'static str, Origin, Value)>,
}

/// A value of a type that the key table has.
#[derive(Clone, Debug)]
pub(crate) enum Value {
    Text(String),
    Word(&'static str),
    Bool(bool),
    Float(f64),
    Int(i128),
    Pair([f64; 2]),
    Pose([f64; 2], Option<f64>),
    Pairs(Vec<[f64; 2]>),
    Numbers(Vec<u16>),
    Floats(Vec<f64>),
    Node(Node),
    Nodes(Vec<Node>),
    Params(Block),
    Methods(Vec<(String, Origin, Block)>),
    /// It was given, and it is wrong, and that has been reported.
    Wrong,
}

/// Parameters of a method, not yet checked against it.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    pub(crate) path: String,
    pub(crate) fields: Vec<Field>,
}

/// Typed access. A key that is not there, or is there and wrong, is what the key table says it is then.
impl Node {
    pub(crate) fn new(
        section: &'static Section,
        path: String,
        origin: Origin,
        tag: Option<&'static str>,
        entries: Vec<(&'static str, Origin, Value)>,
    ) -> Node {
        Node { section, path, origin, tag, entries }
    }

    /// A section that the file does not have.
    pub(crate) fn absent(section: &'static Section, path: &str) -> Node {
        Node { section, path: path.to_string(), origin: Origin::Whole, tag: None, entries: Vec::new() }
    }

    /// Whether the file gives this key, right or wrong.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.entries.iter().any(|(key, ..)| *key == name)
    }

    /// Where a key is, or where it would be.
    pub(crate) fn at(&self, name: &str) -> Origin {
        self.entries.iter().find(|(key, ..)| *key == name).map_or(self.origin, |(_, origin, _)| *origin)
    }

    /// How to name a key.
    pub(crate) fn key(&self, name: &str) -> String {
        join(&self.path, name)
    }

    /// A value as given.
    pub(crate) fn value(&self, name: &str) -> Option<&Value> {
        debug_assert!(self.section.key(name, self.tag).is_some(), "{} has no `{name}`", self.section.title);
        self.entries.iter().find(|(key, ..)| *key == name).map(|(.., value)| value)
    }

    pub(crate) fn float(&self, name: &str) -> Option<f64> {
        match self.value(name) {
            Some(Value::Float(number)) => Some(*number),
            _ => preset(self.section.key(name, self.tag)?).and_then(|text| text.parse().ok()),
        }
    }

    pub(crate) fn int(&self, name: &str) -> Option<i128> {
        match self.value(name) {
            Some(Value::Int(number)) => Some(*number),
            _ => preset(self.section.key(name, self.tag)?).and_then(|text| text.parse().ok()),
        }
    }

    pub(crate) fn bool(&self, name: &str) -> Option<bool> {
        match self.value(name) {
            Some(Value::Bool(value)) => Some(*value),
            _ => preset(self.section.key(name, self.tag)?).and_then(|text| text.parse().ok()),
        }
    }

    /// A text or a word.
    pub(crate) fn text(&self, name: &str) -> Option<&str> {
        match self.value(name) {
            Some(Value::Text(text)) => Some(text),
            Some(Value::Word(word)) => Some(word),
            _ => preset(self.section.key(name, self.tag)?).map(|text| text.trim_matches('"')),
        }
    }

    pub(crate) fn pair(&self, name: &str) -> Option<[f64; 2]> {
        match self.value(name) {
            Some(Value::Pair(pair) | Value::Pose(pair, _)) => Some(*pair),
            _ => {
                let text = preset(self.section.key(name, self.tag)?)?;
                let (x, y) = text.trim_matches(['[', ']']).split_once(", ")?;
                Some([x.parse().ok()?, y.parse().ok()?])
            }
        }
    }

    pub(crate) fn point(&self, name: &str) -> Option<Point2<f64>> {
        self.pair(name).map(|[x, y]| Point2::new(x, y))
    }

    /// The heading that a pose has.
    pub(crate) fn yaw(&self, name: &str) -> Option<f64> {
        match self.value(name) {
            Some(Value::Pose(_, yaw_rad)) => *yaw_rad,
            _ => None,
        }
    }

    pub(crate) fn points(&self, name: &str) -> Vec<Point2<f64>> {
        match self.value(name) {
            Some(Value::Pairs(pairs)) => pairs.iter().map(|[x, y]| Point2::new(*x, *y)).collect(),
            _ => Vec::new(),
        }
    }

    pub(crate) fn numbers(&self, name: &str) -> &[u16] {
        match self.value(name) {
            Some(Value::Numbers(numbers)) => numbers,
            _ => &[],
        }
    }

    pub(crate) fn node(&self, name: &str) -> Option<&Node> {
        match self.value(name) {
            Some(Value::Node(node)) => Some(node),
            _ => None,
        }
    }

    pub(crate) fn nodes(&self, name: &str) -> &[Node] {
        match self.value(name) {
            Some(Value::Nodes(nodes)) => nodes,
            _ => &[],
        }
    }
}

fn preset(key: &Key) -> Option<&'static str> {
    match key.preset {
        Preset::Value(text) => Some(text),
        _ => None,
    }
}

/// The path of a key in the table of that path.
pub(crate) fn join(path: &str, name: &str) -> String {
    if path.is_empty() { name.to_string() } else { format!("{path}.{name}") }
}
