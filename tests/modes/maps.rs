//! Worlds from maps as real processes: the same hash as in one thread, the map in the record, and on time in `realtime`.

use crate::support::{SHOAL, deterministic, report, report_of, shoal};
use shoal_tests::process::Run;

fn example(name: &str) -> String {
    format!("{}/../examples/maps/{name}", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn single_and_lockstep_drive_the_same() {
    for words in ["office.toml", "office.toml --set defaults.knows_map=false", "rooms.toml --robots 4"] {
        let run = |mode| report(&format!("{} --duration 20s --mode {mode}", example(words)));
        let (single, lockstep) = (run("single"), run("lockstep"));
        assert_eq!(single["trajectory_hash"], lockstep["trajectory_hash"], "{words}");
        assert_eq!(deterministic(&single), deterministic(&lockstep), "{words}");
    }
}

/// The record of a run holds the map: it is verified, drawn and read where the files are not.
#[test]
fn a_record_needs_no_other_file() {
    let folder = tempfile::tempdir().expect("a temporary directory");
    for file in ["office.toml", "office.yaml", "office.pgm"] {
        std::fs::copy(example(file), folder.path().join(file)).expect("it is there");
    }
    let scenario = folder.path().join("office.toml");
    let records = ["single", "lockstep", "realtime"].map(|mode| folder.path().join(format!("{mode}.mcap")));
    for (mode, record) in ["single", "lockstep", "realtime"].iter().zip(&records) {
        let words = format!("{} --duration 5s --mode {mode} --record {}", scenario.display(), record.display());
        let report = report_of(&shoal(&words));
        assert_eq!(report["outcome"]["contacts"]["obstacles"].as_u64().unwrap_or(0), 0, "{report:#}");
    }
    std::fs::remove_file(folder.path().join("office.pgm")).expect("it was there");
    let ended = Run::new(SHOAL).words(&format!("validate {}", scenario.display())).end();
    assert!(ended.code == Some(2) && ended.stderr.contains("`office.yaml`: `office.pgm`: file not found"), "{ended}");
    for record in &records {
        let ended = Run::new(SHOAL).words(&format!("replay {} --verify", record.display())).end();
        assert_eq!(ended.code, Some(0), "{ended}");
        let picture = record.with_extension("svg");
        let ended = Run::new(SHOAL).words(&format!("plot {} --out {}", record.display(), picture.display())).end();
        #[expect(clippy::disallowed_methods, reason = "the picture")]
        let text = std::fs::read_to_string(&picture).unwrap_or_else(|error| panic!("{error}: {ended}"));
        assert!(text.contains("wall of the map"), "{ended}");
    }
}
