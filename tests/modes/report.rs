//! Every field of the contract (`shoal.report/1`) is there, in every mode, with a value wherever the mode has one.

use crate::support::report;
use serde_json::Value;

/// When a field has a value.
#[derive(Clone, Copy, Debug, PartialEq)]
enum When {
    Always,
    /// In `lockstep` and `realtime`.
    Processes,
    Realtime,
    /// Depends on what happens in the run: the field alone has to be there.
    Sometimes,
    /// Only with something that these runs do not have.
    Never,
}
use When::{Always, Never, Processes, Realtime, Sometimes};

const TOP: &[(&str, When)] = &[
    ("schema", Always),
    ("scenario", Always),
    ("mode", Always),
    ("planner", Always),
    ("filter", Always),
    ("physics", Always),
    ("seed", Always),
    ("robots", Always),
    ("tick_hz", Always),
    ("ticks", Always),
    ("sim_time_s", Always),
    ("wall_time_s", Always),
    ("rtf", Always),
    ("trajectory_hash", Always),
    ("verdict", Always),
    ("exit_code", Always),
    ("outcome", Always),
    ("per_robot", Always),
    ("latency", Processes),
    ("resources", Always),
    ("events", Always),
];
const OUTCOME: &[(&str, When)] = &[
    ("arrived", Always),
    ("arrived_all", Always),
    ("succeeded", Always),
    ("makespan_s", Always),
    ("flowtime_s", Always),
    ("mean_time_s", Always),
    ("path_length_m", Always),
    ("path_ratio_mean", Always),
    ("robot_contacts", Always),
    ("obstacle_contacts", Always),
    ("min_clearance_m", Always),
    ("min_obstacle_clearance_m", Always),
    ("time_lost_s_mean", Always),
    ("time_lost_s_max", Always),
    ("goals_done", Always),
    ("throughput_per_s", Always),
    ("deadlocked", Always),
    ("ldj_mean", Always),
    ("reversals_per_m", Always),
    ("crossings", Always),
    ("right_of_way_violations", Always),
    ("filter_interventions", Always),
    ("filter_change_mean", Sometimes),
];
const ROBOT: &[(&str, When)] = &[
    ("id", Always),
    ("planner", Always),
    ("incarnation", Always),
    ("pid", Processes),
    ("arrived", Always),
    ("time_s", Always),
    ("path_length_m", Always),
    ("path_ratio", Always),
    ("contacts", Always),
    ("tasks_done", Always),
    ("time_lost_s", Always),
    ("stall", Never),
    ("end_speed_mps", Never),
    ("reversals", Always),
    ("reversals_per_m", Always),
];
const LATENCY: &[(&str, When)] = &[
    ("pose_age_us", Processes),
    ("wake_us", Processes),
    ("plan_us", Processes),
    ("step_us", Processes),
    ("command_age_us", Processes),
    ("reaction_us", Processes),
    ("periods", Realtime),
    ("deadline_misses", Realtime),
    ("stragglers", Processes),
];
const PERCENTILES: &[(&str, When)] =
    &[("p50", Always), ("p90", Always), ("p99", Always), ("p999", Always), ("max", Always), ("n", Always)];
const RESOURCES: &[(&str, When)] = &[
    ("startup_ms", Processes),
    ("cpu_s", Always),
    ("agent_pss_kib_mean", Processes),
    ("agent_pss_kib_max", Processes),
    ("shm_bytes", Processes),
];
const EVENT: &[(&str, When)] =
    &[("tick", Always), ("t_s", Always), ("kind", Always), ("robot", Always), ("detail", Always)];

fn check(value: &Value, fields: &[(&str, When)], mode: &str, path: &str) {
    for (field, when) in fields {
        let has = match when {
            Always => true,
            Processes => mode != "single",
            Realtime => mode == "realtime",
            Never => false,
            Sometimes => value.get(field).is_some_and(|found| !found.is_null()),
        };
        let found = value.get(field).unwrap_or_else(|| panic!("{mode}: {path}.{field} is missing"));
        assert_eq!(!found.is_null(), has, "{mode}: {path}.{field} is {found}");
    }
}

