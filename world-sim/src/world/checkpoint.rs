//! The state of a world as a value, from which another process can go on.
//!
//! It holds what a tick leaves to the next one and does not follow from the scenario. What is not in it is made again: who is
//! near whom, what is seen, and the motions of obstacles and goals, which are functions of time. The log is not in it either,
//! because it grows: [`World::events`] are kept beside it. A world that goes on from a checkpoint does, to the last bit, what
//! the first one would have done, but for bodies with weight, which go on from rest.

use super::World;
use crate::crossings::Crossings;
use crate::faults::Faults;
use crate::presence::Presence;
use crate::referee::Referee;
use geometry::ArmState;
use model::kinematics::Pose;
use model::{
    Event, EventKind, FilterCount, PlanState, Radio, Robot, RobotIndex, RobotInstance, Scenario, TaskId, TaskStep,
};
use protocol::inputs::WorldInput;
use protocol::world_to_daemon::{Notice, Standings};
use protocol::world_to_robot::NeighborRef;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::VecDeque;

/// A world between two ticks, or in a tick that it has opened.
#[derive(Serialize, Deserialize)]
pub struct Checkpoint<'a> {
    tick: u64,
    next_event: usize,
    hash: u64,
    radio: Radio,
    robots: Cow<'a, [Option<Robot>]>,
    presences: Cow<'a, [Presence]>,
    referees: Cow<'a, [Option<Referee>]>,
    poses: Vec<Pose>,
    /// The arms, in their order, and how fast their joints turn, rad/s.
    arms: Vec<(ArmState, [f64; 2])>,
    scolded: Cow<'a, [bool]>,
    plans: Cow<'a, [PlanState]>,
    filter: FilterCount,
    stuck: Cow<'a, [RobotIndex]>,
    faults: Cow<'a, [Faults]>,
    /// By slot.
    heard: Cow<'a, [Vec<NeighborRef>]>,
    /// Contacts between robots, with obstacles, and by slot.
    contacts: (u64, u64, Cow<'a, [u64]>),
    /// Goals reached by robots whose slot another robot has now.
    goals_before: u64,
    /// Smallest clearances so far, between robots and to obstacles, m.
    clearances_m: [f64; 2],
    crossings: Cow<'a, Crossings>,
    ended: Cow<'a, VecDeque<(TaskId, TaskStep)>>,
    events: usize,
    events_lost: u64,
}

/// Why no world can go on from a checkpoint.
#[derive(Debug, thiserror::Error)]
#[error("the checkpoint does not fit its scenario: {0}")]
pub struct CheckpointError(&'static str);

impl Checkpoint<'_> {
    /// The tick that a world opens first that goes on from here.
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// The number of entries that the log had.
    pub fn events(&self) -> usize {
        self.events
    }
}

