//! Every method gets out of a body what the body can: its speed, its slow turns, its reverse gear.

use model::random::Stream;
use model::{BodyKind, EventName, PlanState, RobotState, Scenario};
use planners::{METHODS, Method};
use scenarios::{Overrides, parse};
use shoal_tests::{Recording, seeds};

/// Two robots swap past a pillar, far from the origin.
const SWAP: &str = r#"
[world]
x_m = [388080, 388110]
y_m = [948980, 949010]
[[robot]]
id = "a"
start_m = [388086, 948996]
goal_m = [388106, 948996.3]
[[robot]]
id = "b"
start_m = [388106, 948995]
goal_m = [388086, 948995.2]
[[obstacle]]
shape = "disc"
center_m = [388096.1, 948995.6]
radius_m = 0.4
"#;

/// A unicycle that turns slowly has its goal beside it, another one behind it.
const TIGHT: &str = r#"
[clock]
duration_s = 60
[defaults]
kind = "unicycle"
turn_radps_max = 0.1
[[robot]]
id = "beside"
start_m = [0, 0]
start_yaw_rad = 0
goal_m = [0, 2]
[[robot]]
id = "behind"
start_m = [-5, -5]
start_yaw_rad = 0
goal_m = [-8, -5]
"#;

/// A unicycle that may reverse has its goal straight behind it.
const BEHIND: &str = r#"
[defaults]
kind = "unicycle"
reverse_mps_max = 1
turn_radps_max = 1
[[robot]]
id = "a"
start_m = [0, 0]
start_yaw_rad = 0
goal_m = [-2, 0]
"#;

fn with(text: &str, method: &Method, set: &[String]) -> Scenario {
    let overrides = Overrides { planner: Some(method.name.to_owned()), set: set.to_vec(), ..Overrides::default() };
    parse("bodies", text, &overrides).unwrap_or_else(|problems| panic!("{problems}"))
}

/// When the last robot arrived, s, and the hash of the run.
fn makespan(scenario: &Scenario) -> (f64, u64) {
    let outcome = Recording::of(scenario).outcome;
    let name = &scenario.robots[0].planner;
    let times = outcome.robots.iter().map(|robot| robot.time_s.unwrap_or_else(|| panic!("{name}: not all arrived")));
    (times.fold(0.0, f64::max), outcome.trajectory_hash)
}

fn drive(kind: BodyKind) -> impl Iterator<Item = &'static Method> {
    METHODS.iter().copied().filter(move |method| method.kinds.contains(&kind))
}

#[test]
fn a_faster_body_is_there_sooner_with_every_method_that_does_not_warn() {
    for method in drive(BodyKind::Point) {
        let mut before: Vec<(f64, u64)> = Vec::new();
        for speed in ["1", "1.5", "2", "5"] {
            let scenario = with(SWAP, method, &[format!("defaults.speed_mps_max={speed}")]);
            assert!(scenario.warnings.is_empty(), "{}: {:?}", method.name, scenario.warnings);
            let (time_s, hash) = makespan(&scenario);
            for (longer_s, other) in &before {
                assert!(time_s < *longer_s && hash != *other, "{} at {speed} m/s: {time_s} s", method.name);
            }
            before.push((time_s, hash));
        }
    }
}

#[test]
fn a_parameter_that_holds_a_method_back_is_warned_of() {
    for (method, param, most) in [
        ("decentralized-apf", "attract_cap=1", "1.000"),
        ("decentralized-apf", "xi=0.5", "0.500"),
        ("apf", "attract_cap_m=2", "2.000"),
        ("liquid-online", "step_m=0.02", "1.000"),
        ("rpoa", "step_radius=0.02", "1.000"),
    ] {
        let set = ["defaults.speed_mps_max=3".to_owned(), format!("planners.{method}.{param}")];
        let scenario = with(SWAP, planners::find(method).expect("it exists"), &set);
        let said: Vec<String> = scenario.warnings.iter().map(ToString::to_string).collect();
        let expected = format!("`{method}` with these parameters drives at most {most} m/s of the 3 m/s that it may");
        assert!(said.len() == 1 && said[0].contains(&expected), "{said:?}");
    }
}

