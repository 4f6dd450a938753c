//! The end of a run: the world has ended, the agents go, and what they left is read.

use super::{Supervisor, Watch};
use crate::coordinator::{Ending, SIGBUS};
use crate::error::{Error, Kind};
use crate::processes::{Measured, Who, now};
use bus::{Address, clean};
use model::{Outcome, RobotInstance, Scenario};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::time::Duration;

/// How often it looks while the agents go.
const FAREWELL_BEAT: Timespec = Timespec { tv_sec: 0, tv_nsec: 10_000_000 };
/// How long the agents have to end by themselves once the run is over.
const FAREWELL: Duration = Duration::from_millis(1500);

/// What a run came to.
pub struct Finished {
    /// Where it lived; nothing should be left there.
    pub address: Address,
    /// Ground truth.
    pub outcome: Outcome,
    /// The scenario, with the robots that were added.
    pub scenario: Scenario,
    /// Every process that ran, and what it used. The world has no instance.
    pub processes: Vec<(Option<RobotInstance>, u32, Measured)>,
    /// Statistics that the processes left, by name.
    pub stats: Vec<(String, bus::StatsSnapshot)>,
    /// From the first tick to the end of the last, s.
    pub wall_time_s: f64,
    /// From the first spawn to the first tick, ms.
    pub startup_ms: Option<f64>,
    /// Shared memory that the fleet took, bytes.
    pub shm_bytes: u64,
    /// Somebody asked for the end before its time.
    pub interrupted: bool,
    /// Why there is no record, if one was wanted and there is none.
    pub record_failed: Option<String>,
    /// What went wrong around the run and did not cost its result: it was cut short, or something of it is missing.
    pub failures: Vec<Error>,
}

impl Supervisor {
    /// The world has ended: take stock, let the agents go, read what they left.
    pub(super) fn finish(&mut self, watch: &mut dyn Watch) -> Result<Finished, Error> {
        if self.killed {
            return Err(Error::new(Kind::Interrupted, "interrupted"));
        }
        self.coordinator.stopping();
        self.hear();
        self.coordinator.refuse_waiting();
        self.act(Some(watch));
        self.show(watch);

        self.children.measure_all();
        let shm_bytes = clean::usage(&self.address);
        let (start_ns, end_ns) = (self.gate.start_ns(), self.gate.progress().stamp_ns);
        self.gate.stop();
        let farewell = now();
        while self.children.any() && now() - farewell < FAREWELL {
            let _ = poll(&mut [PollFd::new(&self.signals, PollFlags::IN)], Some(&FAREWELL_BEAT));
            let _ = self.signals.take_interrupts();
            self.reap();
        }
        self.kill_all(watch);
        self.pass_on_talk(watch);

        let mut failures = std::mem::take(&mut self.failures);
        let Some(end) = self.left.read() else { return Err(self.without_outcome(failures)) };
        if !end.finished && failures.is_empty() {
            let problem =
                format!("gate: stopped from outside at tick {}, before the end of the run", end.outcome.ticks);
            let hint = "what holds the run together is memory that every process of it, and of this user, can write";
            failures.push(Error::new(Kind::Gate, problem).hint(hint));
        }
        let stats = self.statistics().unwrap_or_else(|failure| {
            failures.push(failure);
            Vec::new()
        });
        Ok(Finished {
            address: self.address.clone(),
            outcome: end.outcome,
            scenario: self.coordinator.scenario().clone(),
            processes: self.children.take_measured(),
            stats,
            wall_time_s: start_ns.map_or(0.0, |start_ns| end_ns.saturating_sub(start_ns) as f64 * 1e-9),
            startup_ms: start_ns
                .zip(self.spawned_ns)
                .map(|(start_ns, spawned_ns)| start_ns.saturating_sub(spawned_ns) as f64 * 1e-6),
            shm_bytes,
            interrupted: self.coordinator.interrupted(),
            record_failed: end.record_failed,
            failures,
        })
    }

    /// Ends every process that is left, and says which do not die.
    pub(super) fn kill_all(&mut self, watch: &mut dyn Watch) {
        for pid in self.children.kill_all() {
            watch.say(&format!("process {pid} was killed but does not exit: it is traced, or blocked in the kernel"));
        }
    }

    /// What all processes have counted. Nothing of it may be missing in silence: a run without measurements is not one
    /// without delays.
    fn statistics(&self) -> Result<Vec<(String, bus::StatsSnapshot)>, Error> {
        let begun = self.gate.start_ns().is_some();
        let missing = |why: &dyn std::fmt::Display| {
            Error::new(Kind::Statistics, format!("statistics: missing: {why}"))
                .hint("the report covers the whole run, except latencies")
        };
        let departed = self.departed.iter().map(|(robot, counted)| {
            // By a name that no process of theirs has any more.
            let instance = RobotInstance { index: *robot, incarnation: u32::MAX };
            (robot_agent::shell::spec_file(instance), counted.clone())
        });
        let mut read = bus::stats::read_all(&self.address);
        if let (Ok(stats), Some(counted)) = (&mut read, &self.worlds.counted) {
            match stats.iter_mut().find(|(name, _)| name == bus::stats::WORLD) {
                Some((_, world)) => world.merge(counted),
                None => stats.push((bus::stats::WORLD.to_owned(), counted.clone())),
            }
        }
        match read.map(|stats| stats.into_iter().chain(departed).collect::<Vec<_>>()) {
            Ok(stats) if !begun || stats.iter().any(|(name, _)| name == bus::stats::WORLD) => Ok(stats),
            Ok(_) => Err(missing(&"their files were removed")),
            Err(error) => Err(missing(&error)),
        }
    }

    /// Ground truth is lost; what the daemon has seen of the run is not.
    fn without_outcome(&mut self, failures: Vec<Error>) -> Error {
        let ending = self.world_ending.map_or("does not end".to_owned(), |ending| ending.describe());
        let mut failure = Error::new(Kind::World, format!("world-sim {ending} before the run was over"));
        let progress = self.gate.progress();
        if self.gate.start_ns().is_some() {
            let time_s = progress.tick as f64 * self.coordinator.scenario().clock.dt_s();
            failure = failure.detail(format!(
                "at tick {} ({time_s:.2} s): {} of {} robots had arrived, {} contacts",
                progress.tick, progress.arrived, progress.robots, progress.contacts
            ));
        }
        if let Some(words) = self.children.last_words(Who::World, now()) {
            failure = failure.hint(format!("its last output: {words}"));
        }
        failure.hints.extend(self.world_ending.and_then(full_memory));
        failure.before = failures;
        failure.hint("the run has no report; all its files have been removed")
    }
}

impl Finished {
    /// For those who have no use for a run around which something went wrong.
    ///
    /// # Errors
    /// The first thing that did.
    pub fn undisturbed(mut self) -> Result<Finished, Error> {
        if self.failures.is_empty() { Ok(self) } else { Err(self.failures.swap_remove(0)) }
    }
}

/// Why a process that died of SIGBUS may have died, if it is that.
pub(super) fn full_memory(ending: Ending) -> Option<String> {
    (ending.signal == Some(SIGBUS) && bus::sizes::nearly_full()).then(|| {
        "/dev/shm is full, and writing to it then ends in SIGBUS: make room (`df -h /dev/shm`, `shoal clean`), or mount \
         it larger"
            .to_owned()
    })
}
