//! What a scenario means: layers, presets, overrides, times, motions, and robots added later.

use model::*;
use model::{BodyKind, ParamValue, ParamValues};
use nalgebra::Point2;
use shoal_scenarios::*;

fn scenario(text: &str) -> Scenario {
    with(text, &Overrides::default())
}

fn with(text: &str, overrides: &Overrides) -> Scenario {
    parse("dir/some-name.toml", text, overrides).unwrap_or_else(|problems| panic!("{problems}"))
}

fn robot<'a>(scenario: &'a Scenario, id: &str) -> &'a Robot {
    scenario.robots.iter().find(|robot| robot.id == id).unwrap()
}

/// A robot that says nothing but where it is; `more` is added to it.
fn alone(more: &str) -> String {
    format!("[[robot]]\nid = \"a\"\nstart_m = [-1, 0]\ngoal_m = [-1, 5]\n{more}\n")
}

#[test]
fn presets() {
    let scenario = scenario(&alone(""));
    insta::assert_snapshot!(format!("{scenario:#?}"));
}

#[test]
fn agents_are_paths_or_lists_of_words() {
    let words = |words: &[&str]| AgentCommand::Words(words.iter().map(|word| (*word).to_owned()).collect());
    let text = "[defaults]\nagent = [\"python3\", \"my.py\", \"--gain=2\"]\n[[robot]]\nid = \"b\"\nagent = \"own\"\n\
                start_m = [3, 0]\ngoal_m = [3, 5]\n";
    let text = format!("{text}{}", alone(""));
    let scenario = scenario(&text);
    assert_eq!(robot(&scenario, "a").agent, Some(words(&["python3", "my.py", "--gain=2"])));
    assert_eq!(robot(&scenario, "b").agent, Some(AgentCommand::Path("own".to_owned())));
    let overrides = Overrides { agent: Some(words(&["other", "x y"])), ..Overrides::default() };
    let scenario = with(&text, &overrides);
    assert!(scenario.robots.iter().all(|robot| robot.agent == overrides.agent), "instead of all that the file names");
    for (wrong, problem) in [
        ("[]", "must have 1 to 64 words, has 0"),
        ("[\"a\", 3]", "defaults.agent[1]: expected a string, found the whole number 3"),
        ("3", "expected a path or a list of strings, found the whole number 3"),
        ("[\"a\\nb\"]", "must be one line"),
    ] {
        let text = format!("[defaults]\nagent = {wrong}\n{}", alone(""));
        let problems = parse("x", &text, &Overrides::default()).unwrap_err().to_string();
        assert!(problems.contains(problem), "{problem}: {problems}");
    }
}

#[test]
fn processes_of_the_world_and_of_the_agents() {
    let check = |lines: &str, world: Scheduling, agents: Scheduling| {
        assert_eq!(
            scenario(&format!("{lines}\n{}", alone(""))).processes,
            Processes { world, agents, ..Processes::default() },
            "{lines}"
        );
    };
    let inherited = Scheduling::default;
    let class = |class| Scheduling { class: Some(class), ..inherited() };
    check("[processes]", inherited(), inherited());
    check("[processes.world]\nscheduling = \"other\"", class(Class::Other), inherited());
    check("[processes.agents]\nscheduling = \"fifo\"", inherited(), class(Class::Fifo { priority: 1 }));
    check(
        "[processes.agents]\ncpus = [3, 0]\nscheduling = \"batch\"\n[processes.world]\nscheduling = \"rr\"\npriority = 99",
        class(Class::Rr { priority: 99 }),
        Scheduling { cpus: vec![0, 3], class: Some(Class::Batch) },
    );
    let set = ["processes.agents.cpus=[1]", "processes.world.scheduling=fifo"].map(str::to_owned).to_vec();
    let scenario = with(&alone(""), &Overrides { set, ..Overrides::default() });
    assert_eq!(scenario.processes.agents.cpus, [1]);
    assert_eq!(scenario.processes.world, class(Class::Fifo { priority: 1 }));
    let set = ["processes.agents.memory_mib_max=64", "processes.agents.files_max=100"].map(str::to_owned).to_vec();
    let scenario = with(&alone(""), &Overrides { set, ..Overrides::default() });
    let agent_limits = ProcessLimits { memory_mib: Some(64), files: Some(100) };
    assert_eq!(scenario.processes, Processes { agent_limits, ..Processes::default() });
}

