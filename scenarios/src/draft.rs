//! Scenarios that are put together in code. They take the way that a file takes after its text has been read, so every
//! check, default and message is the same.

use crate::document::{Field, Raw, RawTable, RawValue};
use crate::problems::Origin;
use model::{ParamValue, ParamValues};
use nalgebra::Point2;

/// A table of a scenario that is put together in code, with the keys of a file.
///
/// ```
/// use shoal_scenarios::Draft;
///
/// let disc = Draft::new().with("shape", "disc").with("center_m", [2.0, 0.0]).with("radius_m", 0.5);
/// let robot = Draft::new().with("id", "r00").with("start_m", [0.0, 0.0]).with("goal_m", [4.0, 0.0]);
/// let scenario = Draft::new().with("clock.tick_hz", 20.0).with("obstacle", vec![disc]).with("robot", vec![robot]);
/// let scenario = scenario.scenario("example").unwrap();
/// assert_eq!((scenario.robots.len(), scenario.clock.tick_hz), (1, 20.0));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Draft(RawTable);

impl Draft {
    /// An empty table.
    pub fn new() -> Draft {
        Draft::default()
    }

    /// The same with a value at a path of keys, as in `clock.tick_hz`. A later value replaces what is in its way.
    pub fn with(mut self, path: &str, value: impl Into<DraftValue>) -> Draft {
        let mut table = &mut self.0;
        let (tables, name) = path.rsplit_once('.').map_or((None, path), |(tables, name)| (Some(tables), name));
        for step in tables.into_iter().flat_map(|tables| tables.split('.')) {
            table = table.table(step, Origin::Whole);
        }
        table.put(&[name], raw(value.into().0));
        self
    }

    /// As a document that has been read.
    pub(crate) fn document(self) -> RawTable {
        self.0
    }
}

/// A value of a [`Draft`]: a text, a number, a switch, a pair, a list, a table.
#[derive(Clone, Debug, PartialEq)]
pub struct DraftValue(RawValue);

fn raw(value: RawValue) -> Raw {
    Raw { origin: Origin::Whole, value }
}

macro_rules! values {
    ($($from:ty: $value:ident => $to:expr;)+) => {
        $(impl From<$from> for DraftValue {
            fn from($value: $from) -> DraftValue {
                DraftValue($to)
            }
        })+
    };
}

values! {
    &str: text => RawValue::Text(text.to_string());
    String: text => RawValue::Text(text);
    bool: value => RawValue::Bool(value);
    f64: number => RawValue::Float(number);
    i64: number => RawValue::Int(number.into());
    u64: number => RawValue::Int(number.into());
    usize: number => RawValue::Int(number as i128);
    [f64; 2]: pair => RawValue::List(pair.map(|number| raw(RawValue::Float(number))).into());
    Point2<f64>: point => DraftValue::from([point.x, point.y]).0;
    Vec<Draft>: tables => RawValue::List(tables.into_iter().map(|table| raw(RawValue::Table(table.0))).collect());
    Draft: table => RawValue::Table(table.0);
    &ParamValue: value => match value {
        ParamValue::Float(number) => RawValue::Float(*number),
        ParamValue::Int(number) => RawValue::Int((*number).into()),
        ParamValue::Bool(value) => RawValue::Bool(*value),
        ParamValue::Choice(word) => RawValue::Text(word.clone()),
    };
    &ParamValues: values => RawValue::Table(RawTable(values.iter().map(|(name, value)| Field {
        name: name.clone(),
        origin: Origin::Whole,
        value: raw(DraftValue::from(value).0),
    }).collect()));
}
