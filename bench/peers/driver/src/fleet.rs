//! One run: N processes of one peer, from the first start to the last trace.

use crate::peers::{Beside, Peer, Tools};
use crate::process;
use poses::clock::{now_ns, sleep_until_ns};
use poses::link::SOCKET;
use poses::samples::Samples;
use poses::{PERIOD_NS, WARM_UP_TICKS};
use rustix::process::{Pid, Signal, kill_process, set_parent_process_death_signal};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// How long everybody may take to hear everybody, ns.
const CONNECT_NS: u64 = 60_000_000_000;
/// How long a loop may take beyond its time, and a report to come, ns.
const LATE_NS: u64 = 30_000_000_000;
/// How long processes may take to go by themselves, ns.
const GO_NS: u64 = 10_000_000_000;
/// From the order to start to the start, ns.
const NOTICE_NS: u64 = 300_000_000;
/// Longest wait without a look at signals and processes.
const PATIENCE: Duration = Duration::from_millis(100);

/// What a run measured.
#[derive(Clone, Debug)]
pub(crate) struct Measured {
    /// Of all robots together.
    pub(crate) samples: Samples,
    /// Processor time per robot, what runs beside included, percent of one core.
    pub(crate) cpu_percent: f64,
    /// The part of it of what runs beside.
    pub(crate) cpu_beside_percent: f64,
    /// Memory per robot, what runs beside included, MiB.
    pub(crate) pss_mib: f64,
    /// The part of it of what runs beside.
    pub(crate) pss_beside_mib: f64,
    /// From the start of the first process until the last one ran, ms.
    pub(crate) started_ms: f64,
    /// From the start of the first process until everybody had heard everybody, ms.
    pub(crate) connected_ms: f64,
}

/// Why there is nothing measured.
#[derive(Debug)]
pub(crate) enum Stop {
    /// Somebody wants it to end.
    Interrupted,
    /// This peer does not work like this.
    Failed(String),
}

impl<E: std::error::Error> From<E> for Stop {
    fn from(error: E) -> Stop {
        Stop::Failed(error.to_string())
    }
}

/// Runs a peer once.
pub(crate) fn run(
    peer: &Peer,
    tools: &Tools,
    robots: usize,
    ticks: u64,
    number: u32,
    interrupted: &AtomicBool,
) -> Result<Measured, Stop> {
    let mut fleet = Fleet::start(peer, tools, robots, number, interrupted)?;
    let measured = fleet.measure(ticks);
    fleet.end(measured.is_ok());
    measured
}

enum Event {
    Hello { robot: usize, pid: u32, stream: UnixStream },
    Said { robot: usize, line: String },
    Closed,
}

/// A run's processes and everything else that must be gone after it.
struct Fleet<'a> {
    directory: PathBuf,
    listener: UnixListener,
    events: Receiver<Event>,
    interrupted: &'a AtomicBool,
    robots: usize,
    began_ns: u64,
    /// Robots, and whatever starts them.
    children: Vec<Child>,
    hub: Option<Child>,
    /// By robot.
    pids: BTreeMap<usize, u32>,
    streams: Vec<UnixStream>,
    objects: BTreeSet<PathBuf>,
    /// Robots have been told to report, and go when they have.
    reporting: bool,
    ended: bool,
}

