//! What is wrong is refused before anything starts: exit code 2 for the command line and the scenario, 3 for the
//! environment; nothing on standard output; on standard error the file, the key, the value and the way out.

use crate::support::{Here, shoal};
use shoal_tests::process::Ended;
use std::fmt::Write;

/// One robot that is right, to be wrong beside.
const ROBOT: &str = "[[robot]]\nid = \"a\"\nstart_m = [0, 0]\ngoal_m = [5, 0]\n";

fn refused(ended: &Ended, code: i32) {
    assert_eq!(ended.code, Some(code), "{ended}");
    assert_eq!(ended.stdout, "", "{ended}");
    assert!(ended.stderr.starts_with("error: "), "{ended}");
    assert!(!ended.stderr.contains('\x1b'), "no colour where there is no terminal: {ended}");
}

/// (what, a text that has it, what the message must name)
fn bad_texts() -> Vec<(&'static str, String, Vec<&'static str>)> {
    let with = |more: &str| format!("{ROBOT}{more}");
    vec![
        ("unknown key", with("sped_mps_max = 2"), vec!["line 5", "robot[0].sped_mps_max", "`speed_mps_max`"]),
        ("unknown table", with("[clok]\nseed = 1"), vec!["line 5", "clok", "`clock`"]),
        ("wrong type", with("[clock]\ntick_hz = \"fast\""), vec!["line 6", "clock.tick_hz", "number", "`fast`"]),
        ("wrong type of a table", "robot = 3".to_string(), vec!["line 1", "robot", "3"]),
        ("not a number", with("radius_m = nan"), vec!["line 5", "robot[0].radius_m", "nan"]),
        ("infinite", with("radius_m = inf"), vec!["line 5", "robot[0].radius_m", "inf"]),
        ("nan in a point", with("waypoints_m = [[1, nan]]"), vec!["line 5", "robot[0].waypoints_m", "nan"]),
        ("negative radius", with("radius_m = -0.2"), vec!["line 5", "robot[0].radius_m", "-0.2"]),
        ("no speed", with("speed_mps_max = 0"), vec!["line 5", "robot[0].speed_mps_max", "0"]),
        (
            "two robots in one place",
            with("[[robot]]\nid = \"b\"\nstart_m = [0.1, 0]\ngoal_m = [0, 5]"),
            vec!["line 7", "robot[1].start_m", "`b` overlaps `a`", "0.300 m", "0.400 m"],
        ),
        (
            "start inside an obstacle",
            with("[[obstacle]]\nshape = \"disc\"\ncenter_m = [0, 0.5]\nradius_m = 0.4"),
            vec!["line 3", "robot[0].start_m", "obstacle[0]", "[0, 0]"],
        ),
        (
            "goal inside a polygon",
            with("[[obstacle]]\nshape = \"polygon\"\ncorners_m = [[4, -1], [6, -1], [6, 1], [4, 1]]"),
            vec!["line 4", "robot[0].goal_m", "obstacle[0]", "[5, 0]"],
        ),
        ("goal outside", with("[world]\nx_m = [-3, 3]"), vec!["line 4", "robot[0].goal_m", "[5, 0]", "[-3, 3]"]),
        ("unknown planner", with("planner = \"apff\""), vec!["line 5", "robot[0].planner", "`apff`", "`apf`"]),
        (
            "unknown parameter",
            with("planner = \"apf\"\nparams = { k_atr = 2.0 }"),
            vec!["line 6", "robot[0].params.k_atr", "`apf`", "k_att"],
        ),
        (
            "parameter out of range",
            with("planner = \"decentralized-apf\"\nparams = { bracket_power = 7 }"),
            vec!["line 6", "robot[0].params.bracket_power", "7"],
        ),
        (
            "duplicate id",
            with("[[robot]]\nid = \"a\"\nstart_m = [0, 3]\ngoal_m = [5, 3]"),
            vec!["line 6", "robot[1].id", "`a`", "line 2"],
        ),
        (
            "bad id",
            "[[robot]]\nid = \"R 1\"\nstart_m = [0, 0]\ngoal_m = [1, 0]".to_string(),
            vec!["robot[0].id", "R 1"],
        ),
        ("missing key", "[[robot]]\nid = \"a\"\nstart_m = [0, 0]".to_string(), vec!["robot[0]", "goal_m"]),
        (
            "event for nobody",
            with("[[event]]\nat_s = 1\nkind = \"kill\"\nrobot = \"b\""),
            vec!["line 8", "event[0].robot", "`b`", "known robots: a"],
        ),
        (
            "event after the end",
            with("[[event]]\nat_s = 99\nkind = \"kill\"\nrobot = \"a\""),
            vec!["line 6", "event[0].at_s", "99", "duration_s"],
        ),
        (
            "more robots than places",
            "[fleet]\nmax_robots = 2\n[layout]\nkind = \"ring\"\nrobots = 3\nradius_m = 5".to_string(),
            vec!["line 2", "fleet.max_robots", "2", "3 robots"],
        ),
        (
            "more robots than there can be",
            "[layout]\nkind = \"ring\"\nrobots = 2000\nradius_m = 5".to_string(),
            vec!["line 3", "layout.robots", "1024", "2000"],
        ),
        ("no room", "[layout]\nkind = \"random\"\nrobots = 1000\nspread_m = 3".to_string(), vec!["layout", "1000"]),
        ("nobody", "[clock]\nseed = 1".to_string(), vec!["no robots", "[[robot]]"]),
        ("not TOML", "[[robot]\nid = 3".to_string(), vec!["line 1", "TOML", "[[robot]"]),
        ("a key twice", "name = \"a\"\nname = \"b\"".to_string(), vec!["line 2", "name"]),
        ("empty", String::new(), vec!["empty", "[[robot]]"]),
        ("only spaces", " \n\t\n".to_string(), vec!["empty", "[[robot]]"]),
    ]
}

