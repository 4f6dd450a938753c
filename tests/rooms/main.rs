//! The rooms of the workspace: which crate may depend on which, that no modules of a crate depend on each other in a
//! circle, and which names stay in their room. Reads the sources; `cargo test -p shoal-tests --test rooms -- --nocapture`
//! prints the picture of the dependencies.

mod planted;
mod source;

use source::{Crate, circles, code_of, manifest_dependencies, workspace_root};
use std::collections::{BTreeMap, BTreeSet};

/// The crates in the order of the data flow: each depends on some of those above it, and on no other.
const ROOMS: [&str; 22] = [
    "geometry",
    "model",
    "dynamics",
    "planners",
    "scenarios",
    "protocol",
    "record",
    "bus",
    "world-sim",
    "robot-agent",
    "single",
    "replay",
    "reproduce",
    "report",
    "view",
    "watch",
    "web",
    "top",
    "sweep",
    "daemon",
    "cli",
    "tests",
];

/// Workspaces of their own, whose names are looked at as well.
const OUTSIDE: [&str; 2] = ["python", "capi"];

/// What a crate may depend on of the crates above it, where that is less than all.
const ONLY: [(&str, &[&str]); 13] = [
    ("geometry", &[]),
    ("model", &["geometry"]),
    ("dynamics", &["geometry", "model"]),
    ("planners", &["geometry", "model"]),
    ("scenarios", &["geometry", "model", "planners"]),
    ("protocol", &["geometry", "model"]),
    ("record", &["geometry", "model", "protocol"]),
    ("bus", &["model", "protocol"]),
    ("world-sim", &["geometry", "model", "dynamics", "protocol", "record", "bus"]),
    ("robot-agent", &["geometry", "model", "planners", "protocol", "bus"]),
    ("single", &["model", "protocol", "robot-agent", "world-sim"]),
    ("replay", &["model", "protocol", "record", "robot-agent", "world-sim"]),
    ("sweep", &["model", "scenarios", "world-sim", "single", "report", "view"]),
];

/// Names that only these crates may write, and files if a room is larger than it should be.
const NAMES: [(&str, &[&str]); 20] = [
    ("pyo3", &["python"]),
    ("numpy", &["python"]),
    ("clap_complete", &["cli"]),
    ("clap_mangen", &["cli"]),
    ("clap", &["cli"]),
    ("png", &["scenarios/src/map/picture.rs"]),
    ("rapier2d_f64", &["dynamics"]),
    ("plotters", &["view"]),
    ("bincode", &["protocol/src/codec.rs"]),
    ("iceoryx2", &["bus", "protocol"]),
    ("mcap", &["record/src/container.rs"]),
    ("toml", &["scenarios"]),
    ("rusqlite", &["daemon/src/service/store.rs", "sweep/src/database.rs"]),
    ("axum", &["web"]),
    ("tokio", &["web"]),
    ("ratatui", &["top"]),
    ("report::exit", &["cli"]),
    (
        "std::time",
        &[
            "bus",
            "daemon",
            "cli",
            "robot-agent",
            "world-sim",
            "watch",
            "web",
            "top",
            "record/src/sink.rs",
            "sweep/src/pool.rs",
            "python",
        ],
    ),
    (
        "std::fs",
        &[
            "bus",
            "daemon",
            "cli",
            "robot-agent",
            "world-sim",
            "watch",
            "record/src/sink.rs",
            "record/src/source.rs",
            "record/src/identity.rs",
            "sweep/src/directory.rs",
            "python",
            "sweep/src/database.rs",
        ],
    ),
    ("std::process", &["bus", "daemon", "cli", "robot-agent", "world-sim", "record/src/sink.rs"]),
];

#[test]
#[expect(clippy::print_stdout, reason = "the picture of the dependencies, for who asks for it")]
fn crates_depend_one_way() {
    let root = workspace_root();
    let only: BTreeMap<&str, &[&str]> = ONLY.into_iter().collect();
    let mut wrong = Vec::new();
    for (place, room) in ROOMS.iter().enumerate() {
        let found = manifest_dependencies(&root.join(room), &ROOMS);
        println!("{room:<12} <- {}", found.iter().cloned().collect::<Vec<_>>().join(", "));
        for dependency in found {
            let above = ROOMS[..place].contains(&dependency.as_str());
            let allowed = only.get(room).is_none_or(|only| only.contains(&dependency.as_str()));
            if !above || !allowed {
                wrong.push(format!("{room} depends on {dependency}"));
            }
        }
    }
    assert_eq!(wrong, Vec::<String>::new());
}

