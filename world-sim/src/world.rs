//! The tick: what happens in which order. Everything here goes through the slots in their order, so that a run is a
//! function of its scenario, its orders and its commands.

mod checkpoint;
mod orders;
mod outcome;
mod solid;
mod tape;
mod tasks;
mod timeline;
mod views;

use crate::arm::{self, Arm};
use crate::body::Body;
use crate::contact::{Contact, Contacts};
use crate::crossings::Crossings;
use crate::faults::Faults;
use crate::grid::Grid;
use crate::journal::Journal;
use crate::links::Parts;
use crate::opener::{Opener, Opens};
use crate::presence::{Presence, State};
use crate::ranges::Ranges;
use crate::referee::Referee;
use crate::shapes::Shapes;
use crate::touch;
use crate::walls::Walls;
use model::kinematics::fits;
use model::{
    Clock, Drive, EventKind, FilterCount, FilterKind, MAX_ROBOTS, PaceState, Partner, Physics, PlanState, Radio, Robot,
    RobotIndex, RobotInstance, Scenario, StragglerPolicy, TimelineAction, TimelineEvent, Touch,
};
use nalgebra::Point2;
use protocol::daemon_to_world::{Absence, Order};
use protocol::inputs::{WorldInput, WorldInputs};
use protocol::world_to_robot::{Impairment, Piece};

pub use checkpoint::{Checkpoint, CheckpointError};
use orders::excuses;
use solid::Solid;
pub use tasks::{NOT_ITS_TASK, ROBOT_GONE, TOO_MANY_GOALS};

/// Why a task or a fault is refused: no robot has this index.
const UNKNOWN: &str = "unknown robot";

/// The world of one run. See the crate's documentation for its cycle.
pub struct World {
    clock: Clock,
    straggler: StragglerPolicy,
    slots_max: usize,
    /// A process is asked for this long before its robot enters, ticks.
    ahead_ticks: u64,

    tick: u64,
    is_open: bool,
    /// Orders or events have taken effect since the last tick was closed.
    stirred: bool,
    stopped: bool,
    opener: Opener,
    orders: Vec<Order>,
    events: Vec<TimelineEvent>,
    /// The first event of the timeline that has not happened yet.
    next_event: usize,

    // By slot.
    robots: Vec<Option<Robot>>,
    presences: Vec<Presence>,
    referees: Vec<Option<Referee>>,
    bodies: Vec<Body>,
    /// The arms among them.
    arms: Vec<Arm>,
    /// Odometry flags as last shown.
    shown: Vec<u32>,
    /// Robots whose bad command has been logged.
    scolded: Vec<bool>,
    /// Whether each robot's method has a plan.
    plans: Vec<PlanState>,
    /// What filters have done to commands.
    filter: FilterCount,
    /// The radio of robots that are added later.
    radio: Radio,
    /// By slot: what is done to the robot on purpose, and what it is told of that.
    faults: Vec<Faults>,
    impairments: Vec<Impairment>,
    /// No fault ends before this tick.
    faults_end: u64,
    /// No task has a deadline before this tick.
    tasks_end: u64,
    /// A robot that stays at one place for this number of ticks cannot reach its task.
    stuck_ticks: u64,
    /// Robots that do not get to what they head for, of the tick that was closed last.
    stuck: Vec<RobotIndex>,

    shapes: Shapes,
    /// The walls of the map, if there is one. They are not pieces.
    walls: Option<Walls>,
    /// Where bodies have weight and push each other.
    solid: Option<Solid>,
    grid: Grid,
    ranges: Ranges,
    contacts: Contacts,
    crossings: Crossings,
    journal: Journal,
    /// What it was told since the recorder took it last, if the run is recorded.
    tape: Option<WorldInputs>,
    hash: u64,
    /// Goals reached by robots that have left and whose slot another robot has now.
    goals_before: u64,

    // Buffers of the open tick.
    participants: Vec<RobotInstance>,
    due: Vec<RobotInstance>,
    entered: Vec<usize>,
    odometry_changed: Vec<usize>,
    pieces: Vec<Piece>,
    pieces_changed: Vec<usize>,
    impairments_changed: Vec<usize>,
}

