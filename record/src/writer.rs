//! From moments to the messages of a record. Pure but for what it writes to.

use crate::container::{Container, Encoding};
use crate::figures::{self, Counted, Figures};
use crate::frame::{Body, Tracks};
use crate::header::{self, About, Ending};
use crate::moment::Moment;
use crate::wire::Message;
use crate::{palette, scene, schema};
use geometry::Map;
use model::{Event, Robot, RobotIndex, Scenario};
use protocol::codec;
use std::collections::BTreeMap;
use std::io::{self, Write};

/// A chunk with more than this is ended, bytes.
const CHUNK_BYTES: usize = 1 << 20;
/// What is made to be looked at is written at most this often, Hz of simulated time.
const SHOWN_HZ: f64 = 50.0;
/// What stands is shown again after this long, s of simulated time.
const AGAIN_S: f64 = 1.0;

/// The channels that every record has, in the order of their numbers.
#[derive(Clone, Copy)]
enum Channel {
    Frame,
    Event,
    Robot,
    Input,
    Gap,
    Tf,
    Scene,
    Goals,
    Arms,
    Log,
    Metrics,
}

const PROTOBUF: Encoding = Encoding { message: "protobuf", schema: "protobuf" };

/// Topic and schema of each.
const CHANNELS: [(&str, &str); 11] = [
    (header::FRAME, "shoal.Frame"),
    (header::EVENT, "shoal.Event"),
    (header::ROBOT, "shoal.Robot"),
    (header::INPUT, "shoal.Input"),
    (header::GAP, "shoal.Gap"),
    ("/tf", "foxglove.FrameTransforms"),
    ("/scene", "foxglove.SceneUpdate"),
    ("/goals", "foxglove.SceneUpdate"),
    ("/arms", "foxglove.SceneUpdate"),
    ("/events", "foxglove.Log"),
    (header::METRICS, "shoal.Metrics"),
];

/// A robot in its slot, as it is shown.
struct Shown {
    robot: Robot,
    /// The channel of its poses.
    pose: u16,
    /// Where it was shown last, and at which tick.
    last: Option<(u64, Body)>,
}

/// What the writer had to leave out since it last wrote.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Gap {
    pub(crate) frames: u64,
    pub(crate) inputs: u64,
}

/// Writes a record, moment by moment.
pub(crate) struct RecordWriter<W: Write> {
    file: Container<W>,
    scenario: Scenario,
    channels: [u16; CHANNELS.len()],
    tracks: Tracks,
    /// The next frame is one that can be decoded by itself.
    key: bool,
    robots: Vec<Option<Shown>>,
    obstacles: BTreeMap<u32, (u64, Body)>,
    /// The present goals have been shown like this.
    goals: Vec<(u32, [f64; 2])>,
    /// Who is drawn has changed.
    restage: bool,
    /// Every so many ticks are shown.
    stride: u64,
    again: u64,
    last_tick: Option<u64>,
    left_out: Gap,
    memory: Vec<u8>,
}

impl<W: Write> RecordWriter<W> {
    /// Begins a record: what follows can be read, should nothing come after it.
    pub(crate) fn begin(to: W, scenario: &Scenario) -> io::Result<RecordWriter<W>> {
        let mut file = Container::begin(to, "", header::LIBRARY)?;
        file.metadata(header::METADATA, About::of(scenario).to_map())?;
        let bytes = codec::encode(scenario).map_err(invalid)?;
        file.attach(header::SCENARIO, "application/octet-stream", 0, &bytes)?;
        let readable = serde_json::to_vec_pretty(scenario).map_err(invalid)?;
        file.attach(header::SCENARIO_JSON, "application/json", 0, &readable)?;
        let mut channels = [0; CHANNELS.len()];
        for (channel, (topic, name)) in channels.iter_mut().zip(CHANNELS) {
            *channel = file.channel(topic, name, &PROTOBUF, &schema::descriptors(name), &BTreeMap::new())?;
        }
        if let Some(map) = &scenario.map {
            put_map(&mut file, map.map())?;
        }
        let hz = scenario.clock.tick_hz;
        let mut writer = RecordWriter {
            file,
            scenario: scenario.clone(),
            channels,
            tracks: Tracks::default(),
            key: true,
            robots: Vec::new(),
            obstacles: BTreeMap::new(),
            goals: Vec::new(),
            restage: true,
            stride: (hz / SHOWN_HZ).ceil().max(1.0) as u64,
            again: (hz * AGAIN_S).ceil().max(1.0) as u64,
            last_tick: None,
            left_out: Gap::default(),
            memory: Vec::new(),
        };
        for (index, robot) in (0..).zip(&scenario.robots) {
            writer.place(RobotIndex(index), robot)?;
        }
        writer.end_chunk()?;
        Ok(writer)
    }