impl World {
    /// The state of this world. A tick that is open is opened again by the one that goes on from it: what its opening did is
    /// done, and is not done a second time. Notices, and orders that have not taken effect, are not in it.
    pub fn checkpoint(&self) -> Checkpoint<'_> {
        Checkpoint {
            tick: self.tick,
            next_event: self.next_event,
            hash: self.hash,
            radio: self.radio,
            robots: Cow::Borrowed(&self.robots),
            presences: Cow::Borrowed(&self.presences),
            referees: Cow::Borrowed(&self.referees),
            poses: self.bodies.iter().map(|body| body.pose).collect(),
            arms: self.arms.iter().map(|arm| (arm.state, arm.rate_radps)).collect(),
            scolded: Cow::Borrowed(&self.scolded),
            plans: Cow::Borrowed(&self.plans),
            filter: self.filter,
            stuck: Cow::Borrowed(&self.stuck),
            faults: Cow::Borrowed(&self.faults),
            heard: Cow::Borrowed(self.ranges.all_heard()),
            contacts: (self.contacts.robots, self.contacts.obstacles, Cow::Borrowed(&self.contacts.per_robot)),
            goals_before: self.goals_before,
            clearances_m: [self.contacts.clearance_m, self.contacts.obstacle_clearance_m],
            crossings: Cow::Borrowed(&self.crossings),
            ended: Cow::Borrowed(&self.journal.ended),
            events: self.journal.events.len(),
            events_lost: self.journal.events_lost,
        }
    }

    /// The world that goes on from a checkpoint of this scenario, with the log that it had then. Who it expects is in no
    /// notice: a daemon asks with `Order::Resync`.
    ///
    /// # Errors
    /// When the checkpoint is not one of this scenario.
    pub fn resume(
        scenario: &Scenario,
        saved: Checkpoint<'_>,
        mut events: Vec<Event>,
    ) -> Result<World, CheckpointError> {
        let slots = saved.robots.len();
        let by_slot = [
            saved.presences.len(),
            saved.referees.len(),
            saved.poses.len(),
            saved.scolded.len(),
            saved.plans.len(),
            saved.faults.len(),
        ];
        if slots > scenario.fleet.max_robots || by_slot.iter().any(|count| *count != slots) {
            return Err(CheckpointError("it is of another number of robots"));
        }
        if events.len() < saved.events || saved.next_event > scenario.events.len() {
            return Err(CheckpointError("the log is shorter than it was"));
        }
        let mut world = World::new(&Scenario { robots: Vec::new(), ..scenario.clone() });
        for (slot, robot) in saved.robots.iter().enumerate() {
            if let Some(robot) = robot {
                world.place(RobotInstance { index: RobotIndex::of(slot), incarnation: 0 }, robot, 0);
            }
        }
        if world.robots.len() != slots || world.arms.len() != saved.arms.len() {
            return Err(CheckpointError("it is of other robots"));
        }
        (world.tick, world.next_event, world.hash, world.radio) =
            (saved.tick, saved.next_event, saved.hash, saved.radio);
        world.presences = saved.presences.into_owned();
        world.referees = saved.referees.into_owned();
        for (body, pose) in world.bodies.iter_mut().zip(saved.poses) {
            body.pose = pose;
        }
        for (arm, (state, rate_radps)) in world.arms.iter_mut().zip(saved.arms) {
            (arm.state, arm.rate_radps) = (state, rate_radps);
        }
        world.scolded = saved.scolded.into_owned();
        world.plans = saved.plans.into_owned();
        world.filter = saved.filter;
        world.stuck = saved.stuck.into_owned();
        world.faults = saved.faults.into_owned();
        world.ranges.resume(saved.heard.into_owned());
        let (robots, obstacles, per_robot) = saved.contacts;
        (world.contacts.robots, world.contacts.obstacles) = (robots, obstacles);
        world.contacts.per_robot = per_robot.into_owned();
        world.goals_before = saved.goals_before;
        [world.contacts.clearance_m, world.contacts.obstacle_clearance_m] = saved.clearances_m;
        world.crossings = saved.crossings.into_owned();
        events.truncate(saved.events);
        (world.journal.events, world.journal.events_lost) = (events, saved.events_lost);
        world.journal.ended = saved.ended.into_owned();
        // What was told before has been told by another process.
        world.journal.take_notices();

        // They are looked at in the first tick.
        (world.faults_end, world.tasks_end) = (0, 0);
        let time_s = world.time_s();
        world.shapes.advance(time_s);
        for slot in 0..slots {
            world.impair(slot);
            if let (Some(referee), Some(robot)) = (&mut world.referees[slot], &world.robots[slot]) {
                referee.resume(robot, world.clock.seed);
                referee.move_goal(time_s);
            }
        }
        Ok(world)
    }

    /// This world goes on in place of another one, which had simulated `ticks` more, `away_ms` after its last tick.
    pub fn went_on(&mut self, ticks: u64, away_ms: u64) {
        self.keep(|| WorldInput::WentOn { ticks, away_ms });
        self.journal.note(self.tick, None, EventKind::WorldRestarted { ticks, away_ms });
    }

    /// Tells a daemon how everything stands.
    pub(super) fn tell_all(&mut self, number: u64) {
        let standing = |presence: &Presence| Some((presence.instance(), presence.standing()?));
        let tasks = |(slot, referee): (usize, &Option<Referee>)| -> Vec<_> {
            let tasks = referee.iter().flat_map(Referee::tasks);
            tasks.map(|(id, active)| (id, RobotIndex::of(slot), active)).collect()
        };
        let standings = Standings {
            number,
            robots: self.presences.iter().filter_map(standing).collect(),
            tasks: self.referees.iter().enumerate().flat_map(tasks).collect(),
            ended: self.journal.ended.iter().copied().collect(),
        };
        let pace = self.pace();
        self.journal.tell(Notice::Pace(pace));
        self.journal.tell(Notice::Standings(standings));
    }
}
