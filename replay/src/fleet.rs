//! The agents of a run, computed again.
//!
//! Each robot instance is a [`Life`]: its agent, what that said in its newest steps, and the notes of steps that wait. A step
//! needs a view of the world and the steps of others in which they said what it heard; it is made when these are there.
//! Somebody who heard a step has noted that after the step was noted, so nothing waits for ever unless notes are missing:
//! then the life is *in doubt*, its agent is not computed any more, and neither are those that hear it.

use crate::verdict::{Differences, Rank, Unverified, Why};
use crate::views::Views;
use model::{Drive, Mode, PlanState, RobotInstance, Scenario};
use protocol::daemon_to_robot::AgentSpec;
use protocol::inputs::{AgentNote, HeardNote, StepNote};
use protocol::robot_to_robot::{SharedBorder, SharedBorders, SharedPose};
use protocol::world_to_robot::{NeighborRef, Odometry, Piece};
use robot_agent::note::{are_same, sum_of_inputs, sum_of_outputs, sum_of_said};
use robot_agent::{Agent, AgentInputs, AgentOutputs, Time};
use std::collections::{BTreeMap, VecDeque};
use world_sim::World;

/// Steps of a robot instance that others may still refer to.
const SAID_KEPT: usize = 512;
/// Notes of a robot instance that wait for others at most.
const WAITING_MAX: usize = 4096;

/// The command of a robot that the world used in a tick, as the record has it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Used {
    pub(crate) tick: u64,
    /// Which step it comes from, where that is noted.
    pub(crate) stamp_ns: Option<u64>,
    pub(crate) drive: Option<Drive>,
    pub(crate) state: PlanState,
    pub(crate) filtered: f64,
}

/// What an agent said in a step.
struct Said {
    stamp_ns: u64,
    pose: SharedPose,
    borders: Option<Box<SharedBorders>>,
    outputs: AgentOutputs,
}

/// A robot instance.
#[derive(Default)]
struct Life {
    name: String,
    /// `None` before it is in the world, and when it is in doubt.
    agent: Option<Agent>,
    has_been_there: bool,
    is_own: bool,
    doubt: Option<Doubt>,
    said: VecDeque<Said>,
    waiting: VecDeque<StepNote>,
    used: VecDeque<Used>,
}

/// Since when it is not computed, why, and the number of commands that were taken from the record.
struct Doubt {
    tick: u64,
    why: Why,
    commands: u64,
}

/// What became of the attempt to make a step.
enum Attempt {
    Made,
    /// Something that it needs has not come yet.
    Waits,
    Doubtful(Why),
}

/// What a step heard of one neighbour; `None`: its step has not been made yet.
type Heard = Result<Option<(SharedPose, SharedBorder)>, Why>;

pub(crate) struct Fleet {
    scenario: Scenario,
    lives: BTreeMap<RobotInstance, Life>,
    pub(crate) steps: u64,
    pub(crate) commands: u64,
    // Buffers of a step.
    heard: Vec<(NeighborRef, SharedPose)>,
    borders: Vec<SharedBorder>,
    pieces: Vec<Piece>,
}

impl Fleet {
    pub(crate) fn new(scenario: &Scenario) -> Fleet {
        Fleet {
            scenario: scenario.clone(),
            lives: BTreeMap::new(),
            steps: 0,
            commands: 0,
            heard: Vec::new(),
            borders: Vec::new(),
            pieces: Vec::new(),
        }
    }

    /// The agents of all that take part in the open tick are there from now on.
    pub(crate) fn enter(&mut self, world: &World) {
        for instance in world.participants() {
            let life = self.lives.entry(*instance).or_default();
            if std::mem::replace(&mut life.has_been_there, true) {
                continue;
            }
            let Some(robot) = world.robot(instance.index.at()) else { continue };
            life.name.clone_from(&robot.id);
            // One that was added while the fleet ran: those that are started later know of it.
            match self.scenario.robots.get_mut(instance.index.at()) {
                Some(known) if known.id == robot.id => {}
                Some(known) => *known = robot.clone(),
                None => self.scenario.robots.push(robot.clone()),
            }
            if self.scenario.clock.mode == Mode::Lockstep && robot.agent.is_some() {
                // No note says what it had and said: neither its commands nor its intentions are shoal's to compute.
                life.doubt(world.tick(), Why::OwnExecutable);
                continue;
            }
            match Agent::new(AgentSpec::new(&self.scenario, robot, *instance)) {
                Ok(agent) => life.agent = Some(agent),
                Err(error) => life.doubt(world.tick(), Why::Planner(error.to_string())),
            }
            // Of those before the last one nobody tells any more.
            let before = self
                .lives
                .keys()
                .rev()
                .find(|known| known.index == instance.index && known.incarnation + 1 < instance.incarnation);
            if let Some(before) = before.copied()
                && let Some(life) = self.lives.get_mut(&before)
            {
                life.said.clear();
            }
        }
    }

