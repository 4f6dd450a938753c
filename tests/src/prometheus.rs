//! A strict reader of the text format of Prometheus, version 0.0.4: what it takes, every collector takes.

use std::collections::BTreeSet;

/// Samples that belong together.
#[derive(Debug, Default)]
pub struct Family {
    /// Its name.
    pub name: String,
    /// Its type.
    pub kind: String,
    /// Its samples, in order.
    pub samples: Vec<Sample>,
}

/// A line with a value.
#[derive(Debug)]
pub struct Sample {
    /// The name of the family, or that with a suffix.
    pub name: String,
    /// Its labels, in order.
    pub labels: Vec<(String, String)>,
    /// Its value.
    pub value: f64,
}

/// The families of a text.
///
/// # Errors
/// With the line and what is wrong with it.
pub fn parse(text: &str) -> Result<Vec<Family>, String> {
    let mut families: Vec<Family> = Vec::new();
    let mut seen = BTreeSet::new();
    let Some(body) = text.strip_suffix('\n') else { return Err("the last line has no end".to_owned()) };
    let mut pending: Option<String> = None;
    for line in body.split('\n') {
        let wrong = |what: &str| Err(format!("{what}: `{line}`"));
        if let Some(rest) = line.strip_prefix("# HELP ") {
            let Some((name, help)) = rest.split_once(' ') else { return wrong("a help without text") };
            if !is_name(name) || families.iter().any(|family| family.name == name) {
                return wrong("not a new family");
            }
            unescaped(help, false).map_err(|problem| format!("{problem}: `{line}`"))?;
            if pending.replace(name.to_owned()).is_some() {
                return wrong("a help after a help");
            }
        } else if let Some(rest) = line.strip_prefix("# TYPE ") {
            let Some((name, kind)) = rest.split_once(' ') else { return wrong("a type without a kind") };
            if pending.take().as_deref() != Some(name) {
                return wrong("a type without its help before it");
            }
            if !["counter", "gauge", "summary"].contains(&kind) {
                return wrong("an unknown kind");
            }
            if (kind == "counter") != name.ends_with("_total") {
                return wrong("counters, and they alone, end in _total");
            }
            families.push(Family { name: name.to_owned(), kind: kind.to_owned(), samples: Vec::new() });
        } else {
            if pending.is_some() {
                return wrong("a help without a type");
            }
            let sample = sample(line).map_err(|problem| format!("{problem}: `{line}`"))?;
            let Some(family) = families.last_mut() else { return wrong("a sample without a family") };
            let suffix = sample.name.strip_prefix(family.name.as_str());
            let has_quantile = sample.labels.iter().any(|(key, _)| key == "quantile");
            match (family.kind.as_str(), suffix) {
                ("summary", Some("")) if has_quantile => {}
                ("summary", Some("_count" | "_sum")) | ("counter" | "gauge", Some("")) if !has_quantile => {}
                _ => return wrong("it does not belong to the family before it"),
            }
            if family.kind == "counter" && (sample.value.is_nan() || sample.value < 0.0) {
                return wrong("a counter below 0");
            }
            let mut key = sample.labels.clone();
            key.sort();
            if !seen.insert((sample.name.clone(), key)) {
                return wrong("a sample twice");
            }
            family.samples.push(sample);
        }
    }
    if pending.is_some() { Err("a help without a type at the end".to_owned()) } else { Ok(families) }
}

fn is_name(name: &str) -> bool {
    let begins = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_' || c == ':');
    begins && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == ':')
}

fn sample(line: &str) -> Result<Sample, String> {
    let (name, rest) = line.split_at(line.find(['{', ' ']).ok_or("no value")?);
    if !is_name(name) {
        return Err("not a name".to_owned());
    }
    let mut labels: Vec<(String, String)> = Vec::new();
    let mut rest = rest;
    if let Some(inside) = rest.strip_prefix('{') {
        rest = inside;
        while !rest.starts_with('}') {
            let (key, after) = rest.split_once("=\"").ok_or("a label without a value")?;
            if !is_name(key) || key.contains(':') || labels.iter().any(|(known, _)| known == key) {
                return Err(format!("`{key}` is not a new label"));
            }
            // Up to the first quote that is not escaped.
            let mut escaped = false;
            let end = after.find(|c: char| {
                let ends = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                ends
            });
            let (value, behind) = after.split_at(end.ok_or("a label without an end")?);
            labels.push((key.to_owned(), unescaped(value, true)?));
            rest = &behind[1..];
            match rest.strip_prefix(',') {
                Some(more) if !more.starts_with('}') => rest = more,
                None if rest.starts_with('}') => {}
                _ => return Err("labels that are not separated by one comma".to_owned()),
            }
        }
        rest = &rest[1..];
    }
    let value = rest.strip_prefix(' ').ok_or("no space before the value")?;
    let number = match value {
        "+Inf" => f64::INFINITY,
        "-Inf" => f64::NEG_INFINITY,
        "NaN" => f64::NAN,
        text if text.starts_with(|c: char| c.is_ascii_digit() || c == '-') => {
            text.parse().map_err(|_| format!("`{text}` is not a number"))?
        }
        text => return Err(format!("`{text}` is not a number")),
    };
    Ok(Sample { name: name.to_owned(), labels, value: number })
}

fn unescaped(text: &str, quotes: bool) -> Result<String, String> {
    let (mut out, mut chars) = (String::new(), text.chars());
    while let Some(c) = chars.next() {
        out.push(match c {
            '\\' => match chars.next() {
                Some('\\') => '\\',
                Some('n') => '\n',
                Some('"') if quotes => '"',
                other => return Err(format!("an unknown escape {other:?}")),
            },
            '"' if quotes => return Err("a quote that is not escaped".to_owned()),
            c => c,
        });
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_takes_what_is_right_and_nothing_else() {
        let head = "# HELP a_total It is \\\\ counted.\n# TYPE a_total counter\n";
        assert_eq!(parse(&format!("{head}a_total{{x=\"1\\\"\\n\"}} 2.5\na_total 1e3\n")).unwrap()[0].samples.len(), 2);
        let wrong = [
            format!("{head}a_total 1"),
            format!("{head}a_total 1\na_total 1\n"),
            format!("{head}a_total -1\n"),
            format!("{head}b_total 1\n"),
            format!("{head}a_total  1\n"),
            format!("{head}a_total one\n"),
            format!("{head}a_total{{x=\"1\",}} 1\n"),
            format!("{head}a_total{{x=\"1\" y=\"2\"}} 1\n"),
            format!("{head}a_total{{x=\"1\",x=\"2\"}} 1\n"),
            format!("{head}a_total{{x=\"\\t\"}} 1\n"),
            format!("{head}a_total{{x=\"1}} 1\n"),
            format!("{head}\n"),
            format!("{head}{head}"),
            "a_total 1\n".to_owned(),
            "# TYPE a_total counter\na_total 1\n".to_owned(),
            "# HELP a A.\n# TYPE a counter\na 1\n".to_owned(),
            "# HELP a A.\n# TYPE a summary\na 1\n".to_owned(),
            "# HELP a A.\n".to_owned(),
        ];
        for text in wrong {
            assert!(parse(&text).is_err(), "{text}");
        }
    }
}
