//! A machine that is busy, or has one processor only, makes `lockstep` slower and changes nothing else.

use crate::support::{SHOAL, deterministic, report, report_of};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use shoal_tests::process::{Place, Run};

const SCENARIOS: [&str; 2] = ["demo-15", "corridor-swap"];

fn first_processor(of: &CpuSet) -> CpuSet {
    let mut one = CpuSet::new();
    one.set((0..CpuSet::MAX_CPU).find(|cpu| of.is_set(*cpu)).expect("there is a processor"));
    one
}

/// `taskset -c N`: what is started from this thread inherits its processors.
#[test]
fn on_one_processor() {
    let all = sched_getaffinity(None).expect("a thread knows its processors");
    for name in SCENARIOS {
        let single = report(&format!("{name} --mode single"));
        let _place = Place::take();
        sched_setaffinity(None, &first_processor(&all)).expect("a thread may give processors up");
        let started = Run::new(SHOAL).words("run --format json --mode lockstep").words(name).start();
        sched_setaffinity(None, &all).expect("a thread may take its own back");
        let lockstep = report_of(&started.end());
        assert_eq!(deterministic(&single), deterministic(&lockstep), "{name}");
        assert_eq!(lockstep["latency"]["stragglers"], 0, "{name}");
    }
}

/// The limit of a straggler is much shorter than the ticks in which everybody opens the boards of everybody, but no
/// robot takes that long itself: it waits for a processor.
#[test]
fn a_fleet_that_gives_way_to_others_loses_nobody() {
    let scenario = "ring-15 --robots 30 --duration 0.1 --set fleet.straggler_limit_s=0.2 \
                    --set defaults.radius_m=0.1 --set defaults.radio_range_m=100";
    let single = report(&format!("{scenario} --mode single"));
    let _place = Place::take();
    let mut hogs = [(); 4].map(|()| Run::new("sh").args(["-c", "while :; do :; done"]).start());
    let run = Run::new("nice").args(["-n", "9", SHOAL]).words("run --format json --mode lockstep").words(scenario);
    let ended = run.end();
    assert!(hogs.iter_mut().all(|hog| hog.runs()), "the hogs were there all the time");
    let lockstep = report_of(&ended);
    assert_eq!(deterministic(&single), deterministic(&lockstep));
    assert_eq!((&lockstep["latency"]["stragglers"], &lockstep["verdict"]), (&0.into(), &"valid".into()), "{ended}");
}

#[test]
fn beside_others_that_never_sleep() {
    for name in SCENARIOS {
        let single = report(&format!("{name} --mode single"));
        let _place = Place::take();
        // Dropped at the end of the round, and killed by that.
        let mut hogs = [(); 2].map(|()| Run::new("sh").args(["-c", "while :; do :; done"]).start());
        let ended = Run::new(SHOAL).words("run --format json --mode lockstep").words(name).end();
        assert!(hogs.iter_mut().all(|hog| hog.runs()), "the hogs were there all the time");
        let lockstep = report_of(&ended);
        assert_eq!(deterministic(&single), deterministic(&lockstep), "{name}");
        assert_eq!(lockstep["latency"]["stragglers"], 0, "{name}");
    }
}
