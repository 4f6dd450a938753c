//! What has to be true of a fleet whatever happens to it.

use crate::dice::MS;
use crate::fleet::Fleet;
use crate::plan::START_LIMIT_MS;
use crate::shared::Shared;
use crate::world::PATIENCE_NS;
use bus::queue::BACKLOG_MAX;
use daemon::coordinator::{Answer, WAITING_MAX};
use model::{
    Drive, Event, EventKind, EventName, GoalSource, Mode, ProcessState, RobotIndex, RobotInstance, TaskEnd, TaskState,
};
use protocol::operator_to_daemon::{Reply, Request, TaskFilter};
use protocol::robot_to_world::Command;
use protocol::world_to_daemon::Notice;
use std::collections::BTreeMap;
use world_sim::{RobotState, World};

/// The log holds no more entries.
const EVENTS_MAX: usize = 10_000 + 1024;

/// The start limit, once for the process before to end and once for its own, and the time that it takes until all that
/// operators asked for has gone through a small ring.
const WAITS_NS: u64 = 2 * START_LIMIT_MS * MS + 5000 * MS;

/// What was seen at the last opening.
#[derive(Default)]
pub(crate) struct Checks {
    participants: Vec<RobotInstance>,
    states: Vec<RobotState>,
    /// How long the daemon was awake until the last look.
    daemon_awake_ns: u64,
    /// How long both were awake.
    awake_ns: u64,
    /// Those whom the world waits for before it opens a tick, and since when, as that time goes.
    awaited: BTreeMap<RobotInstance, u64>,
}

impl Checks {
    /// Of a world that goes on where another one has stopped.
    pub(crate) fn of(world: &World) -> Checks {
        let known = (0..world.slots()).filter_map(|slot| world.state(slot));
        let present = known.filter(|(_, state)| matches!(state, RobotState::Present { .. }));
        let participants = present.map(|(instance, _)| instance).collect();
        Checks { participants, states: states(world), ..Checks::default() }
    }

    /// The world never waits without a bound: a process that does not come up is given up. What counts is the time in which
    /// neither the daemon nor the world was stopped; a world that is awake looks at least every [`PATIENCE_NS`].
    /// Each daemon that follows one that has died gives a process its time once more.
    pub(crate) fn waited(&mut self, missing: &[RobotInstance], daemon_awake_ns: u64, daemons_died: u64) {
        let waits_ns_max = WAITS_NS + daemons_died * START_LIMIT_MS * MS;
        let passed_ns = daemon_awake_ns - std::mem::replace(&mut self.daemon_awake_ns, daemon_awake_ns);
        self.awake_ns += passed_ns.min(PATIENCE_NS);
        self.awaited.retain(|instance, _| missing.contains(instance));
        for instance in missing {
            let waits_ns = self.awake_ns - *self.awaited.entry(*instance).or_insert(self.awake_ns);
            assert!(waits_ns <= waits_ns_max, "the world has been waiting for {instance:?} for {} ms", waits_ns / MS);
        }
    }

    /// Robots come and go between two ticks, and it is said; a newcomer is not heard yet.
    pub(crate) fn opened(&mut self, world: &World, notices: &[Notice]) {
        let tick = world.tick();
        let entered = notices.iter().filter_map(|notice| match notice {
            Notice::Entered { instance, tick } => Some((*instance, *tick)),
            _ => None,
        });
        let new = world.participants().iter().filter(|instance| !self.participants.contains(instance));
        let (entered, new): (Vec<_>, Vec<_>) = (entered.collect(), new.map(|instance| (*instance, tick)).collect());
        assert_eq!(entered, new, "tick {tick}: those who were said to enter, and those who take part");
        for instance in world.participants() {
            for who in world.neighbors(instance.index.at()) {
                let who = RobotInstance::from(*who);
                assert!(
                    self.participants.contains(&who),
                    "tick {tick}: {instance:?} hears {who:?}, who has not spoken"
                );
            }
        }
        self.participants = world.participants().to_vec();
        self.states = states(world);
    }

