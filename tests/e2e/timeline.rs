//! Faults of the timeline happen at exact ticks: real processes are killed and stopped, and the run is the same.

use crate::support::Run;

const FAULTS: &str = r#"
[world]
x_m = [-8, 8]
y_m = [-8, 8]
[clock]
duration_s = 40
[defaults]
sensor_range_m = 3
radio_range_m = 6
[layout]
kind = "ring"
robots = 6
radius_m = 4
jitter_m = 0.3
[[robot]]
id = "back"
start_m = [-6, -6]
goal_m = [6, -6]
restart = "on-failure"
restart_delay_s = 0.5
[[event]]
at_s = 1
kind = "kill"
robot = "back"
[[event]]
at_s = 1.5
kind = "pause"
robot = "r01"
for_s = 2
[[event]]
at_s = 2
kind = "kill"
robot = "r02"
[[event]]
at_s = 2
kind = "pause"
robot = "r04"
for_s = 0.02
[[event]]
at_s = 3
kind = "kill"
robot = "back"
[[event]]
at_s = 3.02
kind = "pause"
robot = "r01"
for_s = 1
[expect]
arrived = 6
contacts_max = 1000
"#;

#[test]
fn kills_pauses_and_restarts_come_to_the_same_in_one_thread_and_in_processes() {
    let single = Run::scenario(FAULTS).mode("single").finish().expect(0);
    let lockstep = Run::scenario(FAULTS).mode("lockstep").finish().expect(0);
    assert_eq!(lockstep.hash(), single.hash(), "{single}{lockstep}");
    assert_eq!(lockstep.report["ticks"], single.report["ticks"]);
    let kinds = ["killed", "restarted", "paused", "resumed", "joined"];
    let of = |report: &serde_json::Value| -> Vec<String> {
        let events = report["events"].as_array().unwrap().iter();
        events.filter(|event| kinds.iter().any(|kind| event["kind"] == *kind)).map(ToString::to_string).collect()
    };
    assert_eq!(of(&lockstep.report), of(&single.report));
    for ended in [&single, &lockstep] {
        assert_eq!(ended.event("killed", "back")["tick"], 50, "{ended}");
        assert_eq!(ended.event("restarted", "back")["tick"], 75, "{ended}");
        assert_eq!(ended.event("paused", "r01")["tick"], 75, "{ended}");
        assert_eq!(ended.robot("back")["incarnation"], 2, "{ended}");
        assert_eq!(ended.robot("r02")["gone"], "dead", "{ended}");
    }
    assert_eq!(lockstep.report["verdict"], "valid", "nobody was waited for in vain\n{lockstep}");
}
