//! The world of a recorded run, told again what it was told, and held against everything that the record says of it.

use crate::fleet::{Fleet, Used};
use crate::verdict::{Differences, Rank, Verdict};
use crate::views::Views;
use model::{Event, Mode, Outcome, PlanState, RobotInstance, Scenario};
use protocol::inputs::{AgentNote, WorldInput, WorldInputs};
use record::Body;
use serde_json::Value;
use std::collections::VecDeque;
use world_sim::World;
use world_sim::recorder::bodies_of;

/// A frame: its tick, and its bodies.
type Frame = (u64, Vec<Body>);

/// Replays a run from what its record holds, handed over in the order of the record, and compares.
pub struct Verifier {
    scenario: Scenario,
    world: World,
    is_open: bool,
    /// Agents have noted what they had; else it follows from the world.
    is_noted: bool,
    fleet: Fleet,
    views: Views,
    differences: Differences,
    recorded: VecDeque<Frame>,
    replayed: VecDeque<Frame>,
    /// Of the tick that is open: what came with the commands.
    planned: Vec<(RobotInstance, PlanState, f64)>,
    commanded: Vec<(RobotInstance, u64)>,
    events: VecDeque<Event>,
    events_compared: usize,
    frames: u64,
    /// Frames that may still be missing.
    left_out: u64,
    next_inputs: u64,
    ends_early: Option<(u64, String)>,
}

impl Verifier {
    /// A replay of a run of this scenario, in the clock mode in which it was run.
    pub fn new(scenario: &Scenario) -> Verifier {
        Verifier {
            scenario: scenario.clone(),
            world: World::new(scenario),
            is_open: false,
            is_noted: scenario.clock.mode == Mode::Realtime,
            fleet: Fleet::new(scenario),
            views: Views::new(scenario.clock.tick_hz),
            differences: Differences::default(),
            recorded: VecDeque::new(),
            replayed: VecDeque::new(),
            planned: Vec::new(),
            commanded: Vec::new(),
            events: VecDeque::new(),
            events_compared: 0,
            frames: 0,
            left_out: 0,
            next_inputs: 0,
            ends_early: None,
        }
    }

    /// The tick that the replay has come to.
    pub fn tick(&self) -> u64 {
        self.world.tick()
    }

    /// A frame of the record.
    pub fn frame(&mut self, tick: u64, bodies: &[Body]) {
        if self.ends_early.is_none() {
            self.recorded.push_back((tick, bodies.to_vec()));
            self.compare_frames();
        }
    }

    /// This number of frames may be missing: the record says that it has left them out.
    pub fn allow_missing(&mut self, frames: u64) {
        self.left_out = frames;
    }

    /// An entry of the log, as the record has it.
    pub fn event(&mut self, event: &Event) {
        if self.ends_early.is_none() {
            self.events.push_back(event.clone());
            self.compare_events();
        }
    }

    /// What an agent noted.
    pub fn note(&mut self, instance: RobotInstance, note: AgentNote) {
        if self.is_noted && self.ends_early.is_none() {
            self.fleet.note(instance, note, self.world.tick());
        }
    }

    /// From here on the world cannot be replayed: inputs of it are missing. What the record holds after this is not looked at.
    pub fn ends(&mut self, why: &str) {
        let tick = self.world.tick();
        self.ends_early.get_or_insert_with(|| (tick, why.to_owned()));
    }

    /// Inputs of the world, in their order.
    pub fn inputs(&mut self, told: &WorldInputs) {
        if self.ends_early.is_none() && told.number != self.next_inputs {
            self.ends("inputs of the world are missing");
        }
        self.next_inputs += 1;
        for input in &told.inputs {
            if self.ends_early.is_some() {
                return;
            }
            self.input(input);
        }
        if self.is_noted {
            self.fleet.go_on(&self.views, &mut self.differences);
        }
    }

    fn input(&mut self, input: &WorldInput) {
        match input {
            WorldInput::Order(order) => self.world.order(order.clone()),
            WorldInput::Refused => self.world.refuse_orders(),
            WorldInput::TookEffect => self.world.take_effect(),
            WorldInput::Answered => {
                self.world.due();
            }
            WorldInput::StoodStill { lost_ms } => self.world.stood_still(*lost_ms),
            WorldInput::Back(instance) => self.world.back(*instance),
            WorldInput::WentOn { .. } => {
                self.ends("another process went on as the world, from a state that the record does not hold");
            }
            WorldInput::Planned { instance, state, filtered } => {
                self.world.planned(*instance, *state, *filtered);
                self.planned.push((*instance, *state, *filtered));
            }
            WorldInput::Commanded { instance, stamp_ns } => self.commanded.push((*instance, *stamp_ns)),
            WorldInput::Opened { .. } if self.is_open => self.ends("a tick was opened twice"),
            WorldInput::Opened { ready } => self.open(ready),
            WorldInput::Closed { .. } if !self.is_open => self.ends("a tick was closed that was not open"),
            WorldInput::Closed { drives } => self.close(drives),
        }
    }

