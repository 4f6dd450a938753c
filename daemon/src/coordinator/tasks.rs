//! Tasks: what operators want, what the world says of it, and who is answered when. Which robot does a task: `choice`.
//!
//! A task is known here from the request on. Where the shell keeps records ([`Coordinator::keep_records`]), it is handed over
//! to be kept before the world hears of it, so that nothing is acknowledged that a restart would not know of.

mod choice;

use super::{Action, CONFIRM_WITHIN, Coordinator, Refusal, WAITING_MAX, hint_for, refused, shown};
pub use choice::Place;
use model::{RobotIndex, Task, TaskEnd, TaskId, TaskState, TaskStep};
use protocol::daemon_to_world::{Order, Ticket};
use protocol::operator_to_daemon::{Assign, NewTasks, Reply, TaskChange, TaskFilter, TaskRecord};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

/// Tasks of one request.
pub const BATCH_MAX: usize = 128;
/// Tasks that are not at their end; further ones are refused.
pub const OPEN_MAX: usize = 10_000;
/// Tasks at their end that are remembered.
const ENDED_MAX: usize = 1000;
/// A name that a sender gives to a task has no more bytes.
const KEY_MAX: usize = 64;
/// Why a task failed.
const OVERDUE: &str = "not done by its deadline";
/// Records in one answer.
const LIST_MAX: usize = 1000;

/// The robots to which tasks of before belong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Robots {
    /// They are started with the daemon, and know of no task.
    New,
    /// They have been running, and the world says what they have: [`Coordinator::resync`].
    Running,
}

/// Tasks of one request whose sender waits for the answer.
struct Batch {
    /// The first one names the batch: its ticket is that of the answer.
    tasks: Vec<TaskId>,
    /// Since when, once the clock has been looked at.
    since: Option<Duration>,
}

/// All tasks that are known.
#[derive(Default)]
pub(super) struct Tasks {
    next: u32,
    records: BTreeMap<TaskId, TaskRecord>,
    keys: BTreeMap<String, TaskId>,
    // Kept by `sort_in`: records of tasks at their end need not be looked through.
    /// Tasks that are not at their end.
    open: BTreeSet<TaskId>,
    /// Those of them that the world has not answered.
    queued: BTreeSet<TaskId>,
    /// Those of them whose robot was chosen by a rule.
    movable: BTreeSet<TaskId>,
    /// Those at their end, the oldest first.
    ended: VecDeque<TaskId>,
    batches: Vec<Batch>,
    /// The shell keeps records.
    kept: bool,
    /// The clock on the wall, ms since 1970.
    wall_ms: u64,
    /// Where each robot is, as far as the shell has said.
    places: Vec<Option<Place>>,
}

impl Tasks {
    /// Orders that the world has not answered.
    pub(super) fn unconfirmed(&self) -> usize {
        self.queued.len()
    }

    /// Those that are not at their end.
    pub(super) fn open_ids(&self) -> impl Iterator<Item = TaskId> {
        self.open.iter().copied()
    }

    /// Where a task is in its life, if it is known.
    pub(super) fn state_of(&self, id: TaskId) -> Option<TaskState> {
        self.records.get(&id).map(|record| record.state)
    }

    /// Whether a robot has had this task: then it was not refused.
    fn was_taken(&self, id: TaskId) -> bool {
        let steps = self.records.get(&id).map_or(&[][..], |record| &record.steps);
        steps.iter().any(|step| matches!(step.state, TaskState::Assigned | TaskState::Active))
    }

    /// This robot has the task.
    pub(super) fn set_robot(&mut self, id: TaskId, robot: &str) {
        if let Some(record) = self.records.get_mut(&id) {
            robot.clone_into(&mut record.robot);
        }
    }

