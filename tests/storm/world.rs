//! The world's process, a turn at a time: the cores that decide, and around them what the shell does between two sleeps.

use crate::agent::FOREVER;
use crate::checks::Checks;
use crate::dice::MS;
use crate::shared::Shared;
use bus::queue::{NoticeQueue, Sent};
use model::{Drive, Mode, RobotInstance, Scenario};
use protocol::codec;
use protocol::daemon_to_world::{Absence, Order};
use protocol::robot_to_world::Command;
use protocol::world_to_daemon::Notice;
use protocol::world_to_robot::Odometry;
use shoal_tests::Tape;
use std::time::Duration;
use world_sim::attendance::{Attendance, PATIENCE, command_of, command_of_tick};
use world_sim::opener::Opens;
use world_sim::pace::Pace;
use world_sim::{Opening, World};

/// A world that is awake looks at least this often, ns.
pub(crate) const PATIENCE_NS: u64 = PATIENCE.as_nanos() as u64;
/// How long the world waits for a daemon that has not taken its last notices.
const FAREWELL_NS: u64 = 1000 * MS;

/// What it waits for.
enum Stage {
    /// Those that are due.
    Due,
    /// `realtime`: that everybody has opened the boards of everybody else.
    Meeting {
        begun_ns: u64,
    },
    /// `lockstep`: the answers to the open tick.
    Answers,
    /// `realtime`: the end of the open period.
    Period,
    /// `realtime`: nothing; it was interrupted between taking the commands and closing the tick.
    Close,
    /// That the daemon takes the last notices.
    Leave {
        begun_ns: u64,
    },
    Ended,
    /// Nothing: its process has died.
    Dead,
}

pub(crate) struct WorldProcess {
    pub(crate) world: World,
    pub(crate) attendance: Attendance,
    pub(crate) notices: NoticeQueue,
    /// Notices that are kept and not sent.
    untold: Vec<Notice>,
    pub(crate) checks: Checks,
    mode: Mode,
    period_ns: u64,
    command_timeout_ns: u64,
    straggler_limit_ns: u64,
    stage: Stage,
    pace: Option<Pace>,
    commands: Vec<(RobotInstance, Option<Command>)>,
    missing: Vec<RobotInstance>,
    /// Nothing has been written to its board.
    is_blank: bool,
    /// When it wants to run next, ns.
    pub(crate) wake: u64,
}

impl WorldProcess {
    pub(crate) fn new(scenario: &Scenario, shared: &mut Shared) -> WorldProcess {
        let mut world = World::new(scenario);
        shared.tape = Some(Tape::begin(scenario, &mut world));
        shared.memory.pieces = (0..scenario.shape_pieces() as usize).map(|index| world.piece(index)).collect();
        let mut process = WorldProcess::of(world, scenario, shared);
        process.send_notices(shared);
        process
    }

    fn of(world: World, scenario: &Scenario, shared: &Shared) -> WorldProcess {
        let slots = scenario.fleet.max_robots;
        let straggler_limit = Duration::from_secs_f64(scenario.fleet.straggler_limit_s);
        let command_timeout_ns = (scenario.fleet.command_timeout_s * 1e9) as u64;
        WorldProcess {
            world,
            attendance: Attendance::new(slots, straggler_limit, command_timeout_ns),
            notices: NoticeQueue::default(),
            untold: Vec::new(),
            checks: Checks::default(),
            mode: scenario.clock.mode,
            period_ns: (1e9 / scenario.clock.tick_hz).round() as u64,
            command_timeout_ns,
            straggler_limit_ns: straggler_limit.as_nanos() as u64,
            stage: Stage::Due,
            pace: None,
            commands: Vec::new(),
            missing: Vec::new(),
            is_blank: false,
            wake: shared.now + 5 * MS,
        }
    }

    /// The world that comes after one that has died, and begins with its next period.
    pub(crate) fn after(scenario: &Scenario, world: World, shared: &mut Shared) -> WorldProcess {
        let mut process = WorldProcess::of(world, scenario, shared);
        let start_ns = shared.now + 5 * MS;
        shared.tape = None;
        process.pace = Some(Pace::new(start_ns, process.period_ns, process.command_timeout_ns));
        process.attendance.begin(start_ns);
        process.checks = Checks::of(&process.world);
        let memory = &shared.memory;
        process.attendance.go_on(&process.world, &|instance| memory.signs(instance));
        process.is_blank = true;
        process.begin_period(shared);
        process
    }

