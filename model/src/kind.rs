//! What the value of a key may be, and what a declaration says about a key. Planners declare their parameters in these
//! terms, and the scenario format its keys: checks, help and JSON Schema are made from them.

use crate::params::ParamValue;
use crate::value::Value;
use std::fmt;
use std::ops::RangeInclusive;

/// No length, speed or time in a scenario is larger: larger values are almost certainly mistakes.
pub const LARGE: f64 = 1e6;

/// No place is farther from the origin, m: northings of UTM fit, and positions are exact to two nanometres there.
pub const FAR_M: f64 = 1e7;

/// What a number may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Smallest value.
    pub min: f64,
    /// Whether `min` itself is allowed.
    pub min_included: bool,
    /// Largest value, allowed.
    pub max: f64,
    /// Whether `max` only keeps out mistakes: descriptions leave it out, and `-max` too.
    pub roomy: bool,
    /// Whether `inf` is allowed beyond `max`.
    pub infinite: bool,
}

impl Range {
    /// Every finite number.
    pub const FINITE: Range = Range { min: f64::MIN, ..Range::at_least(0.0, f64::MAX) };
    /// Any number that is not a mistake.
    pub const ANY: Range = Range { min: -LARGE, ..Range::at_least(0.0, LARGE) };
    /// A coordinate, m.
    pub const COORDINATE: Range = Range { min: -FAR_M, ..Range::at_least(0.0, FAR_M) };
    /// Above 0.
    pub const POSITIVE: Range = Range { min_included: false, ..Range::NOT_NEGATIVE };
    /// 0 or more.
    pub const NOT_NEGATIVE: Range = Range::at_least(0.0, LARGE);
    /// Above 0, or infinite.
    pub const UNLIMITED: Range = Range { infinite: true, ..Range::POSITIVE };

    /// Whether this number is allowed; what is not a number never is.
    pub fn contains(&self, number: f64) -> bool {
        let above = if self.min_included { number >= self.min } else { number > self.min };
        above && (number <= self.max || self.infinite && number == f64::INFINITY)
    }

    /// This number or more, up to one that only keeps out mistakes.
    pub const fn at_least(min: f64, max: f64) -> Range {
        Range { min, min_included: true, max, roomy: true, infinite: false }
    }
}

impl From<RangeInclusive<f64>> for Range {
    fn from(range: RangeInclusive<f64>) -> Range {
        let (min, max) = range.into_inner();
        Range { min, min_included: true, max, roomy: false, infinite: false }
    }
}

/// In words, as in "above 0".
impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Range { min, min_included, max, roomy, infinite } = *self;
        let end = if infinite { " (or inf)" } else { "" };
        match (min_included, roomy) {
            (true, false) => write!(f, "{min} to {max}"),
            (true, true) if min == -max => write!(f, "within ±{max}"),
            (true, true) => write!(f, "{min} or more{end}"),
            (false, false) => write!(f, "above {min} and at most {max}"),
            (false, true) => write!(f, "above {min}{end}"),
        }
    }
}

