//! shoal as a real process that ends with the test, whatever happens to the test.
#![expect(clippy::disallowed_methods, reason = "tests start processes, wait for them, and read what they wrote")]

use rustix::process::{Pid, Signal, kill_process};
use std::ffi::OsStr;
use std::io::Read;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Nothing that a test starts takes longer, whatever else the machine does.
pub const DEADLINE: Duration = Duration::from_secs(120);
const LOOK_EVERY: Duration = Duration::from_millis(2);
/// How long a process has to clear up after itself before it is killed.
const GRACE: Duration = Duration::from_secs(5);

/// A process to be.
#[derive(Debug)]
pub struct Run {
    command: Command,
    shown: String,
}

impl Run {
    /// An executable, with nothing to read and no terminal.
    pub fn new(program: impl AsRef<OsStr>) -> Run {
        let shown = program.as_ref().to_string_lossy().into_owned();
        let mut command = Command::new(program);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // What is printed must not depend on who runs the tests.
        command.env("COLUMNS", "80").env_remove("NO_COLOR").env_remove("SHOAL_LOG").env_remove("CLICOLOR_FORCE");
        Run { command, shown }
    }

    /// With these arguments.
    pub fn args<A: AsRef<OsStr>>(mut self, args: impl IntoIterator<Item = A>) -> Run {
        for arg in args {
            self.shown = format!("{} {}", self.shown, arg.as_ref().to_string_lossy());
            self.command.arg(arg);
        }
        self
    }

    /// With words that are separated by single spaces.
    pub fn words(self, line: &str) -> Run {
        self.args(line.split(' ').filter(|word| !word.is_empty()))
    }

    /// In this directory.
    pub fn within(mut self, directory: &Path) -> Run {
        self.command.current_dir(directory);
        self
    }

    /// With this in its environment.
    pub fn env(mut self, key: &str, value: &str) -> Run {
        self.command.env(key, value);
        self
    }

    /// Its standard output goes there, and is not kept.
    pub fn stdout(mut self, to: impl Into<Stdio>) -> Run {
        self.command.stdout(to);
        self
    }

    /// Its standard input comes from there.
    pub fn stdin(mut self, from: impl Into<Stdio>) -> Run {
        self.command.stdin(from);
        self
    }

    /// Starts it.
    ///
    /// # Panics
    /// When it cannot be started.
    pub fn start(mut self) -> Running {
        with_signals(&mut self.command, None);
        let mut child = self.command.spawn().unwrap_or_else(|error| panic!("cannot start `{}`: {error}", self.shown));
        let (out, err) = (child.stdout.take().map(drain), child.stderr.take().map(drain));
        Running { child, out, err, shown: self.shown }
    }

    /// Starts it and waits for its end.
    ///
    /// # Panics
    /// When it cannot be started, or does not end.
    pub fn end(self) -> Ended {
        self.start().end()
    }
}

/// Has a process start with the signals that ask for the end as they are by default, but for one that is to be ignored. These
/// tests may run with some of them ignored, as a shell does in the background, and a process inherits that.
pub fn with_signals(command: &mut Command, ignored: Option<Signal>) {
    let dispositions = move || {
        for signal in [Signal::INT, Signal::TERM, Signal::HUP] {
            let to = if ignored == Some(signal) { libc::SIG_IGN } else { libc::SIG_DFL };
            // SAFETY: neither runs any code of ours; the number is that of a real signal.
            unsafe { libc::signal(signal.as_raw(), to) };
        }
        Ok(())
    };
    // SAFETY: between fork and exec it makes system calls only.
    unsafe { command.pre_exec(dispositions) };
}

fn drain(mut from: impl Read + Send + 'static) -> JoinHandle<Vec<u8>> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        // What could be read until the other end broke is what there is.
        let _ = from.read_to_end(&mut bytes);
        bytes
    })
}

/// A process. Dropped before its end, it is asked to go, and then made to.
#[derive(Debug)]
pub struct Running {
    child: Child,
    out: Option<JoinHandle<Vec<u8>>>,
    err: Option<JoinHandle<Vec<u8>>>,
    shown: String,
}

