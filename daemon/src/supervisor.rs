//! The supervisor: the processes of one fleet and the shared memory they live in. It does what the coordinator
//! decides, and tells it what became of it.

mod ending;
mod joining;
mod keeping;
mod places;
mod serving;
mod takeover;
mod worlds;

pub use ending::Finished;
pub use takeover::Orphan;

use crate::coordinator::{Action, Coordinator, Ending, Missed, News, Robots, Signal};
use crate::error::{Error, Kind};
use crate::executables::Executables;
use crate::guardian::Guardian;
use crate::janitor::Janitor;
use crate::processes::{Change, Children, Who, now};
use crate::rlimits;
use crate::service::{Entry, Level};
use crate::service::{Service, wall_ms};
use crate::signals::Signals;
use bus::{
    Address, Footing, Gate, Helm, Lease, Node, NoticeReceiver, OperatorServer, OrderSender, Progress, Responder,
    Services, Sizes, StatsSnapshot, WorldObserver, clean, clock,
};
use ending::full_memory;
use keeping::Keeper;
use model::{Rate, RobotIndex, RobotInstance, Scenario};
use places::Bids;
use protocol::FLEET_VERSION;
use protocol::codec;
use protocol::daemon_to_robot::AgentSpec;
use protocol::daemon_to_world::{Order, Ticket};
use protocol::world_to_daemon::Notice;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::Signal as Kill;
use std::collections::BTreeMap;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::time::Duration;
use world_sim::outcome_file::OutcomeFile;
use worlds::Worlds;

/// How often the daemon looks at the clock while nothing happens.
const HEARTBEAT: Timespec = Timespec { tv_sec: 0, tv_nsec: 100_000_000 };
/// The same while an operator waits for a robot to join.
const JOINING_BEAT: Timespec = Timespec { tv_sec: 0, tv_nsec: 1_000_000 };
/// How often it looks whether the fleet's files are still there.
const FOOTING_EVERY: Duration = Duration::from_millis(250);
/// How long the world may take to end once it has been asked to: some container runtimes kill after ten seconds.
const ENDING_MAX: Duration = Duration::from_secs(8);

/// A fleet whose first tick has begun.
pub struct FleetView<'a> {
    /// Where it lives.
    pub address: &'a Address,
    /// Its processes; the world's is the first.
    pub pids: &'a [u32],
}

/// How a run begins.
#[derive(Clone, Copy, Debug, Default)]
pub struct Start<'a> {
    /// Where the world leaves a record, if it is to leave one.
    pub record: Option<&'a Path>,
    /// `lockstep`: no tick opens before an operator lets it.
    pub paused: bool,
    /// `lockstep`: the rate to which ticks are held.
    pub rate: Rate,
}

