//! Every expectation of the paper's environments.
//!
//! Tolerances: arrival times 0.3 s (2.5 s in `apf_antipodal8`), clearances 0.02 m; where the specification gives none,
//! as for resting places, 2 % or one tick of motion (0.05 m), whichever is larger. The tolerances leave room for other
//! mathematical libraries: where this was written, every row agrees to all printed digits.

use crate::environment::{Environment, Expect};
use crate::sim::{Outcome, Variant};
use nalgebra::Point2;
use shoal_planners::{Kind, ParamValue, ParamValues};
use std::fmt::Write;

const ENVIRONMENTS: &[&str] = &[
    include_str!("../data/apf_antipodal8.toml"),
    include_str!("../data/apf_close_goals_05.toml"),
    include_str!("../data/apf_close_goals_15.toml"),
    include_str!("../data/apf_cross4.toml"),
    include_str!("../data/apf_dynamic.toml"),
    include_str!("../data/apf_headon.toml"),
    include_str!("../data/apf_headon_offset.toml"),
    include_str!("../data/apf_two_disc_trap.toml"),
];

pub(crate) fn environment(name: &str) -> Environment {
    let mut all = ENVIRONMENTS.iter().map(|text| Environment::read(text));
    all.find(|environment| environment.name == name).expect("the environment exists")
}

#[test]
fn every_expectation_is_met() {
    let mut problems = String::new();
    for environment in ENVIRONMENTS.iter().map(|text| Environment::read(text)) {
        for expect in &environment.expect {
            let (set, kind) = match expect.method.as_str() {
                "recommended-point" => ("recommended", Kind::Point),
                "recommended-differential" => ("recommended", Kind::Unicycle),
                "literal-point" => ("literal", Kind::Point),
                other => panic!("unknown rule set {other}"),
            };
            let variant = Variant::row(&environment, set, kind, expect.neighbour_pose_delay_ticks);
            let outcome = variant.run(&environment);
            for problem in compare(&environment, expect, &outcome) {
                let delay = expect.neighbour_pose_delay_ticks;
                writeln!(problems, "{} {} delay {delay}: {problem}", environment.name, expect.method).unwrap();
            }
        }
    }
    assert!(problems.is_empty(), "expectations not met:\n{problems}");
}

fn compare(environment: &Environment, expect: &Expect, outcome: &Outcome) -> Vec<String> {
    let mut problems = Vec::new();
    let mut check = |what: &str, found: f64, expected: f64, tolerance: f64| {
        let error = (found - expected).abs();
        if error.is_nan() || error > tolerance + 1e-9 {
            problems.push(format!("{what} is {found:.3}, expected {expected:.3} ± {tolerance}"));
        }
    };
    let time_tolerance_s = if environment.name == "apf_antipodal8" { 2.5 } else { 0.3 };
    for (i, expected) in expect.arrival_times.iter().enumerate() {
        let found = outcome.arrival_s[i].unwrap_or(-1.0);
        check(&format!("arrival of robot {i}"), found, *expected, time_tolerance_s);
    }
    for (what, found, expected) in [
        ("robot clearance", outcome.robot_clearance, expect.min_robot_clearance),
        ("obstacle clearance", outcome.obstacle_clearance, expect.min_obstacle_clearance),
    ] {
        if let Some(expected) = expected {
            check(what, found, expected, 0.02);
        }
    }
    for (i, end) in expect.end.iter().flatten().enumerate() {
        check(&format!("end of robot {i}"), (outcome.end[i] - Point2::from(*end)).norm(), 0.0, 0.05);
    }
    if outcome.arrival_s.iter().all(Option::is_some) != expect.arrives {
        problems.push(format!("arrives is not {}", expect.arrives));
    }
    problems
}

