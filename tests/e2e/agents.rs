//! Agents as people start them: by a path, behind wrappers, with loud voices, and under limits of the machine.

use crate::support::{
    Ended, PrivateShm, Run, SHOAL, assert_clean, is_gone, is_stopped, lanes, run, script, signal, wait_for,
};
use bus::descriptors;
use model::RobotIndex;
use rustix::process::{Signal, geteuid};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

/// Lanes whose robots hear each other; robot `b` has this agent.
fn wrapped(robots: usize, length_m: f64, agent: &Path) -> String {
    let own = format!("id = \"b\"\nagent = {agent:?}\n");
    lanes(robots, length_m).replacen("id = \"b\"\n", &own, 1).replacen(
        "[defaults]\n",
        "[defaults]\nradio_range_m = 99\n",
        1,
    )
}

/// shoal in a shell that has done something before.
fn after(commands: &str) -> Command {
    let mut command = Command::new("sh");
    command.args(["-c", &format!("{commands}; exec \"$@\""), "sh", SHOAL]);
    command
}

fn impaired(ended: &Ended, words: &[&str]) {
    assert_eq!(ended.report["verdict"], "impaired", "{ended}");
    let reasons = ended.report["impaired_because"].to_string();
    assert!(words.iter().all(|word| reasons.contains(word)), "{words:?} in {reasons}\n{ended}");
}

#[test]
fn the_agent_that_was_checked_is_the_one_that_runs() {
    let (here, path) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    script(here.path(), "own", &format!("#!/bin/sh\nexec {SHOAL} agent \"$@\"\n"));
    script(path.path(), "own", "#!/bin/sh\necho wrong >&2\nexit 1\n");
    script(path.path(), "elsewhere", "#!/bin/sh\nexit 1\n");
    let start = |agent: &str| {
        let mut command = Command::new(SHOAL);
        let search = format!("{}:{}", path.path().display(), std::env::var("PATH").unwrap_or_default());
        command.current_dir(here.path()).env("PATH", search);
        Run::scenario_by(command, &wrapped(2, 1.0, Path::new(agent))).mode("lockstep")
    };
    for agent in ["own", "./own"] {
        let ended = start(agent).finish().expect(0);
        assert_eq!(ended.report["verdict"], "valid", "{ended}");
    }
    start("elsewhere").finish().expect_failure(3, &["robot `b`", "`elsewhere`", "PATH is not searched"]);
}

#[test]
fn agents_behind_wrappers_work_and_every_signal_reaches_them() {
    let dir = TempDir::new().unwrap();
    let wrappers = [
        script(dir.path(), "shell", &format!("#!/bin/sh\n{SHOAL} agent \"$@\"\n")),
        script(dir.path(), "timeout", &format!("#!/bin/sh\ntimeout 600 {SHOAL} agent \"$@\"\n")),
        script(dir.path(), "shells", &format!("#!/bin/sh\nsh -c 'sh -c \"{SHOAL} agent $*; exit\"; exit' x \"$@\"\n")),
    ];
    let events = "[defaults]\nrestart = \"on-failure\"\nrestart_delay_s = 0.2\n";
    let timeline = "[[event]]\nat_s = 1\nkind = \"pause\"\nrobot = \"b\"\nfor_s = 0.5\n\
                    [[event]]\nat_s = 2\nkind = \"kill\"\nrobot = \"b\"\n";
    let text = |agent: Option<&Path>| {
        let lanes = agent.map_or_else(
            || lanes(3, 3.0).replacen("[defaults]\n", "[defaults]\nradio_range_m = 99\n", 1),
            |agent| wrapped(3, 3.0, agent),
        );
        format!("{}{timeline}", lanes.replacen("[defaults]\n", events, 1))
    };
    let plain = Run::scenario(&text(None)).mode("lockstep").finish().expect(0);
    for wrapper in &wrappers {
        let mut fleet = Run::scenario(&text(Some(wrapper))).mode("lockstep").start();
        let root = fleet.root();
        let ended = fleet.wait().expect(0);
        assert_eq!((ended.hash(), &ended.report["verdict"]), (plain.hash(), &"valid".into()), "{wrapper:?}\n{ended}");
        ended.event("restarted", "b");
        assert_clean(&root);
    }
}