#[test]
fn bad_scenarios_say_what_where_and_what_to_do() {
    let here = Here::new();
    let mut all = String::new();
    for (what, text, names) in bad_texts() {
        here.file("bad.toml", &text);
        for verb in ["validate", "run", "run --mode single"] {
            let ended = here.shoal(&format!("{verb} bad.toml"));
            assert_eq!(ended.code, Some(2), "{what}: {ended}");
            refused(&ended, 2);
            assert!(ended.stderr.contains("scenario `bad.toml`"), "{what}: {ended}");
            for name in &names {
                assert!(ended.stderr.contains(name), "{what}: `{name}` is not in\n{ended}");
            }
            if verb == "validate" {
                writeln!(all, "-- {what}\n{}", ended.stderr).unwrap();
            }
        }
    }
    insta::assert_snapshot!(all);
}

#[test]
fn all_problems_of_a_file_come_at_once() {
    let here = Here::new();
    let texts: Vec<&str> = vec![
        "name = \"all at once\"",
        "spedd = 3",
        "[clock]",
        "tick_hz = \"fast\"",
        "seed = -1",
        "duration_s = nan",
        "[defaults]",
        "radius_m = -0.2",
        "speed_mps_max = 0",
        "planner = \"apff\"",
        "[planners.apf]",
        "k_atr = 1.0",
        "[[robot]]",
        "id = \"a\"",
        "start_m = [0, 0]",
        "goal_m = [50, 0]",
        "[[robot]]",
        "id = \"a\"",
        "start_m = [0, 0.1]",
        "goal_m = [5, 0]",
        "[[event]]",
        "at_s = 1",
        "kind = \"kill\"",
        "robot = \"zed\"",
    ];
    let ended = here.file("all.toml", texts.join("\n")).shoal("run all.toml");
    refused(&ended, 2);
    for line in [2, 4, 5, 6, 8, 9, 10, 12, 16, 18, 19, 24] {
        assert!(ended.stderr.contains(&format!("line {line}: ")), "line {line}: {ended}");
    }
    insta::assert_snapshot!(ended.stderr);
}

#[test]
fn files_that_are_none() {
    let here = Here::new();
    std::fs::create_dir(here.path().join("folder.toml")).expect("a directory");
    here.file("bytes.toml", b"name = \"\xff\xfe\"");
    let mut all = String::new();
    for (name, cause) in [
        ("missing.toml", "file not found"),
        ("./missing", "file not found"),
        ("folder.toml", "is a directory"),
        ("bytes.toml", "byte 8 is not UTF-8"),
        ("demo-51", "unknown scenario"),
    ] {
        for verb in ["run", "validate"] {
            let ended = here.shoal(&format!("{verb} {name}"));
            refused(&ended, 2);
            assert!(ended.stderr.contains(name) && ended.stderr.contains(cause), "{ended}");
            assert!(ended.stderr.contains("\nhint: "), "{ended}");
            if verb == "run" {
                all += &ended.stderr;
            }
        }
    }
    insta::assert_snapshot!(all);
}

