//! Reading the specification's data files: they must have the values that are asked for.

use serde_json::Value;
use std::sync::LazyLock;

/// Deterministic results of the specification's own implementation.
pub(super) static ORACLE: LazyLock<Value> = LazyLock::new(|| read(include_str!("../../data/amr-apf-oracle.json")));
/// Worked examples.
pub(super) static VECTORS: LazyLock<Value> = LazyLock::new(|| read(include_str!("../../data/amr-apf-vectors.json")));
/// The authors' stored runs in their simulator.
pub(super) static AUTHORS: LazyLock<Value> =
    LazyLock::new(|| read(include_str!("../../data/amr-apf-authors-results.json")));

fn read(text: &str) -> Value {
    serde_json::from_str(text).expect("the data file is JSON")
}

/// The number there.
pub(super) fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is a number"))
}

/// The count there.
pub(super) fn count(value: &Value) -> usize {
    value.as_u64().unwrap_or_else(|| panic!("{value} is a count")) as usize
}

/// The flag there.
pub(super) fn flag(value: &Value) -> bool {
    value.as_bool().unwrap_or_else(|| panic!("{value} is a flag"))
}

/// The text there.
pub(super) fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_else(|| panic!("{value} is a text"))
}

/// The list there.
pub(super) fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap_or_else(|| panic!("{value} is a list"))
}

/// The pair there.
pub(super) fn pair(value: &Value) -> [f64; 2] {
    [number(&value[0]), number(&value[1])]
}

/// The numbers of a table whose keys are numbers of robots, in the order of the keys.
pub(super) fn by_robots(table: &Value) -> Vec<(usize, &Value)> {
    let table = table.as_object().unwrap_or_else(|| panic!("{table} is a table"));
    let mut rows: Vec<(usize, &Value)> =
        table.iter().map(|(n, value)| (n.parse().expect("a number of robots"), value)).collect();
    rows.sort_by_key(|(n, _)| *n);
    rows
}

/// The authors' results for this many robots: (time, s; mean path, m), the best of their tries.
pub(super) fn authors_best(table: &str, key: &str) -> Option<(f64, f64)> {
    let tries = list(AUTHORS[table].get(key)?);
    tries.iter().map(pair).map(|[time_s, path_m]| (time_s, path_m)).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// A measured number as it is printed: to a hundredth, as seconds and per cent are.
pub(super) fn hundredth(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}
