//! What a record holds of a run, in memory and piece by piece, so that a test can change any of it; and its replay.

use model::{Event, Mode, Outcome, RobotInstance, Scenario};
use protocol::codec;
use protocol::inputs::{AgentNote, WorldInput, WorldInputs};
use record::Body;
use replay::{Verdict, Verifier};
use std::ops::ControlFlow;
use world_sim::World;
use world_sim::recorder::bodies_of;

/// A piece of a record.
#[derive(Clone, Debug)]
pub enum Piece {
    /// What the world was told since the piece before.
    Inputs(WorldInputs),
    /// What could be seen at a tick.
    Frame(u64, Vec<Body>),
    /// An entry of the log.
    Event(Event),
    /// What an agent noted.
    Note(RobotInstance, AgentNote),
}

/// A run, as a record holds it.
#[derive(Clone, Debug)]
pub struct Tape {
    /// What was run.
    pub scenario: Scenario,
    /// In the order in which it was written.
    pub pieces: Vec<Piece>,
    /// What it came to.
    pub outcome: Option<Outcome>,
    events: usize,
}

impl Tape {
    /// Of a run that is about to begin.
    pub fn begin(scenario: &Scenario, world: &mut World) -> Tape {
        world.keep_inputs();
        Tape { scenario: scenario.clone(), pieces: Vec::new(), outcome: None, events: 0 }
    }

    /// Runs a scenario in one thread.
    ///
    /// # Panics
    /// When a method cannot be built, which validation excludes.
    pub fn of(scenario: &Scenario) -> Tape {
        let mut scenario = scenario.clone();
        scenario.clock.mode = Mode::Single;
        let scenario = &scenario;
        let mut world = World::new(scenario);
        let mut tape = Tape::begin(scenario, &mut world);
        let show = &mut |world: &mut World| tape.show(world);
        let outcome = single::run_shown(scenario, world, show, &mut |_, _| ControlFlow::Continue(()));
        tape.outcome = Some(outcome.unwrap_or_else(|error| panic!("{}: {error}", scenario.name)));
        tape
    }

    /// Takes down what a recorder would: when a tick has been opened, and at the end.
    ///
    /// # Panics
    /// When inputs cannot be encoded.
    pub fn show(&mut self, world: &mut World) {
        // Through bytes, as in a file.
        let told = world.take_inputs().expect("it keeps them");
        let bytes = codec::encode(&told).expect("they can be encoded");
        self.pieces.push(Piece::Inputs(codec::decode(&bytes).expect("they were encoded")));
        let events = world.events()[self.events..].iter().cloned();
        self.events = world.events().len();
        self.pieces.extend(events.map(Piece::Event));
        self.pieces.push(Piece::Frame(world.tick(), bodies_of(world)));
    }

    /// What an agent noted.
    ///
    /// # Panics
    /// When the note cannot be read back.
    pub fn note(&mut self, instance: RobotInstance, note: &AgentNote) {
        let mut bytes = Vec::new();
        note.encode(&mut bytes);
        self.pieces.push(Piece::Note(instance, AgentNote::decode(&bytes).expect("it was encoded")));
    }

    /// Its replay.
    pub fn verify(&self) -> Verdict {
        let mut verifier = Verifier::new(&self.scenario);
        for piece in &self.pieces {
            match piece {
                Piece::Inputs(inputs) => verifier.inputs(inputs),
                Piece::Frame(tick, bodies) => verifier.frame(*tick, bodies),
                Piece::Event(event) => verifier.event(event),
                Piece::Note(instance, note) => verifier.note(*instance, note.clone()),
            }
        }
        verifier.finish(self.outcome.as_ref())
    }

    /// The frame of a tick, to be changed.
    ///
    /// # Panics
    /// When there is none.
    pub fn frame_mut(&mut self, wanted: u64) -> &mut Vec<Body> {
        let frame = self.pieces.iter_mut().find_map(|piece| match piece {
            Piece::Frame(tick, bodies) if *tick == wanted => Some(bodies),
            _ => None,
        });
        frame.unwrap_or_else(|| panic!("no frame of tick {wanted}"))
    }

    /// The commands of a tick, to be changed.
    ///
    /// # Panics
    /// When there are none.
    pub fn drives_mut(&mut self, tick: u64) -> &mut Vec<Option<model::Drive>> {
        let inputs = self.pieces.iter_mut().filter_map(|piece| match piece {
            Piece::Inputs(told) => Some(&mut told.inputs),
            _ => None,
        });
        let drives = inputs.flatten().filter_map(|input| match input {
            WorldInput::Closed { drives } => Some(drives),
            _ => None,
        });
        drives.into_iter().nth(tick as usize).unwrap_or_else(|| panic!("no tick {tick}"))
    }
}
