//! AMR-APF and its baseline: every row of the paper, and what the rows say about its claims.

use planners::amr_apf::Preset;
use planners::dapf::Variant;
use shoal_reproduce::amr_apf::layouts::case1;
use shoal_reproduce::amr_apf::replay::{amr, dapf};
use shoal_reproduce::amr_apf::{PAPER, deterministic};
use shoal_reproduce::{Row, Rows};
use std::ops::ControlFlow;

/// Rows that do not hold, and why not is in their notes.
const NOT_REPRODUCED: [&str; 1] = ["K3, K4 H case 1, AMR_with_clusters, 14 robots: steps of the slowest"];
/// Of the long rows.
const NOT_REPRODUCED_LONG: [&str; 1] = ["extra layouts, C1 against DAPF-max3: mean reduction"];

/// All rows in a release build; in a dev build those that are exact, because the rest take minutes there.
#[test]
fn every_row_holds_but_those_named() {
    let mut quiet = |_: &str| ControlFlow::Continue(());
    let mut rows = Rows::new(PAPER.name, &mut quiet);
    let long = !cfg!(debug_assertions);
    assert!(if long { (PAPER.rows)(&mut rows) } else { deterministic(&mut rows) }.is_continue());
    let rows = rows.finish();
    let failed: Vec<&Row> = rows.iter().filter(|row| !row.ok).collect();
    let named: Vec<&str> = failed.iter().map(|row| row.item.as_str()).collect();
    let mut expected = NOT_REPRODUCED.to_vec();
    if long {
        expected.extend(NOT_REPRODUCED_LONG);
    }
    assert_eq!(named, expected, "{failed:#?}");
    assert!(failed.iter().all(|row| !row.note.is_empty()));
    assert_eq!(rows.len(), if long { 641 } else { 322 });
}

/// What the two headline numbers are made of: 35 % is the baseline's own slowness, not other robots.
#[test]
fn one_robot_alone_is_already_a_third_faster_than_the_linear_baseline() {
    let time_s = |program: shoal_reproduce::amr_apf::replay::Program| program.run(&case1(1)).time_s();
    let (ours, lin, constant) = (time_s(amr(Preset::C1)), time_s(dapf(Variant::Lin)), time_s(dapf(Variant::Const)));
    assert!((0.33..0.38).contains(&(1.0 - ours / lin)), "{ours} against {lin}");
    assert!((0.06..0.12).contains(&(1.0 - ours / constant)), "{ours} against {constant}");
}
