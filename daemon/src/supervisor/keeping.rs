//! What of a fleet that is left running outlives it: tasks, robots, events and the log.

use super::{Finished, Supervisor, Watch, write_bytes};
use crate::coordinator::{Action, Robots};
use crate::error::Error;
use crate::processes::now;
use crate::service::{Batch, Entry, EventRow, Level, RobotRow, Service, wall_ms};
use bus::clean::{NAME_FILE, STATE_FILE};
use bus::helm::ORPHAN_LIMIT_FILE;
use model::{Event, EventName, ProcessState, TaskId};
use std::os::unix::ffi::OsStrExt;
use std::time::Duration;

/// Robots and events are written together, this often.
const WRITE_EVERY: Duration = Duration::from_secs(1);
/// What waits for a database that cannot be written; beyond this, events are left out.
const EVENTS_WAITING_MAX: usize = 10_000;

/// The service of a fleet, and what waits to be written.
pub(super) struct Keeper {
    service: Service,
    waiting: Batch,
    /// The robots as they were written last, by slot.
    robots: Vec<(u32, ProcessState)>,
    /// When the database was written last, or when that failed.
    wrote_at: Duration,
    /// The last attempt failed.
    failing: bool,
}

impl Keeper {
    /// Writes all that waits, and these new tasks.
    fn write(&mut self, new: &[&Action]) -> Result<(), Error> {
        let mut batch = std::mem::take(&mut self.waiting);
        let known = batch.tasks.len();
        for action in new {
            if let Action::Keep { records, .. } = action {
                batch.tasks.extend(records.iter().cloned());
            }
        }
        let written = self.service.store.keep(&batch);
        self.wrote_at = now();
        if let Err(error) = &written {
            batch.tasks.truncate(known);
            self.waiting = batch;
            if !std::mem::replace(&mut self.failing, true) {
                self.service.log.write(&Entry::new(Level::Error, "daemon", error.message.clone()));
            }
        } else if std::mem::take(&mut self.failing) {
            self.service.log.write(&Entry::new(Level::Info, "daemon", "the database can be written again"));
        }
        written
    }

    fn is_due(&self) -> bool {
        !self.waiting.is_empty() && now().saturating_sub(self.wrote_at) >= WRITE_EVERY
    }
}

impl Supervisor {
    /// Takes over what an earlier run of this fleet has left, and says where the fleet is. Its robots may run already.
    pub(super) fn begin_service(&mut self, mut service: Service, robots: Robots) -> Result<(), Error> {
        let scenario = &self.coordinator.scenario().name;
        match robots {
            Robots::New => service.store.begin_run(self.address.id(), scenario)?,
            Robots::Running => service.store.resume_run(self.address.id(), scenario)?,
        }
        let (known, next) = service.store.tasks()?;
        let open = known.iter().filter(|record| !record.state.is_final()).count();
        write_bytes(&self.address.file(STATE_FILE), service.state.path().as_os_str().as_bytes())?;
        write_bytes(&self.address.file(NAME_FILE), service.name.as_bytes())?;
        if let Some(limit) = service.orphan_limit {
            write_bytes(&self.address.file(ORPHAN_LIMIT_FILE), limit.as_secs_f64().to_string().as_bytes())?;
        }
        let begun = match robots {
            Robots::New => format!("fleet {} begins: scenario `{scenario}`", self.address.id()),
            Robots::Running => format!("fleet {} has a new daemon, process {}", self.address.id(), std::process::id()),
        };
        service.log.write(&Entry::new(Level::Info, "daemon", begun));
        let (waiting, written) = (Batch::default(), Vec::new());
        self.keeper = Some(Keeper { service, waiting, robots: written, wrote_at: now(), failing: false });
        self.coordinator.tell_wall_clock(wall_ms());
        self.coordinator.keep_records(known, next, robots);
        if open > 0 && robots == Robots::New {
            self.coordinator.say(format!("{open} tasks that were not done are given to their robots again"));
        }
        Ok(())
    }

    /// The fleet is over: the last of it is written.
    pub(super) fn end_service(&mut self, result: &Result<Finished, Error>) {
        self.keep_robots();
        let Some(keeper) = &mut self.keeper else { return };
        let ending = match result {
            Ok(finished) => match finished.failures.first() {
                Some(failure) => failure.message.clone(),
                None => "stopped".to_owned(),
            },
            Err(error) if error.message == "interrupted" => "stopped at once".to_owned(),
            Err(error) => error.message.clone(),
        };
        // The log says what could not be written.
        let _ = keeper.write(&[]);
        let level = if result.is_ok() { Level::Info } else { Level::Error };
        let ended = match keeper.service.store.end_run(&ending) {
            Ok(()) => format!("fleet ends: {ending}"),
            Err(error) => format!("fleet ends: {ending} ({error})"),
        };
        keeper.service.log.write(&Entry::new(level, "daemon", ended));
    }

