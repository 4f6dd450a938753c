//! Checks a document against the key table: unknown keys, types, bounds, missing keys. What comes out has only
//! known keys with values of the right type; what depends on more than one value is checked later.

use crate::document::{Field, Raw, RawTable, RawValue, show};
use crate::keys::{ANY, COORDINATE, Key, LARGE, Preset, Range, Section, Type};
use crate::node::{Block, Node, Value, join};
use crate::problems::{Origin, Report, known, nearest};
use crate::table::ROOT;

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
            if key.preset == Preset::Required && section.tag != Some(key.name) && !given(key.name) {
                let what = if path.is_empty() { section.title } else { &path };
                let message = format!("needs `{}`", key.name);
                report.add_hint(origin, what, message, format!("{}: {}", key.name, describe_key(key)));
            }
        }
    }
    Node::new(section, path, origin, tag.word(), entries)
}

/// The fields of a table. Of one with more keys than anything has, the rest is not looked at.
fn bounded(table: RawTable, path: &str, origin: Origin, report: &mut Report) -> Vec<Field> {
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

fn misplaced(section: &Section, key: &Key, tag: &str, path: &str, origin: Origin, report: &mut Report) {
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

fn value(key: &'static Key, path: String, raw: Raw, report: &mut Report) -> Value {
    let origin = raw.origin;
    let wrong = |expected: &str, found: &RawValue, report: &mut Report| {
        let message = format!("expected {expected}, found {}", found.describe());
        match found {
            RawValue::Text(text) if text.parse::<f64>().is_ok() => {
                report.add_hint(origin, &path, message, "leave out the quotes");
            }
            _ => report.add(origin, &path, message),
        }
        Value::Wrong
    };
    match (key.ty, raw.value) {
        (Type::Text(max), RawValue::Text(text)) => {
            if text.len() <= max && !text.chars().any(char::is_control) {
                return Value::Text(text);
            }
            report.add(origin, &path, format!("must be one line of at most {max} bytes"));
            Value::Wrong
        }
        (Type::Id(max), RawValue::Text(text)) => match check_id(&text, max) {
            Ok(()) => Value::Text(text),
            Err(message) => {
                report.add(origin, &path, message);
                Value::Wrong
            }
        },
        (Type::Planner, RawValue::Text(text)) => Value::Text(text),
        (Type::Bool, RawValue::Bool(value)) => Value::Bool(value),
        (Type::Float(range), RawValue::Float(number)) => float(range, number, &path, origin, report),
        (Type::Float(range), RawValue::Int(number)) => float(range, number as f64, &path, origin, report),
        (Type::Int { min, max }, RawValue::Int(number)) => {
            if (min..=max).contains(&number) {
                return Value::Int(number);
            }
            report.add(origin, &path, format!("must be {min} to {max}, is {number}"));
            Value::Wrong
        }
        (Type::AllOrCount, RawValue::Int(number)) if number >= 0 => Value::Int(number),
        (Type::AllOrCount, RawValue::Text(text)) if text == "all" => Value::Word("all"),
        (Type::ForeverOrCount, RawValue::Int(number)) if (1..=u32::MAX.into()).contains(&number) => Value::Int(number),
        (Type::ForeverOrCount, RawValue::Text(text)) if text == "forever" => Value::Word("forever"),
        (Type::Choice(words), RawValue::Text(text)) => match words.iter().find(|word| **word == text) {
            Some(word) => Value::Word(word),
            None => {
                let message = format!("unknown value `{}`", text.escape_debug());
                report.add_hint(origin, &path, message, known("values", &text, words));
                Value::Wrong
            }
        },
        (Type::Pair, RawValue::List(list)) => {
            pair(list, COORDINATE, &path, origin, report).map_or(Value::Wrong, Value::Pair)
        }
        (Type::Pose, RawValue::List(list)) => pose(list, &path, origin, report),
        (Type::Joints(range), RawValue::List(list)) => {
            pair(list, range, &path, origin, report).map_or(Value::Wrong, Value::Pair)
        }
        (Type::Interval, RawValue::List(list)) => match pair(list, COORDINATE, &path, origin, report) {
            Some([low, high]) if low < high => Value::Pair([low, high]),
            Some([low, high]) => {
                report.add(origin, &path, format!("the first must be below the second, is [{low}, {high}]"));
                Value::Wrong
            }
            None => Value::Wrong,
        },
        (Type::Pairs { min, max }, RawValue::List(list)) => {
            if list.len() < min || list.len() > max {
                report.add(origin, &path, format!("must have {min} to {max} points, has {}", list.len()));
                return Value::Wrong;
            }
            pairs(list, &path, report).map_or(Value::Wrong, Value::Pairs)
        }
        (Type::Numbers(max), RawValue::List(list)) => {
            numbers(list, max, &path, origin, report).map_or(Value::Wrong, Value::Numbers)
        }
        (Type::Floats(max), RawValue::List(list)) => {
            if list.len() > max {
                report.add(origin, &path, format!("must have at most {max} numbers, has {}", list.len()));
                return Value::Wrong;
            }
            let number = |(index, raw): (usize, Raw)| entry(raw, ANY, &format!("{path}[{index}]"), report);
            let numbers: Vec<Option<f64>> = list.into_iter().enumerate().map(number).collect();
            numbers.into_iter().collect::<Option<Vec<f64>>>().map_or(Value::Wrong, Value::Floats)
        }
        (Type::Params, RawValue::Table(table)) => {
            let fields = bounded(table, &path, origin, report);
            Value::Params(Block { path, fields })
        }
        (Type::Methods, RawValue::Table(table)) => {
            let mut methods = Vec::new();
            for field in bounded(table, &path, origin, report) {
                let path = join(&path, &field.name);
                match field.value.value {
                    RawValue::Table(table) => {
                        let fields = bounded(table, &path, field.origin, report);
                        methods.push((field.name, field.origin, Block { path, fields }));
                    }
                    other => {
                        let message = format!("expected a table of parameters, found {}", other.describe());
                        report.add(field.origin, &path, message);
                    }
                }
            }
            Value::Methods(methods)
        }
        (Type::Table(section), RawValue::Table(table)) => Value::Node(node(section, path, origin, table, report)),
        (Type::Tables(section, max), RawValue::List(list)) => {
            Value::Nodes(nodes(section, max, &path, origin, list, report))
        }
        (Type::Tables(section, _), found @ RawValue::Table(_)) => {
            let message = format!("expected a list of tables, found {}", found.describe());
            report.add_hint(origin, &path, message, format!("write {} with double brackets", section.title));
            Value::Wrong
        }
        (ty, found) => wrong(&describe_type(ty), &found, report),
    }
}

/// Checks the only value of a document against a key.
#[cfg(test)]
pub(crate) fn check_value(key: &'static Key, document: RawTable, report: &mut Report) {
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

fn float(range: Range, number: f64, path: &str, origin: Origin, report: &mut Report) -> Value {
    let fits = if range.min_included { number >= range.min } else { number > range.min };
    if fits && (number <= range.max || range.infinite && number == f64::INFINITY) {
        return Value::Float(number);
    }
    let message = match number {
        _ if number.is_nan() => format!("must be a number {}, is nan", describe_range(range)),
        _ if fits => format!("must be at most {}, is {}", range.max, show(number)),
        _ => format!("must be {}, is {}", describe_range(range), show(number)),
    };
    report.add(origin, path, message);
    Value::Wrong
}

fn pairs(list: Vec<Raw>, path: &str, report: &mut Report) -> Option<Vec<[f64; 2]>> {
    let mut points = Some(Vec::new());
    for (index, item) in list.into_iter().enumerate() {
        let path = format!("{path}[{index}]");
        let point = match item.value {
            RawValue::List(list) => pair(list, COORDINATE, &path, item.origin, report),
            other => {
                report.add(item.origin, &path, format!("expected [x, y], found {}", other.describe()));
                None
            }
        };
        points = points.zip(point).map(|(mut points, point)| {
            points.push(point);
            points
        });
    }
    points
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
fn pose(mut list: Vec<Raw>, path: &str, origin: Origin, report: &mut Report) -> Value {
    if !(2..=3).contains(&list.len()) {
        let message = format!("expected [x, y] or [x, y, yaw], found a list of {}", list.len());
        report.add(origin, path, message);
        return Value::Wrong;
    }
    let yaw = list.drain(2..).next();
    let yaw_rad = yaw.map(|raw| match raw.value {
        RawValue::Float(number) => float(ANY, number, &format!("{path}[2]"), raw.origin, report),
        RawValue::Int(number) => float(ANY, number as f64, &format!("{path}[2]"), raw.origin, report),
        other => {
            let message = format!("expected a heading in rad, found {}", other.describe());
            report.add(raw.origin, &format!("{path}[2]"), message);
            Value::Wrong
        }
    });
    match (pair(list, COORDINATE, path, origin, report), yaw_rad) {
        (Some(at), None) => Value::Pose(at, None),
        (Some(at), Some(Value::Float(yaw_rad))) => Value::Pose(at, Some(yaw_rad)),
        _ => Value::Wrong,
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
    let (x, y) = (entry(x, range, &format!("{path}[0]"), report), entry(y, range, &format!("{path}[1]"), report));
    Some([x?, y?])
}

/// One number of a list.
fn entry(raw: Raw, range: Range, path: &str, report: &mut Report) -> Option<f64> {
    let number = match raw.value {
        RawValue::Float(number) => number,
        RawValue::Int(number) => number as f64,
        other => {
            report.add(raw.origin, path, format!("expected a number, found {}", other.describe()));
            return None;
        }
    };
    match float(range, number, path, raw.origin, report) {
        Value::Float(number) => Some(number),
        _ => None,
    }
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

/// A range in words, as in "above 0". The bound that only keeps out mistakes is not mentioned.
pub(crate) fn describe_range(range: Range) -> String {
    let Range { min, max, .. } = range;
    let end = if range.infinite { " (or inf)" } else { "" };
    match (range.min_included, max < LARGE) {
        (true, true) => format!("{min} to {max}"),
        (true, false) if min > -LARGE => format!("{min} or more{end}"),
        (true, false) => format!("within ±{max}"),
        (false, true) => format!("above {min} and at most {max}"),
        (false, false) => format!("above {min}{end}"),
    }
}

/// A type in words, as in "a number".
pub(crate) fn describe_type(ty: Type) -> String {
    match ty {
        Type::Text(_) | Type::Id(_) => "a string".to_string(),
        Type::Planner => "the name of a method".to_string(),
        Type::Bool => "true or false".to_string(),
        Type::Float(_) => "a number".to_string(),
        Type::Int { .. } => "a whole number".to_string(),
        Type::Choice(words) => format!("one of {}", words.join(", ")),
        Type::Pair => "[x, y]".to_string(),
        Type::Pose => "[x, y] or [x, y, yaw]".to_string(),
        Type::Joints(_) => "[first, second]".to_string(),
        Type::Pairs { .. } => "a list of points [[x, y], ...]".to_string(),
        Type::Numbers(_) => "a list of whole numbers".to_string(),
        Type::Floats(_) => "a list of numbers".to_string(),
        Type::Interval => "[low, high]".to_string(),
        Type::AllOrCount => "\"all\" or a whole number".to_string(),
        Type::ForeverOrCount => "\"forever\" or a whole number above 0".to_string(),
        Type::Params => "a table of parameters".to_string(),
        Type::Methods => "a table of tables of parameters".to_string(),
        Type::Table(_) => "a table".to_string(),
        Type::Tables(..) => "a list of tables".to_string(),
    }
}

pub(crate) fn describe_key(key: &Key) -> String {
    format!("{}. {}", describe_type(key.ty), key.help)
}
