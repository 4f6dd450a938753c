//! Types of values that only scenarios have.

use model::field::{Field, Typed};
use model::kind::{Kind, Range};
use model::value::Value;
use nalgebra::Point2;

/// The name of a robot, or the beginning of names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Id(pub(crate) String);

/// The name of a planner, which may be unknown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PlannerName(pub(crate) String);

model::choice! {
    /// What is to stand between the planner of a robot and its body.
    pub(crate) enum FilterChoice {
        Auto = "auto",
        None = "none",
        SharedGap = "shared-gap",
    }
}

/// A place, and perhaps the heading there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pose {
    /// The place, m.
    pub(crate) at: Point2<f64>,
    /// The heading, rad; `None` is any.
    pub(crate) yaw_rad: Option<f64>,
}

/// A number for each joint or link of an arm, the one at the base first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Joints(pub(crate) [f64; 2]);

/// From the first to the second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval(pub(crate) [f64; 2]);

/// A number of robots; `None` is all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Arrivals(pub(crate) Option<usize>);

/// A number of rounds; `None` is without end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Rounds(pub(crate) Option<u32>);

/// Wrappers: a scenario gives what is in them, but other values of that type do not fit.
macro_rules! wrappers {
    ($($name:ident($inner:ty): $kind:expr;)+) => {
        $(impl Typed for $name {
            const KIND: Kind = $kind;
        }

        impl Field for $name {
            fn from_value(value: &Value) -> Option<$name> {
                <$inner>::from_value(value).map($name)
            }

            fn to_value(&self) -> Value {
                self.0.to_value()
            }
        })+
    };
}

wrappers! {
    Id(String): Kind::Id(32);
    PlannerName(String): Kind::Planner;
    Joints([f64; 2]): Kind::Joints(Range::ANY);
    Interval([f64; 2]): Kind::Interval;
}

impl Typed for Pose {
    const KIND: Kind = Kind::Pose;
}

impl Field for Pose {
    fn from_value(value: &Value) -> Option<Pose> {
        match value.list()? {
            [x, y, yaw @ ..] => {
                let yaw_rad = yaw.first().and_then(f64::from_value);
                Some(Pose { at: Point2::new(f64::from_value(x)?, f64::from_value(y)?), yaw_rad })
            }
            _ => None,
        }
    }

    fn to_value(&self) -> Value {
        let numbers = [Some(self.at.x), Some(self.at.y), self.yaw_rad];
        Value::List(numbers.into_iter().flatten().map(Value::Float).collect())
    }
}

/// A number, or this word for all or without end.
macro_rules! counts {
    ($($name:ident($number:ty), $word:literal: $kind:expr;)+) => {
        $(impl Typed for $name {
            const KIND: Kind = $kind;
        }

        impl Field for $name {
            fn from_value(value: &Value) -> Option<$name> {
                match value {
                    Value::Text(word) if word == $word => Some($name(None)),
                    // What is too large for the type is more than there can be of anything.
                    Value::Int(number) => Some($name(Some(<$number>::try_from(*number).unwrap_or(<$number>::MAX)))),
                    _ => None,
                }
            }

            fn to_value(&self) -> Value {
                self.0.map_or_else(|| Value::Text($word.to_string()), |number| number.to_value())
            }
        })+
    };
}

counts! {
    Arrivals(usize), "all": Kind::AllOrCount;
    Rounds(u32), "forever": Kind::ForeverOrCount;
}