/// Checks the form of a report of a run in which everybody arrived, and the sums that can be done with it.
pub(crate) fn check_form(report: &Value, mode: &str) {
    check(report, TOP, mode, "report");
    assert_eq!(report["schema"], "shoal.report/1");
    assert_eq!(report["mode"], mode);
    assert!(report["verdict"] == "valid" || report["verdict"] == "starved");
    let outcome = &report["outcome"];
    check(outcome, OUTCOME, mode, "outcome");
    check(&report["resources"], RESOURCES, mode, "resources");
    let robots = report["per_robot"].as_array().expect("a list");
    assert_eq!(robots.len() as u64, report["robots"].as_u64().expect("a number"));
    robots.iter().for_each(|robot| check(robot, ROBOT, mode, "per_robot[]"));
    let events = report["events"].as_array().expect("a list");
    assert!(!events.is_empty());
    events.iter().for_each(|event| check(event, EVENT, mode, "events[]"));
    if mode != "single" {
        check(&report["latency"], LATENCY, mode, "latency");
        for (name, _) in &LATENCY[..6] {
            let distribution = &report["latency"][name];
            check(distribution, PERCENTILES, mode, name);
            let number = |key: &str| distribution[key].as_f64().expect("a number");
            assert!(number("n") > 0.0, "{mode}: {name}: {distribution}");
            let rising = ["p50", "p90", "p99", "p999", "max"].map(number);
            assert!(rising.is_sorted() && rising[0] >= 0.0, "{mode}: {name}: {distribution}");
        }
    }

    let number = |value: &Value| value.as_f64().expect("a number");
    // What is computed here comes from numbers of the report, each of which is half a millionth off at most, or has four
    // digits if it is small: only the wall time may be.
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-6 * (1.0 + robots.len() as f64);
    let near_ratio = |a: f64, b: f64| (a - b).abs() <= 1e-4 * a.abs().max(b.abs());
    let sum = |key: &str| robots.iter().filter_map(|robot| robot[key].as_f64()).sum::<f64>();
    assert!(near(number(&report["sim_time_s"]), number(&report["ticks"]) / number(&report["tick_hz"])));
    assert!(near_ratio(number(&report["rtf"]), number(&report["sim_time_s"]) / number(&report["wall_time_s"])));
    assert!(near(number(&outcome["path_length_m"]), sum("path_length_m")));
    assert!(near(number(&outcome["flowtime_s"]), sum("time_s")));
    assert!(near(number(&outcome["mean_time_s"]), sum("time_s") / robots.len() as f64));
    assert!(near(number(&outcome["path_ratio_mean"]), sum("path_ratio") / robots.len() as f64));
    assert!(near(number(&outcome["time_lost_s_mean"]), sum("time_lost_s") / robots.len() as f64));
    assert!(near(number(&outcome["goals_done"]), sum("goals_done")));
    assert!(near(number(&outcome["throughput_per_s"]), sum("goals_done") / number(&report["sim_time_s"])));
    assert!(near(number(&outcome["reversals_per_m"]), sum("reversals") / sum("path_length_m")));
    let touched = 2.0 * number(&outcome["robot_contacts"]) + number(&outcome["obstacle_contacts"]);
    assert_eq!(sum("contacts"), touched, "a contact of two robots counts for both");
    for event in events {
        assert!(near(number(&event["t_s"]), number(&event["tick"]) / number(&report["tick_hz"])), "{event}");
    }
}

#[test]
fn of_single_and_lockstep() {
    for mode in ["single", "lockstep"] {
        check_form(&report(&format!("corridor-swap --mode {mode}")), mode);
    }
}

/// One answer per robot and tick is what the loop of `lockstep` is made of; the answers of one tick in sixteen are timed,
/// every robot's.
#[test]
fn lockstep_measures_the_answers_of_every_sixteenth_tick() {
    let report = report("corridor-swap --mode lockstep");
    let ticks = report["ticks"].as_u64().expect("a number");
    let n = |name: &str| report["latency"][name]["n"].as_u64().expect("a number");
    for name in ["plan_us", "step_us", "command_age_us", "reaction_us"] {
        assert_eq!(n(name), 8 * ticks.div_ceil(16), "{name}");
    }
    let pids: Vec<&Value> = report["per_robot"].as_array().expect("a list").iter().map(|robot| &robot["pid"]).collect();
    assert!(
        pids.iter().enumerate().all(|(index, pid)| !pids[..index].contains(pid)),
        "one process per robot: {pids:?}"
    );
}
