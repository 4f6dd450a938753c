//! What users read when a scenario is wrong, as snapshots. Every row is one mistake in an otherwise valid file.

use crate::support::mistakes;
use insta::assert_snapshot;
use model::Mode;
use planners::METHODS;
use shoal_scenarios::{Overrides, parse};
use std::fmt::Write;

/// A valid file for mistakes to be made in.
const GOOD: &str = r#"
[clock]
duration_s = 30

[[robot]]
id = "a"
start_m = [-4, 0]
goal_m = [4, 0]

[[robot]]
id = "b"
start_m = [4, 2]
goal_m = [-4, 2]

[[obstacle]]
shape = "disc"
center_m = [0, -3]
radius_m = 1
"#;

fn errors_of(text: &str, overrides: &Overrides) -> String {
    match parse("test.toml", text, overrides) {
        Ok(_) => "no problem".to_string(),
        Err(problems) => without_lists(problems.to_string()),
    }
}

/// The lists of methods and parameters grow with every method; what is told about them does not.
fn without_lists(mut text: String) -> String {
    let methods: Vec<&str> = METHODS.iter().map(|method| method.name).collect();
    text = text.replace(&methods.join(", "), "(all)");
    for method in METHODS {
        let params: Vec<&str> = (method.params)().iter().map(|spec| spec.name).collect();
        if params.len() > 1 {
            text = text.replace(&params.join(", "), "(all)");
        }
    }
    text
}

/// Errors of the good file with `before` replaced by `after`, row by row.
fn table(rows: &[(&str, &str)]) -> String {
    mistakes(GOOD, rows, |text| errors_of(text, &Overrides::default()))
}

#[test]
fn the_good_file_is_good() {
    assert_eq!(errors_of(GOOD, &Overrides::default()), "no problem");
}

#[test]
fn keys_and_types() {
    assert_snapshot!(table(&[
        ("goal_m = [4, 0]", "goal = [4, 0]"),
        ("goal_m = [4, 0]", "goal_m = [4, 0]\nradius = 0.3"),
        ("goal_m = [4, 0]", "goal_m = [4, 0]\nspeed-mps-max = 0.3"),
        ("goal_m = [4, 0]", "goal_m = [4, 0]\ntick_hz = 20"),
        ("[clock]", "[clocks]"),
        ("[clock]", "colour = \"red\"\n[clock]"),
        ("duration_s = 30", "duration_s = \"30\""),
        ("duration_s = 30", "duration_s = true"),
        ("duration_s = 30", "seed = 1.5"),
        ("duration_s = 30", "mode = \"real-time\""),
        ("[4, 0]", "[4, 0, 0]"),
        ("[4, 0]", "[4, \"0\"]"),
        ("[4, 0]", "4"),
        ("[[robot]]\nid = \"a\"", "[robot]\nid = \"a\""),
        ("[[robot]]", "fleet = 12\n[[robot]]"),
        ("[[robot]]", "[fleet]\nmax_robots = 2020-01-01\n[[robot]]"),
        ("center_m = [0, -3]", "center_m = [0, -3]\nfrom_m = [0, 0]"),
        ("shape = \"disc\"", "shape = \"disk\""),
        ("shape = \"disc\"\n", ""),
        ("radius_m = 1", ""),
    ]));
}

#[test]
fn papers() {
    let arm = "kind = \"two-link-arm\"\nbase_m = [-4, -4]\nlinks_m = [2, 2]\njoint_min_rad = [0, 0]";
    let expect = |what: &str| format!("[[paper.expect]]\nmethod = \"rule\"\n{what}\n[clock]");
    assert_snapshot!(table(&[
        ("[clock]", "[paper]\ninflation = 0.05\n[clock]"),
        ("[clock]", "[[paper.expect]]\narrives = true\n[clock]"),
        ("[clock]", &expect("arives = true")),
        ("[clock]", &expect("time_s = \"12\"")),
        ("[clock]", &expect("arrival_times_s = [1, \"2\"]")),
        ("[clock]", &expect("arrival_times_s = [1, 2, 3]")),
        ("[clock]", &expect("end_m = [[0, 0]]")),
        ("[clock]", &expect("params = { k_v = 1, particles = 3 }")),
        ("[clock]", &expect("params = { k_v = [1] }")),
        ("id = \"a\"", &format!("id = \"a\"\n{arm}\n[paper]\ninflation_m = 0.05\n[[robot]]\nid = \"c\"")),
    ]));
}

