//! The Rust types that keys can have, and what their values may be.

use crate::kind::{Kind, Range, Section};
use crate::value::Value;
use nalgebra::Point2;

/// A type that a key can be declared with.
pub trait Typed {
    /// What values of this type may be, if the declaration gives no bounds.
    const KIND: Kind;
}

/// A type that a reader gets.
pub trait Field: Typed + Sized {
    /// The typed value, if the given one has a fitting type.
    fn from_value(value: &Value) -> Option<Self>;
    /// The value as a scenario would give it.
    fn to_value(&self) -> Value;
}

impl Typed for f64 {
    const KIND: Kind = Kind::Float(Range::FINITE);
}

impl Field for f64 {
    fn from_value(value: &Value) -> Option<f64> {
        match *value {
            Value::Float(x) => Some(x),
            Value::Int(n) => Some(n as f64),
            _ => None,
        }
    }

    fn to_value(&self) -> Value {
        Value::Float(*self)
    }
}

macro_rules! whole_numbers {
    ($($whole:ty)+) => {
        $(impl Typed for $whole {
            const KIND: Kind = Kind::Int { min: <$whole>::MIN as i128, max: <$whole>::MAX as i128 };
        }

        impl Field for $whole {
            fn from_value(value: &Value) -> Option<$whole> {
                if let Value::Int(n) = *value { n.try_into().ok() } else { None }
            }

            fn to_value(&self) -> Value {
                Value::Int(*self as i128)
            }
        })+
    };
}

whole_numbers! { i64 u64 u32 u16 u8 usize }

impl Typed for bool {
    const KIND: Kind = Kind::Bool;
}

impl Field for bool {
    fn from_value(value: &Value) -> Option<bool> {
        if let Value::Bool(b) = *value { Some(b) } else { None }
    }

    fn to_value(&self) -> Value {
        Value::Bool(*self)
    }
}

impl Typed for String {
    const KIND: Kind = Kind::Text(4096);
}

impl Field for String {
    fn from_value(value: &Value) -> Option<String> {
        if let Value::Text(text) = value { Some(text.clone()) } else { None }
    }

    fn to_value(&self) -> Value {
        Value::Text(self.clone())
    }
}

impl Typed for [f64; 2] {
    const KIND: Kind = Kind::Pair;
}

impl Field for [f64; 2] {
    fn from_value(value: &Value) -> Option<[f64; 2]> {
        let [x, y] = value.list()? else { return None };
        Some([f64::from_value(x)?, f64::from_value(y)?])
    }

    fn to_value(&self) -> Value {
        Value::List(self.iter().map(Field::to_value).collect())
    }
}

impl Typed for Point2<f64> {
    const KIND: Kind = Kind::Pair;
}

impl Field for Point2<f64> {
    fn from_value(value: &Value) -> Option<Point2<f64>> {
        <[f64; 2]>::from_value(value).map(Point2::from)
    }

    fn to_value(&self) -> Value {
        [self.x, self.y].to_value()
    }
}

impl Typed for Vec<Point2<f64>> {
    const KIND: Kind = Kind::Pairs { min: 0, max: usize::MAX };
}

impl Typed for Vec<f64> {
    const KIND: Kind = Kind::Floats(usize::MAX);
}

impl Typed for Vec<u16> {
    const KIND: Kind = Kind::Numbers(u16::MAX);
}

impl<T: Field> Field for Vec<T>
where
    Vec<T>: Typed,
{
    fn from_value(value: &Value) -> Option<Vec<T>> {
        value.list()?.iter().map(T::from_value).collect()
    }

    fn to_value(&self) -> Value {
        Value::List(self.iter().map(Field::to_value).collect())
    }
}

/// A table: what is in it is read by the keys of its section.
#[derive(Clone, Copy, Debug)]
pub struct Table;

impl Typed for Table {
    const KIND: Kind = Kind::Table(Section::NONE);
}

/// A list of tables.
#[derive(Clone, Copy, Debug)]
pub struct Tables;

impl Typed for Tables {
    const KIND: Kind = Kind::Tables(Section::NONE, 0);
}

/// A table of parameters of one planner; the planner says which there are.
#[derive(Clone, Copy, Debug)]
pub struct Params;

impl Typed for Params {
    const KIND: Kind = Kind::Params;
}

/// A table of such tables, by planner.
#[derive(Clone, Copy, Debug)]
pub struct ParamsByPlanner;

impl Typed for ParamsByPlanner {
    const KIND: Kind = Kind::ParamsByPlanner;
}