    /// Everybody who takes part in the open tick plans, as in `single`.
    pub(crate) fn plan(&mut self, world: &World) {
        for place in 0..world.participants().len() {
            let instance = world.participants()[place];
            if let Err(why) = self.plan_of(world, instance)
                && let Some(life) = self.lives.get_mut(&instance)
            {
                life.doubt(world.tick(), why);
            }
        }
    }

    fn plan_of(&mut self, world: &World, instance: RobotInstance) -> Result<(), Why> {
        let (tick, slot) = (world.tick(), instance.index.at());
        if self.lives.get(&instance).is_none_or(|life| life.agent.is_none()) {
            return Ok(());
        }
        self.heard.clear();
        self.borders.clear();
        for who in world.neighbors(slot) {
            let Some(life) = self.lives.get(&RobotInstance::from(*who)) else { continue };
            if life.doubt.is_some() {
                return Err(Why::Heard(life.name.clone()));
            }
            let said = life.said.iter().rev().find(|said| said.pose.tick < tick);
            self.heard.push((*who, said.map(|said| said.pose).unwrap_or_default()));
            self.borders.push(said.map(|said| said.border_to(instance)).unwrap_or_default());
        }
        self.pieces.clear();
        self.pieces.extend(world.sensed(slot).iter().map(|index| world.piece(usize::from(*index))));
        let (odometry, radio) = (world.odometry(slot), world.impairment(slot).radio());
        self.step(instance, (&odometry, radio, Time::Ticks), tick);
        Ok(())
    }

    /// Makes a step with what is in the buffers; what is in them may be checked before. The stamp is of the note, or the tick.
    fn step(&mut self, instance: RobotInstance, with: (&Odometry, model::Radio, Time), stamp_ns: u64) -> Option<u64> {
        let life = self.lives.get_mut(&instance)?;
        let agent = life.agent.as_mut()?;
        let (odometry, radio, time) = with;
        let borders: &[SharedBorder] = if agent.has_borders() { &self.borders } else { &[] };
        let inputs = AgentInputs { odometry, heard: &self.heard, borders, radio, pieces: &self.pieces, time };
        let mut pose = SharedPose::default();
        let outputs = agent.step(&inputs, &mut pose);
        let sum = sum_of_outputs(&pose, &outputs);
        pose.stamp_ns = stamp_ns;
        let borders = agent.has_borders().then(|| {
            let mut borders = Box::<SharedBorders>::default();
            agent.tell_borders(odometry.tick, &mut borders);
            borders
        });
        if life.said.len() == SAID_KEPT {
            life.said.pop_front();
        }
        life.said.push_back(Said { stamp_ns, pose, borders, outputs });
        self.steps += 1;
        Some(sum)
    }

    /// An agent has noted something.
    pub(crate) fn note(&mut self, instance: RobotInstance, note: AgentNote, tick: u64) {
        let life = self.lives.entry(instance).or_default();
        match note {
            AgentNote::Began { is_own } => life.is_own = is_own,
            AgentNote::Lost(_) => life.doubt(life.waiting.back().map_or(tick, |note| note.tick), Why::NotesLost),
            AgentNote::Step(_) if life.doubt.is_some() => {}
            AgentNote::Step(step) => {
                life.waiting.push_back(step);
                if life.waiting.len() > WAITING_MAX {
                    life.doubt(tick, Why::NotesLost);
                }
            }
        }
    }

    /// A command that the world used.
    pub(crate) fn used(&mut self, instance: RobotInstance, used: Used, differences: &mut Differences) {
        let Some(life) = self.lives.get_mut(&instance) else { return };
        life.used.push_back(used);
        self.commands += life.compare(differences);
    }

    /// A robot took part in a tick and did not answer: whether its agent planned is not known.
    pub(crate) fn not_answered(&mut self, instance: RobotInstance, tick: u64) {
        if let Some(life) = self.lives.get_mut(&instance) {
            life.doubt(tick, Why::NotAnswered);
        }
    }

    /// Makes the steps that can be made.
    pub(crate) fn go_on(&mut self, views: &Views, differences: &mut Differences) {
        let waiting = |(instance, life): (&RobotInstance, &Life)| (!life.waiting.is_empty()).then_some(*instance);
        let mut instances: Vec<RobotInstance> = self.lives.iter().filter_map(waiting).collect();
        loop {
            let mut is_further = false;
            instances.retain(|instance| {
                is_further |= self.catch_up(*instance, views, differences);
                self.lives.get(instance).is_some_and(|life| !life.waiting.is_empty())
            });
            if !is_further {
                return;
            }
        }
    }

