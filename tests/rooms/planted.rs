//! The list of planted changes, `tests/planted/changes.toml`, keeps up with the sources that it changes.

use crate::source::workspace_root;
use std::collections::BTreeSet;

/// Running the list takes minutes, so that is `tests/planted/run`; that each entry still applies is seen here.
#[test]
#[expect(clippy::disallowed_methods, reason = "it reads the sources")]
fn every_planted_change_applies_exactly_once() {
    let root = workspace_root();
    let read = |path: &str| std::fs::read_to_string(root.join(path)).unwrap_or_else(|error| panic!("{path}: {error}"));
    let list: toml::Table = read("tests/planted/changes.toml").parse().expect("the list is TOML");
    let changes = list["change"].as_array().expect("a list of changes");
    let mut wrong = Vec::new();
    let mut names = BTreeSet::new();
    let mut run = 0;
    for change in changes {
        let of =
            |key: &str| change.get(key).and_then(toml::Value::as_str).unwrap_or_else(|| panic!("{key}: {change:?}"));
        let (name, old, new) = (of("name"), of("old"), of("new"));
        let count = read(of("file")).matches(old).count();
        if count != 1 {
            wrong.push(format!("`{name}`: its old text stands {count} times in {}", of("file")));
        }
        if old == new || !names.insert(name) {
            wrong.push(format!("`{name}`: it changes nothing, or there are two of that name"));
        }
        run += usize::from(change.get("equivalent").is_none());
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(run >= 40, "{run} changes");
}
