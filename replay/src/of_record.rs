//! Records as files: their parts in the order in which they were written.

use crate::compare::{Comparer, Comparison};
use crate::verdict::Verdict;
use crate::verifier::Verifier;
use model::RobotIndex;
use protocol::codec;
use protocol::inputs::{AgentNote, WorldInputs};
use record::{Body, Frames, Input, InputSource, Record, RecordError};

/// How far something has come, of how much.
pub type Progress<'a> = dyn FnMut(u64, u64) + 'a;

/// Computes a recorded run again, and compares. `progress` is told ticks.
///
/// # Errors
/// When the file cannot be read. A record that is damaged somewhere is verified up to there, and the verdict says so.
pub fn verify(record: &Record, progress: &mut Progress<'_>) -> Result<Verdict, RecordError> {
    let mut verifier = Verifier::new(record.scenario());
    verifier.allow_missing(record.left_out());
    record.events().iter().for_each(|event| verifier.event(event));
    let ticks = record.ending().map_or(record.scenario().clock.ticks_max, |ending| ending.outcome.ticks);
    let (mut frames, mut inputs) = (record.frames(), record.inputs().peekable());
    let mut told = 0_u64;
    loop {
        let frame = match frames.next() {
            Ok(Some(frame)) => frame,
            Ok(None) => break,
            Err(error) => {
                damaged(&mut verifier, error)?;
                break;
            }
        };
        while let Some(input) = inputs.next_if(|input| input.as_ref().map_or(true, |input| input.tick <= frame.tick)) {
            told += 1;
            take(&mut verifier, input)?;
        }
        if told == 0 {
            verifier.ends("the record holds no inputs");
        }
        verifier.frame(frame.tick, frame.bodies);
        progress(frame.tick, ticks);
    }
    for input in inputs {
        take(&mut verifier, input)?;
    }
    Ok(verifier.finish(record.ending().map(|ending| &ending.outcome)))
}

fn take(verifier: &mut Verifier, input: Result<Input, RecordError>) -> Result<(), RecordError> {
    let input = match input {
        Ok(input) => input,
        Err(error) => return damaged(verifier, error),
    };
    match input.source {
        InputSource::World => match codec::decode::<WorldInputs>(&input.bytes) {
            Ok(inputs) => verifier.inputs(&inputs),
            Err(_) => verifier.ends("inputs of the world cannot be read"),
        },
        // A note that cannot be read is missing.
        InputSource::Robot(instance) => {
            verifier.note(instance, AgentNote::decode(&input.bytes).unwrap_or(AgentNote::Lost(1)));
        }
    }
    Ok(())
}

/// What is damaged is not looked at; what cannot be read at all is an error.
fn damaged(verifier: &mut Verifier, error: RecordError) -> Result<(), RecordError> {
    match error {
        RecordError::Io(_) => Err(error),
        error => {
            verifier.ends(&format!("the record is damaged: {error}"));
            Ok(())
        }
    }
}

/// Holds the frames of two records against each other, robots by their names. `progress` is told ticks.
///
/// # Errors
/// When one of them is damaged or cannot be read.
pub fn compare(records: [&Record; 2], progress: &mut Progress<'_>) -> Result<Comparison, RecordError> {
    let [mut one, mut other] =
        records.map(|record| Side { record, frames: record.frames(), tick: None, bodies: Vec::new() });
    let ticks = records.map(|record| record.scenario().clock.ticks_max).into_iter().max().unwrap_or(0);
    let mut comparer = Comparer::default();
    one.advance()?;
    other.advance()?;
    while let Some(tick) = [one.tick, other.tick].into_iter().flatten().min() {
        let shown = |side: &Side<'_>| side.tick == Some(tick);
        let (has_one, has_other) = (shown(&one), shown(&other));
        comparer.tick(tick, [has_one.then_some(&one.bodies[..]), has_other.then_some(&other.bodies[..])]);
        progress(tick, ticks);
        if has_one {
            one.advance()?;
        }
        if has_other {
            other.advance()?;
        }
    }
    Ok(comparer.finish())
}

/// One of two records.
struct Side<'a> {
    record: &'a Record,
    frames: Frames<'a>,
    /// The tick of the present frame; `None` when there are no more.
    tick: Option<u64>,
    /// Its bodies, by name.
    bodies: Vec<(String, Body)>,
}

impl Side<'_> {
    fn advance(&mut self) -> Result<(), RecordError> {
        self.bodies.clear();
        let frame = self.frames.next()?;
        self.tick = frame.map(|frame| frame.tick);
        if let Some(frame) = frame {
            let named = frame.bodies.iter().map(|body| (name_of(self.record, body, frame.tick), *body));
            self.bodies.extend(named);
        }
        Ok(())
    }
}

fn name_of(record: &Record, body: &Body, tick: u64) -> String {
    if body.is_obstacle() {
        return format!("obstacle {}", body.index);
    }
    let robot = record.robot_at(RobotIndex(body.index), tick);
    robot.map_or_else(|| format!("#{}", body.index), |robot| robot.id.clone())
}
