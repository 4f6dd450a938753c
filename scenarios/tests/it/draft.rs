//! Scenarios that are put together in code are what the same text gives, and have its problems.

use model::{MAX_ROBOTS, Scenario};
use shoal_scenarios::{Draft, Overrides, parse};

fn of_text(text: &str) -> Scenario {
    parse("test", text, &Overrides::default()).unwrap_or_else(|problems| panic!("{problems}"))
}

fn robot(id: String, start_m: [f64; 2]) -> Draft {
    Draft::new().with("id", id).with("start_m", start_m).with("goal_m", [start_m[0] + 2.0, start_m[1]])
}

#[test]
fn a_draft_is_the_scenario_of_the_same_text() {
    let text = r#"
        [clock]
        mode = "single"
        tick_hz = 20
        seed = 7
        [defaults]
        kind = "unicycle"
        planner = "apf"
        params = { k_att = 2.0, order = "second" }
        [planners.dapf]
        variant = "lin"
        [[robot]]
        id = "a"
        start_m = [0, 0]
        goal_m = [2, 0]
        knows_map = true
        goal_motion = { kind = "orbit", center_m = [3.0, 0.0], omega_radps = 0.5 }
        [[obstacle]]
        shape = "disc"
        center_m = [0, 3]
        radius_m = 0.5
    "#;
    let goal_motion = Draft::new().with("kind", "orbit").with("center_m", [3.0, 0.0]).with("omega_radps", 0.5);
    let robot = robot("a".to_owned(), [0.0, 0.0]).with("knows_map", true).with("goal_motion", goal_motion);
    let disc = Draft::new().with("shape", "disc").with("center_m", [0.0, 3.0]).with("radius_m", 0.5);
    let params = of_text(text).robots[0].params.clone();
    let draft = Draft::new()
        .with("clock.mode", "single")
        .with("clock.tick_hz", 20.0)
        .with("clock.seed", 7_u64)
        .with("defaults.kind", "unicycle")
        .with("defaults.planner", "apf")
        .with("defaults.params", &params)
        .with("planners.dapf.variant", "lin")
        .with("robot", vec![robot])
        .with("obstacle", vec![disc]);
    assert_eq!(draft.scenario("test").unwrap(), of_text(text));
}

#[test]
fn a_later_value_replaces_an_earlier_one() {
    let draft = Draft::new().with("clock.seed", 1_u64).with("robot", vec![robot("a".to_owned(), [0.0, 0.0])]);
    let scenario = draft.clone().with("clock.seed", 2_u64).scenario("test").unwrap();
    assert_eq!(scenario.clock.seed, 2);
    assert_eq!(draft.clone().scenario("test").unwrap().clock.seed, 1);
    let in_the_way = draft.with("clock", 5_u64).with("clock.seed", 3_u64);
    assert_eq!(in_the_way.scenario("test").unwrap().clock.seed, 3);
}

#[test]
fn all_problems_of_a_draft_are_told_by_key() {
    let robots = vec![robot("a".to_owned(), [0.0, 0.0]), robot("A".to_owned(), [0.1, 0.0])];
    let draft = Draft::new().with("clock.tick_hz", 1e9).with("layuot.kind", "ring").with("robot", robots);
    let problems = draft.scenario("test").unwrap_err();
    assert_eq!(problems.subject, "scenario `test`");
    let mut keys: Vec<&str> = problems.shown.iter().map(|problem| problem.key.as_str()).collect();
    keys.sort_unstable();
    assert_eq!(keys, ["clock.tick_hz", "layuot", "robot[1].id", "robot[1].start_m"], "{problems}");
    assert!(problems.shown.iter().all(|problem| problem.line.is_none() && problem.option.is_none()));
}

#[test]
fn a_draft_has_the_bounds_of_a_file() {
    let line = |count: usize| {
        let robots = (0..count).map(|i| robot(format!("r{i}"), [i as f64, 0.0])).collect::<Vec<_>>();
        Draft::new().with("world.x_m", [-10.0, 2000.0]).with("robot", robots)
    };
    assert_eq!(line(MAX_ROBOTS).scenario("test").unwrap().robots.len(), MAX_ROBOTS);
    assert!(line(MAX_ROBOTS + 1).scenario("test").is_err());
}