/// What the value of a key must be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A string of at most this many bytes.
    Text(usize),
    /// The name of a robot; at most this many characters.
    Id(usize),
    /// `true` or `false`.
    Bool,
    /// A real number.
    Float(Range),
    /// A whole number.
    Int {
        /// Smallest value.
        min: i128,
        /// Largest value.
        max: i128,
    },
    /// One of these words.
    Choice(&'static [&'static str]),
    /// A pair of numbers `[x, y]`.
    Pair,
    /// `[x, y]`, or `[x, y, yaw]`.
    Pose,
    /// A number for each joint or link of an arm, the one at the base first.
    Joints(Range),
    /// A list of pairs.
    Pairs {
        /// Fewest pairs.
        min: usize,
        /// Most pairs.
        max: usize,
    },
    /// A list of whole numbers from 0 to this one, at least one of them, each once.
    Numbers(u16),
    /// A list of at most this many numbers.
    Floats(usize),
    /// A path, or a list of the words of a command.
    Command,
    /// `[low, high]` with `low` below `high`.
    Interval,
    /// `"all"` or a whole number.
    AllOrCount,
    /// `"forever"` or a whole number above 0.
    ForeverOrCount,
    /// The name of a planner.
    Planner,
    /// A table of parameters of one planner.
    Params,
    /// A table of such tables, by planner.
    ParamsByPlanner,
    /// A table.
    Table(&'static Section),
    /// A list of tables, at most this many.
    Tables(&'static Section, usize),
}

/// What narrows a kind: the last part of a key's declaration.
#[derive(Clone, Copy, Debug)]
pub enum Bounds {
    /// Of a real number, or of each of a list.
    Range(Range),
    /// Of a whole number, or of the length of a text or a list.
    Whole(i128, i128),
    /// Of a table: its keys.
    Section(&'static Section),
    /// Of a list of tables: the keys of each, and the most tables.
    Sections(&'static Section, usize),
}

impl From<Range> for Bounds {
    fn from(range: Range) -> Bounds {
        Bounds::Range(range)
    }
}

impl From<RangeInclusive<f64>> for Bounds {
    fn from(range: RangeInclusive<f64>) -> Bounds {
        Bounds::Range(range.into())
    }
}

macro_rules! whole_bounds {
    ($($whole:ty)+) => {
        $(impl From<RangeInclusive<$whole>> for Bounds {
            fn from(range: RangeInclusive<$whole>) -> Bounds {
                Bounds::Whole(*range.start() as i128, *range.end() as i128)
            }
        })+
    };
}

whole_bounds! { i32 u32 i64 u64 usize u16 }

impl From<&'static Section> for Bounds {
    fn from(section: &'static Section) -> Bounds {
        Bounds::Section(section)
    }
}

impl From<(&'static Section, usize)> for Bounds {
    fn from((section, most): (&'static Section, usize)) -> Bounds {
        Bounds::Sections(section, most)
    }
}

impl Kind {
    /// This kind within bounds.
    ///
    /// # Panics
    /// When a declaration gives bounds that mean nothing for its type.
    pub fn within(self, bounds: impl Into<Bounds>) -> Kind {
        match (self, bounds.into()) {
            (Kind::Float(_), Bounds::Range(range)) => Kind::Float(range),
            (Kind::Joints(_), Bounds::Range(range)) => Kind::Joints(range),
            (Kind::Int { .. }, Bounds::Whole(min, max)) => Kind::Int { min, max },
            (Kind::Text(_), Bounds::Whole(_, max)) => Kind::Text(max as usize),
            (Kind::Id(_), Bounds::Whole(_, max)) => Kind::Id(max as usize),
            (Kind::Numbers(_), Bounds::Whole(_, max)) => Kind::Numbers(max as u16),
            (Kind::Floats(_), Bounds::Whole(_, max)) => Kind::Floats(max as usize),
            (Kind::Pairs { .. }, Bounds::Whole(min, max)) => Kind::Pairs { min: min as usize, max: max as usize },
            (Kind::Table(_), Bounds::Section(section)) => Kind::Table(section),
            (Kind::Tables(..), Bounds::Sections(section, most)) => Kind::Tables(section, most),
            (kind, bounds) => panic!("{bounds:?} are not bounds of {kind}"),
        }
    }

    /// The type in words, without its bounds, as in "a number".
    pub fn name(&self) -> String {
        let name = match *self {
            Kind::Text(_) | Kind::Id(_) => "a string",
            Kind::Planner => "the name of a planner",
            Kind::Bool => "true or false",
            Kind::Float(_) => "a number",
            Kind::Int { .. } => "a whole number",
            Kind::Choice(words) => return format!("one of {}", words.join(", ")),
            Kind::Pair => "[x, y]",
            Kind::Pose => "[x, y] or [x, y, yaw]",
            Kind::Joints(_) => "[first, second]",
            Kind::Pairs { .. } => "a list of points [[x, y], ...]",
            Kind::Numbers(_) => "a list of whole numbers",
            Kind::Floats(_) => "a list of numbers",
            Kind::Command => "a path or a list of strings",
            Kind::Interval => "[low, high]",
            Kind::AllOrCount => "\"all\" or a whole number",
            Kind::ForeverOrCount => "\"forever\" or a whole number above 0",
            Kind::Params => "a table of parameters",
            Kind::ParamsByPlanner => "a table of tables of parameters",
            Kind::Table(_) => "a table",
            Kind::Tables(..) => "a list of tables",
        };
        name.to_string()
    }

    /// Says what is wrong with the value of a parameter, in a sentence that contains what would be right.
    ///
    /// # Errors
    /// With that sentence.
    pub fn check(&self, value: &ParamValue) -> Result<(), String> {
        let fits = match (*self, value) {
            (Kind::Float(range), ParamValue::Float(x)) => range.contains(*x),
            (Kind::Float(range), ParamValue::Int(n)) => range.contains(*n as f64),
            (Kind::Int { min, max }, ParamValue::Int(n)) => (min..=max).contains(&(*n).into()),
            (Kind::Bool, ParamValue::Bool(_)) => true,
            (Kind::Choice(words), ParamValue::Choice(word)) => words.contains(&word.as_str()),
            _ => false,
        };
        if fits { Ok(()) } else { Err(format!("{value} is not {self}")) }
    }
}

/// The type in words with its bounds, as in "a number from 0 to 1".
impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.name();
        match *self {
            Kind::Float(Range::FINITE) => f.write_str("a finite number"),
            Kind::Float(range) if range.min_included && !range.roomy => write!(f, "{name} from {range}"),
            Kind::Float(range) => write!(f, "{name} {range}"),
            Kind::Int { min, max } => write!(f, "{name} from {min} to {max}"),
            Kind::Joints(range) => write!(f, "{name}, each {range}"),
            Kind::Numbers(max) => write!(f, "{name}, each 0 to {max}"),
            Kind::Choice(words) => {
                let quoted: Vec<String> = words.iter().map(|word| format!("\"{word}\"")).collect();
                write!(f, "one of {}", quoted.join(", "))
            }
            _ => f.write_str(&name),
        }
    }
}

/// The value of a key that is not given.
#[derive(Clone, Copy, Debug)]
pub enum Preset {
    /// The key must be given.
    Required,
    /// Nothing.
    Absent,
    /// This value.
    Value(fn() -> Value),
    /// A value that depends on the rest of the file, in words.
    Computed(&'static str),
}

/// What a declaration says about one key.
#[derive(Clone, Copy, Debug)]
pub struct Spec {
    /// Its name in a scenario.
    pub name: &'static str,
    /// Its unit, "" for none.
    pub unit: &'static str,
    /// What its value must be; [`Spec::kind`] asks.
    pub kind: fn() -> Kind,
    /// What it is when it is not given.
    pub preset: Preset,
    /// What it does, and of parameters what larger means.
    pub help: &'static str,
    /// In a section with a tag: the words of the tag that go with this key; empty is all.
    pub only: &'static [&'static str],
}

impl Spec {
    /// What its value must be.
    pub fn kind(&self) -> Kind {
        (self.kind)()
    }

    /// Its default, if that is a value.
    pub fn default(&self) -> Option<Value> {
        if let Preset::Value(value) = self.preset { Some(value()) } else { None }
    }

    /// Whether the key must be given.
    pub fn is_required(&self) -> bool {
        matches!(self.preset, Preset::Required)
    }

    /// Whether the key goes with this word of the section's tag.
    pub fn goes_with(&self, tag: Option<&str>) -> bool {
        self.only.is_empty() || tag.is_none_or(|tag| self.only.contains(&tag))
    }
}

/// A table of keys.
#[derive(Debug)]
pub struct Section {
    /// How a file writes it, as in `[clock]`.
    pub title: &'static str,
    /// What it is about.
    pub help: &'static str,
    /// The key that decides which other keys there are.
    pub tag: Option<&'static str>,
    /// Its keys, in groups so that sections can share them.
    pub groups: &'static [&'static [Spec]],
}

/// Sections are one if they are the same place.
impl PartialEq for Section {
    fn eq(&self, other: &Section) -> bool {
        std::ptr::eq(self, other)
    }
}

impl Section {
    /// One without keys: what the type of a table key is before its declaration narrows it.
    pub const NONE: &'static Section = &Section { title: "", help: "", tag: None, groups: &[] };

    /// Its keys, in order.
    pub fn keys(&self) -> impl Iterator<Item = &'static Spec> + use<> {
        self.groups.iter().flat_map(|group| group.iter())
    }

    /// The key of that name, rather the one that goes with the tag if there are two.
    pub fn key(&self, name: &str, tag: Option<&str>) -> Option<&'static Spec> {
        let mut named = self.keys().filter(|key| key.name == name).peekable();
        let first = named.peek().copied();
        named.find(|key| key.goes_with(tag)).or(first)
    }

    /// The words that its tag may be.
    pub fn words(&self) -> &'static [&'static str] {
        match self.tag.and_then(|tag| self.key(tag, None)).map(Spec::kind) {
            Some(Kind::Choice(words)) => words,
            _ => &[],
        }
    }
}
