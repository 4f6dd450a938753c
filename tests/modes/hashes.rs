//! Every scenario of the catalog, several seeds: the same trajectories, the same outcome, the same log.

use crate::support::{deterministic, report};

fn check(name: &str) {
    for seed in 1..=3 {
        let run = |mode| report(&format!("{name} --seed {seed} --mode {mode}"));
        let (single, lockstep) = (run("single"), run("lockstep"));
        let hash = single["trajectory_hash"].as_str().expect("a hash is a string");
        assert_eq!(hash.len(), 16, "{hash}");
        assert_eq!(single["trajectory_hash"], lockstep["trajectory_hash"], "{name}, seed {seed}");
        assert_eq!(deterministic(&single), deterministic(&lockstep), "{name}, seed {seed}");
        assert_eq!(lockstep["verdict"], "valid", "{name}, seed {seed}: {:#}", lockstep["starved_because"]);
        assert_eq!(lockstep["exit_code"], 0, "{name}, seed {seed}: {:#}", lockstep["unmet"]);
    }
}

macro_rules! each {
    ($($test:ident: $name:literal),* $(,)?) => {
        $(#[test] fn $test() { check($name); })*

        #[test]
        fn none_is_forgotten() {
            assert_eq!(shoal_tests::catalog_names().collect::<Vec<_>>(), [$($name),*]);
        }
    };
}

shoal_tests::for_each_scenario!(each);

/// What robots tell each other beside their poses comes across as it is.
#[test]
fn planners_that_tell_what_they_are_about() {
    check("demo-15 --planner lanes");
    check("demo-15 --planner orca");
}

/// Faults of processes and of the radio, from the timeline: `single` does in its thread what real processes suffer.
#[test]
fn with_everything_that_the_timeline_can_do() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = directory.path().join("timeline.toml");
    #[expect(clippy::disallowed_methods, reason = "a scenario of its own")]
    std::fs::write(&path, TIMELINE).expect("it can be written");
    for seed in 1..=2 {
        let run = |mode| report(&format!("{} --seed {seed} --mode {mode}", path.display()));
        let (single, lockstep) = (run("single"), run("lockstep"));
        assert_eq!(single["trajectory_hash"], lockstep["trajectory_hash"], "seed {seed}");
        assert_eq!(deterministic(&single), deterministic(&lockstep), "seed {seed}");
        let kinds: Vec<&str> =
            single["events"].as_array().expect("a list").iter().filter_map(|event| event["kind"].as_str()).collect();
        for fault in ["mute", "delay of 4 ticks", "drop of 0.5", "noise of 0.05 m", "slow-cpu of 1.5 ms"] {
            let began = |event: &&serde_json::Value| {
                event["kind"] == "fault" && event["detail"].as_str().is_some_and(|detail| detail.contains(fault))
            };
            assert_eq!(single["events"].as_array().expect("a list").iter().filter(began).count(), 1, "{fault}");
        }
        for kind in [
            "joined",
            "left",
            "killed",
            "restarted",
            "restart-limit",
            "paused",
            "resumed",
            "radio",
            "fault-over",
            "task-done",
            "arrived",
        ] {
            assert!(kinds.contains(&kind), "{kind} is not in {kinds:?}");
        }
    }
}

/// Whether the tasks of the timeline are done in time decides about the exit code, alike in one thread and as processes.
#[test]
fn with_tasks_that_are_to_be_done_in_time() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = directory.path().join("timeline.toml");
    #[expect(clippy::disallowed_methods, reason = "a scenario of its own")]
    std::fs::write(&path, TIMELINE).expect("it can be written");
    let run = |mode: &str, by_s: f64| {
        report(&format!("{} --mode {mode} --set expect.tasks_done_by_s={by_s}", path.display()))
    };
    let single = run("single", 40.0);
    assert_eq!((&single["exit_code"], &single["unmet"]), (&0.into(), &serde_json::json!([])), "{:#}", single["events"]);
    let events = single["events"].as_array().expect("a list").iter();
    let last_s = events.filter(|event| event["kind"] == "task-done").filter_map(|event| event["t_s"].as_f64());
    let last_s = last_s.fold(0.0, f64::max);
    for (by_s, code) in [(last_s, 0), (last_s - 0.02, 1)] {
        let (single, lockstep) = (run("single", by_s), run("lockstep", by_s));
        assert_eq!((&single["exit_code"], &single["unmet"]), (&lockstep["exit_code"], &lockstep["unmet"]), "{by_s}");
        assert_eq!(single["exit_code"], code, "{by_s}: {:#}", single["unmet"]);
    }
}

