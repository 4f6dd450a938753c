//! Records as a whole: what was written, and what is read of it, whole, cut and damaged.

use crate::error::Cut;
use crate::header::{Ending, FORMAT};
use crate::moment::{Added, InputSource, Moment};
use crate::reader::Record;
use crate::writer::{Gap, RecordWriter};
use crate::{Body, RecordError};
use model::{Event, EventKind, Outcome, RobotIndex, RobotInstance, Scenario};

pub(crate) fn scenario() -> Scenario {
    let entry = scenarios::find_catalog("head-on").unwrap();
    scenarios::parse(entry.name, entry.text, &scenarios::Overrides::default()).unwrap()
}

/// Robots that drive, one that comes late, an obstacle, events and inputs.
pub(crate) fn moment(tick: u64) -> Moment {
    let t = tick as f64 * 0.02;
    let robot = |index: u32| Body {
        index,
        position_m: [t.sin() + f64::from(index), t.cos()],
        yaw_rad: t,
        goal_m: [4.0, f64::from(index)],
        ..Body::default()
    };
    let obstacle = Body { index: 0, flags: 1, position_m: [0.1 * t, 0.0], ..Body::default() };
    let mut moment = Moment { tick, arrived: (tick / 100) as u32, contacts: tick / 10, ..Moment::default() };
    moment.bodies.extend([robot(0), robot(1)]);
    if tick >= 60 {
        moment.bodies.push(robot(2));
    }
    moment.bodies.push(obstacle);
    if tick == 60 {
        let robot = model::Robot { id: "late".to_owned(), ..scenario().template };
        moment.added.push(Added { tick, index: RobotIndex(2), robot });
    }
    if tick % 25 == 3 {
        moment.events.push(Event { tick, robot: Some(RobotIndex(1)), kind: EventKind::OffGoal { distance_m: t } });
    }
    let source = InputSource::Robot(RobotInstance { index: RobotIndex(1), incarnation: 3 });
    moment.input(tick, InputSource::World, &tick.to_le_bytes());
    if tick.is_multiple_of(3) {
        moment.input(tick.saturating_sub(1), source, b"heard");
    }
    moment
}

const TICKS: u64 = 200;

fn ending() -> Ending {
    Ending { outcome: Outcome { ticks: TICKS, trajectory_hash: 0xabc, ..Outcome::default() } }
}

/// A record with a chunk every 20 ticks.
fn bytes() -> Vec<u8> {
    let mut writer = RecordWriter::begin(Vec::new(), &scenario()).unwrap();
    for tick in 0..=TICKS {
        writer.moment(&moment(tick), Gap::default()).unwrap();
        if tick % 20 == 19 {
            writer.end_chunk().unwrap();
        }
    }
    writer.finish(&ending(), Gap::default()).unwrap()
}

/// Ticks and bodies from a tick on.
fn frames(record: &Record, from: u64) -> Result<Vec<(u64, Vec<Body>)>, RecordError> {
    let (mut frames, mut all) = (record.frames_from(from), Vec::new());
    while let Some(frame) = frames.next()? {
        let expected = moment(frame.tick);
        assert_eq!((frame.arrived, frame.contacts), (expected.arrived, expected.contacts));
        all.push((frame.tick, frame.bodies.to_vec()));
    }
    Ok(all)
}

fn expected(ticks: std::ops::RangeInclusive<u64>) -> Vec<(u64, Vec<Body>)> {
    ticks.map(|tick| (tick, moment(tick).bodies)).collect()
}

#[test]
fn what_is_written_is_read_to_the_last_bit_from_any_tick() {
    let record = Record::read(bytes()).unwrap();
    assert!(record.is_whole() && record.left_out() == 0);
    assert_eq!((record.scenario(), record.ending()), (&scenario(), Some(&ending())));
    assert_eq!(record.about().version, env!("CARGO_PKG_VERSION"));
    assert_eq!(record.about().seed, scenario().clock.seed.to_string());
    for from in [0, 1, 19, 20, 21, 100, 199, 200] {
        assert_eq!(frames(&record, from).unwrap(), expected(from..=TICKS), "from tick {from}");
    }
    assert_eq!(frames(&record, TICKS + 1).unwrap(), []);
    let events: Vec<Event> = (0..=TICKS).flat_map(|tick| moment(tick).events).collect();
    assert_eq!(record.events(), events);
    let own: Vec<&str> = record.robots().map(|(_, robot)| robot.id.as_str()).collect();
    assert_eq!((own.len(), own.last()), (3, Some(&"late")));
    assert_eq!(record.robot_at(RobotIndex(2), 59), None);
    assert_eq!(record.robot_at(RobotIndex(2), 60), record.robot(RobotIndex(2)));
    assert_eq!(record.robot(RobotIndex(0)), scenario().robots.first());
    assert_eq!(record.robot(RobotIndex(8)), None);
}

