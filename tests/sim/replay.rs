//! A run in one thread, recorded and computed again: equal, whatever happens in it; and what was changed in the record is
//! found where it is.

use model::{Drive, EventKind, FilterKind, Scenario};
use protocol::inputs::{WorldInput, WorldInputs};
use scenarios::Overrides;
use shoal_tests::tape::Piece;
use shoal_tests::{Tape, build, catalog, catalog_names, seeds};

fn verified(scenario: &Scenario) -> Tape {
    let tape = Tape::of(scenario);
    let verdict = tape.verify();
    let outcome = tape.outcome.as_ref().unwrap();
    assert_eq!((verdict.first, verdict.differences), (None, 0), "{}", scenario.name);
    assert_eq!(verdict.unverified, [], "{}", scenario.name);
    assert!(verdict.is_whole && verdict.ends_early.is_none());
    assert_eq!((verdict.trajectory_hash, verdict.ticks), (outcome.trajectory_hash, outcome.ticks), "{}", scenario.name);
    assert_eq!(verdict.frames, outcome.ticks + 1, "{}", scenario.name);
    assert_eq!(verdict.events, outcome.events.len() as u64, "{}", scenario.name);
    assert!(verdict.commands > 0 && verdict.steps == verdict.commands, "{}", scenario.name);
    tape
}

#[test]
fn every_scenario_of_the_catalog_is_the_same_again() {
    for name in catalog_names().filter(|name| !["scale-64", "rvo2-circle", "rvo2-blocks"].contains(name)) {
        verified(&catalog(name, &Overrides { duration_s: Some(20.0), ..Overrides::default() }));
    }
}

#[test]
fn whatever_the_planner_the_filter_and_the_radio() {
    for planner in ["lanes", "orca", "decentralized-apf", "rpoa", "power-law"] {
        for filter in [FilterKind::None, FilterKind::SharedGap] {
            for set in [vec![], vec!["radio.drop=0.2".to_owned(), "radio.delay_ticks=2".to_owned()]] {
                let overrides =
                    Overrides { planner: Some(planner.to_owned()), filter: Some(filter), set, ..build::seed(3) };
                verified(&catalog("demo-15", &overrides));
            }
        }
    }
}

/// A robot dies and comes back, one is paused, one is mute, one slow, radios get worse and better, one leaves.
fn eventful() -> Scenario {
    let text = r#"
        [clock]
        duration_s = 15
        [defaults]
        planner = "lanes"
        filter = "shared-gap"
        restart = "on-failure"
        [layout]
        kind = "circle-swap"
        robots = 8
        radius_m = 5
        jitter_m = 0.3
        [[obstacle]]
        shape = "disc"
        center_m = [0.5, 0]
        radius_m = 0.4
        motion = { kind = "bounce", velocity_mps = [0.3, 0.1], x_m = [-3, 3], y_m = [-3, 3] }
        [[event]]
        at_s = 2
        kind = "kill"
        robot = "r00"
        [[event]]
        at_s = 3
        kind = "pause"
        robot = "r01"
        for_s = 1.5
        [[event]]
        at_s = 3
        kind = "radio"
        drop = 0.3
        noise_m = 0.02
        [[event]]
        at_s = 5
        kind = "leave"
        robot = "r03"
        [[event]]
        at_s = 6
        kind = "task"
        robot = "r04"
        goal_m = [1, 4]
    "#;
    build::with(text, &build::seed(5))
}

#[test]
fn whatever_the_timeline_does() {
    let tape = verified(&eventful());
    let events = &tape.outcome.as_ref().unwrap().events;
    let has = |kind: fn(&EventKind) -> bool| events.iter().any(|event| kind(&event.kind));
    assert!(has(|kind| matches!(kind, EventKind::Killed { .. })), "{events:?}");
    assert!(has(|kind| matches!(kind, EventKind::Restarted { .. })), "{events:?}");
    assert!(has(|kind| matches!(kind, EventKind::Task { .. })), "{events:?}");
}

