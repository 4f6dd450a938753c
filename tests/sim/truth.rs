//! The report of a run against the same numbers recomputed from where everybody was at every tick.

use scenarios::Overrides;
use shoal_tests::truth::{ARM_M, agree, recompute};
use shoal_tests::{Recording, build, catalog, scenario, seeds};

/// Runs a scenario and compares; returns the contacts, so that a test can see that there were any.
fn check(scenario: &model::Scenario) -> (u64, u64) {
    let recording = Recording::of(scenario);
    let (report, truth) = (recording.report(), recompute(scenario, &recording.frames));
    let told = &report.outcome;
    let what = format!("{}, {}, seed {}", report.scenario, report.planner, report.seed);
    let same = |name: &str, told: Option<f64>, truth: Option<f64>| match (told, truth) {
        (Some(told), Some(truth)) => assert!(agree(told, truth), "{what}: {name}: reported {told}, recomputed {truth}"),
        _ => assert_eq!(told, truth, "{what}: {name}"),
    };
    same("makespan_s", told.makespan_s, truth.makespan_s);
    same("flowtime_s", told.flowtime_s, Some(truth.flowtime_s).filter(|_| truth.arrived > 0));
    let goals: u64 = report.per_robot.iter().map(|robot| u64::from(robot.goals_done)).sum();
    assert_eq!(told.goals_done, goals, "{what}: goals_done");
    same("throughput_per_s", told.throughput_per_s, Some(goals as f64 / report.sim_time_s).filter(|x| x.is_finite()));
    let turned_back = f64::from(truth.reversals.iter().sum::<u32>());
    same("reversals_per_m", told.reversals_per_m, Some(turned_back / truth.path_length_m).filter(|x| x.is_finite()));
    same("path_length_m", Some(told.path_length_m), Some(truth.path_length_m));
    let arms = scenario.robots.iter().any(|robot| robot.arm.is_some());
    let clearance = |name: &str, told: Option<f64>, truth: Option<f64>| match (told, truth) {
        (Some(told), Some(truth)) if arms => assert!((told - truth).abs() < ARM_M, "{what}: {name}: {told}, {truth}"),
        _ => same(name, told, truth),
    };
    clearance("min_clearance_m", told.min_clearance_m, truth.min_clearance_m);
    clearance("min_obstacle_clearance_m", told.min_obstacle_clearance_m, truth.min_obstacle_clearance_m);
    assert_eq!(told.arrived, truth.arrived, "{what}: arrived");
    assert_eq!(told.succeeded, truth.succeeded, "{what}: succeeded");
    assert_eq!(told.robot_contacts, truth.robot_contacts, "{what}: robot_contacts");
    assert_eq!(told.obstacle_contacts, truth.obstacle_contacts, "{what}: obstacle_contacts");
    for (slot, robot) in report.per_robot.iter().enumerate() {
        assert_eq!(robot.contacts, truth.contacts[slot], "{what}: contacts of `{}`", robot.id);
        same(&format!("path of `{}`", robot.id), Some(robot.path_length_m), Some(truth.paths_m[slot]));
        assert_eq!(robot.reversals, truth.reversals[slot], "{what}: reversals of `{}`", robot.id);
        let fair = robot
            .time_lost_s
            .is_none_or(|lost_s| lost_s >= -1e-6 && robot.time_s.is_some_and(|time_s| lost_s <= time_s));
        assert!(fair, "{what}: `{}` lost {:?} s of {:?} s", robot.id, robot.time_lost_s, robot.time_s);
        // Only where the shortest way is no way at all there is the one and not the other.
        let alike = robot.time_lost_s.is_some() == robot.path_ratio.is_some() || robot.time_lost_s == robot.time_s;
        assert!(alike, "{what}: `{}`: {:?}, {:?}", robot.id, robot.time_lost_s, robot.path_ratio);
        let possible = robot.path_ratio.is_none_or(|ratio| ratio >= 1.0 - 1e-6);
        assert!(possible, "{what}: `{}` drove {:?} x the shortest way", robot.id, robot.path_ratio);
    }
    (told.robot_contacts, told.obstacle_contacts)
}

fn check_catalog(names: &[&str], planner: &str) -> (u64, u64) {
    let mut contacts = (0, 0);
    for name in names {
        seeds([1, 2], |seed| {
            let overrides = Overrides { planner: Some(planner.to_string()), ..build::seed(seed) };
            let (robots, obstacles) = check(&catalog(name, &overrides));
            contacts = (contacts.0 + robots, contacts.1 + obstacles);
        });
    }
    contacts
}