#[test]
fn what_processes_were_told_comes_back_as_it_was() {
    let record = Record::read(bytes()).unwrap();
    let told: Vec<_> = record.inputs().map(|input| input.unwrap()).map(|i| (i.tick, i.source, i.bytes)).collect();
    let mut expected = Vec::new();
    for moment in (0..=TICKS).map(moment) {
        let mut from = 0;
        for (tick, source, until) in &moment.inputs {
            expected.push((*tick, *source, moment.input_bytes[from..*until].to_vec()));
            from = *until;
        }
    }
    assert_eq!(told, expected);
}

/// At 200 places and more: everything up to the last whole chunk, and that it is cut.
#[test]
fn a_record_that_is_cut_anywhere_is_read_to_its_last_whole_chunk() {
    let whole = bytes();
    let mut begun = 0;
    let mut lengths: Vec<usize> = (0..240).map(|i| i * whole.len() / 240).collect();
    lengths.extend([1, 7, 8, 9, whole.len() - 1]);
    lengths.sort_unstable();
    let mut last = 0;
    for length in lengths {
        match Record::read(whole[..length].to_vec()) {
            Err(error) => {
                let expected = if length == 0 { "not a record" } else { "nothing of it can be read" };
                assert!(error.to_string().contains(expected) && last == 0, "{length}: {error}");
            }
            Ok(record) => {
                assert!(matches!(record.cut(), Some(Cut::Ends(at)) if *at <= length as u64), "{length}: {record:?}");
                let frames = frames(&record, 0).unwrap();
                // Chunks have twenty frames, the last one has one.
                assert!(frames.len().is_multiple_of(20) || frames.len() as u64 == TICKS + 1, "{}", frames.len());
                assert!(frames.len() >= last && frames == expected(0..=TICKS)[..frames.len()], "{length}");
                last = frames.len();
                let until = last as u64;
                let events = (0..until).flat_map(|tick| moment(tick).events).collect::<Vec<_>>();
                assert_eq!(record.events(), events, "{length}");
                assert_eq!(record.robot(RobotIndex(2)).is_some(), last > 60, "{length}: who came late is known");
                begun += 1;
            }
        }
    }
    assert!(begun > 100 && last as u64 == TICKS + 1, "{begun} {last}");
}

#[test]
fn what_is_damaged_or_something_else_is_refused_where_it_matters() {
    let whole = bytes();
    let check = |bytes: Vec<u8>, words: &str| {
        let error = Record::read(bytes).unwrap_err().to_string();
        assert!(error.contains(words), "{words}: {error}");
    };
    check(b"{ \"schema\": \"shoal.report/1\" }".to_vec(), "not a record");
    check(b"SHOALREC\x08\0\0\0".to_vec(), "older shoal");
    let renamed = |from: &[u8], to: &[u8]| {
        let at = whole.windows(from.len()).position(|window| window == from).unwrap();
        [&whole[..at], to, &whole[at + from.len()..]].concat()
    };
    check(renamed(b"shoal 0", b"other 0"), "not a record of shoal");
    let format = format!("\x06\0\0\0format\x01\0\0\0{FORMAT}");
    check(renamed(format.as_bytes(), b"\x06\0\0\0format\x01\0\0\x009"), "format version 9");
    // A bit anywhere: what is read is what was written, and most places are noticed.
    let (mut refused, mut cut, mut damaged, mut unnoticed) = (0, 0, 0, 0);
    for at in (8..whole.len()).step_by(61) {
        let mut changed = whole.clone();
        changed[at] ^= 4;
        match Record::read(changed) {
            Err(_) => refused += 1,
            Ok(record) => match frames(&record, 0) {
                Ok(read) => {
                    assert!(read == expected(0..=TICKS)[..read.len()], "byte {at}");
                    if record.is_whole() { unnoticed += 1 } else { cut += 1 }
                }
                Err(error) => {
                    assert!(matches!(error, RecordError::Damaged(_)), "byte {at}: {error}");
                    damaged += 1;
                }
            },
        }
    }
    let counts = format!("{refused} refused, {cut} cut, {damaged} damaged, {unnoticed} unnoticed");
    assert!(refused > 0 && cut > 0 && damaged > 0, "{counts}");
}

/// Bytes of a length that says that something is larger than the file.
#[test]
fn lengths_that_cannot_be_cost_nothing() {
    let whole = bytes();
    for at in (8..whole.len()).step_by(97) {
        let mut changed = whole.clone();
        let end = (at + 8).min(changed.len());
        changed[at..end].fill(0xff);
        if let Ok(record) = Record::read(changed) {
            let _ = frames_of_any_content(&record);
        }
    }
}

fn frames_of_any_content(record: &Record) -> Result<usize, RecordError> {
    let (mut frames, mut count) = (record.frames(), 0);
    while frames.next()?.is_some() {
        count += 1;
    }
    Ok(count)
}

/// What was left out is marked where it is missing.
#[test]
fn gaps_are_told() {
    let mut writer = RecordWriter::begin(Vec::new(), &scenario()).unwrap();
    writer.moment(&moment(0), Gap::default()).unwrap();
    writer.moment(&moment(7), Gap { frames: 6, inputs: 2 }).unwrap();
    let record = Record::read(writer.finish(&ending(), Gap { frames: 3, inputs: 0 }).unwrap()).unwrap();
    assert_eq!((record.left_out(), frames(&record, 0).unwrap().len()), (9, 2));
}
