//! The processes of a fleet: starting, watching, measuring and ending them.

use crate::coordinator::Ending;
use crate::error::{Error, Kind};
use crate::executables::{Executables, cannot_start};
use crate::logs::Logs;
pub use crate::logs::Spoken;
use crate::rlimits::limit;
use crate::scheduling::schedule;
use crate::signals::with_children_heard;
use bus::{Address, Gate};
use model::{AgentCommand, ProcessState, Processes, RobotInstance};
use report::ProcessFacts;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{
    Pid, PidfdFlags, Signal, WaitId, WaitIdOptions, WaitIdStatus, kill_process, kill_process_group, pidfd_open,
    pidfd_send_signal, waitid,
};
use std::collections::BTreeMap;
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// How long killed processes may take to go. One that hangs in the kernel, or that somebody traces, may take for ever.
pub const DYING: Duration = Duration::from_secs(2);

/// What a process used.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measured {
    /// Time on a processor, s.
    pub cpu_s: f64,
    /// Time it was ready to run but did not, s.
    pub run_queue_wait_s: f64,
    /// Its share of memory, KiB; `None` if it had ended when everybody else was measured.
    pub pss_kib: Option<u64>,
}

/// What the kernel says of a process, in a word for tables.
pub fn state_of(pid: u32) -> ProcessState {
    match bus::process::state_of(pid) {
        Some('T' | 't') => ProcessState::Stopped,
        Some('Z' | 'X') | None => ProcessState::Ended,
        Some(_) => ProcessState::Running,
    }
}

struct Child {
    who: Who,
    pid: Pid,
    /// It was started by a daemon of before, so that the kernel does not tell this one what becomes of it.
    foster: Option<Foster>,
    /// The agent, if that is another process, which this one has started; and when it began.
    wrapped: Option<(Pid, u64)>,
    alive: bool,
    /// What it had used when the first tick began: starting a fleet is not part of the run.
    before: Measured,
    measured: Measured,
}

/// How a process is watched that is no child of this one.
struct Foster {
    /// Names this very process, whatever its number is given to later.
    process: OwnedFd,
    /// It was stopped when it was last looked at.
    halted: bool,
}

/// The world and the agents of one fleet, dead ones included.
pub struct Children {
    root: PathBuf,
    logs: Logs,
    /// Lines of processes that have ended.
    said: Vec<Spoken>,
    scheduling: Processes,
    executables: Executables,
    /// The process group of the fleet: what agents of others start is in it as well.
    group: Option<Pid>,
    all: Vec<Child>,
    alive: BTreeMap<i32, usize>,
    measuring: bool,
}

impl Children {
    /// Nobody yet; they will be scheduled like this, and robots that name an agent get it from among these.
    pub fn new(address: &Address, scheduling: Processes, executables: Executables) -> Children {
        let root = address.root().to_path_buf();
        Children {
            logs: Logs::new(address),
            said: Vec::new(),
            root,
            scheduling,
            executables,
            group: None,
            all: Vec::new(),
            alive: BTreeMap::new(),
            measuring: false,
        }
    }

    /// Starts the world; the process group of the first one is the fleet's.
    ///
    /// # Errors
    /// When no process can be started.
    pub fn spawn_world(&mut self, incarnation: u32) -> Result<u32, Error> {
        close_on_exec();
        let mut command = shoal("world");
        command.arg("--root").arg(&self.root).arg("--incarnation").arg(incarnation.to_string());
        let pid = self.spawn(command, ProcessFacts::WORLD.to_owned(), Who::World).map_err(|error| {
            Error::new(Kind::Process, format!("world-sim: cannot start: {error}"))
                .hint("is the limit on processes reached? see `shoal doctor`")
        })?;
        Ok(pid)
    }

