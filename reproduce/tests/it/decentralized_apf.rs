//! The decentralised potential field: what becomes of its scenes in the runtime, where
//! poses are one tick old.

use model::BodyKind;
use shoal_reproduce::decentralized_apf::run;
use shoal_reproduce::scene::scene;
use shoal_reproduce::stepper::{Rules, Run};

/// With poses of this age, which the robots know.
fn with_old_poses(run: Run, delay_ticks: usize) -> Run {
    let rules = Rules { delay_ticks, age_known: true, ..run.rules };
    run.under(rules)
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
        let fresh = run(scene(name), "recommended", kind);
        let (old, fresh) = (with_old_poses(fresh.clone(), 1).run(), fresh.run());
        let tolerance_s = if name == "apf_antipodal8" { 2.5 } else { 0.3 };
        for robot in 0..fresh.bodies().len() {
            let (old_s, fresh_s) = (old.arrival_s(robot).expect("arrives"), fresh.arrival_s(robot).expect("arrives"));
            assert!((old_s - fresh_s).abs() <= tolerance_s + 1e-9, "{name} {kind:?}: {old_s:.2} against {fresh_s:.2}");
        }
        let (robots_m, discs_m) = (old.robots.clearance_m, old.obstacles.clearance_m);
        assert!(robots_m >= robot_clearance, "{name} {kind:?}: robots {robots_m:.3}");
        assert!(discs_m >= obstacle_clearance, "{name} {kind:?}: discs {discs_m:.3}");
    }
}

/// Poses half a second old let robots overlap when they are taken for fresh (the rows with ten ticks of delay). Robots
/// that know the age keep clear, and arrive later.
#[test]
fn known_age_keeps_robots_clear_of_each_other() {
    for name in ["apf_antipodal8", "apf_cross4", "apf_dynamic", "apf_headon_offset"] {
        let outcome = with_old_poses(run(scene(name), "recommended", BodyKind::Point), 10).run();
        assert!(outcome.robots.clearance_m > 0.3, "{name}: {:.3}", outcome.robots.clearance_m);
        assert!(outcome.all_arrived(), "{name}: {:?}", outcome.arrival_ticks);
    }
}

/// The other potential field gets through the same scenes with its defaults.
#[test]
fn khatib_arrives_without_contact() {
    for name in ["apf_antipodal8", "apf_cross4", "apf_dynamic", "apf_headon_offset", "apf_close_goals_15"] {
        for kind in [BodyKind::Point, BodyKind::Unicycle] {
            let outcome = with_old_poses(Run::of(scene(name), "apf", &[]).each(|robot| robot.kind = kind), 1).run();
            assert!(outcome.all_arrived(), "{name} {kind:?}: {:?}", outcome.arrival_ticks);
            let clearance = outcome.clearance_m();
            assert!(clearance > 0.15, "{name} {kind:?}: {clearance:.3}");
        }
    }
}