/// A shell that is not told of the end of its children waits for them until the start limit is over.
#[test]
fn an_agent_hears_of_the_end_of_its_children() {
    let dir = TempDir::new().unwrap();
    let held = dir.path().join("held");
    // Without a process of its own, for which it would hold back signals itself.
    let read = format!("while read name mask; do [ \"$name\" != SigBlk: ] || echo $mask > {}; done", held.display());
    let text = format!("#!/bin/sh\n{read} < /proc/$$/status\nexec {SHOAL} agent \"$@\"\n");
    let agent = script(dir.path(), "tells", &text);
    Run::scenario(&wrapped(2, 1.0, &agent)).mode("lockstep").finish().expect(0);
    let held = std::fs::read_to_string(held).unwrap();
    let mask = u64::from_str_radix(held.trim(), 16).unwrap();
    assert_eq!(mask >> (Signal::CHILD.as_raw() - 1) & 1, 0, "SIGCHLD is held back: {held}");
}

/// The process of the agent itself, by its announcement.
fn agent_of(fleet: &mut crate::support::Fleet, slot: u32) -> u32 {
    let gate = fleet.gate();
    wait_for("the agent's announcement", || {
        gate.process(model::RobotInstance { index: RobotIndex(slot), incarnation: 0 })
    })
}

#[test]
fn a_wrapped_agent_is_stopped_shown_and_gone_with_its_daemon() {
    let dir = TempDir::new().unwrap();
    // `timeout` leaves the fleet's process group.
    let wrapper = script(dir.path(), "timeout", &format!("#!/bin/sh\ntimeout 600 {SHOAL} agent \"$@\"\n"));
    let timeline = "[clock]\nstop = \"duration\"\nduration_s = 36000\n\
                    [[event]]\nat_s = 0.5\nkind = \"pause\"\nrobot = \"b\"\nfor_s = 30000\n";
    let mut fleet = Run::scenario(&format!("{}{timeline}", wrapped(2, 1.0, &wrapper))).mode("realtime").start();
    let root = fleet.root();
    let agent = agent_of(&mut fleet, 1);
    wait_for("the pause to reach the agent", || is_stopped(agent).then_some(()));
    let shown = run({
        let mut ps = Command::new(SHOAL);
        ps.args(["ps", "--format", "json"]);
        ps
    });
    assert!(shown.stdout.contains(&format!("\"pid\": {agent}")), "{agent} in {shown}");
    signal(fleet.daemon(), Signal::KILL);
    wait_for("the agent to go with its daemon", || is_gone(agent).then_some(()));
    assert_clean(&root);
}

#[test]
fn a_wrapper_that_does_not_stay_is_told_so() {
    let dir = TempDir::new().unwrap();
    // It goes before the agent can be ready, however busy the machine is.
    let text = format!("#!/bin/sh\nsetsid sh -c 'sleep 1; exec {SHOAL} agent \"$@\"' sh \"$@\" &\n");
    let leaves = script(dir.path(), "leaves", &text);
    let ended = Run::scenario(&wrapped(2, 1.0, &leaves)).mode("lockstep").finish().expect(1);
    impaired(&ended, &["b was not-started", "a wrapper has to stay"]);
}

#[test]
fn the_kernel_says_why_an_agent_cannot_start() {
    let dir = TempDir::new().unwrap();
    let check = |name: &str, text: &str, words: &[&str]| {
        let agent = script(dir.path(), name, text);
        for mode in ["lockstep", "realtime"] {
            let ended = Run::scenario(&wrapped(2, 1.0, &agent)).mode(mode).finish().expect(1);
            impaired(&ended, words);
            assert!(ended.arrived("a") && ended.robot("b")["gone"] == "dead", "{ended}");
        }
    };
    check("interpreter", "#!/no/such/interpreter\n", &["cannot start", "No such file", "is the interpreter"]);
    check("plain-text", "hello\n", &["cannot start", "Exec format error"]);
    check("ends", "#!/bin/sh\necho no licence >&2\nexit 7\n", &["ended with code 7", "no licence"]);
}

