//! The verbs that draw, compare and measure.

use crate::support::{Here, shoal};
use serde_json::Value;
use shoal_tests::process::{Ended, Place, parent_of, text_of, wait_for};
use std::path::Path;

fn json(ended: &Ended) -> Value {
    serde_json::from_str(&ended.stdout).unwrap_or_else(|error| panic!("{error}\n{ended}"))
}

/// A picture that a browser would show: every tag that is opened is closed, and every number is one.
fn check_picture(svg: &str) {
    assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"), "{svg:.200}");
    let opened = svg.matches('<').count() - svg.matches("</").count();
    assert_eq!(opened, svg.matches("/>").count() + svg.matches("</").count(), "{svg:.200}");
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg:.200}");
}

fn text(path: &Path) -> String {
    text_of(path).unwrap_or_else(|| panic!("{} is not there", path.display()))
}

#[test]
fn a_recorded_run_can_be_drawn() {
    let here = Here::new();
    for name in shoal_tests::catalog_names() {
        let ended = here.shoal(&format!("run {name} --mode single --record run.mcap --report run.json --duration 3s"));
        assert!(matches!(ended.code, Some(0 | 1 | 4)), "{ended}");
        let ended = here.shoal("plot run.mcap");
        assert_eq!((ended.code, ended.stdout.as_str()), (Some(0), "run.svg\n"), "{ended}");
        let picture = text(&here.path().join("run.svg"));
        check_picture(&picture);
        let report: Value = serde_json::from_str(&text(&here.path().join("run.json"))).expect("JSON");
        let robots = report["per_robot"].as_array().expect("a list");
        for robot in robots.iter().filter(|robot| robots.len() <= 20 && robot["gone"] != "never-joined") {
            let id = robot["id"].as_str().expect("a name");
            assert!(picture.contains(&format!("\n{id}\n")), "{name}: no {id}");
        }
        // The report leads to its record, and standard output takes the same picture.
        for line in ["plot run.json --out -", "plot run.mcap --out -"] {
            assert_eq!(here.shoal(line).stdout, picture, "{name}: {line}");
        }
        let ended = here.shoal("plot run.mcap --out other.svg");
        assert_eq!((ended.code, text(&here.path().join("other.svg")) == picture), (Some(0), true), "{ended}");
    }
}

#[test]
fn contacts_are_in_the_picture() {
    let here = Here::new();
    here.shoal("run head-on --mode single --planner straight --record run.mcap");
    let picture = here.shoal("plot run.mcap --out -").stdout;
    assert!(picture.contains("1 contact ") && picture.contains("\ncontact\n"), "{picture}");
    here.shoal("run head-on --mode single --record run.mcap");
    let picture = here.shoal("plot run.mcap --out -").stdout;
    assert!(picture.contains("no contact") && !picture.contains("\ncontact\n"), "{picture}");
}

/// A record is cut anywhere: where no frame is left of it, nothing was compared, and nothing is called equal.
#[test]
fn a_record_without_frames_is_not_equal_to_anything() {
    let here = Here::new();
    here.shoal("run head-on --mode single --record run.mcap");
    let whole = std::fs::read(here.path().join("run.mcap")).expect("the record");
    let mut seen = [0, 0];
    for part in 1..=8 {
        here.file("cut.mcap", &whole[..whole.len() * part / 8]);
        let ended = here.shoal("replay cut.mcap --verify --format json");
        let Ok(document) = serde_json::from_str::<serde_json::Value>(&ended.stdout) else {
            assert_eq!(ended.code, Some(2), "{ended}");
            continue;
        };
        let has_frames = document["verdict"]["frames"].as_u64() > Some(0);
        assert_eq!((ended.code, &document["equal"]), (Some(i32::from(!has_frames)), &has_frames.into()), "{ended}");
        seen[usize::from(has_frames)] += 1;
        let text = here.shoal("replay cut.mcap --verify").stdout;
        assert_eq!(text.contains("nothing to compare"), !has_frames, "{text}");
    }
    assert!(seen[0] > 0 && seen[1] > 0, "{seen:?}");
}