impl Running {
    /// Its number.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Whether it still runs.
    pub fn runs(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }

    /// Sends it a signal.
    pub fn signal(&self, signal: Signal) {
        if let Some(pid) = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw) {
            // It may have ended by itself.
            let _ = kill_process(pid, signal);
        }
    }

    /// Waits for its end.
    ///
    /// # Panics
    /// When that does not come.
    pub fn end(mut self) -> Ended {
        let started = Instant::now();
        while self.runs() {
            assert!(started.elapsed() < DEADLINE, "`{}` does not end", self.shown);
            std::thread::sleep(LOOK_EVERY);
        }
        let status = self.child.wait().expect("it has ended");
        let text = |end: Option<JoinHandle<Vec<u8>>>| {
            let bytes = end.map(|thread| thread.join().expect("reading does not panic")).unwrap_or_default();
            String::from_utf8(bytes).expect("what shoal prints is UTF-8")
        };
        let (stdout, stderr) = (text(self.out.take()), without_cleaning(&text(self.err.take())));
        Ended { code: status.code(), stdout, stderr, shown: std::mem::take(&mut self.shown) }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if !self.runs() {
            return;
        }
        self.signal(Signal::TERM);
        let asked = Instant::now();
        while self.runs() && asked.elapsed() < GRACE {
            std::thread::sleep(LOOK_EVERY);
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// What a process left behind. Its `Display` form is what a failing test should show.
#[derive(Clone, Debug)]
pub struct Ended {
    /// Its exit code; `None` if a signal ended it.
    pub code: Option<i32>,
    /// What it wrote to standard output.
    pub stdout: String,
    /// What it wrote to standard error, but for what it cleaned away of fleets that others have left.
    pub stderr: String,
    shown: String,
}

impl std::fmt::Display for Ended {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Ended { code, stdout, stderr, shown } = self;
        let stdout: String = stdout.chars().take(4000).collect();
        write!(f, "$ {shown}\nexit code: {code:?}\n-- stdout --\n{stdout}\n-- stderr --\n{stderr}")
    }
}

/// What was said, but for what was cleaned away first: another test, or whatever ran on this machine before, may have been
/// killed at any time, and the next shoal of all removes what it left.
fn without_cleaning(said: &str) -> String {
    let is_cleaning = |line: &&str| line.starts_with("removed what fleet ") && line.contains(" left behind: ");
    said.split_inclusive('\n').filter(|line| !is_cleaning(line)).collect()
}

/// The text of a file, if it can be read.
pub fn text_of(path: impl Into<PathBuf>) -> Option<String> {
    std::fs::read(path.into()).ok().map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
}

/// The process that started this one.
pub fn parent_of(pid: u32) -> Option<u32> {
    let status = text_of(format!("/proc/{pid}/status"))?;
    status.lines().find_map(|line| line.strip_prefix("PPid:"))?.trim().parse().ok()
}

/// Waits until something is there.
///
/// # Panics
/// When it does not come.
pub fn wait_for<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(started.elapsed() < DEADLINE, "{what} does not come");
        std::thread::sleep(LOOK_EVERY);
    }
}

/// Fleets of one test executable that run at the same time: each is a handful of processes.
const FLEETS_MAX: usize = 2;
static FLEETS: (Mutex<usize>, Condvar) = (Mutex::new(0), Condvar::new());

/// A place for a fleet, until it is dropped.
#[derive(Debug)]
pub struct Place(());

impl Place {
    /// Waits for a free one.
    pub fn take() -> Place {
        let (taken, freed) = &FLEETS;
        // A test that failed with a place has given it back: the number is right.
        let held = taken.lock().unwrap_or_else(PoisonError::into_inner);
        let mut held = freed.wait_while(held, |held| *held >= FLEETS_MAX).unwrap_or_else(PoisonError::into_inner);
        *held += 1;
        Place(())
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let (taken, freed) = &FLEETS;
        *taken.lock().unwrap_or_else(PoisonError::into_inner) -= 1;
        freed.notify_one();
    }
}