    /// Somebody has this slot now.
    fn place(&mut self, index: RobotIndex, robot: &Robot) -> io::Result<()> {
        let topic = format!("/robots/{}/pose", robot.id);
        let name = "foxglove.PoseInFrame";
        let pose = self.file.channel(&topic, name, &PROTOBUF, &schema::descriptors(name), &BTreeMap::new())?;
        if self.robots.len() <= index.at() {
            self.robots.resize_with(index.at() + 1, || None);
        }
        self.robots[index.at()] = Some(Shown { robot: robot.clone(), pose, last: None });
        self.restage = true;
        Ok(())
    }

    fn time_ns(&self, tick: u64) -> u64 {
        header::time_ns(tick, self.scenario.clock.tick_hz)
    }

    fn put(&mut self, channel: Channel, tick: u64, message: Message) -> io::Result<()> {
        let time_ns = self.time_ns(tick);
        let written = self.file.message(self.channels[channel as usize], time_ns, tick as u32, message.bytes());
        self.memory = message.into_bytes();
        written
    }

    fn message(&mut self) -> Message {
        Message::reuse(std::mem::take(&mut self.memory))
    }

    /// Adds a moment; `gap` is what was left out before it.
    pub(crate) fn moment(&mut self, moment: &Moment, gap: Gap) -> io::Result<()> {
        if self.file.chunk_bytes() >= CHUNK_BYTES {
            self.end_chunk()?;
        }
        let tick = moment.tick;
        self.gap(tick, gap)?;
        for added in &moment.added {
            let mut message = self.message();
            let data = codec::encode(&added.robot).map_err(invalid)?;
            let robot = &added.robot;
            message.uint(1, tick).uint(2, added.index.0.into()).text(3, &robot.id).double(4, robot.radius_m);
            message.blob(5, &data);
            self.put(Channel::Robot, tick, message)?;
            self.place(added.index, robot)?;
        }
        self.frame(moment)?;
        let mut from = 0;
        for (told, source, until) in &moment.inputs {
            let (mut message, (source, incarnation)) = (self.message(), source.numbers());
            message.uint(1, *told).uint(2, source).uint(3, incarnation).blob(4, &moment.input_bytes[from..*until]);
            from = *until;
            self.put(Channel::Input, tick, message)?;
        }
        for event in &moment.events {
            self.event(tick, event)?;
        }
        self.show(moment)?;
        self.last_tick = Some(tick);
        Ok(())
    }

    fn gap(&mut self, tick: u64, gap: Gap) -> io::Result<()> {
        if gap == Gap::default() {
            return Ok(());
        }
        self.left_out = Gap { frames: self.left_out.frames + gap.frames, inputs: self.left_out.inputs + gap.inputs };
        let from = self.last_tick.map_or(0, |tick| tick + 1);
        let mut message = self.message();
        message.uint(1, from).uint(2, tick).uint(3, gap.frames).uint(4, gap.inputs);
        self.put(Channel::Gap, tick, message)
    }

    fn frame(&mut self, moment: &Moment) -> io::Result<()> {
        let mut bodies = Vec::with_capacity(32 * moment.bodies.len() + 8);
        self.tracks.encode(&moment.bodies, &mut bodies);
        let mut message = self.message();
        message.uint(1, moment.tick).uint(2, std::mem::take(&mut self.key).into());
        message.uint(3, moment.arrived.into()).uint(4, moment.contacts).blob(5, &bodies);
        self.put(Channel::Frame, moment.tick, message)
    }

    fn event(&mut self, tick: u64, event: &Event) -> io::Result<()> {
        let shown = |robot: RobotIndex| self.robots.get(robot.at()).and_then(Option::as_ref);
        let name = |robot: RobotIndex| shown(robot).map_or_else(String::new, |shown| shown.robot.id.clone());
        let (who, what) = (event.robot.map(name).unwrap_or_default(), event.kind.name());
        let detail = event.kind.detail(&name);
        let mut words = what.word().to_owned();
        if !detail.is_empty() {
            words = format!("{words}: {detail}");
        }
        if !who.is_empty() {
            words = format!("{who} {words}");
        }
        let data = codec::encode(event).map_err(invalid)?;
        let log = scene::log(self.time_ns(event.tick), what, &who, &words);
        let mut message = self.message();
        message.uint(1, event.tick).text(2, &who).text(3, what.word()).text(4, &detail).blob(5, &data);
        self.put(Channel::Event, tick, message)?;
        self.put(Channel::Log, tick, log)
    }

    /// What is made to be looked at.
    fn show(&mut self, moment: &Moment) -> io::Result<()> {
        let tick = moment.tick;
        if !tick.is_multiple_of(self.stride) {
            return Ok(());
        }
        let time_ns = self.time_ns(tick);
        if std::mem::take(&mut self.restage) {
            let robots = (0..).zip(&self.robots).filter_map(|(slot, shown)| Some((slot, &shown.as_ref()?.robot)));
            let message = scene::scene(&self.scenario.obstacles, robots);
            self.put(Channel::Scene, tick, message)?;
        }
        let mut transforms = self.message();
        for body in &moment.bodies {
            let again = self.again;
            let is_due = |last: &Option<(u64, Body)>| {
                last.as_ref()
                    .is_none_or(|(shown, last)| tick.saturating_sub(*shown) >= again || places(last) != places(body))
            };
            if body.is_obstacle() {
                if is_due(&self.obstacles.get(&body.index).copied()) {
                    self.obstacles.insert(body.index, (tick, *body));
                    scene::put_transform(&mut transforms, time_ns, &palette::obstacle_frame(body.index), body);
                }
            } else if let Some(Some(shown)) = self.robots.get_mut(body.index as usize)
                && is_due(&shown.last)
            {
                shown.last = Some((tick, *body));
                scene::put_transform(&mut transforms, time_ns, &shown.robot.id, body);
                let pose = scene::pose(time_ns, body);
                self.file.message(shown.pose, time_ns, tick as u32, pose.bytes())?;
            }
        }
        if transforms.bytes().is_empty() {
            self.memory = transforms.into_bytes();
        } else {
            self.put(Channel::Tf, tick, transforms)?;
        }
        self.show_goals(moment)?;
        self.show_arms(moment)
    }