    /// The task of a record as it is now: some of the time until its deadline has gone by. `None` if all of it has.
    fn remaining(&self, record: &TaskRecord) -> Option<Task> {
        let sent_ms = record.steps.first().map_or(self.wall_ms, |step| step.at_ms);
        let passed_s = self.wall_ms.saturating_sub(sent_ms) as f64 * 1e-3;
        let deadline_s = record.task.deadline_s.map(|deadline_s| deadline_s - passed_s);
        deadline_s.is_none_or(|left_s| left_s > 0.0).then_some(Task { deadline_s, ..record.task })
    }

    /// A record is new, has changed, or is gone.
    fn sort_in(&mut self, id: TaskId) {
        let record = self.records.get(&id);
        let is_open = record.is_some_and(|record| !record.state.is_final());
        let is_queued = record.is_some_and(|record| record.state == TaskState::Queued);
        let may_move = record.is_some_and(|record| !matches!(record.assign, Assign::Robot(_)));
        let sets = [(&mut self.open, is_open), (&mut self.queued, is_queued), (&mut self.movable, is_open && may_move)];
        for (set, is_in) in sets {
            let _ = if is_in { set.insert(id) } else { set.remove(&id) };
        }
    }

    fn find(&self, name: &str) -> Option<&TaskRecord> {
        // Rust reads `+1` as a number, too.
        let number = Some(name).filter(|name| name.bytes().all(|byte| byte.is_ascii_digit()));
        let id = number.and_then(|name| name.parse().ok()).map(TaskId).filter(|id| self.records.contains_key(id));
        self.records.get(&id.or_else(|| self.keys.get(name).copied())?)
    }

    /// Time in which nothing ran is not counted.
    pub(super) fn was_away(&mut self, away: Duration) {
        self.batches.iter_mut().filter_map(|batch| batch.since.as_mut()).for_each(|since| *since += away);
    }

    fn forget_old(&mut self) {
        while self.ended.len() > ENDED_MAX {
            let record = self.ended.pop_front().and_then(|id| self.records.remove(&id));
            if let Some(key) = record.and_then(|record| record.key) {
                self.keys.remove(&key);
            }
        }
    }
}

impl Coordinator {
    /// From here on the shell keeps records: an [`Action::Keep`] comes before the world hears of a task, and wants to be
    /// answered with [`Coordinator::kept`]. `known` are those of before, `next` the first number that is free. Those that are
    /// not at their end are given to their robots again, unless those run and may have them.
    pub fn keep_records(&mut self, known: Vec<TaskRecord>, next: TaskId, robots: Robots) {
        self.tasks.kept = true;
        self.tasks.next = next.0;
        for record in known {
            let (id, is_open) = (record.id, !record.state.is_final());
            self.tasks.next = self.tasks.next.max(id.0 + 1);
            self.tasks.keys.extend(record.key.clone().map(|key| (key, id)));
            self.tasks.records.insert(id, record);
            self.tasks.sort_in(id);
            match is_open {
                true if robots == Robots::New => self.hand_over_again(id),
                true => {}
                false => self.tasks.ended.push_back(id),
            }
        }
        self.tasks.forget_old();
    }

    /// A task that a robot had when the fleet ended.
    fn hand_over_again(&mut self, id: TaskId) {
        let Some(record) = self.tasks.records.get(&id) else { return };
        let slot = self.scenario.robots.iter().position(|robot| robot.id == record.robot);
        let problem = match slot {
            None => Some(format!("the fleet has no robot `{}`", record.robot)),
            Some(slot) => scenarios::goal_problem(
                &self.scenario,
                &self.scenario.robots[slot],
                record.task.goal,
                record.task.yaw_rad,
            ),
        };
        match (slot, problem) {
            (Some(slot), None) => {
                let Some(task) = self.tasks.remaining(record) else {
                    return self.change(id, TaskState::Failed, OVERDUE);
                };
                self.change(id, TaskState::Queued, "the fleet was started again");
                self.actions.push(Action::Order(Order::Task { id, index: RobotIndex::of(slot), task }));
            }
            (_, problem) => self.change(id, TaskState::Failed, &problem.unwrap_or_default()),
        }
    }

