//! Values as people write them.

use model::AgentCommand;
use std::ffi::OsString;

/// A time as people write it, in seconds: `60s`, `1.5m`, `500ms`, `2h`, or a plain number of seconds.
pub fn parse_duration(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit_s = match &text[digits.len()..] {
        "" | "s" | "sec" => 1.0,
        "ms" => 1e-3,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        unit => return Err(format!("unknown unit `{unit}`; write 60s, 1.5m, 500ms, or seconds")),
    };
    match digits.trim_end().parse::<f64>() {
        Ok(number) if number.is_finite() && number > 0.0 => Ok(number * unit_s),
        Ok(_) => Err("a duration must be above zero".to_string()),
        Err(_) => Err("not a time; write 60s, 1.5m, 500ms, or seconds".to_string()),
    }
}

/// A program and its arguments, with quotes and backslashes as in a shell. Nothing is expanded.
pub(super) fn parse_command(text: &str) -> Result<AgentCommand, String> {
    let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None::<char>);
    let mut chars = text.chars();
    while let Some(c) = chars.next() {
        match (c, quote) {
            (c, Some(end)) if c == end => quote = None,
            ('\'' | '"', None) => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            ('\\', None | Some('"')) => {
                let next = chars.next().ok_or("it ends with a backslash; write two of them")?;
                word.get_or_insert_default().push(next);
            }
            (c, None) if c.is_whitespace() => words.extend(word.take()),
            (c, _) => word.get_or_insert_default().push(c),
        }
    }
    if let Some(quote) = quote {
        return Err(format!("a quote {quote} has no end"));
    }
    words.extend(word);
    if words.is_empty() {
        Err("it is empty; write a program, as in \"python3 my.py\"".to_string())
    } else {
        Ok(AgentCommand::Words(words))
    }
}

/// How many robots a bench is to have: one less than a fleet can hold, because one more joins.
pub(super) fn parse_robots(text: &str) -> Result<usize, String> {
    let most = model::MAX_ROBOTS - 1;
    match text.trim().parse() {
        Ok(robots) if (1..=most).contains(&robots) => Ok(robots),
        _ => Err(format!("`{text}` is not a number of robots; write sizes from 1 to {most}, as in 15,64,200")),
    }
}

/// A place that begins with a minus is not an option: it gets a space in front, which numbers may have.
pub fn not_an_option(word: OsString) -> OsString {
    let is_place = |bytes: &[u8]| matches!(bytes, [b'-', b'0'..=b'9' | b'.', ..]) && bytes.contains(&b',');
    if !is_place(word.as_encoded_bytes()) {
        return word;
    }
    let mut spaced = OsString::from(" ");
    spaced.push(word);
    spaced
}

/// A point as people write it: `X,Y`, m.
pub fn parse_point(text: &str) -> Result<[f64; 2], String> {
    let Some((x, y)) = text.split_once(',') else {
        return Err("not a point; write X,Y in metres, as in 4,-2.5".to_string());
    };
    Ok([parse_number(x)?, parse_number(y)?])
}

/// Where to go, and which way to look there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The place, m.
    pub at_m: [f64; 2],
    /// The heading, rad; `None` is any.
    pub yaw_rad: Option<f64>,
}

/// A place as people write it, with a heading or without: `X,Y` or `X,Y,YAW`.
pub fn parse_pose(text: &str) -> Result<Pose, String> {
    let parts: Vec<&str> = text.split(',').collect();
    let (x, y, yaw) = match parts[..] {
        [x, y] => (x, y, None),
        [x, y, yaw] => (x, y, Some(yaw)),
        _ => return Err("not a place; write X,Y in metres, as in 4,-2.5, or X,Y,YAW with a heading in rad".to_string()),
    };
    Ok(Pose { at_m: [parse_number(x)?, parse_number(y)?], yaw_rad: yaw.map(parse_number).transpose()? })
}

/// A length of time, s: a number above 0.
pub(super) fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds = parse_number(text)?;
    if seconds > 0.0 { Ok(seconds) } else { Err(format!("`{text}` is not a length of time")) }
}

pub(super) fn parse_number(text: &str) -> Result<f64, String> {
    let text = text.trim();
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(format!("`{text}` is not a number")),
    }
}
