//! Limits of memory and open files that a scenario sets for agents: a fleet runs with the smallest that are accepted, and an
//! agent that wants more dies alone, with the name of the limit.

use crate::support::{Run, assert_clean, example, lanes, signal};
use rustix::process::Signal;

#[test]
fn an_agent_that_hits_its_limit_dies_with_the_name_of_the_limit() {
    let agent = example("hungry_agent");
    for (eats, key, words) in
        [("memory", "memory_mib_max=16", "memory allocation of"), ("files", "files_max=60", "os error 24")]
    {
        // It is the last robot.
        let run = Run::scenario(&format!("{}agent = {agent:?}\n", lanes(2, 3.0))).mode("lockstep");
        let ended = run.env("SHOAL_EATS", eats).set(&format!("processes.agents.{key}")).finish().expect(1);
        let detail = ended.event("died", "b")["detail"].as_str().unwrap().to_owned();
        let limit = format!("(its limit is processes.agents.{})", key.replace('=', " = "));
        assert!(detail.contains(words) && detail.ends_with(&limit), "{detail}\n{ended}");
        assert!(ended.arrived("a"), "{ended}");
    }
}

#[test]
fn a_fleet_runs_with_the_smallest_limits_and_not_with_less() {
    // Each of twelve robots hears eleven others.
    let run = |mode: &str, memory_mib: u32, files: u32| {
        let run = Run::scenario(&lanes(12, 1.0)).mode(mode).set("defaults.radio_range_m=99");
        let run = run.set(&format!("processes.agents.memory_mib_max={memory_mib}"));
        run.set(&format!("processes.agents.files_max={files}")).set("fleet.command_timeout_s=30")
    };
    let ended = run("lockstep", 1, 80).finish().expect(0);
    assert_eq!(ended.report["outcome"]["arrived"], 12, "{ended}");
    let mut fleet = run("realtime", 1, 80).set("clock.stop=\"duration\"").set("clock.duration_s=36000").start();
    let root = fleet.root();
    fleet.wait_tick(20);
    let limits = |pid: u32| std::fs::read_to_string(format!("/proc/{pid}/limits")).unwrap();
    let (agent, world) = (limits(fleet.agent(3)), limits(fleet.process("world")));
    let of = |limits: &str, name: &str| {
        let line = limits.lines().find(|line| line.starts_with(name)).unwrap().to_owned();
        line[name.len()..].split_whitespace().take(2).map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(of(&agent, "Max data size"), ["1048576", "1048576"], "{agent}");
    assert_eq!(of(&agent, "Max open files"), ["80", "80"], "{agent}");
    assert_ne!(of(&world, "Max data size"), of(&agent, "Max data size"), "the world is not an agent");
    signal(fleet.daemon(), Signal::INT);
    let ended = fleet.wait().expect(130);
    assert!(ended.report["events"].as_array().unwrap().iter().all(|event| event["kind"] != "deaf"), "{ended}");
    assert_clean(&root);
    let files = ["processes.agents.files_max: 79 open files", "hears 11 others, needs 80", "files_max = 80"];
    run("lockstep", 1, 79).finish().expect_failure(3, &files);
    // `single` has no processes to limit.
    run("single", 1, 1).finish().expect(0);
}
