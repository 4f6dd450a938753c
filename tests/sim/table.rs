//! Every method in every scenario, as one table: a change of behaviour is a changed cell.
//!
//! `cargo insta review`, or `INSTA_UPDATE=always cargo test -p shoal-tests`, and then read the difference.

use scenarios::Overrides;
use shoal_tests::{Recording, catalog, catalog_names};
use std::fmt::Write;

/// Planners that search for whole paths, over and over in a crowd: a run of fifty robots and more takes them minutes.
const PLAN_FIRST: [&str; 2] = ["liquid", "pso-via-points"];

#[test]
fn planner_by_scenario() {
    let mut table = String::from(
        "scenario          planner            arrived  makespan_s  contacts  clearance_m  to_obstacle_m  deadlocked\n",
    );
    for name in catalog_names() {
        for method in planners::METHODS {
            let drives = |robot: &model::Robot| method.kinds.contains(&robot.kind);
            if name.starts_with("rvo2-") && PLAN_FIRST.contains(&method.name) {
                continue;
            }
            if !catalog(name, &Overrides::default()).robots.iter().any(drives) {
                continue;
            }
            let overrides = Overrides { planner: Some(method.name.to_string()), ..Overrides::default() };
            let report = Recording::of(&catalog(name, &overrides)).report();
            let outcome = &report.outcome;
            let number = |value: Option<f64>| value.map_or("-".to_string(), |value| format!("{value:.2}"));
            writeln!(
                table,
                "{name:<17} {:<18} {:>3}/{:<3}  {:>10}  {:>8}  {:>11}  {:>13}  {:>10}",
                method.name,
                outcome.arrived,
                report.robots,
                number(outcome.makespan_s),
                outcome.robot_contacts + outcome.obstacle_contacts,
                number(outcome.min_clearance_m),
                number(outcome.min_obstacle_clearance_m),
                outcome.deadlocked,
            )
            .unwrap();
        }
    }
    insta::assert_snapshot!(table);
}
