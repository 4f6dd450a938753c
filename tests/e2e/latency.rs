//! What a fleet costs and how late it is: whose fault that was, seen by whoever looks, at no cost to the agents.

use crate::support::{Fleet, Run, assert_clean, example, is_gone, lanes, run, shoal, signal, stop, wait_for};
use bus::{Address, Counter, FrameSubscriber, Node, StatsSnapshot, clock, stats};
use model::{Metric, RobotIndex, RobotInstance};
use report::Blame;
use rustix::process::Signal;
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use serde_json::Value;
use shoal_tests::process::Run as Words;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Robots that are there until somebody ends the run.
fn endless(robots: usize) -> Run {
    let scenario = format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(robots, 1.0));
    Run::scenario(&scenario).mode("realtime")
}

fn robot<'a>(latency: &'a Value, id: &str) -> &'a Value {
    let robots = latency["per_robot"].as_array().into_iter().flatten();
    robots.into_iter().find(|robot| robot["id"] == id).unwrap_or_else(|| panic!("no robot `{id}` in {latency:#}"))
}

fn count(value: &Value) -> u64 {
    value.as_u64().unwrap_or_else(|| panic!("not a count: {value}"))
}

/// The causes of the late periods, and their sum.
fn assert_adds_up(blame: &Value) {
    let sum: u64 = ["scheduler", "planner", "world", "input", "neither"].iter().map(|cause| count(&blame[cause])).sum();
    assert_eq!(count(&blame["late"]), sum, "{blame}");
}

#[test]
fn a_slow_planner_is_to_blame_itself() {
    let slow = example("slow_planner");
    // Half as slow again as a period is long: it misses every period, whatever else the machine does.
    let run = Run::scenario(&lanes(2, 0.8)).mode("realtime").env("SHOAL_PLAN_MS", "30");
    let run = run.set(&format!("robot[0].agent={:?}", slow.to_str().unwrap())).set("fleet.command_timeout_s=30");
    let ended = run.finish();
    let report = &ended.report;
    assert_eq!(report["verdict"], "starved", "{ended}");
    let latency = &report["latency"];
    let (slow, other) = (robot(latency, "a"), robot(latency, "b"));
    let (late, planner) = (count(&slow["blame"]["late"]), count(&slow["blame"]["planner"]));
    assert!(late >= count(&slow["deadline_misses"]) && 2 * planner > late, "{slow:#}");
    assert_eq!(count(&other["blame"]["planner"]), 0, "{other:#}");
    for blame in [&slow["blame"], &other["blame"], &latency["world"]["blame"], &latency["blame"]] {
        assert_adds_up(blame);
    }
    // Periods that it could not begin were late as well: half of them, by up to a period.
    assert_eq!(slow["wake_us"]["n"], slow["periods"], "{slow:#}");
    assert!(slow["wake_us"]["n"].as_u64() > slow["plan_us"]["n"].as_u64(), "{slow:#}");
}

#[test]
fn a_robot_that_the_timeline_stops_is_not_late() {
    let pause = "[[event]]\nat_s = 0.4\nkind = \"pause\"\nrobot = \"b\"\nfor_s = 4\n";
    let ended = Run::scenario(&format!("{}{pause}", lanes(2, 1.0))).mode("realtime").finish();
    let ticks = count(&ended.report["ticks"]);
    let latency = &ended.report["latency"];
    let (always, stopped) = (count(&robot(latency, "a")["periods"]), count(&robot(latency, "b")["periods"]));
    // Stopped for 200 ticks, give or take what the machine needs for it.
    assert!(ticks > 200 && stopped + 100 < ticks && always > stopped, "{always} and {stopped} of {ticks}\n{ended}");
    ended.event("resumed", "b");
}

#[test]
fn after_the_last_tick_nothing_is_measured() {
    let run = Run::scenario(&lanes(2, 1.0)).mode("realtime").set("fleet.command_timeout_s=30");
    let mut fleet = run.set("clock.stop=duration").set("clock.duration_s=1").start();
    fleet.wait_tick(5);
    let (address, gate, world) = (fleet.address(), fleet.gate(), fleet.process("world"));
    // The agents go on until the daemon tells them that the run is over.
    stop(fleet.daemon());
    wait_for("the world to end", || is_gone(world).then_some(()));
    let instance = RobotInstance { index: RobotIndex(0), incarnation: 0 };
    let periods = |n: u64| {
        let begun = gate.signs(instance);
        wait_for("the agents to go on", || (gate.signs(instance) >= begun + n).then_some(()));
    };
    let measured = || {
        let snapshot = snapshot(&address, 0);
        [Metric::PoseAge, Metric::Plan, Metric::Step].map(|metric| snapshot.percentiles(metric).unwrap().n)
    };
    periods(2);
    let at_the_end = measured();
    periods(10);
    assert_eq!(measured(), at_the_end);
    signal(fleet.daemon(), Signal::CONT);
    fleet.wait();
}

