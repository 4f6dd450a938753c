//! Processes that die, stop, or never come up: the fleet goes on, and the report says who, when, and what was done.

use crate::support::{Ended, Fleet, Run, SHOAL, assert_clean, is_gone, lanes, script, shoal, signal, stop, wait_for};
use rustix::process::Signal;
use tempfile::TempDir;

/// A run in `lockstep` that is long enough to do something to it: 10 000 ticks of simulated time until all arrive.
fn long_lockstep(robots: usize) -> Run {
    Run::scenario(&lanes(robots, 10.0)).mode("lockstep").set("clock.tick_hz=1000").set("clock.duration_s=3600")
}

fn short_realtime(robots: usize) -> Run {
    Run::scenario(&lanes(robots, 2.5)).mode("realtime").set("fleet.command_timeout_s=30")
}

/// Kills the agent of `b` in the middle of the run.
fn kill_b(fleet: &mut Fleet) {
    fleet.wait_tick(20);
    let agent = fleet.agent(1);
    signal(agent, Signal::KILL);
}

fn assert_b_is_dead_and_the_others_arrived(ended: &Ended) {
    let died = ended.event("died", "b");
    assert!(died["tick"].as_u64().unwrap() >= 20 && died["detail"] == "signal 9", "{ended}");
    assert_eq!((ended.arrived("a"), ended.arrived("b"), ended.arrived("c")), (true, false, true), "{ended}");
    assert_eq!(ended.robot("b")["gone"], "dead", "{ended}");
    assert!(ended.stderr.contains("b died: signal 9"), "{ended}");
    assert!(ended.report["unmet"][0].as_str().unwrap().contains("missing: b"), "{ended}");
}

#[test]
fn a_killed_robot_does_not_stop_a_lockstep_fleet() {
    let mut fleet = long_lockstep(3).start();
    let root = fleet.root();
    kill_b(&mut fleet);
    assert_b_is_dead_and_the_others_arrived(&fleet.wait().expect(1));
    assert_clean(&root);
}

#[test]
fn a_killed_robot_does_not_stop_a_realtime_fleet() {
    let mut fleet = short_realtime(3).start();
    let root = fleet.root();
    kill_b(&mut fleet);
    assert_b_is_dead_and_the_others_arrived(&fleet.wait().expect(1));
    assert_clean(&root);
}

/// Kills `b` twice, and looks for its later lives.
fn restarts(run: Run) {
    let run = run.set("defaults.restart=\"on-failure\"").set("defaults.restart_delay_s=0.1");
    let mut fleet = run.start();
    let root = fleet.root();
    kill_b(&mut fleet);
    let again = wait_for("the next life of b", || {
        let mut lives = fleet.agents().into_iter().filter(|agent| agent.slot() == Some(1));
        lives.find(|agent| agent.incarnation() == Some(1)).map(|agent| agent.pid)
    });
    let ended = fleet.wait().expect(0);
    assert_eq!(
        (ended.event("died", "b"), ended.robot("b")["incarnation"].as_u64()),
        (ended.event("died", "b"), Some(1))
    );
    assert_eq!(ended.event("restarted", "b")["detail"], "incarnation 1", "{ended}");
    assert_eq!(ended.robot("b")["pid"], again, "{ended}");
    assert!(["a", "b", "c"].iter().all(|id| ended.arrived(id)), "{ended}");
    assert_clean(&root);
}

#[test]
fn a_killed_robot_comes_back_in_lockstep() {
    restarts(long_lockstep(3));
}

#[test]
fn a_killed_robot_comes_back_in_realtime() {
    restarts(short_realtime(3));
}