    /// What the clock on the wall says, ms since 1970: steps of tasks are dated by it.
    pub fn tell_wall_clock(&mut self, now_ms: u64) {
        self.tasks.wall_ms = now_ms;
    }

    /// An operator sends tasks. What is sent a second time under its name is answered as it stands.
    pub(super) fn new_tasks(&mut self, new: &NewTasks) -> Result<super::Answer, Refusal> {
        if let Some(key) = &new.key {
            let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.:".contains(&byte);
            let is_name = !key.is_empty() && key.len() <= KEY_MAX && key.bytes().all(is_plain);
            if !is_name || key.bytes().all(|byte| byte.is_ascii_digit()) {
                let hint = format!("up to {KEY_MAX} letters, digits, `-`, `_`, `.` or `:`, not digits alone");
                return Err(refused(&format!("id `{}` is not valid for a task", shown(key)), Some(&hint)));
            }
            if let Some(known) = self.tasks.keys.get(key).and_then(|id| self.tasks.records.get(id)) {
                return match new.tasks[..] == [known.task] && new.assign == known.assign {
                    true => Ok(super::Answer::Now(Reply::Tasked(vec![known.clone()]))),
                    false => Err(refused(
                        &format!("id `{key}` is taken by task {}, which is another one", known.id),
                        Some(&format!("choose another id; `shoal task show {key}` shows that task")),
                    )),
                };
            }
            if new.tasks.len() != 1 {
                return Err(refused("an id is for one task", Some("send the goals one by one, each with its id")));
            }
        }
        if new.tasks.is_empty() || new.tasks.len() > BATCH_MAX {
            return Err(refused(&format!("{} goals: 1 to {BATCH_MAX} can be sent at once", new.tasks.len()), None));
        }
        for task in &new.tasks {
            if let Some(deadline_s) =
                task.deadline_s.filter(|deadline_s| !(*deadline_s > 0.0 && deadline_s.is_finite()))
            {
                return Err(refused(&format!("the deadline, {deadline_s} s, is not a time above 0"), None));
            }
        }
        if self.tasks.open.len() + new.tasks.len() > OPEN_MAX {
            return Err(refused(
                &format!("{} tasks are not done yet, of at most {OPEN_MAX}", self.tasks.open.len()),
                Some("send more when some of them are done: `shoal task list`"),
            ));
        }
        if self.unanswered() + new.tasks.len() > WAITING_MAX {
            return Err(refused(
                &format!("{} requests wait for the world already", self.unanswered()),
                Some("is the world stopped or the machine overloaded? see `shoal ps`, and try again later"),
            ));
        }
        let slots = self.assigned(&new.assign, &new.tasks)?;
        let mut ids = Vec::new();
        for (task, slot) in new.tasks.iter().zip(slots) {
            let id = TaskId(self.tasks.next);
            self.tasks.next += 1;
            let robot = self.scenario.robots[slot].id.clone();
            let (key, assign) = (new.key.clone(), new.assign.clone());
            self.tasks.keys.extend(key.clone().map(|key| (key, id)));
            let record =
                TaskRecord { id, key, assign, robot, task: *task, state: TaskState::Queued, steps: Vec::new() };
            self.tasks.records.insert(id, record);
            ids.push(id);
        }
        let first = ids[0];
        self.tasks.batches.push(Batch { tasks: ids.clone(), since: None });
        ids.iter().for_each(|id| self.note_change(*id, TaskState::Queued, ""));
        if self.tasks.kept {
            let records = ids.iter().map(|id| self.tasks.records[id].clone()).collect();
            self.actions.push(Action::Keep { first, records });
        } else {
            self.kept(first, Ok(()));
        }
        Ok(super::Answer::Later(Ticket::Task(first)))
    }

