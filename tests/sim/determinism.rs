//! The same scenario and seed give the same run, to the last bit; another seed gives another one wherever anything is
//! random; and who stands where in the list of robots is nobody's business.

use model::random::Stream;
use model::{Scenario, TimelineAction};
use shoal_tests::{Recording, build, catalog, catalog_names, scenario, seeds};

#[test]
fn the_same_again_is_the_same() {
    for name in catalog_names().filter(|name| *name != "scale-64") {
        seeds([1, 2], |seed| {
            let scenario = catalog(name, &build::seed(seed));
            let (first, second) = (Recording::of(&scenario), Recording::of(&scenario));
            assert_eq!(first.first_difference(&second), None, "{name}");
            assert_eq!(first.hash(), second.hash(), "{name}");
            assert_eq!(first.outcome, second.outcome, "{name}");
        });
    }
}

/// The seed moves starts, wandering obstacles and the radio. Where there is none of these, it changes nothing.
#[test]
fn the_seed_matters_where_anything_is_random_and_nowhere_else() {
    for (name, random) in [
        ("demo-15", true),
        ("ring-15", true),
        ("moving-obstacles", true),
        ("unicycle-15", true),
        ("head-on", false),
        ("corridor-swap", false),
        ("late-join", false),
        ("tasks", false),
    ] {
        // This planner feels everything in sight, however far.
        let planner = Some("decentralized-apf".to_string());
        let set = |seed| scenarios::Overrides { planner: planner.clone(), ..build::seed(seed) };
        let hash = |seed| Recording::of(&catalog(name, &set(seed))).hash();
        assert_eq!(hash(1) != hash(2), random, "{name}");
    }
}

#[test]
fn noise_is_drawn_from_the_seed() {
    let set = |seed| scenarios::Overrides { set: vec!["radio.noise_m=0.01".to_string()], ..build::seed(seed) };
    let hash = |seed| Recording::of(&catalog("head-on", &set(seed))).hash();
    assert_eq!(hash(1), hash(1));
    assert_ne!(hash(1), hash(2));
}

/// A scenario whose robots stand in another order, and who was where: `slots[old] = new`.
fn shuffled(scenario: &Scenario, seed: u64) -> (Scenario, Vec<usize>) {
    let count = scenario.robots.len();
    let mut order: Vec<usize> = (0..count).collect();
    let mut stream = Stream::new(seed, 0, 0, "test-shuffle");
    for i in (1..count).rev() {
        order.swap(i, stream.between(0.0, (i + 1) as f64) as usize);
    }
    let mut slots = vec![0; count];
    for (new, old) in order.iter().enumerate() {
        slots[*old] = new;
    }
    let mut shuffled = scenario.clone();
    shuffled.robots = order.iter().map(|old| scenario.robots[*old].clone()).collect();
    for event in &mut shuffled.events {
        match &mut event.what {
            TimelineAction::Join { robot }
            | TimelineAction::Leave { robot }
            | TimelineAction::Task { robot, .. }
            | TimelineAction::Fault { robot, .. } => *robot = slots[*robot],
            TimelineAction::Radio { robot, .. } => *robot = robot.map(|robot| slots[robot]),
        }
    }
    (shuffled, slots)
}

/// Sums over neighbours are rounded in another order, and the runs are chaotic: they are compared for as long as
/// rounding has not grown to something that can be seen.
#[test]
fn the_order_of_the_robots_is_nobodys_business() {
    for (name, ticks) in [("ring-15", 600), ("late-join", 1000), ("moving-obstacles", 800), ("unicycle-15", 600)] {
        seeds(1..=3, |seed| {
            let scenario = catalog(name, &build::seed(seed));
            let (other, slots) = shuffled(&scenario, seed);
            assert_ne!(slots, (0..slots.len()).collect::<Vec<_>>(), "the shuffle does something");
            let (a, b) = (Recording::of(&scenario), Recording::of(&other));
            for tick in 0..ticks.min(a.outcome.ticks).min(b.outcome.ticks) {
                for (slot, new) in slots.iter().enumerate() {
                    match (a.robot(tick, slot), b.robot(tick, *new)) {
                        (Some(a), Some(b)) => {
                            let off_m = (a.x_m - b.x_m).hypot(a.y_m - b.y_m);
                            assert!(off_m < 1e-6, "{name}, tick {tick}, robot {slot}: {off_m} m");
                        }
                        (None, None) => {}
                        _ => panic!("{name}, tick {tick}: only one of the runs has robot {slot}"),
                    }
                }
            }
        });
    }
}

/// Nobody can see anybody: exactly the same numbers, whatever the order.
#[test]
fn alone_the_order_changes_nothing_at_all() {
    let text = r#"
        [clock]
        duration_s = 20
        [defaults]
        sensor_range_m = 0.01
        radio_range_m = 0.01
        radio_hysteresis_m = 0
        sees_robots = false
        [layout]
        kind = "circle-swap"
        robots = 9
        radius_m = 7
        jitter_m = 0.3
    "#;
    let scenario = scenario(text);
    let (other, slots) = shuffled(&scenario, 5);
    let (a, b) = (Recording::of(&scenario), Recording::of(&other));
    for tick in 0..=a.outcome.ticks {
        for (slot, new) in slots.iter().enumerate() {
            let place = |recording: &Recording, slot| recording.robot(tick, slot).map(|body| (body.x_m, body.y_m));
            assert_eq!(place(&a, slot), place(&b, *new), "tick {tick}, robot {slot}");
        }
    }
}
