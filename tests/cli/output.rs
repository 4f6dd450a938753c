//! Standard output is for data: JSON and nothing else where JSON was asked for, whoever reads it and however little of
//! it.

use crate::support::{Here, SHOAL, shoal};
use serde_json::Value;
use shoal_tests::process::{Ended, Place, Run};
use std::fs::File;
use std::io::Read;

fn json(ended: &Ended) -> Value {
    let value = serde_json::from_str(&ended.stdout).unwrap_or_else(|error| panic!("{error}\n{ended}"));
    assert!(ended.stdout.ends_with("}\n"), "one newline at the end: {ended}");
    value
}

#[test]
fn json_is_json_and_nothing_else() {
    for (line, schema) in [
        ("run head-on --mode single --format json", "shoal.report/1"),
        ("validate --format json", "shoal.validate/1"),
        ("validate demo-15 missing.toml --format json", "shoal.validate/1"),
        ("planners --format json", "shoal.planners/1"),
        ("planners apf --format json", "shoal.planners/1"),
        ("doctor --format json", "shoal.doctor/1"),
        ("ps --format json", "shoal.ps/1"),
    ] {
        let ended = shoal(line);
        assert_eq!(json(&ended)["schema"], schema, "{ended}");
        assert!(!ended.stdout.contains('\x1b'), "{ended}");
    }
    let schema = json(&shoal("schema"));
    assert!(schema["$schema"].as_str().is_some_and(|url| url.starts_with("https://json-schema.org/")), "{schema:#}");
}

#[test]
fn the_reference_of_scenarios_is_the_page_in_docs() {
    let ended = shoal("schema --format text");
    assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{ended}");
    assert!(ended.stdout == include_str!("../../docs/scenario-reference.md"), "docs/scenario-reference.md is another");
}

#[test]
fn a_fleet_talks_on_standard_error_only() {
    let _place = Place::take();
    let ended = shoal("run late-join --mode lockstep --format json");
    let report = json(&ended);
    assert_eq!(ended.code, Some(0), "{ended}");
    assert_eq!((&report["mode"], &report["robots"]), (&"lockstep".into(), &7.into()));
    assert!(ended.stderr.contains("late-1 joined"), "what happens is told: {ended}");
    assert!(!ended.stderr.contains(['\x1b', '\r']), "no live line where there is no terminal: {ended}");
}

#[test]
fn wrong_scenarios_are_listed_in_json_too() {
    let here = Here::new();
    here.file("bad.toml", "[[robot]]\nid = \"a\"\nstart_m = [0, 0]\ngoal_m = [5, 0]\nradius_m = -1\nplaner = \"apf\"");
    let ended = here.shoal("validate bad.toml head-on --format json");
    assert_eq!((ended.code, ended.stderr.as_str()), (Some(2), ""), "{ended}");
    let files = json(&ended)["files"].clone();
    assert_eq!((&files[0]["ok"], &files[1]["ok"]), (&false.into(), &true.into()), "{files:#}");
    let problems = files[0]["problems"].as_array().expect("a list");
    let keys: Vec<_> = problems.iter().map(|p| (p["line"].as_u64(), p["key"].as_str().unwrap_or(""))).collect();
    assert_eq!(keys, [(Some(5), "robot[0].radius_m"), (Some(6), "robot[0].planer")]);
    assert!(problems[1]["hint"].as_str().is_some_and(|hint| hint.contains("`planner`")), "{problems:#?}");
}

#[test]
fn the_report_in_a_file_is_the_one_that_is_printed() {
    let here = Here::new();
    here.file("out.json", "what was there before");
    let ended = here.shoal("run ring-15 --robots 5 --mode single --report out.json --format json");
    assert_eq!(ended.code, Some(0), "{ended}");
    let kept = shoal_tests::process::text_of(here.path().join("out.json")).expect("it was written");
    assert_eq!(kept, ended.stdout);
    let names: Vec<_> = std::fs::read_dir(here.path()).expect("a directory").flatten().collect();
    assert_eq!(names.len(), 1, "nothing else is left: {names:?}");
    // A run that was not as expected has a report as well.
    let ended = here.shoal("run head-on --mode single --planner straight --report out.json");
    assert_eq!(ended.code, Some(1), "{ended}");
    let kept = shoal_tests::process::text_of(here.path().join("out.json")).expect("it was written");
    let kept: Value = serde_json::from_str(&kept).expect("JSON");
    assert_eq!((&kept["exit_code"], &kept["outcome"]["robot_contacts"]), (&1.into(), &1.into()));
}