    /// No robot comes or goes while a tick is open, and a robot that was given a command moves.
    pub(crate) fn closed(&self, world: &World, commands: &[(RobotInstance, Option<Command>)]) {
        let tick = world.tick() - 1;
        let change = states(world).into_iter().zip(&self.states).position(|(now, then)| now != *then);
        assert_eq!(change, None, "tick {tick}: the robot of this slot changed in the middle of a tick");
        for (instance, command) in commands {
            let odometry = world.odometry(instance.index.at());
            let moves = odometry.vx_mps != 0.0 || odometry.vy_mps != 0.0;
            match command.and_then(|command| command.drive()) {
                None => assert!(!moves, "tick {tick}: {instance:?} was given no command, and moves"),
                Some(Drive::Velocity(wish)) if wish.norm() > 0.0 => {
                    assert!(moves, "tick {tick}: {instance:?} was given a command, and stands");
                }
                Some(_) => {}
            }
        }
    }

    /// Only what the present life of a robot has said for this moment moves it; and what it has answered does.
    pub(crate) fn commanded(
        &self,
        world: &World,
        mode: Mode,
        commands: &[(RobotInstance, Option<Command>)],
        shared: &Shared,
        timeout_ns: u64,
    ) {
        let tick = world.tick();
        let instances: Vec<RobotInstance> = commands.iter().map(|(instance, _)| *instance).collect();
        assert_eq!(instances, self.participants, "tick {tick}: commands are for those who take part");
        for (instance, command) in commands {
            let is_readable = shared.memory.boards.get(instance).is_some_and(|board| board.is_readable);
            let answered = is_readable && shared.memory.answered(*instance, tick);
            if mode == Mode::Lockstep {
                assert_eq!(answered, command.is_some(), "tick {tick}: {instance:?} has answered, its command counts");
            }
            let Some(command) = command else { continue };
            assert_eq!(command.incarnation, instance.incarnation, "tick {tick}: {instance:?} is moved by another life");
            assert_eq!(Some(*command), shared.memory.boards.get(instance).map(|board| board.command));
            match mode {
                Mode::Realtime => assert!(command.odometry_stamp_ns + timeout_ns >= shared.now),
                _ => assert_eq!(command.tick, tick, "{instance:?} is moved by what it said for another tick"),
            }
        }
    }
}

/// Where everybody is, but for whether those that are held answer again.
fn states(world: &World) -> Vec<RobotState> {
    let known = (0..world.slots()).filter_map(|slot| world.state(slot));
    known
        .map(|(_, state)| match state {
            RobotState::Held { .. } => RobotState::Held { answers: false },
            state => state,
        })
        .collect()
}

/// Memory is bounded, whatever stands still.
pub(crate) fn bounds(fleet: &Fleet) {
    let (world, coordinator) = (&fleet.world, &fleet.daemon.coordinator);
    let slots = coordinator.scenario().fleet.max_robots;
    // Of each robot: that it stopped, was late, and died, in a few lives.
    let facts = slots * 3 * 22 + 1 + fleet.shared.coverage.removals as usize;
    let held = [
        ("requests that wait for the world", coordinator.unanswered(), WAITING_MAX + fleet.shared.estate.records.len()),
        ("orders that wait for room", fleet.daemon.orders.len(), WAITING_MAX + facts),
        ("orders that wait for a tick", world.world.orders_waiting(), WAITING_MAX + facts),
        ("notices that wait for room", world.notices.len(), BACKLOG_MAX),
        ("entries of the log", world.world.events().len(), EVENTS_MAX),
        // A life that is over is in there until its tick closes.
        ("robots that are not waited for", world.attendance.silent_count(), 2 * slots),
        ("processes", fleet.kernel.processes.len(), slots),
        ("robots", coordinator.members().len(), slots),
    ];
    for (what, is, most) in held {
        assert!(is <= most, "{is} {what}, more than {most}");
    }
}

/// Nothing is under way: not in a ring, not before one, and no process has changed without notice.
pub(crate) fn is_drained(fleet: &Fleet) -> bool {
    let rings = fleet.shared.orders.is_empty() && fleet.shared.notices.is_empty();
    let estate = &fleet.shared.estate;
    let settled = !fleet.daemon.coordinator.is_resyncing() && !estate.world_died && estate.world_begins.is_none();
    rings && settled && fleet.daemon.orders.is_empty() && fleet.world.is_drained() && fleet.kernel.is_settled()
}

