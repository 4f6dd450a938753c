//! A TOML document as a tree that remembers where every value came from: a line of the file, or an option.

use crate::problems::{Origin, Report};
use std::borrow::Cow;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A value and its origin.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Raw {
    pub(crate) origin: Origin,
    pub(crate) value: RawValue,
}

/// A value of a type that TOML has.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum RawValue {
    Text(String),
    Int(i128),
    Float(f64),
    Bool(bool),
    Date(String),
    List(Vec<Raw>),
    Table(RawTable),
}

/// Keys in the order of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct RawTable(pub(crate) Vec<Field>);

/// A key and its value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Field {
    pub(crate) name: String,
    pub(crate) origin: Origin,
    pub(crate) value: Raw,
}

impl RawTable {
    /// The value of a key.
    pub(crate) fn get(&self, name: &str) -> Option<&Raw> {
        self.0.iter().find(|field| field.name == name).map(|field| &field.value)
    }

    /// Puts a value at a path of tables; where something else than a table is in the way, it is left for the walker
    /// to complain about.
    pub(crate) fn put(&mut self, path: &[&str], value: Raw) {
        let [name, rest @ ..] = path else { return };
        let slot = self.get_or_insert(name, value.origin);
        match (rest, &mut slot.value) {
            ([], _) => {
                *slot = value;
                self.own(name);
            }
            (_, RawValue::Table(inner)) => inner.put(rest, value),
            _ => {}
        }
    }

    /// The table of that name; what else has the name makes way for it.
    pub(crate) fn table(&mut self, name: &str, origin: Origin) -> &mut RawTable {
        let slot = self.get_or_insert(name, origin);
        if !matches!(slot.value, RawValue::Table(_)) {
            slot.value = RawValue::Table(RawTable::default());
        }
        match &mut slot.value {
            RawValue::Table(table) => table,
            _ => unreachable!("it is a table now"),
        }
    }

    /// Removes every key of this name, in tables and lists of tables at any depth.
    pub(crate) fn remove_all(&mut self, name: &str) {
        self.0.retain(|field| field.name != name);
        for field in &mut self.0 {
            match &mut field.value.value {
                RawValue::Table(table) => table.remove_all(name),
                RawValue::List(list) => {
                    for item in list {
                        if let RawValue::Table(table) = &mut item.value {
                            table.remove_all(name);
                        }
                    }
                }
                _ => {}
            }
        }
    }

    /// A value that was replaced has a new origin, and so has its key.
    fn own(&mut self, name: &str) {
        for field in self.0.iter_mut().filter(|field| field.name == name) {
            field.origin = field.value.origin;
        }
    }

    fn get_or_insert(&mut self, name: &str, origin: Origin) -> &mut Raw {
        let index = self.0.iter().position(|field| field.name == name).unwrap_or_else(|| {
            let value = Raw { origin, value: RawValue::Table(RawTable::default()) };
            self.0.push(Field { name: name.to_string(), origin, value });
            self.0.len() - 1
        });
        &mut self.0[index].value
    }
}

impl RawValue {
    /// What it is, for "expected a number, found ...".
    pub(crate) fn describe(&self) -> String {
        match self {
            RawValue::Text(text) if text.chars().count() > 40 => "a long string".to_string(),
            RawValue::Text(text) => format!("the string `{}`", text.escape_debug()),
            RawValue::Int(number) => format!("the whole number {number}"),
            RawValue::Float(number) => format!("the number {}", show(*number)),
            RawValue::Bool(value) => format!("`{value}`"),
            RawValue::Date(date) => format!("the date {date}"),
            RawValue::List(list) => format!("a list of {}", list.len()),
            RawValue::Table(_) => "a table".to_string(),
        }
    }
}

/// A number as TOML writes it.
pub(crate) fn show(number: f64) -> String {
    if number.is_nan() { "nan".to_string() } else { number.to_string() }
}

/// Each takes a kilobyte to read, however short it is written.
const INLINE_TABLES_MAX: usize = 20_000;

/// Reads a file's text. A syntax error stands alone.
pub(crate) fn read(text: &str, report: &mut Report) -> Option<RawTable> {
    if text.trim().is_empty() {
        report.add_hint(
            Origin::Whole,
            "",
            "the file is empty",
            "a scenario needs at least a [[robot]] with id, start_m and goal_m; `shoal schema` lists all keys",
        );
        return None;
    }
    let tables = text.matches('{').count();
    if tables > INLINE_TABLES_MAX {
        let message = format!("has {tables} `{{`, and no scenario has more than {INLINE_TABLES_MAX} inline tables");
        report.add_hint(Origin::Whole, "", message, "is it a scenario?");
        return None;
    }
    let lines = Lines::new(text);
    match DeTable::parse(text) {
        Ok(table) => Some(convert_table(table.get_ref(), &|offset| Origin::Line(lines.at(offset)))),
        Err(error) => {
            let line = error.span().map(|span| lines.at(span.start));
            let message = format!("not valid TOML: {}", error.message().replace('\n', ", "));
            match line.and_then(|line| text.lines().nth(line - 1).filter(|text| text.len() <= 100)) {
                Some(source) => report.add_hint(
                    line.map_or(Origin::Whole, Origin::Line),
                    "",
                    message,
                    format!("the line reads `{}`", source.trim()),
                ),
                None => report.add(line.map_or(Origin::Whole, Origin::Line), "", message),
            }
            None
        }
    }
}