/// The late periods of a bare timer: by more than a fifth of a period. One that it slept through is late as well.
#[derive(Debug, Default)]
struct Bare {
    periods: u64,
    late: u64,
    /// Those in which it waited for a processor for most of the time that it was late.
    queued: u64,
}

fn bare_timer(period_ns: u64, over: &AtomicBool) -> Bare {
    clock::set_timer_slack_1ns();
    let mut queue = clock::RunQueue::open();
    let mut waited_ns = move || queue.as_mut().and_then(clock::RunQueue::waited_ns).unwrap_or(0);
    let (mut bare, mut due_ns) = (Bare::default(), clock::now_ns());
    while !over.load(Relaxed) {
        due_ns += period_ns;
        let before_ns = waited_ns();
        clock::sleep_until_ns(due_ns);
        let late_ns = clock::now_ns().saturating_sub(due_ns);
        let queued_ns = waited_ns() - before_ns;
        let slept_through = late_ns / period_ns;
        bare.periods += 1 + slept_through;
        if late_ns > period_ns / 5 {
            bare.late += 1 + slept_through;
            bare.queued += if 2 * queued_ns > late_ns { 1 + slept_through } else { 0 };
        }
        due_ns += slept_through * period_ns;
    }
    bare
}

/// `taskset -c N` for what is started from this thread, and for the thread.
fn on_one_processor<T>(act: impl FnOnce() -> T) -> T {
    let all = sched_getaffinity(None).unwrap();
    let mut one = CpuSet::new();
    one.set((0..CpuSet::MAX_CPU).find(|cpu| all.is_set(*cpu)).unwrap());
    sched_setaffinity(None, &one).unwrap();
    let result = act();
    sched_setaffinity(None, &all).unwrap();
    result
}

