//! Checks a document against the key table: unknown keys, types, bounds, missing keys. What comes out has only
//! known keys with values of the right type; what depends on more than one value is checked later.

use crate::document::{self, Raw, RawTable, RawValue, show};
use crate::node::{Block, Entry, Node, join};
use crate::problems::{Origin, Report, known, nearest};
use crate::table::ROOT;
use crate::types::Pose;
use model::AgentCommand;
use model::agent::{WORD_MAX, WORDS_MAX};
use model::field::Field;
use model::kind::{Kind, Range, Section, Spec};
use model::value::Value;
use nalgebra::Point2;

/// No table of the format has nearly as many keys, and none of a method's parameters.
const KEYS_MAX: usize = 200;

/// Walks a whole file.
pub(crate) fn walk(root: RawTable, report: &mut Report) -> Node {
    node(&ROOT, String::new(), Origin::Whole, root, report)
}

fn node(section: &'static Section, path: String, origin: Origin, table: RawTable, report: &mut Report) -> Node {
    let tag = tag(section, &path, origin, &table, report);
    let mut entries = Vec::new();
    for field in bounded(table, &path, origin, report) {
        let path = join(&path, &field.name);
        match section.key(&field.name, tag.word()) {
            Some(key) if key.goes_with(tag.word()) => {
                // Tables and lists may have been opened by several lines; their first key says where they are.
                let entry = value(key, path, field.value, report);
                entries.push((key.name, field.origin, entry));
            }
            Some(key) => misplaced(section, key, tag.word().unwrap_or(""), &path, field.origin, report),
            None => unknown(section, tag.word(), &field.name, &path, field.origin, report),
        }
    }
    if !matches!(tag, Tag::Wrong) {
        let given = |key: &str| entries.iter().any(|(name, ..)| *name == key);
        for key in section.keys().filter(|key| key.goes_with(tag.word())) {
            if key.is_required() && section.tag != Some(key.name) && !given(key.name) {
                let what = if path.is_empty() { section.title } else { &path };
                let message = format!("needs `{}`", key.name);
                report.add_hint(origin, what, message, format!("{}: {}", key.name, describe_key(key)));
            }
        }
    }
    Node::new(section, path, origin, tag.word(), entries)
}

/// The fields of a table. Of one with more keys than anything has, the rest is not looked at.
fn bounded(table: RawTable, path: &str, origin: Origin, report: &mut Report) -> Vec<document::Field> {
    let mut fields = table.0;
    if fields.len() > KEYS_MAX {
        report.add(origin, path, format!("has {} keys; only the first {KEYS_MAX} were checked", fields.len()));
        fields.truncate(KEYS_MAX);
    }
    fields
}

enum Tag {
    /// The section has none.
    None,
    Word(&'static str),
    /// Missing or no word, and reported.
    Wrong,
}

impl Tag {
    fn word(&self) -> Option<&'static str> {
        match self {
            Tag::Word(word) => Some(word),
            _ => None,
        }
    }
}

/// Finds out which of its kinds a section is; the value itself is reported where all values are.
fn tag(section: &'static Section, path: &str, origin: Origin, table: &RawTable, report: &mut Report) -> Tag {
    let Some(name) = section.tag else { return Tag::None };
    match table.get(name).map(|raw| &raw.value) {
        Some(RawValue::Text(text)) => {
            (section.words().iter().find(|word| *word == text)).map_or(Tag::Wrong, |word| Tag::Word(word))
        }
        Some(_) => Tag::Wrong,
        None => {
            let message = format!("needs `{name}`");
            report.add_hint(origin, path, message, format!("{name}: one of {}", section.words().join(", ")));
            Tag::Wrong
        }
    }
}

fn misplaced(section: &Section, key: &Spec, tag: &str, path: &str, origin: Origin, report: &mut Report) {
    let fitting: Vec<&str> = section.keys().filter(|key| key.goes_with(Some(tag))).map(|key| key.name).collect();
    let message = format!("does not go with {} = \"{tag}\"", section.tag.unwrap_or(""));
    let hint = format!("it belongs to {}; keys of {tag}: {}", key.only.join(", "), fitting.join(", "));
    report.add_hint(origin, path, message, hint);
}

fn unknown(section: &Section, tag: Option<&str>, name: &str, path: &str, origin: Origin, report: &mut Report) {
    let mut keys: Vec<&str> = section.keys().filter(|key| key.goes_with(tag)).map(|key| key.name).collect();
    keys.dedup();
    let mut hint = known(&format!("keys of {}", section.title), name, &keys);
    if let Some(way) = expressed(name) {
        hint = way.to_string();
    } else if nearest(name, keys.iter().copied()).is_none()
        && let Some(elsewhere) = crate::table::all_sections().into_iter().find(|other| other.key(name, None).is_some())
    {
        hint = format!("`{name}` belongs to {}", elsewhere.title);
    }
    report.add_hint(origin, path, format!("unknown key `{}`", name.escape_debug()), hint);
}

