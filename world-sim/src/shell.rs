//! The process around the world: shared memory, time, and the end of it. No decision about robots is taken here;
//! the shell only finds out who answered.

use crate::attendance::{self, Attendance, PATIENCE, Seen};
use crate::checkpoints::{self, Checkpoints, Haste};
use crate::opener::Opens;
use crate::outcome_file::OutcomeFile;
use crate::pace::Pace;
use crate::recorder::Recorder;
use crate::{CheckpointError, Opening, World};
use bus::blame::{Period, Watch};
use bus::notes::NoteReaders;
use bus::{
    Address, BusError, FramePublisher, Gate, Lease, Node, NoticeSender, OrderReceiver, Progress, RobotReader, Sizes,
    StatsWriter, Strips, WorldWriter, clock, gate, helm,
};
use model::{Drive, Metric, Mode, PaceState, RobotIndex, RobotInstance, Scenario};
use protocol::codec::{self, CodecError};
use protocol::daemon_to_world::Absence;
use protocol::robot_to_world::Command;
use protocol::world_to_daemon::{Notice, WorldEnd};
use protocol::world_to_observer::{FrameBody, FrameHeader};
use record::InputSource;
use std::ffi::OsString;
use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The first period of `realtime` begins this long after everybody is ready.
const RUN_UP_NS: u64 = 5_000_000;
/// How long the world waits for a daemon that has not taken its last notices.
const FAREWELL_NS: u64 = 1_000_000_000;

/// Name of the file in the run's root that holds the scenario.
pub const SCENARIO_FILE: &str = "scenario";
/// Name of the file in the run's root that holds the path of the record, if one is wanted.
pub const RECORD_FILE: &str = bus::notes::RECORD_FILE;