    /// It dies, and what waits in its memory with it.
    pub(crate) fn dies(&mut self) {
        (self.stage, self.wake, self.notices) = (Stage::Dead, FOREVER, NoticeQueue::default());
        self.untold.clear();
    }

    /// It has begun, and is not about to end.
    pub(crate) fn runs(&self) -> bool {
        matches!(self.stage, Stage::Period | Stage::Close)
    }

    pub(crate) fn turn(&mut self, shared: &mut Shared) {
        self.wake = shared.now + PATIENCE_NS;
        match self.stage {
            Stage::Due => self.await_due(shared),
            Stage::Meeting { begun_ns } => self.meet(begun_ns, shared),
            Stage::Answers => self.await_answers(shared),
            Stage::Period => self.end_period(shared),
            Stage::Close => self.close_period(shared),
            Stage::Leave { begun_ns } => self.leave(begun_ns, shared),
            Stage::Ended | Stage::Dead => self.wake = FOREVER,
        }
    }

    fn over(&self) -> bool {
        self.world.finished()
    }

    fn await_due(&mut self, shared: &mut Shared) {
        self.take_orders_and_answer(shared);
        let (memory, attendance) = (&shared.memory, &self.attendance);
        let misses = attendance.misses(&mut self.world, &|instance| memory.is_ready(instance));
        let due = self.world.due().iter().copied();
        self.missing.clear();
        self.missing.extend(due.filter(|instance| !memory.is_ready(*instance) && !attendance.is_silent(*instance)));
        self.checks.waited(&self.missing, shared.daemon_awake_ns, shared.coverage.daemon_deaths);
        if misses && !self.over() {
            return;
        }
        match self.mode {
            Mode::Realtime => {
                for (slot, neighbors) in self.world.foreseen() {
                    shared.memory.neighbors[slot] = neighbors;
                }
                shared.memory.meeting = true;
                shared.calls.agents = true;
                self.stage = Stage::Meeting { begun_ns: shared.now };
            }
            _ if self.over() => self.begin_leaving(shared),
            _ => {
                match self.world.opens(shared.now) {
                    Opens::Now => {}
                    opens => return self.hold(opens, shared),
                }
                self.open_tick(shared);
                self.attendance.await_answers(shared.now);
                shared.calls.agents = true;
                self.stage = Stage::Answers;
                // A tick without participants is over immediately.
                self.wake = if self.world.participants().is_empty() { shared.now + MS } else { self.wake };
            }
        }
    }

    /// The next tick is not to open yet.
    fn hold(&mut self, opens: Opens, shared: &mut Shared) {
        shared.coverage.holds += 1;
        if let Opens::At(due_ns) = opens {
            self.wake = self.wake.min(due_ns);
        }
        self.world.take_effect();
        let memory = &shared.memory;
        self.attendance.welcome_back(&mut self.world, &|instance| memory.signs(instance));
        self.send_notices(shared);
    }

    fn meet(&mut self, begun_ns: u64, shared: &mut Shared) {
        self.take_orders_and_answer(shared);
        let misses = self.attendance.misses(&mut self.world, &|instance| shared.memory.has_met(instance));
        if misses && shared.now - begun_ns <= self.straggler_limit_ns && !self.over() {
            return;
        }
        shared.memory.neighbors.iter_mut().for_each(Vec::clear);
        let start_ns = shared.now + 5 * MS;
        self.pace = Some(Pace::new(start_ns, self.period_ns, self.command_timeout_ns));
        self.attendance.begin(start_ns);
        shared.memory.start_ns = Some(start_ns);
        shared.calls.agents = true;
        self.begin_period(shared);
    }

    // ---- `lockstep`

    fn await_answers(&mut self, shared: &mut Shared) {
        let tick = self.world.tick();
        let memory = &shared.memory;
        self.attendance.missing(&self.world, &|instance| memory.answered(instance, tick), &mut self.missing);
        if !self.missing.is_empty() {
            // The kernel does not say what they did in this time: all of it counts.
            let overdue = self.attendance.overdue(shared.now, &self.missing, &mut |_| None);
            for instance in overdue {
                shared.coverage.overdue += 1;
                self.attendance
                    .give_up(&mut self.world, instance, Absence::Overdue, &|instance| memory.signs(instance));
            }
            self.take_orders_and_answer(shared);
            let memory = &shared.memory;
            self.attendance.missing(&self.world, &|instance| memory.answered(instance, tick), &mut self.missing);
            if !self.missing.is_empty() {
                return;
            }
        }
        self.commands.clear();
        for instance in self.world.participants() {
            let newest = newest(*instance, shared);
            self.commands.push((*instance, command_of_tick(tick, shared.memory.answered(*instance, tick), newest)));
        }
        self.checks.commanded(&self.world, self.mode, &self.commands, shared, self.command_timeout_ns);
        self.close_tick(shared);
        self.take_orders(shared);
        self.send_notices(shared);
        self.stage = Stage::Due;
        self.wake = shared.now + shared.haste();
    }