    /// Writes what is new of tasks before anything else is done: operators that are answered afterwards can count on it.
    pub(super) fn keep(&mut self, actions: &[Action]) {
        let new: Vec<&Action> = actions.iter().filter(|action| matches!(action, Action::Keep { .. })).collect();
        let mut results: Vec<(TaskId, Result<(), String>)> = Vec::new();
        if let Some(keeper) = &mut self.keeper {
            let changed = actions.iter().filter_map(|action| match action {
                Action::Record(record) => Some(record.clone()),
                _ => None,
            });
            let before = keeper.waiting.tasks.len();
            keeper.waiting.tasks.extend(changed);
            let is_new = keeper.waiting.tasks.len() > before && !keeper.failing || !new.is_empty();
            if !is_new && !keeper.is_due() {
                return;
            }
            let all = keeper.write(&new).map_err(|error| error.message);
            for action in &new {
                let Action::Keep { first, .. } = action else { continue };
                // One of several that cannot be written does not cost the others.
                let kept = match &all {
                    Err(_) if new.len() > 1 => keeper.write(&[action]).map_err(|error| error.message),
                    all => all.clone(),
                };
                results.push((*first, kept));
            }
        } else {
            let firsts = new.iter().filter_map(|action| match action {
                Action::Keep { first, .. } => Some(*first),
                _ => None,
            });
            results.extend(firsts.map(|first| (first, Ok(()))));
        }
        for (first, kept) in results {
            self.coordinator.kept(first, kept);
        }
    }

    /// An event of the run, for the log and the database.
    pub(super) fn keep_event(&mut self, event: &Event) {
        let Some(keeper) = &mut self.keeper else { return };
        let robots = &self.coordinator.scenario().robots;
        let name = |robot: model::RobotIndex| robots.get(robot.at()).map_or_else(String::new, |robot| robot.id.clone());
        let (robot, kind) = (event.robot.map(&name), event.kind.name());
        let detail = event.kind.detail(&name);
        let text = if detail.is_empty() { kind.word().to_owned() } else { format!("{}: {detail}", kind.word()) };
        keeper.service.log.write(&Entry {
            robot: robot.clone(),
            tick: Some(event.tick),
            event: Some(kind.word().to_owned()),
            ..Entry::new(level_of(kind), "world", text)
        });
        if keeper.waiting.events.len() < EVENTS_WAITING_MAX {
            keeper.waiting.events.push(EventRow { tick: event.tick, robot, name: kind.word(), detail });
        }
    }

    /// Robots whose process or state is another one, for the database; and writes what is due.
    pub(super) fn keep_robots(&mut self) {
        let Some(keeper) = &mut self.keeper else { return };
        let (members, robots) = (self.coordinator.members(), &self.coordinator.scenario().robots);
        for (slot, (member, robot)) in members.iter().zip(robots).enumerate() {
            let is = (member.instance.incarnation, member.state);
            match keeper.robots.get_mut(slot) {
                Some(was) if *was == is => continue,
                Some(was) => *was = is,
                None => keeper.robots.push(is),
            }
            keeper.waiting.robots.push(RobotRow {
                name: robot.id.clone(),
                slot: slot as u32,
                incarnation: member.instance.incarnation,
                planner: robot.planner.clone(),
                state: member.state.word(),
            });
        }
        if keeper.is_due() {
            // The log says so if it fails, and it is tried again.
            let _ = keeper.write(&[]);
        }
    }

    pub(super) fn log(&mut self, entry: Entry) {
        if let Some(keeper) = &mut self.keeper {
            keeper.service.log.write(&entry);
        }
    }

    /// What processes have printed goes to the log and to the watcher.
    pub(super) fn pass_on_talk(&mut self, watch: &mut dyn Watch) {
        for spoken in self.children.talk(now()) {
            watch.say(&spoken.to_string());
            let is_robot = self.coordinator.scenario().robots.iter().any(|robot| robot.id == spoken.speaker);
            let source = if is_robot { "agent" } else { "world" };
            let robot = is_robot.then_some(spoken.speaker);
            self.log(Entry { robot, ..Entry::new(Level::Info, source, spoken.words) });
        }
    }
}

/// How much an event matters.
fn level_of(kind: EventName) -> Level {
    match kind {
        EventName::Died
        | EventName::RestartLimit
        | EventName::Held
        | EventName::Dropped
        | EventName::NotStarted
        | EventName::Deaf
        | EventName::Gap
        | EventName::Ignored
        | EventName::GaveUp
        | EventName::BadCommand => Level::Warn,
        _ => Level::Info,
    }
}