#[test]
fn values() {
    assert_snapshot!(table(&[
        ("duration_s = 30", "duration_s = nan"),
        ("duration_s = 30", "duration_s = 0"),
        ("duration_s = 30", "duration_s = 0.001"),
        ("duration_s = 30", "tick_hz = 0"),
        ("duration_s = 30", "tick_hz = 20000"),
        ("duration_s = 30", "seed = -1"),
        ("[4, 0]", "[nan, 0]"),
        ("[4, 0]", "[4, inf]"),
        ("goal_m = [4, 0]", "goal_m = [4, 0]\nradius_m = -0.2"),
        ("goal_m = [4, 0]", "goal_m = [4, 0]\nspeed_mps_max = 0"),
        ("goal_m = [4, 0]", "goal_m = [4, 0]\naccel_mps2_max = -inf"),
        ("goal_m = [4, 0]", "goal_m = [4, 0]\ngoal_tolerance_m = inf"),
        ("[clock]", "[radio]\ndrop = 1.5\n[clock]"),
        ("[clock]", "[radio]\ndelay_ticks = 256\n[clock]"),
        ("[clock]", "[world]\nx_m = [3, 3]\n[clock]"),
        ("[clock]", "[fleet]\nmax_robots = 2000\n[clock]"),
        ("[clock]", "[fleet]\nmax_robots = 1\n[clock]"),
        ("[clock]", "[fleet]\ncommand_timeout_s = 0.001\n[clock]"),
        ("[clock]", "[fleet]\ncommand_timeout_s = 0.059\n[clock]"),
        ("[clock]", "[expect]\narrived = 3\n[clock]"),
        ("[clock]", "[expect]\narrived = \"most\"\n[clock]"),
        ("id = \"a\"", "id = \"Robot 1\""),
        ("id = \"a\"", "id = \"b\""),
        ("radius_m = 1", "radius_m = 0"),
    ]));
}

#[test]
fn processes() {
    let with = |lines: &str| format!("[processes.agents]\n{lines}\n[clock]");
    let rows: Vec<String> = [
        "cpus = []",
        "cpus = 0",
        "cpus = [0, 1, 0]",
        "cpus = [0, -1]",
        "cpus = [1024]",
        "cpus = [0, 0.5]",
        "cpus = [\"0-3\"]",
        "scheduling = \"realtime\"",
        "scheduling = \"fif\"",
        "scheduling = \"fifo\"\npriority = 0",
        "scheduling = \"rr\"\npriority = 100",
        "scheduling = \"batch\"\npriority = 5",
        "priority = 5",
        "scheduling = \"fife\"\npriority = 5",
        "cpu = [0]",
    ]
    .into_iter()
    .map(with)
    .chain(["[processes]\ncpus = [0]\n[clock]", "[processes.daemon]\n[clock]"].map(str::to_owned))
    .collect();
    let mut result = String::new();
    for row in &rows {
        let text = GOOD.replacen("[clock]", row, 1);
        let row = row.trim_end_matches("[clock]").trim_end().replace('\n', "\n# ");
        writeln!(result, "# {row}\n{}\n", errors_of(&text, &Overrides::default())).unwrap();
    }
    assert_snapshot!(result);
}

