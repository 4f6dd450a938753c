//! `shoal sweep` as people use it: what it refuses, what a kill and Ctrl-C leave, and that `lockstep` finds what `single` does.

use crate::support::{Here, SHOAL};
use rustix::process::Signal;
use serde_json::Value;
use shoal_tests::process::{Ended, Place, Run, text_of, wait_for};
use std::path::Path;
use std::time::{Duration, Instant};

/// Two robots that swap places, soon.
const PAIR: &str = "\
[clock]
tick_hz = 20
duration_s = 20
[layout]
kind = \"circle-swap\"
robots = 2
radius_m = 2
jitter_m = 0.3
";

fn text(here: &Here, name: &str) -> String {
    text_of(here.path().join(name)).unwrap_or_else(|| panic!("{name} is not there"))
}

fn refused(ended: &Ended, code: i32, words: &[&str]) {
    assert_eq!((ended.code, ended.stdout.as_str()), (Some(code), ""), "{ended}");
    // A value out of bounds is its own way out.
    assert!(ended.stderr.contains("\nhint: ") || ended.stderr.contains("clock.tick_hz"), "{ended}");
    words.iter().for_each(|word| assert!(ended.stderr.contains(word), "`{word}` is not in {ended}"));
}

#[test]
fn what_cannot_be_swept_is_refused_before_anything_is_made() {
    let here = Here::new();
    here.file("pair.toml", PAIR).file("bad.toml", PAIR.replace("tick_hz = 20", "tick_hz = \"fast\"\nsped = 1"));
    here.file("file", "");
    std::fs::create_dir(here.path().join("foreign")).expect("a directory");
    here.file("foreign/notes.txt", "mine");
    for (line, code, words) in [
        (
            "sweep missing.toml ring-51 --out x",
            2,
            &["`missing.toml`: file not found", "unknown scenario `ring-51`"][..],
        ),
        ("sweep -", 2, &["scenario `-`: a sweep cannot read standard input"]),
        ("sweep pair.toml pair.toml", 2, &["scenario `pair.toml`: it is given twice"]),
        ("sweep pair.toml --planner apff --out x", 2, &["scenario `pair.toml`: --planner apff", "did you mean `apf`"]),
        ("sweep pair.toml --set clock.tick_hz=0 --out x", 2, &["--set clock.tick_hz=0"]),
        ("sweep pair.toml --vary clock.tick_hz=20,-1 --out x", 2, &["--set clock.tick_hz=-1", "clock.tick_hz"]),
        ("sweep pair.toml --vary clock.seed=1,2", 2, &["key `clock.seed`: it cannot be varied", "--seeds"]),
        ("sweep pair.toml --planner apf --baseline rpoa", 2, &["--baseline: planner `rpoa` is not in the sweep"]),
        ("sweep pair.toml --planner apf --assert rpoa:success>=1", 2, &["--assert rpoa:success>=1: planner `rpoa`"]),
        ("sweep pair.toml --assert makespan_ratio<=1", 2, &["it needs a baseline"]),
        ("sweep pair.toml --seeds 0..100000 --vary clock.tick_hz=20,40", 2, &["more than 100000 runs"]),
        ("sweep pair.toml --out file", 3, &["directory `file`: cannot be used: a file is in its place"]),
        ("sweep pair.toml --out foreign", 2, &["directory `foreign`: it is not that of a sweep: it holds `notes.txt`"]),
        ("sweep pair.toml --out /proc/x", 3, &["directory `/proc/x`: cannot be used"]),
    ] {
        refused(&here.shoal(line), code, words);
    }
    // The words of a wrong scenario are those of `validate`.
    let [validated, swept] = ["validate bad.toml", "sweep bad.toml"].map(|line| here.shoal(line));
    assert_eq!((validated.code, &validated.stderr), (swept.code, &swept.stderr), "{swept}");
    for wrong in
        ["--seeds 5..3", "--seeds many", "--vary k", "--assert success=1", "--assert succ>=1", "--mode realtime"]
    {
        let ended = here.shoal(&format!("sweep pair.toml {wrong}"));
        assert_eq!((ended.code, ended.stdout.as_str()), (Some(2), ""), "{ended}");
    }
    let mut names: Vec<_> =
        here.path().read_dir().expect("a directory").map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["bad.toml", "file", "foreign", "pair.toml"], "nothing was made");
    assert_eq!(text(&here, "foreign/notes.txt"), "mine");
}

/// What is the same however a sweep got there.
fn results(folder: &Path) -> Vec<String> {
    let read = |name: &str| text_of(folder.join(name)).unwrap_or_else(|| panic!("{name} is not there"));
    ["summary.json", "summary.txt", "makespan-ring-15.svg", "sweep.json"].map(read).to_vec()
}

const RINGS: &str = "sweep ring-15 --planner amr-apf --planner apf --seeds 0..40 --jobs 1 --baseline apf";