/// In the runtime, poses are one tick old and the robots know it: they go by where the others should be now. Arrival
/// times keep their tolerances; the clearances are those found, rounded down.
#[test]
fn poses_one_tick_old_do_as_well_as_fresh_ones() {
    for (name, kind, robot_clearance, obstacle_clearance) in [
        ("apf_antipodal8", Kind::Point, 0.33, 0.37),
        ("apf_antipodal8", Kind::Unicycle, 0.34, 0.37),
        ("apf_cross4", Kind::Point, 0.38, 0.38),
        ("apf_cross4", Kind::Unicycle, 0.34, 0.37),
        ("apf_dynamic", Kind::Point, 0.39, 0.37),
        ("apf_dynamic", Kind::Unicycle, 0.77, 0.27),
        ("apf_headon_offset", Kind::Point, 0.38, 0.38),
        ("apf_headon_offset", Kind::Unicycle, 0.38, 0.38),
    ] {
        let environment = environment(name);
        let fresh = Variant::row(&environment, "recommended", kind, 0);
        let old = Variant { delay_ticks: 1, age_known: true, ..fresh.clone() }.run(&environment);
        let fresh = fresh.run(&environment);
        let tolerance_s = if name == "apf_antipodal8" { 2.5 } else { 0.3 };
        for (old_s, fresh_s) in old.arrival_s.iter().zip(&fresh.arrival_s) {
            let (old_s, fresh_s) = (old_s.expect("arrives"), fresh_s.expect("arrives"));
            assert!((old_s - fresh_s).abs() <= tolerance_s + 1e-9, "{name} {kind:?}: {old_s:.2} against {fresh_s:.2}");
        }
        assert!(old.robot_clearance >= robot_clearance, "{name} {kind:?}: robots {:.3}", old.robot_clearance);
        assert!(old.obstacle_clearance >= obstacle_clearance, "{name} {kind:?}: discs {:.3}", old.obstacle_clearance);
    }
}

/// Poses half a second old let robots overlap when they are taken for fresh (the rows with ten ticks of delay above).
/// Robots that know the age keep clear, and arrive later.
#[test]
fn known_age_keeps_robots_clear_of_each_other() {
    for name in ["apf_antipodal8", "apf_cross4", "apf_dynamic", "apf_headon_offset"] {
        let environment = environment(name);
        let row = Variant::row(&environment, "recommended", Kind::Point, 10);
        let outcome = Variant { age_known: true, ..row }.run(&environment);
        assert!(outcome.robot_clearance > 0.3, "{name}: {:.3}", outcome.robot_clearance);
        assert!(outcome.arrival_s.iter().all(Option::is_some), "{name}: {:?}", outcome.arrival_s);
    }
}

/// The aid against deadlock frees both traps, at the times of the specification's prototype.
#[test]
fn the_aid_frees_the_traps() {
    for (name, force, push_s, expected_s) in [("apf_headon", 0.2, 1.0, 9.15), ("apf_two_disc_trap", 0.5, 3.0, 14.4)] {
        let environment = environment(name);
        let mut variant = Variant::row(&environment, "recommended", Kind::Point, 0);
        variant.params.insert("aid".into(), ParamValue::Bool(true));
        variant.params.insert("aid_force".into(), ParamValue::Float(force));
        variant.params.insert("aid_push_s".into(), ParamValue::Float(push_s));
        let arrival_s = variant.run(&environment).arrival_s[0].unwrap_or(-1.0);
        assert!((arrival_s - expected_s).abs() <= 0.3 + 1e-9, "{name}: arrives at {arrival_s:.2}");
    }
}

/// The other potential field gets through the same environments with its defaults.
#[test]
fn khatib_arrives_without_contact() {
    for name in ["apf_antipodal8", "apf_cross4", "apf_dynamic", "apf_headon_offset", "apf_close_goals_15"] {
        let environment = environment(name);
        for kind in [Kind::Point, Kind::Unicycle] {
            let row = Variant::row(&environment, "recommended", kind, 1);
            let variant = Variant { method: "apf", params: ParamValues::new(), age_known: true, ..row };
            let outcome = variant.run(&environment);
            assert!(outcome.arrival_s.iter().all(Option::is_some), "{name} {kind:?}: {:?}", outcome.arrival_s);
            let clearance = outcome.robot_clearance.min(outcome.obstacle_clearance);
            assert!(clearance > 0.15, "{name} {kind:?}: {clearance:.3}");
        }
    }
}
