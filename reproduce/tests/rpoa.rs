//! Random particle optimisation: every row of the paper, and what becomes of the method in the runtime: with the guard,
//! on unicycles, among other robots.

use model::{BodyKind, ParamValue, ParamValues};
use shoal_reproduce::environment::{environment, environments_of};
use shoal_reproduce::rpoa::{PAPER, Seeds, field, rpoa};
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

/// Fixed discs: the field stands still. A disc on an orbit round the goal: the field drives far and never arrives. A
/// moving goal: it arrives later and drives farther. RPOA arrives everywhere here, with every seed, without contact.
#[test]
fn it_arrives_where_the_field_stands_circles_or_lags() {
    let random = |name: &str| Seeds::run(&rpoa(environment(name), "random", 1), 1..=20);
    for name in ["rpoa_static_moved4", "rpoa_orbiter", "rpoa_moving_target"] {
        let seeds = random(name);
        assert_eq!((seeds.arrivals(), seeds.collisions()), (20, 0), "{name}: {seeds:?}");
    }
    let stuck = field(environment("rpoa_static_moved4"), None).run();
    let tail = &stuck.paths[0][stuck.paths[0].len() - 100..];
    assert!(!stuck.arrives() && tail.iter().all(|p| (p - stuck.end(0)).norm() < 0.5), "{:?}", stuck.end(0));
    let circling = field(environment("rpoa_orbiter"), None).run();
    assert!(!circling.arrives() && circling.path_length(0) > 20.0, "{:.1} m", circling.path_length(0));
    let late = field(environment("rpoa_moving_target"), None).run();
    let seeds = random("rpoa_moving_target");
    assert!(late.arrival_s[0].is_some_and(|time_s| time_s > seeds.time_max()), "{:?} {seeds:?}", late.arrival_s);
}

/// Its own failures: concave groups, a disc that circles fast round the goal, and hills that overlap, through which it
/// drives.
#[test]
fn it_fails_where_it_is_known_to_fail() {
    let random = |name: &str| Seeds::run(&rpoa(environment(name), "random", 1), 1..=20);
    assert_eq!(random("rpoa_u_trap").arrivals(), 0);
    assert_eq!(random("rpoa_orbiter_fast").arrivals(), 0);
    let squeeze = random("rpoa_squeeze");
    assert!(squeeze.collisions() >= 19 && squeeze.clearance_worst() < -0.1, "{squeeze:?}");
}

#[test]
fn figures_show_who_takes_part() {
    let series = (PAPER.series)();
    let of = |name: &str| series.iter().find(|series| series.name == name).expect("it is drawn");
    // Who stands beside whom, what moves, and who arrives.
    let orbiter = of("rpoa_orbiter");
    for line in ["RPOA, random angles", "RPOA, equal angles", "APF", "goal"] {
        assert!(orbiter.lines.iter().any(|(name, _)| name == line), "{line}");
    }
    assert!(orbiter.lines.iter().any(|(name, _)| name.starts_with("course of obstacle")));
    assert!(orbiter.title.contains("APF does not arrive"), "{}", orbiter.title);
    assert_eq!(of("rpoa_orbiter_distance").lines.len(), 3);
    assert!(of("rpoa_squeeze").lines.iter().any(|(name, _)| name == "RPOA with the guard"));
}

/// With its guard the method touches nothing in any environment, at the price of not getting through some.
#[test]
fn guarded_robots_touch_nothing() {
    for environment in environments_of("rpoa_") {
        for kind in [BodyKind::Point, BodyKind::Unicycle] {
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
        for kind in [BodyKind::Point, BodyKind::Unicycle] {
            let run = Run {
                method: "rpoa",
                params: ParamValues::new(),
                delay_ticks: 1,
                age_known: true,
                kind,
                ..decentralized_apf::run(environment, "recommended", BodyKind::Point)
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
