//! Parameters of methods: a typed struct per method, a table of the same for validation, help and schema.
//!
//! A method declares its parameters once, with [`params!`](crate::params!), and gets both from it.

pub use model::{ParamValue, ParamValues};
use std::fmt;
use std::ops::RangeInclusive;

/// What a parameter may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParamKind {
    /// A real number within bounds, both included.
    Float {
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// A whole number within bounds, both included.
    Int {
        /// Smallest value.
        min: i64,
        /// Largest value.
        max: i64,
    },
    /// A switch.
    Bool,
    /// One of these words.
    Choice(&'static [&'static str]),
}

/// One row of a method's parameter table.
#[derive(Clone, Debug)]
pub struct ParamSpec {
    /// Its key in a scenario.
    pub name: &'static str,
    /// Its unit, "" for none.
    pub unit: &'static str,
    /// What it may be.
    pub kind: ParamKind,
    /// Default.
    pub default: ParamValue,
    /// What it does, and what larger means.
    pub help: &'static str,
}

/// Why a set of values does not fit a method.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParamError {
    /// The method has no such parameter.
    #[error("unknown parameter `{name}`")]
    Unknown {
        /// The key as given.
        name: String,
        /// The nearest known key, if one is near.
        nearest: Option<&'static str>,
        /// All keys of the method.
        known: Vec<&'static str>,
    },
    /// The value has the wrong type, or is outside its bounds.
    #[error("`{name}`: {problem}")]
    Value {
        /// The key.
        name: String,
        /// What is wrong, with the bounds.
        problem: String,
    },
}

impl ParamError {
    /// The key that the problem is about.
    pub fn name(&self) -> &str {
        match self {
            ParamError::Unknown { name, .. } | ParamError::Value { name, .. } => name,
        }
    }
}

/// Every problem of `values` against a table, in the order of the keys.
pub fn check(specs: &[ParamSpec], values: &ParamValues) -> Vec<ParamError> {
    values.iter().filter_map(|(name, value)| check_one(specs, name, value).err()).collect()
}

fn check_one(specs: &[ParamSpec], name: &str, value: &ParamValue) -> Result<(), ParamError> {
    match specs.iter().find(|spec| spec.name == name) {
        Some(spec) => spec.kind.check(value).map_err(|problem| ParamError::Value { name: name.to_owned(), problem }),
        None => {
            let known: Vec<&'static str> = specs.iter().map(|spec| spec.name).collect();
            Err(ParamError::Unknown { name: name.to_owned(), nearest: nearest(name, known.iter().copied()), known })
        }
    }
}

/// The known word most like `word`, if one is like it at all: what a "did you mean" asks for.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // Below this likeness suggestions start to look arbitrary: `p_q` should find `p_o`, `speed` should not find `xi`.
    const LIKENESS_MIN: f64 = 0.7;
    // Comparing takes the product of the lengths.
    const LENGTH_MAX: usize = 100;
    if word.len() > LENGTH_MAX {
        return None;
    }
    known
        .into_iter()
        .map(|candidate| (strsim::jaro_winkler(word, candidate), candidate))
        .filter(|(likeness, _)| *likeness >= LIKENESS_MIN)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

impl ParamKind {
    /// Says what is wrong with a value, in a sentence that contains what would be right.
    pub fn check(&self, value: &ParamValue) -> Result<(), String> {
        let fits = match (*self, value) {
            // A comparison with NaN is false, so what is not a number does not fit either.
            (ParamKind::Float { min, max }, ParamValue::Float(x)) => x.is_finite() && (min..=max).contains(x),
            (ParamKind::Float { min, max }, ParamValue::Int(n)) => (min..=max).contains(&(*n as f64)),
            (ParamKind::Int { min, max }, ParamValue::Int(n)) => (min..=max).contains(n),
            (ParamKind::Bool, ParamValue::Bool(_)) => true,
            (ParamKind::Choice(words), ParamValue::Choice(word)) => words.contains(&word.as_str()),
            _ => false,
        };
        if fits { Ok(()) } else { Err(format!("{value} is not {self}")) }
    }
}

impl fmt::Display for ParamKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            ParamKind::Float { min, max } => write!(f, "a number from {min} to {max}"),
            ParamKind::Int { min, max } => write!(f, "a whole number from {min} to {max}"),
            ParamKind::Bool => write!(f, "true or false"),
            ParamKind::Choice(words) => {
                let quoted: Vec<String> = words.iter().map(|word| format!("\"{word}\"")).collect();
                write!(f, "one of {}", quoted.join(", "))
            }
        }
    }
}

/// A type that a field of a parameter struct may have.
pub trait ParamField: Sized {
    /// What values of this type may be, given the bounds of the field; types without order ignore them.
    fn kind(bounds: Option<RangeInclusive<Self>>) -> ParamKind;
    /// The value as a scenario would give it.
    fn to_value(&self) -> ParamValue;
    /// The typed value, if the given one has a fitting type.
    fn from_value(value: &ParamValue) -> Option<Self>;
}

impl ParamField for f64 {
    fn kind(bounds: Option<RangeInclusive<f64>>) -> ParamKind {
        let (min, max) = bounds.map_or((f64::MIN, f64::MAX), RangeInclusive::into_inner);
        ParamKind::Float { min, max }
    }

    fn to_value(&self) -> ParamValue {
        ParamValue::Float(*self)
    }