/// Whoever watches a run.
pub trait Watch {
    /// The first tick has begun.
    fn started(&mut self, _fleet: &FleetView<'_>) {}
    /// Whether it has seen enough: then the run ends in good order.
    fn enough(&self) -> bool {
        false
    }
    /// Where the run is, this long after its first tick, s of wall time.
    fn progress(&mut self, progress: &Progress, wall_s: f64);
    /// Something happened.
    fn say(&mut self, line: &str);
    /// An event of this kind happened; there may be many.
    fn news(&mut self, kind: News, line: &str);
}

/// One fleet, from its creation to its end.
pub struct Supervisor {
    address: Address,
    coordinator: Coordinator,
    children: Children,
    gate: Gate,
    orders: OrderSender,
    notices: NoticeReceiver,
    operators: OperatorServer,
    /// Operators whose request the world has not decided yet.
    awaiting: Vec<(Ticket, Responder)>,
    observer: WorldObserver,
    worlds: Worlds,
    signals: Signals,
    world_ending: Option<Ending>,
    /// What the world leaves when it ends.
    left: OutcomeFile,
    footing: Footing,
    footing_seen: Duration,
    /// What went wrong around the run; each of these ends it, and none costs its result.
    failures: Vec<Error>,
    /// When the world was asked to end.
    asked_at: Option<Duration>,
    /// Somebody wants the end at once.
    killed: bool,
    /// Whoever watches has seen enough.
    enough: bool,
    /// When the first process was started, if this daemon has done that.
    spawned_ns: Option<u64>,
    /// What lives that are over have counted, by slot.
    departed: BTreeMap<RobotIndex, StatsSnapshot>,
    /// The newest life of each robot that was started, which its spec says to a daemon that takes over: whatever else is
    /// lost, no life is started twice.
    specs: BTreeMap<RobotIndex, RobotInstance>,
    /// What outlives the fleet, if it is one that is left running.
    keeper: Option<Keeper>,
    /// The daemon's place at such a fleet.
    helm: Option<Helm>,
    janitor: Janitor,
    node: Node,
    services: Services,
    guardian: Guardian,
    _lease: Lease,
}

/// Runs a scenario as real processes, and removes everything of it afterwards.
///
/// # Errors
/// When the environment fails: shared memory, an executable, a process that cannot be started, a dead world; or when
/// the run is interrupted twice.
pub fn run(scenario: Scenario, start: Start<'_>, watch: &mut dyn Watch) -> Result<Finished, Error> {
    run_as(scenario, start, None, watch)
}

/// Runs a scenario as a fleet that is left running, until an operator or a signal asks for the end. What outlives it is in
/// the state directory of the service.
///
/// # Errors
/// As [`run`]; and when the database or the log of the service cannot be written at the start.
pub fn serve(scenario: Scenario, service: Service, start: Start<'_>, watch: &mut dyn Watch) -> Result<Finished, Error> {
    run_as(scenario, start, Some(service), watch)
}

fn run_as(
    scenario: Scenario,
    start: Start<'_>,
    service: Option<Service>,
    watch: &mut dyn Watch,
) -> Result<Finished, Error> {
    let executables = Executables::find(&scenario)?;
    crate::scheduling::check(&scenario.processes)?;
    crate::limits::check(&scenario)?;
    crate::descriptors::check(&scenario)?;
    rlimits::check(&scenario)?;
    // First of all: whoever ends the run from here on finds somebody who cleans.
    let signals = Signals::install()
        .map_err(|error| Error::new(Kind::Process, format!("signals: cannot install handlers: {error}")))?;
    let address = Address::create()?;
    let result =
        Supervisor::create(address.clone(), scenario, executables, start.record, signals).and_then(|mut supervisor| {
            supervisor.coordinator.begin_at(start.paused, start.rate);
            if let Some(service) = service {
                supervisor.take_helm()?;
                supervisor.begin_service(service, Robots::New)?;
            }
            serve_until_the_end(supervisor, Supervisor::start, watch)
        });
    if result.is_err() {
        clean::sweep(&address);
    }
    result
}

/// Lets a fleet begin, looks after it until its end, and removes everything of it.
fn serve_until_the_end(
    mut supervisor: Supervisor,
    begin: fn(&mut Supervisor) -> Result<(), Error>,
    watch: &mut dyn Watch,
) -> Result<Finished, Error> {
    let result = begin(&mut supervisor).map(|()| supervisor.supervise(watch)).and_then(|()| supervisor.finish(watch));
    supervisor.kill_all(watch);
    supervisor.end_service(&result);
    // What agents of others start may have left the process group of the fleet, which a fleet that was taken over has not.
    let all = supervisor.children.has_guests() || supervisor.helm.is_some();
    let Supervisor { guardian, children, janitor, address, helm, .. } = supervisor;
    // Everything that killed processes left goes here; the guardian stays on guard until that is done.
    drop((children, janitor));
    clean::sweep(&address);
    guardian.dismiss();
    if all {
        clean::end_processes(&address);
    }
    drop(helm);
    result
}

impl Supervisor {
    /// Creates the fleet's shared memory; no process runs yet but the guardian.
    fn create(
        address: Address,
        scenario: Scenario,
        executables: Executables,
        record: Option<&Path>,
        signals: Signals,
    ) -> Result<Supervisor, Error> {
        let lease = Lease::take(&address)?;
        let sizes = Sizes { max_robots: scenario.fleet.max_robots as u32, shape_pieces: scenario.shape_pieces() };
        // Agents whose run is recorded need room for their notes.
        if let Some(record) = record {
            write_bytes(&address.file(world_sim::shell::RECORD_FILE), record.as_os_str().as_bytes())?;
        }
        sizes.check_space(&address)?;
        let guardian = Guardian::start(&address)?;
        let left = OutcomeFile::create(&address).map_err(|error| no_room(&address, &error))?;
        write(&address, world_sim::shell::SCENARIO_FILE, &scenario)?;
        if let Some(map) = &scenario.map {
            bus::freeze_map(&address, map)?;
        }
        if let Some(links) = robot_agent::links_of(&scenario) {
            bus::freeze_ways(&address, &links)?;
        }
        let node = Node::new(&address, "daemon")?;
        let services = Services::create(&node, sizes)?;
        let gate = Gate::create(&address, sizes.max_robots)?;
        Ok(Supervisor {
            children: Children::new(&address, scenario.processes.clone(), executables),
            gate,
            footing: Footing::survey(&address)?,
            footing_seen: now(),
            left,
            failures: Vec::new(),
            asked_at: None,
            orders: OrderSender::open(&node)?,
            notices: NoticeReceiver::open(&node)?,
            operators: OperatorServer::open(&address)?,
            awaiting: Vec::new(),
            observer: WorldObserver::open(&node, 0)?,
            worlds: Worlds::default(),
            coordinator: Coordinator::new(scenario),
            signals,
            world_ending: None,
            killed: false,
            enough: false,
            spawned_ns: None,
            departed: BTreeMap::new(),
            specs: BTreeMap::new(),
            keeper: None,
            helm: None,
            janitor: Janitor::new(&address),
            address,
            node,
            services,
            guardian,
            _lease: lease,
        })
    }