/// Some files are worse than wrong: they are answered in a moment, and in a page.
#[test]
fn tens_of_thousands_of_robots_are_refused_in_a_page() {
    let here = Here::new();
    let mut text = String::new();
    for i in 0..12_000 {
        writeln!(text, "[[robot]]\nid = \"r{i}\"\nstart_m = [{i}, 0]\ngoal_m = [{i}, 5]").unwrap();
    }
    let ended = here.file("huge.toml", text).shoal("run huge.toml");
    refused(&ended, 2);
    assert!(
        ended.stderr.starts_with("error: scenario `huge.toml`: line 1: robot: there can be at most 1024"),
        "{ended}"
    );
    assert!(ended.stderr.lines().count() < 50, "{ended}");
    let ended = shoal("run ring-15 --robots 100000");
    refused(&ended, 2);
    assert!(ended.stderr.contains("--robots 100000: layout.robots") && ended.stderr.contains("1024"), "{ended}");
}

/// (words, what the message must name)
const BAD_LINES: &[(&str, &[&str])] = &[
    ("run head-on --set clock.tick_hz", &["--set clock.tick_hz", "no `=`"]),
    ("run head-on --set clok.tick_hz=3", &["--set clok.tick_hz=3", "unknown key", "did you mean `clock`"]),
    ("run head-on --set clock.tick_hz=abc", &["clock.tick_hz", "number", "`abc`"]),
    ("run head-on --set clock.tick_hz=[1", &["clock.tick_hz", "not a TOML value"]),
    ("run head-on --set =3", &["--set =3", "not a key path"]),
    ("run head-on --set robot.0.radius_m=3", &["robot.0.radius_m", "robot[0]"]),
    ("run head-on --set robot[7].radius_m=3", &["robot[7]", "2"]),
    ("run head-on --set robot[0].radius_m=-3", &["robot[0].radius_m", "-3"]),
    ("run head-on --set robot[0].start_m=[4,0]", &["overlaps"]),
    ("run head-on --set clock.tick_hz=0 --set clock.seed=x", &["--set clock.tick_hz=0", "--set clock.seed=x"]),
    ("run head-on --robots 3", &["--robots 3", "[layout]"]),
    ("run head-on --planner apff", &["--planner apff", "`apff`", "did you mean `apf`"]),
    ("run head-on --filter full", &["full", "--filter", "none", "shared-gap"]),
    ("run head-on --set world.physics=\"rapier\" --filter shared-gap", &["--filter shared-gap", "kinematic"]),
    ("run head-on --mode warp", &["warp", "--mode", "lockstep"]),
    ("run head-on --duration 0", &["--duration", "above zero"]),
    ("run head-on --duration 5parsecs", &["--duration", "parsecs", "60s"]),
    ("run head-on --seed -1", &["-1", "--seed"]),
    ("run ring-15 --robots -1", &["-1", "--robots"]),
    ("run head-on --format yaml", &["yaml", "--format", "json"]),
    ("run head-on demo-15", &["demo-15"]),
    ("run --sed 3", &["--sed", "--seed"]),
    ("up head-on --mode single", &["single", "lockstep"]),
    ("up head-on --name a/b", &["name `a/b`", "letters", "--name"]),
    ("up nowhere", &["nowhere"]),
    ("logs --since yesterday", &["--since yesterday", "10m"]),
    ("task send r01", &["no goal", "4,-2"]),
    ("task send r01 4", &["goal `4`", "X,Y"]),
    ("task send r01 1,2 3,4 --now", &["--now", "one goal"]),
    ("task wait", &["<TASK>"]),
    ("remove", &["<ROBOT>"]),
    ("restart", &["<ROBOT>"]),
    ("inject kil a", &["unknown verb `inject kil`", "did you mean `kill`"]),
    ("bench loop --robots 0", &["--robots", "sizes from 1 to 1023"]),
    ("bench plan", &["unknown verb `bench plan`", "did you mean `planners`"]),
    ("bench planners apff", &["`apff`", "did you mean `apf`"]),
    ("bench planners --plans 0", &["--plans"]),
    ("reproduce rpao", &["unknown paper `rpao`", "did you mean `rpoa`"]),
    ("reproduce --runs -1", &["--runs", "-1"]),
    ("plot", &["<FILE>"]),
    ("replay --verify x", &["record `x`", "No such file", "--record"]),
    ("stress --robots 0", &["--robots 0", "1 to 1024"]),
    ("stress --robots -3", &["--robots", "-3"]),
    ("stress --hz 0", &["--hz 0", "1 to 10000"]),
    ("stress --duration 0", &["--duration"]),
    ("latency --metric age", &["'age'", "pose-age"]),
    ("valdiate", &["unknown verb `valdiate`", "did you mean `validate`"]),
    ("demo-15", &["unknown verb `demo-15`", "shoal run demo-15"]),
    ("planners apff", &["`apff`", "did you mean `apf`"]),
    ("add --start 1,2", &["--goal"]),
    ("add --start 1 --goal 2,3", &["--start", "X,Y"]),
    ("task send a", &["X,Y"]),
    ("task send a 1,nan", &["nan"]),
];

