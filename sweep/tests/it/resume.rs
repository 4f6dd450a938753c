//! A sweep that was killed and resumed has the result of one that was not, wherever it was killed; a directory that is not
//! the sweep's is left alone.

use crate::support::{plan, records};
use shoal_sweep::directory::Directory;
use shoal_sweep::summary::summarize;
use shoal_sweep::{ErrorKind, Plan, Record, ScenarioSource, execute, pool};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

/// Continues the sweep in a directory, and finishes it; how many runs were executed.
fn go_on(path: &Path, plan: &Plan, known: &[Record]) -> usize {
    let (mut directory, kept) = Directory::open(path, plan).unwrap();
    let mut all: Vec<Option<Record>> = vec![None; plan.runs()];
    for record in kept {
        let run = record.run;
        all[run] = Some(record);
    }
    let to_do: Vec<usize> = (0..plan.runs()).filter(|run| all[*run].is_none()).collect();
    for run in &to_do {
        directory.keep(&known[*run]).unwrap();
        all[*run] = Some(known[*run].clone());
    }
    let all: Vec<Record> = all.into_iter().map(Option::unwrap).collect();
    directory.finish(plan, &all, &summarize(plan, &all, Some("straight"), &[])).unwrap();
    to_do.len()
}

/// Every file of a directory but the runs, and the rows of the database.
fn results(path: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut results = BTreeMap::new();
    for entry in fs::read_dir(path).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        match name.as_str() {
            "runs.jsonl" => {}
            "sweep.db" => {
                let rows = rows(&path.join(&name));
                results.insert(name, rows.into_bytes());
            }
            _ => _ = results.insert(name.clone(), fs::read(path.join(name)).unwrap()),
        }
    }
    results
}

fn rows(path: &Path) -> String {
    let db = rusqlite::Connection::open(path).unwrap();
    let mut text = String::new();
    for table in ["run", "robot"] {
        let mut query = db.prepare(&format!("SELECT * FROM {table}")).unwrap();
        let columns = query.column_count();
        let mut rows = query.query([]).unwrap();
        while let Some(row) = rows.next().unwrap() {
            let cells: Vec<String> = (0..columns).map(|i| format!("{:?}", row.get_ref(i).unwrap())).collect();
            text += &format!("{table}: {}\n", cells.join(" "));
        }
    }
    text
}

#[test]
fn a_sweep_that_was_cut_anywhere_resumes_to_the_same_results() {
    let (plan, folder) = (plan(), tempfile::tempdir().unwrap());
    let known = records(&plan);
    let whole = folder.path().join("whole");
    assert_eq!(go_on(&whole, &plan, &known), 16);
    let expected = results(&whole);
    let names: Vec<&str> = expected.keys().map(String::as_str).collect();
    let pictures = ["makespan-pair.svg", "makespan-three.svg"];
    assert_eq!(names, [&pictures[..], &["summary.json", "summary.txt", "sweep.db", "sweep.json"]].concat());
    let runs = fs::read(whole.join("runs.jsonl")).unwrap();
    // Also in another order, as threads leave it.
    let mut lines: Vec<&[u8]> = runs.split_inclusive(|byte| *byte == b'\n').collect();
    lines.rotate_left(5);
    lines.swap(2, 9);
    let mixed = lines.concat();
    let cut = folder.path().join("cut");
    let mut repeated = Vec::new();
    for end in (0..=mixed.len()).step_by(mixed.len() / 41).chain([mixed.len() - 1, mixed.len()]) {
        let _ = fs::remove_dir_all(&cut);
        fs::create_dir(&cut).unwrap();
        fs::copy(whole.join("sweep.json"), cut.join("sweep.json")).unwrap();
        fs::write(cut.join("runs.jsonl"), &mixed[..end]).unwrap();
        fs::write(cut.join(".sweep.db.tmp"), "what a killed sweep left").unwrap();
        repeated.push(go_on(&cut, &plan, &known));
        let found = results(&cut);
        assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>(), "cut at {end}");
        for (name, content) in &found {
            assert!(content == &expected[name], "cut at {end}: {name} differs");
        }
    }
    assert_eq!((repeated[0], repeated.last(), repeated[repeated.len() - 2]), (16, Some(&0), 1));
}

/// Every column of a table that has the name of a field has its value.
#[test]
fn the_columns_of_the_database_are_the_fields_of_the_lines() {
    use rusqlite::types::ValueRef;
    let (plan, folder) = (plan(), tempfile::tempdir().unwrap());
    let known = records(&plan);
    go_on(&folder.path().join("whole"), &plan, &known);
    let db = rusqlite::Connection::open(folder.path().join("whole/sweep.db")).unwrap();
    let runs: Vec<serde_json::Value> = known.iter().map(|record| serde_json::to_value(record).unwrap()).collect();
    let robots = runs.iter().flat_map(|run| run["per_robot"].as_array().unwrap().clone()).collect();
    for (table, fields, fewest) in [("run", runs, 28), ("robot", robots, 14)] {
        let mut query = db.prepare(&format!("SELECT * FROM {table}")).unwrap();
        let columns: Vec<String> = query.column_names().into_iter().map(str::to_owned).collect();
        let mut rows = query.query([]).unwrap();
        for line in fields {
            let row = rows.next().unwrap().expect("a row for each");
            let named = columns.iter().zip(0..).filter(|(name, _)| line.get(*name).is_some() && *name != "varied");
            assert_eq!(named.clone().count(), fewest, "{table}: {columns:?}");
            for (name, place) in named {
                let (told, found) = (&line[name], row.get_ref(place).unwrap());
                let same = match found {
                    ValueRef::Null => told.is_null(),
                    ValueRef::Integer(n) => told.as_i64() == Some(n) || told.as_bool() == Some(n == 1),
                    ValueRef::Real(x) => told.as_f64() == Some(x),
                    ValueRef::Text(text) => told.as_str().map(str::as_bytes) == Some(text),
                    ValueRef::Blob(_) => false,
                };
                assert!(same, "{table}.{name}: {found:?}, and the line has {told}");
            }
        }
        assert!(rows.next().unwrap().is_none());
    }
}