/// The default of `amr-apf`, which draws its detours at random; as processes it brings all home without a contact too.
#[test]
fn with_the_default_of_amr_apf() {
    let settings = ["preset=\"fleet\"", "margin_m=0", "safety_m=0.07", "pillar_gaps=\"midpoint\"", "sticky_stop=false"]
        .map(|setting| format!(" --set planners.amr-apf.{setting}"))
        .concat();
    for scenario in ["amr-case1", "amr-case1 --robots 9", "amr-case2-01", "amr-case2-04"] {
        let run = |mode| report(&format!("{scenario} --mode {mode}{settings}"));
        let (single, lockstep) = (run("single"), run("lockstep"));
        assert_eq!(single["trajectory_hash"], lockstep["trajectory_hash"], "{scenario}");
        let outcome = &lockstep["outcome"];
        assert_eq!(outcome["arrived"], lockstep["robots"], "{scenario}: {outcome:#}");
        assert_eq!((&outcome["robot_contacts"], &outcome["obstacle_contacts"]), (&0.into(), &0.into()), "{scenario}");
    }
}

/// Robots on wheels, one hash for threads and processes.
#[test]
fn with_robots_on_wheels() {
    let wheels = " --set defaults.kind=\"diff-drive\" --set defaults.wheel_accel_radps2_max=30";
    for scenario in ["amr-case1", "amr-case2-01 --planner decentralized-apf"] {
        let run = |mode| report(&format!("{scenario} --mode {mode}{wheels}"));
        let (single, lockstep) = (run("single"), run("lockstep"));
        assert_eq!(single["trajectory_hash"], lockstep["trajectory_hash"], "{scenario}");
        assert_eq!(deterministic(&single), deterministic(&lockstep), "{scenario}");
    }
}

/// Bodies that have weight: the engine gives the same bits in the world's process as in one thread, with robots that die,
/// leave and come late, on two wheels and on one patch.
#[test]
fn with_bodies_that_have_weight() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = directory.path().join("weight.toml");
    // The engine has no arms: a body on wheels is in its place.
    let of_arms =
        ["planner = \"pso-via-points\"", "base_m =", "links_m =", "turn_radps_max =", "turn_accel_radps2_max ="];
    let lines = TIMELINE.lines().filter(|line| !of_arms.iter().any(|key| line.trim_start().starts_with(key)));
    let text = lines.collect::<Vec<_>>().join("\n").replace("two-link-arm", "diff-drive");
    let text = format!("[world]\nphysics = \"rapier\"\n{text}");
    #[expect(clippy::disallowed_methods, reason = "a scenario of its own")]
    std::fs::write(&path, text).expect("it can be written");
    let path = path.display();
    for run in [
        format!("{path}"),
        format!("{path} --set defaults.kind=\"diff-drive\" --seed 2"),
        "demo-15 --set world.physics=\"rapier\"".to_owned(),
        "amr-case1 --set world.physics=\"rapier\" --set defaults.kind=\"diff-drive\"".to_owned(),
    ] {
        let report = |mode| report(&format!("{run} --mode {mode}"));
        let (single, lockstep) = (report("single"), report("lockstep"));
        assert_eq!((&single["physics"], &lockstep["physics"]), (&"rapier".into(), &"rapier".into()));
        assert_eq!(single["trajectory_hash"], lockstep["trajectory_hash"], "{run}");
        assert_eq!(deterministic(&single), deterministic(&lockstep), "{run}");
    }
}

