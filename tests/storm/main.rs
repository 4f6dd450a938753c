//! A whole fleet in one thread, under fire: the cores of the world, of the coordinator and of the agents, and around them
//! processes that start late or not at all, stop, die and do not die, rings that are full, and operators who ask for
//! anything. A seed decides about all of it.
//!
//! ```text
//! plan      the fleet of a seed           weather     what happens to it
//! fleet     whose turn it is              checks      what has to be true whatever happens
//! world, agent, daemon                    the processes, a turn at a time: cores, and the loop of a shell
//! restarts  what policies of restarts come to    succession  daemons and worlds that die
//! kernel, shared, ring                    the machine: processes, memory, messages under way
//! operators what was asked and answered   coverage    what happened how often
//! ```
//!
//! Does it bite? These bugs were planted, one after the other. Each was found, at this seed first, and at this number of
//! the first thousand seeds:
//!
//! | planted | seed | found at | by |
//! |---|---|---|---|
//! | `Presence::die` does not raise the incarnation | 0 | 816 | world and coordinator do not agree |
//! | `NoticeQueue` leaves out answers as well when the ring is full | 1 | 522 | a request that stays unanswered |
//! | `World::close` ignores the command of a robot whose death has been reported | 2 | 442 | a robot that was given a command and stands |
//! | `World::close` lets robots in that are due | 0 | 986 | a change in the middle of a tick |
//! | `Order::Remove` drops the tasks for its robot that came with it | 6 | 163 | a request that stays unanswered |
//! | `Member::come_again` counts the lives of a slot from 0 again | 1 | 283 | an instance that is started twice |
//! | `World::leave` does not drop the tasks of the robot first | 4 | 164 | a robot that does not know what it was given |

mod agent;
mod checks;
mod coverage;
mod daemon;
mod dice;
mod fleet;
mod kernel;
mod operators;
mod plan;
mod replays;
mod restarts;
mod ring;
mod shared;
mod succession;
mod weather;
mod world;

use coverage::Coverage;
use fleet::{Came, Fleet};
use plan::Plan;
use shoal_tests::seeds;

fn storm(seed: u64, robots: Option<usize>) -> Came {
    Fleet::new(seed, Plan::new(seed, robots)).run()
}

/// Storms; each seed chooses its number of robots. `SHOAL_STORM_SEEDS` sets the number of storms, `SHOAL_STORM_ROBOTS` the
/// number of robots in each; with one of them the test prints what happened:
///
/// `SHOAL_STORM_SEEDS=10000 SHOAL_STORM_ROBOTS=15 cargo test --release -p shoal-tests --test storm -- --nocapture any_storm`
///
/// With `SHOAL_STORM_SEED=7` it is that storm alone, and every message of it is told.
#[test]
#[expect(clippy::disallowed_methods, clippy::print_stderr, reason = "how long they took, and what they came to")]
fn a_fleet_weathers_any_storm() {
    let robots = number("SHOAL_STORM_ROBOTS").map(|robots| robots as usize);
    if let Some(seed) = number("SHOAL_STORM_SEED") {
        let mut fleet = Fleet::new(seed, Plan::new(seed, robots));
        fleet.shared.aloud = true;
        fleet.run();
        return;
    }
    let wanted = number("SHOAL_STORM_SEEDS");
    let (mut coverage, mut failing, began) = (Coverage::default(), Vec::new(), std::time::Instant::now());
    for seed in 0..wanted.unwrap_or(500) {
        // All that fail are wanted, not only the first one.
        match std::panic::catch_unwind(|| storm(seed, robots)) {
            Ok(came) => coverage.add(&came.coverage),
            Err(_) => failing.push(seed),
        }
    }
    if let Some(wanted) = wanted {
        eprintln!("{wanted} storms in {:.1} s\n{coverage}", began.elapsed().as_secs_f64());
    }
    assert!(failing.is_empty(), "failing seeds: {failing:?}");
    let missing: Vec<&str> = coverage
        .missing()
        .into_iter()
        .filter(|text| !text.starts_with("faults ") && !text.starts_with("successions") && !text.starts_with("paces"))
        .collect();
    assert!(wanted.is_some() || missing.is_empty(), "{missing:?}\n{coverage}");
}

