//! A whole fleet in one thread, every tick of it kept.

use model::{Event, EventName, Outcome, RobotIndex, Scenario};
use nalgebra::Point2;
use protocol::world_to_observer::FrameBody;
use report::{Report, RunFacts};
use std::ops::ControlFlow;
use world_sim::World;

/// Everything that can be seen at one tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// The tick.
    pub tick: u64,
    /// Robots by slot, then moving obstacles.
    pub bodies: Vec<FrameBody>,
}

impl Frame {
    /// The robots in it, by slot.
    pub fn robots(&self) -> impl Iterator<Item = &FrameBody> {
        self.bodies.iter().filter(|body| body.flags & FrameBody::FLAG_OBSTACLE == 0)
    }

    /// The robot of a slot, if it is in the world.
    pub fn robot(&self, slot: usize) -> Option<&FrameBody> {
        self.robots().find(|body| body.index as usize == slot)
    }

    /// The moving obstacle with this index in the scenario.
    pub fn obstacle(&self, index: usize) -> Option<&FrameBody> {
        let obstacles = self.bodies.iter().filter(|body| body.flags & FrameBody::FLAG_OBSTACLE != 0);
        obstacles.into_iter().find(|body| body.index as usize == index)
    }
}

/// Where a body is, m.
pub fn at(body: &FrameBody) -> Point2<f64> {
    Point2::new(body.x_m, body.y_m)
}

/// Whether a robot's process takes part.
pub fn is_silent(body: &FrameBody) -> bool {
    body.flags & FrameBody::FLAG_SILENT != 0
}

/// Whether a robot is at its last goal.
pub fn has_arrived(body: &FrameBody) -> bool {
    body.flags & FrameBody::FLAG_ARRIVED != 0
}

/// A run from its beginning to its end.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// What was run.
    pub scenario: Scenario,
    /// What it came to, says the world.
    pub outcome: Outcome,
    /// One frame per tick, the first for tick 0: before anybody has entered.
    pub frames: Vec<Frame>,
}

impl Recording {
    /// Runs a scenario to its end.
    ///
    /// # Panics
    /// When a method cannot be built, which validation excludes.
    pub fn of(scenario: &Scenario) -> Recording {
        let mut frames = vec![frame(&World::new(scenario))];
        let outcome = single::run(scenario, &mut |world, _| {
            frames.push(frame(world));
            ControlFlow::Continue(())
        });
        let outcome = outcome.unwrap_or_else(|error| panic!("{}: {error}", scenario.name));
        assert_eq!(outcome.ticks as usize + 1, frames.len());
        Recording { scenario: scenario.clone(), outcome, frames }
    }

    /// The report that `shoal run --mode single` gives; the wall time is made up.
    pub fn report(&self) -> Report {
        report::assemble(RunFacts::new(self.scenario.clone(), self.outcome.clone(), 1.0))
    }

    /// The hash of its trajectories.
    pub fn hash(&self) -> u64 {
        self.outcome.trajectory_hash
    }

    /// The slot of the robot of this name.
    ///
    /// # Panics
    /// When there is none.
    pub fn slot(&self, id: &str) -> usize {
        let slot = self.scenario.robots.iter().position(|robot| robot.id == id);
        slot.unwrap_or_else(|| panic!("{}: no robot `{id}`", self.scenario.name))
    }

    /// A robot at a tick, if it is in the world.
    pub fn robot(&self, tick: u64, slot: usize) -> Option<&FrameBody> {
        self.frames.get(tick as usize)?.robot(slot)
    }

    /// Where a robot is at a tick, m.
    ///
    /// # Panics
    /// When it is not in the world.
    pub fn position(&self, tick: u64, slot: usize) -> Point2<f64> {
        self.robot(tick, slot).map(at).unwrap_or_else(|| panic!("robot {slot} is not in the world at tick {tick}"))
    }

    /// The entries of the log about a robot, of one kind.
    pub fn events(&self, slot: usize, kind: EventName) -> impl Iterator<Item = &Event> {
        self.outcome
            .events
            .iter()
            .filter(move |event| event.robot == Some(RobotIndex::of(slot)) && event.kind.name() == kind)
    }

    /// The first tick at which two recordings show different things; `None` if they show the same.
    pub fn first_difference(&self, other: &Recording) -> Option<u64> {
        let longer = self.frames.len() != other.frames.len();
        let end = longer.then_some(self.frames.len().min(other.frames.len()) as u64);
        let pairs = self.frames.iter().zip(&other.frames);
        pairs.into_iter().find(|(a, b)| a != b).map(|(a, _)| a.tick).or(end)
    }
}

fn frame(world: &World) -> Frame {
    let mut bodies = Vec::new();
    world.frame(&mut bodies);
    Frame { tick: world.tick(), bodies }
}