    /// Starts the agent of a robot instance: shoal's own, or the program that the robot names.
    ///
    /// # Errors
    /// When it cannot be started, in words.
    pub fn spawn_agent(
        &mut self,
        instance: RobotInstance,
        id: &str,
        own: Option<&AgentCommand>,
    ) -> Result<u32, String> {
        let program = own.map(|own| self.executables.path(own));
        #[expect(clippy::disallowed_methods, reason = "the supervisor starts the agents")]
        let mut command = program.as_ref().map_or_else(|| shoal("agent"), Command::new);
        command.args(own.map(AgentCommand::arguments).unwrap_or_default());
        command.arg("--root").arg(&self.root);
        command
            .arg("--slot")
            .arg(instance.index.to_string())
            .arg("--incarnation")
            .arg(instance.incarnation.to_string());
        if instance.incarnation > 0 {
            close_on_exec();
        }
        let started = self.spawn(command, id.to_owned(), Who::Agent(instance));
        started.map_err(|error| cannot_start(program.as_deref().unwrap_or(Path::new("shoal agent")), &error))
    }

    fn spawn(&mut self, mut command: Command, speaker: String, who: Who) -> io::Result<u32> {
        // The child asks the kernel to die with this process; it compares this number in case it is too late for that.
        command.arg("--parent").arg(std::process::id().to_string()).env(bus::clean::MARK, &self.root);
        command.process_group(self.group.map_or(0, Pid::as_raw_pid));
        schedule(
            &mut command,
            match who {
                Who::World => &self.scheduling.world,
                Who::Agent(_) => &self.scheduling.agents,
            },
        );
        if let Who::Agent(_) = who {
            limit(&mut command, self.scheduling.agent_limits);
        }
        let log = self.logs.create(&log_of(who), speaker)?;
        command.stdin(Stdio::null()).stdout(log.try_clone()?).stderr(log);
        let id = with_children_heard(|| command.spawn())?.id();
        let pid = pid_of(id).expect("a spawned process has a positive id");
        self.group.get_or_insert(pid);
        self.alive.insert(pid.as_raw_pid(), self.all.len());
        let (before, measured) = (Measured::default(), Measured::default());
        self.all.push(Child { who, pid, foster: None, wrapped: None, alive: true, before, measured });
        Ok(id)
    }

    /// Takes over the processes of a fleet whose daemon has ended: who they are, and the number of each. `speaker` names a
    /// process for people.
    pub fn take_over(&mut self, address: &Address, gate: &Gate, speaker: &dyn Fn(Who) -> String) -> Vec<(Who, u32)> {
        let mut found: BTreeMap<Who, Vec<(u64, u32)>> = BTreeMap::new();
        for (pid, instance) in bus::clean::members(address) {
            if let Some(since) = bus::process::start_of(pid) {
                found.entry(instance.map_or(Who::World, Who::Agent)).or_default().push((since, pid));
            }
        }
        let mut taken = Vec::new();
        for (who, mut processes) in found {
            // A wrapper was started before the agent that it has started, and waits for its end.
            processes.sort_unstable();
            let Some((id, (pid, foster))) =
                processes.iter().find_map(|(since, pid)| Some((*pid, (pid_of(*pid)?, Foster::of(*pid, *since)?))))
            else {
                continue;
            };
            let is_agent = |(_, other): &&(u64, u32)| match who {
                Who::World => false,
                Who::Agent(instance) => *other != id && gate.process(instance) == Some(*other),
            };
            let wrapped = processes.iter().find(is_agent).and_then(|(since, other)| Some((pid_of(*other)?, *since)));
            self.alive.insert(pid.as_raw_pid(), self.all.len());
            let (before, measured) = (Measured::default(), Measured::default());
            self.all.push(Child { who, pid, foster: Some(foster), wrapped, alive: true, before, measured });
            self.logs.take_over(&log_of(who), speaker(who));
            taken.push((who, id));
        }
        taken
    }

    /// Descriptors that are readable when a process ends of which the kernel does not tell.
    pub fn fosters(&self) -> impl Iterator<Item = &OwnedFd> {
        self.alive.values().filter_map(|index| self.all[*index].foster.as_ref().map(|foster| &foster.process))
    }

