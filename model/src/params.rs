//! Values of planner parameters, as a scenario carries them. What a planner accepts is the planner's to say.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// A value as a scenario gives it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ParamValue {
    /// A real number.
    Float(f64),
    /// A whole number.
    Int(i64),
    /// A switch.
    Bool(bool),
    /// One word out of a list.
    Choice(String),
}

/// Values by name; what is missing takes its default.
pub type ParamValues = BTreeMap<String, ParamValue>;

impl fmt::Display for ParamValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // Debug keeps the point of 1.0, as TOML does.
            ParamValue::Float(x) => write!(f, "{x:?}"),
            ParamValue::Int(n) => write!(f, "{n}"),
            ParamValue::Bool(b) => write!(f, "{b}"),
            ParamValue::Choice(word) => write!(f, "\"{word}\""),
        }
    }
}