#[test]
fn of_the_catalog() {
    check_catalog(&["demo-15", "ring-15", "head-on", "corridor-swap", "late-join", "tasks"], "decentralized-apf");
}

#[test]
fn of_moving_obstacles_and_unicycles() {
    check_catalog(&["moving-obstacles", "unicycle-15"], "decentralized-apf");
}

#[test]
fn of_arms() {
    for name in ["arm-1", "arm-elbow-flip", "mixed"] {
        assert_eq!(check(&catalog(name, &build::seed(1))), (0, 0));
    }
    // Blind robots drive through the links, and the arm goes its way.
    let overrides = Overrides { planner: Some("straight".to_string()), ..build::seed(1) };
    check(&catalog("mixed", &overrides));
}

#[test]
fn of_sixty_four_robots() {
    check(&catalog("scale-64", &build::seed(1)));
}

/// The null method drives through everything: many contacts, deep overlaps, polygons from inside.
#[test]
fn where_everybody_touches_everything() {
    let names = ["demo-15", "ring-15", "head-on", "corridor-swap", "late-join", "tasks", "moving-obstacles"];
    let (robots, obstacles) = check_catalog(&names, "straight");
    assert!(robots > 50 && obstacles > 10, "{robots} and {obstacles} contacts");
    assert!(check_catalog(&["unicycle-15"], "straight").0 > 10);
}

/// A tick so long that bodies pass through each other between two of them.
#[test]
fn when_everything_happens_between_two_ticks() {
    let text = r#"
        [clock]
        tick_hz = 2
        duration_s = 30
        [defaults]
        speed_mps_max = 4
        goal_tolerance_m = 0.5
        planner = "straight"
        radius_m = 0.15
        [layout]
        kind = "circle-swap"
        robots = 12
        radius_m = 8
        jitter_m = 0.4
        [[obstacle]]
        shape = "disc"
        center_m = [2, 0]
        radius_m = 0.1
        motion = { kind = "orbit", center_m = [0, 0], omega_radps = 2.0 }
        [[obstacle]]
        shape = "segment"
        from_m = [-3, -3]
        to_m = [-3, 3]
        [[obstacle]]
        shape = "polygon"
        corners_m = [[3, 3], [3.2, 3.1], [3.1, 3.3]]
        motion = { kind = "bounce", velocity_mps = [-1.7, -2.3] }
    "#;
    let mut contacts = (0, 0);
    seeds(1..=10, |seed| {
        let (robots, obstacles) = check(&build::with(text, &build::seed(seed)));
        contacts = (contacts.0 + robots, contacts.1 + obstacles);
    });
    assert!(contacts.0 > 20 && contacts.1 > 20, "{contacts:?}");
}

/// Robots that die, pause, leave, come back and come late.
#[test]
fn when_robots_come_and_go() {
    let text = r#"
        [clock]
        duration_s = 25
        [defaults]
        sensor_range_m = 3
        radio_range_m = 4
        planner = "straight"
        [kinds.unicycle]
        reverse_mps_max = 0.3
        [layout]
        kind = "circle-swap"
        robots = 8
        radius_m = 5
        jitter_m = 0.3
        [[robot]]
        id = "late"
        start_m = [0.3, 0]
        goal_m = [6, 6]
        kind = "unicycle"
        start_yaw_rad = 3
        restart = "on-failure"
        [[event]]
        at_s = 4
        kind = "join"
        robot = "late"
        [[event]]
        at_s = 4.5
        kind = "kill"
        robot = "late"
        [[event]]
        at_s = 3
        kind = "kill"
        robot = "r00"
        [[event]]
        at_s = 2
        kind = "pause"
        robot = "r01"
        for_s = 3
        [[event]]
        at_s = 3.5
        kind = "leave"
        robot = "r02"
        [[event]]
        at_s = 1
        kind = "task"
        robot = "r03"
        goal_m = [-7, 7]
    "#;
    seeds(1..=5, |seed| _ = check(&build::with(text, &build::seed(seed))));
    // A robot that never moves is arrived at tick 0, with no path.
    check(&scenario("[clock]\nduration_s = 1\n[[robot]]\nid = \"a\"\nstart_m = [0, 0]\ngoal_m = [0, 0]"));
}