/// How to say what people look for under names of their own.
fn expressed(name: &str) -> Option<&'static str> {
    let plain = name.to_lowercase().replace('-', "_");
    let is_one_of = |names: &[&str]| names.contains(&plain.as_str());
    if is_one_of(&["goal_yaw", "goal_yaw_rad", "goal_heading", "goal_heading_rad", "goal_theta", "goal_theta_rad"]) {
        Some("the heading at the goal is the third number of goal_m = [x, y, yaw]")
    } else if is_one_of(&["loop", "repeat", "patrol", "waypoints_loop", "cyclic", "periodic"]) {
        Some("a robot goes round its waypoints_m and its goal_m with rounds = \"forever\", or rounds = 3")
    } else if is_one_of(&["turning_radius", "turning_radius_m", "min_turning_radius", "wheelbase_m"]) {
        Some("the smallest turning radius of a car-like body is turning_radius_m_min")
    } else {
        None
    }
}

fn value(key: &'static Spec, path: String, raw: Raw, report: &mut Report) -> Entry {
    let origin = raw.origin;
    let wrong = |expected: &str, found: &RawValue, report: &mut Report| {
        let message = format!("expected {expected}, found {}", found.describe());
        match found {
            RawValue::Text(text) if text.parse::<f64>().is_ok() => {
                report.add_hint(origin, &path, message, "leave out the quotes");
            }
            _ => report.add(origin, &path, message),
        }
        Entry::Wrong
    };
    match (key.kind(), raw.value) {
        (Kind::Text(max), RawValue::Text(text)) => {
            if text.len() <= max && !text.chars().any(char::is_control) {
                return entry(Some(text));
            }
            report.add(origin, &path, format!("must be one line of at most {max} bytes"));
            Entry::Wrong
        }
        (Kind::Id(max), RawValue::Text(text)) => match check_id(&text, max) {
            Ok(()) => entry(Some(text)),
            Err(message) => {
                report.add(origin, &path, message);
                Entry::Wrong
            }
        },
        (Kind::Planner, RawValue::Text(text)) => entry(Some(text)),
        (Kind::Bool, RawValue::Bool(value)) => entry(Some(value)),
        (Kind::Float(range), RawValue::Float(number)) => entry(float(range, number, &path, origin, report)),
        (Kind::Float(range), RawValue::Int(number)) => entry(float(range, number as f64, &path, origin, report)),
        (Kind::Int { min, max }, RawValue::Int(number)) => {
            if (min..=max).contains(&number) {
                return Entry::Value(Value::Int(number));
            }
            report.add(origin, &path, format!("must be {min} to {max}, is {number}"));
            Entry::Wrong
        }
        (Kind::AllOrCount, RawValue::Int(number)) if number >= 0 => Entry::Value(Value::Int(number)),
        (Kind::AllOrCount, RawValue::Text(text)) if text == "all" => entry(Some(text)),
        (Kind::ForeverOrCount, RawValue::Int(number)) if (1..=u32::MAX.into()).contains(&number) => {
            Entry::Value(Value::Int(number))
        }
        (Kind::ForeverOrCount, RawValue::Text(text)) if text == "forever" => entry(Some(text)),
        (Kind::Choice(words), RawValue::Text(text)) => {
            if words.contains(&text.as_str()) {
                return entry(Some(text));
            }
            let message = format!("unknown value `{}`", text.escape_debug());
            report.add_hint(origin, &path, message, known("values", &text, words));
            Entry::Wrong
        }
        (Kind::Pair, RawValue::List(list)) => entry(pair(list, Range::COORDINATE, &path, origin, report)),
        (Kind::Pose, RawValue::List(list)) => entry(pose(list, &path, origin, report)),
        (Kind::Joints(range), RawValue::List(list)) => entry(pair(list, range, &path, origin, report)),
        (Kind::Interval, RawValue::List(list)) => match pair(list, Range::COORDINATE, &path, origin, report) {
            Some([low, high]) if low >= high => {
                report.add(origin, &path, format!("the first must be below the second, is [{low}, {high}]"));
                Entry::Wrong
            }
            interval => entry(interval),
        },
        (Kind::Pairs { min, max }, RawValue::List(list)) => {
            if list.len() < min || list.len() > max {
                report.add(origin, &path, format!("must have {min} to {max} points, has {}", list.len()));
                return Entry::Wrong;
            }
            entry(pairs(list, &path, report))
        }
        (Kind::Numbers(max), RawValue::List(list)) => entry(numbers(list, max, &path, origin, report)),
        (Kind::Floats(max), RawValue::List(list)) => {
            if list.len() > max {
                report.add(origin, &path, format!("must have at most {max} numbers, has {}", list.len()));
                return Entry::Wrong;
            }
            let number = |(index, raw): (usize, Raw)| item(raw, Range::ANY, &format!("{path}[{index}]"), report);
            let numbers: Vec<Option<f64>> = list.into_iter().enumerate().map(number).collect();
            entry(numbers.into_iter().collect::<Option<Vec<f64>>>())
        }
        (Kind::Command, RawValue::Text(text)) => entry(word(text, &path, origin, report).map(AgentCommand::Path)),
        (Kind::Command, RawValue::List(list)) => entry(command(list, &path, origin, report)),
        (Kind::Params, RawValue::Table(table)) => {
            let fields = bounded(table, &path, origin, report);
            Entry::Params(Block { path, fields })
        }
        (Kind::ParamsByPlanner, RawValue::Table(table)) => {
            let mut planners = Vec::new();
            for field in bounded(table, &path, origin, report) {
                let path = join(&path, &field.name);
                match field.value.value {
                    RawValue::Table(table) => {
                        let fields = bounded(table, &path, field.origin, report);
                        planners.push((field.name, field.origin, Block { path, fields }));
                    }
                    other => {
                        let message = format!("expected a table of parameters, found {}", other.describe());
                        report.add(field.origin, &path, message);
                    }
                }
            }
            Entry::ParamsByPlanner(planners)
        }
        (Kind::Table(section), RawValue::Table(table)) => Entry::Node(node(section, path, origin, table, report)),
        (Kind::Tables(section, max), RawValue::List(list)) => {
            Entry::Nodes(nodes(section, max, &path, origin, list, report))
        }
        (Kind::Tables(section, _), found @ RawValue::Table(_)) => {
            let message = format!("expected a list of tables, found {}", found.describe());
            report.add_hint(origin, &path, message, format!("write {} with double brackets", section.title));
            Entry::Wrong
        }
        (kind, found) => wrong(&kind.name(), &found, report),
    }
}