#[test]
fn the_robot_is_stronger_than_its_kind_and_the_kind_than_the_defaults() {
    let scenario = scenario(
        r#"
[defaults]
radius_m = 0.1
speed_mps_max = 1.1
sensor_range_m = 1.2
[kinds.unicycle]
radius_m = 0.3
speed_mps_max = 1.3
[kinds.point]
radius_m = 0.4
[[robot]]
id = "u"
kind = "unicycle"
radius_m = 0.5
start_m = [0, 0]
goal_m = [5, 0]
[[robot]]
id = "p"
start_m = [0, 2]
goal_m = [5, 2]
"#,
    );
    let (u, p) = (robot(&scenario, "u"), robot(&scenario, "p"));
    assert_eq!((u.radius_m, u.limits.speed_mps_max, u.sensor_range_m), (0.5, 1.3, 1.2));
    assert_eq!((p.radius_m, p.limits.speed_mps_max, p.sensor_range_m), (0.4, 1.1, 1.2));
    assert_eq!((u.kind, p.kind), (BodyKind::Unicycle, BodyKind::Point));
    assert_eq!(scenario.template.radius_m, 0.4, "what is added later is a point robot by default");
}

#[test]
fn parameters_belong_to_the_method_of_the_layer_where_they_stand() {
    let text = r#"
[planners.apf]
k_rep = 0.7
[planners.decentralized-apf]
eta = 0.2
xi = 0.9
[defaults]
planner = "decentralized-apf"
params = { eta = 0.3 }
[[robot]]
id = "plain"
start_m = [0, 0]
goal_m = [5, 0]
[[robot]]
id = "own"
start_m = [0, 2]
goal_m = [5, 2]
params = { eta = 0.4 }
[[robot]]
id = "other"
start_m = [0, 4]
goal_m = [5, 4]
planner = "apf"
params = { k_att = 1.5 }
"#;
    let params = |scenario: &Scenario, id: &str| {
        let robot = robot(scenario, id);
        let values: Vec<String> = robot.params.iter().map(|(name, value)| format!("{name} = {value}")).collect();
        format!("{}: {}", robot.planner, values.join(", "))
    };
    let own = scenario(text);
    assert_eq!(params(&own, "plain"), "decentralized-apf: eta = 0.3, xi = 0.9");
    assert_eq!(params(&own, "own"), "decentralized-apf: eta = 0.4, xi = 0.9");
    assert_eq!(params(&own, "other"), "apf: k_att = 1.5, k_rep = 0.7");

    let all_apf = with(text, &Overrides { planner: Some("apf".to_string()), ..Overrides::default() });
    assert_eq!(params(&all_apf, "plain"), "apf: k_rep = 0.7");
    assert_eq!(params(&all_apf, "own"), "apf: k_rep = 0.7");
    assert_eq!(params(&all_apf, "other"), "apf: k_att = 1.5, k_rep = 0.7");
    assert_eq!(all_apf.template.planner, "apf");
}

#[test]
fn overrides_reach_every_key() {
    let overrides = Overrides {
        mode: Some(Mode::Single),
        seed: Some(u64::MAX),
        duration_s: Some(10.0),
        set: [
            "clock.tick_hz=100",
            "clock.seed=3",
            "robot[0].radius_m=0.35",
            "robot[1]={id=\"b\",start_m=[3,3],goal_m=[4,4]}",
            "robot[2].id=c",
            "robot[2].start_m=[5, 5]",
            "robot[2].goal_m=[6, 6]",
            "robot[2].goal_motion.kind=orbit",
            "robot[2].goal_motion.center_m=[6, 5]",
            "robot[2].goal_motion.omega_radps=1",
            "defaults.planner=straight",
            "radio.drop=0.25",
            "name=renamed",
            "kinds.point.speed_mps_max=2",
        ]
        .map(str::to_string)
        .to_vec(),
        ..Overrides::default()
    };
    let scenario = with(&alone(""), &overrides);
    assert_eq!(scenario.clock.mode, Mode::Single);
    assert_eq!((scenario.clock.seed, scenario.clock.ticks_max), (u64::MAX, 1000));
    assert_eq!((scenario.robots[0].radius_m, scenario.robots[2].limits.speed_mps_max), (0.35, 2.0));
    assert_eq!((scenario.robots[1].id.as_str(), scenario.robots[2].planner.as_str()), ("b", "straight"));
    assert_eq!((scenario.radio.drop, scenario.name.as_str()), (0.25, "renamed"));
    assert!(matches!(scenario.robots[2].goal_motion, Some(Motion::Orbit { radius_m: 1.0, .. })));
}

