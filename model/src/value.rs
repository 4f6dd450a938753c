//! Values of keys as data.

use crate::params::ParamValue;
use std::fmt;

/// The value of a key.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A real number.
    Float(f64),
    /// A whole number.
    Int(i128),
    /// A switch.
    Bool(bool),
    /// A text, or one word out of a list.
    Text(String),
    /// A list.
    List(Vec<Value>),
}

/// As TOML.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Float(x) => write!(f, "{x}"),
            Value::Int(n) => write!(f, "{n}"),
            Value::Bool(b) => write!(f, "{b}"),
            Value::Text(text) => write!(f, "\"{text}\""),
            Value::List(list) => {
                let list: Vec<String> = list.iter().map(Value::to_string).collect();
                write!(f, "[{}]", list.join(", "))
            }
        }
    }
}

impl From<&ParamValue> for Value {
    fn from(value: &ParamValue) -> Value {
        match value {
            ParamValue::Float(x) => Value::Float(*x),
            ParamValue::Int(n) => Value::Int((*n).into()),
            ParamValue::Bool(b) => Value::Bool(*b),
            ParamValue::Choice(word) => Value::Text(word.clone()),
        }
    }
}

impl Value {
    /// As the value of a parameter; `None` for a list.
    pub fn to_param(&self) -> Option<ParamValue> {
        match self {
            Value::Float(x) => Some(ParamValue::Float(*x)),
            Value::Int(n) => i64::try_from(*n).ok().map(ParamValue::Int),
            Value::Bool(b) => Some(ParamValue::Bool(*b)),
            Value::Text(word) => Some(ParamValue::Choice(word.clone())),
            Value::List(_) => None,
        }
    }

    /// Its entries, if it is a list.
    pub fn list(&self) -> Option<&[Value]> {
        if let Value::List(list) = self { Some(list) } else { None }
    }
}