    // ---- `realtime`

    fn begin_period(&mut self, shared: &mut Shared) {
        if self.over() {
            return self.begin_leaving(shared);
        }
        self.open_tick(shared);
        let due_ns = self.pace.as_mut().expect("it has begun").next_ns();
        self.stage = Stage::Period;
        self.wake = due_ns.max(shared.now) + shared.dice.between_ms(0, 2);
    }

    fn end_period(&mut self, shared: &mut Shared) {
        if let Some(lost_ns) = self.pace.as_mut().expect("it has begun").woken(shared.now) {
            shared.coverage.gaps += 1;
            self.attendance.stood_still(shared.now);
            self.world.stood_still(lost_ns / MS);
        }
        self.commands.clear();
        let memory = &shared.memory;
        for instance in self.world.participants().to_vec() {
            let newest = newest(instance, shared);
            let signs = &|instance| memory.signs(instance);
            let command = self.attendance.newest(&mut self.world, instance, newest, shared.now, signs);
            self.commands.push((instance, command));
        }
        self.checks.commanded(&self.world, self.mode, &self.commands, shared, self.command_timeout_ns);
        if shared.dice.permille(200) {
            // The processor goes to another process for a moment.
            self.stage = Stage::Close;
            self.wake = shared.now + shared.haste();
        } else {
            self.close_period(shared);
        }
    }

    fn close_period(&mut self, shared: &mut Shared) {
        self.close_tick(shared);
        self.take_orders(shared);
        self.begin_period(shared);
    }

    // ---- both

    fn open_tick(&mut self, shared: &mut Shared) {
        self.send_notices(shared);
        let (memory, attendance) = (&mut shared.memory, &self.attendance);
        self.world.open(&mut |instance| memory.is_ready(instance) && !attendance.is_silent(instance));
        let (world, stamp_ns) = (&self.world, shared.now);
        let (slots, pieces): (Vec<_>, Vec<_>) = ((0..world.slots()).collect(), (0..world.pieces()).collect());
        let opening = match std::mem::take(&mut self.is_blank) {
            false => world.opening(),
            true => {
                Opening { odometry: &slots, neighbors: &slots, sensed: &slots, pieces: &pieces, impairments: &slots }
            }
        };
        for index in opening.pieces {
            memory.pieces.resize(memory.pieces.len().max(index + 1), Default::default());
            memory.pieces[*index] = world.piece(*index);
        }
        for slot in opening.neighbors {
            memory.neighbors[*slot] = world.neighbors(*slot).to_vec();
            memory.versions[*slot] += 1;
        }
        for slot in opening.impairments {
            memory.impairments[*slot] = world.impairment(*slot);
        }
        for slot in opening.sensed {
            memory.sensed[*slot] = world.sensed(*slot).to_vec();
        }
        for slot in opening.odometry {
            memory.odometry[*slot] = Odometry { stamp_ns, ..world.odometry(*slot) };
        }
        for instance in self.world.participants().to_vec() {
            if !memory.boards.get(&instance).is_some_and(|board| board.is_readable) {
                let why = "its commands cannot be read".to_owned();
                let signs = &|instance| memory.signs(instance);
                self.attendance.give_up(&mut self.world, instance, Absence::Deaf { why }, signs);
            }
            self.attendance.takes_part(instance, self.world.tick(), stamp_ns);
        }
        memory.tick = Some(self.world.tick());
        self.record(shared);
        let notices = self.send_notices(shared);
        if shared.dice.permille(500) {
            // A large fleet leaves its state less often than every tick.
            shared.estate.leave(&self.world);
        }
        self.checks.opened(&self.world, &notices);
        shared.coverage.ticks += 1;
    }