    /// The shell has kept the records of the tasks that came with this one, or could not: then they are refused.
    pub fn kept(&mut self, first: TaskId, kept: Result<(), String>) {
        let Some(batch) = self.tasks.batches.iter().position(|batch| batch.tasks[0] == first) else { return };
        match kept {
            Ok(()) => {
                for id in self.tasks.batches[batch].tasks.clone() {
                    self.order_task(id);
                }
            }
            Err(problem) => {
                for id in self.tasks.batches.remove(batch).tasks {
                    if let Some(key) = self.tasks.records.remove(&id).and_then(|record| record.key) {
                        self.tasks.keys.remove(&key);
                    }
                    self.tasks.sort_in(id);
                }
                let hint = "the fleet goes on; nothing was sent to a robot".to_owned();
                self.actions.push(Action::Reply(Ticket::Task(first), Reply::Failed { problem, hint }));
            }
        }
    }

    fn order_task(&mut self, id: TaskId) {
        let (Some(record), Some(index)) = (self.tasks.records.get(&id), self.index_of(id)) else { return };
        let Some(task) = self.tasks.remaining(record) else { return self.change(id, TaskState::Failed, OVERDUE) };
        if let Some(resync) = &mut self.resync {
            resync.tasks.remove(&id);
        }
        self.actions.push(Action::Order(Order::Task { id, index, task }));
    }

    /// The world has never had this task, or has forgotten it: it is sent once more.
    pub(super) fn order_task_again(&mut self, id: TaskId) {
        if self.tasks.state_of(id).is_some_and(|state| state != TaskState::Queued) {
            self.change(id, TaskState::Queued, "sent to the world again");
        }
        self.order_task(id);
    }

    /// A step in the life of a task, which the shell is to keep.
    pub(super) fn change(&mut self, id: TaskId, state: TaskState, reason: &str) {
        self.note_change(id, state, reason);
        if let Some(record) = self.tasks.records.get(&id).filter(|_| self.tasks.kept) {
            self.actions.push(Action::Record(record.clone()));
        }
        self.answer_batches();
    }

    fn note_change(&mut self, id: TaskId, state: TaskState, reason: &str) {
        let at_ms = self.tasks.wall_ms;
        let Some(record) = self.tasks.records.get_mut(&id) else { return };
        record.state = state;
        record.steps.push(TaskChange { at_ms, state, robot: record.robot.clone(), reason: reason.to_owned() });
        self.tasks.sort_in(id);
        if state.is_final() {
            self.tasks.ended.push_back(id);
            self.tasks.forget_old();
        }
    }

    /// The world has taken the task, or will not.
    pub(super) fn task_answered(&mut self, id: TaskId, problem: Option<String>) {
        // It may be further already; and what was given up for lost may have been taken all the same.
        if self.tasks.records.get(&id).is_some_and(|record| record.state == TaskState::Queued) {
            let end = if self.tasks.was_taken(id) { TaskState::Failed } else { TaskState::Refused };
            match problem {
                None => self.change(id, TaskState::Assigned, ""),
                // It went after it had been chosen.
                Some(problem) if problem == world_sim::ROBOT_GONE => self.reassign(id, end, &problem),
                Some(problem) => self.change(id, end, &problem),
            }
        }
    }

    /// What became of a task that a robot has.
    pub(super) fn task_step(&mut self, id: TaskId, step: TaskStep) {
        let Some(record) = self.tasks.records.get(&id).filter(|record| !record.state.is_final()) else { return };
        let robot = record.robot.clone();
        match step {
            TaskStep::Active => self.change(id, TaskState::Active, ""),
            TaskStep::Done => self.change(id, TaskState::Done, ""),
            TaskStep::Dropped(TaskEnd::Cancelled) => self.change(id, TaskState::Cancelled, "by an operator"),
            TaskStep::Dropped(TaskEnd::Replaced) => {
                self.change(id, TaskState::Cancelled, "replaced by a task that was to be done at once");
            }
            TaskStep::Dropped(TaskEnd::Overdue) => self.change(id, TaskState::Failed, OVERDUE),
            TaskStep::Dropped(TaskEnd::RobotGone) => {
                self.reassign(id, TaskState::Failed, &format!("robot `{robot}` is gone"));
            }
            TaskStep::Dropped(TaskEnd::Unreachable) => self.reassign_unreachable(id),
        }
    }

