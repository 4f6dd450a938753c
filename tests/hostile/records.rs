//! Records whose content was changed and whose checksum fits all the same.

use crate::counting::peak_of;
use crate::random::Random;
use model::Scenario;
use record::{Record, RecordError};
use scenarios::Overrides;
use std::ops::ControlFlow;
use view::{run::draw, scene::Scene};
use world_sim::World;
use world_sim::recorder::Recorder;

/// A mutant of a few kilobytes may take this much, bytes: mostly for its picture.
const PEAK_MAX: usize = 24 << 20;

fn scenario(name: &str, duration_s: f64) -> Scenario {
    let entry = ::scenarios::find_catalog(name).expect("it ships with shoal");
    let overrides = Overrides { duration_s: Some(duration_s), ..Overrides::default() };
    ::scenarios::parse(entry.name, entry.text, &overrides).expect("it is valid")
}

/// A record whose bytes are checked by no sum.
fn record(scenario: &Scenario) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a temporary directory");
    let path = folder.path().join("run.mcap");
    let mut recorder = Recorder::begin(&path, scenario).expect("a file");
    let mut world = World::new(scenario);
    world.keep_inputs();
    let show = &mut |world: &mut World| recorder.frame(world);
    let outcome = single::run_shown(scenario, world, show, &mut |_, _| ControlFlow::Continue(()));
    recorder.finish(&outcome.expect("it runs")).expect("a record");
    record::unpacked(&std::fs::read(path).expect("the record")).expect("it is whole")
}

/// One to four changes behind the head of the file: to single bytes, to numbers, of lengths.
fn mutant(whole: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    for _ in 0..=random.below(4) {
        let at = 40 + random.below(bytes.len() - 56);
        match random.below(6) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.below(256) as u8,
            2 => bytes[at] = 0xff,
            3 => {
                let until = (at + 1 + random.below(12)).min(bytes.len() - 16);
                bytes[at..until].fill([0xff, 0x00, 0x7f][random.below(3)]);
            }
            4 => drop(bytes.drain(at..(at + 1 + random.below(16)).min(bytes.len() - 16))),
            _ => {
                let again = bytes[at..(at + 1 + random.below(200)).min(bytes.len() - 16)].to_vec();
                bytes.splice(at..at, again);
            }
        }
    }
    bytes
}

/// Reads everything that there is and draws it.
fn draw_all(bytes: Vec<u8>) -> Result<usize, RecordError> {
    let record = Record::read(bytes)?;
    for input in record.inputs() {
        input?;
    }
    let mut from = record.frames_from(7);
    while from.next()?.is_some() {}
    Ok(draw(&Scene::of(&record)?).len())
}

#[test]
fn mutants_of_records_are_refused_or_drawn_in_bounded_memory() {
    for name in ["moving-obstacles", "tasks", "arm-1"] {
        let whole = record(&scenario(name, 0.4));
        let (drawn, peak) = peak_of(|| draw_all(whole.clone()));
        drawn.unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(peak < PEAK_MAX, "{name}: {peak} bytes");
        let (mut read, seeds) = (0, 1..=800_u64);
        for seed in seeds.clone() {
            let bytes = mutant(&whole, &mut Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
            let length = bytes.len();
            let (drawn, peak) = peak_of(|| draw_all(bytes));
            assert!(peak < PEAK_MAX, "{name}, seed {seed}: {peak} bytes for a record of {length}");
            read += usize::from(drawn.is_ok());
        }
        // Else nothing was tried but refusals.
        assert!((50..780).contains(&read), "{name}: {read} of {seeds:?} were read");
    }
}

/// A file that says that it is large is not believed, and one that is large is not read as a whole.
#[test]
fn a_large_file_costs_what_is_in_it() {
    let folder = tempfile::tempdir().expect("a temporary directory");
    let path = folder.path().join("run.mcap");
    let whole = record(&scenario("tasks", 0.4));
    // The last chunk but for its end, and behind it nothing, twenty gigabytes of it.
    let outcome = whole.windows(11).position(|part| part == b"outcome.bin").expect("it is there");
    for (bytes, what) in [(&whole[..outcome + 40], "cut"), (&[][..], "empty")] {
        std::fs::write(&path, bytes).expect("a file");
        let file = std::fs::File::options().write(true).open(&path).expect("a file");
        file.set_len(20 << 30).expect("a hole");
        let (opened, peak) = peak_of(|| Record::open(&path).map(|record| record.is_whole()));
        assert!(!opened.unwrap_or(false) && peak < PEAK_MAX, "{what}: {peak} bytes");
    }
}