    /// Becomes the daemon of a fleet that another one may take over.
    fn take_helm(&mut self) -> Result<(), Error> {
        let helm = Helm::take(&self.address)?;
        if let Some(helm) = &helm {
            helm.sign(&self.address, FLEET_VERSION, env!("CARGO_PKG_VERSION"))?;
        }
        self.helm = helm;
        Ok(())
    }

    /// Starts the world, and the agents of all robots that are there from the beginning.
    fn start(&mut self) -> Result<(), Error> {
        self.spawned_ns = Some(clock::now_ns());
        // The world finds in its orders at what pace to begin.
        self.act(None);
        self.children.spawn_world(0)?;
        self.coordinator.begin();
        self.act(None);
        Ok(())
    }

    /// The loop: sleep until something happens, find out what, do what follows.
    fn supervise(&mut self, watch: &mut dyn Watch) {
        let overdue = |asked: Option<Duration>| asked.is_some_and(|asked| now() - asked > ENDING_MAX);
        while self.world_ending.is_none() && !self.killed && !overdue(self.asked_at) {
            {
                let mut sources = vec![
                    PollFd::new(&self.signals, PollFlags::IN),
                    PollFd::new(&self.notices, PollFlags::IN),
                    PollFd::new(&self.operators, PollFlags::IN),
                ];
                sources.extend(self.children.fosters().map(|process| PollFd::new(process, PollFlags::IN)));
                // An interrupted sleep is as good as a finished one.
                let beat = if self.coordinator.awaits_newcomers() { &JOINING_BEAT } else { &HEARTBEAT };
                let _ = poll(&mut sources, Some(beat));
            }
            for _ in 0..self.signals.take_interrupts() {
                self.coordinator.interrupt(now());
            }
            self.coordinator.tell_wall_clock(wall_ms());
            self.reap();
            self.look();
            self.follow_world();
            if self.coordinator.wants_places() {
                self.coordinator.tell_places(self.places(Bids::Unread));
            }
            self.hear();
            self.look_at_newcomers();
            self.serve();
            self.orders.flush();
            let gate = &self.gate;
            let waited = |pid| clock::schedstat_of(pid).map_or(0, |stat| stat.waited_ns);
            let waited = |pid| Duration::from_nanos(waited(pid));
            let children = &self.children;
            let words = |instance| children.words_so_far(Who::Agent(instance));
            self.coordinator.time(now(), &|instance| gate.is_ready(instance), &waited, &words);
            self.coordinator.open_tick(self.open_tick(), now());
            self.janitor.tend(now());
            self.act(Some(watch));
            self.children.adopt(&self.gate);
            self.pass_on_talk(watch);
            self.keep_robots();
            if self.gate.start_ns().is_some() {
                if self.children.begin_measuring() {
                    watch.started(&FleetView { address: &self.address, pids: &self.children.pids() });
                }
                self.show(watch);
                if watch.enough() && !std::mem::replace(&mut self.enough, true) {
                    self.coordinator.enough();
                }
            }
        }
    }

    /// Takes what the world has said.
    pub(crate) fn hear(&mut self) {
        let mut bids_are_read = false;
        while let Some(notice) = self.notices.take() {
            if !bids_are_read && self.coordinator.wants_bids(&notice) {
                self.coordinator.tell_places(self.places(Bids::Read));
                bids_are_read = true;
            }
            if let Notice::Log(event) = &notice {
                self.keep_event(event);
            }
            self.coordinator.notice(notice);
        }
        self.coordinator.missed(Missed { entries: self.notices.left_out(), others: self.notices.lost() });
    }

