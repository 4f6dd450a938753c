//! A storm of real processes: something of a fleet that is left running is killed or stopped all the time.
//!
//! `SHOAL_CRASH_S=60 SHOAL_CRASH_SEEDS=20 cargo test -p shoal --test e2e -- --nocapture crashes` for more of it than a test
//! run has time for.

use crate::service::Service;
use crate::support::{assert_clean, lanes, process_of, processes_of, shoal, signal, wait_for};
use rustix::process::Signal;
use serde_json::Value;
use std::path::Path;
use std::time::{Duration, Instant};

const ROBOTS: usize = 15;
/// From one blow to the next.
const EVERY: Duration = Duration::from_millis(200);
/// A process that is stopped goes on after this number of blows.
const STOPPED_BLOWS: usize = 2;

fn setting(name: &str, usual: u64) -> u64 {
    std::env::var(name)
        .map_or(usual, |text| text.parse().unwrap_or_else(|_| panic!("{name} is not a number: `{text}`")))
}

/// A random number below `n`, always the same for a seed.
fn draw(state: &mut u64, n: usize) -> usize {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 33) as usize % n
}

fn scenario() -> String {
    let more = "[fleet]\ncommand_timeout_s = 1\nstraggler_limit_s = 0.3\nstraggler = \"hold\"\n[defaults]\n\
                restart = \"always\"\nrestart_limit = 1000\nrestart_delay_s = 0.1\n";
    let text = lanes(ROBOTS, 2.0).replacen("[defaults]\n", more, 1);
    // There and back again.
    (0..ROBOTS).fold(text, |text, lane| {
        let goal = format!("goal_m = [2, {}]\n", 2 * lane);
        let round = format!("waypoints_m = [[2, {0}]]\ngoal_m = [0, {0}]\nrounds = \"forever\"\n", 2 * lane);
        text.replacen(&goal, &round, 1)
    })
}

/// What the fleet takes of the machine.
#[derive(Debug)]
struct Taken {
    files: usize,
    shm_bytes: u64,
    /// Of the daemon and of the world.
    resident_kib: [u64; 2],
    descriptors: [usize; 2],
}

impl Taken {
    fn by(service: &Service) -> Taken {
        let entries: Vec<_> = std::fs::read_dir(&service.root).unwrap().flatten().collect();
        let size = |entry: &std::fs::DirEntry| {
            entry.metadata().map_or(0, |meta| std::os::unix::fs::MetadataExt::blocks(&meta) * 512)
        };
        let pids = [service.daemon(), service.world()];
        let resident = |pid: u32| {
            let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap();
            let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
            line.split_whitespace().next().unwrap().parse().unwrap()
        };
        let descriptors =
            |pid: u32| std::fs::read_dir(Path::new("/proc").join(pid.to_string()).join("fd")).unwrap().count();
        Taken {
            files: entries.len(),
            shm_bytes: entries.iter().map(size).sum(),
            resident_kib: pids.map(resident),
            descriptors: pids.map(descriptors),
        }
    }
}

/// The robots that `ps` shows in this state.
fn count(ps: &Value, state: &str) -> usize {
    let robots = ps["fleets"][0]["robots"].as_array();
    robots.map_or(0, |robots| robots.iter().filter(|robot| robot["state"] == state).count())
}

/// A daemon that has ended has another one as its successor, as a service manager would see to.
fn tend(service: &mut Service) -> bool {
    let dead = process_of(service.daemon()).is_none();
    if dead {
        service.adopt();
    }
    dead
}

/// Lets a process go on, unless it was killed since.
fn go_on(pid: u32) {
    if process_of(pid).is_some() {
        signal(pid, Signal::CONT);
    }
}

fn storm(seed: u64, length: Duration) {
    let mut service = Service::of(scenario(), &[]);
    let mut dice = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let whole = |service: &Service| {
        wait_for("the whole fleet", || {
            let ps = shoal(&["ps", "--fleet", &service.name, "--format", "json"]).expect(0).report;
            (count(&ps, "running") == ROBOTS).then_some(ps)
        })
    };
    whole(&service);
    let before = Taken::by(&service);
    let (began, mut stopped, mut blows) = (Instant::now(), Vec::<(usize, u32)>::new(), [0_usize; 4]);
    let (mut adoptions, mut number, mut killed) = (0, 0, None);
    while began.elapsed() < length {
        let due = EVERY * number as u32;
        std::thread::sleep(due.saturating_sub(began.elapsed()));
        stopped.retain(|(since, pid)| {
            let goes_on = number - since >= STOPPED_BLOWS;
            if goes_on {
                go_on(*pid);
            }
            !goes_on
        });
        adoptions += usize::from(tend(&mut service));
        let mut all = processes_of(&service.root);
        all.retain(|process| ["agent", "world", "guardian"].contains(&process.verb()));
        let mut pids: Vec<u32> = all.iter().map(|process| process.pid).collect();
        pids.push(service.daemon());
        pids.sort_unstable();
        let victim = pids[draw(&mut dice, pids.len())];
        let kills = draw(&mut dice, 3) > 0;
        let verb = all.iter().find(|process| process.pid == victim).map_or("daemon", |process| process.verb());
        blows[["agent", "world", "guardian", "daemon"].iter().position(|known| *known == verb).unwrap()] += 1;
        if kills {
            signal(victim, Signal::KILL);
            killed = Some(victim);
        } else {
            signal(victim, Signal::STOP);
            stopped.push((number, victim));
        }
        number += 1;
    }
    stopped.iter().for_each(|(_, pid)| go_on(*pid));
    // A process that is killed takes a moment to end: until then it would count as one of the fleet that comes back.
    if let Some(pid) = killed {
        wait_for("the end of the last one killed", || process_of(pid).is_none().then_some(()));
    }
    let took = began.elapsed().as_secs_f64();
    adoptions += usize::from(tend(&mut service));
    let ps = whole(&service);
    let after = Taken::by(&service);
    let simulated = ps["fleets"][0]["time_s"].as_f64().unwrap();
    eprintln!(
        "seed {seed}: {number} blows in {took:.1} s (agents, world, guardian, daemon: {blows:?}), {adoptions} adoptions, \
         {simulated:.1} s simulated\n  before {before:?}\n  after  {after:?}"
    );
    // What dead processes hold is cleared away, a few at a time.
    assert!(after.files <= 2 * before.files && after.shm_bytes <= 2 * before.shm_bytes, "{before:?} {after:?}");
    for which in 0..2 {
        assert!(after.descriptors[which] <= before.descriptors[which] + 40, "{before:?} {after:?}");
        assert!(after.resident_kib[which] <= before.resident_kib[which] + 16 * 1024, "{before:?} {after:?}");
    }
    let down = service.json(&["down"]);
    assert_eq!(down["forced"], false);
    assert_clean(&service.root);
    let report: Value =
        serde_json::from_str(&std::fs::read_to_string(service.state().join("report.json")).unwrap()).unwrap();
    assert_eq!(report["outcome"]["robot_contacts"], 0, "{report:#}");
}

#[test]
fn the_fleet_always_comes_back() {
    for seed in 0..setting("SHOAL_CRASH_SEEDS", 1) {
        storm(seed, Duration::from_secs(setting("SHOAL_CRASH_S", 5)));
    }
}