    /// Nothing more comes. In a whole record, what waits still waits for something that is missing.
    pub(crate) fn finish(&mut self, is_whole: bool, views: &Views, differences: &mut Differences) {
        self.go_on(views, differences);
        if !is_whole {
            return;
        }
        let next = |(instance, life): (&RobotInstance, &Life)| {
            life.waiting.front().map(|note| (note.stamp_ns, note.tick, *instance))
        };
        while let Some((_, tick, instance)) = self.lives.iter().filter_map(next).min() {
            if let Some(life) = self.lives.get_mut(&instance) {
                life.doubt(tick, Why::NotesLost);
            }
            self.go_on(views, differences);
        }
        for life in self.lives.values_mut() {
            if let Some(used) = life.used.front() {
                life.doubt(used.tick, Why::NotesLost);
            }
        }
    }

    /// Those whose commands were taken from the record.
    pub(crate) fn unverified(&self) -> Vec<Unverified> {
        let told = |(instance, life): (&RobotInstance, &Life)| {
            let doubt = life.doubt.as_ref().filter(|doubt| doubt.commands > 0)?;
            Some(Unverified {
                robot: life.name.clone(),
                incarnation: instance.incarnation,
                tick: doubt.tick,
                why: doubt.why.clone(),
                commands: doubt.commands,
            })
        };
        self.lives.iter().filter_map(told).collect()
    }

    /// Makes the steps of one robot instance that can be made; whether there were any.
    fn catch_up(&mut self, instance: RobotInstance, views: &Views, differences: &mut Differences) -> bool {
        let mut is_further = false;
        while let Some(note) = self.lives.get_mut(&instance).and_then(|life| life.waiting.pop_front()) {
            let attempt = self.attempt(instance, &note, views, differences);
            let Some(life) = self.lives.get_mut(&instance) else { return is_further };
            match attempt {
                Attempt::Waits => {
                    life.waiting.push_front(note);
                    return is_further;
                }
                Attempt::Made => self.commands += life.compare(differences),
                Attempt::Doubtful(why) => life.doubt(note.tick, why),
            }
            is_further = true;
        }
        is_further
    }

    fn attempt(
        &mut self,
        instance: RobotInstance,
        note: &StepNote,
        views: &Views,
        differences: &mut Differences,
    ) -> Attempt {
        let Some((first, _)) = views.range().filter(|(_, last)| note.tick <= *last) else { return Attempt::Waits };
        let Some(seat) = views.seat(note.tick, instance) else {
            return Attempt::Doubtful(if note.tick < first { Why::TooOld } else { Why::NotThere });
        };
        self.heard.clear();
        self.borders.clear();
        for heard in &note.heard {
            match self.heard_of(instance, heard, note.stamp_ns) {
                Ok(Some((pose, border))) => {
                    self.heard.push((heard.who, pose));
                    self.borders.push(border);
                }
                Ok(None) => return Attempt::Waits,
                Err(why) => return Attempt::Doubtful(why),
            }
        }
        let radio = match &note.between {
            Some(between) => {
                self.pieces.clone_from(&between.pieces);
                between.radio
            }
            None => {
                views.look(seat, &mut self.pieces);
                seat.radio
            }
        };
        let time = note.now_ns.map_or(Time::Ticks, |now_ns| Time::Stamps { now_ns });
        let Some(life) = self.lives.get(&instance) else { return Attempt::Waits };
        let Some(agent) = &life.agent else { return Attempt::Waits };
        let (odometry, is_own, name) = (&seat.odometry, life.is_own, life.name.clone());
        let borders: &[SharedBorder] = if agent.has_borders() { &self.borders } else { &[] };
        let inputs = AgentInputs { odometry, heard: &self.heard, borders, radio, pieces: &self.pieces, time };
        let sum = sum_of_inputs(&inputs);
        let mut differ = |rank, field, sums: [u64; 2]| {
            differences.add(rank, note.tick, Some(name.clone()), field, sums.map(|sum| format!("{sum:016x}")));
        };
        if sum != note.inputs_sum {
            differ(Rank::Inputs, "check sum over the inputs of its agent", [note.inputs_sum, sum]);
        }
        match self.step(instance, (odometry, radio, time), note.stamp_ns) {
            Some(sum) if sum != note.outputs_sum && is_own => {
                if let Some(life) = self.lives.get_mut(&instance) {
                    life.said.pop_back();
                }
                Attempt::Doubtful(Why::OwnExecutable)
            }
            Some(sum) if sum != note.outputs_sum => {
                differ(Rank::Said, "check sum over what its agent said", [note.outputs_sum, sum]);
                Attempt::Made
            }
            _ => Attempt::Made,
        }
    }