#[test]
fn no_modules_depend_on_each_other_in_a_circle() {
    let root = workspace_root();
    let mut found = Vec::new();
    for room in ROOMS.iter().filter(|room| **room != "tests") {
        for circle in circles(&Crate::read(&root.join(room).join("src")).arrows()) {
            found.push(format!("{room}: {}", circle.join(" <-> ")));
        }
    }
    assert_eq!(found, Vec::<String>::new());
}

#[test]
fn names_stay_in_their_rooms() {
    let root = workspace_root();
    let mut found = BTreeSet::new();
    for room in ROOMS.iter().filter(|room| **room != "tests").chain(&OUTSIDE) {
        for (file, code) in code_of(&root.join(room).join("src")) {
            for (name, rooms) in NAMES {
                let here = format!("{room}/src/{file}");
                let at_home = rooms.iter().any(|home| home == room || *home == here);
                if !at_home && names(&code, name) {
                    found.insert(format!("{here} names {name}"));
                }
            }
        }
    }
    assert_eq!(found, BTreeSet::new());
}

/// Whether code names this crate or module, not only something whose name begins or ends like it.
fn names(code: &str, name: &str) -> bool {
    let in_a_word = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let path = format!("{name}::");
    code.match_indices(&path).any(|(at, _)| !code[..at].ends_with(in_a_word))
        || code.lines().any(|line| line.trim() == format!("use {name};"))
}

#[test]
fn a_circle_is_noticed() {
    let arrows = |pairs: &[(&str, &str)]| -> BTreeMap<String, BTreeSet<String>> {
        let mut arrows = BTreeMap::<String, BTreeSet<String>>::new();
        for (from, to) in pairs {
            arrows.entry((*from).to_owned()).or_default().insert((*to).to_owned());
        }
        arrows
    };
    assert!(circles(&arrows(&[("a", "b"), ("b", "c"), ("a", "c")])).is_empty());
    assert_eq!(circles(&arrows(&[("a", "b"), ("b", "c"), ("c", "a"), ("d", "a")])), [["a", "b", "c"]]);
    let crate_of = |files: &[(&str, &str)]| Crate::of(files.iter().map(|(f, c)| ((*f).to_owned(), (*c).to_owned())));
    let files = [
        ("lib.rs", "mod a; mod b; pub use b::Noun;"),
        ("a.rs", "use crate::Noun;"),
        ("b/inner.rs", "use super::{self, super::a::{verb, other}};"),
        ("b.rs", "mod inner;"),
    ];
    assert_eq!(circles(&crate_of(&files).arrows()), [["a", "b"]], "through a name of the root, and out of a submodule");
    assert!(names("use clap::Parser;", "clap") && !names("use flapclap::Parser; my::clap::x", "clap"));
}

/// The walks of ARCHITECTURE.md, each step with the file that does it: the files exist, and there are no more than this.
#[test]
fn the_walks_of_the_architecture_are_short_and_lead_through_files_that_exist() {
    let root = workspace_root();
    let text = source::read(&root.join("ARCHITECTURE.md"));
    for (title, most) in [("### A task, from the command line to the planner and back", 12), ("### A pose", 9)] {
        let begin = text.find(title).unwrap_or_else(|| panic!("no section `{title}`"));
        let rest = &text[begin + title.len()..];
        let walk = &rest[..rest.find("\n#").unwrap_or(rest.len())];
        let steps = walk.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit()));
        assert!(steps.count() <= 10, "{title}: more than ten steps");
        let files: BTreeSet<&str> =
            walk.split('`').filter(|word| word.ends_with(".rs") && word.contains('/')).collect();
        let missing: Vec<&&str> = files.iter().filter(|file| !root.join(file).is_file()).collect();
        assert!(missing.is_empty() && files.len() > 4, "{title}: {missing:?}");
        assert!(files.len() <= most, "{title}: {} files, {files:?}", files.len());
    }
}
