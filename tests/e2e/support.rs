//! What the tests share: a fleet as a child process, its processes found in `/proc`, deadlines, private `/dev/shm`.

use crate::places::Permit;
use bus::{Address, Gate};
use model::RobotIndex;
use rustix::process::{Pid, Signal, geteuid, kill_process};
use serde_json::Value;
use shoal_tests::process::with_signals;
use std::ffi::OsStr;
use std::fs::{File, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// The executable under test.
pub(crate) const SHOAL: &str = env!("CARGO_BIN_EXE_shoal");
/// No condition takes longer, however loaded the machine is. A test that fails waits for this long.
const DEADLINE: Duration = Duration::from_secs(60);
/// How long processes and shared memory may outlive their fleet.
const CLEAN_DEADLINE: Duration = Duration::from_secs(10);

/// Looks again and again until there is something.
pub(crate) fn wait_for<T>(what: &str, look: impl FnMut() -> Option<T>) -> T {
    wait_within(DEADLINE, look).unwrap_or_else(|| panic!("{what}: not within {} s", DEADLINE.as_secs()))
}

fn wait_within<T>(deadline: Duration, mut look: impl FnMut() -> Option<T>) -> Option<T> {
    let since = Instant::now();
    loop {
        if let Some(found) = look() {
            return Some(found);
        }
        if since.elapsed() > deadline {
            return None;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

// ---- a fleet

/// How to start a fleet.
pub(crate) struct Run {
    command: Command,
    dir: TempDir,
    fleets: usize,
    ignored: Option<Signal>,
    stdout: Option<Stdio>,
    stderr: Option<Stdio>,
}

impl Run {
    /// A scenario of the catalog.
    pub(crate) fn catalog(name: &str) -> Run {
        let mut run = Run::bare(Command::new(SHOAL));
        run.command.arg(name);
        run
    }

    /// A scenario of one's own.
    pub(crate) fn scenario(text: &str) -> Run {
        Run::scenario_by(Command::new(SHOAL), text)
    }

    /// The same, started by a command that ends in `shoal`.
    pub(crate) fn scenario_by(command: Command, text: &str) -> Run {
        let mut run = Run::bare(command);
        let path = run.dir.path().join("scenario.toml");
        std::fs::write(&path, text).unwrap();
        run.command.arg(path);
        run
    }

    fn bare(mut command: Command) -> Run {
        command.args(["run", "--format", "json"]);
        Run {
            command,
            dir: TempDir::with_prefix("shoal-e2e-").unwrap(),
            fleets: 1,
            ignored: None,
            stdout: None,
            stderr: None,
        }
    }

    pub(crate) fn mode(self, mode: &str) -> Run {
        self.arg("--mode").arg(mode)
    }

    pub(crate) fn set(self, setting: &str) -> Run {
        self.arg("--set").arg(setting)
    }

    pub(crate) fn arg(mut self, arg: impl AsRef<OsStr>) -> Run {
        self.command.arg(arg);
        self
    }

    pub(crate) fn env(mut self, key: &str, value: &str) -> Run {
        self.command.env(key, value);
        self
    }

    /// It is started as `nohup` and shells start processes: with a signal ignored.
    pub(crate) fn ignoring(mut self, signal: Signal) -> Run {
        self.ignored = Some(signal);
        self
    }

    /// Where its data goes; it is not kept then.
    pub(crate) fn stdout(mut self, to: impl Into<Stdio>) -> Run {
        self.stdout = Some(to.into());
        self
    }

    /// Where its talk goes; it is not kept then.
    pub(crate) fn stderr(mut self, to: impl Into<Stdio>) -> Run {
        self.stderr = Some(to.into());
        self
    }

    /// This run counts for so many: for tests that hold several fleets at once, which take all places with the first.
    pub(crate) fn places(mut self, fleets: usize) -> Run {
        self.fleets = fleets;
        self
    }

    /// Starts it, as soon as there is a place.
    pub(crate) fn start(mut self) -> Fleet {
        let permit = Permit::take(self.fleets);
        let (out, err) = (self.dir.path().join("stdout"), self.dir.path().join("stderr"));
        self.command.stdin(Stdio::null());
        let (kept_out, kept_err) = (File::create(&out).unwrap(), File::create(&err).unwrap());
        self.command.stdout(self.stdout.take().unwrap_or(kept_out.into()));
        self.command.stderr(self.stderr.take().unwrap_or(kept_err.into()));
        with_signals(&mut self.command, self.ignored);
        let words = std::iter::once(self.command.get_program()).chain(self.command.get_args());
        let shown = words.map(OsStr::to_string_lossy).collect::<Vec<_>>().join(" ");
        let daemon = self.command.spawn().unwrap_or_else(|error| panic!("`{shown}`: {error}"));
        Fleet { daemon, shown, out, err, root: None, status: None, _dir: self.dir, _permit: permit }
    }

    /// Runs it to its end.
    pub(crate) fn finish(self) -> Ended {
        self.start().wait()
    }
}

/// A fleet that was started. It is killed when it is dropped, and shows what it said if the test failed.
pub(crate) struct Fleet {
    daemon: Child,
    shown: String,
    out: PathBuf,
    err: PathBuf,
    root: Option<PathBuf>,
    status: Option<ExitStatus>,
    _dir: TempDir,
    _permit: Permit,
}

impl Fleet {
    /// The process of the daemon.
    pub(crate) fn daemon(&self) -> u32 {
        self.daemon.id()
    }

    /// The directory of the run: its processes, which are children of the daemon, name it on their command lines.
    pub(crate) fn root(&mut self) -> PathBuf {
        if self.root.is_none() {
            let daemon = self.daemon.id();
            let (status, child) = (&mut self.status, &mut self.daemon);
            let found = wait_for("the root of the run", || {
                let mine = processes().into_iter().find(|process| process.parent == daemon && process.root().is_some());
                *status = status.or_else(|| child.try_wait().unwrap());
                assert!(mine.is_some() || status.is_none(), "the run ended before it was seen");
                mine?.root()
            });
            self.root = Some(found);
        }
        self.root.clone().unwrap()
    }

    /// The random part of the fleet's name.
    pub(crate) fn id(&mut self) -> String {
        let root = self.root();
        root.file_name().unwrap().to_str().unwrap().rsplit('-').next().unwrap().to_owned()
    }

    pub(crate) fn address(&mut self) -> Address {
        let root = self.root();
        wait_for("the address of the run", || Address::at(&root).ok())
    }

    /// All processes of the run but the daemon.
    pub(crate) fn processes(&mut self) -> Vec<Process> {
        let root = self.root();
        processes_of(&root)
    }

    /// The processes of the robots.
    pub(crate) fn agents(&mut self) -> Vec<Process> {
        self.processes().into_iter().filter(|process| process.slot().is_some()).collect()
    }

    /// The process of the robot in this slot.
    pub(crate) fn agent(&mut self, slot: u32) -> u32 {
        let root = self.root();
        wait_for("the process of a robot", || {
            processes_of(&root).into_iter().find(|process| process.slot() == Some(slot)).map(|process| process.pid)
        })
    }

    /// The process `shoal world` or `shoal guardian`.
    pub(crate) fn process(&mut self, verb: &str) -> u32 {
        let root = self.root();
        wait_for(verb, || processes_of(&root).into_iter().find(|process| process.verb() == verb)).pid
    }

    /// The newest tick.
    pub(crate) fn tick(&mut self) -> u64 {
        self.gate().progress().tick
    }

    pub(crate) fn gate(&mut self) -> Gate {
        let address = self.address();
        wait_for("the gate of the run", || Gate::open(&address).ok())
    }

    /// Waits until so many ticks have been run.
    pub(crate) fn wait_tick(&mut self, tick: u64) {
        let gate = self.gate();
        wait_for("the ticks to pass", || (gate.progress().tick >= tick).then_some(()));
    }

    /// Waits until a life of a robot is in the fleet.
    pub(crate) fn wait_ready(&mut self, slot: u32, incarnation: u32) {
        let (gate, instance) = (self.gate(), model::RobotInstance { index: RobotIndex(slot), incarnation });
        wait_for("the robot to be ready", || gate.is_ready(instance).then_some(()));
    }

    /// What the run has said so far.
    pub(crate) fn stderr(&self) -> String {
        String::from_utf8_lossy(&std::fs::read(&self.err).unwrap()).into_owned()
    }

    /// Waits until the run has said this.
    pub(crate) fn wait_said(&self, words: &str) {
        wait_for(&format!("the words `{words}`"), || self.stderr().contains(words).then_some(()));
    }

    /// Whether the daemon has ended.
    pub(crate) fn has_ended(&mut self) -> bool {
        self.status = self.status.or_else(|| self.daemon.try_wait().unwrap());
        self.status.is_some()
    }

    /// Waits for the end.
    pub(crate) fn wait(mut self) -> Ended {
        wait_for("the end of the run", || self.has_ended().then_some(()));
        let status = self.status.expect("it has ended");
        let stdout = String::from_utf8_lossy(&std::fs::read(&self.out).unwrap()).into_owned();
        Ended {
            code: status.code(),
            signal: status.signal(),
            report: serde_json::from_str(&stdout).unwrap_or(Value::Null),
            stderr: self.stderr(),
            stdout,
        }
    }

    fn show(&self) {
        eprintln!(
            "---- {}\n{}",
            self.shown,
            self.status.map_or_else(|| "still runs".to_owned(), |end| end.to_string())
        );
        for (name, path) in [("stdout", &self.out), ("stderr", &self.err)] {
            eprintln!("---- {name}\n{}", String::from_utf8_lossy(&std::fs::read(path).unwrap_or_default()));
        }
        for entry in self.root.iter().flat_map(std::fs::read_dir).flatten().flatten() {
            if entry.path().extension() == Some(OsStr::new("log")) {
                let text = std::fs::read(entry.path()).unwrap_or_default();
                eprintln!("---- {}\n{}", entry.path().display(), String::from_utf8_lossy(&text));
            }
        }
    }
}

impl Drop for Fleet {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.show();
        }
        if !self.has_ended() {
            // The guardian does the rest.
            let _ = self.daemon.kill();
            let _ = self.daemon.wait();
        }
    }
}

/// How a run ended.
pub(crate) struct Ended {
    pub(crate) code: Option<i32>,
    pub(crate) signal: Option<i32>,
    /// The report on standard output, or null.
    pub(crate) report: Value,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Ended {
    /// Asserts how it ended.
    #[track_caller]
    pub(crate) fn expect(self, code: i32) -> Ended {
        assert_eq!((self.code, self.signal), (Some(code), None), "exit code\n{self}");
        self
    }

    /// Asserts that it failed with all of these words, and a way out.
    #[track_caller]
    pub(crate) fn expect_failure(self, code: i32, words: &[&str]) -> Ended {
        let ended = self.expect(code);
        for word in words.iter().chain(&["error: ", "hint: "]) {
            assert!(ended.stderr.contains(word), "`{word}` is missing\n{ended}");
        }
        ended
    }

    pub(crate) fn hash(&self) -> &str {
        self.report["trajectory_hash"].as_str().unwrap_or_else(|| panic!("no report\n{self}"))
    }

    /// What the report says of a robot.
    pub(crate) fn robot(&self, id: &str) -> &Value {
        let robots = self.report["per_robot"].as_array().into_iter().flatten();
        robots.into_iter().find(|robot| robot["id"] == id).unwrap_or_else(|| panic!("no robot `{id}`\n{self}"))
    }

    pub(crate) fn arrived(&self, id: &str) -> bool {
        self.robot(id)["arrived"] == true
    }

    /// The first event of this kind about this robot.
    pub(crate) fn event(&self, kind: &str, robot: &str) -> &Value {
        let events = self.report["events"].as_array().into_iter().flatten();
        let mut found = events.into_iter().filter(|event| event["kind"] == kind && event["robot"] == robot);
        found.next().unwrap_or_else(|| panic!("no event `{kind}` of `{robot}`\n{self}"))
    }
}

impl std::fmt::Display for Ended {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Ended { code, signal, stdout, stderr, .. } = self;
        write!(f, "---- code {code:?}, signal {signal:?}\n---- stdout\n{stdout}\n---- stderr\n{stderr}")
    }
}

/// Runs a short command to its end.
pub(crate) fn run(mut command: Command) -> Ended {
    let dir = TempDir::with_prefix("shoal-e2e-").unwrap();
    let (out, err) = (dir.path().join("stdout"), dir.path().join("stderr"));
    command.stdin(Stdio::null()).stdout(File::create(&out).unwrap()).stderr(File::create(&err).unwrap());
    let mut child = command.spawn().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let status = wait_within(DEADLINE, || child.try_wait().unwrap()).unwrap_or_else(|| {
        let _ = child.kill();
        panic!("{command:?}: not within {} s", DEADLINE.as_secs())
    });
    let read = |path: &Path| String::from_utf8_lossy(&std::fs::read(path).unwrap()).into_owned();
    let (stdout, stderr) = (read(&out), read(&err));
    let report = serde_json::from_str(&stdout).unwrap_or(Value::Null);
    Ended { code: status.code(), signal: status.signal(), report, stdout, stderr }
}

/// Runs a verb.
pub(crate) fn shoal(args: &[&str]) -> Ended {
    let mut command = Command::new(SHOAL);
    command.args(args);
    run(command)
}

/// Other executables that were built with shoal.
pub(crate) fn example(name: &str) -> PathBuf {
    Path::new(SHOAL).parent().unwrap().join("examples").join(name)
}

/// A script that can be named as an agent.
pub(crate) fn script(dir: &Path, name: &str, text: &str) -> PathBuf {
    let path = dir.join(name);
    std::fs::write(&path, text).unwrap();
    std::fs::set_permissions(&path, Permissions::from_mode(0o755)).unwrap();
    path
}

/// Robots `a`, `b`, ... on lanes side by side, too far apart to feel each other.
pub(crate) fn lanes(robots: usize, length_m: f64) -> String {
    let lane = |(index, id): (usize, char)| {
        let y_m = 2 * index;
        format!("[[robot]]\nid = \"{id}\"\nstart_m = [0, {y_m}]\ngoal_m = [{length_m}, {y_m}]\n")
    };
    let lanes: String = ('a'..='z').take(robots).enumerate().map(lane).collect();
    let (x_max, y_max) = (length_m + 1.0, 2 * robots);
    format!("[world]\nx_m = [-1, {x_max}]\ny_m = [-1, {y_max}]\n[defaults]\nplanner = \"straight\"\n{lanes}")
}

// ---- processes

/// A process, as `/proc` has it.
#[derive(Clone, Debug)]
pub(crate) struct Process {
    pub(crate) pid: u32,
    pub(crate) parent: u32,
    line: Vec<String>,
}

impl Process {
    /// The verb of a shoal process.
    pub(crate) fn verb(&self) -> &str {
        self.line.get(1).map_or("", String::as_str)
    }

    /// The slot of an agent, whatever its executable is.
    pub(crate) fn slot(&self) -> Option<u32> {
        self.value("--slot")?.parse().ok()
    }

    pub(crate) fn incarnation(&self) -> Option<u32> {
        self.value("--incarnation")?.parse().ok()
    }

    fn root(&self) -> Option<PathBuf> {
        self.value("--root").map(PathBuf::from)
    }

    fn value(&self, key: &str) -> Option<&str> {
        let index = self.line.iter().position(|word| word == key)?;
        self.line.get(index + 1).map(String::as_str)
    }
}

/// All processes that have a command line.
fn processes() -> Vec<Process> {
    let pids = std::fs::read_dir("/proc").unwrap().flatten().filter_map(|e| e.file_name().to_str()?.parse().ok());
    pids.filter_map(process).collect()
}

/// One process, if there is such.
pub(crate) fn process_of(pid: u32) -> Option<Process> {
    process(pid)
}

fn process(pid: u32) -> Option<Process> {
    let line = std::fs::read(format!("/proc/{pid}/cmdline")).ok().filter(|line| !line.is_empty())?;
    let (parent, _) = stat(pid)?;
    let words = line.strip_suffix(b"\0").unwrap_or(&line).split(|byte| *byte == 0);
    Some(Process { pid, parent, line: words.map(|word| String::from_utf8_lossy(word).into_owned()).collect() })
}

fn stat(pid: u32) -> Option<(u32, char)> {
    let text = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    let mut words = text.rsplit_once(')')?.1.split_ascii_whitespace();
    let state = words.next()?.chars().next()?;
    Some((words.next()?.parse().ok()?, state))
}

/// The processes that name this root.
pub(crate) fn processes_of(root: &Path) -> Vec<Process> {
    let root = root.to_str().unwrap();
    processes().into_iter().filter(|process| process.line.iter().any(|word| word.contains(root))).collect()
}

/// Whether a process is stopped.
pub(crate) fn is_stopped(pid: u32) -> bool {
    stat(pid).is_some_and(|(_, state)| state == 'T')
}

/// Whether a process has ended.
pub(crate) fn is_gone(pid: u32) -> bool {
    stat(pid).is_none_or(|(_, state)| state == 'Z')
}

/// Sends a signal.
pub(crate) fn signal(pid: u32, signal: Signal) {
    let number = Pid::from_raw(i32::try_from(pid).unwrap()).unwrap();
    kill_process(number, signal).unwrap_or_else(|error| panic!("signal {signal:?} to {pid}: {error}"));
}

/// Stops a process, and waits until it is stopped.
pub(crate) fn stop(pid: u32) {
    signal(pid, Signal::STOP);
    wait_for("the process to stop", || is_stopped(pid).then_some(()));
}

// ---- what is left

/// Waits until nothing of a fleet is left: no process that names its root, nothing with its name in `/dev/shm`.
#[track_caller]
pub(crate) fn assert_clean(root: &Path) {
    assert_clean_in(Path::new("/dev/shm"), root);
}

#[track_caller]
pub(crate) fn assert_clean_in(shm: &Path, root: &Path) {
    let clean = || (processes_of(root).is_empty() && objects_in(shm, root).is_empty()).then_some(());
    if wait_within(CLEAN_DEADLINE, clean).is_none() {
        panic!("left behind: {:#?}\n{:#?}", processes_of(root), objects_in(shm, root));
    }
}

/// What a fleet has in `/dev/shm`.
pub(crate) fn objects(root: &Path) -> Vec<String> {
    objects_in(Path::new("/dev/shm"), root)
}

pub(crate) fn objects_in(shm: &Path, root: &Path) -> Vec<String> {
    let name = root.file_name().unwrap().to_str().unwrap();
    let names = std::fs::read_dir(shm).unwrap().flatten().filter_map(|entry| entry.file_name().into_string().ok());
    names.filter(|found| found.starts_with(name)).collect()
}

// ---- a machine of one's own

/// A mount namespace whose `/dev/shm` nobody else sees.
pub(crate) struct PrivateShm {
    holder: Child,
}

impl PrivateShm {
    /// Mounts something on `/dev/shm`; `mount` is what follows the word. `None`, and a note, where that is not permitted.
    pub(crate) fn new(mount: &str) -> Option<PrivateShm> {
        if !geteuid().is_root() {
            eprintln!("skipped: a private /dev/shm needs root");
            return None;
        }
        let mut command = Command::new("unshare");
        command.args(["-m", "sh", "-c", &format!("mount {mount} /dev/shm && exec sleep 1000")]);
        let mut holder = command.stdin(Stdio::null()).spawn().ok()?;
        let ready = wait_within(DEADLINE, || {
            let line = std::fs::read(format!("/proc/{}/cmdline", holder.id())).unwrap_or_default();
            (line.starts_with(b"sleep") || holder.try_wait().unwrap().is_some()).then_some(())
        });
        if ready.is_none() || holder.try_wait().unwrap().is_some() {
            eprintln!("skipped: `unshare -m` and `mount {mount} /dev/shm` are not permitted");
            let _ = holder.kill();
            let _ = holder.wait();
            return None;
        }
        Some(PrivateShm { holder })
    }

    /// shoal in there.
    pub(crate) fn shoal(&self) -> Command {
        self.command(SHOAL)
    }

    /// A program in there.
    pub(crate) fn command(&self, program: &str) -> Command {
        let mut command = Command::new("nsenter");
        command.arg("-m").arg("-t").arg(self.holder.id().to_string()).arg("--").arg(program);
        command
    }

    /// Its `/dev/shm`, as seen from here.
    pub(crate) fn path(&self) -> PathBuf {
        PathBuf::from(format!("/proc/{}/root/dev/shm", self.holder.id()))
    }
}

impl Drop for PrivateShm {
    fn drop(&mut self) {
        let _ = self.holder.kill();
        let _ = self.holder.wait();
    }
}
