//! Robots are processes; they need nobody but each other and the world; fleets do not meet; nothing spins.

use crate::support::{Run, assert_clean, is_stopped, lanes, signal, stop, wait_for};
use bus::{Node, WorldObserver};
use model::RobotIndex;
use rustix::process::Signal;
use std::collections::BTreeSet;

/// Processor time of a whole fleet of 15 as a share of one processor. It takes about a tenth of that.
const CPU_SHARE_MAX: f64 = 0.5;

#[test]
fn every_robot_is_a_process_and_none_of_them_spins() {
    let mut fleet = Run::catalog("demo-15").mode("realtime").arg("--duration").arg("6s").start();
    fleet.wait_tick(1);
    let first: BTreeSet<_> = fleet.agents().iter().map(|agent| agent.pid).collect();
    assert!(first.len() >= 15, "{first:?}");
    assert_eq!(fleet.process("world"), fleet.process("world"));
    // Two robots join later: they are in the scenario, but nobody has started them yet.
    wait_for("the late joiners", || (fleet.agents().len() == 17).then_some(()));
    let pids: BTreeSet<_> = fleet.agents().iter().map(|agent| agent.pid).collect();
    assert!(pids.is_superset(&first), "{pids:?} {first:?}");

    // 6 s are not enough.
    let ended = fleet.wait().expect(4);
    let named: BTreeSet<_> = ended.report["per_robot"].as_array().unwrap().iter().map(|r| r["pid"].as_u64()).collect();
    assert_eq!(named, pids.iter().map(|pid| Some(u64::from(*pid))).collect(), "the report names these processes");
    for late in ["late-1", "late-2"] {
        assert!(ended.event("joined", late)["tick"].as_u64().unwrap() >= 100, "{ended}");
    }
    let (cpu_s, wall_s) = (&ended.report["resources"]["cpu_s"], &ended.report["wall_time_s"]);
    let share = cpu_s.as_f64().unwrap() / wall_s.as_f64().unwrap();
    eprintln!("15 robots in realtime take {share:.3} of a processor");
    assert!(share < CPU_SHARE_MAX, "{share:.3} of a processor\n{ended}");
}

#[test]
fn a_fleet_drives_on_while_its_daemon_is_stopped() {
    let scenario = lanes(3, 2.5);
    // A late command must not stop a robot here, however loaded the machine is.
    let mut fleet = Run::scenario(&scenario).mode("realtime").set("fleet.command_timeout_s=30").start();
    let (root, daemon) = (fleet.root(), fleet.daemon());
    fleet.wait_tick(1);
    stop(daemon);
    let node = Node::new(&fleet.address(), "test").unwrap();
    let observer = WorldObserver::open(&node, 0).unwrap();
    let places = || (0..3).map(|slot| observer.odometry(RobotIndex(slot)).x_m).collect::<Vec<_>>();
    let before = places();
    wait_for("every robot to drive on", || places().iter().zip(&before).all(|(x, x0)| *x > x0 + 0.5).then_some(()));
    let gate = fleet.gate();
    wait_for("every robot to arrive", || (gate.progress().arrived == 3).then_some(()));
    assert!(is_stopped(daemon) && !fleet.has_ended());
    drop((observer, node));
    signal(daemon, Signal::CONT);

    let ended = fleet.wait().expect(0);
    assert_eq!(ended.report["outcome"]["arrived"], 3, "{ended}");
    assert!(ended.report["latency"]["reaction_us"]["n"].as_u64().unwrap() > 0, "{ended}");
    ended.event("arrived", "c");
    assert_clean(&root);
}

#[test]
fn two_fleets_at_once_do_not_meet() {
    let scenario = format!("{}\n[clock]\nmode = \"lockstep\"\nstop = \"duration\"\nduration_s = 60\n", lanes(4, 3.0));
    let mut first = Run::scenario(&scenario).places(2).start();
    let roots_and_other = {
        // The second one counts for none: the first holds the places of both.
        let mut second = Run::scenario(&scenario).places(0).start();
        let roots = (first.root(), second.root());
        (roots, second.wait().expect(0))
    };
    let ((root, other_root), other) = roots_and_other;
    assert_ne!(root, other_root);
    let one = first.wait().expect(0);
    assert_eq!(one.hash(), other.hash());
    assert_clean(&root);
    assert_clean(&other_root);
}
