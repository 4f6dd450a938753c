//! The decentralised potential field: every row of the paper, and what becomes of its environments in the runtime, where
//! poses are one tick old.

use model::{BodyKind, ParamValues};
use shoal_reproduce::decentralized_apf::{PAPER, run};
use shoal_reproduce::environment::environment;
use shoal_reproduce::{Row, Rows, simulate::Run};
use std::ops::ControlFlow;

#[test]
fn every_row_holds() {
    let mut quiet = |_: &str| ControlFlow::Continue(());
    let mut rows = Rows::new(PAPER.name, &mut quiet);
    assert!((PAPER.rows)(&mut rows).is_continue());
    let failed: Vec<Row> = rows.finish().into_iter().filter(|row| !row.ok).collect();
    assert!(failed.is_empty(), "{failed:#?}");
}

/// Robots that know how old poses are go by where the others should be now. Arrival times keep their tolerances; the
/// clearances are those found, rounded down.
#[test]
fn poses_one_tick_old_do_as_well_as_fresh_ones() {
    for (name, kind, robot_clearance, obstacle_clearance) in [
        ("apf_antipodal8", BodyKind::Point, 0.33, 0.37),
        ("apf_antipodal8", BodyKind::Unicycle, 0.34, 0.37),
        ("apf_cross4", BodyKind::Point, 0.38, 0.38),
        ("apf_cross4", BodyKind::Unicycle, 0.34, 0.37),
        ("apf_dynamic", BodyKind::Point, 0.39, 0.37),
        ("apf_dynamic", BodyKind::Unicycle, 0.77, 0.27),
        ("apf_headon_offset", BodyKind::Point, 0.38, 0.38),
        ("apf_headon_offset", BodyKind::Unicycle, 0.38, 0.38),
    ] {
        let fresh = run(environment(name), "recommended", kind);
        let old = Run { delay_ticks: 1, age_known: true, ..fresh.clone() }.run();
        let fresh = fresh.run();
        let tolerance_s = if name == "apf_antipodal8" { 2.5 } else { 0.3 };
        for (old_s, fresh_s) in old.arrival_s.iter().zip(&fresh.arrival_s) {
            let (old_s, fresh_s) = (old_s.expect("arrives"), fresh_s.expect("arrives"));
            assert!((old_s - fresh_s).abs() <= tolerance_s + 1e-9, "{name} {kind:?}: {old_s:.2} against {fresh_s:.2}");
        }
        assert!(old.robot_clearance >= robot_clearance, "{name} {kind:?}: robots {:.3}", old.robot_clearance);
        assert!(old.obstacle_clearance >= obstacle_clearance, "{name} {kind:?}: discs {:.3}", old.obstacle_clearance);
    }
}

/// Poses half a second old let robots overlap when they are taken for fresh (the rows with ten ticks of delay). Robots
/// that know the age keep clear, and arrive later.
#[test]
fn known_age_keeps_robots_clear_of_each_other() {
    for name in ["apf_antipodal8", "apf_cross4", "apf_dynamic", "apf_headon_offset"] {
        let fresh = run(environment(name), "recommended", BodyKind::Point);
        let outcome = Run { delay_ticks: 10, age_known: true, ..fresh }.run();
        assert!(outcome.robot_clearance > 0.3, "{name}: {:.3}", outcome.robot_clearance);
        assert!(outcome.arrives(), "{name}: {:?}", outcome.arrival_s);
    }
}

/// The other potential field gets through the same environments with its defaults.
#[test]
fn khatib_arrives_without_contact() {
    for name in ["apf_antipodal8", "apf_cross4", "apf_dynamic", "apf_headon_offset", "apf_close_goals_15"] {
        for kind in [BodyKind::Point, BodyKind::Unicycle] {
            let row = run(environment(name), "recommended", kind);
            let params = ParamValues::new();
            let outcome = Run { method: "apf", params, delay_ticks: 1, age_known: true, ..row }.run();
            assert!(outcome.arrives(), "{name} {kind:?}: {:?}", outcome.arrival_s);
            let clearance = outcome.robot_clearance.min(outcome.obstacle_clearance);
            assert!(clearance > 0.15, "{name} {kind:?}: {clearance:.3}");
        }
    }
}
