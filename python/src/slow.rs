//! Plans that take too long: which robot, how long, and at which line of the script it is.

use pyo3::prelude::*;
use std::io::Write;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How often it is looked whether a plan hangs.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// A plan that has run for this long is said to, wherever it is then.
const HANGS: Duration = Duration::from_millis(500);
/// Between two lines about plans that took too long.
const SAID_EVERY: Duration = Duration::from_secs(5);

/// When the present plan began, and how long plans may take.
#[derive(Debug)]
pub(crate) struct Stopwatch {
    started: Instant,
    /// When the present plan began, ns since `started`, plus one; 0: none is running.
    begun_ns: AtomicU64,
    /// In `realtime`, a period, ns; otherwise no plan is too long.
    period_ns: Option<u64>,
    robot: String,
    /// Where the planner is, for messages.
    place: String,
    said: Mutex<Said>,
    over: AtomicBool,
}

#[derive(Debug, Default)]
struct Said {
    at: Option<Instant>,
    since: u64,
}

impl Stopwatch {
    pub(crate) fn new(robot: &str, place: String, period_s: Option<f64>) -> Arc<Stopwatch> {
        Arc::new(Stopwatch {
            started: Instant::now(),
            begun_ns: AtomicU64::new(0),
            period_ns: period_s.map(|period_s| (period_s * 1e9) as u64),
            robot: robot.to_owned(),
            place,
            said: Mutex::default(),
            over: AtomicBool::new(false),
        })
    }

    fn now_ns(&self) -> u64 {
        self.started.elapsed().as_nanos() as u64
    }

    pub(crate) fn begin(&self) {
        self.begun_ns.store(self.now_ns() + 1, Relaxed);
    }

    pub(crate) fn end(&self) {
        let begun_ns = self.begun_ns.swap(0, Relaxed);
        let took_ns = (self.now_ns() + 1).saturating_sub(begun_ns);
        if let Some(period_ns) = self.period_ns.filter(|period_ns| took_ns > *period_ns) {
            self.took(took_ns, period_ns);
        }
    }

    /// Says that a plan took longer than a period, now and then.
    #[cold]
    fn took(&self, took_ns: u64, period_ns: u64) {
        let mut said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        said.since += 1;
        if said.at.is_some_and(|at| at.elapsed() < SAID_EVERY) {
            return;
        }
        let times = match said.since {
            1 => String::new(),
            since => format!("; {since} such plans since the last warning"),
        };
        *said = Said { at: Some(Instant::now()), since: 0 };
        say(&format!(
            "robot `{}`: a plan took {:.1} ms, longer than a period of {:.1} ms, so the robot is late ({}){times}",
            self.robot,
            took_ns as f64 * 1e-6,
            period_ns as f64 * 1e-6,
            self.place,
        ));
    }

    /// Looks now and then whether a plan hangs, until the stopwatch is stopped. `main` is the thread that plans, as Python
    /// numbers it.
    pub(crate) fn watch(self: &Arc<Stopwatch>, main: u64) -> std::thread::JoinHandle<()> {
        let watch = Arc::clone(self);
        std::thread::spawn(move || {
            let mut told = 0;
            while !watch.over.load(Relaxed) {
                std::thread::park_timeout(LOOK_EVERY);
                let begun_ns = watch.begun_ns.load(Relaxed);
                let runs = Duration::from_nanos((watch.now_ns() + 1).saturating_sub(begun_ns));
                if begun_ns == 0 || begun_ns == told || runs < HANGS {
                    continue;
                }
                let place = Python::attach(|py| place_now(py, main)).unwrap_or_else(|| watch.place.clone());
                // It may have come to its end while this thread waited for Python.
                if watch.begun_ns.load(Relaxed) == begun_ns {
                    told = begun_ns;
                    let runs_s = runs.as_secs_f64();
                    say(&format!("robot `{}`: a plan has been running for {runs_s:.1} s ({place})", watch.robot));
                }
            }
        })
    }

    /// Ends the watch.
    pub(crate) fn stop(&self) {
        self.over.store(true, Relaxed);
    }
}

/// Where a thread of Python is, in a file of the user.
fn place_now(py: Python<'_>, thread: u64) -> Option<String> {
    let place = py.import("shoal._errors").and_then(|errors| errors.call_method1("place_of_thread", (thread,)));
    place.ok()?.extract().ok()
}

/// A warning on standard error: `shoal run` repeats it with the robot's name.
fn say(text: &str) {
    let _ = writeln!(std::io::stderr(), "warning: {text}");
}
