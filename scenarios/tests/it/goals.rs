//! Goals with a heading, rounds, and what is different about one robot of a layout.

use model::{Scenario, TimelineAction};
use shoal_scenarios::{Overrides, parse, schema};

fn scenario(text: &str) -> Scenario {
    parse("test.toml", text, &Overrides::default()).unwrap_or_else(|problems| panic!("{problems}"))
}

fn refused(text: &str, expected: &str) {
    let problems = parse("test.toml", text, &Overrides::default()).expect_err(text).to_string();
    assert!(problems.contains(expected), "{problems}");
}

fn robot(rest: &str) -> String {
    format!("[[robot]]\nid = \"a\"\nkind = \"unicycle\"\nstart_m = [0, 0]\n{rest}\n")
}

#[test]
fn a_goal_may_have_a_heading() {
    let docked = scenario(&robot("goal_m = [2, -4, 1.57]\ngoal_yaw_tolerance_rad = 0.05"));
    assert_eq!((docked.robots[0].goal_yaw_rad, docked.robots[0].goal_yaw_tolerance_rad), (Some(1.57), 0.05));
    assert_eq!(scenario(&robot("goal_m = [2, -4]")).robots[0].goal_yaw_rad, None);
    let task = "[[event]]\nkind = \"task\"\nat_s = 1\nrobot = \"a\"\ngoal_m = [1, 1, -3]\n";
    let tasked = scenario(&(robot("goal_m = [2, -4]") + task));
    assert!(matches!(tasked.events[0].what, TimelineAction::Task { task, .. } if task.yaw_rad == Some(-3.0)));

    let point = "kind = \"point\"\ngoal_m = [2, 0, 1]".to_string();
    let point = robot(&point).replace("kind = \"unicycle\"\n", "");
    refused(&point, "robot[0].goal_m: a point does not turn: it has no heading at its goal");
    refused(&(point.replace(", 1]", "]") + task), "event[0].goal_m: a point does not turn");
    refused(&robot("goal_m = [2, 0, 1, 1]"), "expected [x, y] or [x, y, yaw], found a list of 4");
    refused(&robot("goal_m = [2, 0, \"n\"]"), "robot[0].goal_m[2]: expected a heading in rad");
    refused(&robot("goal_m = [2, 0]\ngoal_yaw_rad = 1"), "hint: the heading at the goal is the third number of goal_m");
}

#[test]
fn waypoints_may_be_gone_round() {
    let rounds =
        |rest: &str| scenario(&robot(&format!("goal_m = [2, 0]\nwaypoints_m = [[2, 2]]\n{rest}"))).robots[0].rounds;
    assert_eq!(rounds(""), Some(1));
    assert_eq!(rounds("rounds = 3"), Some(3));
    assert_eq!(rounds("rounds = \"forever\""), None);
    refused(&robot("goal_m = [2, 0]\nrounds = 2"), "robot[0].rounds: there is only one goal to go round");
    refused(&robot("goal_m = [2, 0]\nrounds = 0"), "expected \"forever\" or a whole number above 0");
    refused(&robot("goal_m = [2, 0]\nloop = true"), "rounds = \"forever\"");
}

const RING: &str = "[layout]\nkind = \"circle-swap\"\nrobots = 4\nradius_m = 4\n";

#[test]
fn one_robot_of_a_layout_may_be_different() {
    let plain = scenario(RING);
    let own = "[[robot]]\nid = \"r02\"\nplanner = \"straight\"\nradius_m = 0.3\n[[robot]]\nid = \"x\"\nstart_m = [0, 1]\ngoal_m = [1, 0]\n";
    let changed = scenario(&format!("{RING}{own}"));
    assert_eq!(
        changed.robots.iter().map(|robot| robot.id.as_str()).collect::<Vec<_>>(),
        ["r00", "r01", "r02", "r03", "x"]
    );
    let (before, after) = (&plain.robots[2], &changed.robots[2]);
    assert_eq!((after.start, &after.goals), (before.start, &before.goals));
    assert_eq!((after.planner.as_str(), after.radius_m), ("straight", 0.3));
    assert_eq!(changed.robots[3], plain.robots[3]);

    let moved = scenario(&format!("{RING}[[robot]]\nid = \"r02\"\nstart_m = [-6, 1]\nwaypoints_m = [[0, 5]]\n"));
    assert_eq!(moved.robots[2].start, [-6.0, 1.0].into());
    assert_eq!(moved.robots[2].goals, [[0.0, 5.0].into(), before.goals[0]]);

    refused(&format!("{RING}[[robot]]\nid = \"r04\"\n"), "robot[0]: needs `goal_m`");
    let twice = "[[robot]]\nid = \"r02\"\nstart_m = [1, 1]\ngoal_m = [2, 1]\n".repeat(2);
    refused(&format!("{RING}{twice}"), "the id `r02` is taken");
    refused(
        &format!("{RING}[[robot]]\nid = \"r02\"\nkind = \"two-link-arm\"\n"),
        "a robot of the layout cannot be an arm",
    );
}

#[test]
fn coordinates_reach_as_far_as_the_schema_says() {
    let utm = "[world]\nx_m = [388080, 388110]\ny_m = [9948980, 9949010]\n[[robot]]\nid = \"a\"\nstart_m = [388086, 9948996]\n";
    scenario(&format!("{utm}goal_m = [388106, 9948996]\n"));
    refused(&format!("{utm}goal_m = [388106, 1.1e7]\n"), "must be at most 10000000, is 11000000");
    let pair = &schema()["$defs"]["robot"]["properties"]["start_m"]["items"];
    assert_eq!((pair["minimum"].as_f64(), pair["maximum"].as_f64()), (Some(-1e7), Some(1e7)), "{pair}");
}
