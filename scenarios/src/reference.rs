//! The key table as a page for people, in Markdown: docs/scenario-reference.md.

use crate::keys::{Key, Preset, Section, Type};
use crate::table::all_sections;
use crate::walk::{describe_range, describe_type};
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
    let mut explained: Vec<(&[Key], &Section)> = Vec::new();
    for section in all_sections() {
        let _ = writeln!(page, "\n## {}\n\n{}\n", heading(section), section.help);
        for group in section.groups.iter().copied() {
            match explained.iter().find(|(known, _)| known.len() > 1 && std::ptr::eq(*known, group)) {
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
        for spec in (method.params)() {
            let unit = if spec.unit.is_empty() { String::new() } else { format!(", {}", spec.unit) };
            let _ = writeln!(page, "- `{}`: {}{unit}; default `{}`. {}", spec.name, spec.kind, spec.default, spec.help);
        }
    }
    page
}

/// How a heading names a section.
fn heading(section: &Section) -> String {
    match section.title.strip_prefix("the ") {
        Some(title) => format!("The {title}"),
        None => format!("`{}`", section.title),
    }
}

fn about(key: &Key) -> String {
    let mut text = describe_type(key.ty);
    match key.ty {
        Type::Float(range) => text = format!("{text} {}", describe_range(range)),
        Type::Joints(range) => text = format!("{text}, each {}", describe_range(range)),
        Type::Int { min, max } => text = format!("{text} {min} to {max}"),
        Type::Numbers(max) => text = format!("{text}, each 0 to {max}"),
        _ => {}
    }
    if !key.unit().is_empty() {
        let _ = write!(text, ", {}", key.unit());
    }
    match key.preset {
        Preset::Required => text.push_str("; required"),
        Preset::Absent => {}
        Preset::Value(value) => {
            let _ = write!(text, "; default `{value}`");
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