#[test]
fn bad_command_lines_say_what_and_what_to_do() {
    let mut all = String::new();
    for (line, names) in BAD_LINES {
        let ended = shoal(line);
        refused(&ended, 2);
        for name in *names {
            assert!(ended.stderr.contains(name), "`{name}` is not in\n{ended}");
        }
        writeln!(all, "$ shoal {line}\n{}", ended.stderr).unwrap();
    }
    insta::assert_snapshot!(all);
}

/// The report has no place: that is found out before the run, not after it.
#[test]
fn reports_without_a_place() {
    let here = Here::new();
    here.file("file", "");
    let mut all = String::new();
    for (place, names) in [
        ("nowhere/out.json", &["nowhere/out.json", "directory `nowhere` does not exist", "mkdir -p nowhere"][..]),
        (".", &["report `.`", "is a directory"]),
        ("file/out.json", &["file/out.json"]),
        // Read-only for everybody, root included.
        ("/sys/kernel/out.json", &["/sys/kernel/out.json", "ermission", "directory that you may write to"]),
    ] {
        let ended = here.shoal(&format!("run head-on --mode single --report {place}"));
        refused(&ended, 3);
        for name in names {
            assert!(ended.stderr.contains(name), "`{name}` is not in\n{ended}");
        }
        all += &ended.stderr;
    }
    insta::assert_snapshot!(all);
    // The first that applies: a wrong scenario is a wrong scenario.
    refused(&here.shoal("run demo-51 --report nowhere/out.json"), 2);
}

/// Nobody answers to the name of a fleet that cannot be. (Without a name these verbs mean whatever fleet runs.) With
/// other fleets on the machine the name is wrong, without any there is none to talk to.
#[test]
fn fleets_that_are_not_there() {
    for line in ["ps", "add --start 0,0 --goal 1,1", "task send a 1,2"] {
        let ended = shoal(&format!("{line} --fleet no-such-fleet"));
        let others = ended.stderr.contains("hint: running fleets: ");
        refused(&ended, if others { 2 } else { 3 });
        assert!(ended.stderr.contains("fleet") && ended.stderr.contains("\nhint: "), "{ended}");
    }
}

/// What happened decides the code of a run that could be run.
#[test]
fn runs_that_do_not_go_as_expected() {
    let here = Here::new();
    for (line, code) in [
        ("run head-on --mode single", 0),
        ("run head-on --mode single --planner straight", 1),
        ("run head-on --mode single --duration 1s", 4),
        ("run head-on --mode single --duration 1s --set expect.arrived=0", 0),
        ("run head-on --mode single --planner straight --set expect.contacts_max=1", 0),
        ("run head-on --mode single --set expect.makespan_s_max=5", 1),
        ("run head-on --mode single --set expect.clearance_m_min=3", 1),
    ] {
        let ended = here.shoal(line);
        assert_eq!(ended.code, Some(code), "{ended}");
        assert!(!ended.stdout.is_empty(), "{ended}");
    }
}