/// The value of a key; none is wrong, and has been reported.
fn entry(value: Option<impl Field>) -> Entry {
    value.map_or(Entry::Wrong, |value| Entry::Value(value.to_value()))
}

/// Checks the only value of a document against a key.
#[cfg(test)]
pub(crate) fn check_value(key: &'static Spec, document: RawTable, report: &mut Report) {
    for field in document.0 {
        value(key, field.name, field.value, report);
    }
}

fn nodes(
    section: &'static Section,
    max: usize,
    path: &str,
    origin: Origin,
    list: Vec<Raw>,
    report: &mut Report,
) -> Vec<Node> {
    if list.len() > max {
        report.add(origin, path, format!("there can be at most {max}, there are {}", list.len()));
    }
    let mut nodes = Vec::new();
    for (index, item) in list.into_iter().take(max).enumerate() {
        let path = format!("{path}[{index}]");
        match item.value {
            RawValue::Table(table) => nodes.push(node(section, path, item.origin, table, report)),
            other => report.add(item.origin, &path, format!("expected a table, found {}", other.describe())),
        }
    }
    nodes
}

fn float(range: Range, number: f64, path: &str, origin: Origin, report: &mut Report) -> Option<f64> {
    if range.contains(number) {
        return Some(number);
    }
    let message = match number {
        _ if number.is_nan() => format!("must be a number {range}, is nan"),
        _ if number > range.max => format!("must be at most {}, is {}", range.max, show(number)),
        _ => format!("must be {range}, is {}", show(number)),
    };
    report.add(origin, path, message);
    None
}

fn pairs(list: Vec<Raw>, path: &str, report: &mut Report) -> Option<Vec<Point2<f64>>> {
    let mut points = Some(Vec::new());
    for (index, item) in list.into_iter().enumerate() {
        let path = format!("{path}[{index}]");
        let point = match item.value {
            RawValue::List(list) => pair(list, Range::COORDINATE, &path, item.origin, report),
            other => {
                report.add(item.origin, &path, format!("expected [x, y], found {}", other.describe()));
                None
            }
        };
        points = points.zip(point).map(|(mut points, point)| {
            points.push(point.into());
            points
        });
    }
    points
}

/// A program and its arguments.
fn command(list: Vec<Raw>, path: &str, origin: Origin, report: &mut Report) -> Option<AgentCommand> {
    if list.is_empty() || list.len() > WORDS_MAX {
        report.add_hint(
            origin,
            path,
            format!("must have 1 to {WORDS_MAX} words, has {}", list.len()),
            "write a program and its arguments, as in [\"python3\", \"my.py\"]",
        );
        return None;
    }
    let mut words = Some(Vec::new());
    for (index, item) in list.into_iter().enumerate() {
        let path = format!("{path}[{index}]");
        let found = match item.value {
            RawValue::Text(text) => word(text, &path, item.origin, report),
            other => {
                report.add(item.origin, &path, format!("expected a string, found {}", other.describe()));
                None
            }
        };
        words = words.zip(found).map(|(mut words, word)| {
            words.push(word);
            words
        });
    }
    words.map(AgentCommand::Words)
}

