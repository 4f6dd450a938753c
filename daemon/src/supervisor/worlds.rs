//! The world's process, and the next one if it ends before its time: of a fleet that is left running, in `realtime`.

use super::Supervisor;
use crate::coordinator::Ending;
use crate::error::{Error, Kind};
use crate::processes::{Who, now};
use crate::service::{Entry, Level};
use bus::{Footing, StatsSnapshot, WorldObserver, stats};
use model::Mode;
use std::time::Duration;

/// A world that ends more often than this within the window is not started again.
const RESTARTS_MAX: usize = 20;
const WINDOW: Duration = Duration::from_secs(60);
/// Numbers that are tried for a new world: a daemon of before may have made the board of one that never ran.
const NUMBERS_MAX: u32 = 16;

/// The worlds of a fleet.
#[derive(Default)]
pub(super) struct Worlds {
    /// How often the world's process was replaced.
    pub(super) incarnation: u32,
    /// Whose board the daemon reads.
    observed: u32,
    /// When it was replaced, within the window.
    replaced: Vec<Duration>,
    /// What those that have ended have counted.
    pub(super) counted: Option<StatsSnapshot>,
}

impl Worlds {
    /// The world that runs, as the gate has it.
    pub(super) fn of(incarnation: u32) -> Worlds {
        Worlds { incarnation, observed: incarnation, ..Worlds::default() }
    }
}

impl Supervisor {
    /// The world's process has ended. Where another one can go on, it does; otherwise this is the end of the run.
    pub(super) fn world_ended(&mut self, ending: Ending) {
        let words = self.children.last_words(Who::World, now());
        if !self.can_replace_world() {
            self.world_ending = Some(ending);
            return;
        }
        let mut how = format!("the world's process {}", ending.describe());
        if let Some(words) = words.filter(|_| ending.code != Some(0)) {
            how += &format!(": {words}");
        }
        self.log(Entry::new(Level::Error, "daemon", format!("{how}; another one goes on from its last state")));
        if let Err(failure) = self.replace_world() {
            self.world_ending = Some(ending);
            self.fail(failure);
        }
    }

    fn can_replace_world(&mut self) -> bool {
        let since = now().saturating_sub(WINDOW);
        self.worlds.replaced.retain(|at| *at > since);
        self.keeper.is_some()
            && self.can_go_on()
            && self.asked_at.is_none()
            && !self.killed
            && !self.gate.stopped()
            && self.failures.is_empty()
            && self.worlds.replaced.len() < RESTARTS_MAX
    }

    /// Starts a world that goes on from the state that the one before has left. Its board and its frames are new; the
    /// rings, the gate and the boards of robots are those of before.
    pub(super) fn replace_world(&mut self) -> Result<(), Error> {
        self.worlds.replaced.push(now());
        if let Some(counted) = stats::take(&self.address, stats::WORLD) {
            self.worlds.counted.get_or_insert_default().merge(&counted);
        }
        let tried = self.worlds.incarnation + NUMBERS_MAX;
        loop {
            self.worlds.incarnation += 1;
            match self.services.renew(&self.node, self.worlds.incarnation) {
                Ok(()) => break,
                Err(_) if self.worlds.incarnation < tried => {}
                Err(error) => return Err(error.into()),
            }
        }
        self.footing = Footing::survey_running(&self.address)?;
        // Before the world: it answers in its first tick.
        self.coordinator.resync();
        self.act(None);
        self.children.spawn_world(self.worlds.incarnation)?;
        self.janitor.want();
        Ok(())
    }

    /// Reads the board of the world that writes.
    pub(super) fn follow_world(&mut self) {
        let incarnation = self.gate.world_incarnation();
        if incarnation != self.worlds.observed
            && let Ok(observer) = WorldObserver::open(&self.node, incarnation)
        {
            (self.observer, self.worlds.observed) = (observer, incarnation);
        }
    }

    /// What keeps a fleet from being taken over if its world has ended as well.
    pub(super) fn refuse_without_world(&self) -> Result<(), Error> {
        if self.can_go_on() {
            return Ok(());
        }
        let problem = format!("fleet `{}`: its daemon and its world have ended", self.address.id());
        Err(Error::new(Kind::World, problem)
            .hint("`shoal down --force` removes it, and `shoal up` starts it again: its tasks are kept"))
    }

    fn can_go_on(&self) -> bool {
        self.coordinator.scenario().clock.mode == Mode::Realtime && self.gate.start_ns().is_some()
    }
}