#[test]
fn a_stopped_robot_is_held_and_comes_back() {
    let mut fleet = long_lockstep(3).set("fleet.straggler=\"hold\"").start();
    let root = fleet.root();
    fleet.wait_tick(20);
    let agent = fleet.agent(1);
    stop(agent);
    fleet.wait_said("b held: stopped");
    // The others do not wait.
    let tick = fleet.tick();
    fleet.wait_tick(tick + 100);
    signal(agent, Signal::CONT);
    let ended = fleet.wait().expect(0);
    assert_eq!(ended.event("held", "b")["detail"], "stopped", "{ended}");
    assert_eq!(ended.event("resumed", "b")["detail"], "answers again", "{ended}");
    assert_eq!((&ended.report["verdict"], ended.robot("b")["incarnation"].as_u64()), (&"starved".into(), Some(0)));
    assert!(["a", "b", "c"].iter().all(|id| ended.arrived(id)), "{ended}");
    assert_clean(&root);
}

#[test]
fn a_stopped_robot_stands_still_in_realtime() {
    let mut fleet = Run::scenario(&lanes(2, 2.5)).mode("realtime").set("fleet.command_timeout_s=0.5").start();
    let root = fleet.root();
    fleet.wait_tick(20);
    let agent = fleet.agent(1);
    stop(agent);
    fleet.wait_said("b held: overdue");
    let gate = fleet.gate();
    wait_for("the other one to arrive", || (gate.progress().arrived == 1).then_some(()));
    signal(agent, Signal::CONT);
    let ended = fleet.wait().expect(0);
    assert_eq!(ended.event("resumed", "b")["detail"], "answers again", "{ended}");
    assert!(ended.arrived("a") && ended.arrived("b"), "{ended}");
    assert_clean(&root);
}

#[test]
fn a_stopped_robot_is_dropped() {
    let mut fleet = long_lockstep(3).set("fleet.straggler=\"drop\"").start();
    let root = fleet.root();
    fleet.wait_tick(20);
    let agent = fleet.agent(1);
    signal(agent, Signal::STOP);
    wait_for("the stopped process to be killed", || is_gone(agent).then_some(()));
    let ended = fleet.wait().expect(1);
    assert_eq!(ended.event("dropped", "b")["detail"], "stopped", "{ended}");
    assert_eq!(ended.robot("b")["gone"], "dropped", "{ended}");
    assert_eq!((ended.arrived("a"), ended.arrived("b"), ended.arrived("c")), (true, false, true), "{ended}");
    assert_clean(&root);
}

#[test]
fn a_stopped_robot_is_waited_for_and_changes_nothing() {
    let undisturbed = long_lockstep(2).finish().expect(0);
    let mut fleet = long_lockstep(2).set("fleet.straggler_limit_s=3600").start();
    fleet.wait_tick(20);
    let agent = fleet.agent(1);
    stop(agent);
    // The world is at the tick that the stopped robot does not answer, or will be.
    let gate = fleet.gate();
    let mut seen = (u64::MAX, 0);
    wait_for("the fleet to wait", || {
        let tick = gate.progress().tick;
        seen = if seen.0 == tick { (tick, seen.1 + 1) } else { (tick, 0) };
        (seen.1 > 20).then_some(())
    });
    signal(agent, Signal::CONT);
    let ended = fleet.wait().expect(0);
    assert_eq!(ended.hash(), undisturbed.hash(), "{ended}");
    assert_eq!(ended.report["verdict"], "valid", "{ended}");
}

#[test]
fn a_stopped_robot_is_waited_for_no_longer_than_the_limit() {
    let mut fleet = long_lockstep(2).set("fleet.straggler_limit_s=0.5").set("clock.duration_s=15").start();
    let root = fleet.root();
    fleet.wait_tick(20);
    let agent = fleet.agent(1);
    stop(agent);
    // It never goes on, and nobody ends it but the end of the run.
    let ended = fleet.wait().expect(4);
    assert_eq!(ended.event("held", "b")["detail"], "overdue", "{ended}");
    assert_eq!((ended.arrived("a"), ended.arrived("b")), (true, false), "{ended}");
    assert_clean(&root);
}