/// What the world and the coordinator believe of every robot fits, and with it what the kernel knows. Only to be asked
/// when nothing is under way.
pub(crate) fn agreement(fleet: &Fleet) {
    let (world, coordinator) = (&fleet.world.world, &fleet.daemon.coordinator);
    assert_eq!(coordinator.unanswered(), 0, "the world has done all that it was asked for, and has not said so");
    for (slot, member) in coordinator.members().iter().enumerate() {
        let Some((instance, state)) = world.state(slot) else {
            assert_eq!(member.state, ProcessState::Refused, "slot {slot}: the world does not know this robot");
            continue;
        };
        let runs = fleet.kernel.processes.iter().any(|process| process.instance == instance);
        let same = member.instance == instance;
        let fits = match (state, member.state) {
            (RobotState::Vacant, ProcessState::Refused) => !runs,
            (RobotState::Awaited { .. } | RobotState::Dead { returns: Some(_) }, now)
                if world.has_process(instance) =>
            {
                same && runs && matches!(now, ProcessState::Starting | ProcessState::Stopped)
            }
            (
                RobotState::Awaited { .. } | RobotState::Dead { returns: Some(_) },
                ProcessState::Awaited | ProcessState::Dead,
            ) => !runs,
            (RobotState::Present { .. } | RobotState::Held { .. }, ProcessState::Running | ProcessState::Stopped) => {
                same && runs
            }
            (RobotState::Paused { .. }, ProcessState::Running | ProcessState::Stopped | ProcessState::Paused) => {
                same && runs
            }
            (RobotState::Dead { returns: None }, ProcessState::Dead | ProcessState::RestartLimit) => !runs,
            (RobotState::Dropped, ProcessState::Dead) => !runs,
            (RobotState::Left, ProcessState::Left) => true,
            _ => false,
        };
        assert!(
            fits,
            "slot {slot}: the world says {instance:?} {state:?}, process: {runs}; the coordinator {member:?}"
        );
    }
    for process in &fleet.kernel.processes {
        let known =
            coordinator.members().iter().any(|member| member.instance == process.instance && member.pid.is_some());
        assert!(known, "the process of {:?} belongs to no robot", process.instance);
    }
}

/// After the storm, and after time enough: everybody who can come back has, and of everybody else it is said why not.
pub(crate) fn nobody_is_lost(fleet: &Fleet) {
    let world = &fleet.world.world;
    for slot in 0..world.slots() {
        let Some((instance, state)) = world.state(slot) else { continue };
        let Some(robot) = world.robot(slot) else { continue };
        let said = |kinds: &[EventName]| {
            let mut events = world.events().iter().filter(|event| event.robot == Some(RobotIndex::of(slot)));
            world.outcome().events_lost > 0 || events.any(|event| kinds.contains(&event.kind.name()))
        };
        let is_fine = match state {
            RobotState::Present { .. } => true,
            RobotState::Left => said(&[EventName::Left]),
            RobotState::Dropped => said(&[EventName::Dropped]),
            RobotState::Dead { returns: None } => {
                said(&[EventName::Died, EventName::Killed, EventName::NotStarted, EventName::Deaf])
            }
            _ => false,
        };
        assert!(is_fine, "robot {} is lost: {instance:?}, {state:?}, restarts {:?}", robot.id, robot.restart);
    }
    for process in fleet.kernel.processes.iter().filter(|process| process.lives()) {
        assert!(world.has_process(process.instance), "the process of {:?} is not wanted", process.instance);
    }
}

/// What did not reach the daemon, it has said so.
pub(crate) fn nothing_is_missed_in_silence(fleet: &Fleet) {
    let missed = fleet.shared.missed;
    assert_eq!(fleet.daemon.said_missed, missed.entries + missed.others, "notices that found no room, as said");
}

/// A task that a robot was given is done, was dropped, waits, or is the goal that it heads for: none gets lost on the way.
/// Robots are left out that were to forget what they had, and runs whose log is full.
pub(crate) fn tasks_are_kept(fleet: &Fleet) {
    let world = &fleet.world.world;
    if world.outcome().events_lost > 0 {
        return;
    }
    for slot in 0..world.slots() {
        let Some(robot) = world.robot(slot) else { continue };
        let events = of_this_robot(world, slot);
        let mut tasks = events.iter().filter(|event| event.kind.name() == EventName::Task);
        if tasks.clone().any(|event| matches!(event.kind, EventKind::Task { task, .. } if task.now)) {
            continue;
        }
        let (given, odometry) = (robot.goals.len() + tasks.by_ref().count(), world.odometry(slot));
        let dropped = events.iter().filter(|event| event.kind.name() == EventName::TaskDropped);
        let known = (odometry.goals_done + odometry.goals_left) as usize + dropped.count();
        // The last goal is done, and is left again while its robot is off it.
        let twice = odometry.goals_left == 1 && known == given + 1;
        assert!(known == given || twice, "robot {} was given {given} goals, and knows {known}", robot.id);
    }
}