#[test]
fn threads_do_every_run_once_and_the_first_error_ends_them() {
    let plan = plan();
    for jobs in [1, 3, 64] {
        let mut done = Vec::new();
        let to_do: Vec<usize> = (2..plan.runs()).collect();
        let mut keep = |record: Record| {
            done.push(record.run);
            Ok(())
        };
        pool::run(&plan, &to_do, jobs, &execute::single, &|| false, &mut keep, &mut || {}).unwrap();
        done.sort_unstable();
        assert_eq!(done, to_do, "{jobs} jobs");
    }
    let calls = AtomicUsize::new(0);
    let failing: &execute::Execute<'_> = &|run, _, _| {
        calls.fetch_add(1, SeqCst);
        Err(execute::failed(run, "no more memory"))
    };
    let all: Vec<usize> = (0..plan.runs()).collect();
    let error = pool::run(&plan, &all, 2, failing, &|| false, &mut |_| Ok(()), &mut || {}).unwrap_err();
    assert!(error.message.contains("no more memory") && error.hints[0].contains("shoal run "), "{error:?}");
    assert!(calls.load(SeqCst) < plan.runs(), "{calls:?}");
    // Interrupted before it begins, it does nothing, and that is no error.
    pool::run(&plan, &all, 2, failing, &|| true, &mut |_| panic!("no run has ended"), &mut || {}).unwrap();
}

#[test]
fn another_plan_is_refused_with_what_differs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a/b");
    drop(Directory::open(&path, &plan()).unwrap());
    let before = fs::read(path.join("sweep.json")).unwrap();
    let check = |other: Plan, words: &str| {
        let error = Directory::open(&path, &other).unwrap_err();
        assert_eq!(error.kind, ErrorKind::Usage, "{error}");
        assert!(error.message.contains("it holds another sweep") && error.message.contains(words), "{words}: {error}");
        assert!(error.hints[0].contains("--out"), "{error:?}");
    };
    check(Plan { seeds: vec![3], ..plan() }, "seeds: 3, 1 before, 3 now");
    check(Plan { planners: Vec::new(), ..plan() }, "planners: straight, amr-apf before, none now");
    check(Plan { set: Vec::new(), ..plan() }, "--set: defaults.speed_mps_max=1.5 before, none now");
    check(Plan { build: "c".to_owned(), ..plan() }, "another build of shoal");
    let mut changed = plan();
    changed.scenarios[0] = ScenarioSource::new("pair.toml", "name = \"changed\"");
    check(changed, "the text of scenario `pair.toml` has changed");
    assert_eq!(fs::read(path.join("sweep.json")).unwrap(), before);
    assert!(Directory::open(&path, &plan()).is_ok(), "the same plan goes on");
}

#[test]
fn what_is_not_a_sweep_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let check = |path: &Path, kind: ErrorKind, words: &str| {
        let error = Directory::open(path, &plan()).unwrap_err();
        assert_eq!(error.kind, kind, "{error}");
        assert!(error.message.contains(words) && !error.hints.is_empty(), "{words}: {error:?}");
    };
    fs::create_dir(at("foreign")).unwrap();
    fs::write(at("foreign/thesis.tex"), "years of work").unwrap();
    check(&at("foreign"), ErrorKind::Usage, "it is not that of a sweep: it holds `thesis.tex`");
    assert_eq!(fs::read_dir(at("foreign")).unwrap().count(), 1);
    fs::write(at("file"), "").unwrap();
    check(&at("file"), ErrorKind::Environment, "a file is in its place");
    check(&at("file/below"), ErrorKind::Environment, "a file is in its place");
    fs::create_dir(at("other")).unwrap();
    fs::write(at("other/sweep.json"), "{}").unwrap();
    check(&at("other"), ErrorKind::Usage, "its sweep.json is not that of a sweep");
    // Two at a time.
    let first = Directory::open(&at("shared"), &plan()).unwrap();
    check(&at("shared"), ErrorKind::Environment, "another sweep is writing to it");
    drop(first);
    // Lines that are whole, and wrong.
    let line = records(&Plan { scenarios: plan().scenarios[..1].to_vec(), ..plan() })[0].line();
    for (text, words) in [
        ("what is this\n".to_owned(), "line 1 cannot be used"),
        (format!("{line}\n{line}\n"), "line 2 cannot be used: run 0 is there twice"),
        (line.replace("\"seed\":3", "\"seed\":4") + "\n", "line 1 cannot be used: it is not run 0 of this sweep"),
        (line.replace("\"run\":0", "\"run\":999") + "\n", "it is not run 999 of this sweep"),
        (line.replace("sweep-run/1", "sweep-run/9") + "\n", "its schema is `shoal.sweep-run/9`"),
    ] {
        fs::write(at("shared/runs.jsonl"), &text).unwrap();
        check(&at("shared"), ErrorKind::Environment, words);
        assert_eq!(fs::read_to_string(at("shared/runs.jsonl")).unwrap(), text, "it is not changed");
    }
}