/// (what there is to draw, what the message must name)
#[test]
fn what_cannot_be_drawn_is_refused() {
    let here = Here::new();
    here.shoal("run head-on --mode single --record whole.mcap --report whole.json");
    here.shoal("run head-on --mode single --report alone.json");
    let whole = std::fs::read(here.path().join("whole.mcap")).expect("the record");
    here.file("begun.mcap", &whole[..1000]);
    here.file("foreign.mcap", b"\x7fELF and so on");
    here.file("empty.mcap", b"");
    let at = |part: &[u8]| whole.windows(part.len()).position(|window| window == part).expect("it is there");
    // In the middle of the largest part of the file, which is a chunk with frames.
    let (mut place, mut largest) = (8, 8..8);
    while let Some(length) = whole.get(place + 1..place + 9) {
        let end = place + 9 + u64::from_le_bytes(length.try_into().expect("eight bytes")) as usize;
        if whole[place] == 6 && end - place > largest.len() {
            largest = place..end;
        }
        place = end;
    }
    let mut changed = whole.clone();
    changed[largest.start + largest.len() / 2] ^= 1;
    here.file("changed.mcap", &changed);
    let mut changed = whole.clone();
    changed[at(b"\x06\0\0\0format\x01\0\0\0") + 14] = b'9';
    here.file("newer.mcap", &changed);
    here.file("older.mcap", b"SHOALREC\x08\0\0\0and so on");
    here.file("my.toml", "[[robot]]\nid = \"a\"\nstart_m = [0, 0]\ngoal_m = [5, 0]\n");
    let mut all = String::new();
    let check = |all: &mut String, file: &str, names: &[&str]| {
        let ended = here.shoal(&format!("plot {file}"));
        assert_eq!((ended.code, ended.stdout.as_str()), (Some(2), ""), "{ended}");
        assert!(ended.stderr.starts_with("error: ") && ended.stderr.contains("\nhint: "), "{ended}");
        names.iter().for_each(|name| assert!(ended.stderr.contains(name), "`{name}` is not in {ended}"));
        all.push_str(&format!("$ shoal plot {file}\n{}\n", ended.stderr));
    };
    check(&mut all, "begun.mcap", &["begun.mcap", "cut off"]);
    check(&mut all, "foreign.mcap", &["foreign.mcap", "not a record", "--record"]);
    check(&mut all, "empty.mcap", &["not a record"]);
    check(&mut all, "changed.mcap", &["damaged"]);
    let reads = format!("reads version {}", record::FORMAT);
    check(&mut all, "newer.mcap", &["version 9", &reads]);
    check(&mut all, "older.mcap", &["older shoal", "record the run again"]);
    check(&mut all, "nothing.mcap", &["nothing.mcap", "No such file"]);
    check(&mut all, "alone.json", &["not recorded", "--record"]);
    check(&mut all, "my.toml", &["not a record", "shoal run my.toml --record"]);
    check(&mut all, "head-on", &["shoal run head-on --record"]);
    // The report remains, its record is now another one's.
    here.shoal("run head-on --mode single --planner straight --record whole.mcap");
    let ended = here.shoal("plot whole.json");
    assert_eq!(ended.code, Some(2), "{ended}");
    assert!(ended.stderr.contains("another run"), "{ended}");
    insta::assert_snapshot!(all);
    let ended = here.shoal("plot whole.mcap --out no/such/folder.svg");
    assert_eq!(ended.code, Some(3), "{ended}");
    assert!(ended.stderr.contains("picture `no/such/folder.svg`") && ended.stderr.contains("mkdir -p"), "{ended}");
}

#[test]
fn records_without_a_place() {
    let here = Here::new();
    let mut all = String::new();
    for place in ["nowhere/out.mcap", ".", "/dev/null"] {
        let ended = here.shoal(&format!("run head-on --mode single --record {place}"));
        assert_eq!((ended.code, ended.stdout.as_str()), (Some(3), ""), "{ended}");
        all += &ended.stderr;
    }
    insta::assert_snapshot!(all);
}

