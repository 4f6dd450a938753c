//! Two-link arms in scenarios: what they may say, how they stand, and what is told of those that cannot be.

use crate::support::mistakes;
use geometry::Elbow;
use insta::assert_snapshot;
use model::BodyKind;
use model::*;
use nalgebra::Point2;
use planners::METHODS;
use shoal_scenarios::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// An arm beside a robot and two obstacles: a valid file for mistakes to be made in.
const GOOD: &str = r#"
[world]
x_m = [-8, 8]
y_m = [-8, 8]

[kinds.two-link-arm]
planner = "pso-via-points"
turn_radps_max = 0.8

[[robot]]
id = "arm"
kind = "two-link-arm"
base_m = [0, 0]
links_m = [3.5, 3.5]
link_radius_m = 0.1
start_m = [6, 0.5]
goal_m = [-3.5, 5]

[[robot]]
id = "r"
start_m = [-4, -4]
goal_m = [4, -4]

[[obstacle]]
shape = "disc"
center_m = [4.8, 3.9]
radius_m = 0.4

[[obstacle]]
shape = "polygon"
corners_m = [[-1, 6], [1, 6], [1, 7.5], [-1, 7.5]]
"#;

fn good(before: &str, after: &str) -> Scenario {
    assert!(GOOD.contains(before), "`{before}` is in the file");
    parse("arms.toml", &GOOD.replacen(before, after, 1), &Overrides::default())
        .unwrap_or_else(|error| panic!("{error}"))
}

fn arm(scenario: &Scenario) -> ArmSetup {
    scenario.robots.iter().find_map(|robot| robot.arm).expect("there is an arm")
}

#[test]
fn an_arm_stands_where_its_tip_is() {
    let scenario = good("", "");
    let (robot, setup) = (&scenario.robots[0], arm(&scenario));
    assert_eq!((robot.kind, robot.radius_m, robot.limits.turn_radps_max), (BodyKind::TwoLinkArm, 0.1, 0.8));
    assert_eq!((setup.geometry.joint_min_rad, setup.geometry.joint_max_rad), ([0.0, -FRAC_PI_2], [TAU, FRAC_PI_2]));
    assert!((robot.start - Point2::new(6.0, 0.5)).norm() < 1e-12);
    assert_eq!(robot.start, setup.start().tip(), "to the last bit");
    let [first, second] = setup.start_joints_rad;
    assert!((first.to_degrees() - 35.4343).abs() < 1e-4 && (second.to_degrees() + 61.3413).abs() < 1e-4);
    assert!((robot.start_yaw_rad - (first + second)).abs() < 1e-12);
    assert!(scenario.robots[1].arm.is_none());
    assert_eq!(scenario.shape_pieces(), 1 + 4 + 1, "the second link counts");
}

#[test]
fn the_elbow_bends_as_told_or_to_where_there_is_room() {
    let elbow = |scenario: &Scenario| arm(scenario).start().elbow();
    assert_eq!(elbow(&good("", "")), Elbow::Up);
    assert_eq!(elbow(&good("base_m", "elbow = \"down\"\nbase_m")), Elbow::Down);
    // With the elbow up the first link would be in the way of this one.
    assert_eq!(elbow(&good("center_m = [4.8, 3.9]", "center_m = [2.9, 2]")), Elbow::Down);
    // 0.5 m above +x with the elbow down: the first link points below it, at the other end of its range.
    assert!(
        (arm(&good("base_m", "elbow = \"down\"\nbase_m")).start_joints_rad[0].to_degrees() - 334.0930).abs() < 1e-4
    );
}

#[test]
fn joints_may_say_where_an_arm_stands() {
    let scenario = good("start_m = [6, 0.5]", "start_joints_rad = [1.5, -1]");
    assert_eq!(arm(&scenario).start_joints_rad, [1.5, -1.0]);
    let tip = Point2::new(3.5 * 1.5f64.cos() + 3.5 * 0.5f64.cos(), 3.5 * 1.5f64.sin() + 3.5 * 0.5f64.sin());
    assert!((scenario.robots[0].start - tip).norm() < 1e-12);
}