#[test]
fn a_list_is_a_program_with_arguments() {
    let dir = TempDir::new().unwrap();
    let wrapper =
        script(dir.path(), "own.sh", &format!("[ \"$1\" = 'a b' ] || exit 9\nshift\nexec {SHOAL} agent \"$@\"\n"));
    let wrapper = wrapper.to_str().unwrap();
    let plain = Run::scenario(&lanes(2, 1.0)).mode("lockstep").finish().expect(0);
    // The first word is looked up in PATH; what the scenario names gives way to `--agent`.
    let list = format!("defaults.agent=[\"sh\", {wrapper:?}, \"a b\"]");
    let run = Run::scenario(&lanes(2, 1.0)).mode("lockstep").set(&list).finish().expect(0);
    assert_eq!((run.hash(), &run.report["verdict"]), (plain.hash(), &"valid".into()), "{run}");
    let with = Run::scenario(&lanes(2, 1.0)).mode("lockstep").set("robot[1].agent='no/such'");
    let run = with.arg("--agent").arg(format!("sh {wrapper} 'a b'")).finish().expect(0);
    assert_eq!(run.hash(), plain.hash(), "{run}");
    let missing = Run::scenario(&lanes(2, 1.0)).mode("lockstep").arg("--agent").arg("no-such-program x");
    missing.finish().expect_failure(3, &["robot `a`", "agent `no-such-program x`", "`no-such-program` is not in PATH"]);
    let single = Run::scenario(&lanes(2, 1.0)).mode("single").arg("--agent").arg("sh");
    single.finish().expect_failure(2, &["`--agent`", "starts no agents", "--mode lockstep"]);
}

#[test]
fn the_spec_is_there_as_json_for_an_agent_of_ones_own() {
    let dir = TempDir::new().unwrap();
    let kept = dir.path().join("spec.json");
    let text = format!("#!/bin/sh\ncp \"$2/agent-$4-$6.json\" {}\nexec {SHOAL} agent \"$@\"\n", kept.display());
    let own = script(dir.path(), "own", &text);
    Run::scenario(&wrapped(2, 1.0, &own)).mode("lockstep").finish().expect(0);
    let spec: serde_json::Value = serde_json::from_slice(&std::fs::read(kept).unwrap()).unwrap();
    assert_eq!((&spec["robot"]["id"], &spec["instance"]["index"]), (&"b".into(), &1.into()), "{spec:#}");
    // docs/agent-protocol.md has a row for each key.
    let page = include_str!("../../docs/agent-protocol.md");
    let keys: Vec<&String> = spec.as_object().unwrap().keys().collect();
    let missing: Vec<_> = keys.iter().filter(|key| !page.contains(&format!("\n| `{key}` | "))).collect();
    assert!(missing.is_empty() && keys.len() > 8, "{missing:?} of {keys:?}");
}

#[test]
fn what_is_not_ready_in_time_is_told_with_its_command_and_its_last_words() {
    let dir = TempDir::new().unwrap();
    let waits = script(dir.path(), "waits.sh", "echo loads a model\nsleep 30\n");
    let agent = format!("robot[1].agent=[\"sh\", {:?}]", waits.to_str().unwrap());
    let run = Run::scenario(&lanes(2, 1.0)).mode("lockstep").set(&agent).set("fleet.start_limit_s=0.5");
    let ended = run.finish().expect(1);
    impaired(
        &ended,
        &["b was not-started", &format!("`sh {}` is not ready within 0.5 s: loads a model", waits.display())],
    );
    assert!(ended.arrived("a"), "{ended}");
    let ends = "robot[1].agent=[\"sh\", \"-c\", \"echo no licence >&2; exit 7\"]";
    let ended = Run::scenario(&lanes(2, 1.0)).mode("lockstep").set(ends).finish().expect(1);
    impaired(&ended, &["its process `sh -c 'echo no licence >&2; exit 7'` ended with code 7: no licence"]);
}