/// Every row has what a reader needs, and the exit code is what the rows say.
#[test]
fn a_paper_is_reproduced() {
    let here = Here::new();
    let ended = here.shoal("reproduce decentralized-apf --runs 0 --out figures --format json");
    let document = json(&ended);
    assert_eq!(document["schema"], "shoal.reproduce/2", "{ended}");
    let rows = document["rows"].as_array().expect("a list");
    assert!(rows.len() > 50 && rows.iter().all(|row| row["paper"] == "decentralized-apf"), "{ended}");
    let paper = &document["papers"][0];
    for verdict in ["paper", "specification", "differs", "no-evidence"] {
        let of = rows.iter().filter(|row| row["verdict"] == verdict).count();
        assert_eq!(paper["verdicts"][verdict], of, "{ended}");
    }
    // One row differs, which is known: the exit code says that nothing unknown does.
    let differs: Vec<&Value> = rows.iter().filter(|row| row["verdict"] == "differs").collect();
    assert_eq!((differs.len(), &differs[0]["named"]), (1, &true.into()), "{ended}");
    assert_eq!(paper["differs_named"][0], differs[0]["item"], "{ended}");
    assert_eq!(ended.code, Some(0), "{ended}");
    let headlines = paper["headlines"].as_array().expect("a list");
    assert_eq!(headlines.len(), 2, "{ended}");
    assert!(
        headlines.iter().all(|claim| claim["sentence"].as_str().is_some_and(|text| text.ends_with('.'))),
        "{ended}"
    );
    assert_eq!(document["exit_code"].as_i64(), ended.code.map(i64::from));
    let figures = document["figures"].as_array().expect("a list");
    assert!(!figures.is_empty());
    for name in figures.iter().filter_map(Value::as_str) {
        let text = text(&here.path().join("figures").join(name));
        match name.ends_with(".svg") {
            true => check_picture(&text),
            false => assert!(text.starts_with("line,") && text.lines().count() > 2, "{name}: {text}"),
        }
    }
    let ended = here.shoal("reproduce decentralized-apf --runs 0");
    assert!(ended.stdout.lines().all(|line| line.chars().count() <= 80), "{ended}");
    let summary = format!("decentralized-apf: {} rows: paper 1, specification {}", rows.len(), rows.len() - 2);
    assert!(ended.stdout.contains(&summary), "{summary}: {}", ended.stdout);
    // The headline claims come first.
    let (claims, table) = (ended.stdout.find("DIFFERS The law"), ended.stdout.find("\nitem "));
    assert!(claims.is_some() && claims < table, "{ended}");
}

/// One row in full, found by a part of its name; a part of several names, or of none, is an error that lists them.
#[test]
fn a_row_is_explained() {
    let here = Here::new();
    let ended = here.shoal("reproduce decentralized-apf --explain avoided");
    assert_eq!(ended.code, Some(0), "{ended}");
    assert!(ended.stdout.lines().all(|line| line.chars().count() <= 80), "{ended}");
    insta::assert_snapshot!(ended.stdout);
    let ended = here.shoal("reproduce decentralized-apf --runs 0 --format json --explain recommended");
    assert_eq!((ended.code, ended.stdout.as_str()), (Some(2), ""), "{ended}");
    assert!(ended.stderr.contains("rows contain `recommended`"), "{ended}");
    let ended = here.shoal("reproduce decentralized-apf --format json --explain apf_two_disc_trap,");
    let row = json(&ended)["row"].clone();
    for key in ["item", "ours", "specification", "tolerance", "verdict", "source", "method", "why"] {
        assert!(row[key].as_str().is_some_and(|text| !text.is_empty()), "{key}: {row:#}");
    }
    let ended = here.shoal("reproduce decentralized-apf --runs 0 --explain nonsense");
    assert_eq!(ended.code, Some(2), "{ended}");
    assert!(ended.stderr.contains("no row contains `nonsense`"), "{ended}");
}