    fn from_value(value: &ParamValue) -> Option<f64> {
        match *value {
            ParamValue::Float(x) => Some(x),
            ParamValue::Int(n) => Some(n as f64),
            _ => None,
        }
    }
}

impl ParamField for i64 {
    fn kind(bounds: Option<RangeInclusive<i64>>) -> ParamKind {
        let (min, max) = bounds.map_or((i64::MIN, i64::MAX), RangeInclusive::into_inner);
        ParamKind::Int { min, max }
    }

    fn to_value(&self) -> ParamValue {
        ParamValue::Int(*self)
    }

    fn from_value(value: &ParamValue) -> Option<i64> {
        if let ParamValue::Int(n) = *value { Some(n) } else { None }
    }
}

impl ParamField for u32 {
    fn kind(bounds: Option<RangeInclusive<u32>>) -> ParamKind {
        let (min, max) = bounds.map_or((0, u32::MAX), RangeInclusive::into_inner);
        ParamKind::Int { min: min.into(), max: max.into() }
    }

    fn to_value(&self) -> ParamValue {
        ParamValue::Int((*self).into())
    }

    fn from_value(value: &ParamValue) -> Option<u32> {
        if let ParamValue::Int(n) = *value { u32::try_from(n).ok() } else { None }
    }
}

impl ParamField for bool {
    fn kind(_: Option<RangeInclusive<bool>>) -> ParamKind {
        ParamKind::Bool
    }

    fn to_value(&self) -> ParamValue {
        ParamValue::Bool(*self)
    }

    fn from_value(value: &ParamValue) -> Option<bool> {
        if let ParamValue::Bool(b) = *value { Some(b) } else { None }
    }
}

/// Declares the parameters of a method: one line each, `name: type = default, "unit", bounds;`. The doc comment is
/// the help, so it should say what larger means. Bounds are optional and mean nothing for switches and choices.
///
/// The struct gets `Default`, `specs() -> Vec<ParamSpec>`, `from_values(&ParamValues) -> Result<Self, ParamError>`, and
/// `with(self, &ParamValues) -> Self` for methods whose parameters start from presets. Lines `..field: Struct;` before the
/// others take over the parameters of another such struct.
#[macro_export]
macro_rules! params {
    (
        $(#[$about:meta])*
        $visibility:vis struct $name:ident {
            $( ..$shared:ident: $shared_type:ty; )*
            $( $(#[doc = $help:literal])+ $field:ident: $type:ty = $default:expr, $unit:literal $(, $bounds:expr)?; )*
        }
    ) => {
        $(#[$about])*
        #[derive(Clone, Debug, PartialEq)]
        $visibility struct $name {
            $( #[doc = "Parameters that other methods have too."] pub $shared: $shared_type, )*
            $( $(#[doc = $help])+ pub $field: $type, )*
        }

        impl Default for $name {
            fn default() -> Self {
                $name { $( $shared: Default::default(), )* $( $field: $default, )* }
            }
        }

        impl $name {
            /// The table of the parameters.
            pub fn specs() -> Vec<$crate::params::ParamSpec> {
                let default = Self::default();
                let own = vec![ $( $crate::params::ParamSpec {
                    name: stringify!($field),
                    unit: $unit,
                    kind: <$type as $crate::params::ParamField>::kind(None$(.or(Some($bounds)))?),
                    default: $crate::params::ParamField::to_value(&default.$field),
                    help: concat!($($help),+).trim(),
                }, )* ];
                let shared: Vec<Vec<$crate::params::ParamSpec>> = vec![ $( <$shared_type>::specs() ),* ];
                shared.into_iter().flatten().chain(own).collect()
            }

            /// The parameters with these values, the rest at their defaults; or the first problem.
            pub fn from_values(
                values: &$crate::params::ParamValues,
            ) -> Result<Self, $crate::params::ParamError> {
                if let Some(problem) = $crate::params::check(&Self::specs(), values).into_iter().next() {
                    return Err(problem);
                }
                Ok(Self::default().with(values))
            }

            /// These parameters with some of them replaced; what does not fit its field is passed over.
            pub fn with(self, values: &$crate::params::ParamValues) -> Self {
                let mut params = self;
                $( params.$shared = params.$shared.with(values); )*
                $( if let Some(value) =
                    values.get(stringify!($field)).and_then($crate::params::ParamField::from_value)
                {
                    params.$field = value;
                } )*
                params
            }
        }
    };
}

/// Declares a choice for use as a field of [`params!`](crate::params!): an enum whose variants have the words by
/// which scenarios name them.
#[macro_export]
macro_rules! choice {
    (
        $(#[$about:meta])*
        $visibility:vis enum $name:ident { $( $(#[$help:meta])* $variant:ident = $word:literal, )+ }
    ) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        $visibility enum $name { $( $(#[$help])* $variant, )+ }

        impl $crate::params::ParamField for $name {
            fn kind(_: Option<std::ops::RangeInclusive<Self>>) -> $crate::params::ParamKind {
                $crate::params::ParamKind::Choice(&[$($word),+])
            }

            fn to_value(&self) -> $crate::params::ParamValue {
                $crate::params::ParamValue::Choice(match self { $( $name::$variant => $word, )+ }.to_owned())
            }

            fn from_value(value: &$crate::params::ParamValue) -> Option<Self> {
                match value {
                    $crate::params::ParamValue::Choice(word) => match word.as_str() {
                        $( $word => Some($name::$variant), )+
                        _ => None,
                    },
                    _ => None,
                }
            }
        }
    };
}