/// Where processes run, and which of them goes first, changes nothing that comes out.
#[test]
fn with_processors_and_classes_from_the_scenario() {
    let mine = rustix::thread::sched_getaffinity(None).expect("it can be asked for");
    let cpu = (0..1024).find(|cpu| mine.is_set(*cpu)).expect("there is one");
    let check = |settings: &str| {
        let run = |mode| report(&format!("demo-15 --mode {mode} {settings}"));
        let (single, lockstep) = (run("single"), run("lockstep"));
        assert_eq!(single["trajectory_hash"], lockstep["trajectory_hash"], "{settings}");
        assert_eq!(deterministic(&single), deterministic(&lockstep), "{settings}");
        assert_eq!(single["resources"]["scheduling"], serde_json::Value::Null, "{settings}");
        single["trajectory_hash"].clone()
    };
    let set = |settings: &[String]| settings.iter().map(|setting| format!(" --set {setting}")).collect::<String>();
    let one = format!("cpus=[{cpu}]");
    let hashes = [
        check(""),
        check(&set(&["processes.agents.scheduling=batch".to_owned()])),
        check(&set(&[format!("processes.agents.{one}"), format!("processes.world.{one}")])),
    ];
    assert!(hashes.iter().all(|hash| *hash == hashes[0]), "{hashes:?}");
}

const TIMELINE: &str = r#"
    [clock]
    duration_s = 40
    [radio]
    noise_m = 0.01
    [defaults]
    sensor_range_m = 3
    radio_range_m = 5
    [layout]
    kind = "circle-swap"
    robots = 7
    radius_m = 6
    jitter_m = 0.4
    [[robot]]
    id = "late"
    start_m = [-8, 8]
    goal_m = [8, -8]
    kind = "unicycle"
    restart = "always"
    restart_limit = 1
    restart_window_s = 3
    restart_delay_s = 0.3
    restart_backoff = 2
    [[robot]]
    id = "arm"
    kind = "two-link-arm"
    planner = "pso-via-points"
    base_m = [-6.5, -6.5]
    links_m = [1.5, 1.5]
    start_m = [-4, -6]
    goal_m = [-7, -4]
    turn_radps_max = 0.4
    turn_accel_radps2_max = 2
    restart = "on-failure"
    restart_delay_s = 0.4
    [[obstacle]]
    shape = "capsule"
    from_m = [3, 3]
    to_m = [3.5, 3]
    radius_m = 0.2
    motion = { kind = "random-walk", speed_mps = 0.3 }
    [[event]]
    at_s = 2
    kind = "join"
    robot = "late"
    [[event]]
    at_s = 4
    kind = "kill"
    robot = "late"
    [[event]]
    at_s = 7.5
    kind = "kill"
    robot = "late"
    [[event]]
    at_s = 9
    kind = "kill"
    robot = "late"
    [[event]]
    at_s = 3
    kind = "kill"
    robot = "r00"
    [[event]]
    at_s = 3.5
    kind = "leave"
    robot = "r01"
    [[event]]
    at_s = 4
    kind = "pause"
    robot = "r02"
    for_s = 1.5
    [[event]]
    at_s = 1.5
    kind = "pause"
    robot = "arm"
    for_s = 0.8
    [[event]]
    at_s = 3.2
    kind = "kill"
    robot = "arm"
    [[event]]
    at_s = 6
    kind = "task"
    robot = "arm"
    goal_m = [-4.2, -5.2]
    [[event]]
    at_s = 5
    kind = "task"
    robot = "r03"
    goal_m = [0, 8]
    [[event]]
    at_s = 2.5
    kind = "radio"
    delay_ticks = 3
    drop = 0.2
    [[event]]
    at_s = 6
    kind = "radio"
    [[event]]
    at_s = 3
    kind = "mute"
    robot = "r04"
    for_s = 2
    [[event]]
    at_s = 3.4
    kind = "delay"
    robot = "r05"
    delay_ticks = 4
    for_s = 1.5
    [[event]]
    at_s = 3.6
    kind = "drop"
    robot = "r05"
    drop = 0.5
    for_s = 1.1
    [[event]]
    at_s = 3.8
    kind = "noise"
    robot = "r06"
    noise_m = 0.05
    for_s = 0.9
    [[event]]
    at_s = 4.2
    kind = "slow-cpu"
    robot = "r06"
    slow_s = 0.0015
    [[event]]
    at_s = 4.4
    kind = "pause"
    robot = "r06"
    [[event]]
    at_s = 5.1
    kind = "resume"
    robot = "r06"
    [expect]
    arrived = 6
    contacts_max = 100
"#;