    /// What happened to the processes since the last call.
    pub fn changes(&mut self) -> Vec<(Who, Change)> {
        let mut changes = self.changes_of_fosters();
        let kinds = WaitIdOptions::EXITED | WaitIdOptions::STOPPED | WaitIdOptions::CONTINUED;
        // Mostly nothing has happened to anybody: one look instead of one at each.
        if matches!(waitid(WaitId::All, kinds | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT), Ok(None)) {
            return changes;
        }
        let alive: Vec<usize> = self.alive.values().copied().collect();
        for index in alive {
            let child = &mut self.all[index];
            if child.foster.is_some() {
                continue;
            }
            // A look without taking: the statistics of a dead process are gone once it is reaped.
            let look = kinds | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
            let Ok(Some(status)) = waitid(WaitId::Pid(child.pid), look) else { continue };
            if let Some(ending) = ending_of(&status) {
                if child.measured == Measured::default() {
                    child.measured = measure(child.itself(), false);
                }
                child.alive = false;
                self.alive.remove(&child.pid.as_raw_pid());
                changes.push((child.who, Change::Ended(ending)));
            } else if status.stopped() {
                changes.push((child.who, Change::Stopped));
            } else if status.continued() {
                changes.push((child.who, Change::Continued));
            }
            // The first world leads the group. As long as it is not reaped, nobody else is given the group's number.
            if child.alive || Some(child.pid) != self.group {
                let _ = waitid(WaitId::Pid(child.pid), kinds | WaitIdOptions::NOHANG);
            }
        }
        changes
    }

    fn changes_of_fosters(&mut self) -> Vec<(Who, Change)> {
        let mut changes = Vec::new();
        for index in self.alive.values().copied().collect::<Vec<_>>() {
            let child = &mut self.all[index];
            let Some(foster) = &mut child.foster else { continue };
            if let Some(change) = foster.change(child.pid) {
                changes.push((child.who, change));
                if let Change::Ended(_) = change {
                    child.alive = false;
                    self.alive.remove(&child.pid.as_raw_pid());
                }
            }
        }
        changes
    }

    /// Whether some agents are not shoal's own.
    pub fn has_guests(&self) -> bool {
        !self.executables.is_empty()
    }

    /// The robot instances whose processes live.
    pub fn instances(&self) -> Vec<RobotInstance> {
        let of = |index: &usize| match self.all[*index].who {
            Who::World => None,
            Who::Agent(instance) => Some(instance),
        };
        self.alive.values().filter_map(of).collect()
    }

    /// Whether any process is left.
    pub fn any(&self) -> bool {
        !self.alive.is_empty()
    }

    /// Process of the world.
    pub fn world_pid(&self) -> Option<u32> {
        self.all.iter().rfind(|child| child.who == Who::World).map(|child| child.pid.as_raw_pid() as u32)
    }

    /// Processes that live; the world's is the first.
    pub fn pids(&self) -> Vec<u32> {
        self.all.iter().filter(|child| child.alive).map(|child| child.pid.as_raw_pid() as u32).collect()
    }

    /// Sends a signal to a process that has not been reaped, and to the agent that it may be a wrapper of.
    pub fn signal(&self, pid: u32, signal: Signal) {
        if let Some(index) = self.alive.get(&(pid as i32)) {
            self.all[*index].signal(signal);
        }
    }

    /// Ends every process of the fleet, and waits until each is gone, or `DYING` has passed: those that are not.
    pub fn kill_all(&mut self) -> Vec<u32> {
        let until_ns = bus::clock::now_ns() + DYING.as_nanos() as u64;
        let mut alive = Vec::new();
        if let Some(group) = self.group.take() {
            let _ = kill_process_group(group, Signal::KILL);
            if !reap_until(group, until_ns) {
                alive.push(group.as_raw_pid() as u32);
            }
            if let Some(index) = self.alive.remove(&group.as_raw_pid()) {
                self.all[index].alive = false;
            }
        }
        for index in std::mem::take(&mut self.alive).into_values() {
            let child = &mut self.all[index];
            child.signal(Signal::KILL);
            let gone = match &child.foster {
                Some(foster) => foster.ends_until(until_ns),
                None => reap_until(child.pid, until_ns),
            };
            if !gone {
                alive.push(child.pid.as_raw_pid() as u32);
            }
            child.alive = false;
        }
        alive
    }

    /// The first tick has begun: from here on waiting for a processor counts. Does something the first time only;
    /// whether this was it.
    pub fn begin_measuring(&mut self) -> bool {
        let first = !std::mem::replace(&mut self.measuring, true);
        for child in self.all.iter_mut().filter(|child| first && child.alive) {
            child.before = measure(child.itself(), false);
        }
        first
    }