#[test]
fn a_layout_takes_any_number_of_robots() {
    let ring = find_catalog("ring-15").unwrap();
    for count in [1, 2, 7, 15, 40] {
        let scenario = with(ring.text, &Overrides { robots: Some(count), ..Overrides::default() });
        assert_eq!((scenario.robots.len(), scenario.fleet.max_robots), (count, count + 8));
    }
    let demo = find_catalog("demo-15").unwrap();
    for count in 3..30 {
        assert_eq!(with(demo.text, &Overrides { robots: Some(count), ..Overrides::default() }).robots.len(), count + 2);
    }
}

#[test]
fn a_run_cut_short_keeps_its_later_events() {
    let demo = find_catalog("demo-15").unwrap();
    let whole = with(demo.text, &Overrides::default());
    let short = with(demo.text, &Overrides { duration_s: Some(1.0), ..Overrides::default() });
    assert_eq!(short.events, whole.events, "who joins later is still absent before");
    assert_eq!(short.clock.ticks_max, 50);
}

#[test]
fn events_are_sorted_and_in_ticks() {
    let scenario = scenario(&format!(
        "{}{}",
        alone("restart = \"on-failure\"\nrestart_limit = 2\nrestart_delay_s = 0.5"),
        r#"
[radio]
drop = 0.1
noise_m = 0.02
[[event]]
at_s = 3
kind = "radio"
delay_ticks = 4
[[event]]
at_s = 1.009
kind = "pause"
robot = "a"
for_s = 0.1
[[event]]
at_s = 3
kind = "radio"
robot = "a"
drop = 1
[[event]]
at_s = 2
kind = "kill"
robot = "a"
"#
    ));
    let radio = |delay_ticks, drop| Radio { delay_ticks, drop, noise_m: 0.02 };
    let expected = [
        TimelineEvent { tick: 50, what: TimelineAction::pause(0, 5) },
        TimelineEvent { tick: 100, what: TimelineAction::kill(0) },
        TimelineEvent { tick: 150, what: TimelineAction::Radio { robot: None, radio: radio(4, 0.1) } },
        TimelineEvent { tick: 150, what: TimelineAction::Radio { robot: Some(0), radio: radio(0, 1.0) } },
    ];
    assert_eq!(scenario.events, expected);
    assert_eq!(scenario.robots[0].restart, Restart::on_failure(2, 25));
}

#[test]
fn restarts_have_a_policy_a_limit_a_window_and_growing_delays() {
    let robot = |id: &str, y_m: f64, more: &str| {
        format!("[[robot]]\nid = \"{id}\"\nstart_m = [0, {y_m}]\ngoal_m = [5, {y_m}]\n{more}\n")
    };
    let scenario = scenario(&format!(
        "[clock]\ntick_hz = 10\n[defaults]\nrestart = \"always\"\nrestart_window_s = 60\nrestart_backoff = 2\n\
         [kinds.unicycle]\nrestart_limit = 5\nrestart_delay_max_s = 30\n{}{}{}",
        robot("a", 0.0, "restart = \"never\""),
        robot("b", 2.0, "restart = \"on-failure\"\nrestart_delay_s = 0"),
        robot("c", 4.0, "kind = \"unicycle\"\nrestart_delay_s = 0.5"),
    ));
    let restarts: Vec<Restart> = scenario.robots.iter().map(|robot| robot.restart).collect();
    let b = Restart { window_ticks: Some(600), backoff: 2.0, ..Restart::on_failure(3, 1) };
    let c = Restart { policy: RestartPolicy::Always, limit: 5, delay_ticks: 5, delay_ticks_max: 300, ..b };
    assert_eq!(restarts, [Restart::NEVER, b, c]);
}

#[test]
fn faults_have_a_length_or_last_until_they_are_ended() {
    let event = |at_s: f64, rest: &str| format!("[[event]]\nat_s = {at_s}\nrobot = \"a\"\n{rest}\n");
    let events: String = [
        event(1.0, "kind = \"pause\""),
        event(2.0, "kind = \"resume\""),
        event(3.0, "kind = \"mute\"\nfor_s = 0.5"),
        event(4.0, "kind = \"delay\"\ndelay_ticks = 7"),
        event(5.0, "kind = \"drop\"\ndrop = 0.3\nfor_s = 0.02"),
        event(6.0, "kind = \"noise\"\nnoise_m = 0.25"),
        event(7.0, "kind = \"slow-cpu\"\nslow_s = 0.25\nfor_s = 1"),
    ]
    .concat();
    let scenario = scenario(&format!("{}{events}", alone("")));
    let expected = [
        (50, Fault::Pause, None),
        (100, Fault::Resume, None),
        (150, Fault::Mute, Some(25)),
        (200, Fault::Delay { ticks: 7 }, None),
        (250, Fault::Drop { share: 0.3 }, Some(1)),
        (300, Fault::Noise { sigma_m: 0.25 }, None),
        (350, Fault::SlowCpu { ms: 250.0 }, Some(50)),
    ];
    let expected = expected
        .map(|(tick, fault, ticks)| TimelineEvent { tick, what: TimelineAction::Fault { robot: 0, fault, ticks } });
    assert_eq!(scenario.events, expected);
}