/// As real processes the fleets of a paper do what they do in one thread.
#[test]
fn a_paper_with_its_fleets() {
    let _place = Place::take();
    let document = json(&shoal("reproduce decentralized-apf --runs 1 --format json"));
    let rows = document["rows"].as_array().expect("a list").iter();
    let fleets: Vec<&Value> = rows.filter(|row| row["item"].as_str().unwrap_or("").contains("in lockstep")).collect();
    assert!(fleets.len() > 20);
    fleets.iter().for_each(|row| assert_eq!(row["verdict"], "specification", "{row:#}"));
}

/// Long work can be broken off: what there is is printed.
#[test]
fn reproduction_can_be_interrupted() {
    let here = Here::new();
    let running = here.run("reproduce --format json").start();
    // From here on it minds the signal.
    let minds = |status: String| {
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"))?;
        let caught = u64::from_str_radix(caught.trim(), 16).ok()?;
        (caught & (1 << (rustix::process::Signal::INT.as_raw() - 1)) != 0).then_some(())
    };
    wait_for("its handler", || text_of(format!("/proc/{}/status", running.pid())).and_then(minds));
    running.signal(rustix::process::Signal::INT);
    let ended = running.end();
    assert_eq!(ended.code, Some(130), "{ended}");
    let document = json(&ended);
    assert_eq!((&document["interrupted"], &document["exit_code"]), (&true.into(), &130.into()), "{ended}");
    let papers = document["papers"].as_array().expect("a list");
    assert_eq!(papers.last().map(|paper| &paper["complete"]), Some(&false.into()), "{ended}");
}

/// The bench of the loop stops its fleet again and again. Interrupted, it lets the fleet run to its end, and does not report
/// its own stops as events.
#[test]
fn the_bench_of_the_loop_can_be_interrupted() {
    let _place = Place::take();
    let here = Here::new();
    let running = here.run("bench loop --robots 2 --planner straight --ticks 100000000 --format json").start();
    let is_stopped_world = |process: &str| {
        let pid = process.parse().ok().filter(|pid| parent_of(*pid) == Some(running.pid()))?;
        let world = text_of(format!("/proc/{pid}/cmdline"))?.contains("world");
        let stopped = text_of(format!("/proc/{pid}/status"))?.contains("State:\tT");
        (world && stopped).then_some(())
    };
    wait_for("a turn of the barrier", || {
        let mut processes = std::fs::read_dir("/proc").ok()?.flatten();
        processes.find_map(|process| is_stopped_world(process.file_name().to_str()?))
    });
    running.signal(rustix::process::Signal::INT);
    let ended = running.end();
    assert_eq!((ended.code, &json(&ended)["interrupted"]), (Some(130), &true.into()), "{ended}");
    assert!(!ended.stderr.contains("the world's process"), "{ended}");
}

#[test]
fn plans_are_timed() {
    let document = json(&shoal("bench planners straight rpoa liquid --plans 5 --format json"));
    let cells = document["cells"].as_array().expect("a list");
    assert_eq!(cells.len(), 3 * (2 * 4 + 1));
    let targets = document["verdicts"].as_array().expect("a list");
    assert_eq!(targets.len(), 3, "{document:#}");
    assert_eq!(targets[1]["target"]["median_us"], 25.0, "{document:#}");
    assert!(targets[2]["target"]["slice_us"].is_f64(), "{document:#}");
    for cell in cells {
        assert_eq!(cell["plans"], 5, "{cell:#}");
        assert!(cell["p50_us"].as_f64() <= cell["p99_us"].as_f64(), "{cell:#}");
    }
    let ended = shoal("bench planners straight --plans 5");
    assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{ended}");
    assert!(ended.stdout.contains("straight") && ended.stdout.lines().all(|l| l.chars().count() <= 80), "{ended}");
}