#[test]
fn a_limit_on_processes_costs_robots_and_not_the_fleet() {
    if !geteuid().is_root() {
        return eprintln!("skipped: a user without processes needs root");
    }
    let dir = TempDir::new().unwrap();
    std::fs::set_permissions(dir.path(), std::fs::Permissions::from_mode(0o755)).unwrap();
    let copy = dir.path().join("shoal");
    std::fs::copy(SHOAL, &copy).unwrap();
    // What is foreseen fits: the daemon, its guardian, the world, a process for each robot. One robot has two.
    let two = script(dir.path(), "two", &format!("#!/bin/sh\n{} agent \"$@\"\nexit $?\n", copy.display()));
    let scenario = dir.path().join("lanes.toml");
    std::fs::write(&scenario, wrapped(6, 1.0, &two)).unwrap();
    let limited = |processes: u32| {
        let mut command = Command::new("setpriv");
        command.args(["--reuid=64321", "--regid=64321", "--clear-groups", "prlimit"]);
        command.arg(format!("--nproc={processes}:{processes}")).arg(&copy).arg("run").arg(&scenario);
        command.args(["--mode", "lockstep", "--format", "json"]).current_dir("/");
        run(command)
    };
    limited(5).expect_failure(3, &["processes", "6 robots need", "ulimit -u"]);
    let ended = limited(9).expect(1);
    impaired(&ended, &["not-started"]);
    assert!(ended.report["outcome"]["arrived"].as_u64().unwrap() >= 1, "{ended}");
}

#[test]
fn a_robot_without_room_in_shared_memory_does_not_come_back_and_the_others_go_on() {
    let Some(machine) = PrivateShm::new("-t tmpfs -o size=64m tmpfs") else { return };
    let scenario = format!(
        "{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n",
        lanes(2, 1.0).replacen("[defaults]\n", "[defaults]\nrestart = \"on-failure\"\nrestart_delay_s = 0.1\n", 1)
    );
    let mut fleet = Run::scenario_by(machine.shoal(), &scenario).mode("realtime").start();
    fleet.root();
    let agent = fleet.agent(1);
    wait_for("the fleet to run", || {
        let mut ps = machine.shoal();
        ps.args(["ps", "--format", "json"]);
        run(ps).report["fleets"][0]["tick"].as_u64().filter(|tick| *tick > 5)
    });
    let mut fill = Command::new("dd");
    fill.args(["if=/dev/zero", "bs=4k", "count=20000"]).arg(format!("of={}", machine.path().join("filler").display()));
    run(fill).expect(1);
    signal(agent, Signal::KILL);
    fleet.wait_said("b not-started: ");
    assert!(!fleet.has_ended());
    signal(fleet.daemon(), Signal::INT);
    let ended = fleet.wait().expect(130);
    impaired(&ended, &["b was not-started", "No space left on device"]);
    ended.event("died", "b");
}

#[test]
fn what_an_agent_prints_takes_no_room_and_is_said_with_its_name() {
    const PRINTED: u64 = 30_000_000;
    let dir = TempDir::new().unwrap();
    let text = format!(
        "#!/bin/sh\necho here I am\n(for i in $(seq 300); do yes a flood of words | head -c 100000; sleep 0.01; done; \
         echo; sleep 2; echo the last words) &\nexec {SHOAL} agent \"$@\"\n"
    );
    let loud = script(dir.path(), "loud", &text);
    let scenario = format!("{}[clock]\nstop = \"duration\"\nduration_s = 36000\n", wrapped(2, 1.0, &loud));
    let mut fleet = Run::scenario(&scenario).mode("realtime").start();
    let root = fleet.root();
    let log = root.join("agent-1-0.log");
    let mut most = 0;
    wait_for("the flood to be over", || {
        let meta = std::fs::metadata(&log).ok()?;
        most = most.max(meta.blocks() * 512);
        (meta.len() > PRINTED).then_some(())
    });
    fleet.wait_said("b: the last words");
    let now = std::fs::metadata(&log).unwrap().blocks() * 512;
    assert!(now <= 256 << 10, "{now} bytes are taken, {most} at most meanwhile");
    assert!(most < PRINTED / 2, "{most} bytes of {PRINTED} were taken at once");
    let said = fleet.stderr();
    assert!(said.contains("b: here I am") && said.contains("b: a flood of words"), "{said}");
    assert!(said.contains("of what it printed left out here)"), "{said}");
    assert!(said.len() < 100_000, "{} bytes were said", said.len());
    signal(fleet.daemon(), Signal::INT);
    fleet.wait().expect(130);
    assert_clean(&root);
}