/// What has to be written because the tick opened: slots and indices, sorted. The views of [`World`] say what.
#[derive(Clone, Copy, Debug)]
pub struct Opening<'a> {
    /// Slots whose odometry is new: all participants, and robots that no longer take part since this tick.
    pub odometry: &'a [usize],
    /// Slots whose list of neighbours is not what it was.
    pub neighbors: &'a [usize],
    /// Slots whose list of pieces in sight is not what it was.
    pub sensed: &'a [usize],
    /// Pieces that appeared or moved.
    pub pieces: &'a [usize],
    /// Slots whose radio or processor is not what it was.
    pub impairments: &'a [usize],
}

impl World {
    /// The world before its first tick. The processes that it needs at once are in the notices.
    pub fn new(scenario: &Scenario) -> World {
        let clock = scenario.clock;
        let shapes = Shapes::new(&scenario.obstacles, clock.seed);
        let solid = match scenario.physics {
            Physics::Kinematic => None,
            Physics::Rapier => Some(Solid::new(clock.dt_s(), &shapes)),
        };
        let mut world = World {
            clock,
            straggler: scenario.fleet.straggler,
            slots_max: scenario.fleet.max_robots.min(MAX_ROBOTS),
            ahead_ticks: (0.5 * clock.tick_hz).ceil().max(1.0) as u64,
            tick: 0,
            is_open: false,
            stirred: false,
            stopped: false,
            opener: Opener::new(clock.dt_s()),
            orders: Vec::new(),
            events: scenario.events.clone(),
            next_event: 0,
            robots: Vec::new(),
            presences: Vec::new(),
            referees: Vec::new(),
            bodies: Vec::new(),
            arms: Vec::new(),
            shown: Vec::new(),
            scolded: Vec::new(),
            plans: Vec::new(),
            filter: FilterCount::default(),
            radio: scenario.radio,
            faults: Vec::new(),
            impairments: Vec::new(),
            faults_end: u64::MAX,
            tasks_end: u64::MAX,
            stuck_ticks: (scenario.fleet.stuck_limit_s * clock.tick_hz).ceil() as u64,
            stuck: Vec::new(),
            shapes,
            walls: scenario.walls().cloned().map(Walls),
            solid,
            grid: Grid::default(),
            ranges: Ranges::default(),
            contacts: Contacts::new(),
            crossings: Crossings::default(),
            journal: Journal::default(),
            tape: None,
            hash: 0,
            goals_before: 0,
            participants: Vec::new(),
            due: Vec::new(),
            entered: Vec::new(),
            odometry_changed: Vec::new(),
            pieces: Vec::new(),
            pieces_changed: Vec::new(),
            impairments_changed: Vec::new(),
        };
        for (slot, robot) in scenario.robots.iter().enumerate() {
            let joins = |event: &&TimelineEvent| matches!(event.what, TimelineAction::Join { robot } if robot == slot);
            let instance = RobotInstance { index: RobotIndex::of(slot), incarnation: 0 };
            world.place(instance, robot, scenario.events.iter().find(joins).map_or(0, |event| event.tick));
        }
        world.announce();
        world
    }