/// A word of a command, or a path.
fn word(text: String, path: &str, origin: Origin, report: &mut Report) -> Option<String> {
    if text.len() <= WORD_MAX && !text.chars().any(char::is_control) {
        return Some(text);
    }
    report.add(origin, path, format!("must be one line of at most {WORD_MAX} bytes"));
    None
}

fn numbers(list: Vec<Raw>, max: u16, path: &str, origin: Origin, report: &mut Report) -> Option<Vec<u16>> {
    if list.is_empty() {
        report.add_hint(origin, path, "must have at least one number", "leave the key out for its default");
        return None;
    }
    let count = list.len();
    let mut numbers = Vec::new();
    for (index, item) in list.into_iter().enumerate() {
        let path = format!("{path}[{index}]");
        match item.value {
            RawValue::Int(number) => match u16::try_from(number).ok().filter(|number| *number <= max) {
                Some(number) if numbers.contains(&number) => {
                    report.add(item.origin, &path, format!("{number} is in the list already"));
                }
                Some(number) => numbers.push(number),
                None => report.add(item.origin, &path, format!("must be 0 to {max}, is {number}")),
            },
            other => {
                report.add(item.origin, &path, format!("expected a whole number, found {}", other.describe()));
            }
        }
    }
    (numbers.len() == count).then_some(numbers)
}

/// `[x, y]`, or `[x, y, yaw]`.
fn pose(mut list: Vec<Raw>, path: &str, origin: Origin, report: &mut Report) -> Option<Pose> {
    if !(2..=3).contains(&list.len()) {
        let message = format!("expected [x, y] or [x, y, yaw], found a list of {}", list.len());
        report.add(origin, path, message);
        return None;
    }
    let yaw = list.drain(2..).next();
    let yaw_rad = yaw.map(|raw| match raw.value {
        RawValue::Float(number) => float(Range::ANY, number, &format!("{path}[2]"), raw.origin, report),
        RawValue::Int(number) => float(Range::ANY, number as f64, &format!("{path}[2]"), raw.origin, report),
        other => {
            let message = format!("expected a heading in rad, found {}", other.describe());
            report.add(raw.origin, &format!("{path}[2]"), message);
            None
        }
    });
    match (pair(list, Range::COORDINATE, path, origin, report), yaw_rad) {
        (Some(at), None) => Some(Pose { at: at.into(), yaw_rad: None }),
        (Some(at), Some(Some(yaw_rad))) => Some(Pose { at: at.into(), yaw_rad: Some(yaw_rad) }),
        _ => None,
    }
}

fn pair(list: Vec<Raw>, range: Range, path: &str, origin: Origin, report: &mut Report) -> Option<[f64; 2]> {
    let [x, y] = match <[Raw; 2]>::try_from(list) {
        Ok(pair) => pair,
        Err(list) => {
            report.add(origin, path, format!("expected two numbers, found a list of {}", list.len()));
            return None;
        }
    };
    let (x, y) = (item(x, range, &format!("{path}[0]"), report), item(y, range, &format!("{path}[1]"), report));
    Some([x?, y?])
}

/// One number of a list.
fn item(raw: Raw, range: Range, path: &str, report: &mut Report) -> Option<f64> {
    let number = match raw.value {
        RawValue::Float(number) => number,
        RawValue::Int(number) => number as f64,
        other => {
            report.add(raw.origin, path, format!("expected a number, found {}", other.describe()));
            return None;
        }
    };
    float(range, number, path, raw.origin, report)
}

/// Reports and tables name these beside the robots.
const RESERVED: [&str; 4] = ["world", "daemon", "guardian", "operator"];

/// Says what is wrong with an id, if anything is.
pub(crate) fn check_id(id: &str, max: usize) -> Result<(), String> {
    let mut chars = id.chars();
    let first = chars.next().is_some_and(|c| c.is_ascii_lowercase());
    let rest = chars.all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_' || c == '-');
    if first && rest && id.len() <= max {
        return match RESERVED.contains(&id) {
            true => Err(format!("`{id}` is the name of a process of shoal itself; a robot needs another one")),
            false => Ok(()),
        };
    }
    let shown: String = id.chars().take(max + 8).collect();
    Err(format!(
        "`{}` is not a valid id: a lower-case letter, then lower-case letters, digits, `_` and `-`, at most {max} in all",
        shown.escape_debug()
    ))
}

pub(crate) fn describe_key(key: &Spec) -> String {
    format!("{}. {}", key.kind().name(), key.help)
}
