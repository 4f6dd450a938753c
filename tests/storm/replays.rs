//! What was recorded of a storm is computed again, from the record alone.

use crate::fleet::Fleet;
use crate::plan::Plan;
use ::replay::Why;
use model::{EventKind, Mode, Outcome};
use protocol::inputs::{AgentNote, StepNote};
use shoal_tests::Tape;
use shoal_tests::tape::Piece;

/// Replays a storm, if its record is whole; the number of commands that were computed again.
pub(crate) fn is_the_same_again(tape: Option<Tape>, outcome: &Outcome) -> u64 {
    let Some(mut tape) = tape else { return 0 };
    tape.outcome = Some(outcome.clone());
    let verdict = tape.verify();
    assert_eq!(verdict.first.as_ref().map(ToString::to_string), None, "{} differences", verdict.differences);
    assert!(verdict.is_whole, "{:?}", verdict.ends_early);
    let overdue =
        outcome.events.iter().any(|event| matches!(event.kind, EventKind::Held { .. } | EventKind::Dropped { .. }));
    for unverified in &verdict.unverified {
        // In `lockstep` nothing says whether a robot that did not answer has planned.
        let may_be = tape.scenario.clock.mode != Mode::Realtime && overdue;
        assert!(may_be && matches!(unverified.why, Why::NotAnswered | Why::Heard(_)), "{unverified:?}");
    }
    verdict.commands
}

/// The record of a storm in `realtime` in which robots hear each other.
fn realtime_tape() -> Tape {
    let is_realtime = |seed: &u64| Plan::new(*seed, Some(4)).scenario.clock.mode == Mode::Realtime;
    let tapes = (0..100).filter(is_realtime).map(|seed| {
        let mut fleet = Fleet::new(seed, Plan::new(seed, Some(4)));
        while !fleet.daemon.has_finished {
            fleet.step();
        }
        let mut tape = fleet.shared.tape.take().expect("it is recorded");
        tape.outcome = Some(fleet.world.world.outcome());
        tape
    });
    let tape = tapes.into_iter().find(|tape| tape.pieces.iter().any(|piece| heard(piece, tape.scenario.robots.len())));
    let tape = tape.expect("robots hear each other");
    assert_eq!(tape.verify().differences, 0);
    tape
}

/// Whether it is a step, well in the run, in which a robot of the scenario heard others.
fn heard(piece: &Piece, robots: usize) -> bool {
    match piece {
        Piece::Note(instance, AgentNote::Step(step)) => {
            instance.index.at() < robots && step.tick > 20 && step.heard.iter().any(|heard| heard.stamp_ns > 0)
        }
        _ => false,
    }
}

/// Changes a step of a record, and finds the change at its tick and robot.
#[track_caller]
fn check(change: impl FnOnce(&mut StepNote)) {
    let mut tape = realtime_tape();
    let (step, robot) = heard_step(&mut tape);
    change(step);
    let tick = step.tick;
    let first = tape.verify().first.expect("a difference");
    assert_eq!((first.tick, first.robot), (tick, Some(robot)));
}

/// A step in the middle of the run in which a robot heard others; its name is that of its slot.
fn heard_step(tape: &mut Tape) -> (&mut StepNote, String) {
    // Of a robot that was there from the beginning.
    let robots = tape.scenario.robots.len();
    let steps = tape.pieces.iter_mut().filter_map(|piece| match piece {
        Piece::Note(instance, AgentNote::Step(step)) if instance.index.at() < robots => Some((*instance, step)),
        _ => None,
    });
    let found = steps.into_iter().find(|(_, step)| step.tick > 20 && step.heard.iter().any(|heard| heard.stamp_ns > 0));
    let (instance, step) = found.expect("robots hear each other");
    (step, tape.scenario.robots[instance.index.at()].id.clone())
}

#[test]
fn a_pose_that_was_not_heard_is_found() {
    check(|step| {
        let place = step.heard.iter().position(|heard| heard.stamp_ns > 0).expect("there is one");
        step.heard[place].stamp_ns = 0;
    });
}

#[test]
fn a_step_that_said_something_else_is_found() {
    check(|step| step.outputs_sum ^= 1);
}

#[test]
fn odometry_of_another_tick_is_found() {
    check(|step| step.tick -= 1);
}

/// Nothing is computed from what is not there, and nobody is silent about it.
#[test]
fn a_step_that_is_missing_is_said() {
    let mut tape = realtime_tape();
    let whole = tape.verify();
    let place =
        tape.pieces.iter().position(|piece| matches!(piece, Piece::Note(_, AgentNote::Step(step)) if step.tick > 20));
    let Piece::Note(instance, AgentNote::Step(step)) = tape.pieces.remove(place.expect("it planned")) else { return };
    tape.pieces.insert(place.unwrap_or(0), Piece::Note(instance, AgentNote::Lost(1)));
    let verdict = tape.verify();
    let of = tape.scenario.robots[instance.index.at()].id.clone();
    let said = verdict.unverified.iter().find(|robot| robot.robot == of).expect("it is said");
    assert!(said.tick <= step.tick && said.why == Why::NotesLost && said.commands > 0, "{said:?}");
    let unverified: u64 = verdict.unverified.iter().map(|robot| robot.commands).sum();
    assert_eq!((verdict.differences, verdict.commands + unverified), (0, whole.commands));
}