#[test]
fn places() {
    assert_snapshot!(table(&[
        ("start_m = [-4, 0]", "start_m = [4, 1.7]"),
        ("start_m = [-4, 0]", "start_m = [0, -3]"),
        ("start_m = [-4, 0]", "start_m = [1.1, -3]"),
        ("goal_m = [4, 0]", "goal_m = [0.5, -3.2]"),
        ("goal_m = [4, 0]", "goal_m = [4, 0]\nwaypoints_m = [[1, 1], [0, -2]]"),
        ("goal_m = [4, 0]", "goal_m = [40, 0]"),
        ("start_m = [-4, 0]", "start_m = [-11, 0]"),
        (
            "shape = \"disc\"\ncenter_m = [0, -3]\nradius_m = 1",
            "shape = \"polygon\"\ncorners_m = [[-5, -1], [-3, -1], [-3, 1], [-5, 1]]",
        ),
        ("shape = \"disc\"\ncenter_m = [0, -3]\nradius_m = 1", "shape = \"polygon\"\ncorners_m = [[-5, 5], [-3, 5]]",),
        (
            "shape = \"disc\"\ncenter_m = [0, -3]\nradius_m = 1",
            "shape = \"polygon\"\ncorners_m = [[5, 5], [7, 7], [7, 5], [5, 7]]",
        ),
        (
            "shape = \"disc\"\ncenter_m = [0, -3]\nradius_m = 1",
            "shape = \"polygon\"\ncorners_m = [[5, 5], [7, 5], [6, 5]]",
        ),
        (
            "shape = \"disc\"\ncenter_m = [0, -3]\nradius_m = 1",
            "shape = \"polygon\"\ncorners_m = [[5, 5], [7, 5], [7, 7], [5, 5]]",
        ),
        ("shape = \"disc\"\ncenter_m = [0, -3]\nradius_m = 1", "shape = \"segment\"\nfrom_m = [1, 5]\nto_m = [1, 5]"),
    ]));
}

#[test]
fn motions() {
    let disc = "radius_m = 1\n";
    let with = |motion: &str| format!("radius_m = 1\nmotion = {{ {motion} }}\n");
    let rows: Vec<String> = [
        "kind = \"orbit\", omega_radps = 1",
        "kind = \"orbit\", center_m = [0, -3], omega_radps = 1",
        "kind = \"orbit\", center_m = [0, 0], omega_radps = 1, radius_m = 0",
        "kind = \"bounce\", velocity_mps = [1, 0], x_m = [5, 6]",
        "kind = \"bounce\", speed_mps = 1",
        "kind = \"random-walk\", speed_mps = 1, turn_every_s = 0",
        "kind = \"waypoints\", points_m = [[1, 1]], speed_mps = 1",
        "kind = \"waypoints\", points_m = [[1, 1], [1, 1]], speed_mps = 1",
        "kind = \"waypoints\", points_m = [[1, 1], [2, 2]], speed_mps = 1, then = \"back\"",
        "kind = \"wobble\"",
    ]
    .into_iter()
    .map(with)
    .collect();
    assert_snapshot!(table(&rows.iter().map(|row| (disc, row.as_str())).collect::<Vec<_>>()));
}

/// Where a place could not be read, nothing that depends on it is blamed.
#[test]
fn a_wrong_goal_is_the_only_problem_of_its_motion() {
    for motion in ["kind = \"bounce\", velocity_mps = [1, 0]", "kind = \"random-walk\", speed_mps = 1"] {
        let robot =
            format!("[[robot]]\nid = \"c\"\nstart_m = [0, 5]\ngoal_m = [0, true]\ngoal_motion = {{ {motion} }}");
        let told = errors_of(&format!("{GOOD}\n{robot}"), &Overrides::default());
        assert_eq!(told.matches("error: ").count(), 1, "{told}");
        assert!(told.contains("robot[2].goal_m[1]: expected a number"), "{told}");
    }
}

#[test]
fn planners() {
    assert_snapshot!(table(&[
        ("goal_m = [4, 0]", "goal_m = [4, 0]\nplanner = \"apff\""),
        ("goal_m = [4, 0]", "goal_m = [4, 0]\nplanner = \"magic\""),
        ("goal_m = [4, 0]", "goal_m = [4, 0]\nparams = { etaa = 1 }"),
        ("goal_m = [4, 0]", "goal_m = [4, 0]\nparams = { eta = -1 }"),
        ("goal_m = [4, 0]", "goal_m = [4, 0]\nparams = { eta = nan }"),
        ("goal_m = [4, 0]", "goal_m = [4, 0]\nparams = { eta = [1] }"),
        ("goal_m = [4, 0]", "goal_m = [4, 0]\nparams = 3"),
        ("[clock]", "[planners.apff]\nk = 1\n[clock]"),
        ("[clock]", "[planners.decentralized-apf]\nxi = \"much\"\n[clock]"),
        ("[clock]", "[planners]\napf = 1\n[clock]"),
        ("[clock]", "[defaults]\nplanner = \"strait\"\n[clock]"),
        ("[clock]", "[kinds.unicycle]\nplanner = \"strait\"\n[clock]"),
        ("[clock]", "[kinds.arm]\n[clock]"),
    ]));
}

