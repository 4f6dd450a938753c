//! The process around an agent: shared memory, time, and the end of it. No decision about robots is taken here.
//!
//! [`run`] takes the function that builds the planner, so that another executable can bring its own planner
//! (see [`crate::executable`]).

use crate::agent::{Agent, AgentError, AgentInputs, AgentOutputs, Duty, Time, duty, planner_of};
use crate::note::Notes;
use crate::ports::{Custody, Ports, PortsError};
use bus::blame::{Period, Watch};
use bus::{Address, BusError, Counter, Gate, Poses, Sizes, TickWait, clock, gate, helm};
use model::{Metric, Mode, RobotIndex, RobotInstance};
use planners::{Plan, PlanInput, Planner};
use protocol::codec::{self, CodecError};
use protocol::daemon_to_robot::AgentSpec;
use protocol::robot_to_robot::SharedPose;
use protocol::world_to_robot::Odometry;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering::Relaxed};
use std::time::Duration;

/// Longest sleep without a look at the stop word.
const PATIENCE: Duration = Duration::from_millis(500);
/// In `realtime`, boards are opened for this part of a period, and at least one: an open costs a hundred microseconds.
const OPENING_SHARE: u64 = 8;
/// The same for the first period of a robot in the world.
const FIRST_OPENING_SHARE: u64 = 2;

/// Who this process is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Args {
    /// Root directory of the run.
    pub root: PathBuf,
    /// Slot and life of the robot.
    pub instance: RobotInstance,
    /// The process that started this one: when it goes, this one goes.
    pub parent: u32,
}

impl Args {
    /// Reads the arguments of a program that has some of its own: those of shoal follow them, from the last `--root` on.
    ///
    /// # Errors
    /// As [`Args::parse`].
    pub fn after_own(words: impl IntoIterator<Item = String>) -> Result<Args, ShellError> {
        let words: Vec<String> = words.into_iter().collect();
        let own = words.iter().rposition(|word| word == "--root").unwrap_or(words.len());
        Args::parse(words.into_iter().skip(own))
    }

    /// Reads `--root PATH --slot N --incarnation N --parent PID`, which is how the daemon starts every agent.
    ///
    /// # Errors
    /// When one is missing, or is not a number where it should be.
    pub fn parse(words: impl IntoIterator<Item = String>) -> Result<Args, ShellError> {
        let mut words = words.into_iter();
        let (mut root, mut slot, mut incarnation, mut parent) = (None, None, None, None);
        while let Some(key) = words.next() {
            let value = words.next().ok_or_else(|| ShellError::Usage(format!("`{key}` needs a value")))?;
            let number =
                || value.parse::<u32>().map_err(|_| ShellError::Usage(format!("`{key}`: `{value}` is not a number")));
            match key.as_str() {
                "--root" => root = Some(PathBuf::from(&value)),
                "--slot" => slot = Some(number()?),
                "--incarnation" => incarnation = Some(number()?),
                "--parent" => parent = Some(number()?),
                _ => return Err(ShellError::Usage(format!("unknown argument `{key}`"))),
            }
        }
        let missing = |key: &str| ShellError::Usage(format!("`{key}` is missing: agents are started by `shoal run`"));
        Ok(Args {
            root: root.ok_or_else(|| missing("--root"))?,
            instance: RobotInstance {
                index: RobotIndex(slot.ok_or_else(|| missing("--slot"))?),
                incarnation: incarnation.ok_or_else(|| missing("--incarnation"))?,
            },
            parent: parent.ok_or_else(|| missing("--parent"))?,
        })
    }
}

