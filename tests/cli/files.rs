//! What a command writes: never over what it reads, never two things into one file, and what cannot be written costs
//! nothing of what is printed.

use crate::support::{Here, SHOAL};
use rustix::process::Signal;
use serde_json::Value;
use shoal_tests::process::{Ended, Place, Run, text_of, wait_for};
use std::fs::File;
use std::os::unix::fs::{PermissionsExt, symlink};

const SCENARIO: &str = "[[robot]]\nid = \"a\"\nstart_m = [0, 0]\ngoal_m = [2, 0]\n";

fn text(here: &Here, name: &str) -> String {
    text_of(here.path().join(name)).unwrap_or_else(|| panic!("{name} is not there"))
}

/// (the command, what its message must name)
#[test]
fn no_output_replaces_an_input_or_another_output() {
    let here = Here::new();
    here.file("my.toml", SCENARIO).file("agent", "#!/bin/sh\n");
    here.file("own.toml", format!("{SCENARIO}agent = \"./agent\"\n"));
    std::fs::set_permissions(here.path().join("agent"), PermissionsExt::from_mode(0o755)).expect("its mode");
    std::fs::hard_link(here.path().join("my.toml"), here.path().join("hard")).expect("a link");
    symlink("my.toml", here.path().join("soft")).expect("a link");
    symlink("new.mcap", here.path().join("to-new")).expect("a link");
    assert_eq!(here.shoal("run my.toml --mode single --record run.mcap --report run.json").code, Some(0));
    std::fs::hard_link(here.path().join("run.mcap"), here.path().join("rec.svg")).expect("a link");
    let kept = ["my.toml", "agent", "run.json"].map(|name| text(&here, name));
    let record = std::fs::read(here.path().join("run.mcap")).expect("the record");
    for (line, names) in [
        ("run my.toml --mode single --report my.toml", ["report `my.toml`", "the scenario", "--report"]),
        ("run my.toml --mode single --record hard", ["record `hard`", "the scenario", "--record"]),
        ("run my.toml --mode lockstep --record soft", ["record `soft`", "the scenario", "--record"]),
        ("run own.toml --mode lockstep --report agent", ["report `agent`", "the agent of robot `a`", "--report"]),
        ("run my.toml --mode single --report x --record ./x", ["record `./x`", "the report", "--record"]),
        (
            "run my.toml --mode single --report to-new --record new.mcap",
            ["record `new.mcap`", "the report", "--record"],
        ),
        ("run my.toml --mode single --record -", ["record `-`", "standard output", "`./-`"]),
        ("plot run.mcap --out run.mcap", ["picture `run.mcap`", "SVG", "run.svg"]),
        ("plot run.mcap --out rec.svg", ["picture `rec.svg`", "what is drawn", "--out"]),
        ("plot run.json --out rec.svg", ["picture `rec.svg`", "the record", "--out"]),
        ("plot rec.svg", ["picture `rec.svg`", "what is drawn", "--out"]),
        ("plot run.mcap --out run.png", ["picture `run.png`", "SVG", "run.svg"]),
        ("plot -", ["record `-`", "files", "`./-`"]),
        ("reproduce rpoa --runs 0 --out -", ["figures `-`", "directory", "`./-`"]),
    ] {
        let ended = here.shoal(line);
        assert_eq!((ended.code, ended.stdout.as_str()), (Some(2), ""), "{line}: {ended}");
        assert!(ended.stderr.contains("\nhint: "), "{line}: {ended}");
        names.iter().for_each(|name| assert!(ended.stderr.contains(name), "{line}: `{name}` is not in {ended}"));
    }
    assert_eq!(kept, ["my.toml", "agent", "run.json"].map(|name| text(&here, name)));
    assert_eq!(record, std::fs::read(here.path().join("run.mcap")).expect("the record"));
    let made = here.path().read_dir().expect("a directory").count();
    assert_eq!(made, 9, "nothing was made");
    // Standard output may be a file as well.
    let out = File::options().append(true).open(here.path().join("run.json")).expect("a file");
    let ended = here.run("run my.toml --mode single --report run.json").stdout(out).end();
    assert_eq!((ended.code, &text(&here, "run.json")), (Some(2), &kept[2]), "{ended}");
    assert!(ended.stderr.contains("standard output"), "{ended}");
}