#[test]
fn a_sweep_that_was_killed_resumes_to_the_same_results() {
    let here = Here::new();
    let whole = here.shoal(&format!("{RINGS} --out whole"));
    assert_eq!(whole.code, Some(0), "{whole}");
    let lines =
        |folder: &str| text_of(here.path().join(folder).join("runs.jsonl")).map_or(0, |text| text.lines().count());
    for signal in [Signal::KILL, Signal::INT] {
        let running = here.run(&format!("{RINGS} --out cut")).start();
        let before = lines("cut");
        wait_for("some runs", || (lines("cut") > before + 3).then_some(()));
        let sent = Instant::now();
        running.signal(signal);
        let ended = running.end();
        assert!(lines("cut") < 80, "it was still running");
        assert!(!here.path().join("cut/summary.json").exists(), "{ended}");
        if signal == Signal::INT {
            assert!(sent.elapsed() < Duration::from_secs(30), "a bound for a machine under load");
            assert_eq!((ended.code, ended.stdout.as_str()), (Some(130), ""), "{ended}");
            let said = "of 80 runs are kept in cut; give the same command again to resume\n";
            assert!(ended.stderr.ends_with(said), "{ended}");
        }
    }
    let resumed = here.shoal(&format!("{RINGS} --out cut"));
    assert_eq!((resumed.code, &resumed.stdout), (Some(0), &whole.stdout), "{resumed}");
    assert!(resumed.stderr.contains("of 80 runs have ended before and are not repeated"), "{resumed}");
    assert_eq!(results(&here.path().join("whole")), results(&here.path().join("cut")));
    // Other questions about the same runs need no new runs; other runs are another sweep.
    let asked = here
        .shoal(&format!("{} --baseline amr-apf --assert success>=1 --out cut", RINGS.replace(" --baseline apf", "")));
    assert_eq!(asked.code, Some(0), "{asked}");
    assert!(asked.stderr.contains("80 of 80 runs have ended before"), "{asked}");
    let other = here.shoal(&format!("{} --out cut", RINGS.replace("0..40", "0..4")));
    refused(&other, 2, &["directory `cut`: it holds another sweep: seeds: ", "give --out another directory"]);
}

#[test]
fn assertions_decide_the_exit_code() {
    let here = Here::new();
    here.file("pair.toml", PAIR);
    let line = "sweep pair.toml --planner straight --planner amr-apf --seeds 1,2,3 --baseline amr-apf";
    let ended = here.shoal(&format!("{line} --assert amr-apf:success==1 --assert amr-apf:contacts==0"));
    assert_eq!(ended.code, Some(0), "runs that failed are results: {ended}");
    assert!(ended.stdout.contains("assertion amr-apf:success==1: holds"), "{ended}");
    let command = "shoal run pair.toml --mode single --planner straight --seed 1";
    assert!(ended.stdout.contains(command), "{ended}");
    let repeated = here.shoal(&command["shoal ".len()..]);
    assert_eq!(repeated.code, Some(1), "{repeated}");
    let ended = here.shoal(&format!("{line} --assert contacts==0 --format json"));
    let summary: Value = serde_json::from_str(&ended.stdout).unwrap_or_else(|error| panic!("{error}: {ended}"));
    assert_eq!((ended.code, &summary["schema"]), (Some(1), &"shoal.sweep/1".into()), "{ended}");
    let failed = &summary["assertions"][0]["failed"];
    assert_eq!((&failed[0]["row"], &failed[1]), (&"pair.toml, straight".into(), &Value::Null), "{failed:#}");
}

#[test]
fn lockstep_finds_what_single_does() {
    let _place = Place::take();
    let here = Here::new();
    here.file("pair.toml", PAIR);
    let records = |mode: &str| {
        let ended =
            here.shoal(&format!("sweep pair.toml --vary radio.drop=0,0.3 --seeds 2,4 --mode {mode} --out {mode}"));
        assert_eq!(ended.code, Some(0), "{ended}");
        let runs = text(&here, &format!("{mode}/runs.jsonl"));
        let mut records: Vec<Value> = runs.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
        records.sort_by_key(|record| record["run"].as_u64());
        records.iter_mut().for_each(|record| record["cost"] = Value::Null);
        records
    };
    assert_eq!(records("single"), records("lockstep"));
}

#[test]
fn a_reader_may_stop_reading_and_files_are_written() {
    let here = Here::new();
    here.file("pair.toml", PAIR);
    let (reader, writer) = std::io::pipe().expect("a pipe");
    let running =
        Run::new(SHOAL).words("sweep pair.toml --seeds 0..2 --out kept").within(here.path()).stdout(writer).start();
    drop(reader);
    let ended = running.end();
    assert_eq!(ended.code, Some(0), "{ended}");
    assert!(text(&here, "kept/summary.txt").contains("pair.toml"), "{ended}");
}
