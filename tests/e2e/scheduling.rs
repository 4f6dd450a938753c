//! Processors and scheduling classes: every process of the robots and of the world has what the scenario says, in every
//! life and from wherever it came; nobody else has. What the machine refuses is said before anything is started.

use crate::support::{Run, SHOAL, assert_clean, example, lanes, run, shoal, signal, wait_for};
use rustix::process::{Signal, geteuid};
use rustix::thread::sched_getaffinity;
use std::os::unix::fs::PermissionsExt;
use std::process::Command;

/// `SCHED_OTHER` and `SCHED_BATCH` in the 41st field of `/proc/PID/stat`.
const OTHER: &str = "0";
const BATCH: &str = "3";

/// The processors that a process may use, and its class.
fn scheduling_of(pid: u32) -> (String, String) {
    let read = |file: &str| std::fs::read_to_string(format!("/proc/{pid}/{file}")).unwrap();
    let status = read("status");
    let cpus = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).unwrap().trim().to_owned();
    let stat = read("stat");
    // The fields after the name count from the third.
    let class = stat.rsplit_once(')').unwrap().1.split_ascii_whitespace().nth(41 - 3).unwrap().to_owned();
    (cpus, class)
}

/// The first processor that this process may use: containers do not always have number 0.
fn first_cpu() -> usize {
    let mine = sched_getaffinity(None).unwrap();
    (0..1024).find(|cpu| mine.is_set(*cpu)).unwrap()
}

#[test]
fn robots_and_world_have_what_the_scenario_says_and_nobody_else_has() {
    let cpu = first_cpu();
    let own = example("own_planner");
    let scenario = format!(
        "{}agent = {own:?}\n\
         [[robot]]\nid = \"late\"\nstart_m = [0, 6]\ngoal_m = [36000, 6]\n\
         [[event]]\nat_s = 0.2\nkind = \"join\"\nrobot = \"late\"\n\
         [clock]\nstop = \"duration\"\nduration_s = 36000\n\
         [processes.agents]\ncpus = [{cpu}]\nscheduling = \"batch\"\n\
         [processes.world]\nscheduling = \"batch\"\n",
        lanes(2, 36000.0)
    );
    let run = Run::scenario(&scenario).mode("realtime").set("world.y_m=[-4, 8]").set("fleet.command_timeout_s=30");
    let run = run.set("defaults.restart=\"on-failure\"").set("defaults.restart_delay_s=0.1");
    let mut fleet = run.start();
    let (root, id) = (fleet.root(), fleet.id());
    fleet.wait_tick(20);
    let late = fleet.agent(2);
    signal(fleet.agent(0), Signal::KILL);
    let again = wait_for("the next life of a", || {
        let mut lives = fleet.agents().into_iter().filter(|agent| agent.slot() == Some(0));
        lives.find(|agent| agent.incarnation() == Some(1)).map(|agent| agent.pid)
    });
    shoal(&["add", "--fleet", &id, "--id", "new", "--start", "0,-2", "--goal", "1,-2"]).expect(0);
    let added = fleet.agent(3);

    let inherited = scheduling_of(std::process::id()).0;
    let batch = |cpus: &str| (cpus.to_owned(), BATCH.to_owned());
    let of_others = fleet.agent(1);
    for (whose, pid) in [("agent of its own", of_others), ("late", late), ("restarted", again), ("added", added)] {
        // Between fork and exec a process is still the daemon: it has its command line, but not yet its class.
        wait_for(whose, || (scheduling_of(pid) == batch(&cpu.to_string())).then_some(()));
    }
    assert_eq!(scheduling_of(fleet.process("world")), batch(&inherited));
    for pid in [fleet.daemon(), fleet.process("guardian")] {
        assert_eq!(scheduling_of(pid), (inherited.clone(), OTHER.to_owned()), "{pid}");
    }

    signal(fleet.daemon(), Signal::INT);
    let ended = fleet.wait().expect(130);
    let told = &ended.report["resources"]["scheduling"];
    assert_eq!(told["agents"], serde_json::json!({ "cpus": [cpu], "class": "batch", "priority": null }), "{ended}");
    assert_eq!(told["world"], serde_json::json!({ "cpus": null, "class": "batch", "priority": null }), "{ended}");
    assert_clean(&root);
}

#[test]
fn processors_that_are_not_there_or_not_allowed() {
    let refused = |run: Run, words: &[&str]| {
        let ended = run.finish().expect_failure(3, words);
        assert!(ended.stdout.is_empty(), "{ended}");
    };
    if std::thread::available_parallelism().unwrap().get() < 1000 {
        let run = Run::scenario(&lanes(1, 1.0)).mode("lockstep").set("processes.world.cpus=[1023]");
        refused(run, &["processes.world.cpus: processor 1023: not online"]);
        // There is no process to be scheduled.
        Run::scenario(&lanes(1, 1.0)).mode("single").set("processes.world.cpus=[1023]").finish().expect(0);
    }
    let mine = sched_getaffinity(None).unwrap();
    let mut allowed = (0..1024).filter(|cpu| mine.is_set(*cpu));
    let (Some(first), Some(second)) = (allowed.next(), allowed.next()) else {
        return eprintln!("skipped: a second processor is needed to be refused it");
    };
    let mut narrow = Command::new("taskset");
    narrow.args(["-c", &first.to_string(), SHOAL]);
    let run =
        Run::scenario_by(narrow, &lanes(1, 1.0)).mode("realtime").set(&format!("processes.agents.cpus=[{second}]"));
    refused(run, &[&format!("processes.agents.cpus: processor {second}: not allowed"), "taskset -c"]);
}

#[test]
fn a_real_time_class_that_is_not_permitted() {
    // Without privileges, and with the limit that does instead. Somewhere another user can execute it.
    let dir = tempfile::TempDir::new().unwrap();
    std::fs::set_permissions(dir.path(), std::fs::Permissions::from_mode(0o755)).unwrap();
    let copy = dir.path().join("shoal");
    std::fs::copy(SHOAL, &copy).unwrap();
    let with_limit = |limit: u32, whose: &str, class: &str, priority: u32| {
        let mut command = Command::new("prlimit");
        command.arg(format!("--rtprio={limit}:{limit}"));
        if geteuid().is_root() {
            command.args(["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"]);
        }
        command.arg(&copy).args(["run", "head-on", "--mode", "lockstep"]).current_dir("/");
        command.arg("--set").arg(format!("processes.{whose}.scheduling={class}"));
        command.arg("--set").arg(format!("processes.{whose}.priority={priority}"));
        run(command)
    };
    let words = ["processes.world.scheduling: fifo with priority 5: not permitted", "is 0", "ulimit -r 5"];
    let ended = with_limit(0, "world", "fifo", 5).expect_failure(3, &words);
    assert!(ended.stdout.is_empty(), "{ended}");

    let ended = with_limit(4, "agents", "rr", 4);
    match ended.code {
        Some(1) if ended.stderr.contains("prlimit") => eprintln!("skipped: raising the limit is not permitted"),
        Some(0) => assert!(ended.stdout.contains("as rr 4"), "{ended}"),
        // The limit allows it, the cgroup does not.
        _ => drop(ended.expect_failure(3, &["rr with priority 4: not permitted, although", "cpu.rt_runtime_us"])),
    }
}