    /// Gives a slot its robot, to enter at `at`. Of a robot that had the slot before, nothing is left there; the goals that it
    /// reached stay counted.
    fn place(&mut self, instance: RobotInstance, robot: &Robot, at: u64) {
        let slot = instance.index.at();
        for vacant in self.robots.len()..=slot {
            self.robots.push(None);
            self.referees.push(None);
            self.presences.push(Presence::vacant(vacant));
            self.bodies.push(Body::new(vacant, robot));
            self.shown.push(0);
            self.scolded.push(false);
            self.plans.push(PlanState::Ready);
            self.faults.push(Faults::none(Radio::PERFECT));
            self.impairments.push(Impairment::default());
        }
        let mut referee = Referee::new(slot, robot, self.clock.seed, self.clock.dt_s());
        referee.move_goal(self.time_s());
        self.bodies[slot] = Body::new(slot, robot);
        self.faults[slot] = Faults::none(self.radio);
        self.impair(slot);
        if let Some(setup) = &robot.arm {
            let arm = Arm::new(slot, slot + self.arms.len(), setup);
            self.bodies[slot].pose = arm.pose();
            self.arms.push(arm);
        }
        (self.scolded[slot], self.plans[slot]) = (false, PlanState::Ready);
        self.contacts.forget(slot);
        self.crossings.forget(slot);
        if let Some(solid) = &mut self.solid {
            solid.leave(slot);
        }
        self.presences[slot] = Presence::awaited(instance, at, robot.restart);
        self.goals_before += self.referees[slot].as_ref().map_or(0, |before| u64::from(before.goals_done));
        self.referees[slot] = Some(referee);
        self.robots[slot] = Some(robot.clone());
    }

    /// Whether this is the present incarnation of a robot, with a process that runs or is about to start. Messages about any
    /// other instance are ignored.
    pub fn has_process(&self, instance: RobotInstance) -> bool {
        let presence = self.presences.get(instance.index.at());
        presence.is_some_and(|presence| presence.instance() == instance && presence.has_process())
            || self.orders.iter().any(|order| matches!(order, Order::Admit { instance: new, .. } if *new == instance))
    }

    /// Time stood still for the world's process: it goes on from now, and does not make up for it.
    pub fn stood_still(&mut self, lost_ms: u64) {
        self.keep(|| WorldInput::StoodStill { lost_ms });
        self.journal.note(self.tick, None, EventKind::Gap { lost_ms });
    }

    /// Whether this robot takes part, says the newest tick.
    pub fn takes_part(&self, instance: RobotInstance) -> bool {
        let presence = self.presences.get(instance.index.at());
        presence.is_some_and(|presence| presence.instance() == instance && presence.takes_part())
    }

    /// A robot that was held answers again: it takes part from the next opening on. One that was to be held then is not.
    pub fn back(&mut self, instance: RobotInstance) {
        self.keep(|| WorldInput::Back(instance));
        let passed = |cause: &Absence| matches!(cause, Absence::Overdue | Absence::Stopped);
        self.orders.retain(
            |order| !matches!(order, Order::Absent { instance: who, cause } if *who == instance && passed(cause)),
        );
        if let Some(presence) = self.presences.get_mut(instance.index.at()) {
            presence.back(instance);
        }
    }

    /// The instances that must be ready before this tick may open, by slot: initial robots, and joins, restarts and resumes
    /// due now or earlier. A robot instance that has been reported absent is not among them any more.
    pub fn due(&mut self) -> &[RobotInstance] {
        if self.answer_daemon() {
            self.keep(|| WorldInput::Answered);
        }
        let mut due = std::mem::take(&mut self.due);
        due.clear();
        let tick = self.tick;
        let instances = self.presences.iter().filter(|presence| presence.due(tick)).map(Presence::instance);
        due.extend(instances.filter(|instance| !self.orders.iter().any(|order| excuses(order, *instance))));
        self.due = due;
        &self.due
    }