#[test]
fn events() {
    let event = |lines: &str| format!("[[event]]\nat_s = 5\n{lines}\n[[obstacle]]");
    let rows: Vec<String> = [
        "kind = \"leave\"\nrobot = \"c\"",
        "kind = \"leaf\"\nrobot = \"a\"",
        "kind = \"leave\"",
        "kind = \"task\"\nrobot = \"a\"",
        "kind = \"task\"\nrobot = \"a\"\ngoal_m = [0, -3]",
        "kind = \"task\"\nrobot = \"a\"\ngoal_m = [0, 30]",
        "kind = \"pause\"\nrobot = \"a\"\nfor_s = 0",
        "kind = \"pause\"\nrobot = \"a\"\nfor_s = 0.001",
        "kind = \"pause\"\nrobot = \"a\"\ndelay_ticks = 3",
        "kind = \"kill\"\nrobot = \"a\"\nfor_s = 1",
        "kind = \"mute\"\nrobot = \"a\"\nfor_s = 0.001",
        "kind = \"delay\"\nrobot = \"a\"",
        "kind = \"delay\"\nrobot = \"a\"\ndelay_ticks = 256",
        "kind = \"drop\"\nrobot = \"a\"\ndrop = 1.5",
        "kind = \"noise\"\nnoise_m = 1",
        "kind = \"slow-cpu\"\nrobot = \"a\"\nslow_s = 2",
        "kind = \"radio\"\ndelay_ticks = 300",
        "kind = \"radio\"\nrobot = \"c\"",
        "kind = \"join\"\nrobot = \"a\"\n[[event]]\nat_s = 6\nkind = \"join\"\nrobot = \"a\"",
        "kind = \"join\"\nrobot = \"a\"\n[[event]]\nat_s = 4\nkind = \"task\"\nrobot = \"a\"\ngoal_m = [1, 1]",
        "kind = \"leave\"\nrobot = \"a\"\n[[event]]\nat_s = 6\nkind = \"kill\"\nrobot = \"a\"",
        "kind = \"leave\"\nrobot = \"a\"\n[[event]]\nat_s = 6\nkind = \"join\"\nrobot = \"a\"",
        "kind = \"kill\"\nrobot = \"a\"\n[[event]]\nat_s = 6\nkind = \"pause\"\nrobot = \"a\"\nfor_s = 1",
        "kind = \"kill\"\nrobot = \"a\"\n[[event]]\nat_s = 30\nkind = \"leave\"\nrobot = \"b\"",
        "kind = \"kill\"\nrobot = \"a\"\n[[event]]\nkind = \"leave\"\nrobot = \"b\"",
        "kind = \"kill\"\nrobot = \"a\"\n[[event]]\nat_s = -1\nkind = \"leave\"\nrobot = \"b\"",
    ]
    .into_iter()
    .map(event)
    .collect();
    let mut result = String::new();
    for row in &rows {
        let text = GOOD.replacen("[[obstacle]]", row, 1);
        let row = row.trim_end_matches("[[obstacle]]").trim_end().replace('\n', "\n# ");
        writeln!(result, "# {row}\n{}\n", errors_of(&text, &Overrides::default())).unwrap();
    }
    assert_snapshot!(result);
}

#[test]
fn texts_that_are_no_scenario() {
    let rows = [
        "",
        "  \n\n",
        "# nothing but talk\n",
        "description = \"nobody\"",
        "[[robot]\nid = 3",
        "id = \nstart = 2",
        "a = 1\na = 2",
        "\u{0}\u{1}",
        "[layout]\nkind = \"ring\"",
        "[layout]\nkind = \"ring\"\nrobots = 4\nradius_m = 0.1",
        "[layout]\nkind = \"ring\"\nrobots = 4\nradius_m = 3\nshift = 8",
        "[layout]\nkind = \"random\"\nrobots = 400\nspread_m = 1",
        "[layout]\nkind = \"rings\"\nrobots = 4",
        "[layout]\nkind = \"line\"\nrobots = 4\nradius_m = 3",
        "[layout]\nkind = \"ring\"\nrobots = 4\nradius_m = 3\n[[robot]]\nid = \"r01\"\nstart_m = [0, 0]\ngoal_m = [1, 1]",
        "[layout]\nkind = \"ring\"\nrobots = 1024\nradius_m = 300\n[world]\nx_m=[-400, 400]\ny_m=[-400, 400]\n[[robot]]\nid = \"one-more\"\nstart_m = [0, 0]\ngoal_m = [1, 1]",
    ];
    let mut result = String::new();
    for text in rows {
        writeln!(result, "# {}\n{}\n", text.escape_debug(), errors_of(text, &Overrides::default())).unwrap();
    }
    assert_snapshot!(result);
}