#[test]
fn beside_hogs_the_scheduler_is_to_blame() {
    let over = AtomicBool::new(false);
    let (mut fleet, mut hogs) = on_one_processor(|| {
        let hogs = [(); 8].map(|()| Words::new("sh").args(["-c", "while :; do :; done"]).start());
        let run = Run::scenario(&format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 3\n", lanes(3, 1.0)));
        (run.mode("realtime").set("clock.tick_hz=500").set("fleet.command_timeout_s=30").start(), hogs)
    });
    let bare = std::thread::scope(|scope| {
        let bare = scope.spawn(|| on_one_processor(|| bare_timer(2_000_000, &over)));
        wait_for("the end", || fleet.has_ended().then_some(()));
        over.store(true, Relaxed);
        bare.join().unwrap()
    });
    assert!(hogs.iter_mut().all(|hog| hog.runs()), "the hogs were there all the time");
    let ended = fleet.wait();
    let report = &ended.report;
    if bare.late * 100 < bare.periods {
        eprintln!("skipped: bare timers are on time beside eight hogs: {bare:?}");
        return;
    }
    let blame = &report["latency"]["blame"];
    assert_adds_up(blame);
    // Some schedulers wake a fleet in time that bare timers beside it wait for. Only its own figures may say so: its late periods are
    // those of which the verdict allows one in a hundred, and missed ones, one in a thousand.
    let latency = &report["latency"];
    let [periods, missed] = ["periods", "deadline_misses"].map(|key| count(&latency[key]));
    if report["verdict"] == "valid" {
        assert!(100 * count(&blame["late"]) <= periods && 1000 * missed <= periods, "{bare:?}\n{ended}");
        eprintln!("skipped: the fleet is on time beside eight hogs: {bare:?}");
        return;
    }
    assert_eq!(report["verdict"], "starved", "{bare:?}\n{ended}");
    // A machine that stands still as a whole is in no counter of its scheduler. Bare timers tell how much of the lateness that
    // was: where they waited for the processor, so did the fleet.
    let [scheduler, neither, late] = ["scheduler", "neither", "late"].map(|cause| count(&blame[cause]));
    assert!(2 * scheduler * bare.late > bare.queued * late, "{bare:?}\n{ended}");
    assert!(10 * bare.queued < 9 * bare.late || 5 * neither <= late, "{bare:?}\n{ended}");
    assert_eq!(count(&blame["planner"]), 0, "{ended}");
}

// ---- looking costs nothing

fn snapshot(address: &Address, slot: u32) -> StatsSnapshot {
    let name = format!("agent-{slot}-0");
    stats::read_all(address).unwrap().into_iter().find(|(found, _)| *found == name).expect("statistics of an agent").1
}

/// How often a process has gone to sleep.
fn sleeps(pid: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap();
    status.lines().find_map(|line| line.strip_prefix("voluntary_ctxt_switches:")).unwrap().trim().parse().unwrap()
}

/// Looks at a fleet in all the ways there are, until so many ticks have passed.
fn observe(fleet: &mut Fleet, ticks: u64) {
    let (address, id) = (fleet.address(), fleet.id());
    let node = Node::new(&address, "test").unwrap();
    let mut frames = FrameSubscriber::open(&node, 0).unwrap();
    let (gate, mut seen) = (fleet.gate(), 0);
    let until = gate.progress().tick + ticks;
    while gate.progress().tick < until {
        for args in [&["ps"][..], &["latency", "--pairs", "--histogram"], &["latency", "--format", "json"]] {
            shoal(&[args, &["--fleet", &id]].concat()).expect(0);
            while let Ok(Some(_)) = frames.take() {
                seen += 1;
            }
        }
    }
    assert!(seen > 0, "there were frames to see");
}

#[test]
fn an_observer_wakes_nobody() {
    let mut fleet = endless(2).start();
    let root = fleet.root();
    let (address, agents) = (fleet.address(), [fleet.agent(0), fleet.agent(1)]);
    fleet.wait_tick(50);
    let measure = |slot: usize| (sleeps(agents[slot]), snapshot(&address, slot as u32).counter(Counter::Periods));
    let before = [measure(0), measure(1)];
    observe(&mut fleet, 150);
    for slot in [0, 1] {
        let (slept, periods) = (sleeps(agents[slot]) - before[slot].0, measure(slot).1 - before[slot].1);
        // Once in every period, for its timer; not at all in one that it was too late for.
        assert!(periods >= 100 && slept <= periods + 3, "{slept} sleeps in {periods} periods");
    }
    signal(fleet.daemon(), Signal::INT);
    fleet.wait().expect(130);
    assert_clean(&root);
}

#[test]
fn an_agent_makes_one_system_call_a_period_watched_or_not() {
    let mut fleet = endless(2).start();
    let (address, agent) = (fleet.address(), fleet.agent(0));
    fleet.wait_tick(50);
    let log = tempfile::NamedTempFile::new().unwrap();
    let trace = Command::new("strace")
        .args(["-qq", "-o", log.path().to_str().unwrap(), "-p", &agent.to_string()])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    let Ok(mut trace) = trace else {
        eprintln!("skipped: there is no strace");
        return;
    };
    let lines = || std::fs::read_to_string(log.path()).unwrap().lines().count();
    // Where one process may not trace another, it ends at once.
    let traced = wait_for("the trace", || {
        (lines() > 5).then_some(true).or_else(|| trace.try_wait().unwrap().is_some().then_some(false))
    });
    if !traced {
        eprintln!("skipped: processes may not be traced here");
        return;
    }
    let before = snapshot(&address, 0);
    let begun = lines();
    observe(&mut fleet, 100);
    let text = std::fs::read_to_string(log.path()).unwrap();
    let after = snapshot(&address, 0);
    let _ = trace.kill();
    let _ = trace.wait();

    let passed = |counter| after.counter(counter) - before.counter(counter);
    let (periods, late) = (passed(Counter::Periods), Blame::of(after.late()).late - Blame::of(before.late()).late);
    let of = |name: &str| text.lines().skip(begun).filter(|line| line.starts_with(name)).count() as u64;
    let (sleeps, looks) = (of("clock_nanosleep("), of("pread64("));
    assert!(periods >= 50 && sleeps <= periods + 3, "{sleeps} sleeps in {periods} periods");
    // About one look at the scheduler's counters a second; after a late period one after each of the second that follows.
    // Tracing makes the agent slow, and the first of these may have been late before the first count.
    let closely = if Blame::of(after.late()).late > 0 { periods.min(51 * (late + 1)) } else { 0 };
    assert!(looks <= closely + periods / 50 + 3, "{looks} looks, {late} of {periods} late");
    let others = text.lines().skip(begun).filter(|line| {
        !["clock_nanosleep(", "pread64(", "restart_syscall("].iter().any(|known| line.starts_with(known))
    });
    let others: Vec<&str> = others.collect();
    assert!(others.is_empty(), "{others:#?}");
    signal(fleet.daemon(), Signal::INT);
    fleet.wait().expect(130);
}

// ---- the verbs

#[test]
fn latency_of_a_fleet_that_runs() {
    let mut fleet = endless(2).set("fleet.max_robots=3").set("world.y_m=[-4, 8]").start();
    let id = fleet.id();
    fleet.wait_tick(30);
    let ask = |args: &[&str]| shoal(&[&["latency", "--fleet", &id], args].concat());
    shoal(&["add", "--fleet", &id, "--id", "late", "--start", "0,-2", "--goal", "1,-2"]).expect(0);
    let heard = |json: &Value, robot: &str, other: &str| {
        json["pairs"].as_array().unwrap().iter().any(|pair| pair["robot"] == robot && pair["heard"] == other)
    };
    // The newcomer opens one board in a period.
    let json = wait_for("the new robot's statistics", || {
        let json = ask(&["--pairs", "--histogram", "--metric", "wake", "--format", "json"]).expect(0).report;
        let robots = json["per_robot"].as_array().map_or(0, Vec::len);
        let hears_all = ["a", "b"].iter().all(|other| heard(&json, "late", other));
        (robots == 3 && hears_all && robot(&json, "late")["pose_age_us"].is_object()).then_some(json)
    });
    assert_eq!((&json["schema"], &json["mode"]), (&"shoal.latency/1".into(), &"realtime".into()), "{json:#}");
    for id in ["a", "b", "late"] {
        let robot = robot(&json, id);
        assert!(count(&robot["periods"]) > 0 && robot["reaction_us"]["n"].as_u64() > Some(0), "{robot:#}");
        assert_adds_up(&robot["blame"]);
    }
    // Everybody hears everybody.
    let pairs = json["pairs"].as_array().unwrap();
    for (robot, other) in [("a", "b"), ("b", "a"), ("late", "a"), ("late", "b")] {
        assert!(heard(&json, robot, other), "{robot} hears {other}: {pairs:#?}");
    }
    assert!(pairs.iter().all(|pair| pair["robot"] != pair["heard"]), "{pairs:#?}");
    let bins = json["histogram"]["bins"].as_array().unwrap();
    assert_eq!(bins.iter().map(|bin| count(&bin["n"])).sum::<u64>(), count(&json["histogram"]["n"]), "{json:#}");

    let text = ask(&["a", "--pairs"]).expect(0).stdout;
    assert!(["a, us", "wake-up", "late periods", "heard"].iter().all(|word| text.contains(word)), "{text}");
    assert!(!text.contains("late, us"), "{text}");
    ask(&["nobody"]).expect_failure(2, &["unknown robot `nobody`", "a, b, late"]);
    ask(&["--svg", "/nowhere/x.svg"]).expect_failure(3, &["/nowhere", "picture"]);
    let svg = tempfile::tempdir().unwrap();
    let path = svg.path().join("wake.svg");
    ask(&["--metric", "wake", "--svg", path.to_str().unwrap()]).expect(0);
    assert!(std::fs::read_to_string(path).unwrap().starts_with("<svg"));

    // Without the daemon as well: nobody is asked.
    crate::support::stop(fleet.daemon());
    ask(&[]).expect(0);
    signal(fleet.daemon(), Signal::CONT);
    signal(fleet.daemon(), Signal::INT);
    fleet.wait().expect(130);
}

#[test]
fn a_stress_test_says_what_the_machine_did() {
    let mut command = Command::new(crate::support::SHOAL);
    command.args(["stress", "--robots", "3", "--duration", "1s", "--hz", "100", "--format", "json"]);
    let ended = run(command).expect(0);
    let stress = &ended.report;
    assert_eq!((&stress["schema"], &stress["robots"]), (&"shoal.stress/1".into(), &3.into()), "{ended}");
    assert_eq!(stress["left_over"], serde_json::json!([]), "{ended}");
    // Of every period it is known whether it was missed; agents and the world together.
    assert!(count(&stress["latency"]["periods"]) >= 350, "{ended}");
    assert_adds_up(&stress["latency"]["blame"]);
    let (asked, held) = (stress["tick_hz"].as_f64().unwrap(), stress["rate"]["min_hz"].as_f64().unwrap());
    assert!(held > 0.0 && held <= asked, "{ended}");
    assert!(
        stress["cores_used"].as_f64() > Some(0.0) && stress["resources"]["shm_bytes"].as_u64() > Some(0),
        "{ended}"
    );
    let starved = stress["verdict"] == "starved";
    assert_eq!(starved, !stress["starved_because"].as_array().unwrap().is_empty(), "{ended}");
}
