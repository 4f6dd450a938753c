//! A whole fleet in one thread, under fire.

mod agent;
mod checks;
mod coverage;
mod daemon;
mod dice;
mod fleet;
mod kernel;
mod operators;
mod plan;
mod ring;
mod shared;
mod weather;
mod world;

use coverage::Coverage;
use fleet::{Came, Fleet};
use plan::Plan;
use shoal_tests::seeds;

fn storm(seed: u64, robots: Option<usize>) -> Came {
    Fleet::new(seed, Plan::new(seed, robots)).run()
}

#[test]
fn a_fleet_weathers_any_storm() {
    let mut coverage = Coverage::default();
    seeds(0..500, |seed| coverage.add(&storm(seed, None).coverage));
    assert!(coverage.missing().is_empty(), "{:?}\n{coverage}", coverage.missing());
}

/// What the environment asks for.
#[expect(clippy::disallowed_methods, reason = "how many seeds, and which one aloud")]
fn number(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{name} is to be a number, not `{text}`")))
}

/// `SHOAL_STORM_SEEDS=10000 cargo test --release -p shoal-tests --test storm -- --ignored --nocapture very_many`
#[test]
#[ignore = "takes long: the number of seeds is in SHOAL_STORM_SEEDS"]
#[expect(clippy::disallowed_methods, clippy::print_stderr, reason = "how long they took, and what they came to")]
fn fifteen_robots_weather_very_many_storms() {
    let wanted = number("SHOAL_STORM_SEEDS").unwrap_or(1000);
    // Zero: as many as the seed wants.
    let robots = Some(number("SHOAL_STORM_ROBOTS").unwrap_or(15) as usize).filter(|robots| *robots > 0);
    let (mut coverage, mut failing, began) = (Coverage::default(), Vec::new(), std::time::Instant::now());
    for seed in 0..wanted {
        // All that fail are wanted, not only the first one.
        match std::panic::catch_unwind(|| storm(seed, robots)) {
            Ok(came) => coverage.add(&came.coverage),
            Err(_) => failing.push(seed),
        }
    }
    eprintln!("{wanted} storms in {:.1} s\n{coverage}", began.elapsed().as_secs_f64());
    assert!(failing.is_empty(), "failing seeds: {failing:?}");
}

/// `SHOAL_STORM_SEED=7 cargo test -p shoal-tests --test storm -- --ignored --nocapture aloud`; with `SHOAL_STORM_ROBOTS` for
/// a fleet that is not as large as the seed wants.
#[test]
#[ignore = "tells every message of the storm in SHOAL_STORM_SEED"]
fn one_storm_aloud() {
    let robots = number("SHOAL_STORM_ROBOTS").map(|robots| robots as usize);
    let seed = number("SHOAL_STORM_SEED").unwrap_or(0);
    let mut fleet = Fleet::new(seed, Plan::new(seed, robots));
    fleet.shared.aloud = true;
    fleet.run();
}

#[test]
fn the_same_seed_is_the_same_storm() {
    seeds(0..20, |seed| assert_eq!(storm(seed, None), storm(seed, None)));
    assert_ne!(storm(1, None).trace, storm(2, None).trace);
}

/// What stands for processes, rings and boards in here is good enough that a fleet left alone does what it always does.
#[test]
fn a_fleet_that_is_left_alone_does_what_single_does() {
    seeds(0..10, |seed| {
        let plan = Plan::calm(seed);
        let scenario = plan.scenario.clone();
        let single = single::run(&scenario, &mut |_, _| std::ops::ControlFlow::Continue(()));
        assert_eq!(Fleet::new(seed, plan).run().outcome, single.expect("its methods exist"));
    });
}