#[test]
fn open_files_are_enough_or_the_run_is_refused() {
    let text = lanes(9, 2.0).replacen("[defaults]\n", "[defaults]\nradio_range_m = 99\n", 1);
    let limited = |files: u64| Run::scenario_by(after(&format!("ulimit -n {files}")), &text).mode("lockstep").finish();
    let free = Run::scenario(&text).mode("lockstep").finish().expect(0);
    let need = descriptors::of_world(9);
    for files in [24, 40, 56, need - 1] {
        let ended = limited(files).expect_failure(3, &["open files", &format!("is {files}"), "ulimit -n"]);
        assert!(ended.stdout.is_empty(), "{ended}");
    }
    for files in [need, need + 1, 128] {
        let ended = limited(files).expect(0);
        assert_eq!((ended.hash(), &ended.report["verdict"]), (free.hash(), &"valid".into()), "{files}\n{ended}");
    }
}

#[test]
fn what_a_process_has_open_is_what_was_reckoned() {
    let text = lanes(9, 2.0).replacen("[defaults]\n", "[defaults]\nradio_range_m = 99\n", 1);
    let text = format!("{text}[clock]\nstop = \"duration\"\nduration_s = 36000\n");
    for mode in ["realtime", "lockstep"] {
        let mut fleet = Run::scenario(&text).mode(mode).start();
        fleet.root();
        let gate = fleet.gate();
        let all_hear =
            || (0..9).all(|slot| gate.heard(model::RobotInstance { index: RobotIndex(slot), incarnation: 0 }) == 8);
        wait_for("everybody to hear everybody", || all_hear().then_some(()));
        let open = |pid: u32| std::fs::read_dir(format!("/proc/{pid}/fd")).unwrap().count() as u64;
        let check = |who: &str, pid: u32, need: u64| {
            let open = open(pid);
            assert!(open <= need && need <= open + 24, "{who}: {open} open, {need} reckoned");
        };
        check("daemon", fleet.daemon(), descriptors::of_daemon() + 3);
        check("world", fleet.process("world"), descriptors::of_world(9));
        check("agent", fleet.agent(4), descriptors::of_agent(8));
        signal(fleet.daemon(), Signal::INT);
        fleet.wait().expect(130);
    }
}

#[test]
fn a_robot_that_cannot_hear_says_so_and_is_not_there() {
    let dir = TempDir::new().unwrap();
    for (files, words) in [
        (descriptors::of_agent(3), ["b was deaf", "cannot hear", "Too many open files"]),
        (20, ["b was deaf", "cannot hear a", "Too many open files"]),
        (8, ["b was not-started", "ended with code 3", "Too many open files"]),
    ] {
        let low = script(dir.path(), "low", &format!("#!/bin/sh\nulimit -n {files}\nexec {SHOAL} agent \"$@\"\n"));
        for mode in ["lockstep", "realtime"] {
            let ended = Run::scenario(&wrapped(9, 1.0, &low)).mode(mode).finish().expect(1);
            impaired(&ended, &words);
            assert_eq!(ended.robot("b")["gone"], "dead", "{ended}");
            assert!(ended.arrived("a") && !ended.arrived("b"), "{ended}");
        }
    }
}

#[test]
fn a_robot_whose_commands_cannot_be_read_is_not_there() {
    let text = lanes(3, 1.0)
        + "[clock]\nstop = \"duration\"\nduration_s = 36000\n\
                                [[event]]\nat_s = 1\nkind = \"join\"\nrobot = \"c\"\n";
    let mut fleet = Run::scenario(&text).mode("realtime").start();
    fleet.root();
    let world = fleet.process("world");
    fleet.wait_tick(1);
    // From outside, because what is foreseen is refused.
    let open = std::fs::read_dir(format!("/proc/{world}/fd")).unwrap().count();
    let mut limit = Command::new("prlimit");
    limit.arg("--pid").arg(world.to_string()).arg(format!("--nofile={}", open + 2));
    run(limit).expect(0);
    fleet.wait_said("c deaf: ");
    signal(fleet.daemon(), Signal::INT);
    let ended = fleet.wait().expect(130);
    impaired(&ended, &["c was deaf", "its commands cannot be read", "Too many open files"]);
}
