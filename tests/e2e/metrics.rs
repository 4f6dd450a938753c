//! `shoal metrics`: a running fleet in the text format of Prometheus.

use crate::support::{Run, assert_clean, lanes, shoal, signal, wait_for};
use rustix::process::Signal;
use shoal_tests::prometheus::{Family, parse};

fn value(families: &[Family], name: &str, labels: &[(&str, &str)]) -> f64 {
    let mut samples = families.iter().flat_map(|family| &family.samples);
    let has = |(key, value): &(&str, &str), of: &[(String, String)]| of.iter().any(|(k, v)| k == key && v == value);
    let found = samples.find(|sample| sample.name == name && labels.iter().all(|label| has(label, &sample.labels)));
    found.unwrap_or_else(|| panic!("no {name} {labels:?} in {families:#?}")).value
}

#[test]
fn a_collector_reads_what_a_running_fleet_does() {
    let scenario = format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(2, 1.0));
    let mut fleet = Run::scenario(&scenario).mode("realtime").set("fleet.command_timeout_s=30").start();
    let (root, id) = (fleet.root(), fleet.id());
    fleet.wait_tick(1);
    let look = || {
        let text = shoal(&["metrics", "--fleet", &id]).expect(0).stdout;
        parse(&text).unwrap_or_else(|problem| panic!("{problem}\n{text}"))
    };
    let first = wait_for("both robots to arrive and their figures", || {
        let seen = look();
        let is_measured =
            seen.iter().any(|family| family.name == "shoal_reaction_seconds" && family.samples.len() >= 12);
        (value(&seen, "shoal_robots_arrived", &[]) == 2.0 && is_measured).then_some(seen)
    });
    assert_eq!(value(&first, "shoal_fleet_info", &[("fleet", &id), ("mode", "realtime")]), 1.0);
    assert_eq!(value(&first, "shoal_robots", &[("state", "running")]), 2.0);
    assert_eq!(value(&first, "shoal_robot_goals_done_total", &[("robot", "b")]), 1.0);
    for process in ["daemon", "world", "a", "b"] {
        assert!(value(&first, "shoal_process_resident_memory_bytes", &[("process", process)]) > 0.0);
        assert!(value(&first, "shoal_process_cpu_seconds_total", &[("process", process)]) > 0.0);
    }
    let quantile = |of: &str| value(&first, "shoal_plan_seconds", &[("process", "a"), ("quantile", of)]);
    assert!(quantile("0.5") > 0.0 && quantile("0.5") <= quantile("0.99") && quantile("0.99") <= quantile("1"));
    assert!(value(&first, "shoal_shared_memory_bytes", &[]) > 0.0);
    let second = look();
    for counter in ["shoal_ticks_total", "shoal_process_cpu_seconds_total", "shoal_periods_total"] {
        assert!(value(&second, counter, &[]) >= value(&first, counter, &[]), "{counter}");
    }

    shoal(&["inject", "kill", "b", "--fleet", &id]).expect(0);
    wait_for("the dead robot to be counted", || {
        (value(&look(), "shoal_robots", &[("state", "dead")]) == 1.0).then_some(())
    });
    signal(fleet.daemon(), Signal::INT);
    fleet.wait().expect(130);
    assert_clean(&root);
}