/// Seeds that failed: what was wrong, the seed, and the number of robots if it was not the seed's own.
const FAILED: [(&str, u64, Option<usize>); 14] = [
    ("a robot that was held and then died stayed held", 5, None),
    ("a robot that was stopped while it started was not waited for", 1, None),
    ("a robot that answered just before it was held stayed held", 903, None),
    ("a robot that died before the daemon heard that it had entered was running", 18, None),
    ("a robot that died before the daemon heard of its pause was paused", 246, None),
    ("a robot that left between two lives had not left", 33, None),
    ("a robot that left while it was about to be started was starting", 22, None),
    ("a life that was over before it was started was started beside the next one", 35, None),
    ("a life that was over while it waited for the one before it was started", 2005, Some(15)),
    ("a process that hung went on when its robot had left", 2330, None),
    ("a tick waited for ever for the next life of a process that did not exit", 17, None),
    ("a tick waited for a robot whose process was not asked for, because the ring was full", 39, None),
    ("a task was done and refused, because the answer was lost at the end", 303, Some(15)),
    ("notices were left out in silence", 7, None),
];

#[test]
fn what_failed_once_does_not_fail_again() {
    for (what, seed, robots) in FAILED {
        let came = std::panic::catch_unwind(|| storm(seed, robots));
        assert!(came.is_ok(), "{what}: seed {seed}");
    }
}

/// The same with operators who kill, pause, resume, mute and disturb robots: what is acknowledged is true, and in the end
/// every robot is where it should be.
#[test]
fn a_fleet_weathers_faults_on_purpose() {
    let mut coverage = Coverage::default();
    seeds(0..200, |seed| {
        let came = Fleet::new(seed, Plan::new(seed, None)).with_mischief(seed).run();
        coverage.add(&came.coverage);
    });
    let wanted = [coverage.faults_asked, coverage.faults_acknowledged, coverage.faults, coverage.faults_over];
    assert!(wanted.iter().all(|times| *times > 100), "{coverage}");
}

/// The same with operators who pause the fleet, let it go on, step it and change its rate, if it is in `lockstep`.
#[test]
fn a_fleet_weathers_pauses_and_steps() {
    let mut coverage = Coverage::default();
    seeds(0..200, |seed| {
        let came = Fleet::new(seed, Plan::new(seed, None)).with_pace(seed).run();
        coverage.add(&came.coverage);
    });
    let wanted = [coverage.paces_asked, coverage.paces_acknowledged, coverage.holds];
    assert!(wanted.iter().all(|times| *times > 500), "{coverage}");
}

/// Whatever operators do to its pace, it is the same run.
#[test]
fn a_fleet_whose_ticks_are_held_does_what_single_does() {
    let mut coverage = Coverage::default();
    seeds(0..10, |seed| {
        let plan = Plan::calm(seed);
        let scenario = plan.scenario.clone();
        let single = single::run(&scenario, &mut |_, _| std::ops::ControlFlow::Continue(()));
        let came = Fleet::new(seed, plan).with_pace(seed).run();
        assert_eq!(came.outcome, single.expect("its methods exist"));
        coverage.add(&came.coverage);
    });
    assert!(coverage.holds > 50, "{coverage}");
}

/// The same with robots of which each has its own restart policy: with a limit, a window, and delays that grow.
#[test]
fn a_fleet_weathers_restart_policies() {
    let mut coverage = Coverage::default();
    seeds(0..200, |seed| {
        let came = Fleet::new(seed, Plan::new(seed, None).with_policies(seed)).run();
        coverage.add(&came.coverage);
    });
    assert!(coverage.restart_limits > 100 && coverage.restarts > 500, "{coverage}");
}

/// The same with daemons that die and are followed by others, and in `realtime` with worlds that do: no task is lost and none
/// is done twice, no life is started twice, and everybody who can come back does.
#[test]
fn a_fleet_weathers_the_deaths_of_its_daemons_and_worlds() {
    let (mut coverage, mut failing) = (Coverage::default(), Vec::new());
    let wanted = number("SHOAL_STORM_SUCCESSIONS");
    let seeds = number("SHOAL_STORM_SEED").map_or(0..wanted.unwrap_or(300), |seed| seed..seed + 1);
    let aloud = seeds.end - seeds.start == 1;
    for seed in seeds {
        let came = std::panic::catch_unwind(|| {
            let mut fleet = Fleet::new(seed, Plan::new(seed, None).with_room()).with_successions(seed);
            fleet.shared.aloud = aloud;
            fleet.run()
        });
        match came {
            Ok(came) => coverage.add(&came.coverage),
            Err(_) => failing.push(seed),
        }
    }
    assert!(failing.is_empty(), "failing seeds: {failing:?}");
    let deaths = [coverage.daemon_deaths, coverage.world_deaths];
    assert!(aloud || deaths.iter().all(|times| *times > 200), "{coverage}");
}

/// What the environment asks for.
#[expect(clippy::disallowed_methods, reason = "how many seeds, and which one aloud")]
fn number(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{name} is to be a number, not `{text}`")))
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
