//! The pace of fleets in `lockstep`: a second terminal holds their ticks, has some of them done, and lets them go on.

use crate::support::{Run, assert_clean, lanes, shoal, signal, wait_for};
use rustix::process::Signal;
use serde_json::{Value, json};
use std::time::{Duration, Instant};

#[test]
fn a_fleet_is_paused_stepped_and_goes_on_to_the_same_hash() {
    let single = Run::scenario(&lanes(2, 3.0)).mode("single").finish().expect(0);
    let mut fleet = Run::scenario(&lanes(2, 3.0)).mode("lockstep").arg("--paused").start();
    let (root, id) = (fleet.root(), fleet.id());
    fleet.wait_said("the fleet pauses at tick 0");
    let json = |args: &[&str]| shoal(&[args, &["--fleet", &id, "--format", "json"]].concat()).expect(0).report;
    let status = || json(&["ps"])["fleets"][0].clone();

    assert_eq!((&status()["tick"], &status()["paused"], &status()["rate"]), (&json!(0), &json!(true), &Value::Null));
    let stepped = json(&["step", "10"]);
    assert_eq!(
        (&stepped["schema"], &stepped["tick"], &stepped["until_tick"]),
        (&json!("shoal.pace/1"), &json!(10), &Value::Null)
    );
    // Nothing happens without an operator, and nobody is given up for it.
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!((&status()["tick"], &status()["waits_for"]), (&json!(10), &json!([])));
    let text = shoal(&["ps", "--fleet", &id]).expect(0).stdout;
    assert!(text.contains(", paused") && !text.contains("ago"), "{text}");
    assert_eq!(json(&["step"])["tick"], 11);

    // At this rate a tick takes 5 s, but for the first one: longer than the daemon lets an operator wait.
    assert_eq!(json(&["resume", "--rate", "0.004"])["rate"], 0.004);
    assert_eq!(json(&["pause"])["paused"], true);
    assert!(json(&["step", "2", "--timeout", "60s"])["tick"].as_u64() >= Some(13));
    let late = shoal(&["step", "5000", "--timeout", "1ms", "--fleet", &id]).expect(4);
    assert!(late.stderr.contains("are not done after"), "{late}");
    let resumed = json(&["resume", "--rate", "max"]);
    assert_eq!(
        (&resumed["paused"], &resumed["rate"], &resumed["until_tick"]),
        (&json!(false), &Value::Null, &Value::Null)
    );
    let ended = fleet.wait().expect(0);
    assert_eq!(ended.hash(), single.hash(), "{ended}");
    assert_clean(&root);
}

#[test]
fn a_paused_fleet_takes_tasks_notices_deaths_and_ends_at_once() {
    let scenario = format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(2, 1.0));
    let run = Run::scenario(&scenario).mode("lockstep").set("defaults.restart=\"on-failure\"");
    let run = run.set("defaults.restart_delay_s=0").set("fleet.max_robots=3").set("world.y_m=[-4, 8]");
    let mut fleet = run.arg("--paused").start();
    let (root, id) = (fleet.root(), fleet.id());
    fleet.wait_said("the fleet pauses at tick 0");
    let ask = |args: &[&str]| shoal(&[args, &["--fleet", &id]].concat());
    let json = |args: &[&str]| ask(&[args, &["--format", "json"]].concat()).expect(0).report;
    json(&["step", "3"]);

    let task = json(&["task", "send", "a", "0,0"]);
    assert_eq!(task["robot"], "a", "acknowledged, although no tick opens");
    signal(fleet.agent(1), Signal::KILL);
    fleet.wait_said("b died");
    // Its next process is there before the fleet goes on.
    fleet.wait_ready(1, 1);
    ask(&["add", "--id", "c", "--start", "0,-2", "--goal", "1,-2"])
        .expect_failure(3, &["robot `c`: not confirmed: the fleet is paused at tick 3", "shoal resume"]);
    assert_eq!(json(&["step", "2"])["tick"], 5);
    let robots = json(&["ps"])["fleets"][0]["robots"].clone();
    let running = robots.as_array().unwrap().iter().filter(|robot| robot["state"] == "running").count();
    assert_eq!((running, &robots[1]["incarnation"]), (3, &json!(1)), "{robots:#}");

    let began = Instant::now();
    signal(fleet.daemon(), Signal::INT);
    let ended = fleet.wait().expect(130);
    assert!(began.elapsed() < Duration::from_secs(5), "{:?}", began.elapsed());
    assert_eq!(ended.report["ticks"], 5, "{ended}");
    ended.event("task", "a");
    assert_clean(&root);
}

/// A robot that hangs keeps the open tick open; the pause says so.
#[test]
fn a_pause_waits_for_the_open_tick_and_no_longer_than_a_few_seconds() {
    let scenario = format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(2, 1.0));
    let mut fleet = Run::scenario(&scenario).mode("lockstep").set("fleet.straggler=\"wait\"").start();
    let (root, id) = (fleet.root(), fleet.id());
    fleet.wait_tick(5);
    let agent = fleet.agent(0);
    signal(agent, Signal::STOP);
    fleet.wait_said("waits for robot `a`");
    shoal(&["pause", "--fleet", &id]).expect_failure(3, &["is still open", "shoal ps"]);
    signal(agent, Signal::CONT);
    let paused = shoal(&["pause", "--fleet", &id, "--format", "json"]).expect(0).report;
    let tick = fleet.tick();
    assert_eq!(paused["tick"], tick, "{paused:#}");
    signal(fleet.daemon(), Signal::INT);
    fleet.wait().expect(130);
    assert_clean(&root);
}

#[test]
fn a_rate_holds_processes_and_one_thread_to_the_clock() {
    // Half a second of simulated time.
    for mode in ["lockstep", "single"] {
        let run = Run::scenario(&lanes(1, 100.0)).mode(mode).arg("--duration").arg("0.5s").arg("--rate").arg("0.5");
        let began = Instant::now();
        let ended = run.finish().expect(4);
        // From the first tick to the last one.
        assert!(began.elapsed() >= Duration::from_millis(900), "{mode}: {:?}", began.elapsed());
        assert_eq!(ended.report["ticks"], 25, "{ended}");
    }
}

#[test]
fn what_has_no_ticks_to_hold_says_so() {
    let check = |mode: &str, options: &[&str], words: &[&str]| {
        let run = options.iter().fold(Run::scenario(&lanes(1, 1.0)).mode(mode), |run, option| run.arg(option));
        run.finish().expect_failure(2, words);
    };
    check("realtime", &["--paused"], &["`--paused`", "realtime", "--mode lockstep"]);
    check("realtime", &["--rate", "2"], &["`--rate`", "realtime", "--mode lockstep"]);
    check("single", &["--paused"], &["`--paused`", "single", "--mode lockstep"]);

    let scenario = format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(1, 1.0));
    let mut fleet = Run::scenario(&scenario).mode("realtime").start();
    let id = fleet.id();
    fleet.wait_tick(1);
    for verb in ["pause", "resume", "step"] {
        shoal(&[verb, "--fleet", &id]).expect_failure(2, &["realtime", "--mode lockstep", "inject pause"]);
    }
    let status = wait_for("the status", || {
        shoal(&["ps", "--fleet", &id, "--format", "json"]).report["fleets"][0].as_object().cloned()
    });
    assert_eq!((&status["paused"], &status["rate"]), (&json!(false), &json!(1.0)));
    signal(fleet.daemon(), Signal::INT);
    fleet.wait().expect(130);
}