impl<'a> Fleet<'a> {
    fn start(
        peer: &Peer,
        tools: &Tools,
        robots: usize,
        number: u32,
        interrupted: &'a AtomicBool,
    ) -> Result<Fleet<'a>, Stop> {
        let directory = process::make_directory(number)?;
        let listener = UnixListener::bind(directory.join(SOCKET))?;
        let (sender, events) = channel();
        let socket = listener.try_clone()?;
        std::thread::spawn(move || listen(&socket, &sender));
        let mut fleet = Fleet {
            directory,
            listener,
            events,
            interrupted,
            robots,
            began_ns: 0,
            children: Vec::new(),
            hub: None,
            pids: BTreeMap::new(),
            streams: Vec::new(),
            objects: BTreeSet::new(),
            reporting: false,
            ended: false,
        };
        peer.write_files(tools, robots, &fleet.directory)?;
        fleet.began_ns = now_ns();
        if let Some(command) = peer.beside_command(tools, &fleet.directory) {
            let child = fleet.spawn(command, "beside", peer.beside == Beside::Dora)?;
            if let Beside::Hub(file) = peer.beside {
                fleet.hub = Some(child);
                fleet.wait_for_file(file)?;
            } else {
                fleet.children.push(child);
            }
        }
        for robot in 0..robots {
            let Some(command) = peer.robot_command(tools, robot, robots, &fleet.directory) else { continue };
            let child = fleet.spawn(command, &robot.to_string(), true)?;
            fleet.children.push(child);
        }
        Ok(fleet)
    }

    /// Starts a process in a group of its own, so that Ctrl-C is the driver's business alone. It dies with the driver,
    /// or ends when its standard input does.
    fn spawn(&self, mut command: Command, log: &str, dies_with_us: bool) -> Result<Child, Stop> {
        let log = std::fs::File::create(self.directory.join(format!("log-{log}")))?;
        command.stdin(Stdio::piped()).stdout(log.try_clone()?).stderr(log).process_group(0);
        if dies_with_us {
            // SAFETY: between fork and exec this makes one system call and allocates nothing.
            unsafe { command.pre_exec(|| Ok(set_parent_process_death_signal(Some(Signal::KILL))?)) };
        }
        let name = command.get_program().to_string_lossy().into_owned();
        command.spawn().map_err(|e| Stop::Failed(format!("`{name}`: {e}")))
    }

    fn wait_for_file(&mut self, file: &str) -> Result<(), Stop> {
        while !self.directory.join(file).exists() {
            self.look()?;
            sleep_until_ns(now_ns() + 200_000);
        }
        Ok(())
    }

    fn measure(&mut self, ticks: u64) -> Result<Measured, Stop> {
        let (started_ns, connected_ns) = self.meet()?;
        let start_ns = now_ns() + NOTICE_NS;
        self.say(&format!("start {start_ns} {ticks}"))?;

        let beside = self.beside();
        let pids: Vec<u32> = self.pids.values().copied().collect();
        let cpu_ns = |pids: &[u32]| pids.iter().map(|pid| process::cpu_ns(*pid)).sum::<u64>() as f64;
        let window_ns = ticks * PERIOD_NS;
        let from_ns = start_ns + (WARM_UP_TICKS + 1) * PERIOD_NS;
        self.sleep_until(from_ns)?;
        let before = (cpu_ns(&pids), cpu_ns(&beside));
        self.sleep_until(from_ns + window_ns)?;
        let after = (cpu_ns(&pids), cpu_ns(&beside));
        self.collect("end of the loop", |line| line == "done")?;
        let pss_mib = |pids: &[u32]| pids.iter().filter_map(|pid| process::pss_kib(*pid)).sum::<u64>() as f64 / 1024.0;
        let pss = (pss_mib(&pids), pss_mib(&beside));
        self.remember_objects();

        self.reporting = true;
        self.say("report")?;
        let samples = self.reports()?;
        let robots = self.robots as f64;
        let percent = |before: f64, after: f64| 100.0 * (after - before) / window_ns as f64 / robots;
        let cpu_beside_percent = percent(before.1, after.1);
        Ok(Measured {
            samples,
            cpu_percent: percent(before.0, after.0) + cpu_beside_percent,
            cpu_beside_percent,
            pss_mib: (pss.0 + pss.1) / robots,
            pss_beside_mib: pss.1 / robots,
            started_ms: started_ns.saturating_sub(self.began_ns) as f64 * 1e-6,
            connected_ms: connected_ns.saturating_sub(self.began_ns) as f64 * 1e-6,
        })
    }

    /// Waits until everybody has heard everybody: when the last one ran, and when the last one had.
    fn meet(&mut self) -> Result<(u64, u64), Stop> {
        let until_ns = self.began_ns + CONNECT_NS;
        let mut started_ns = self.began_ns;
        let mut connected = BTreeMap::new();
        while connected.len() < self.robots {
            match self.next(until_ns)? {
                Some(Event::Hello { robot, pid, stream }) => {
                    started_ns = now_ns();
                    self.pids.insert(robot, pid);
                    self.streams.push(stream);
                }
                Some(Event::Said { robot, line }) => {
                    let time = line.strip_prefix("connected ").and_then(|time| time.parse::<u64>().ok());
                    connected.insert(robot, time.ok_or_else(|| Stop::Failed(format!("robot {robot} said `{line}`")))?);
                }
                Some(Event::Closed) => self.look()?,
                None => {
                    let (started, heard, all) = (self.pids.len(), connected.len(), self.robots);
                    return Err(Stop::Failed(format!(
                        "after {} s {started} of {all} robots ran, {heard} had heard everybody",
                        CONNECT_NS / 1_000_000_000
                    )));
                }
            }
        }
        Ok((started_ns, connected.into_values().max().unwrap_or_default()))
    }

    /// Waits until every robot has said a line like this.
    fn collect(&mut self, what: &str, mut is_it: impl FnMut(&str) -> bool) -> Result<(), Stop> {
        let until_ns = now_ns() + LATE_NS;
        let mut said = 0;
        while said < self.robots {
            match self.next(until_ns)? {
                Some(Event::Said { line, .. }) => said += usize::from(is_it(&line)),
                Some(Event::Closed) => self.look()?,
                Some(Event::Hello { .. }) => {}
                None => return Err(Stop::Failed(format!("{said} of {} robots came to the {what}", self.robots))),
            }
        }
        Ok(())
    }

    fn reports(&mut self) -> Result<Samples, Stop> {
        let mut samples = Samples::default();
        let mut strange = None;
        self.collect("end of the report", |line| {
            if line != "end" && samples.read_line(line).is_none() {
                strange.get_or_insert_with(|| line.to_owned());
            }
            line == "end"
        })?;
        strange.map_or(Ok(samples), |line| Err(Stop::Failed(format!("a robot reported `{line}`"))))
    }

    fn say(&mut self, line: &str) -> Result<(), Stop> {
        for stream in &mut self.streams {
            writeln!(stream, "{line}")?;
        }
        Ok(())
    }

    /// What runs beside the robots.
    fn beside(&self) -> Vec<u32> {
        let robots: BTreeSet<u32> = self.pids.values().copied().collect();
        let roots = self.children.iter().chain(&self.hub).map(Child::id);
        let all: BTreeSet<u32> = roots.flat_map(|pid| [vec![pid], process::descendants(pid)].concat()).collect();
        all.difference(&robots).copied().collect()
    }

    fn remember_objects(&mut self) {
        let beside = self.beside();
        for pid in self.pids.values().chain(&beside) {
            self.objects.extend(process::shared_objects(*pid));
        }
    }

    /// The next event; `None` when the time is over.
    fn next(&mut self, until_ns: u64) -> Result<Option<Event>, Stop> {
        loop {
            match self.events.recv_timeout(PATIENCE) {
                Ok(event) => return Ok(Some(event)),
                Err(RecvTimeoutError::Timeout) => self.look()?,
                Err(RecvTimeoutError::Disconnected) => return Err(Stop::Failed("the driver's socket closed".into())),
            }
            if now_ns() > until_ns {
                return Ok(None);
            }
        }
    }

    fn sleep_until(&mut self, until_ns: u64) -> Result<(), Stop> {
        while now_ns() < until_ns {
            self.look()?;
            sleep_until_ns(until_ns.min(now_ns() + PATIENCE.as_nanos() as u64));
        }
        Ok(())
    }

    /// Whether there was a signal, or a process has ended before its time.
    fn look(&mut self) -> Result<(), Stop> {
        if self.interrupted.load(Relaxed) {
            return Err(Stop::Interrupted);
        }
        if self.reporting {
            return Ok(());
        }
        for child in self.children.iter_mut().chain(&mut self.hub) {
            if let Some(status) = child.try_wait()? {
                let talk = last_words(&self.directory);
                return Err(Stop::Failed(format!("a process ended early ({status}){talk}")));
            }
        }
        Ok(())
    }

    /// Lets the processes go, or makes them, and removes every trace.
    fn end(&mut self, in_good_order: bool) {
        if std::mem::replace(&mut self.ended, true) {
            return;
        }
        if !in_good_order {
            self.remember_objects();
        }
        let _ = rustix::net::shutdown(&self.listener, rustix::net::Shutdown::Both);
        for stream in self.streams.drain(..) {
            let _ = stream.shutdown(std::net::Shutdown::Both);
        }
        let asked = if in_good_order { None } else { Some(Signal::INT) };
        for child in &self.children {
            if let (Some(signal), Some(pid)) = (asked, Pid::from_raw(child.id() as i32)) {
                let _ = kill_process(pid, signal);
            }
        }
        let until_ns = now_ns() + GO_NS;
        for child in &mut self.children {
            while now_ns() < until_ns && matches!(child.try_wait(), Ok(None)) {
                sleep_until_ns(now_ns() + 2_000_000);
            }
            let _ = child.kill();
            let _ = child.wait();
        }
        // dora's robots are not our children.
        for pid in self.pids.values().filter(|pid| process::belongs_to(**pid, &self.directory)) {
            if let Some(pid) = Pid::from_raw(*pid as i32) {
                let _ = kill_process(pid, Signal::KILL);
            }
        }
        if let Some(mut hub) = self.hub.take() {
            drop(hub.stdin.take());
            let _ = hub.wait();
        }
        for object in &self.objects {
            let _ = std::fs::remove_file(object);
        }
        process::remove_all(&self.directory.file_name().unwrap_or_default().to_string_lossy());
    }
}