/// No task is lost, and none is done twice, whatever has died: with ticks that are lost, what the log has of a task that is at
/// its end is not what the daemon was told of it.
pub(crate) fn tasks_survive(fleet: &mut Fleet) {
    // A daemon that was not told how everything stands before the end leaves it to the next one.
    let is_blind = fleet.daemon.coordinator.is_resyncing();
    if is_blind || fleet.shared.missed.others > 0 || fleet.world.world.outcome().events_lost > 0 {
        return;
    }
    for record in fleet.shared.estate.records.values() {
        let done = record.steps.iter().filter(|step| step.state == TaskState::Done).count();
        assert!(done <= 1, "{record:?} was done twice");
        let source = GoalSource::Operator(record.id);
        let (mut given, mut ended) = (0, 0);
        for event in fleet.world.world.events() {
            match event.kind {
                EventKind::Task { source: of, .. } if of == source => given += 1,
                EventKind::TaskDone { source: of } | EventKind::TaskDropped { source: of, .. } if of == source => {
                    ended += 1;
                }
                _ => {}
            }
        }
        let right = match record.state {
            // Sent again to a world that ended before it took it: the next fleet is given it.
            TaskState::Queued => record.steps.len() > 1 && (given, ended) == (0, 0),
            TaskState::Assigned | TaskState::Active => (given, ended) == (1, 0),
            TaskState::Refused => given == 0 && record.steps.iter().all(|step| step.state != TaskState::Assigned),
            TaskState::Done | TaskState::Failed | TaskState::Cancelled => given == ended,
        };
        assert!(right, "{record:?} was given {given} times, and came to an end {ended} times");
    }
}

/// What happened to the robot that has a slot now, or had it last; not what happened to robots that had it before.
pub(crate) fn of_this_robot(world: &World, slot: usize) -> Vec<&Event> {
    let events: Vec<&Event> = world.events().iter().filter(|event| event.robot == Some(RobotIndex::of(slot))).collect();
    let mut robots: Vec<Vec<&Event>> = vec![Vec::new()];
    for event in events {
        robots.last_mut().expect("there is one").push(event);
        if event.kind == EventKind::Left {
            robots.push(Vec::new());
        }
    }
    let is_gone = matches!(world.state(slot), Some((_, RobotState::Left)));
    robots.truncate(robots.len() - usize::from(is_gone));
    robots.pop().unwrap_or_default()
}

/// What the daemon knows of every task that an operator sent is what has become of it.
pub(crate) fn tasks_are_followed(fleet: &mut Fleet) {
    if fleet.shared.missed.others > 0 || fleet.world.world.outcome().events_lost > 0 {
        return;
    }
    let filter = TaskFilter { newest: u32::MAX, ..TaskFilter::default() };
    let Answer::Now(Reply::Tasks(records)) = fleet.daemon.coordinator.request(&Request::Tasks(filter), &|_, _| None)
    else {
        panic!("no list of tasks");
    };
    for record in records {
        let source = GoalSource::Operator(record.id);
        let (mut given, mut end) = (0, None);
        for event in fleet.world.world.events() {
            match event.kind {
                EventKind::Task { source: of, .. } if of == source => given += 1,
                EventKind::TaskDone { source: of } if of == source => {
                    assert_eq!(end, None, "{record:?} is done, and was at its end before");
                    end = Some(TaskState::Done);
                }
                EventKind::TaskDropped { source: of, why } if of == source => {
                    assert_eq!(end, None, "{record:?} is dropped, and was at its end before");
                    end = Some(match why {
                        TaskEnd::Cancelled | TaskEnd::Replaced => TaskState::Cancelled,
                        TaskEnd::Overdue | TaskEnd::RobotGone | TaskEnd::Unreachable => TaskState::Failed,
                    });
                }
                _ => {}
            }
        }
        let right = match (given, end) {
            (0, None) => record.state == TaskState::Refused,
            (1, None) => matches!(record.state, TaskState::Assigned | TaskState::Active),
            (1, Some(end)) => record.state == end,
            _ => false,
        };
        assert!(right, "{record:?} was given {given} times and came to {end:?}");
    }
}