    /// Opens the tick: orders take effect, then the timeline, then instances that are due and `ready` enter; the others
    /// stay due. Afterwards the views hold until [`close`](World::close).
    pub fn open(&mut self, ready: &mut dyn FnMut(RobotInstance) -> bool) -> Opening<'_> {
        assert!(!self.is_open, "a tick is opened once");
        self.is_open = true;
        self.give_up_tasks();
        // Robots come to be gone, and tasks to have deadlines, by orders and events alone.
        self.stirred |= self.events.get(self.next_event).is_some_and(|next| next.tick <= self.tick);
        self.apply_orders();
        self.end_faults();
        self.apply_timeline();
        if std::mem::take(&mut self.stirred) || self.tick >= self.tasks_end {
            self.drop_tasks();
        }
        self.enter(ready);
        self.announce();
        self.refresh();
        self.opening()
    }

    /// What the open tick changed, once more: the borrow of [`open`](World::open) excludes the views.
    pub fn opening(&self) -> Opening<'_> {
        Opening {
            odometry: &self.odometry_changed,
            neighbors: self.ranges.heard_changed(),
            sensed: self.ranges.sensed_changed(),
            pieces: &self.pieces_changed,
            impairments: &self.impairments_changed,
        }
    }

    fn enter(&mut self, ready: &mut dyn FnMut(RobotInstance) -> bool) {
        let tick = self.tick;
        let mut were_ready = Vec::new();
        let mut ready = |instance| {
            let is_ready = ready(instance);
            were_ready.extend((is_ready && self.tape.is_some()).then_some(instance));
            is_ready
        };
        self.entered.clear();
        for (slot, presence) in self.presences.iter_mut().enumerate() {
            let answers = presence.state == State::Held { answers: true };
            if answers || presence.due(tick) && ready(presence.instance()) {
                if presence.enter(tick, &mut self.journal) {
                    self.entered.push(slot);
                }
                if let Some(referee) = &mut self.referees[slot] {
                    referee.faces(self.bodies[slot].pose.yaw_rad);
                    referee.judge([self.bodies[slot].pose.position; 2], tick, &mut self.journal);
                }
            }
        }
        self.keep(|| WorldInput::Opened { ready: were_ready });
    }

    fn announce(&mut self) {
        for presence in &mut self.presences {
            presence.announce(self.tick, self.ahead_ticks, &mut self.journal);
        }
    }

    /// Brings everything that is seen of the world up to date with who takes part.
    fn refresh(&mut self) {
        self.participants.clear();
        self.odometry_changed.clear();
        self.shapes.open();
        for slot in 0..self.bodies.len() {
            let (presence, body) = (&self.presences[slot], &mut self.bodies[slot]);
            body.instance = presence.instance();
            body.in_world = presence.in_world();
            body.takes_part = presence.takes_part();
            let is_heard = body.takes_part && !self.faults[slot].is_mute();
            body.on_radio = is_heard && presence.on_radio(self.tick);
            body.speaks_first = is_heard && !body.on_radio;
            body.from = body.pose.position;
            if body.takes_part {
                self.participants.push(body.instance);
            } else if self.solid.is_none() {
                body.pose.halt();
            }
            let flags = self.flags(slot);
            if self.bodies[slot].takes_part || flags != self.shown[slot] {
                self.odometry_changed.push(slot);
                self.shown[slot] = flags;
            }
        }
        for arm in &mut self.arms {
            arm.from_rad = arm.state.joints_rad;
            if !self.bodies[arm.slot].takes_part {
                arm.halt();
            }
        }
        self.contacts.enter(&self.entered, &self.bodies, &self.arms, &self.shapes, self.walls.as_ref());
        if let Some(solid) = &mut self.solid {
            solid.open(&self.bodies, &self.robots);
            self.contacts.found.retain(|contact| solid.overlap(*contact));
        }
        self.log_contacts(self.tick);
        self.grid.rebuild(&self.bodies);
        self.ranges.update(&self.bodies, &self.arms, &self.shapes, &self.grid);
        self.refresh_pieces();
    }

    fn refresh_pieces(&mut self) {
        let shape_pieces = self.shapes.len();
        let first = self.pieces.is_empty();
        self.pieces.resize(shape_pieces + self.bodies.len() + self.arms.len(), Piece::default());
        self.pieces_changed.clear();
        for index in 0..self.pieces.len() {
            let in_sight = match index.checked_sub(shape_pieces) {
                Some(piece) => {
                    let (slot, _) = arm::owner(&self.arms, piece);
                    self.ranges.is_shown(slot) || self.bodies[slot].has_seen_links()
                }
                None => first || self.shapes.obstacles[self.shapes.owner(index)].moves(),
            };
            if in_sight {
                let piece = self.piece(index);
                // A body may come to be seen again where it was seen last, but then nobody needs to be told.
                if first || piece != self.pieces[index] {
                    self.pieces[index] = piece;
                    self.pieces_changed.push(index);
                }
            }
        }
    }

    /// A robot says whether its method has a plan, and how much its filter has changed the command, in greatest speeds: to be
    /// called before the tick closes. That it gave up is an event.
    pub fn planned(&mut self, instance: RobotInstance, state: PlanState, filtered: f64) {
        self.keep(|| WorldInput::Planned { instance, state, filtered });
        let slot = instance.index.at();
        if self.robots.get(slot).and_then(Option::as_ref).is_some_and(|robot| robot.filter != FilterKind::None) {
            self.filter.commands += 1;
            if filtered > 0.0 {
                self.filter.changed += 1;
                // From one end of its speeds to the other.
                self.filter.change += filtered.min(2.0);
            }
        }
        let Some(known) = self.plans.get_mut(slot) else { return };
        if std::mem::replace(known, state) != state && state == PlanState::GaveUp {
            self.journal.note_quietly(self.tick, instance.index, || EventKind::GaveUp);
            self.stuck.push(instance.index);
        }
    }

    /// Closes the tick: everyone drives as `commands` says for `participants`, and stands still without a command;
    /// obstacles and goals move, contacts are counted and goals judged. Afterwards [`tick`](World::tick) is one more.
    pub fn close(&mut self, commands: &mut dyn FnMut(RobotInstance) -> Option<Drive>) {
        assert!(self.is_open, "only an open tick can be closed");
        let mut drives = Vec::new();
        for index in 0..self.participants.len() {
            let instance = self.participants[index];
            let drive = commands(instance);
            if self.tape.is_some() {
                drives.push(drive);
            }
            self.obey(instance, drive);
        }
        self.keep(|| WorldInput::Closed { drives });
        self.tick += 1;
        let time_s = self.time_s();
        self.shapes.advance(time_s);
        if let Some(solid) = &mut self.solid {
            solid.pass(&mut self.bodies, &self.shapes);
        }
        self.contacts.sweep(&self.bodies, &self.arms, &self.shapes, self.walls.as_ref(), &self.grid);
        if let Some(solid) = &self.solid {
            // Solid bodies do not overlap when they touch, and part again within a tick.
            self.contacts.found.clear();
            self.contacts.found.extend(solid.touched());
        }
        self.log_contacts(self.tick - 1);
        self.crossings.look(self.tick, self.clock.dt_s(), &self.bodies, self.ranges.all_heard());
        self.judge(time_s);
        self.announce();
        self.impairments_changed.clear();
        self.is_open = false;
        self.answer_pace();
    }

    /// Whether the next tick of `lockstep` may open at this time, ns. The trajectories do not depend on it.
    pub fn opens(&mut self, now_ns: u64) -> Opens {
        self.opener.opens(self.tick, now_ns)
    }

    /// The pace that operators want.
    pub fn pace(&self) -> PaceState {
        self.opener.state(self.tick)
    }

    /// While no tick opens, orders take effect all the same: as they would at the beginning of the next one.
    pub fn take_effect(&mut self) {
        if !self.is_open && !self.orders.is_empty() {
            self.keep(|| WorldInput::TookEffect);
            self.apply_orders();
            self.announce();
        }
    }

    fn obey(&mut self, instance: RobotInstance, drive: Option<Drive>) {
        let (slot, dt_s) = (instance.index.at(), self.clock.dt_s());
        let body = &mut self.bodies[slot];
        let fitting = drive.filter(|drive| fits(body.kind, drive));
        if let Some(solid) = &mut self.solid {
            solid.ask(slot, fitting);
        } else if let Some(arm) = arm::of_slot_mut(&mut self.arms, slot) {
            match fitting {
                Some(Drive::Joints { rate_radps }) => arm.advance(rate_radps, &body.limits, dt_s),
                _ => arm.halt(),
            }
            body.pose = arm.pose();
        } else {
            match (fitting, &body.wheels) {
                (Some(drive), Some(wheels)) => body.pose.advance_on(wheels, drive, &body.limits, dt_s),
                (Some(drive), None) => body.pose.advance(drive, &body.limits, dt_s),
                (None, _) => body.pose.halt(),
            }
        }
        if let (Some(drive), None) = (drive, fitting)
            && !std::mem::replace(&mut self.scolded[slot], true)
        {
            self.journal.note(self.tick, instance.index, EventKind::BadCommand { drive, body: body.kind });
        }
    }

    fn judge(&mut self, time_s: f64) {
        for (body, referee) in self.bodies.iter().zip(&mut self.referees) {
            let Some(referee) = referee else { continue };
            referee.move_goal(time_s);
            if body.takes_part {
                referee.drove(body.driven_m(), [body.from, body.pose.position], body.pose.velocity);
                referee.faces(body.pose.yaw_rad);
                referee.judge([body.from, body.pose.position], self.tick, &mut self.journal);
                if referee.stays(self.tick, body.pose.position, body.radius_m) >= self.stuck_ticks {
                    self.stuck.push(body.instance.index);
                }
            } else {
                referee.rests();
            }
            if body.in_world {
                referee.pass(self.tick, body.pose.position);
                let Point2 { coords } = body.pose.position;
                let instance = u64::from(body.instance.index.0) << 32 | u64::from(body.instance.incarnation);
                let state = [coords.x.to_bits(), coords.y.to_bits(), body.pose.yaw_rad.to_bits()];
                self.hash =
                    [self.tick, instance, referee.goals_done.into()].into_iter().chain(state).fold(self.hash, mix);
                if let Some(arm) = arm::of_slot(&self.arms, body.instance.index.at()) {
                    self.hash = arm.state.joints_rad.map(f64::to_bits).into_iter().fold(self.hash, mix);
                }
            }
        }
    }

    /// Counts and logs the contacts just found, in the tick that opened with `opened`.
    fn log_contacts(&mut self, opened: u64) {
        self.contacts.count();
        for contact in &self.contacts.found {
            let (Contact::Robots(slot, _) | Contact::Obstacle(slot, _) | Contact::Map(slot)) = *contact;
            let stands = match *contact {
                Contact::Robots(..) => false,
                Contact::Obstacle(_, index) => !self.shapes.obstacles[index].moves(),
                Contact::Map(_) => true,
            };
            if let Some(referee) = &mut self.referees[slot] {
                // Solid bodies lean on what they touch; others go on through it.
                referee.trespassed |= self.solid.is_none() && stands;
            }
            self.journal.note_quietly(self.tick, RobotIndex::of(slot), || {
                let body = &self.bodies[slot];
                let with = match *contact {
                    Contact::Robots(_, other) => Partner::Robot(RobotIndex::of(other)),
                    Contact::Obstacle(_, index) => Partner::Obstacle(index as u32),
                    Contact::Map(_) => Partner::Map,
                };
                let first = self.solid.as_ref().and_then(|solid| solid.first(*contact)).or_else(|| {
                    let parts = Parts::of(body, &self.arms);
                    match *contact {
                        Contact::Robots(_, other) => {
                            let others = Parts::of(&self.bodies[other], &self.arms);
                            touch::first(parts.as_slice(), others.as_slice().iter().copied())
                        }
                        Contact::Obstacle(_, index) => {
                            touch::first(parts.as_slice(), self.shapes.ways(&self.shapes.obstacles[index]))
                        }
                        Contact::Map(_) => {
                            let walls = self.walls.as_ref()?.on_way(parts.as_slice());
                            touch::first(parts.as_slice(), walls.into_iter())
                        }
                    }
                });
                // Inside a polygon whose edges are far there is no surface to touch.
                let (share, at) = first.map_or((0.0, body.from), |first| (first.share, first.at));
                let touch = Touch { t_s: (opened as f64 + share) * self.clock.dt_s(), at_m: [at.x, at.y] };
                EventKind::Contact { with, touch }
            });
        }
    }
}

/// Stirs a word into a hash so that every bit of it reaches every other: xor, odd multiply, fold the top down.
fn mix(hash: u64, word: u64) -> u64 {
    let stirred = (hash.rotate_left(29) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    stirred ^ stirred >> 32
}