    /// The run cannot go on like this: it ends in good order, and what it has come to is reported.
    fn fail(&mut self, failure: Error) {
        if self.failures.is_empty() {
            self.coordinator.enough();
        }
        self.log(Entry::new(Level::Error, "daemon", failure.message.clone()));
        self.failures.push(failure);
    }

    /// Whether the fleet's files are still there: without them nobody can join or be restarted.
    fn look(&mut self) {
        let now = now();
        if now - self.footing_seen < FOOTING_EVERY || !self.failures.is_empty() {
            return;
        }
        self.footing_seen = now;
        if self.guardian.has_ended()
            && let Ok(guardian) = Guardian::start(&self.address)
        {
            self.guardian = guardian;
            self.coordinator.say("the guardian's process has ended: another one is on guard".to_owned());
        }
        if let Some(path) = self.footing.missing() {
            let problem =
                format!("fleet `{}`: its files were removed: `{}` does not exist", self.address.id(), path.display());
            self.fail(
                Error::new(Kind::Memory, problem).hint(
                    "was it `rm` in /dev/shm, or logind at a logout (`RemoveIPC=no` in logind.conf prevents that)?",
                ),
            );
        }
    }

    pub(crate) fn show(&self, watch: &mut dyn Watch) {
        let progress = self.gate.progress();
        let start_ns = self.gate.start_ns().unwrap_or(progress.stamp_ns);
        watch.progress(&progress, progress.stamp_ns.saturating_sub(start_ns) as f64 * 1e-9);
    }

    /// Finds out which processes ended, were stopped, or go on.
    pub(crate) fn reap(&mut self) {
        for (who, change) in self.children.changes() {
            match (who, change) {
                (Who::World, Change::Ended(ending)) => self.world_ended(ending),
                (Who::World, Change::Stopped) => {
                    self.coordinator.news(News::WorldStopped, "the world's process was stopped");
                }
                (Who::World, Change::Continued) => {
                    self.coordinator.news(News::WorldGoesOn, "the world's process goes on");
                }
                (Who::Agent(instance), Change::Ended(ending)) => {
                    let words = self.children.last_words(who, now()).filter(|_| ending.code != Some(0));
                    let words = full_memory(ending).or(words);
                    let limits = self.coordinator.scenario().processes.agent_limits;
                    let words = words.map(|words| rlimits::explain(limits, words));
                    self.coordinator.exited(instance, ending, words, self.gate.deaf_to(instance));
                    self.bury(instance);
                }
                (Who::Agent(instance), Change::Stopped) => self.coordinator.stopped(instance),
                (Who::Agent(instance), Change::Continued) => self.coordinator.continued(instance),
            }
        }
    }

    /// Takes over what a life has counted, and removes what it leaves in shared memory: a robot may have many lives.
    fn bury(&mut self, instance: RobotInstance) {
        let name = robot_agent::shell::spec_file(instance);
        if let Some(counted) = bus::stats::take(&self.address, &name) {
            self.departed.entry(instance.index).or_default().merge(&counted);
        }
        self.children.bury(instance);
        self.janitor.want();
    }

    /// Does what the coordinator decided.
    pub(crate) fn act(&mut self, mut watch: Option<&mut dyn Watch>) {
        loop {
            let actions = self.coordinator.take_actions();
            if actions.is_empty() {
                return;
            }
            self.keep(&actions);
            for action in actions {
                match action {
                    Action::Spawn(instance) => self.spawn_agent(instance),
                    Action::Signal(instance, signal) => {
                        if let Some(pid) = self.coordinator.members()[instance.index.at()].pid {
                            let signal = match signal {
                                Signal::Kill => Kill::KILL,
                                Signal::Stop => Kill::STOP,
                                Signal::Continue => Kill::CONT,
                            };
                            self.children.adopt(&self.gate);
                            self.children.signal(pid, signal);
                        }
                    }
                    Action::Order(order) => {
                        if order == Order::Stop {
                            self.asked_at.get_or_insert_with(now);
                        }
                        if self.helm.is_some() && matches!(order, Order::Admit { .. }) {
                            self.leave_scenario();
                        }
                        self.orders.send(&order).unwrap_or_else(|error| self.fail(error.into()));
                        self.gate.ring_world();
                    }
                    Action::Keep { .. } | Action::Record(_) => {} // Has been kept, or refused.
                    Action::Reply(ticket, reply) => {
                        if let Some(index) = self.awaiting.iter().position(|(waits, _)| *waits == ticket) {
                            self.awaiting.swap_remove(index).1.reply(&reply);
                        }
                    }
                    Action::News { kind, robot, line } => {
                        if !matches!(kind, News::Event(_)) {
                            let level = match kind {
                                News::RobotGoesOn | News::TickGoesOn | News::WorldGoesOn => Level::Info,
                                _ => Level::Warn,
                            };
                            let robot = robot.map(|robot| self.coordinator.name(robot).to_owned());
                            self.log(Entry { robot, ..Entry::new(level, "daemon", line.clone()) });
                        }
                        if let Some(watch) = watch.as_deref_mut() {
                            watch.news(kind, &line);
                        }
                    }
                    Action::Say(line) => {
                        self.log(Entry::new(Level::Info, "daemon", line.clone()));
                        if let Some(watch) = watch.as_deref_mut() {
                            watch.say(&line);
                        }
                    }
                    Action::KillFleet => self.killed = true,
                }
            }
        }
    }