#[test]
fn links_and_limits_can_be_those_of_the_kind() {
    let kind = "[kinds.two-link-arm]\nlinks_m = [2, 1]\njoint_min_rad = [-3.2, -3]\njoint_max_rad = [3.2, 3]";
    let text = GOOD
        .replace("[kinds.two-link-arm]", kind)
        .replace("links_m = [3.5, 3.5]\n", "")
        .replace("start_m = [6, 0.5]", "start_m = [-2, -1]")
        .replace("[-3.5, 5]", "[1.5, -0.5]");
    let scenario = parse("x", &text, &Overrides::default()).unwrap_or_else(|error| panic!("{error}"));
    let setup = arm(&scenario);
    assert_eq!((setup.geometry.links_m, setup.geometry.joint_max_rad[1]), ([2.0, 1.0], 3.0));
    assert!((-3.2..=3.2).contains(&setup.start_joints_rad[0]) && setup.start_joints_rad[1].abs() < PI);
}

#[test]
fn a_random_layout_keeps_clear_of_links() {
    let layout = "[layout]\nkind = \"random\"\nrobots = 40\nspread_m = 0.1\n[world]";
    let scenario = good("[world]", layout);
    let links = arm(&scenario).geometry.bodies(arm(&scenario).start_joints_rad);
    let layout = scenario.robots.iter().filter(|robot| robot.id.starts_with("r0") || robot.id.starts_with("r1"));
    for robot in layout {
        assert!(links.iter().all(|link| link.distance(robot.start) >= robot.radius_m + 0.1 - 1e-9), "{}", robot.id);
    }
}

#[test]
fn a_method_for_all_is_for_all_that_it_can_drive() {
    let planner = |name: &str, text: &str| {
        let overrides = Overrides { planner: Some(name.to_string()), ..Overrides::default() };
        let scenario = parse("arms.toml", text, &overrides).map_err(|problems| without_lists(problems.to_string()));
        scenario.map(|scenario| scenario.robots.iter().map(|robot| robot.planner.clone()).collect::<Vec<_>>())
    };
    assert_eq!(planner("apf", GOOD).unwrap(), ["pso-via-points", "apf"]);
    assert_eq!(planner("pso-via-points", GOOD).unwrap(), ["pso-via-points", "pso-via-points"]);
    let (before, after) = (GOOD.find("[[robot]]\nid = \"r\"").unwrap(), GOOD.find("[[obstacle]]").unwrap());
    let alone = format!("{}{}", &GOOD[..before], &GOOD[after..]);
    let refused = planner("apf", &alone).unwrap_err();
    assert!(refused.contains("--planner apf: `apf` can drive none of these robots, such as `arm`"), "{refused}");
}

#[test]
fn tasks_of_a_running_fleet_are_checked_for_arms_too() {
    let scenario = good("", "");
    let problem = |x, y| goal_problem(&scenario, &scenario.robots[0], Point2::new(x, y), None);
    assert_eq!(problem(0.0, -6.0), None);
    assert!(problem(1.0, 1.0).unwrap().contains("out of reach"));
    assert!(problem(0.0, 6.2).unwrap().contains("overlaps obstacle[1]"));
    assert!(problem(f64::NAN, 0.0).is_some());
}

#[test]
fn arms_are_not_added_to_a_running_fleet() {
    let scenario = good("", "");
    let request = NewRobot {
        returns: false,
        id: None,
        kind: Some(BodyKind::TwoLinkArm),
        radius_m: None,
        start: Point2::new(-6.0, -6.0),
        start_yaw_rad: None,
        goals: Vec::new(),
        goal_yaw_rad: None,
        planner: None,
        params: Default::default(),
    };
    let problems = add_robot(&scenario, &request).unwrap_err().to_string();
    assert!(problems.contains("kind: an arm cannot be added to a running fleet"), "{problems}");
    assert!(add_robot(&scenario, &NewRobot { kind: None, ..request }).is_ok());
}

/// The lists of methods grow with every method; what is told about them does not.
fn without_lists(mut text: String) -> String {
    let names = |methods: Vec<&str>| methods.join(", ");
    text = text.replace(&names(METHODS.iter().map(|method| method.name).collect()), "(all)");
    for kind in BodyKind::ALL {
        let fitting = METHODS.iter().filter(|method| method.kinds.contains(kind)).map(|method| method.name).collect();
        text =
            text.replace(&format!("that can: {}", names(fitting)), &format!("that can: (those for {})", kind.word()));
    }
    text
}