#[test]
fn over_seeds() {
    seeds(1..=20, |seed| {
        verified(&catalog("demo-15", &build::seed(seed)));
    });
}

/// A tape of demo-15 with some loss, so that the seed matters all the time.
fn lossy(seed: u64) -> Tape {
    Tape::of(&catalog("demo-15", &Overrides { set: vec!["radio.drop=0.2".to_owned()], ..build::seed(seed) }))
}

fn flip(value: &mut f64) {
    *value = f64::from_bits(value.to_bits() ^ 1);
}

/// Changes a tape, and what is said of it: tick, robot and field of the first difference.
#[track_caller]
fn check(change: impl FnOnce(&mut Tape), expected: (u64, Option<&str>, &str)) {
    let mut tape = lossy(1);
    change(&mut tape);
    let verdict = tape.verify();
    let first = verdict.first.unwrap_or_else(|| panic!("nothing is found, expected {expected:?}"));
    assert_eq!((first.tick, first.robot.as_deref(), first.field.as_str()), expected, "{first}");
    assert_ne!(first.recorded, first.replayed);
}

#[test]
fn a_bit_of_a_pose_is_found() {
    check(|tape| flip(&mut tape.frame_mut(300)[4].position_m[1]), (300, Some("r04"), "y_m"));
    check(|tape| flip(&mut tape.frame_mut(0)[0].yaw_rad), (0, Some("r00"), "yaw_rad"));
}

#[test]
fn a_wrong_goal_is_found() {
    check(|tape| tape.frame_mut(100)[2].goal_m[0] += 1.0, (100, Some("r02"), "goal_x_m"));
    check(|tape| tape.scenario.robots[7].goals[0].x += 1e-9, (0, Some("r07"), "goal_x_m"));
}

#[test]
fn a_missing_robot_is_found() {
    let remove = |tape: &mut Tape| tape.frame_mut(200).retain(|body| body.index != 3);
    check(remove, (200, Some("r03"), "body"));
}

#[test]
fn a_changed_command_is_found() {
    let change = |tape: &mut Tape| match &mut tape.drives_mut(150)[5] {
        Some(Drive::Velocity(velocity)) => flip(&mut velocity.x),
        other => panic!("{other:?}"),
    };
    check(change, (150, Some("r05"), "command"));
}

#[test]
fn a_command_that_is_not_there_is_found() {
    check(|tape| tape.drives_mut(150)[5] = None, (150, Some("r05"), "command"));
}

#[test]
fn a_changed_event_is_found() {
    let change = |tape: &mut Tape| {
        let event = tape.pieces.iter_mut().find_map(|piece| match piece {
            Piece::Event(event) if matches!(event.kind, EventKind::Task { .. }) => Some(event),
            _ => None,
        });
        let event = event.expect("demo-15 has tasks");
        if let EventKind::Task { task, .. } = &mut event.kind {
            task.goal.x += 0.5;
        }
    };
    let tick = lossy(1).outcome.unwrap().events.iter().find(|e| matches!(e.kind, EventKind::Task { .. })).unwrap().tick;
    let mut tape = lossy(1);
    change(&mut tape);
    let first = tape.verify().first.unwrap();
    assert_eq!((first.tick, first.field.as_str()), (tick, "event"), "{first}");
    // And one that is missing.
    let mut tape = lossy(1);
    let place = tape.pieces.iter().position(|piece| matches!(piece, Piece::Event(_))).unwrap();
    tape.pieces.remove(place);
    assert_eq!(tape.verify().first.unwrap().field, "event");
}

#[test]
fn another_seed_is_found() {
    let mut tape = lossy(1);
    tape.scenario.clock.seed = 2;
    let first = tape.verify().first.unwrap();
    // The first pose that one seed loses and the other does not.
    assert!(first.tick < 20 && first.robot.is_some(), "{first}");
}