    /// Leaves the scenario, with the robots that were added, to a daemon that takes over.
    fn leave_scenario(&mut self) {
        let (name, draft) = (world_sim::shell::SCENARIO_FILE, "scenario.draft");
        let left = write(&self.address, draft, self.coordinator.scenario()).and_then(|()| {
            std::fs::rename(self.address.file(draft), self.address.file(name))
                .map_err(|error| Error::new(Kind::Memory, format!("scenario: cannot be replaced: {error}")))?;
            self.footing = Footing::survey_running(&self.address)?;
            Ok(())
        });
        if let Err(failure) = left {
            self.log(Entry::new(Level::Error, "daemon", failure.message));
        }
    }

    /// What keeps one robot from starting is said of that robot; the others go on.
    fn spawn_agent(&mut self, instance: RobotInstance) {
        let Some(robot) = self.coordinator.scenario().robots.get(instance.index.at()) else { return };
        let (id, program) = (robot.id.clone(), robot.agent.clone());
        let foreseen = self.foreseen(robot, instance);
        let spec = AgentSpec { foreseen, ..AgentSpec::new(self.coordinator.scenario(), robot, instance) };
        if let Err(failure) = write(&self.address, &robot_agent::shell::spec_file(instance), &spec) {
            return self.coordinator.not_spawned(instance, failure.message);
        }
        let as_json = |instance| self.address.file(&robot_agent::shell::spec_file_json(instance));
        if program.is_some() {
            // For people, and for agents that do not link shoal: that of its own agents is the other one.
            let text = serde_json::to_vec_pretty(&spec).unwrap_or_default();
            if let Err(failure) = write_bytes(&as_json(instance), &text) {
                return self.coordinator.not_spawned(instance, failure.message);
            }
        }
        if let Some(before) = self.specs.insert(instance.index, instance) {
            let _ = std::fs::remove_file(self.address.file(&robot_agent::shell::spec_file(before)));
            let _ = std::fs::remove_file(as_json(before));
        }
        match self.children.spawn_agent(instance, &id, program.as_ref()) {
            Ok(pid) => self.coordinator.spawned(instance, pid, now()),
            Err(problem) => self.coordinator.not_spawned(instance, problem),
        }
    }
}

/// Leaves a value for a process of the fleet, as a file in the root of the run.
fn write<T: serde::Serialize>(address: &Address, name: &str, value: &T) -> Result<(), Error> {
    let path = address.file(name);
    let bytes =
        codec::encode(value).map_err(|error| Error::new(Kind::Memory, format!("`{}`: {error}", path.display())))?;
    write_bytes(&path, &bytes)
}

fn no_room(address: &Address, error: &std::io::Error) -> Error {
    Error::new(Kind::Memory, format!("outcome of fleet `{}`: cannot reserve space: {error}", address.id()))
        .hint("is /dev/shm full (`df -h /dev/shm`, `shoal clean`), or a limit on file sizes set (`ulimit -f`)?")
}

fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    #[expect(clippy::disallowed_methods, reason = "the supervisor leaves specs in the root of the run")]
    std::fs::write(path, bytes).map_err(|error| {
        Error::new(Kind::Memory, format!("`{}`: cannot write: {error}", path.display()))
            .hint("is /dev/shm full? see `df -h /dev/shm` and `shoal clean`")
    })
}
