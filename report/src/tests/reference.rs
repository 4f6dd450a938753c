//! docs/report.md names every field of a report, and no others.

use super::*;
use std::collections::BTreeSet;

/// A report in which every optional table is present.
fn full() -> serde_json::Value {
    let mut report = assemble(realtime(2));
    let of = || ProcessScheduling { cpus: None, class: None, priority: None };
    report.resources.scheduling = Some(SchedulingReport { world: of(), agents: of() });
    serde_json::to_value(report).unwrap()
}

fn paths(value: &serde_json::Value, at: &str, found: &mut BTreeSet<String>) {
    match value {
        serde_json::Value::Object(fields) => {
            for (name, value) in fields {
                let path = if at.is_empty() { name.clone() } else { format!("{at}.{name}") };
                // Described once: distributions, and tables that say "the fields of".
                let once = name.ends_with("_us")
                    || ["latency.world", "latency.per_robot[].blame", "resources.scheduling.world"].contains(&&*path);
                found.insert(path.clone());
                if !once {
                    paths(value, &path, found);
                }
            }
        }
        serde_json::Value::Array(items) if items.iter().any(serde_json::Value::is_object) => {
            items.iter().for_each(|item| paths(item, &format!("{at}[]"), found));
        }
        _ => {}
    }
}

#[test]
fn the_reference_names_every_field_and_no_others() {
    let mut produced = BTreeSet::new();
    paths(&full(), "", &mut produced);
    let page = include_str!("../../../docs/report.md");
    let documented: BTreeSet<String> = page
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split_once('`'))
        .map(|(path, _)| path.trim_end_matches("[]").to_owned())
        .filter(|path| !path.starts_with('*') && !model::EventName::ALL.iter().any(|(name, _)| name.word() == path))
        .collect();
    // The headings of sections stand for their tables.
    let sections = ["outcome", "per_robot", "latency", "resources", "events"];
    let expected: BTreeSet<String> = produced.into_iter().filter(|path| !sections.contains(&&**path)).collect();
    assert_eq!(documented, expected);
}

#[test]
fn the_reference_says_what_every_event_means() {
    let page = include_str!("../../../docs/report.md");
    for (name, help) in model::EventName::ALL {
        let row = format!("| `{name}` | {} |", help.trim());
        assert!(page.lines().any(|line| line == row), "docs/report.md has no line {row}");
    }
}