#[test]
fn agents_that_never_come_up_do_not_stop_the_fleet() {
    let dir = TempDir::new().unwrap();
    let starts = dir.path().join("starts");
    let agents = [
        script(dir.path(), "never-ready", "#!/bin/sh\nsleep 1000\n"),
        script(dir.path(), "ends-at-once", &format!("#!/bin/sh\necho start >> {}\nexit 1\n", starts.display())),
        script(dir.path(), "cannot-start", "#!/nonexistent/interpreter\n"),
    ];
    let mut scenario = lanes(1, 2.0);
    for (index, agent) in agents.iter().enumerate() {
        let y_m = -2.0 * (index + 1) as f64;
        scenario +=
            &format!("[[robot]]\nid = \"bad-{index}\"\nstart_m = [0, {y_m}]\ngoal_m = [2, {y_m}]\nagent = {agent:?}\n");
    }
    for (turn, mode) in ["lockstep", "realtime"].into_iter().enumerate() {
        let run = Run::scenario(&scenario).mode(mode).set("world.y_m=[-10, 10]").set("fleet.start_limit_s=1");
        let mut fleet = run.start();
        let root = fleet.root();
        let ended = fleet.wait().expect(1);
        assert!(ended.arrived("a"), "{ended}");
        for index in 0..agents.len() {
            let id = format!("bad-{index}");
            ended.event("not-started", &id);
            assert!(!ended.robot(&id)["gone"].is_null() && !ended.arrived(&id), "{ended}");
        }
        let lines = std::fs::read_to_string(&starts).unwrap().lines().count();
        assert_eq!(lines, turn + 1, "one life is one process\n{ended}");
        assert_clean(&root);
    }
}

/// An agent that ends by itself with code 0 has not failed: only `always` starts it again, until the limit.
#[test]
fn an_agent_that_ends_without_a_failure_is_restarted_by_the_policy_always_alone() {
    let dir = TempDir::new().unwrap();
    // Each life ends when its file is there.
    let until = format!("until [ -e {}/end-$life ]; do sleep 0.02; done", dir.path().display());
    let life = "life=$(echo \"$*\" | sed 's/.*--incarnation \\([0-9]*\\).*/\\1/')";
    let text = format!("#!/bin/sh\n{life}\n{SHOAL} agent \"$@\" &\n{until}\nkill -9 $!\nwait $!\nexit 0\n");
    let agent = script(dir.path(), "ends", &text);
    for (policy, restarts, word) in [("on-failure", 0, "dead"), ("always", 2, "restart-limit")] {
        let scenario = lanes(3, 1.0).replacen("id = \"b\"\n", &format!("id = \"b\"\nagent = {agent:?}\n"), 1);
        let scenario = format!("{scenario}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n");
        let run = Run::scenario(&scenario).mode("realtime").set(&format!("defaults.restart=\"{policy}\""));
        let mut fleet = run.set("defaults.restart_limit=2").set("defaults.restart_delay_s=0.05").start();
        let (id, root) = (fleet.id(), fleet.root());
        fleet.wait_tick(1);
        let b = || {
            let ps = shoal(&["ps", "--fleet", &id, "--format", "json"]).expect(0).report;
            ps["fleets"][0]["robots"][1].clone()
        };
        for life in 0..=restarts {
            wait_for("b to take part", || (b()["state"] == "running" && b()["incarnation"] == life).then_some(()));
            std::fs::write(dir.path().join(format!("end-{life}")), "").unwrap();
        }
        wait_for("what `ps` shows", || (b()["state"] == word).then_some(()));
        // The daemon knows of a death before the world does.
        fleet.wait_said("b died: exit code 0");
        signal(fleet.daemon(), Signal::INT);
        let ended = fleet.wait().expect(130);
        assert_eq!(ended.event("died", "b")["detail"], "exit code 0", "{ended}");
        assert_eq!(ended.robot("b")["incarnation"], restarts, "{ended}");
        let limits = ended.report["events"].as_array().unwrap().iter().filter(|event| event["kind"] == "restart-limit");
        assert_eq!(limits.count(), usize::from(policy == "always"), "{ended}");
        assert_clean(&root);
        for life in 0..=restarts {
            std::fs::remove_file(dir.path().join(format!("end-{life}"))).unwrap();
        }
    }
}
