//! `shoal planners`: the methods that steer robots.

use crate::args::{Format, PlannersArgs};
use crate::exit::Failure;
use crate::out;
use model::kind::{Kind, Range, Spec};
use model::value;
use planners::{METHODS, Method};
use report::{Column, Page, table};
use serde_json::{Value, json};

/// Lists them, or explains one.
///
/// # Errors
/// With exit code 2, when there is no method of that name.
pub fn run(options: &PlannersArgs) -> Result<(), Failure> {
    let methods: Vec<&Method> = match &options.name {
        None => METHODS.to_vec(),
        Some(name) => vec![find(name)?],
    };
    match options.format {
        Format::Json => {
            let methods: Vec<Value> = methods.into_iter().map(method_json).collect();
            out::json(&json!({ "schema": "shoal.planners/1", "planners": methods }))
        }
        Format::Text => {
            let mut page = Page::new(out::stdout_width());
            match options.name {
                None => list(&mut page, &methods),
                Some(_) => explain(&mut page, methods[0]),
            }
            out::data(&page.into_text())
        }
    }
}

pub(super) fn find(name: &str) -> Result<&'static Method, Failure> {
    planners::find(name).ok_or_else(|| {
        let known: Vec<&str> = METHODS.iter().map(|method| method.name).collect();
        let list = known.join(", ");
        Failure::usage(format!("unknown planner `{}`", name.escape_debug())).hint(
            match planners::params::nearest(name, known) {
                Some(near) => format!("known planners: {list} (did you mean `{near}`?)"),
                None => format!("known planners: {list}"),
            },
        )
    })
}

fn list(page: &mut Page, methods: &[&Method]) {
    let pad = methods.iter().map(|method| method.name.len()).max().unwrap_or(0);
    for method in methods {
        page.words_after(&format!("{:<pad$}  ", method.name), method.summary, pad + 2);
    }
    page.gap();
    page.words("`shoal planners NAME` explains one, `shoal run --planner NAME` takes it.", 0);
}

fn explain(page: &mut Page, method: &Method) {
    page.words(&format!("{}: {}", method.name, method.summary), 2);
    if !method.source.is_empty() {
        page.gap();
        page.words(method.source, 0);
    }
    page.gap();
    page.words(&format!("It drives robots of kind {}.", kinds(method).join(", ")), 0);
    page.gap();
    let specs = (method.params)();
    if specs.is_empty() {
        return page.words("It has no parameters.", 0);
    }
    let columns = [
        Column::left("parameter", 0, 32),
        Column::left("unit", 1, 12),
        Column::right("default", 0),
        Column::left("range", 2, 40),
    ];
    let rows: Vec<Vec<String>> = (specs.iter())
        .map(|spec| vec![spec.name.into(), spec.unit.into(), default_text(spec), range_text(spec.kind())])
        .collect();
    for line in table(&columns, &rows, 2, page.width()) {
        page.line(&line);
    }
    page.gap();
    for spec in &specs {
        page.words_after(&format!("  {}: ", spec.name), spec.help, 4);
    }
    page.gap();
    page.words("Set one for all robots:", 0);
    let (name, default) = (specs[0].name, specs[0].default().map(|default| toml(&default)).unwrap_or_default());
    page.line(&format!("  shoal run --planner {0} --set planners.{0}.{name}={default}", method.name));
}

/// As TOML; a real number keeps its decimal point, which tells it from a whole number.
fn toml(value: &value::Value) -> String {
    match value {
        value::Value::Float(number) => format!("{number:?}"),
        value => value.to_string(),
    }
}

fn default_text(spec: &Spec) -> String {
    match spec.default() {
        Some(value::Value::Text(word)) => word,
        default => default.map(|default| toml(&default)).unwrap_or_default(),
    }
}

/// The bounds, or the words; what has no bounds in practice shows none.
fn range_text(kind: Kind) -> String {
    match kind {
        Kind::Float(Range { min, max, .. }) => {
            let side = |x: f64| if x.abs() > 1e300 { "any".to_string() } else { format!("{x}") };
            format!("{} .. {}", side(min), side(max))
        }
        Kind::Int { min, max } => {
            let side = |n: i128| match i64::try_from(n) {
                Ok(n) if n != i64::MIN && n != i64::MAX => n.to_string(),
                _ => "any".to_string(),
            };
            format!("{} .. {}", side(min), side(max))
        }
        Kind::Bool => "true, false".to_string(),
        Kind::Choice(words) => words.join(", "),
        kind => kind.to_string(),
    }
}

fn method_json(method: &Method) -> Value {
    let params: Vec<Value> = (method.params)().iter().map(param_json).collect();
    let source = (!method.source.is_empty()).then_some(method.source);
    let kinds = kinds(method);
    json!({ "name": method.name, "summary": method.summary, "source": source, "kinds": kinds, "params": params })
}

fn kinds(method: &Method) -> Vec<&'static str> {
    method.kinds.iter().map(|kind| kind.word()).collect()
}

fn param_json(spec: &Spec) -> Value {
    let (kind, min, max, choices) = match spec.kind() {
        Kind::Float(Range { min, max, .. }) => ("float", json!(min), json!(max), Value::Null),
        Kind::Int { min, max } => ("int", json!(min as i64), json!(max as i64), Value::Null),
        Kind::Bool => ("bool", Value::Null, Value::Null, Value::Null),
        Kind::Choice(words) => ("choice", Value::Null, Value::Null, json!(words)),
        kind => unreachable!("no parameter of a planner is {kind}"),
    };
    let default = match spec.default() {
        Some(value::Value::Float(x)) => json!(x),
        Some(value::Value::Int(n)) => json!(n as i64),
        Some(value::Value::Bool(b)) => json!(b),
        Some(value::Value::Text(word)) => json!(word),
        Some(value::Value::List(_)) | None => Value::Null,
    };
    json!({
        "name": spec.name, "unit": spec.unit, "kind": kind, "default": default,
        "min": min, "max": max, "choices": choices, "help": spec.help,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_is_explained_in_words_and_in_json() {
        for method in METHODS {
            for width in [40, 80] {
                let mut page = Page::new(width);
                explain(&mut page, method);
                let text = page.into_text();
                assert!(text.lines().all(|line| line.chars().count() <= width), "{text}");
                assert!((method.params)().iter().all(|spec| text.contains(spec.name)), "{text}");
            }
            assert_eq!(method_json(method)["name"], method.name);
        }
    }

    #[test]
    fn unknown_names_are_refused_with_the_known_ones() {
        let text = find("apff").map(|_| ()).unwrap_err().to_string();
        assert!(text.contains("unknown planner `apff`") && text.contains("did you mean `apf`"), "{text}");
    }
}
