//! The key table as JSON Schema, for editors.

use crate::table::{ROOT, all_sections};
use model::agent::{WORD_MAX, WORDS_MAX};
use model::kind::{Kind, Preset, Range, Section, Spec};
use model::value;
use planners::{METHODS, Method};
use serde_json::{Map, Value, json};
use std::fmt::Write;

/// The scenario format as JSON Schema (2020-12), the methods and their parameters included.
pub fn schema() -> Value {
    let mut definitions = Map::new();
    for section in all_sections().into_iter().skip(1) {
        definitions.insert(name(section).to_string(), section_schema(section));
    }
    for method in METHODS {
        definitions.insert(format!("params.{}", method.name), params_schema(method));
    }
    let mut schema = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "shoal scenario",
    });
    if let (Value::Object(schema), Value::Object(root)) = (&mut schema, section_schema(&ROOT)) {
        schema.extend(root);
        schema.insert("$defs".to_string(), Value::Object(definitions));
    }
    schema
}

/// A section's name: its title without brackets.
fn name(section: &Section) -> &'static str {
    section.title.trim_matches(['[', ']'])
}

fn section_schema(section: &Section) -> Value {
    if section.words().is_empty() {
        return object_schema(section.help, section, None);
    }
    let variants: Vec<Value> =
        section.words().iter().map(|word| object_schema(&format!("{word}."), section, Some(word))).collect();
    json!({ "description": section.help, "type": "object", "oneOf": variants })
}

fn object_schema(about: &str, section: &Section, tag: Option<&'static str>) -> Value {
    let keys: Vec<&Spec> = section.keys().filter(|key| key.goes_with(tag)).collect();
    let properties: Map<String, Value> = (keys.iter())
        .map(|key| {
            let mut schema = key_schema(key);
            if let (Some(word), true, Value::Object(schema)) = (tag, section.tag == Some(key.name), &mut schema) {
                schema.remove("enum");
                schema.insert("const".to_string(), json!(word));
            }
            (key.name.to_string(), schema)
        })
        .collect();
    let required: Vec<&str> = keys.iter().filter(|key| key.is_required()).map(|key| key.name).collect();
    json!({
        "description": about,
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": false,
    })
}

/// The schema of one key, or of one parameter of a planner.
fn key_schema(key: &Spec) -> Value {
    let mut schema = kind_schema(key.kind());
    let mut about = key.help.to_string();
    if !key.unit.is_empty() {
        let _ = write!(about, " Unit: {}.", key.unit);
    }
    match key.preset {
        Preset::Value(value) => match json_of(&value()) {
            // JSON has no infinity.
            Value::Null => _ = write!(about, " Default: {}.", value()),
            default => schema["default"] = default,
        },
        Preset::Computed(words) => _ = write!(about, " Default: {words}."),
        Preset::Required | Preset::Absent => {}
    }
    schema["description"] = json!(about);
    schema
}

fn json_of(value: &value::Value) -> Value {
    match value {
        value::Value::Bool(value) => json!(value),
        value::Value::Int(number) => serde_json::from_str(&number.to_string()).unwrap_or(Value::Null),
        // As they are written: 50, not 50.0.
        value::Value::Float(number) => serde_json::from_str(&number.to_string()).unwrap_or(Value::Null),
        value::Value::Text(text) => json!(text),
        value::Value::List(list) => list.iter().map(json_of).collect(),
    }
}

fn kind_schema(kind: Kind) -> Value {
    let point = || list(number(Range::COORDINATE), 2, 2);
    match kind {
        Kind::Text(max) => json!({ "type": "string", "maxLength": max }),
        Kind::Id(max) => json!({ "type": "string", "pattern": format!("^[a-z][a-z0-9_-]{{0,{}}}$", max - 1) }),
        Kind::Bool => json!({ "type": "boolean" }),
        Kind::Float(range) => number(range),
        Kind::Int { min, max } => {
            let mut schema = json!({ "type": "integer" });
            if min > i64::MIN.into() {
                schema["minimum"] = json!(min as i64);
            }
            if max != i64::MAX.into() {
                schema["maximum"] = json!(u64::try_from(max).unwrap_or(u64::MAX));
            }
            schema
        }
        Kind::Choice(words) => json!({ "enum": words }),
        Kind::Pair | Kind::Interval => point(),
        Kind::Pose => list(number(Range::COORDINATE), 2, 3),
        Kind::Joints(range) => list(number(range), 2, 2),
        Kind::Pairs { min, max } => list(point(), min, max),
        Kind::Numbers(max) => {
            let number = json!({ "type": "integer", "minimum": 0, "maximum": max });
            json!({ "type": "array", "items": number, "minItems": 1, "uniqueItems": true })
        }
        Kind::Floats(max) => json!({ "type": "array", "items": number(Range::ANY), "maxItems": max }),
        Kind::Command => {
            let word = json!({ "type": "string", "maxLength": WORD_MAX });
            json!({ "anyOf": [word, { "type": "array", "items": word, "minItems": 1, "maxItems": WORDS_MAX }] })
        }
        Kind::AllOrCount => json!({ "anyOf": [{ "const": "all" }, { "type": "integer", "minimum": 0 }] }),
        Kind::ForeverOrCount => json!({ "anyOf": [{ "const": "forever" }, { "type": "integer", "minimum": 1 }] }),
        Kind::Planner => json!({ "enum": METHODS.iter().map(|method| method.name).collect::<Vec<_>>() }),
        Kind::Params => {
            let methods: Vec<Value> =
                METHODS.iter().map(|method| reference(&format!("params.{}", method.name))).collect();
            json!({ "anyOf": methods })
        }
        Kind::ParamsByPlanner => {
            let methods: Map<String, Value> = (METHODS.iter())
                .map(|method| (method.name.to_string(), reference(&format!("params.{}", method.name))))
                .collect();
            json!({ "type": "object", "properties": methods, "additionalProperties": false })
        }
        Kind::Table(section) => reference(name(section)),
        Kind::Tables(section, max) => json!({ "type": "array", "items": reference(name(section)), "maxItems": max }),
    }
}