    /// Operators whose tasks are all decided are answered.
    fn answer_batches(&mut self) {
        let (tasks, mut decided) = (&mut self.tasks, Vec::new());
        let records = &tasks.records;
        let is_open = |id: &TaskId| records.get(id).is_some_and(|record| record.state == TaskState::Queued);
        tasks.batches.retain(|batch| {
            let waits = batch.tasks.iter().any(is_open);
            if !waits {
                decided.push(batch.tasks.clone());
            }
            waits
        });
        for ids in decided {
            let records: Vec<TaskRecord> = ids.iter().filter_map(|id| self.tasks.records.get(id).cloned()).collect();
            let reply = match &records[..] {
                [TaskRecord { state: TaskState::Refused, robot, steps, .. }] => {
                    let problem = steps.last().map_or("", |step| step.reason.as_str());
                    refused(&format!("robot `{robot}`: {problem}"), hint_for(problem)).into()
                }
                _ => Reply::Tasked(records),
            };
            self.actions.push(Action::Reply(Ticket::Task(ids[0]), reply));
        }
    }

    /// The world has said all that it will. What it has not taken will not happen, unless what it said is lost. A task that a
    /// robot had before stays as it is: the next `shoal up` gives it to the robot again.
    pub(super) fn refuse_tasks(&mut self, answers_are_lost: bool) {
        let batches = std::mem::take(&mut self.tasks.batches);
        if !answers_are_lost {
            let never_had = |record: &&TaskRecord| record.steps.iter().all(|step| step.state == TaskState::Queued);
            let never: Vec<TaskId> = self.tasks.records.values().filter(never_had).map(|record| record.id).collect();
            never.into_iter().for_each(|id| self.change(id, TaskState::Refused, "the run is over"));
        }
        for Batch { tasks, .. } in batches {
            let reply = match answers_are_lost {
                true => {
                    let problem = format!(
                        "{}: not confirmed: the run is over, and the world's answer is lost",
                        self.words(&tasks)
                    );
                    Reply::Unconfirmed { problem, hint: "it may have been done: the report says so".to_owned() }
                }
                false => {
                    let records: Vec<TaskRecord> =
                        tasks.iter().filter_map(|id| self.tasks.records.get(id).cloned()).collect();
                    match records.iter().all(|record| record.state == TaskState::Refused) {
                        true => {
                            let robot = records.first().map_or("", |record| record.robot.as_str());
                            refused(&format!("robot `{robot}`: the run is over"), None).into()
                        }
                        false => Reply::Tasked(records),
                    }
                }
            };
            self.actions.push(Action::Reply(Ticket::Task(tasks[0]), reply));
        }
    }

    /// Operators who have waited long enough are told that it is not known yet.
    pub(super) fn answer_late_tasks(&mut self, now: Duration) {
        let mut late = Vec::new();
        self.tasks.batches.retain_mut(|batch| {
            let waits = now.saturating_sub(*batch.since.get_or_insert(now)) <= CONFIRM_WITHIN;
            if !waits {
                late.push(batch.tasks.clone());
            }
            waits
        });
        for tasks in late {
            let seconds = CONFIRM_WITHIN.as_secs();
            let problem = format!("{}: not confirmed: the world has not answered for {seconds} s", self.words(&tasks));
            let hint = format!(
                "it may still be done: `shoal task show {}` tells; `shoal ps` shows whether the world runs",
                tasks[0]
            );
            self.actions.push(Action::Reply(Ticket::Task(tasks[0]), Reply::Unconfirmed { problem, hint }));
        }
    }

