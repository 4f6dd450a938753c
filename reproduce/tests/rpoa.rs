//! Random particle optimisation: every row of the paper, and what becomes of the method in the runtime: with the guard,
//! on unicycles, among other robots.

use planners::{Kind, ParamValue, ParamValues};
use shoal_reproduce::environment::environments_of;
use shoal_reproduce::rpoa::{PAPER, Seeds, rpoa};
use shoal_reproduce::simulate::Run;
use shoal_reproduce::{Rows, decentralized_apf};
use std::ops::ControlFlow;

/// What does not hold, and why; the rows say it too.
const EXCEPTIONS: [&str; 3] = [
    // In these nine environments the modified rule fails as often as the basic one, in others of them.
    "environments not solved by all of 20 seeds: modified rule (lambda 1), basic rule",
    // The courses of the paper's obstacles are lost; in the specification's the APF path is no longer than RPOA's.
    "scenario 2 (rpoa_moving6)",
    // The claim is too strong: concave groups of obstacles trap the method.
    "local minima (rpoa_u_trap)",
];

#[test]
fn every_row_holds_but_the_named() {
    let mut quiet = |_: &str| ControlFlow::Continue(());
    let mut rows = Rows::new(PAPER.name, &mut quiet);
    assert!((PAPER.rows)(&mut rows).is_continue());
    let failed: Vec<_> = rows.finish().into_iter().filter(|row| !row.ok).collect();
    let items: Vec<&str> = failed.iter().map(|row| row.item.as_str()).collect();
    assert_eq!(items, EXCEPTIONS, "{failed:#?}");
    assert!(failed.iter().all(|row| !row.note.is_empty()));
}

/// With its guard the method touches nothing in any environment, at the price of not getting through some.
#[test]
fn guarded_robots_touch_nothing() {
    for environment in environments_of("rpoa_") {
        for kind in [Kind::Point, Kind::Unicycle] {
            let mut run = Run { kind, dt_s: 0.05, speed_mps_max: 1.0, ..rpoa(environment, "random", 1) };
            run.params.insert("guard".to_owned(), ParamValue::Bool(true));
            let seeds = Seeds::run(&run, 1..=5);
            let name = &environment.name;
            let solved = !["rpoa_orbiter_fast", "rpoa_squeeze", "rpoa_u_trap"].contains(&name.as_str());
            assert_eq!(seeds.collisions(), 0, "{name} {kind:?}: {seeds:?}");
            assert!(!solved || seeds.arrivals() == 5, "{name} {kind:?}: {seeds:?}");
        }
    }
}

/// Robots that all run it arrive clear of each other, with poses one tick old, also where potential fields stand still
/// for ever.
#[test]
fn teams_arrive() {
    for environment in environments_of("apf_") {
        for kind in [Kind::Point, Kind::Unicycle] {
            let run = Run {
                method: "rpoa",
                params: ParamValues::new(),
                delay_ticks: 1,
                age_known: true,
                kind,
                ..decentralized_apf::run(environment, "recommended", Kind::Point)
            };
            for seed in 1..=3 {
                let outcome = Run { seed, ..run.clone() }.run();
                let name = format!("{} {kind:?} seed {seed}", environment.name);
                assert!(outcome.arrives(), "{name}: {:?}", outcome.arrival_s);
                let clearance = outcome.robot_clearance.min(outcome.obstacle_clearance);
                assert!(clearance > 0.0, "{name}: {clearance:.3}");
            }
        }
    }
}