#[test]
fn a_changed_parameter_is_found() {
    let change = |tape: &mut Tape| tape.scenario.robots[6].limits.speed_mps_max *= 1.01;
    let mut tape = lossy(1);
    change(&mut tape);
    let first = tape.verify().first.unwrap();
    assert_eq!((first.tick, first.robot.as_deref()), (0, Some("r06")), "{first}");
}

#[test]
fn a_dropped_and_a_shifted_tick_are_found() {
    let drop_frame = |tape: &mut Tape| tape.pieces.retain(|piece| !matches!(piece, Piece::Frame(250, _)));
    check(drop_frame, (250, None, "frame"));
    let shift = |tape: &mut Tape| {
        for piece in &mut tape.pieces {
            if let Piece::Frame(tick, _) = piece {
                *tick += u64::from(*tick >= 90);
            }
        }
    };
    check(shift, (90, None, "frame"));
    // The last one as well.
    let last = lossy(1).outcome.unwrap().ticks;
    let drop_last = |tape: &mut Tape| tape.pieces.retain(|piece| !matches!(piece, Piece::Frame(at, _) if *at == last));
    check(drop_last, (last, None, "frame"));
}

#[test]
fn a_lost_message_is_found() {
    // Of one robot it is not known what came with its command.
    let mut tape = lossy(1);
    let mut seen = 0;
    for piece in &mut tape.pieces {
        if let Piece::Inputs(told) = piece {
            told.inputs.retain(|input| {
                seen += u64::from(matches!(input, WorldInput::Planned { .. }));
                seen != 1000 || !matches!(input, WorldInput::Planned { .. })
            });
        }
    }
    let verdict = tape.verify();
    assert!(!verdict.unverified.is_empty() && verdict.unverified.iter().all(|robot| robot.tick >= 60), "{verdict:?}");
    // The inputs of a whole tick are not there.
    let mut tape = lossy(1);
    let is_inputs = |piece: &&mut Piece| matches!(piece, Piece::Inputs(told) if told.number == 400);
    let lost = tape.pieces.iter_mut().find(is_inputs).unwrap();
    *lost = Piece::Inputs(WorldInputs { number: 401, inputs: Vec::new() });
    let verdict = tape.verify();
    assert_eq!(verdict.ends_early, Some((399, "inputs of the world are missing".to_owned())));
    assert_eq!((verdict.first, verdict.is_whole), (None, false), "what was before is the same");
    // A tick is opened and not closed.
    let mut tape = lossy(1);
    for piece in &mut tape.pieces {
        if let Piece::Inputs(told) = piece {
            told.inputs.retain(|input| !matches!(input, WorldInput::Closed { .. }));
        }
    }
    assert_eq!(tape.verify().ends_early, Some((0, "a tick was opened twice".to_owned())));
}

#[test]
fn a_wrong_outcome_is_found() {
    let change = |tape: &mut Tape| tape.outcome.as_mut().unwrap().robots[3].path_length_m += 1e-12;
    let last = lossy(1).outcome.unwrap().ticks;
    check(change, (last, None, "outcome, robots.3.path_length_m"));
    let change = |tape: &mut Tape| tape.outcome.as_mut().unwrap().trajectory_hash ^= 1;
    check(change, (last, None, "outcome, trajectory_hash"));
}

#[test]
fn a_record_that_is_cut_is_verified_as_far_as_it_goes() {
    let whole = lossy(1);
    for length in [0, 1, 2, 100, 333, whole.pieces.len() - 1] {
        let mut tape = whole.clone();
        tape.pieces.truncate(length);
        tape.outcome = None;
        let verdict = tape.verify();
        assert_eq!((verdict.first, verdict.is_whole), (None, false), "{length}");
        let frames = tape.pieces.iter().filter(|piece| matches!(piece, Piece::Frame(..))).count();
        assert_eq!(verdict.frames, frames as u64, "{length}");
    }
}