    /// What a robot heard of another one before `stamp_ns`.
    fn heard_of(&self, instance: RobotInstance, heard: &HeardNote, stamp_ns: u64) -> Heard {
        let Some(life) = self.lives.get(&RobotInstance::from(heard.who)) else { return Ok(None) };
        let place = life.said.binary_search_by_key(&heard.stamp_ns, |said| said.stamp_ns);
        let pose = match (heard.stamp_ns, place) {
            (0, _) => SharedPose::default(),
            (_, Ok(place)) => life.said[place].pose,
            (_, Err(_)) => return life.not_said(heard.stamp_ns),
        };
        let Some(sum) = heard.border_sum else { return Ok(Some((pose, SharedBorder::default()))) };
        // Borders are told after the pose: those at hand were of the same step, of the one before, or of a later one.
        let place = place.unwrap_or(0);
        let around = life.said.range(place..).chain(life.said.range(..place).rev());
        let border = around.map(|said| said.border_to(instance)).find(|border| sum_of_said(border) == Some(sum));
        border.map_or_else(|| life.not_said(stamp_ns), |border| Ok(Some((pose, border))))
    }
}

impl Life {
    /// It is not computed from this tick on.
    fn doubt(&mut self, tick: u64, why: Why) {
        if self.doubt.is_none() {
            self.doubt = Some(Doubt { tick, why, commands: 0 });
            self.agent = None;
            self.waiting.clear();
        }
        let taken = self.used.drain(..).filter(|used| used.drive.is_some()).count() as u64;
        if let Some(doubt) = &mut self.doubt {
            doubt.commands += taken;
        }
    }

    /// A step with this stamp, or one before it, is not among those that are known: is it still to come?
    fn not_said(&self, stamp_ns: u64) -> Heard {
        let is_beyond = self.said.back().is_some_and(|said| said.stamp_ns > stamp_ns);
        if self.doubt.is_some() || is_beyond { Err(Why::Heard(self.name.clone())) } else { Ok(None) }
    }

    /// Compares the commands that the world used with those that its agent has computed by now; their number.
    fn compare(&mut self, differences: &mut Differences) -> u64 {
        let mut compared = 0;
        while let Some(used) = self.used.front().copied() {
            let stamp_ns = used.stamp_ns.unwrap_or(used.tick);
            match (self.said.binary_search_by_key(&stamp_ns, |said| said.stamp_ns), &mut self.doubt) {
                (Ok(place), _) => {
                    compare(&self.name, &used, &self.said[place].outputs, differences);
                    compared += 1;
                }
                (Err(_), Some(doubt)) => doubt.commands += u64::from(used.drive.is_some()),
                (Err(place), None) if place < self.said.len() => {
                    let steps = [format!("of a step at {stamp_ns} ns"), "no such step".to_owned()];
                    differences.add(Rank::Command, used.tick, Some(self.name.clone()), "command", steps);
                }
                // Its step is still to come.
                (Err(_), None) => break,
            }
            self.used.pop_front();
        }
        compared
    }
}

impl Said {
    fn border_to(&self, instance: RobotInstance) -> SharedBorder {
        let to = |borders: &SharedBorders| borders.to(instance.index.0, instance.incarnation);
        self.borders.as_deref().map(to).unwrap_or_default()
    }
}

fn compare(name: &str, used: &Used, outputs: &AgentOutputs, differences: &mut Differences) {
    let mut differ = |field: &str, values: [String; 2]| {
        differences.add(Rank::Command, used.tick, Some(name.to_owned()), field, values);
    };
    if !are_same(used.drive, Some(outputs.drive)) {
        let in_words = |drive: Option<Drive>| drive.map_or_else(|| "none".to_owned(), words_of);
        differ("command", [in_words(used.drive), in_words(Some(outputs.drive))]);
    }
    if used.state != outputs.plan {
        differ("state of its plan", [used.state, outputs.plan].map(|state| format!("{state:?}")));
    }
    let filtered = f64::from(outputs.filtered);
    if used.filtered.to_bits() != filtered.to_bits() {
        differ("change by its filter", [used.filtered, filtered].map(|value| format!("{value:?}")));
    }
}

fn words_of(drive: Drive) -> String {
    match drive {
        Drive::Velocity(velocity) => format!("velocity ({:?}, {:?}) m/s", velocity.x, velocity.y),
        Drive::Twist { speed_mps, turn_radps } => format!("twist {speed_mps:?} m/s, {turn_radps:?} rad/s"),
        Drive::Joints { rate_radps: [base, elbow] } => format!("joints {base:?}, {elbow:?} rad/s"),
        Drive::Wheels { rate_radps: [left, right] } => format!("wheels {left:?}, {right:?} rad/s"),
    }
}