/// What is told of the good file with `before` replaced by `after`, row by row.
fn table(rows: &[(&str, &str)]) -> String {
    mistakes(GOOD, rows, |text| match parse("arms.toml", text, &Overrides::default()) {
        Ok(_) => "no problem".to_string(),
        Err(problems) => without_lists(problems.to_string()),
    })
}

#[test]
fn keys() {
    assert_snapshot!(table(&[
        ("base_m = [0, 0]\n", ""),
        ("links_m = [3.5, 3.5]\n", ""),
        ("links_m = [3.5, 3.5]", "links_m = [3.5, 0]"),
        ("links_m = [3.5, 3.5]", "links_m = [3.5]"),
        ("links_m = [3.5, 3.5]", "links_m = 7"),
        ("link_radius_m = 0.1", "link_radius_m = -0.1"),
        ("link_radius_m = 0.1", "radius_m = 0.1"),
        ("link_radius_m = 0.1", "start_yaw_rad = 0.1"),
        ("link_radius_m = 0.1", "joint_min_rad = [7, -1.5]"),
        ("link_radius_m = 0.1", "joint_max_rad = [6, 3.5]"),
        ("link_radius_m = 0.1", "elbow = \"left\""),
        ("start_m = [6, 0.5]\n", ""),
        ("start_m = [6, 0.5]", "start_m = [6, 0.5]\nstart_joints_rad = [0, 1]"),
        ("start_m = [6, 0.5]", "elbow = \"up\"\nstart_joints_rad = [0, 1]"),
        ("id = \"r\"", "id = \"r\"\nbase_m = [0, 0]\nlinks_m = [1, 1]"),
        ("start_m = [-4, -4]\n", ""),
        ("start_m = [-4, -4]", "start_joints_rad = [0, 0]"),
        ("turn_radps_max = 0.8", "radius_m = 0.3"),
        ("turn_radps_max = 0.8", "base_m = [0, 0]"),
        ("[world]", "[kinds.point]\nlinks_m = [1, 1]\n[world]"),
        (
            "[world]",
            "[defaults]\nkind = \"two-link-arm\"\n[layout]\nkind = \"ring\"\nrobots = 3\nradius_m = 5\n[world]"
        ),
        ("planner = \"pso-via-points\"", ""),
        ("planner = \"pso-via-points\"", "planner = \"apf\""),
        ("base_m = [0, 0]", "base_m = [0, 0]\nplanner = \"straight\""),
        ("planner = \"pso-via-points\"", "planner = \"apf\"\nagent = \"my-arm\""),
    ]));
}

#[test]
fn places() {
    assert_snapshot!(table(&[
        ("start_m = [6, 0.5]", "start_m = [7.1, 0]"),
        ("start_m = [6, 0.5]", "start_m = [3, 3]"),
        ("start_m = [6, 0.5]", "start_m = [6, 0.5]\njoint_max_rad = [0.5, 1]"),
        ("start_m = [6, 0.5]", "start_m = [6, 0.5]\nelbow = \"up\"\njoint_max_rad = [0.5, 1]"),
        ("start_m = [6, 0.5]", "start_joints_rad = [7, 0]"),
        ("start_m = [6, 0.5]", "start_joints_rad = [1, 3.2]"),
        ("start_m = [6, 0.5]", "start_m = [5, 4.2]"),
        ("start_m = [6, 0.5]", "start_m = [0, 6.5]"),
        ("base_m = [0, 0]", "base_m = [9, 0]"),
        ("goal_m = [-3.5, 5]", "goal_m = [1, 1]"),
        ("goal_m = [-3.5, 5]", "goal_m = [5, 4.2]"),
        ("goal_m = [-3.5, 5]", "goal_m = [-3.5, 5]\nwaypoints_m = [[0, 7], [0, 8.5]]"),
        ("goal_m = [-3.5, 5]", "goal_m = [-3.5, 5]\njoint_max_rad = [1.5, 1.5]"),
        ("start_m = [-4, -4]", "start_m = [3, 2]"),
        (
            "[[obstacle]]",
            "[[robot]]\nid = \"b\"\nkind = \"two-link-arm\"\nbase_m = [2, -5]\nlinks_m = [4, 4]\nstart_m = [2, 2.5]\ngoal_m = [2, 2]\n[[obstacle]]"
        ),
        ("[[obstacle]]", "[[event]]\nat_s = 1\nkind = \"task\"\nrobot = \"arm\"\ngoal_m = [0, 0]\n[[obstacle]]"),
    ]));
}
