//! The key table as a page for people, in Markdown: docs/scenario-reference.md.

use crate::table::all_sections;
use model::kind::{Preset, Section, Spec};
use planners::METHODS;
use std::fmt::Write;

const HEAD: &str = "\
# Scenario reference

Every section and every key of a scenario file, with its type, range, unit and default. This page is the output of
`shoal schema --format text`; `shoal schema > shoal.schema.json` writes the same as JSON Schema, for editors.

Names carry their units: `_m` is metres, `_s` seconds, `_rad` radians counter-clockwise from +x, `_mps` metres per second.
`only` lists the kinds of the section that have the key. `--set path.to.key=VALUE` replaces any key on the command line.
";

/// The scenario format as a page of Markdown: every section, every key with its type, bounds, default and meaning.
pub fn reference() -> String {
    let mut page = HEAD.to_string();
    // Keys that several sections share are explained in the first.
    let mut explained: Vec<(&[Spec], &Section)> = Vec::new();
    for section in all_sections() {
        let _ = writeln!(page, "\n## {}\n\n{}\n", heading(section), section.help);
        for group in section.groups.iter().copied() {
            match explained.iter().find(|(known, _)| known.len() > 1 && same(known, group)) {
                Some((_, first)) => {
                    let (from, to) = (group[0].name, group[group.len() - 1].name);
                    let _ = writeln!(page, "- `{from}` to `{to}`: as in {}.", heading(first));
                }
                None => {
                    explained.push((group, section));
                    for key in group {
                        let _ = writeln!(page, "- `{}`: {}", key.name, about(key));
                    }
                }
            }
        }
    }
    for method in METHODS {
        let _ = writeln!(page, "\n## `[planners.{}]`\n\n{}\n", method.name, method.summary);
        for key in &(method.params)() {
            let _ = writeln!(page, "- `{}`: {}", key.name, about(key));
        }
    }
    page
}

/// Whether two groups are one. A constant has no address of its own, so they are compared.
fn same(a: &[Spec], b: &[Spec]) -> bool {
    a.iter().map(|key| (key.name, key.help)).eq(b.iter().map(|key| (key.name, key.help)))
}

/// How a heading names a section.
fn heading(section: &Section) -> String {
    match section.title.strip_prefix("the ") {
        Some(title) => format!("The {title}"),
        None => format!("`{}`", section.title),
    }
}

fn about(key: &Spec) -> String {
    let mut text = key.kind().to_string();
    if !key.unit.is_empty() {
        let _ = write!(text, ", {}", key.unit);
    }
    match key.preset {
        Preset::Required => text.push_str("; required"),
        Preset::Absent => {}
        Preset::Value(value) => {
            let _ = write!(text, "; default `{}`", value());
        }
        Preset::Computed(words) => {
            let _ = write!(text, "; default: {words}");
        }
    }
    if !key.only.is_empty() {
        let _ = write!(text, "; only {}", key.only.join(", "));
    }
    format!("{text}. {}", key.help)
}