    fn words(&self, tasks: &[TaskId]) -> String {
        let first = tasks[0];
        match tasks.len() {
            1 => {
                let robot = self.tasks.records.get(&first).map_or("?", |record| record.robot.as_str());
                format!("task {first} for robot `{robot}`")
            }
            many => format!("tasks {first} to {}", first.0 + many as u32 - 1),
        }
    }

    /// The tasks that a filter lets through.
    pub(super) fn list_tasks(&self, filter: &TaskFilter) -> Result<Vec<TaskRecord>, Refusal> {
        if let Some(name) = filter.which.iter().find(|name| self.tasks.find(name).is_none()) {
            return Err(self.unknown_task(name));
        }
        let named = |record: &TaskRecord| {
            let is = |name: &String| self.tasks.find(name).is_some_and(|found| found.id == record.id);
            filter.which.is_empty() || filter.which.iter().any(is)
        };
        let fits = |record: &&TaskRecord| {
            filter.robot.as_ref().is_none_or(|robot| *robot == record.robot)
                && (filter.states.is_empty() || filter.states.contains(&record.state))
                && named(record)
        };
        let newest = (filter.newest as usize).min(LIST_MAX);
        let mut records: Vec<TaskRecord> =
            self.tasks.records.values().rev().filter(fits).take(newest).cloned().collect();
        records.reverse();
        Ok(records)
    }

    fn unknown_task(&self, name: &str) -> Refusal {
        let hint = match self.tasks.kept {
            true => format!(
                "`shoal task list` shows the open tasks and the newest {ENDED_MAX} others; the database has all"
            ),
            false => format!("`shoal task list` shows the open tasks and the newest {ENDED_MAX} others"),
        };
        refused(&format!("unknown task `{}`", shown(name)), Some(&hint))
    }

    /// A task that is to be cancelled: the order, and the robot that has it.
    pub(super) fn cancel_task(&mut self, name: &str) -> Result<(Ticket, String), Refusal> {
        let Some(record) = self.tasks.find(name) else { return Err(self.unknown_task(name)) };
        let (id, robot, state) = (record.id, record.robot.clone(), record.state);
        if state.is_final() || self.index_of(id).is_none() {
            let hint = format!("`shoal task show {id}` shows what became of it");
            return Err(refused(&format!("task {id} is {} already", state.word()), Some(&hint)));
        }
        if state == TaskState::Queued {
            let hint = "try again when the world has answered; `shoal ps` shows whether it runs";
            return Err(refused(&format!("task {id} is not confirmed yet"), Some(hint)));
        }
        if self.waiting.iter().any(|waiting| waiting.ticket == Ticket::Cancel(id)) {
            let hint = format!("`shoal task show {id}` shows what has become of it");
            return Err(refused(&format!("task {id} is being cancelled already"), Some(&hint)));
        }
        self.order_cancel(id);
        Ok((Ticket::Cancel(id), robot))
    }

    /// The robot that has a task is to drop it.
    pub(super) fn order_cancel(&mut self, id: TaskId) {
        if let Some(index) = self.index_of(id) {
            self.actions.push(Action::Order(Order::Cancel { id, index }));
        }
    }

    /// The slot of the robot that has a task.
    fn index_of(&self, id: TaskId) -> Option<RobotIndex> {
        let record = self.tasks.records.get(&id)?;
        self.scenario.robots.iter().position(|robot| robot.id == record.robot).map(RobotIndex::of)
    }

    /// What the sender of a cancellation is told.
    pub(super) fn cancelled(&self, id: TaskId) -> Reply {
        match self.tasks.records.get(&id) {
            // It came to another end before a world that was replaced had heard of it.
            Some(record) if record.state != TaskState::Cancelled && record.state.is_final() => {
                refused(&format!("task {id} is {} already", record.state.word()), None).into()
            }
            record => Reply::Tasks(record.cloned().into_iter().collect()),
        }
    }
}

#[cfg(test)]
mod tests;