    fn open(&mut self, ready: &[RobotInstance]) {
        self.is_open = true;
        self.world.open(&mut |instance| ready.contains(&instance));
        self.fleet.enter(&self.world);
        if self.is_noted {
            self.views.keep(&self.world);
        } else {
            self.fleet.plan(&self.world);
        }
        self.show();
    }

    fn close(&mut self, drives: &[Option<model::Drive>]) {
        self.is_open = false;
        let tick = self.world.tick();
        let participants = self.world.participants().to_vec();
        if drives.len() != participants.len() {
            let counts = [drives.len(), participants.len()].map(|count| count.to_string());
            self.differences.add(Rank::Frame, tick, None, "number of robots that take part", counts);
        }
        for (instance, drive) in participants.iter().zip(drives) {
            let stamp_of = |(who, stamp_ns): &(RobotInstance, u64)| (who == instance).then_some(*stamp_ns);
            let stamp_ns = if self.is_noted { self.commanded.iter().find_map(stamp_of) } else { None };
            match self.planned.iter().find(|(who, ..)| who == instance) {
                Some(&(_, state, filtered)) => {
                    let used = Used { tick, stamp_ns, drive: *drive, state, filtered };
                    self.fleet.used(*instance, used, &mut self.differences);
                }
                None if self.is_noted => {}
                None => self.fleet.not_answered(*instance, tick),
            }
        }
        self.planned.clear();
        self.commanded.clear();
        let command = |instance: RobotInstance| {
            let place = participants.binary_search_by_key(&instance.index, |who| who.index).ok()?;
            drives.get(place).copied().flatten()
        };
        self.world.close(&mut |instance| command(instance));
        self.world.take_notices();
        self.compare_events();
    }

    /// What observers see now.
    fn show(&mut self) {
        self.replayed.push_back((self.world.tick(), bodies_of(&self.world)));
        self.compare_frames();
    }

    fn compare_frames(&mut self) {
        while let (Some((recorded, _)), Some((replayed, _))) = (self.recorded.front(), self.replayed.front()) {
            let (recorded, replayed) = (*recorded, *replayed);
            if recorded > replayed {
                self.replayed.pop_front();
                self.missing_frame(replayed);
                continue;
            }
            let Some((_, bodies)) = self.recorded.pop_front() else { return };
            if recorded < replayed {
                self.extra_frame(recorded);
                continue;
            }
            if let Some((_, again)) = self.replayed.pop_front() {
                self.frames += 1;
                self.compare_bodies(recorded, &bodies, &again);
            }
        }
    }

    fn missing_frame(&mut self, tick: u64) {
        if self.left_out > 0 {
            self.left_out -= 1;
        } else {
            let words = ["none".to_owned(), "a frame".to_owned()];
            self.differences.add(Rank::Frame, tick, None, "frame", words);
        }
    }

    fn extra_frame(&mut self, tick: u64) {
        let words = ["a frame".to_owned(), "none".to_owned()];
        self.differences.add(Rank::Frame, tick, None, "frame", words);
    }

    fn compare_bodies(&mut self, tick: u64, recorded: &[Body], replayed: &[Body]) {
        let key = |body: &Body| (body.is_obstacle(), body.index);
        let (mut one, mut other) = (recorded.iter().peekable(), replayed.iter().peekable());
        loop {
            let (ours, theirs) = (one.peek().copied(), other.peek().copied());
            let (only, words) = match (ours, theirs) {
                (None, None) => return,
                (Some(a), Some(b)) if key(a) == key(b) => {
                    one.next();
                    other.next();
                    self.compare_body(tick, a, b);
                    continue;
                }
                (Some(a), b) if b.is_none_or(|b| key(a) < key(b)) => {
                    one.next();
                    (a, ["there", "not there"])
                }
                (_, Some(b)) => {
                    other.next();
                    (b, ["not there", "there"])
                }
                (Some(_), None) => return,
            };
            let name = self.name_of(only);
            self.differences.add(Rank::Frame, tick, name, "body", words.map(str::to_owned));
        }
    }

    fn compare_body(&mut self, tick: u64, recorded: &Body, replayed: &Body) {
        if recorded.flags != replayed.flags {
            let flags = [recorded, replayed].map(|body| format!("{:#x}", body.flags));
            self.differences.add(Rank::Frame, tick, self.name_of(recorded), "flags", flags);
        }
        for ((field, one), (_, other)) in fields(recorded).into_iter().zip(fields(replayed)) {
            if one.to_bits() != other.to_bits() {
                let values = [format!("{one:?}"), format!("{other:?}")];
                self.differences.add(Rank::Frame, tick, self.name_of(recorded), field, values);
            }
        }
    }