#[test]
fn things_start_where_their_motion_starts() {
    let scenario = scenario(&format!(
        "{}{}",
        alone(
            "waypoints_m = [[0, 2]]\ngoal_motion = { kind = \"waypoints\", points_m = [[3, 3], [4, 4]], speed_mps = 1 }"
        ),
        r#"
[[obstacle]]
shape = "segment"
from_m = [-9, -9]
to_m = [-7, -9]
motion = { kind = "waypoints", points_m = [[5, -5], [6, -5]], speed_mps = 1, then = "ping-pong" }
[[obstacle]]
shape = "disc"
center_m = [0, -5]
radius_m = 0.5
motion = { kind = "orbit", center_m = [0, -7], omega_radps = 1 }
[[obstacle]]
shape = "disc"
center_m = [-5, -5]
radius_m = 0.5
motion = { kind = "bounce", velocity_mps = [1, 0], y_m = [-6, -4] }
"#
    ));
    let close = |p: Point2<f64>, x: f64, y: f64| (p - Point2::new(x, y)).norm() < 1e-12;
    let reference = |index: usize| scenario.obstacles[index].shape.reference();
    assert!(close(reference(0), 5.0, -5.0) && close(reference(1), 0.0, -5.0) && close(reference(2), -5.0, -5.0));
    assert_eq!(scenario.robots[0].goals, [Point2::new(0.0, 2.0), Point2::new(3.0, 3.0)]);
    match &scenario.obstacles[1].motion {
        Some(Motion::Orbit { radius_m, phase_rad, .. }) => {
            assert_eq!((*radius_m, *phase_rad), (2.0, std::f64::consts::FRAC_PI_2));
        }
        other => panic!("{other:?}"),
    }
    match &scenario.obstacles[2].motion {
        Some(Motion::Bounce { within, .. }) => assert_eq!((within.x_m, within.y_m), ([-10.0, 10.0], [-6.0, -4.0])),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_late_joiner_may_start_where_another_one_starts() {
    let two = format!("{}{}", alone(""), alone("").replace("\"a\"", "\"late\""));
    assert!(parse("x", &two, &Overrides::default()).is_err());
    let join = "[[event]]\nat_s = 5\nkind = \"join\"\nrobot = \"late\"";
    assert_eq!(scenario(&format!("{two}{join}")).robots.len(), 2);
}

fn request() -> NewRobot {
    NewRobot {
        id: None,
        returns: false,
        kind: None,
        radius_m: None,
        start: Point2::new(3.0, 0.0),
        start_yaw_rad: None,
        goals: vec![Point2::new(3.0, 5.0)],
        goal_yaw_rad: None,
        planner: None,
        params: ParamValues::new(),
    }
}

#[test]
fn a_new_robot_is_like_the_defaults() {
    let scenario = scenario(&format!("[defaults]\nradius_m = 0.3\nparams = {{ horizon = 2 }}\n{}", alone("")));
    let plain = add_robot(&scenario, &request()).unwrap();
    assert_eq!((plain.id.as_str(), plain.radius_m, plain.start_yaw_rad), ("r00", 0.3, std::f64::consts::FRAC_PI_2));
    assert_eq!(plain.params, scenario.template.params);
    let other = NewRobot { planner: Some("straight".to_string()), id: Some("x".to_string()), ..request() };
    let other = add_robot(&scenario, &other).unwrap();
    assert_eq!((other.id.as_str(), other.planner.as_str(), other.params.len()), ("x", "straight", 0));
    let again = add_robot(&scenario, &NewRobot { id: Some("a".to_string()), returns: true, ..request() });
    assert_eq!(again.unwrap().id, "a", "that of a robot that has left");
    let stays = add_robot(&scenario, &NewRobot { goals: Vec::new(), ..request() }).unwrap();
    assert_eq!((stays.goals, stays.start_yaw_rad), (vec![stays.start], 0.0));
}

#[test]
fn a_layout_for_a_running_fleet_has_the_keys_of_a_scenario() {
    let scenario = scenario(&alone(""));
    let layout = |kind: &str, robots, set: &[&str]| NewLayout {
        kind: kind.to_owned(),
        robots,
        set: set.iter().map(|text| (*text).to_owned()).collect(),
        seed: Some(7),
    };
    let ring = places(&scenario, &layout("ring", 4, &["radius_m=2", "center_m=[1, 0]"]), &[]).unwrap();
    assert_eq!(ring.len(), 4);
    assert!((ring[0][0] - Point2::new(3.0, 0.0)).norm() < 1e-9 && (ring[0][1] - ring[2][0]).norm() < 1e-9, "{ring:?}");
    // A random one keeps clear of where robots are now.
    let within = ["x_m=[0, 1.5]", "y_m=[0, 1.5]"];
    let [[start, _]] = places(&scenario, &layout("random", 1, &within), &[]).unwrap()[..] else { panic!("one") };
    let body = geometry::Capsule::disc(start, 0.3);
    let [[other, _]] = places(&scenario, &layout("random", 1, &within), &[body]).unwrap()[..] else { panic!("one") };
    assert!((other - start).norm() > 0.3 + scenario.template.radius_m, "{start} {other}");
    let wrong = |layout: NewLayout| places(&scenario, &layout, &[]).expect_err("it is wrong").to_string();
    assert!(wrong(layout("rign", 4, &[])).contains("ring"));
    assert!(wrong(layout("ring", 4, &[])).contains("radius_m"));
    assert!(wrong(layout("ring", 0, &["radius_m=2"])).contains("--count 0"));
    assert!(wrong(layout("ring", 4, &["radius_m=2", "spacing_m=2"])).contains("--set spacing_m=2"));
    assert!(wrong(layout("ring", 4, &["radius"])).contains("--set radius"));
}

#[test]
fn a_new_robot_is_checked_like_any_other() {
    let obstacle = "[[obstacle]]\nshape = \"disc\"\ncenter_m = [3, 0]\nradius_m = 0.5\n";
    let scenario = scenario(&format!("{}{obstacle}", alone("")));
    let wrong = NewRobot {
        id: Some("a".to_string()),
        radius_m: Some(-1.0),
        goals: vec![Point2::new(3.0, f64::NAN), Point2::new(30.0, 0.0)],
        goal_yaw_rad: None,
        planner: Some("apff".to_string()),
        ..request()
    };
    let bad_params = NewRobot {
        id: Some("B".to_string()),
        start: Point2::origin(),
        params: [("etaa".to_string(), ParamValue::Int(1))].into(),
        ..request()
    };
    let errors = [wrong, bad_params].map(|request| {
        let problems = add_robot(&scenario, &request).unwrap_err();
        // The lists of methods and parameters grow with every method.
        let lines = problems.shown.iter().map(|problem| format!("{}: {problem}\n", problems.subject));
        lines.collect::<String>()
    });
    insta::assert_snapshot!(errors.join("\n"));
}

/// Reports and tables name these beside the robots.
#[test]
fn the_names_of_shoals_own_processes_are_reserved() {
    let of_file = |id: &str| {
        parse("test.toml", &alone("").replace("id = \"a\"", &format!("id = \"{id}\"")), &Overrides::default())
    };
    let added = |id: &str| add_robot(&scenario(&alone("")), &NewRobot { id: Some(id.to_owned()), ..request() });
    for id in ["world", "daemon", "guardian", "operator"] {
        let expected = format!("`{id}` is the name of a process of shoal itself; a robot needs another one");
        for problems in [of_file(id).unwrap_err(), added(id).unwrap_err()] {
            let said: Vec<String> = problems.shown.iter().map(ToString::to_string).collect();
            assert!(said.len() == 1 && said[0].contains("id: ") && said[0].ends_with(&expected), "{said:?}");
        }
    }
    for id in ["worlds", "world-1", "daemon2", "guardian_", "operators", "agent", "shoal", "r00"] {
        assert_eq!(of_file(id).unwrap().robots[0].id, id);
        assert_eq!(added(id).unwrap().id, id);
    }
}

#[test]
fn a_command_lives_for_three_ticks_at_least_whatever_the_rate() {
    for (tick_hz, least, less) in
        [(10, "0.3", "0.299"), (30, "0.1", "0.0999"), (50, "0.06", "0.0599"), (1000, "0.003", "0.002")]
    {
        let text = |timeout: &str| {
            format!("[clock]\ntick_hz = {tick_hz}\n[fleet]\ncommand_timeout_s = {timeout}\n{}", alone(""))
        };
        assert_eq!(scenario(&text(least)).fleet.command_timeout_s, least.parse::<f64>().unwrap());
        let problems = parse("test.toml", &text(less), &Overrides::default()).unwrap_err().to_string();
        assert!(problems.contains(&format!("must be at least three ticks, {least} s, is {less}")), "{problems}");
        assert!(problems.contains("hint: "), "{problems}");
    }
}