    /// Measures every process that lives.
    pub fn measure_all(&mut self) {
        for child in self.all.iter_mut().filter(|child| child.alive) {
            child.measured = measure(child.itself(), true);
        }
    }

    /// What every process used.
    pub fn take_measured(&mut self) -> Vec<(Option<RobotInstance>, u32, Measured)> {
        let entry = |child: &Child| {
            let instance = match child.who {
                Who::Agent(instance) => Some(instance),
                Who::World => None,
            };
            let waited_s = child.measured.run_queue_wait_s - child.before.run_queue_wait_s;
            let measured = Measured { run_queue_wait_s: waited_s.max(0.0), ..child.measured };
            (instance, child.itself().as_raw_pid() as u32, measured)
        };
        self.all.iter().map(entry).collect()
    }

    /// Removes what a process that has ended has printed.
    pub fn bury(&self, instance: RobotInstance) {
        self.logs.remove(&robot_agent::shell::spec_file(instance));
    }

    /// What the processes printed since the last call, line by line; and keeps their logs small.
    pub fn talk(&mut self, now: Duration) -> Vec<Spoken> {
        let mut lines = std::mem::take(&mut self.said);
        lines.extend(self.logs.look(now));
        lines
    }

    /// A process has been reaped: what it said last, in one line. What else it printed comes with [`Children::talk`].
    pub fn last_words(&mut self, who: Who, now: Duration) -> Option<String> {
        let name = log_of(who);
        self.said.extend(self.logs.close(&name, now));
        self.logs.last_words(&name)
    }

    /// What a process has said last by now, in one line.
    pub fn words_so_far(&self, who: Who) -> Option<String> {
        self.logs.last_words(&log_of(who))
    }

    /// Learns from the gate which processes are the agents, where those that were started are wrappers around them.
    pub fn adopt(&mut self, gate: &Gate) {
        for index in self.alive.values() {
            let child = &mut self.all[*index];
            let Who::Agent(instance) = child.who else { continue };
            if child.wrapped.is_some() {
                continue;
            }
            let started = child.pid.as_raw_pid() as u32;
            let Some(pid) = gate.process(instance).filter(|pid| *pid != started) else { continue };
            // What a file of the run says may be wrong: only what this child has started is its agent.
            if let Some(since) = bus::process::start_of(pid).filter(|_| bus::process::descends_from(pid, started)) {
                child.wrapped = pid_of(pid).map(|pid| (pid, since));
            }
        }
    }

    /// The agent's own process, for the one that was started.
    pub fn agent_pid(&self, started: u32) -> u32 {
        let child = self.alive.get(&(started as i32)).map(|index| &self.all[*index]);
        child.map_or(started, |child| child.itself().as_raw_pid() as u32)
    }
}

impl Child {
    /// The process that does the work: the agent behind a wrapper, or what was started.
    fn itself(&self) -> Pid {
        self.wrapped.map_or(self.pid, |(pid, _)| pid)
    }

    /// Signals the agent, then what was started: a wrapper that goes first would leave it alone.
    fn signal(&self, signal: Signal) {
        if let Some((pid, since)) = self.wrapped
            && bus::process::start_of(pid.as_raw_pid() as u32) == Some(since)
        {
            let _ = kill_process(pid, signal);
        }
        // It may have ended this moment: then there is nothing to signal.
        let _ = match &self.foster {
            Some(foster) => pidfd_send_signal(&foster.process, signal),
            None => kill_process(self.pid, signal),
        };
    }
}

impl Foster {
    /// Watches a process that was started at this time (ticks of the kernel); `None` if it has ended since.
    fn of(pid: u32, since: u64) -> Option<Foster> {
        let process = pidfd_open(pid_of(pid)?, PidfdFlags::empty()).ok()?;
        // In this order: the number may have been given to another process before.
        (bus::process::start_of(pid) == Some(since)).then_some(Foster { process, halted: false })
    }

    /// What happened to it since the last look. How it ended is told to its parent alone.
    fn change(&mut self, pid: Pid) -> Option<Change> {
        if self.ends_until(0) {
            return Some(Change::Ended(Ending { signal: None, code: None }));
        }
        let halted = state_of(pid.as_raw_pid() as u32) == ProcessState::Stopped;
        let changed = std::mem::replace(&mut self.halted, halted) != halted;
        changed.then_some(if halted { Change::Stopped } else { Change::Continued })
    }