#[test]
fn unicycles_that_turn_slowly_arrive_with_every_method() {
    for method in drive(BodyKind::Unicycle) {
        makespan(&with(TIGHT, method, &[]));
        // Lazy bodies take longer, and arrive.
        let set = ["defaults.accel_mps2_max=0.5".to_owned(), "defaults.turn_accel_radps2_max=0.1".to_owned()];
        makespan(&with(TIGHT, method, &set));
    }
}

#[test]
fn a_goal_behind_is_reached_backwards_with_every_method() {
    for method in drive(BodyKind::Unicycle) {
        let recording = Recording::of(&with(BEHIND, method, &[]));
        let robot = &recording.outcome.robots[0];
        assert!(robot.arrived && robot.path_length_m < 2.1, "{}: {robot:?}", method.name);
        assert!(robot.time_s.is_some_and(|time_s| time_s < 4.0), "{}: {robot:?}", method.name);
    }
}

/// A unicycle docks with a heading, then gets a task with another one.
const DOCK: &str = r#"
[defaults]
kind = "unicycle"
radius_m = 0.3
[[robot]]
id = "d0"
start_m = [3.635, 4]
start_yaw_rad = -1.57
goal_m = [-2.175, -4, 1.57]
[[event]]
kind = "task"
at_s = 20
robot = "d0"
goal_m = [0, -4, -2]
"#;

#[test]
fn a_robot_has_arrived_when_it_looks_as_it_is_to() {
    for method in drive(BodyKind::Unicycle) {
        let scenario = with(DOCK, method, &[]);
        let recording = Recording::of(&scenario);
        let robot = &recording.outcome.robots[0];
        assert!(robot.arrived && (robot.goals_done, robot.tasks_done) == (2, 1), "{}: {robot:?}", method.name);
        let off = |tick: u64, yaw_rad: f64| {
            let frame = recording.frames.iter().find(|frame| frame.tick == tick).expect("the tick was run");
            geometry::wrap(frame.robot(0).expect("it is there").yaw_rad - yaw_rad).abs()
        };
        assert!(off(robot.arrived_tick.expect("it arrived"), -2.0) <= 0.1, "{}", method.name);
        let first =
            recording.outcome.events.iter().find(|event| event.kind.name() == EventName::Arrived).expect("it docked");
        assert!(first.tick < 1000 && off(first.tick, 1.57) <= 0.1, "{}: {first:?}", method.name);
    }
}

/// Rounds of three goals; the second robot goes round until the time is up.
const PATROL: &str = r#"
[clock]
duration_s = 60
[[robot]]
id = "twice"
start_m = [-5, 0]
waypoints_m = [[-5, 2], [-3, 2]]
goal_m = [-3, 0]
rounds = 2
[[robot]]
id = "guard"
start_m = [5, 0]
waypoints_m = [[5, 2], [3, 2]]
goal_m = [3, 0]
rounds = "forever"
"#;

#[test]
fn robots_go_round() {
    let recording = Recording::of(&parse("patrol", PATROL, &Overrides::default()).expect("it is valid"));
    let [twice, guard] = &recording.outcome.robots[..] else { panic!("{:?}", recording.outcome) };
    assert!(twice.arrived && (twice.goals_done, twice.rounds_done) == (6, 2), "{twice:?}");
    assert!(!guard.arrived && guard.rounds_done >= 4 && guard.goals_done / 3 == guard.rounds_done, "{guard:?}");
    let report = recording.report();
    assert_eq!((report.ticks, report.exit_code), (3000, 0), "{:?}", report.unmet);
    assert_eq!(
        report.per_robot.iter().map(|robot| robot.rounds).collect::<Vec<_>>(),
        [Some(2), Some(guard.rounds_done)]
    );
    assert!(report.outcome.arrived_all && report.outcome.arrived == 1);

    // Goals that all lie within the tolerance are no endless tick; a task that is to be done now ends the patrol.
    let here = PATROL.replace("[5, 2], [3, 2]", "[3, 0.01], [3, 0]");
    let task = "[[event]]\nkind = \"task\"\nat_s = 30\nrobot = \"guard\"\ngoal_m = [4, 4]\nnow = true\n";
    let recording = Recording::of(&parse("patrol", &(here + task), &Overrides::default()).expect("it is valid"));
    let guard = &recording.outcome.robots[1];
    assert!(guard.arrived && guard.tasks_done == 1 && guard.rounds_done > 100, "{guard:?}");
}

