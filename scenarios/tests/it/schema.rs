//! The schema and the reference say what the parser does.

use planners::METHODS;
use serde_json::{Value, json};
use shoal_scenarios::{catalog, reference, schema};
use std::path::Path;

/// The schema without what every new method changes.
#[test]
fn schema_of_the_format() {
    let mut schema = schema();
    let names: Vec<&str> = METHODS.iter().map(|method| method.name).collect();
    assert_eq!(schema["$defs"]["defaults"]["properties"]["planner"]["enum"], json!(names));
    schema["$defs"].as_object_mut().unwrap().retain(|name, _| !name.starts_with("params."));
    for section in ["defaults", "kinds.point", "kinds.unicycle", "kinds.two-link-arm", "robot"] {
        let properties = &mut schema["$defs"][section]["properties"];
        properties["planner"]["enum"] = json!(["every method"]);
        properties["params"]["anyOf"] = json!(["the parameters of every method"]);
    }
    schema["$defs"]["paper.expect"]["properties"]["params"]["anyOf"] = json!(["the parameters of every method"]);
    schema["properties"]["planners"]["properties"] = json!({ "every method": "its parameters" });
    insta::assert_json_snapshot!(schema);
}

#[test]
fn every_parameter_of_every_method_is_in_the_schema() {
    let (schema, reference) = (schema(), reference());
    for method in METHODS {
        let properties = &schema["$defs"][format!("params.{}", method.name)]["properties"];
        for spec in (method.params)() {
            assert!(properties[spec.name]["default"] != Value::Null, "{}.{}", method.name, spec.name);
            assert!(reference.contains(spec.help));
        }
    }
}

/// `UPDATE_DOCS=1 cargo test -p shoal-scenarios --test it schema` rewrites the page.
#[test]
#[expect(clippy::disallowed_methods, reason = "the test is about a file of this repository")]
fn the_reference_in_docs_is_the_one_that_is_printed() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/scenario-reference.md");
    if std::env::var("UPDATE_DOCS").is_ok() {
        std::fs::write(&page, reference()).unwrap();
    }
    let kept = std::fs::read_to_string(&page).unwrap_or_default();
    for (number, (kept, printed)) in kept.lines().zip(reference().lines()).enumerate() {
        assert_eq!(kept, printed, "line {}; UPDATE_DOCS=1 writes the page", number + 1);
    }
    assert_eq!(kept.len(), reference().len(), "one of them goes on; UPDATE_DOCS=1 writes the page");
}

#[test]
fn the_catalog_uses_only_keys_of_the_schema() {
    let schema = schema();
    for entry in catalog() {
        let document: Value = toml::from_str(entry.text).unwrap();
        check(&document, &schema, &schema, entry.name);
    }
}

/// A small part of JSON Schema, enough for ours: references, objects, lists, and one of several objects by a constant.
fn check(value: &Value, schema: &Value, root: &Value, path: &str) {
    if let Some(target) = schema["$ref"].as_str() {
        return check(value, &root["$defs"][target.trim_start_matches("#/$defs/")], root, path);
    }
    if let Some(variants) = schema["oneOf"].as_array() {
        let fits = |variant: &&Value| {
            let properties = variant["properties"].as_object().unwrap();
            properties.iter().all(|(key, schema)| schema.get("const").is_none_or(|word| value[key] == *word))
        };
        let variant = variants.iter().find(fits).unwrap_or_else(|| panic!("{path}: no such kind"));
        return check(value, variant, root, path);
    }
    match (value, schema["properties"].as_object()) {
        (Value::Object(fields), Some(properties)) => {
            for (key, inner) in fields {
                let schema = properties.get(key).unwrap_or_else(|| panic!("{path}.{key} is not in the schema"));
                check(inner, schema, root, &format!("{path}.{key}"));
            }
            for key in schema["required"].as_array().into_iter().flatten() {
                assert!(fields.contains_key(key.as_str().unwrap()), "{path} needs {key}");
            }
        }
        (Value::Array(items), _) => {
            assert_eq!(schema["type"], "array", "{path}");
            items.iter().for_each(|item| check(item, &schema["items"], root, path));
        }
        (Value::String(word), _) => {
            let words = schema["enum"].as_array();
            assert!(words.is_none_or(|words| words.iter().any(|known| known == word)), "{path}: {word}");
        }
        (Value::Number(number), _) => {
            let number = number.as_f64().unwrap();
            assert!(schema["minimum"].as_f64().is_none_or(|min| number >= min), "{path}");
            assert!(schema["exclusiveMinimum"].as_f64().is_none_or(|min| number > min), "{path}");
            assert!(schema["maximum"].as_f64().is_none_or(|max| number <= max), "{path}");
        }
        _ => {}
    }
}