impl Drop for Fleet<'_> {
    fn drop(&mut self) {
        self.end(false);
    }
}

fn listen(socket: &UnixListener, sender: &Sender<Event>) {
    for stream in socket.incoming() {
        let Ok(stream) = stream else { return };
        let sender = sender.clone();
        std::thread::spawn(move || hear(stream, &sender));
    }
}

/// Reads what one robot says until it goes. Nobody listens any more once the run has ended.
fn hear(stream: UnixStream, sender: &Sender<Event>) -> Option<()> {
    let mut lines = BufReader::new(stream.try_clone().ok()?).lines();
    let hello = lines.next()?.ok()?;
    let (robot, pid) = hello.strip_prefix("hello ")?.split_once(' ')?;
    let (robot, pid) = (robot.parse().ok()?, pid.parse().ok()?);
    sender.send(Event::Hello { robot, pid, stream }).ok()?;
    for line in lines {
        sender.send(Event::Said { robot, line: line.ok()? }).ok()?;
    }
    sender.send(Event::Closed).ok()
}

/// The last line of the log that speaks of an error, else of any.
fn last_words(directory: &Path) -> String {
    let logs = std::fs::read_dir(directory).into_iter().flatten().flatten();
    let logs = logs.filter(|entry| entry.file_name().to_string_lossy().starts_with("log-"));
    let texts: Vec<String> = logs.filter_map(|entry| std::fs::read_to_string(entry.path()).ok()).collect();
    let lines = || texts.iter().flat_map(|text| text.lines()).filter(|line| !line.trim().is_empty());
    let line = lines().find(|line| line.to_lowercase().contains("error")).or(lines().next_back());
    line.map_or_else(String::new, |line| format!(": {line}"))
}