/// Applies `path.to.key=VALUE` to a document.
pub(crate) fn set(table: &mut RawTable, assignment: &str, origin: Origin, report: &mut Report) {
    let Some((path, value)) = assignment.split_once('=') else {
        report.add_hint(origin, "", "has no `=`", "write --set path.to.key=VALUE, as in --set clock.seed=7");
        return;
    };
    let path = path.trim();
    let value = match DeValue::parse(value.trim()) {
        Ok(value) => convert(value.get_ref(), origin, &|_| origin),
        Err(_) if is_bare(value.trim()) => Raw { origin, value: RawValue::Text(value.trim().to_string()) },
        Err(error) => {
            let message = format!("not a TOML value: {}", error.message().replace('\n', ", "));
            report.add_hint(
                origin,
                path,
                message,
                "strings with characters other than letters, digits, `-` and `_` need quotes",
            );
            return;
        }
    };
    let Some(steps) = steps(path) else {
        report.add_hint(origin, "", "is not a key path", "write a path such as robot[2].radius_m or radio.drop");
        return;
    };
    if let Err((message, hint)) = put(table, &steps, value, origin) {
        report.add_hint(origin, path, message, hint);
    }
}

/// One step of a path: a key, and an index if it names an entry of a list.
type Step<'a> = (&'a str, Option<usize>);

/// No key of a scenario lies deeper than this.
const STEPS_MAX: usize = 8;

fn steps(path: &str) -> Option<Vec<Step<'_>>> {
    let steps: Option<Vec<Step<'_>>> = (path.split('.').take(STEPS_MAX + 1))
        .map(|step| {
            let (name, index) = match step.split_once('[') {
                Some((name, index)) => (name, Some(index.strip_suffix(']')?.parse().ok()?)),
                None => (step, None),
            };
            is_bare(name).then_some((name, index))
        })
        .collect();
    steps.filter(|steps| steps.len() <= STEPS_MAX)
}

fn is_bare(word: &str) -> bool {
    !word.is_empty() && word.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_')
}

fn put(table: &mut RawTable, steps: &[Step<'_>], value: Raw, origin: Origin) -> Result<(), (String, String)> {
    let [(name, index), rest @ ..] = steps else { return Ok(()) };
    let fresh = table.get(name).is_none();
    let mut slot = table.get_or_insert(name, origin);
    if let Some(index) = *index {
        if fresh {
            slot.value = RawValue::List(Vec::new());
        }
        let RawValue::List(list) = &mut slot.value else {
            return Err((format!("`{name}` is not a list"), format!("leave out [{index}]")));
        };
        if index > list.len() {
            let hint = "an index counts the entries of the file from 0; robots of a layout are not entries".to_string();
            return Err((format!("`{name}` has {} entries, so there is no [{index}]", list.len()), hint));
        }
        if index == list.len() {
            list.push(Raw { origin, value: RawValue::Table(RawTable::default()) });
        }
        slot = &mut list[index];
    }
    if rest.is_empty() {
        *slot = value;
        if index.is_none() {
            table.own(name);
        }
        return Ok(());
    }
    match &mut slot.value {
        RawValue::Table(inner) => put(inner, rest, value, origin),
        RawValue::List(_) => Err((format!("`{name}` is a list"), format!("name an entry, as in {name}[0]"))),
        other => Err((format!("`{name}` is {}, not a table", other.describe()), "name a key of a table".to_string())),
    }
}

fn convert(value: &DeValue<'_>, origin: Origin, at: &dyn Fn(usize) -> Origin) -> Raw {
    let value = match value {
        DeValue::String(text) => RawValue::Text(text.to_string()),
        // What does not fit 128 bits is beyond every bound anyway.
        DeValue::Integer(number) => {
            let largest = if number.as_str().starts_with('-') { i128::MIN } else { i128::MAX };
            RawValue::Int(i128::from_str_radix(number.as_str(), number.radix()).unwrap_or(largest))
        }
        DeValue::Float(number) => RawValue::Float(number.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(value) => RawValue::Bool(*value),
        DeValue::Datetime(date) => RawValue::Date(date.to_string()),
        DeValue::Array(list) => {
            RawValue::List(list.iter().map(|item| convert(item.get_ref(), at(item.span().start), at)).collect())
        }
        DeValue::Table(table) => RawValue::Table(convert_table(table, at)),
    };
    Raw { origin, value }
}

fn convert_table(table: &DeTable<'_>, at: &dyn Fn(usize) -> Origin) -> RawTable {
    let mut entries: Vec<_> = table.iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    let field = |(key, value): (&Spanned<Cow<'_, str>>, &Spanned<DeValue<'_>>)| Field {
        name: key.get_ref().to_string(),
        origin: at(key.span().start),
        value: convert(value.get_ref(), at(value.span().start), at),
    };
    RawTable(entries.into_iter().map(field).collect())
}

/// Where the lines of a text begin.
struct Lines(Vec<usize>);

impl Lines {
    fn new(text: &str) -> Lines {
        Lines(std::iter::once(0).chain(text.match_indices('\n').map(|(offset, _)| offset + 1)).collect())
    }

    /// The line of a byte, counted from 1.
    fn at(&self, offset: usize) -> usize {
        self.0.partition_point(|begin| *begin <= offset)
    }
}