#[test]
fn a_dash_is_standard_output_or_input() {
    let here = Here::new();
    here.file("my.toml", SCENARIO);
    let ended = here.shoal("run my.toml --mode single --report -");
    let report: Value = serde_json::from_str(&ended.stdout).unwrap_or_else(|error| panic!("{error}: {ended}"));
    assert_eq!((report["schema"].as_str(), ended.code), (Some("shoal.report/1"), Some(0)), "{ended}");
    let input = || File::open(here.path().join("my.toml")).expect("the scenario");
    let ended = here.run("run - --mode single --format json").stdin(input()).end();
    let same: Value = serde_json::from_str(&ended.stdout).unwrap_or_else(|error| panic!("{error}: {ended}"));
    assert_eq!((&same["scenario"], &same["trajectory_hash"]), (&"stdin".into(), &report["trajectory_hash"]));
    let ended = here.run("validate -").stdin(input()).end();
    assert_eq!((ended.code, ended.stdout.contains("stdin: 1 robot")), (Some(0), true), "{ended}");
    assert_eq!(here.path().read_dir().expect("a directory").count(), 1, "no file is called `-`");
    // What is read may be called so.
    here.file("-", SCENARIO);
    assert_eq!(here.shoal("run ./- --mode single").code, Some(0));
}

fn check_printed(ended: &Ended, code: i32, words: &[&str]) {
    assert_eq!(ended.code, Some(code), "{ended}");
    assert!(ended.stdout.contains("trajectory hash"), "the whole report is printed: {ended}");
    words.iter().for_each(|word| assert!(ended.stderr.contains(word), "`{word}` is not in {ended}"));
}

#[test]
fn a_report_that_cannot_be_written_is_printed_and_one_that_cannot_be_printed_is_written() {
    let here = Here::new();
    let ended = here.shoal("run head-on --mode single --report /dev/full");
    check_printed(&ended, 3, &["report `/dev/full`: cannot write", "hint: make room"]);
    let full = File::options().write(true).open("/dev/full").expect("a full disk");
    let ended = here.run("run head-on --mode single --report out.json --record out.mcap").stdout(full).end();
    assert_eq!(ended.code, Some(3), "{ended}");
    assert!(ended.stderr.contains("standard output: cannot write"), "{ended}");
    let report: Value = serde_json::from_str(&text(&here, "out.json")).expect("JSON");
    assert_eq!(report["outcome"]["arrived_all"], true);
    assert_eq!(here.shoal("plot out.json").code, Some(0));
}

#[test]
fn a_directory_that_is_removed_during_the_run_costs_only_the_files_in_it() {
    let _place = Place::take();
    let here = Here::new();
    std::fs::create_dir(here.path().join("sub")).expect("a directory");
    let line = "run head-on --mode realtime --set clock.stop=\"duration\" --duration 1h --report sub/out.json --record sub/out.mcap";
    let running = here.run(line).start();
    wait_for("the fleet", || {
        let ended = Run::new(SHOAL).words("ps --format json").end();
        let fleets: Value = serde_json::from_str(&ended.stdout).ok()?;
        let own = |fleet: &Value| fleet["daemon_pid"] == running.pid() && fleet["tick"].as_u64() > Some(3);
        fleets["fleets"].as_array()?.iter().any(own).then_some(())
    });
    std::fs::remove_dir_all(here.path().join("sub")).expect("it can be removed");
    running.signal(Signal::INT);
    let ended = running.end();
    check_printed(&ended, 3, &["report `sub/out.json`", "does not exist", "mkdir -p", "record `"]);
}