/// Why the world's process ended badly.
#[derive(Debug, thiserror::Error)]
pub enum ShellError {
    /// Shared memory failed it.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// A file of the run cannot be read or written.
    #[error("run file `{0}`: {1}")]
    File(PathBuf, #[source] std::io::Error),
    /// What the run came to cannot be left behind.
    #[error("outcome: cannot write: {0}")]
    Outcome(#[source] std::io::Error),
    /// A file of the run is damaged.
    #[error("run file: {0}")]
    Codec(#[from] CodecError),
    /// The world before this one left nothing to go on from.
    #[error("checkpoint: there is none that is whole")]
    NoCheckpoint,
    /// What the world before this one left does not fit.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The state of the world cannot be left for another one to go on from.
    #[error("checkpoint: cannot write: {0}")]
    CannotLeave(#[source] std::io::Error),
}

/// Runs the world of the fleet at `root` until its scenario ends or the daemon stops it. An `incarnation` above 0 goes on
/// from the last state of the one before. The world of a fleet that is left running outlives the daemon that started it.
///
/// # Errors
/// See [`ShellError`].
pub fn main(root: &Path, parent: u32, incarnation: u32) -> Result<(), ShellError> {
    bus::process::leave_ending_to_daemon();
    let address = Address::at(root)?;
    let left_running = helm::is_left_running(&address);
    if !left_running && !bus::process::die_with_parent(parent) {
        return Ok(());
    }
    // While the world lives, nobody takes the fleet for abandoned.
    let _lease = match left_running {
        true => {
            helm::sign_world(&address)?;
            Some(Lease::take(&address)?)
        }
        false => None,
    };
    let path = address.file(SCENARIO_FILE);
    #[expect(clippy::disallowed_methods, reason = "the shell reads its scenario once, before the loop")]
    let bytes = std::fs::read(&path).map_err(|error| ShellError::File(path, error))?;
    let mut scenario: Scenario = codec::decode(&bytes)?;
    bus::attach_map(&address, scenario.map.as_mut())?;

    let left = OutcomeFile::open(&address).map_err(ShellError::Outcome)?;
    let world = match incarnation {
        0 => World::new(&scenario),
        _ => {
            let (newest, events) = checkpoints::newest(&address).ok_or(ShellError::NoCheckpoint)?;
            World::resume(&scenario, newest, events)?
        }
    };
    let mut shell = Shell::open(&address, &scenario, world, incarnation)?;
    shell.recorder = recorder(&address, &scenario)?;
    if shell.recorder.is_some() {
        shell.world.keep_inputs();
    }
    if left_running && scenario.clock.mode == Mode::Realtime {
        let files = Checkpoints::open(&address, scenario.fleet.max_robots, shell.world.events());
        shell.checkpoints = Some(files.map_err(ShellError::CannotLeave)?);
    }
    match scenario.clock.mode {
        Mode::Realtime => shell.realtime(),
        Mode::Lockstep | Mode::Single => shell.lockstep(),
    }
    left.write(shell.leave()).map_err(ShellError::Outcome)
}

/// Whoever writes the record, if the run has one.
fn recorder(address: &Address, scenario: &Scenario) -> Result<Option<Recorder>, ShellError> {
    #[expect(clippy::disallowed_methods, reason = "the shell learns once, before the loop, whether to record")]
    let Ok(path) = std::fs::read(address.file(RECORD_FILE)) else { return Ok(None) };
    let path = PathBuf::from(OsString::from_vec(path));
    Recorder::begin_counting(&path, scenario, address).map(Some).map_err(|error| ShellError::File(path, error))
}

struct Shell {
    world: World,
    period_ns: u64,
    gate: Gate,
    board: WorldWriter,
    orders: OrderReceiver,
    notices: NoticeSender,
    frames: FramePublisher,
    stats: StatsWriter,
    /// The boards of the robots, by slot.
    robots: Vec<Option<(RobotInstance, RobotReader)>>,
    /// Commands of the tick that closes, by slot.
    commands: Vec<Option<Drive>>,
    bodies: Vec<FrameBody>,
    recorder: Option<Recorder>,
    /// What agents note for it.
    notes: NoteReaders,
    /// Where its state goes, if another world may go on from it.
    checkpoints: Option<Checkpoints>,
    /// How often the world's process was replaced.
    incarnation: u32,
    /// Nothing has been written to the board.
    blank: bool,
    attendance: Attendance,
    straggler_limit: Duration,
    /// The pace that the gate tells.
    pace: PaceState,
    /// Participants that have not answered the open tick.
    missing: Vec<RobotInstance>,
    command_timeout_ns: u64,
    node: Node,
}

impl Shell {
    fn open(address: &Address, scenario: &Scenario, world: World, incarnation: u32) -> Result<Shell, BusError> {
        let node = Node::new(address, "world")?;
        let sizes = Sizes { max_robots: scenario.fleet.max_robots as u32, shape_pieces: scenario.shape_pieces() };
        let slots = scenario.fleet.max_robots;
        let straggler_limit = Duration::from_secs_f64(scenario.fleet.straggler_limit_s);
        let command_timeout_ns = (scenario.fleet.command_timeout_s * 1e9) as u64;
        let mut shell = Shell {
            world,
            period_ns: (1e9 / scenario.clock.tick_hz).round() as u64,
            gate: Gate::open(address)?,
            board: WorldWriter::open(&node, sizes, incarnation)?,
            orders: OrderReceiver::open(&node)?,
            notices: NoticeSender::open(&node)?,
            frames: FramePublisher::open(&node, sizes.frame_bodies_max(), incarnation)?,
            stats: StatsWriter::create(
                address,
                bus::stats::WORLD,
                &[Metric::CommandAge, Metric::Reaction, Metric::Wake],
                Strips::of_world(sizes.max_robots),
            )?,
            robots: (0..slots).map(|_| None).collect(),
            commands: vec![None; slots],
            bodies: Vec::new(),
            recorder: None,
            notes: NoteReaders::new(address),
            checkpoints: None,
            incarnation,
            blank: incarnation > 0,
            attendance: Attendance::new(slots, straggler_limit, command_timeout_ns),
            straggler_limit,
            pace: PaceState::default(),
            missing: Vec::with_capacity(slots),
            command_timeout_ns,
            node,
        };
        for index in 0..sizes.shape_pieces {
            shell.board.piece(index, |piece| shell.world.tell_piece(index as usize, piece));
        }
        Ok(shell)
    }

    /// `lockstep`: open a tick, wait for everybody's answer, integrate.
    fn lockstep(&mut self) {
        // At what pace to begin the daemon has said before it started this process.
        self.take_orders();
        loop {
            self.send_notices();
            self.await_due();
            if self.over() {
                return;
            }
            match self.world.opens(clock::now_ns()) {
                Opens::Now => {}
                opens => {
                    self.hold(opens);
                    continue;
                }
            }
            self.open_tick();
            let (tick, opened_ns) = (self.world.tick(), clock::now_ns());
            if self.gate.start_ns().is_none() {
                self.gate.set_start(opened_ns);
            }
            self.gate.open_tick(tick, self.world.participants().len() as u32, opened_ns);
            self.await_answers(tick, opened_ns);
            let now_ns = clock::now_ns();
            for index in 0..self.world.participants().len() {
                let instance = self.world.participants()[index];
                let answered = self.gate.answered(instance, tick);
                let command = attendance::command_of_tick(tick, answered, self.command_of(instance));
                self.obey(instance, command, gate::is_measured(tick).then_some(now_ns));
            }
            self.close_tick(now_ns);
            self.take_orders();
        }
    }

    /// The next tick is not to open yet. Orders are taken, take effect and are answered all the same.
    fn hold(&mut self, opens: Opens) {
        let left = match opens {
            Opens::At(due_ns) => Duration::from_nanos(due_ns.saturating_sub(clock::now_ns())),
            Opens::Now | Opens::OnOrder => PATIENCE,
        };
        self.gate.wait_call(left.min(PATIENCE));
        if self.take_orders() {
            self.world.take_effect();
        }
        let gate = &self.gate;
        self.attendance.welcome_back(&mut self.world, &|instance| gate.signs(instance));
    }

    /// `realtime`: at every period take the newest commands, integrate, publish. Nobody is waited for.
    fn realtime(&mut self) {
        clock::set_timer_slack_1ns();
        let start_ns = match self.gate.start_ns() {
            None => {
                self.send_notices();
                self.await_due();
                self.meet();
                let start_ns = clock::now_ns() + RUN_UP_NS;
                self.gate.set_start(start_ns);
                start_ns
            }
            Some(first_ns) => self.go_on(first_ns),
        };
        let mut pace = Pace::new(start_ns, self.period_ns, self.command_timeout_ns);
        self.attendance.begin(start_ns);
        let mut watch = Watch::of_world();
        clock::sleep_until_ns(start_ns);
        let mut woken = None;
        while !self.over() {
            self.open_tick();
            if let Some((due_ns, woken_ns)) = woken {
                // From taking the commands of one tick to having opened the next.
                let done_ns = clock::now_ns();
                let work_ns = done_ns.saturating_sub(woken_ns);
                let period =
                    Period { period_ns: self.period_ns, due_ns, woken_ns, done_ns, work_ns, ..Period::default() };
                watch.judge(&mut self.stats, period);
            }
            let due_ns = pace.next_ns();
            clock::sleep_until_ns(due_ns);
            let now_ns = clock::now_ns();
            woken = Some((due_ns, now_ns));
            if let Some(lost_ns) = pace.woken(now_ns) {
                self.attendance.stood_still(now_ns);
                self.world.stood_still(lost_ns / 1_000_000);
            }
            for index in 0..self.world.participants().len() {
                let instance = self.world.participants()[index];
                let (newest, gate) = (self.command_of(instance), &self.gate);
                let command =
                    self.attendance.newest(&mut self.world, instance, newest, now_ns, &|instance| gate.signs(instance));
                if let Some(command) = &command {
                    self.world.commanded(instance, command.stamp_ns);
                }
                self.obey(instance, command, Some(now_ns));
            }
            self.close_tick(now_ns);
            self.take_orders();
        }
    }

    /// This world takes the place of one that ended, in the phase of the agents' timers. When the first period begins.
    fn go_on(&mut self, first_ns: u64) -> u64 {
        let (before, now_ns) = (self.gate.progress(), clock::now_ns());
        let away_ms = now_ns.saturating_sub(before.stamp_ns) / 1_000_000;
        self.world.went_on(before.tick.saturating_sub(self.world.tick()), away_ms);
        let gate = &self.gate;
        self.attendance.go_on(&self.world, &|instance| gate.signs(instance));
        first_ns + (now_ns.saturating_sub(first_ns) / self.period_ns + 1) * self.period_ns
    }

    /// Leaves the state of the world for another one to go on from.
    fn leave_checkpoint(&mut self, haste: Haste) {
        if let Some(checkpoints) = &mut self.checkpoints
            && let Err(error) = checkpoints.leave(&self.world, haste, &mut clock::now_ns)
        {
            say(&format!("its state cannot be kept: {error}; if it dies, another one goes on from an older state"));
            self.checkpoints = None;
        }
    }

    fn over(&self) -> bool {
        self.world.finished() || self.gate.stopped()
    }

    /// Lets the tick begin, and tells every robot what it hears and sees.
    fn open_tick(&mut self) {
        let (gate, attendance) = (&self.gate, &self.attendance);
        self.world.open(&mut |instance| gate.is_ready(instance) && !attendance.is_silent(instance));
        let stamp_ns = clock::now_ns();
        let (world, board) = (&self.world, &mut self.board);
        // On a board on which nothing is, everything is new.
        let all = if std::mem::take(&mut self.blank) { Some((0..world.slots(), 0..world.pieces())) } else { None };
        let all = all.map(|(slots, pieces)| (slots.collect::<Vec<_>>(), pieces.collect::<Vec<_>>()));
        let opening = all.as_ref().map_or_else(
            || world.opening(),
            |(slots, pieces)| Opening { odometry: slots, neighbors: slots, sensed: slots, pieces, impairments: slots },
        );
        for index in opening.pieces {
            board.piece(*index as u32, |piece| world.tell_piece(*index, piece));
        }
        for slot in opening.neighbors {
            board.neighbors(RobotIndex::of(*slot), world.neighbors(*slot), world.coming(*slot));
        }
        for slot in opening.impairments {
            board.impairment(RobotIndex::of(*slot), world.impairment(*slot));
        }
        for slot in opening.sensed {
            board.sensed(RobotIndex::of(*slot), world.sensed(*slot));
        }
        for slot in opening.odometry {
            board.odometry(RobotIndex::of(*slot), |odometry| {
                world.tell_odometry(*slot, odometry);
                odometry.stamp_ns = stamp_ns;
            });
        }
        if all.is_some() {
            self.gate.set_world_incarnation(self.incarnation);
        }
        for index in 0..self.world.participants().len() {
            let instance = self.world.participants()[index];
            let slot = instance.index.at();
            if self.robots[slot].as_ref().is_none_or(|(who, _)| *who != instance) {
                self.open_robot(instance);
            }
            self.attendance.takes_part(instance, self.world.tick(), stamp_ns);
        }
        self.show(stamp_ns);
        self.send_notices();
        self.leave_checkpoint(Haste::MayWait);
    }

    /// Opens the board of a robot. One that has died has none any more: it stands still until its death is reported. Where
    /// the board is there and cannot be opened, the robot cannot take part.
    fn open_robot(&mut self, instance: RobotInstance) {
        let slot = instance.index.at();
        self.robots[slot] = None;
        let mut reader = RobotReader::open(&self.node, instance);
        if reader.as_ref().is_err_and(|error| !error.is_missing()) {
            // What robots hold that do not take part any more may be enough.
            let mut wanted = self.world.due().to_vec();
            wanted.extend_from_slice(self.world.participants());
            self.robots.iter_mut().for_each(|open| drop(open.take_if(|(who, _)| !wanted.contains(who))));
            reader = RobotReader::open(&self.node, instance);
        }
        match reader {
            Ok(reader) => {
                self.robots[slot] = Some((instance, reader));
                if self.recorder.is_some() {
                    self.notes.open(instance);
                }
            }
            Err(error) if error.is_missing() => {}
            Err(error) => {
                let (why, gate) = (format!("its commands cannot be read: {error}"), &self.gate);
                self.attendance
                    .give_up(&mut self.world, instance, Absence::Deaf { why }, &|instance| gate.signs(instance));
            }
        }
    }

    /// Before the first period of `realtime` every agent opens the boards of the robots that it will hear in the second, which
    /// takes several periods. An agent that is not done within the limit of stragglers does the rest later. A robot that died
    /// before it was ready is left out: its board may be half made.
    fn meet(&mut self) {
        let mut foreseen = self.world.foreseen();
        for (_, neighbors) in &mut foreseen {
            neighbors.retain(|who| self.gate.is_ready((*who).into()));
        }
        for (slot, neighbors) in &foreseen {
            self.board.neighbors(RobotIndex::of(*slot), neighbors, &[]);
        }
        self.gate.call_meeting();
        for instance in self.world.due().to_vec() {
            self.open_robot(instance);
        }
        let begun_ns = clock::now_ns();
        let limit_ns = self.straggler_limit.as_nanos() as u64;
        let overdue = || clock::now_ns().saturating_sub(begun_ns) > limit_ns;
        while self.misses(Gate::has_met) && !overdue() && !self.over() {
            self.gate.wait_call(PATIENCE.min(self.straggler_limit));
            self.take_orders_and_answer();
        }
        for (slot, _) in foreseen {
            self.board.neighbors(RobotIndex::of(slot), &[], &[]);
        }
    }

    /// Publishes the frame of the present tick, if anybody watches, and records it, if anybody wants that.
    fn show(&mut self, stamp_ns: u64) {
        if let Some(recorder) = &mut self.recorder {
            let tick = self.world.tick();
            self.notes.drain(&mut |instance, note| recorder.input(tick, InputSource::Robot(instance), note));
            recorder.frame(&mut self.world);
        }
        if self.frames.is_watched() {
            self.bodies.clear();
            self.world.frame(&mut self.bodies);
            let header = FrameHeader { stamp_ns, ..self.world.frame_header() };
            self.frames.publish(header, &self.bodies);
        }
    }

    /// Lets the tick end.
    fn close_tick(&mut self, now_ns: u64) {
        let commands = &self.commands;
        self.world.close(&mut |instance| commands[instance.index.at()]);
        self.gate.set_progress(Progress {
            tick: self.world.tick(),
            robots: self.world.robot_count() as u32,
            arrived: self.world.arrived_count() as u32,
            contacts: self.world.contacts(),
            stamp_ns: now_ns,
        });
        let gate = &self.gate;
        self.attendance.welcome_back(&mut self.world, &|instance| gate.signs(instance));
    }

    /// The newest command of a robot instance, if it ever gave one.
    fn command_of(&self, instance: RobotInstance) -> Option<Command> {
        let (who, reader) = self.robots[instance.index.at()].as_ref()?;
        attendance::command_of(instance, reader.command()).filter(|_| *who == instance)
    }

    /// Takes a command for this tick; `now_ns`, if its age is to be measured.
    fn obey(&mut self, instance: RobotInstance, command: Option<Command>, now_ns: Option<u64>) {
        if let (Some(command), Some(now_ns)) = (&command, now_ns) {
            for (metric, stamp_ns) in
                [(Metric::CommandAge, command.stamp_ns), (Metric::Reaction, command.odometry_stamp_ns)]
            {
                let age_ns = now_ns.saturating_sub(stamp_ns);
                self.stats.record(metric, age_ns);
                self.stats.record_of(instance.index, metric, age_ns, now_ns);
            }
        }
        if let Some(command) = &command {
            self.world.planned(instance, command.plan_state(), f64::from(command.filtered));
        }
        self.commands[instance.index.at()] = command.and_then(|command| command.drive());
    }

    /// Waits until every robot that is to enter now is ready, or has been given up.
    fn await_due(&mut self) {
        while self.misses(Gate::is_ready) && !self.over() {
            self.gate.wait_call(PATIENCE);
            self.take_orders_and_answer();
        }
    }

    /// Whether a robot that is to enter now, and that has not been given up, has not said this yet.
    fn misses(&mut self, said: fn(&Gate, RobotInstance) -> bool) -> bool {
        let gate = &self.gate;
        self.attendance.misses(&mut self.world, &|instance| said(gate, instance))
    }

    /// Waits until every participant has answered the tick, or has been given up.
    fn await_answers(&mut self, tick: u64, opened_ns: u64) {
        self.attendance.await_answers(opened_ns);
        loop {
            self.gate.wait_answers(tick, PATIENCE);
            let gate = &self.gate;
            self.attendance.missing(&self.world, &|instance| gate.answered(instance, tick), &mut self.missing);
            if self.missing.is_empty() || gate.stopped() {
                return;
            }
            let overdue = self.attendance.overdue(clock::now_ns(), &self.missing, &mut |instance| seen(gate, instance));
            for instance in overdue {
                self.attendance.give_up(&mut self.world, instance, Absence::Overdue, &|instance| gate.signs(instance));
            }
            self.take_orders_and_answer();
        }
    }

    /// Takes the orders that have come; whether there were any. Notices that wait for room go out as well: while this process
    /// waits for a robot, the daemon may not know yet that it has to start it.
    fn take_orders(&mut self) -> bool {
        self.notices.flush();
        let mut came = false;
        while let Some(order) = self.orders.take() {
            let gate = &self.gate;
            self.attendance.take(&mut self.world, order, &|instance| gate.signs(instance));
            came = true;
        }
        if came {
            self.tell_pace();
        }
        came
    }

    /// Tells everybody the pace, if it is another one.
    fn tell_pace(&mut self) {
        let pace = self.world.pace();
        if (pace.paused, pace.rate) != (self.pace.paused, self.pace.rate) {
            self.gate.set_pace(pace.paused, pace.rate);
            self.pace = pace;
        }
    }

    /// The same where the next tick may wait for the daemon: what is answered without a tick does not wait for it.
    fn take_orders_and_answer(&mut self) {
        if self.take_orders() {
            self.send_notices();
        }
    }

    /// Tells the daemon what is new. What it may act on is kept first: no later world knows less than the daemon was told.
    fn send_notices(&mut self) {
        let notices = self.world.take_notices();
        if notices.iter().any(|notice| !matches!(notice, Notice::Log(_))) {
            self.leave_checkpoint(Haste::Now);
        }
        for notice in notices {
            self.notices.send(&notice);
        }
        self.notices.flush();
    }

    /// What waits for room in the ring would end with this process: a daemon that is only slow is waited for.
    fn take_leave(&mut self) {
        let begun_ns = clock::now_ns();
        while self.notices.flush() > 0 && clock::now_ns().saturating_sub(begun_ns) < FAREWELL_NS {
            clock::sleep_until_ns(clock::now_ns() + 1_000_000);
        }
        self.notices.abandon();
    }

    /// What is left behind when the run is over.
    fn leave(&mut self) -> WorldEnd {
        self.gate.set_over();
        // No tick opens any more: whoever waits for an order is told so.
        self.take_orders();
        self.world.refuse_orders();
        // No tick opens where the last one ended: without this, observers would never see how the run came out.
        self.show(clock::now_ns());
        self.send_notices();
        self.take_leave();
        let outcome = self.world.outcome();
        let recorded = self.recorder.take().map(|recorder| recorder.finish(&outcome));
        let record_failed = recorded.and_then(Result::err).map(|error| error.to_string());
        WorldEnd { outcome, record_failed, finished: self.world.finished() }
    }
}

/// Says something that the daemon hands to the log.
#[expect(clippy::print_stderr, reason = "standard error of the world is a file that the daemon reads")]
fn say(words: &str) {
    eprintln!("{words}");
}

/// What the kernel says of the agent of a robot instance.
fn seen(gate: &Gate, instance: RobotInstance) -> Option<Seen> {
    let pid = gate.process(instance)?;
    let runnable = bus::process::state_of(pid) == Some('R');
    Some(Seen { stat: clock::schedstat_of(pid)?, runnable })
}
