//! Parameters of methods: a typed struct per method, a table of the same for validation, help and schema.
//!
//! A method declares its parameters once, with [`params!`](crate::params!), and gets both from it.

use model::kind::Spec;
pub use model::{ParamValue, ParamValues};

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
pub fn check(specs: &[Spec], values: &ParamValues) -> Vec<ParamError> {
    values.iter().filter_map(|(name, value)| check_one(specs, name, value).err()).collect()
}

fn check_one(specs: &[Spec], name: &str, value: &ParamValue) -> Result<(), ParamError> {
    match specs.iter().find(|spec| spec.name == name) {
        Some(spec) => spec.kind().check(value).map_err(|problem| ParamError::Value { name: name.to_owned(), problem }),
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

/// Declares the parameters of a method with [`model::keys!`]: one line each, `name: type = default, "unit", bounds;`. The
/// doc comment is the help, so it should say what larger means. Bounds are optional and mean nothing for switches and
/// choices.
///
/// The struct gets `Default`, `specs() -> Vec<Spec>`, `from_values(&ParamValues) -> Result<Self, ParamError>`, and
/// `with(self, &ParamValues) -> Self` for methods whose parameters start from presets. Lines `..field: Struct;` before the
/// others take over the parameters of another such struct.
#[macro_export]
macro_rules! params {
    ($(#[$about:meta])* $visibility:vis struct $name:ident { $($lines:tt)* }) => {
        $crate::keys! {
            $(#[$about])*
            $visibility struct $name { $($lines)* }
        }

        impl $name {
            /// The parameters with these values, the rest at their defaults; or the first problem.
            pub fn from_values(
                values: &$crate::params::ParamValues,
            ) -> Result<Self, $crate::params::ParamError> {
                match $crate::params::check(&Self::specs(), values).into_iter().next() {
                    Some(problem) => Err(problem),
                    None => Ok(Self::default().with(values)),
                }
            }
        }
    };
}
