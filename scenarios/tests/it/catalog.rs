//! What holds for every scenario that ships with shoal.

use model::Scenario;
use shoal_scenarios::{CatalogEntry, Overrides, Paper, catalog, find_catalog, parse, parse_with_paper};

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
        // No contact is the rule; in the crowds of RVO2's demos ORCA cannot keep it.
        let touches = entry.name.starts_with("rvo2-");
        assert_eq!(scenario.expect.contacts_max > 0, touches, "{}", entry.name);
        for robot in &scenario.robots {
            assert!(robot.radio_range_m.is_finite() && robot.sensor_range_m.is_finite());
        }
    }
}

/// What a paper says about a scenario stands at its end.
#[test]
fn a_run_does_not_depend_on_what_a_paper_says() {
    let mut papers = 0;
    for entry in catalog() {
        let Some(end) = ["\n[paper]", "\n[[paper."].iter().filter_map(|mark| entry.text.find(mark)).min() else {
            continue;
        };
        // Without its paper nothing says why its robots have another size than the planner's defaults are for.
        let without = parse(entry.name, &entry.text[..end], &Overrides::default()).unwrap();
        let without = Scenario { warnings: Vec::new(), ..without };
        assert_eq!(parse(entry.name, entry.text, &Overrides::default()).unwrap(), without, "{}", entry.name);
        let (_, paper) = parse_with_paper(entry.name, entry.text, &Overrides::default()).unwrap();
        assert_ne!(paper, Paper::default(), "{}", entry.name);
        papers += 1;
    }
    assert!(papers > 20, "{papers}");
}

#[test]
fn unknown_names_are_told_the_nearest() {
    assert_eq!(find_catalog("demo-15").unwrap().name, "demo-15");
    let unknown = find_catalog("demo15").unwrap_err();
    assert_eq!(unknown.to_string(), "unknown scenario `demo15`");
    assert!(unknown.hint().ends_with("(did you mean `demo-15`?)"), "{}", unknown.hint());
}

/// docs/catalog.md, as the catalog is.
fn page() -> String {
    let mut page = "# Catalog\n\nThe scenarios that are built into shoal: `shoal run NAME`. *Robots* includes robots \
                    that join later.\nA test keeps this page equal to the catalog.\n\n\
                    | name | robots | obstacles | planner | shows |\n|---|---|---|---|---|\n"
        .to_owned();
    for entry in catalog() {
        let scenario = parse(entry.name, entry.text, &Overrides::default()).unwrap();
        let planners: std::collections::BTreeSet<_> =
            scenario.robots.iter().map(|robot| format!("`{}`", robot.planner)).collect();
        page += &format!(
            "| `{}` | {} | {} | {} | {} |\n",
            entry.name,
            scenario.robots.len(),
            scenario.obstacles.len(),
            planners.into_iter().collect::<Vec<_>>().join(", "),
            scenario.description
        );
    }
    page
}

#[test]
#[expect(clippy::disallowed_methods, reason = "the page is a file")]
fn the_page_of_the_catalog_is_up_to_date() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/catalog.md");
    let new = concat!(env!("CARGO_TARGET_TMPDIR"), "/catalog.md");
    if std::fs::read_to_string(path).unwrap_or_default() != page() {
        std::fs::write(new, page()).unwrap();
        panic!("{path} is out of date: cp {new} {path}");
    }
}