    fn close_tick(&mut self, shared: &mut Shared) {
        for (instance, command) in &self.commands {
            if let Some(command) = command {
                self.world.commanded(*instance, command.stamp_ns);
                self.world.planned(*instance, command.plan_state(), f64::from(command.filtered));
            }
        }
        let commands = &self.commands;
        let drive = |instance: RobotInstance| -> Option<Drive> {
            let index = commands.binary_search_by_key(&instance, |(who, _)| *who).ok()?;
            commands[index].1?.drive()
        };
        self.world.close(&mut |instance| drive(instance));
        let memory = &shared.memory;
        self.attendance.welcome_back(&mut self.world, &|instance| memory.signs(instance));
        self.checks.closed(&self.world, &self.commands);
        shared.note(self.world.trajectory_hash());
    }

    /// What a recorder takes down. A world that goes on in place of another one is not recorded.
    fn record(&mut self, shared: &mut Shared) {
        if let Some(tape) = &mut shared.tape {
            tape.show(&mut self.world);
        }
    }

    fn take_orders(&mut self, shared: &mut Shared) {
        self.flush(shared);
        while let Some(bytes) = shared.orders.pop() {
            let order: Order = codec::decode(&bytes).expect("both ends are the same build");
            shared.tell(|| format!("world <- {}", brief(&order)));
            let memory = &shared.memory;
            self.attendance.take(&mut self.world, order, &|instance| memory.signs(instance));
        }
    }

    fn take_orders_and_answer(&mut self, shared: &mut Shared) {
        self.take_orders(shared);
        self.send_notices(shared);
    }

    fn send_notices(&mut self, shared: &mut Shared) -> Vec<Notice> {
        let notices = self.world.take_notices();
        if notices.iter().any(|notice| !matches!(notice, Notice::Log(_))) {
            shared.estate.leave(&self.world);
        }
        self.untold.extend(notices.iter().cloned());
        // A world that dies between the two has kept what it has not told.
        if shared.estate.keeps && self.runs() && shared.dice.permille(100) {
            return notices;
        }
        for notice in std::mem::take(&mut self.untold) {
            let bytes = codec::encode(&notice).expect("it can be encoded");
            shared.note_bytes(&bytes);
            shared.tell(|| format!("world {} -> {notice:?}", self.world.tick()));
            self.flush(shared);
            match self.notices.send(&notice, bytes, &mut |bytes| shared.notices.push(bytes)) {
                Sent::Pushed | Sent::Waits => {}
                Sent::LeftOut => shared.missed.entries += 1,
                Sent::Lost => shared.missed.others += 1,
            }
        }
        self.flush(shared);
        notices
    }

    fn flush(&mut self, shared: &mut Shared) {
        self.notices.flush(&mut |bytes| shared.notices.push(bytes));
        shared.calls.daemon |= !shared.notices.is_empty();
    }

    fn begin_leaving(&mut self, shared: &mut Shared) {
        self.take_orders(shared);
        self.world.refuse_orders();
        self.record(shared);
        self.stage = Stage::Leave { begun_ns: shared.now };
        self.send_notices(shared);
        self.wake = shared.now + MS;
    }

    fn leave(&mut self, begun_ns: u64, shared: &mut Shared) {
        self.flush(shared);
        if !self.notices.is_empty() && shared.now - begun_ns < FAREWELL_NS {
            self.wake = shared.now + MS;
            return;
        }
        shared.missed.others += self.notices.abandon();
        self.stage = Stage::Ended;
        shared.world_ended = true;
        shared.calls.daemon = true;
    }

    /// Whether it sleeps until it is called, and not until a time.
    pub(crate) fn waits_for_calls(&self) -> bool {
        matches!(self.stage, Stage::Due | Stage::Meeting { .. } | Stage::Answers)
    }

    /// Whether it has done all that it was told, and has said so. When a run is over, what comes late is left undone.
    pub(crate) fn is_drained(&self) -> bool {
        let works = !matches!(self.stage, Stage::Close | Stage::Leave { .. } | Stage::Ended | Stage::Dead);
        works && self.world.orders_waiting() == 0 && self.untold.is_empty() && self.notices.is_empty()
    }

    pub(crate) fn has_ended(&self) -> bool {
        matches!(self.stage, Stage::Ended | Stage::Dead)
    }
}

/// The newest command on a robot's board.
fn newest(instance: RobotInstance, shared: &Shared) -> Option<Command> {
    let board = shared.memory.boards.get(&instance).filter(|board| board.is_readable)?;
    command_of(instance, board.command)
}

/// An order in a line: what a robot is like does not matter here.
fn brief(order: &Order) -> String {
    match order {
        Order::Admit { instance, robot } => format!("Admit {{ {instance:?}, robot: {} }}", robot.id),
        order => format!("{order:?}"),
    }
}