/// A method that finds no way says so: in an event, in the robot's row, and it is not taken for a deadlock while it looks.
#[test]
fn a_method_that_finds_no_way_says_so() {
    // The goal stands in a ring of walls.
    let scene = |planner: &str, params: &str, duration_s: u32| {
        let text = format!(
            "[clock]\nduration_s = {duration_s}\n[defaults]\nplanner = \"{planner}\"\nknows_map = true\n{params}\n\
             [[robot]]\nid = \"a\"\nstart_m = [-4, 0]\ngoal_m = [4, 0]\n[[obstacle]]\nshape = \"polygon\"\n\
             corners_m = [[2, -2], [6, -2], [6, -1.6], [2.4, -1.6], [2.4, 1.6], [6, 1.6], [6, 2], [2, 2]]\n\
             [[obstacle]]\nshape = \"segment\"\nfrom_m = [5.6, -2]\nto_m = [5.6, 2]\n"
        );
        Recording::of(&parse("ring", &text, &Overrides::default()).unwrap_or_else(|problems| panic!("{problems}")))
    };
    for (planner, params) in [("liquid", ""), ("liquid-online", "params = { virtual_max = 5 }")] {
        let recording = scene(planner, params, 30);
        let robot = &recording.outcome.robots[0];
        assert!(!robot.arrived && robot.plan == PlanState::GaveUp, "{planner}: {robot:?}");
        let events: Vec<_> = recording.events(0, EventName::GaveUp).collect();
        assert!(events.len() == 1 && events[0].tick > 0, "{planner}: {events:?}");
        // It knew a way, or was looking for one, until then.
        let before_s = (events[0].tick / 50).max(1);
        let earlier = scene(planner, params, before_s as u32);
        assert_eq!(earlier.events(0, EventName::GaveUp).count(), 0, "{planner}");
        let rows = [&recording, &earlier].map(|recording| recording.report().per_robot.remove(0));
        let words = rows.each_ref().map(|row| row.planner_state);
        let until_then = if planner == "liquid" { PlanState::Planning } else { PlanState::Ready };
        assert_eq!(words, [PlanState::GaveUp, until_then], "{planner}");
        assert!(rows[0].state == RobotState::GaveUp && !rows[1].deadlocked, "{planner}: {rows:?}");
    }
}

/// Random lazy bodies: they come to rest at their goals, and none is off again once it is there.
#[test]
fn lazy_bodies_stay_at_their_goals() {
    for name in ["dapf", "amr-apf"] {
        seeds(0..60, |seed| {
            let mut stream = Stream::new(seed, 0, 0, "test-lazy");
            let mut between = |low: f64, high: f64| stream.between(low, high);
            let kind = if seed % 4 == 0 { "point" } else { "unicycle" };
            let text = format!(
                "[clock]\nduration_s = 200\nstop = \"duration\"\n[defaults]\nkind = \"{kind}\"\nspeed_mps_max = {}\n\
                 accel_mps2_max = {}\nturn_radps_max = {}\nturn_accel_radps2_max = {}\n\
                 [[robot]]\nid = \"a\"\nstart_m = [{}, {}]\nstart_yaw_rad = {}\ngoal_m = [0, 0]\n",
                between(0.5, 1.5),
                between(0.3, 3.0),
                between(0.1, 2.0),
                between(0.2, 3.0),
                between(-4.0, 4.0),
                between(-4.0, 4.0),
                between(-3.1, 3.1)
            );
            let scenario = with(&text, planners::find(name).expect("it exists"), &[]);
            let recording = Recording::of(&scenario);
            assert!(recording.outcome.robots[0].arrived, "{name}: {text}{:?}", recording.outcome.robots[0]);
            assert_eq!(recording.events(0, EventName::OffGoal).count(), 0, "{name}: {text}");
        });
    }
}