/// `| head -c 1`, and `| true`: the reader's going away is no error, and no panic.
#[test]
fn a_reader_may_stop_reading() {
    let lines =
        ["schema", "--help", "run --help", "planners", "planners apf", "validate", "ps", "run head-on --mode single"];
    for line in lines.iter().flat_map(|line| [line.to_string(), format!("{line} --format json")]) {
        if line.contains("--help --format") {
            continue;
        }
        for read in [0, 1] {
            let (mut reader, writer) = std::io::pipe().expect("a pipe");
            let running = Run::new(SHOAL).words(&line).stdout(writer).start();
            let mut bytes = vec![0; read];
            reader.read_exact(&mut bytes).expect("it prints something");
            drop(reader);
            let ended = running.end();
            assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{read} bytes: {ended}");
        }
    }
}

#[test]
fn a_full_disk_is_said_to_be_full() {
    for line in ["schema", "planners", "validate", "run head-on --mode single --format json"] {
        let full = File::options().write(true).open("/dev/full").expect("Linux has it");
        let ended = Run::new(SHOAL).words(line).stdout(full).end();
        assert_eq!(ended.code, Some(3), "{ended}");
        assert!(ended.stderr.contains("error: standard output: ") && ended.stderr.contains("\nhint: "), "{ended}");
    }
}

/// In a terminal of 40 columns, made by `script`.
#[test]
fn a_narrow_terminal_is_not_overrun() {
    let line = |words: &str| format!("stty cols 40 rows 30; '{SHOAL}' {words}");
    for words in [
        "run corridor-swap --mode single 2>/dev/null",
        "run ring-15 --mode lockstep >/dev/null",
        "planners decentralized-apf",
        "planners",
        "--help",
        "doctor",
        "sweep ring-15 head-on --planner apf --planner amr-apf --seeds 0..2 --baseline apf",
    ] {
        let _place = Place::take();
        let ended = Run::new("script").args(["-q", "-e", "-c", &line(words), "/dev/null"]).env("TERM", "xterm").end();
        assert!(!ended.stdout.is_empty() || words.contains(">/dev/null"), "{ended}");
        for shown in plain(&ended.stdout).split(['\n', '\r']) {
            assert!(shown.chars().count() <= 40, "{words}: {shown:?} is {} wide", shown.chars().count());
        }
    }
}

/// Without the sequences that paint and erase.
fn plain(text: &str) -> String {
    let mut plain = String::new();
    let mut chars = text.chars();
    while let Some(c) = chars.next() {
        if c != '\x1b' {
            plain.push(c);
        } else if chars.next() == Some('[') {
            chars.by_ref().find(char::is_ascii_alphabetic);
        }
    }
    plain
}

#[test]
fn colour_is_for_terminals() {
    let run = |env: (&str, &str)| {
        let line = format!("'{SHOAL}' run head-on --mode single");
        let run = Run::new("script").args(["-q", "-e", "-c", &line, "/dev/null"]).env("TERM", "xterm");
        run.env(env.0, env.1).end().stdout
    };
    assert!(run(("LANG", "C")).contains("\x1b[1;32m"));
    for plain in [("NO_COLOR", "1"), ("TERM", "dumb")] {
        assert!(!run(plain).contains("\x1b[1;"), "{plain:?}");
    }
}

#[test]
fn warnings_are_talk_and_stand_in_the_report() {
    let here = Here::new();
    let robot = |id: &str, x: i32| format!("[[robot]]\nid = \"{id}\"\nstart_m = [{x}, 0]\ngoal_m = [0, 0]\n");
    here.file("one-goal.toml", format!("[clock]\nduration_s = 2\n{}{}", robot("a", -3), robot("b", 5)));
    let said = "line 10: robot[1].goal_m: the goals of `b` and `a` are 0.000 m apart, their bodies need 0.400 m";

    let ended = here.shoal("validate one-goal.toml");
    assert_eq!((ended.code, ended.stdout.starts_with("ok: ")), (Some(0), true), "{ended}");
    assert!(ended.stderr.starts_with(&format!("warning: scenario `one-goal.toml`: {said}\nhint: ")), "{ended}");
    let listed: Value = serde_json::from_str(&here.shoal("validate one-goal.toml --format json").stdout).expect("JSON");
    assert_eq!(listed["files"][0]["warnings"][0]["line"], 10, "{listed}");

    let ended = here.shoal("run one-goal.toml --mode single --format json");
    assert!(ended.stderr.contains(said), "{ended}");
    let report: Value = serde_json::from_str(&ended.stdout).expect("JSON");
    assert_eq!(report["warnings"], serde_json::json!([said]), "{ended}");
}