#[test]
fn all_problems_of_a_file_at_once() {
    assert_snapshot!(errors_of(
        r#"
descripton = "everything is wrong"
[world]
x_m = [5, -5]
[clock]
mode = "fast"
tick_hz = nan
[defaults]
radius_m = -1
planner = "apff"
[[robot]]
id = "a"
start_m = [0, 0]
goal_m = [4, 0]
speed_mps_max = 0
[[robot]]
id = "a"
start_m = [0.1, 0]
goal_m = [4, 50]
params = { q = 1 }
[[obstacle]]
shape = "disc"
center_m = [4, 0]
radius_m = 1
[[event]]
at_s = 100
kind = "task"
robot = "z"
goal_m = [1, 1]
"#,
        &Overrides::default()
    ));
}

#[test]
fn overrides() {
    const RING: &str = "[layout]\nkind = \"ring\"\nrobots = 4\nradius_m = 3\n";
    let with = |text: &str, overrides: Overrides| errors_of(text, &overrides);
    let set = |text: &str, assignment: &str| {
        let errors = errors_of(text, &Overrides { set: vec![assignment.to_string()], ..Overrides::default() });
        format!("{errors}\n")
    };
    let rows = [
        with(GOOD, Overrides { planner: Some("apff".to_string()), ..Overrides::default() }),
        with(GOOD, Overrides { robots: Some(5), ..Overrides::default() }),
        with(RING, Overrides { robots: Some(0), ..Overrides::default() }),
        with(RING, Overrides { robots: Some(100_000), ..Overrides::default() }),
        with(RING, Overrides { duration_s: Some(f64::NAN), ..Overrides::default() }),
        with(RING, Overrides { duration_s: Some(-1.0), mode: Some(Mode::Single), ..Overrides::default() }),
        set(GOOD, "robot[0].radius_m=-1"),
        set(GOOD, "robot[1].radius=1"),
        set(GOOD, "robot[7].radius_m=1"),
        set(GOOD, "robot.radius_m=1"),
        set(GOOD, "clock[0].seed=1"),
        set(GOOD, "clock.seed.x=1"),
        set(GOOD, "clock.seed=abc"),
        set(GOOD, "clock.seed='abc"),
        set(GOOD, "clock.seed"),
        set(GOOD, "=3"),
        set(GOOD, "a.b.c.d.e.f.g.h.i=3"),
        set(GOOD, "clock=3"),
        set(GOOD, "defaults.planner=apff"),
        set(GOOD, "robot=[]"),
    ];
    assert_snapshot!(rows.join("\n"));
}

#[test]
fn a_hundred_thousand_mistakes_are_a_short_answer() {
    let mut robots = String::new();
    for index in 0..100_000 {
        writeln!(robots, "[[robot]]\nid = \"r{index}\"\nstart_m = [0, 0]\ngoal_m = [50, 50]\nradios_m = {index}")
            .unwrap();
    }
    let keys: String = (0..100_000).map(|index| format!("key{index} = 1\n")).collect();
    let corners: String = (0..100_000).map(|index| format!("[{index}, {index}], ")).collect();
    let rows = [
        errors_of(&robots, &Overrides::default()),
        errors_of(&keys, &Overrides::default()),
        errors_of(
            &format!("{GOOD}\n[[obstacle]]\nshape = \"polygon\"\ncorners_m = [{corners}]"),
            &Overrides::default(),
        ),
        errors_of("[layout]\nkind = \"random\"\nrobots = 100000", &Overrides::default()),
    ];
    assert_snapshot!(rows.join("\n\n"));
}