/// Why an agent's process ended badly.
#[derive(Debug, thiserror::Error)]
pub enum ShellError {
    /// It was not started as an agent is.
    #[error("agent: {0}")]
    Usage(String),
    /// Shared memory failed it, or it was started in a way in which it cannot tell when the fleet ends.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// What it shares with others failed it.
    #[error(transparent)]
    Ports(#[from] PortsError),
    /// Its spec cannot be read.
    #[error("agent spec `{0}`: {1}")]
    SpecFile(PathBuf, #[source] std::io::Error),
    /// Its spec is damaged.
    #[error("agent spec: {0}")]
    Spec(#[from] CodecError),
    /// Its method cannot be built.
    #[error(transparent)]
    Agent(#[from] AgentError),
}

/// What may change the pose and the command of a step before they are published.
pub type Adjust<'a> = dyn FnMut(&mut SharedPose, &mut AgentOutputs) + 'a;

/// What makes an agent's planner.
pub type Build<'a> = dyn FnMut(&AgentSpec) -> Result<Box<dyn Planner>, AgentError> + 'a;

/// Runs the agent with the method that its spec names.
///
/// # Errors
/// See [`ShellError`].
pub fn main(args: &Args) -> Result<(), ShellError> {
    run_as(args, false, &mut planner_of, &mut |_, _| {})
}

/// Runs an agent until its robot leaves or the run ends. `build` makes the planner; `adjust` may change what the
/// agent says and does before it is published.
///
/// # Errors
/// See [`ShellError`].
pub fn run(args: &Args, build: &mut Build<'_>, adjust: &mut Adjust<'_>) -> Result<(), ShellError> {
    run_as(args, true, build, adjust)
}

/// The same; `is_own`: its executable is not shoal's.
fn run_as(args: &Args, is_own: bool, build: &mut Build<'_>, adjust: &mut Adjust<'_>) -> Result<(), ShellError> {
    bus::process::leave_ending_to_daemon();
    let address = Address::at(&args.root)?;
    let left_running = helm::is_left_running(&address);
    if !left_running {
        bus::process::die_with_ancestor(args.parent)?;
    }
    // Early: behind a wrapper this is how the daemon finds the process that it has to stop or to kill.
    let gate = Gate::open(&address)?;
    gate.announce_process(args.instance);
    let path = address.file(&spec_file(args.instance));
    #[expect(clippy::disallowed_methods, reason = "the shell reads its spec once, before the loop")]
    let bytes = std::fs::read(&path).map_err(|error| ShellError::SpecFile(path, error))?;
    let mut spec: AgentSpec = codec::decode(&bytes)?;
    bus::attach_map(&address, spec.walls.as_mut())?;
    bus::attach_ways(&address, planners::way::tell_links)?;

    let planner = build(&spec)?;
    let watch = Arc::new(Stopwatch::default());
    let agent = Agent::with_planner(spec, Box::new(Timed { inner: planner, watch: Arc::clone(&watch) }));
    let mut ports = {
        let spec = agent.spec();
        let sizes = Sizes { max_robots: spec.max_robots, shape_pieces: spec.shape_pieces };
        let poses = if spec.clock.mode == Mode::Realtime { Poses::Newest } else { Poses::LastTwo };
        let custody = left_running.then(|| Custody::of(&address));
        Ports::open(
            &address,
            gate,
            (args.instance, &spec_file(args.instance)),
            sizes,
            poses,
            agent.has_borders(),
            custody,
        )?
    };
    // In other modes, what an agent knows follows from what the world was told.
    if agent.spec().clock.mode == Mode::Realtime && bus::notes::is_recorded(&address) {
        ports.notes = Notes::begin(&address, agent.spec(), is_own);
    }
    ports.prepare(&agent.spec().foreseen);
    ports.gate.announce_ready(args.instance);
    let ended = match agent.spec().clock.mode {
        Mode::Realtime => realtime(agent, &mut ports, &watch, adjust),
        Mode::Lockstep | Mode::Single => lockstep(agent, &mut ports, &watch, adjust),
    };
    if let Err(ShellError::Ports(PortsError::Deaf(to, _))) = &ended {
        // A robot that does not hear what it should must not go on as if nobody were there.
        ports.gate.announce_deaf(args.instance, *to);
    }
    ended
}

/// Name of the file in the run's root that holds the spec of a robot instance.
pub fn spec_file(instance: RobotInstance) -> String {
    format!("agent-{}-{}", instance.index, instance.incarnation)
}

/// Name of the file beside it that holds the same as JSON, if the robot names a program of its own.
pub fn spec_file_json(instance: RobotInstance) -> String {
    format!("{}.json", spec_file(instance))
}

/// `lockstep`: the world opens a tick, this robot answers it.
fn lockstep(
    mut agent: Agent,
    ports: &mut Ports,
    stopwatch: &Stopwatch,
    adjust: &mut Adjust<'_>,
) -> Result<(), ShellError> {
    let instance = agent.spec().instance;
    let mut last = None;
    loop {
        let (tick, opened_ns) = match ports.gate.wait_tick(last, PATIENCE) {
            TickWait::Open { tick, stamp_ns } => (tick, stamp_ns),
            TickWait::TimedOut if ports.is_orphaned(clock::now_ns()) => return Ok(()),
            TickWait::TimedOut => continue,
            TickWait::Stopped => return Ok(()),
        };
        ports.follow_world()?;
        let measured = gate::is_measured(tick);
        let woken_ns = if measured { clock::now_ns() } else { opened_ns };
        last = Some(tick);
        let odometry = ports.world.odometry();
        match duty(instance, &odometry, odometry.tick == tick) {
            Duty::Plan => {}
            Duty::Wait => continue,
            Duty::ShowLife => {
                ports.gate.note_alive(instance);
                continue;
            }
            Duty::Leave => return Ok(()),
        }
        step(&mut agent, ports, &odometry, Time::Ticks, stopwatch, adjust)?;
        ports.gate.answer(instance, tick);
        ports.open_coming(Duration::MAX);
        if measured {
            ports.stats.record(Metric::Wake, woken_ns.saturating_sub(opened_ns));
            record_ages(&agent, ports, stopwatch.begun_ns.load(Relaxed));
            ports.stats.record(Metric::Plan, stopwatch.plan_ns());
            ports.stats.record(Metric::Step, clock::now_ns().saturating_sub(woken_ns));
        }
        ports.stats.add(Counter::Periods, 1);
    }
}

/// `realtime`: this robot's own timer opens its periods; nobody waits for anybody.
fn realtime(
    mut agent: Agent,
    ports: &mut Ports,
    stopwatch: &Stopwatch,
    adjust: &mut Adjust<'_>,
) -> Result<(), ShellError> {
    let (instance, robots) = (agent.spec().instance, u64::from(agent.spec().max_robots));
    let odometry_age_ns_max = (agent.spec().command_timeout_s * 1e9) as u64;
    clock::set_timer_slack_1ns();
    while !ports.gate.wait_meeting(PATIENCE) {
        if ports.gate.stopped() || ports.is_orphaned(clock::now_ns()) {
            return Ok(());
        }
    }
    if ports.gate.start_ns().is_none() {
        ports.follow_list();
        ports.open_missing(Duration::MAX)?;
        ports.gate.announce_met(instance);
    }
    bus::process::give_back_stack();
    let start_ns = loop {
        if ports.gate.stopped() || ports.is_orphaned(clock::now_ns()) {
            return Ok(());
        }
        if let Some(start_ns) = ports.gate.wait_start(PATIENCE) {
            break start_ns;
        }
    };
    let period_ns = (1e9 / agent.spec().clock.tick_hz) as u64;
    // The agents spread over the period, behind the world: they do not all want the processor at once.
    let phase_ns = period_ns * (u64::from(instance.index.0) + 1) / (robots + 1);
    let first_ns = start_ns + phase_ns;
    let passed = clock::now_ns().saturating_sub(first_ns).div_ceil(period_ns);
    let mut due_ns = first_ns + passed * period_ns;
    let opening = Duration::from_nanos(period_ns / OPENING_SHARE);
    let mut watch = Watch::of_agent();
    // From its first period in the world to the last tick of it, a robot is expected to be on time; not while somebody
    // has stopped its process (SIGSTOP, which the timeline uses as well), of which it learns when it may go on.
    let mut expected = false;
    let continued = Arc::new(AtomicBool::new(false));
    // It is a wish: where it is refused, a stopped process counts as a late one.
    let _ = signal_hook::flag::register(signal_hook::consts::SIGCONT, Arc::clone(&continued));
    loop {
        clock::sleep_until_ns(due_ns);
        let woken_ns = clock::now_ns();
        if ports.gate.stopped() {
            return Ok(());
        }
        ports.follow_world()?;
        let odometry = ports.world.odometry();
        let mut work_ns = 0;
        // From odometry that is too old for its commands to act there is no command: nobody drives blind. The periods
        // count as late for their input.
        let is_fresh = woken_ns.saturating_sub(odometry.stamp_ns) <= odometry_age_ns_max;
        match duty(instance, &odometry, is_fresh) {
            Duty::Plan => {
                if !std::mem::replace(&mut expected, true) {
                    // What it does not hear from its first period on it does not know: that is worth a part of it.
                    ports.follow_list();
                    ports.open_missing(Duration::from_nanos(period_ns / FIRST_OPENING_SHARE))?;
                }
                step(&mut agent, ports, &odometry, Time::Stamps { now_ns: woken_ns }, stopwatch, adjust)?;
                work_ns = stopwatch.plan_ns();
                // After the last tick nobody has anything new to say: what was said last only gets older.
                if !ports.gate.over() {
                    record_ages(&agent, ports, stopwatch.begun_ns.load(Relaxed));
                    ports.stats.record(Metric::Plan, work_ns);
                    ports.stats.record(Metric::Step, clock::now_ns().saturating_sub(woken_ns));
                }
                ports.gate.note_alive(instance);
            }
            Duty::ShowLife => ports.gate.note_alive(instance),
            // Nothing is heard of a world.
            Duty::Wait if !is_fresh && ports.is_orphaned(woken_ns) => return Ok(()),
            Duty::Wait => {}
            Duty::Leave => return Ok(()),
        }
        let period = Period {
            period_ns,
            due_ns,
            woken_ns,
            done_ns: clock::now_ns(),
            work_ns,
            input_age_ns: woken_ns.saturating_sub(odometry.stamp_ns),
            ..Period::default()
        };
        if expected && !continued.swap(false, Relaxed) && !ports.gate.over() {
            watch.judge(&mut ports.stats, period);
        }
        ports.open_missing(opening)?;
        ports.open_coming(opening);
        // The next period is the first one that has not gone by completely: it begins late, those before never.
        due_ns += period_ns * period.missed().max(1);
    }
}

/// Reads what there is, plans, publishes.
fn step(
    agent: &mut Agent,
    ports: &mut Ports,
    odometry: &Odometry,
    time: Time,
    stopwatch: &Stopwatch,
    adjust: &mut Adjust<'_>,
) -> Result<(), ShellError> {
    ports.listen(match time {
        Time::Ticks => Some(odometry.tick),
        Time::Stamps { .. } => None,
    })?;
    ports.look();
    stopwatch.slow_us.store(ports.impairment.slow_us, Relaxed);
    let radio = ports.impairment.radio();
    let (heard, borders, pieces) = (&ports.heard, &ports.borders, &ports.pieces);
    let inputs = AgentInputs { odometry, heard, borders, radio, pieces, time };
    let (outputs, stamp_ns) = ports.robot.pose(|pose| {
        let mut outputs = agent.step(&inputs, pose);
        adjust(pose, &mut outputs);
        // The planner's stopwatch has just looked at the clock.
        pose.stamp_ns = stopwatch.done_ns.load(Relaxed);
        if let Some(notes) = &mut ports.notes {
            // Before anybody can hear it: whoever notes that he heard it comes later.
            notes.step(&inputs, pose, &outputs, ports.gate.progress().tick);
        }
        (outputs, pose.stamp_ns)
    });
    if ports.has_borders {
        ports.robot.borders(|borders| agent.tell_borders(odometry.tick, borders));
    }
    ports.robot.command(|command| outputs.command(odometry, stamp_ns, command));
    ports.gate.note_heard(agent.spec().instance, ports.world.neighbors_version(), ports.heard.len());
    Ok(())
}

/// Counts how old the poses were that the planner used.
fn record_ages(agent: &Agent, ports: &mut Ports, used_ns: u64) {
    for (who, spoken_ns) in agent.used() {
        let age_ns = used_ns.saturating_sub(spoken_ns);
        ports.stats.record(Metric::PoseAge, age_ns);
        ports.stats.record_of(RobotIndex(who.index), Metric::PoseAge, age_ns, used_ns);
    }
}

/// When the planner began and when it was done, monotonic clock, ns. Atomics, because planners may be sent to threads.
#[derive(Default)]
struct Stopwatch {
    begun_ns: AtomicU64,
    done_ns: AtomicU64,
    /// A fault on purpose: every plan takes longer by this time, µs.
    slow_us: AtomicU32,
}

impl Stopwatch {
    fn plan_ns(&self) -> u64 {
        self.done_ns.load(Relaxed).saturating_sub(self.begun_ns.load(Relaxed))
    }
}

/// A planner with a stopwatch.
struct Timed {
    inner: Box<dyn Planner>,
    watch: Arc<Stopwatch>,
}

impl Planner for Timed {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        self.watch.begun_ns.store(clock::now_ns(), Relaxed);
        let plan = self.inner.plan(input);
        let slow_us = self.watch.slow_us.load(Relaxed);
        if slow_us > 0 {
            // It sleeps: a slow processor of one robot takes nothing from the others.
            clock::sleep_until_ns(clock::now_ns() + u64::from(slow_us) * 1000);
        }
        self.watch.done_ns.store(clock::now_ns(), Relaxed);
        plan
    }
}