    /// Waits for its end until this time (monotonic clock, ns); whether it has ended.
    fn ends_until(&self, until_ns: u64) -> bool {
        let left_ns = until_ns.saturating_sub(bus::clock::now_ns());
        let limit = Timespec { tv_sec: (left_ns / 1_000_000_000) as i64, tv_nsec: (left_ns % 1_000_000_000) as i64 };
        matches!(poll(&mut [PollFd::new(&self.process, PollFlags::IN)], Some(&limit)), Ok(1..))
    }
}

/// Name of the log of a process.
fn log_of(who: Who) -> String {
    match who {
        Who::World => "world".to_owned(),
        Who::Agent(instance) => robot_agent::shell::spec_file(instance),
    }
}

/// Waits until a killed child of this process is gone, and no longer than that; whether it is.
pub(crate) fn reap_until(pid: Pid, until_ns: u64) -> bool {
    loop {
        // None of its children any more: somebody else has waited for it.
        if !matches!(waitid(WaitId::Pid(pid), WaitIdOptions::EXITED | WaitIdOptions::NOHANG), Ok(None)) {
            return true;
        }
        let now_ns = bus::clock::now_ns();
        if now_ns > until_ns {
            return false;
        }
        bus::clock::sleep_until_ns(now_ns + 200_000);
    }
}

fn ending_of(status: &WaitIdStatus) -> Option<Ending> {
    if status.exited() {
        Some(Ending { signal: None, code: status.exit_status() })
    } else if status.killed() || status.dumped() {
        Some(Ending { signal: status.terminating_signal(), code: None })
    } else {
        None
    }
}

/// shoal itself, whatever has become of its file since it was started.
pub fn shoal(verb: &str) -> Command {
    #[expect(clippy::disallowed_methods, reason = "the supervisor starts the processes of the fleet")]
    let mut command = Command::new("/proc/self/exe");
    command.arg0("shoal").arg(verb);
    command
}

fn measure(pid: Pid, memory: bool) -> Measured {
    let stat = bus::clock::schedstat_of(pid.as_raw_pid() as u32).unwrap_or_default();
    Measured {
        cpu_s: stat.ran_ns as f64 * 1e-9,
        run_queue_wait_s: stat.waited_ns as f64 * 1e-9,
        pss_kib: memory.then(|| pss_kib(pid)).flatten(),
    }
}

/// The proportional share of memory of a process, KiB.
fn pss_kib(pid: Pid) -> Option<u64> {
    #[expect(clippy::disallowed_methods, reason = "the kernel's own account of a process")]
    let text = std::fs::read_to_string(format!("/proc/{}/smaps_rollup", pid.as_raw_pid())).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("Pss:"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// Children must not inherit the fleet's files: iceoryx2 opens them without close-on-exec.
fn close_on_exec() {
    let Ok(entries) = std::fs::read_dir("/proc/self/fd") else { return };
    let numbers: Vec<i32> =
        entries.flatten().filter_map(|entry| entry.file_name().to_str()?.parse().ok()).filter(|fd| *fd > 2).collect();
    for number in numbers {
        // SAFETY: the number is used for this one call only. A descriptor that was closed meanwhile (the listing's own)
        // makes the call fail with EBADF, which is as good.
        let fd = unsafe { std::os::fd::BorrowedFd::borrow_raw(number) };
        let _ = rustix::io::fcntl_setfd(fd, rustix::io::FdFlags::CLOEXEC);
    }
}

/// Whose process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Who {
    /// The world's.
    World,
    /// The agent of this instance.
    Agent(RobotInstance),
}

/// What happened to a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// It ended, and has been reaped.
    Ended(Ending),
    /// It was stopped.
    Stopped,
    /// It goes on.
    Continued,
}

/// The monotonic clock.
pub(crate) fn now() -> Duration {
    Duration::from_nanos(bus::clock::now_ns())
}

/// A process id as rustix wants it.
pub(crate) fn pid_of(pid: u32) -> Option<Pid> {
    Pid::from_raw(pid as i32)
}
