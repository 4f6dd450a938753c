//! What holds for every scenario that ships with shoal.

use shoal_scenarios::{CatalogEntry, Overrides, Scenario, catalog, find_catalog, parse};

fn resolved(entry: &CatalogEntry) -> Scenario {
    parse(&format!("{}.toml", entry.name), entry.text, &Overrides::default())
        .unwrap_or_else(|problems| panic!("{problems}"))
}

#[test]
fn every_scenario_of_the_catalog_is_valid() {
    for entry in catalog() {
        let scenario = resolved(entry);
        assert_eq!(scenario.name, entry.name);
        assert!(!scenario.description.is_empty(), "{} has a description", entry.name);
        assert_eq!(scenario.expect.contacts_max, 0, "{}: no contact is the rule", entry.name);
        for robot in &scenario.robots {
            assert!(robot.radio_range_m.is_finite() && robot.sensor_range_m.is_finite());
        }
    }
}

#[test]
fn unknown_names_are_told_the_nearest() {
    assert_eq!(find_catalog("demo-15").unwrap().name, "demo-15");
    let unknown = find_catalog("demo15").unwrap_err();
    assert_eq!(unknown.to_string(), "unknown scenario `demo15`");
    assert!(unknown.hint().ends_with("(did you mean `demo-15`?)"), "{}", unknown.hint());
}