    fn name_of(&self, body: &Body) -> Option<String> {
        let index = body.index as usize;
        Some(if body.is_obstacle() {
            format!("obstacle {index}")
        } else {
            self.world.robot(index).map_or_else(|| format!("#{index}"), |robot| robot.id.clone())
        })
    }

    /// Compares the log so far, as far as the record and the replay have it.
    fn compare_events(&mut self) {
        while let (Some(recorded), Some(replayed)) =
            (self.events.front(), self.world.events().get(self.events_compared))
        {
            if recorded != replayed {
                let tick = recorded.tick.min(replayed.tick);
                let robot = recorded.robot.and_then(|robot| self.world.robot(robot.at())).map(|robot| robot.id.clone());
                let words = [recorded, replayed].map(|event| format!("{} {:?}", event.tick, event.kind));
                self.differences.add(Rank::Event, tick, robot, "event", words);
            }
            self.events.pop_front();
            self.events_compared += 1;
        }
    }

    /// The record is over. With its outcome it is whole; without, it ends somewhere.
    pub fn finish(mut self, outcome: Option<&Outcome>) -> Verdict {
        let is_whole = outcome.is_some() && self.ends_early.is_none();
        let has_last = self.recorded.front().is_some_and(|(tick, _)| *tick == self.world.tick());
        if (has_last || is_whole) && !self.is_open {
            self.show();
        }
        if self.ends_early.is_none() {
            for (tick, _) in std::mem::take(&mut self.recorded) {
                // Its inputs may be behind the cut.
                if is_whole {
                    self.extra_frame(tick);
                }
            }
            if is_whole {
                self.finish_whole(outcome);
            }
        }
        self.fleet.finish(is_whole, &self.views, &mut self.differences);
        Verdict {
            ticks: self.world.tick(),
            frames: self.frames,
            steps: self.fleet.steps,
            commands: self.fleet.commands,
            events: self.events_compared as u64,
            trajectory_hash: self.world.trajectory_hash(),
            is_whole,
            ends_early: self.ends_early,
            unverified: self.fleet.unverified(),
            differences: self.differences.count,
            first: self.differences.into_first(),
        }
    }

    fn finish_whole(&mut self, outcome: Option<&Outcome>) {
        for (tick, _) in std::mem::take(&mut self.replayed) {
            self.missing_frame(tick);
        }
        let missing = self.world.events().get(self.events_compared..).unwrap_or_default();
        for event in missing {
            let words = ["none".to_owned(), format!("{:?}", event.kind)];
            self.differences.add(Rank::Event, event.tick, None, "event", words);
        }
        for event in std::mem::take(&mut self.events) {
            let words = [format!("{:?}", event.kind), "none".to_owned()];
            self.differences.add(Rank::Event, event.tick, None, "event", words);
        }
        let (Some(recorded), replayed) = (outcome, self.world.outcome()) else { return };
        if *recorded != replayed {
            let (field, values) = first_in(recorded, &replayed);
            self.differences.add(Rank::Outcome, self.world.tick(), None, format!("outcome, {field}"), values);
        }
    }

    /// The scenario that is replayed.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }
}

/// The numbers of a body, each with what it is.
pub(crate) fn fields(body: &Body) -> [(&'static str, f64); 7] {
    let Body { position_m: [x, y], yaw_rad, goal_m: [goal_x, goal_y], joints_rad: [base, elbow], .. } = *body;
    [
        ("x_m", x),
        ("y_m", y),
        ("yaw_rad", yaw_rad),
        ("goal_x_m", goal_x),
        ("goal_y_m", goal_y),
        ("joint_base_rad", base),
        ("joint_elbow_rad", elbow),
    ]
}

/// The first part in which two outcomes differ, and what it is in each.
pub(crate) fn first_in(one: &Outcome, other: &Outcome) -> (String, [String; 2]) {
    let value = |outcome: &Outcome| serde_json::to_value(outcome).unwrap_or(Value::Null);
    let (mut path, mut one, mut other) = (String::new(), value(one), value(other));
    loop {
        let (key, pair) = match (&one, &other) {
            (Value::Object(a), Value::Object(b)) => {
                let differs = a.iter().find(|(key, value)| b.get(*key) != Some(value));
                let Some((key, value)) = differs else { break };
                (key.clone(), (value.clone(), b.get(key).cloned().unwrap_or(Value::Null)))
            }
            (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
                let Some(place) = (0..a.len()).find(|place| a[*place] != b[*place]) else { break };
                (place.to_string(), (a[place].clone(), b[place].clone()))
            }
            _ => break,
        };
        path = if path.is_empty() { key } else { format!("{path}.{key}") };
        (one, other) = pair;
    }
    (path, [one.to_string(), other.to_string()])
}
