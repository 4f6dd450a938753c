//! The end of a run: the world has ended, the agents go, and what they left is read.

use crate::coordinator::Ending;
use crate::exit::{self, Failure};
use crate::processes::Measured;
use crate::supervisor::{Supervisor, Watch, now};
use bus::{Address, clean};
use protocol::Seat;
use protocol::codec;
use protocol::world_to_daemon::Outcome;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use scenarios::Scenario;
use std::time::Duration;

/// How often it looks while the agents go.
const FAREWELL_BEAT: Timespec = Timespec { tv_sec: 0, tv_nsec: 10_000_000 };
/// How long the agents have to end by themselves once the run is over.
const FAREWELL: Duration = Duration::from_millis(1500);
/// SIGBUS: what writing into a full tmpfs does.
const SIGBUS: i32 = 7;

/// What a run came to.
pub struct Finished {
    /// Where it lived; nothing should be left there.
    pub address: Address,
    /// Ground truth.
    pub outcome: Outcome,
    /// The scenario, with the robots that were added.
    pub scenario: Scenario,
    /// Every process that ran, and what it used. The world has no seat.
    pub processes: Vec<(Option<Seat>, u32, Measured)>,
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
}

impl Supervisor {
    /// The world has ended: take stock, let the agents go, read what they left.
    pub(crate) fn finish(&mut self, watch: &mut dyn Watch) -> Result<Finished, Failure> {
        if self.killed {
            return Err(Failure { code: exit::INTERRUPTED, lines: Vec::new() });
        }
        self.coordinator.stopping();
        while let Some(notice) = self.notices.take() {
            self.coordinator.notice(notice);
        }
        self.act(Some(watch))?;
        self.show(watch);

        self.children.measure_all();
        let shm_bytes = clean::usage(&self.address);
        let (start_ns, end_ns) = (self.gate.start_ns(), self.gate.progress().stamp_ns);
        self.gate.stop();
        let farewell = now();
        while self.children.any() && now() - farewell < FAREWELL {
            let _ = poll(&mut [PollFd::new(&self.signals, PollFlags::IN)], Some(&FAREWELL_BEAT));
            let _ = self.signals.take_interrupts();
            self.reap()?;
        }
        self.children.kill_all();

        let Some(outcome) = self.outcome() else {
            let ending = self.world_ending.map_or("is gone".to_owned(), |ending| ending.describe());
            let mut failure = Failure::environment(format!("world-sim {ending} before the run was over"));
            if let Some(words) = self.children.last_words("world") {
                failure = failure.hint(format!("its last words: {words}"));
            }
            return Err(failure.hint("the run has no outcome; everything of it has been removed"));
        };
        Ok(Finished {
            address: self.address.clone(),
            outcome,
            scenario: self.coordinator.scenario().clone(),
            processes: self.children.take_measured(),
            stats: bus::stats::read_all(&self.address)?,
            wall_time_s: start_ns.map_or(0.0, |start_ns| end_ns.saturating_sub(start_ns) as f64 * 1e-9),
            startup_ms: start_ns.map(|start_ns| start_ns.saturating_sub(self.spawned_ns) as f64 * 1e-6),
            shm_bytes,
            interrupted: self.coordinator.interrupted(),
            record_failed: self
                .left_by_world(world_sim::shell::RECORD_FAILED_FILE)
                .map(|cause| String::from_utf8_lossy(&cause).into_owned()),
        })
    }

    fn outcome(&self) -> Option<Outcome> {
        codec::decode(&self.left_by_world(world_sim::shell::OUTCOME_FILE)?).ok()
    }

    fn left_by_world(&self, name: &str) -> Option<Vec<u8>> {
        #[expect(clippy::disallowed_methods, reason = "the supervisor reads what the world left")]
        std::fs::read(self.address.file(name)).ok()
    }
}

/// A process that dies of SIGBUS wrote into a tmpfs that had no room left.
pub(crate) fn fail_on_full_memory(who: &str, ending: Ending) -> Result<(), Failure> {
    if ending.signal == Some(SIGBUS) {
        return Err(Failure::environment(format!("{who}: died of SIGBUS: shared memory is full"))
            .hint("make room in /dev/shm (`df -h /dev/shm`, `shoal clean`), or mount it larger"));
    }
    Ok(())
}