fn list(items: Value, min: usize, max: usize) -> Value {
    json!({ "type": "array", "items": items, "minItems": min, "maxItems": max })
}

fn number(Range { min, min_included, max, infinite, .. }: Range) -> Value {
    let mut schema = json!({ "type": "number" });
    if min > f64::MIN {
        schema[if min_included { "minimum" } else { "exclusiveMinimum" }] = json!(min);
    }
    if max < f64::MAX && !infinite {
        schema["maximum"] = json!(max);
    }
    schema
}

fn reference(definition: &str) -> Value {
    json!({ "$ref": format!("#/$defs/{definition}") })
}

fn params_schema(method: &Method) -> Value {
    let properties: Map<String, Value> =
        (method.params)().iter().map(|key| (key.name.to_string(), key_schema(key))).collect();
    json!({
        "description": method.summary,
        "type": "object",
        "properties": properties,
        "additionalProperties": false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document;
    use crate::problems::Report;
    use crate::walk;

    #[test]
    fn every_preset_is_a_value_of_its_key() {
        for section in all_sections() {
            for key in section.keys() {
                let Some(value) = key.default() else { continue };
                let mut report = Report::new(section.title.to_string(), Vec::new());
                let document = document::read(&format!("{} = {value}", key.name), &mut report).unwrap();
                walk::check_value(key, document, &mut report);
                assert_eq!(report.finish(), Ok(Vec::new()), "{} {}", section.title, key.name);
            }
        }
    }

    #[test]
    fn every_unit_is_the_one_in_the_name() {
        const UNITS: [(&str, &str); 12] = [
            ("_mib", "MiB"),
            ("_radps2", "rad/s²"),
            ("_radps", "rad/s"),
            ("_rad", "rad"),
            ("_mps2", "m/s²"),
            ("_mps", "m/s"),
            ("_kg", "kg"),
            ("_nm", "Nm"),
            ("_m", "m"),
            ("_s", "s"),
            ("_hz", "Hz"),
            ("_ticks", "ticks"),
        ];
        for section in all_sections() {
            for key in section.keys() {
                let name = key.name.trim_end_matches("_max").trim_end_matches("_min");
                let unit = UNITS.iter().find(|(ending, _)| name.ends_with(ending)).map_or("", |(_, unit)| unit);
                assert_eq!(key.unit, unit, "{} {}", section.title, key.name);
            }
        }
    }

    /// Results of papers are read as a list; all other keys are asked for by name.
    #[test]
    #[expect(clippy::disallowed_methods, reason = "a test of sources")]
    fn every_key_has_a_reader() {
        let src = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        let files = std::fs::read_dir(src).unwrap().map(|file| file.unwrap().path()).filter(|file| file.is_file());
        let readers: String = files.map(|file| std::fs::read_to_string(file).unwrap()).collect();
        for section in all_sections() {
            for key in section.keys() {
                let asked = readers.contains(&format!("::{}", key.name.replace('-', "_")));
                let is_result =
                    crate::Results::KEYS.iter().any(|result| (result.name, result.help) == (key.name, key.help));
                assert!(asked || is_result, "nothing reads {} {}", section.title, key.name);
            }
        }
    }

    #[test]
    fn every_key_of_the_table_is_in_the_schema() {
        let schema = schema();
        for section in all_sections() {
            let node = if std::ptr::eq(section, &ROOT) { &schema } else { &schema["$defs"][name(section)] };
            let variants = node["oneOf"].as_array().cloned().unwrap_or_else(|| vec![node.clone()]);
            for key in section.keys() {
                let found = variants.iter().any(|variant| variant["properties"].get(key.name).is_some());
                assert!(found, "{} has no `{}`", section.title, key.name);
            }
        }
    }

    #[test]
    fn references_lead_somewhere() {
        fn follow(value: &Value, schema: &Value) {
            match value {
                Value::Object(fields) => {
                    if let Some(Value::String(target)) = fields.get("$ref") {
                        let definition = target.trim_start_matches("#/$defs/");
                        assert!(schema["$defs"].get(definition).is_some(), "{target}");
                    }
                    fields.values().for_each(|inner| follow(inner, schema));
                }
                Value::Array(items) => items.iter().for_each(|inner| follow(inner, schema)),
                _ => {}
            }
        }
        let schema = schema();
        follow(&schema, &schema);
    }
}
