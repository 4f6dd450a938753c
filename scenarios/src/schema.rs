//! The key table as JSON Schema, for editors.

use crate::keys::{ANY, COORDINATE, Key, Preset, Range, Section, Type};
use crate::table::{ROOT, all_sections};
use model::ParamValue;
use planners::{METHODS, Method, ParamKind};
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
    let keys: Vec<&Key> = section.keys().filter(|key| key.goes_with(tag)).collect();
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
    let required: Vec<&str> = keys.iter().filter(|key| key.preset == Preset::Required).map(|key| key.name).collect();
    json!({
        "description": about,
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": false,
    })
}

fn key_schema(key: &Key) -> Value {
    let mut schema = type_schema(key.ty);
    let Value::Object(fields) = &mut schema else { return schema };
    let mut about = key.help.to_string();
    if !key.unit().is_empty() {
        let _ = write!(about, " Unit: {}.", key.unit());
    }
    match key.preset {
        Preset::Value(text) => match text.trim_matches('"').parse::<f64>() {
            Ok(number) if !number.is_finite() => {
                let _ = write!(about, " Default: {text}.");
            }
            _ => {
                let default = serde_json::from_str(text).unwrap_or(Value::Null);
                fields.insert("default".to_string(), default);
            }
        },
        Preset::Computed(words) => {
            let _ = write!(about, " Default: {words}.");
        }
        Preset::Required | Preset::Absent => {}
    }
    fields.insert("description".to_string(), json!(about));
    schema
}

fn type_schema(ty: Type) -> Value {
    let point = || json!({ "type": "array", "items": number(COORDINATE), "minItems": 2, "maxItems": 2 });
    match ty {
        Type::Text(max) => json!({ "type": "string", "maxLength": max }),
        Type::Id(max) => json!({ "type": "string", "pattern": format!("^[a-z][a-z0-9_-]{{0,{}}}$", max - 1) }),
        Type::Bool => json!({ "type": "boolean" }),
        Type::Float(range) => number(range),
        Type::Int { min, max } => {
            json!({ "type": "integer", "minimum": min as i64, "maximum": u64::try_from(max).unwrap_or(u64::MAX) })
        }
        Type::Choice(words) => json!({ "enum": words }),
        Type::Pair | Type::Interval => point(),
        Type::Pose => json!({ "type": "array", "items": number(COORDINATE), "minItems": 2, "maxItems": 3 }),
        Type::Joints(range) => json!({ "type": "array", "items": number(range), "minItems": 2, "maxItems": 2 }),
        Type::Pairs { min, max } => json!({ "type": "array", "items": point(), "minItems": min, "maxItems": max }),
        Type::Numbers(max) => {
            let number = json!({ "type": "integer", "minimum": 0, "maximum": max });
            json!({ "type": "array", "items": number, "minItems": 1, "uniqueItems": true })
        }
        Type::Floats(max) => json!({ "type": "array", "items": number(ANY), "maxItems": max }),
        Type::AllOrCount => json!({ "anyOf": [{ "const": "all" }, { "type": "integer", "minimum": 0 }] }),
        Type::ForeverOrCount => json!({ "anyOf": [{ "const": "forever" }, { "type": "integer", "minimum": 1 }] }),
        Type::Planner => json!({ "enum": METHODS.iter().map(|method| method.name).collect::<Vec<_>>() }),
        Type::Params => {
            let methods: Vec<Value> =
                METHODS.iter().map(|method| reference(&format!("params.{}", method.name))).collect();
            json!({ "anyOf": methods })
        }
        Type::Methods => {
            let methods: Map<String, Value> = (METHODS.iter())
                .map(|method| (method.name.to_string(), reference(&format!("params.{}", method.name))))
                .collect();
            json!({ "type": "object", "properties": methods, "additionalProperties": false })
        }
        Type::Table(section) => reference(name(section)),
        Type::Tables(section, max) => json!({ "type": "array", "items": reference(name(section)), "maxItems": max }),
    }
}

fn number(Range { min, min_included, max, infinite }: Range) -> Value {
    let mut schema = json!({ "type": "number" });
    schema[if min_included { "minimum" } else { "exclusiveMinimum" }] = json!(min);
    if !infinite {
        schema["maximum"] = json!(max);
    }
    schema
}

fn reference(definition: &str) -> Value {
    json!({ "$ref": format!("#/$defs/{definition}") })
}

fn params_schema(method: &Method) -> Value {
    let properties: Map<String, Value> = ((method.params)().into_iter())
        .map(|spec| {
            let mut schema = match spec.kind {
                ParamKind::Float { min, max } => {
                    bounded("number", json!(min), json!(max), min > f64::MIN, max < f64::MAX)
                }
                ParamKind::Int { min, max } => {
                    bounded("integer", json!(min), json!(max), min > i64::MIN, max < i64::MAX)
                }
                ParamKind::Bool => json!({ "type": "boolean" }),
                ParamKind::Choice(words) => json!({ "enum": words }),
            };
            schema["default"] = match spec.default {
                ParamValue::Float(number) => json!(number),
                ParamValue::Int(number) => json!(number),
                ParamValue::Bool(value) => json!(value),
                ParamValue::Choice(word) => json!(word),
            };
            let unit = if spec.unit.is_empty() { String::new() } else { format!(" Unit: {}.", spec.unit) };
            schema["description"] = json!(format!("{}{unit}", spec.help));
            (spec.name.to_string(), schema)
        })
        .collect();
    json!({
        "description": method.summary,
        "type": "object",
        "properties": properties,
        "additionalProperties": false,
    })
}

fn bounded(ty: &str, min: Value, max: Value, has_min: bool, has_max: bool) -> Value {
    let mut schema = json!({ "type": ty });
    if has_min {
        schema["minimum"] = min;
    }
    if has_max {
        schema["maximum"] = max;
    }
    schema
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
                let Preset::Value(text) = key.preset else { continue };
                let mut report = Report::new(section.title.to_string(), Vec::new());
                let document = document::read(&format!("{} = {text}", key.name), &mut report).unwrap();
                walk::check_value(key, document, &mut report);
                assert_eq!(report.finish(), Ok(Vec::new()), "{} {}", section.title, key.name);
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