    fn show_goals(&mut self, moment: &Moment) -> io::Result<()> {
        let robots = || moment.bodies.iter().filter(|body| !body.is_obstacle());
        if robots().map(|body| (body.index, body.goal_m)).eq(self.goals.iter().copied()) {
            return Ok(());
        }
        self.goals = robots().map(|body| (body.index, body.goal_m)).collect();
        let goals = self
            .goals
            .iter()
            .filter_map(|(slot, goal)| Some((*slot, &self.robots.get(*slot as usize)?.as_ref()?.robot, *goal)));
        let message = scene::goals(goals);
        self.put(Channel::Goals, moment.tick, message)
    }

    fn show_arms(&mut self, moment: &Moment) -> io::Result<()> {
        let arms = moment.bodies.iter().filter(|body| !body.is_obstacle()).filter_map(|body| {
            let robot = &self.robots.get(body.index as usize)?.as_ref()?.robot;
            Some((body.index, robot, robot.arm.as_ref()?, body.joints_rad))
        });
        let message = scene::arms(arms);
        if message.bytes().is_empty() { Ok(()) } else { self.put(Channel::Arms, moment.tick, message) }
    }

    /// Adds what the processes have counted so far.
    pub(crate) fn figures(&mut self, figures: &[(Counted, Figures)]) -> io::Result<()> {
        let Some(tick) = self.last_tick.filter(|_| !figures.is_empty()) else { return Ok(()) };
        let mut message = self.message();
        message.uint(1, tick);
        for (counted, figures) in figures {
            let name = match counted {
                Counted::Fleet => "fleet",
                Counted::World => "world",
                Counted::Robot(robot) => match self.robots.get(robot.at()) {
                    Some(Some(shown)) => shown.robot.id.as_str(),
                    _ => continue,
                },
            };
            figures::put(&mut message, name, figures);
        }
        self.put(Channel::Metrics, tick, message)
    }

    /// There is something that a kill would cost.
    pub(crate) fn has_open_chunk(&self) -> bool {
        self.file.chunk_bytes() > 0
    }

    /// Ends the chunk: what was written so far is kept from now on, whatever happens.
    pub(crate) fn end_chunk(&mut self) -> io::Result<()> {
        self.tracks.restart();
        self.key = true;
        self.file.end_chunk()
    }

    /// Ends the record with what the run came to, and gives back what it was written to.
    pub(crate) fn finish(mut self, ending: &Ending, gap: Gap) -> io::Result<W> {
        let tick = ending.outcome.ticks;
        self.gap(tick, gap)?;
        let bytes = codec::encode(&ending.outcome).map_err(invalid)?;
        let time_ns = self.time_ns(tick);
        self.file.attach(header::OUTCOME, "application/octet-stream", time_ns, &bytes)?;
        let readable = serde_json::to_vec_pretty(&ending.outcome).map_err(invalid)?;
        self.file.attach(header::OUTCOME_JSON, "application/json", time_ns, &readable)?;
        self.file.metadata(header::METADATA_END, ending.to_map(self.left_out.frames, self.left_out.inputs))?;
        self.file.finish()
    }
}

/// Writes a map: its bytes in parts, each in a chunk of its own, which packs it; and its walls as viewers show them. Both once.
fn put_map<W: Write>(file: &mut Container<W>, map: &Map) -> io::Result<()> {
    let none = BTreeMap::new();
    let parts = file.channel(header::MAP, "shoal.Map", &PROTOBUF, &schema::descriptors("shoal.Map"), &none)?;
    for (part, sequence) in map.bytes().chunks(CHUNK_BYTES).zip(0..) {
        let mut message = Message::default();
        message.blob(1, part);
        file.message(parts, 0, sequence, message.bytes())?;
        file.end_chunk()?;
    }
    let name = "foxglove.SceneUpdate";
    let shown = file.channel(header::MAP_SHOWN, name, &PROTOBUF, &schema::descriptors(name), &none)?;
    file.message(shown, 0, 0, scene::walls(map).bytes())?;
    file.end_chunk()
}

/// What a viewer sees of a body.
fn places(body: &Body) -> ([f64; 2], f64) {
    (body.position_m, body.yaw_rad)
}

fn invalid(error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, error)
}
