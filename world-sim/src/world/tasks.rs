//! Tasks: robots are given them, and have them no more when they are cancelled, too late, or the robot is gone.

use super::{UNKNOWN, World};
use crate::referee::Referee;
use model::{EventKind, GoalSource, PlanState, RobotIndex, Task, TaskEnd, TaskId, TaskStep};

/// Why a task is refused: the robot has as many goals as it can keep.
pub const TOO_MANY_GOALS: &str = "too many goals are waiting";
/// Why a task is refused: the robot left, was dropped, or is dead for good.
pub const ROBOT_GONE: &str = "the robot is gone";
/// Why a task is not cancelled: the robot has done it, or has dropped it, or never had it.
pub const NOT_ITS_TASK: &str = "the robot does not have this task";

impl World {
    pub(super) fn task(&mut self, index: RobotIndex, task: Task, source: GoalSource) -> Result<(), &'static str> {
        let left = self.referees.get(index.at()).and_then(Option::as_ref).map_or(0, Referee::goals_left);
        let result = self.try_task(index.at(), &task, source);
        let kind = match result {
            Ok(()) => EventKind::Task { source, task, given_up: if task.now && left > 1 { left } else { 0 } },
            Err(problem) => EventKind::Ignored { order: source.to_string(), why: problem.to_owned() },
        };
        self.journal.note(self.tick, index, kind);
        result
    }

    /// Whether a robot has this task, or had it a short time ago.
    pub(super) fn knows_task(&self, id: TaskId) -> bool {
        let has = |referee: &Referee| referee.tasks().any(|(known, _)| known == id);
        // One whose robot is gone, or cannot reach it, is for another robot.
        let ended = |(known, step): &(TaskId, TaskStep)| {
            *known == id && !matches!(step, TaskStep::Dropped(why) if why.is_for_another())
        };
        self.referees.iter().flatten().any(has) || self.journal.ended.iter().any(ended)
    }

    fn try_task(&mut self, slot: usize, task: &Task, source: GoalSource) -> Result<(), &'static str> {
        let Some(referee) = self.referees.get_mut(slot).and_then(Option::as_mut) else {
            return Err(UNKNOWN);
        };
        if self.presences[slot].gone().is_some() {
            return Err(ROBOT_GONE);
        }
        if !(task.goal.coords.iter().all(|x| x.is_finite()) && task.yaw_rad.is_none_or(f64::is_finite)) {
            return Err("the goal is nowhere");
        }
        if !task.deadline_s.is_none_or(|deadline_s| deadline_s > 0.0 && deadline_s.is_finite()) {
            return Err("the deadline is not a time above 0");
        }
        let at = self.bodies[slot].pose.position;
        if !referee.task(task, source, self.tick, at, &mut self.journal) {
            return Err(TOO_MANY_GOALS);
        }
        if let GoalSource::Operator(id) = source {
            // Another robot had it before.
            self.journal.ended.retain(|(known, _)| *known != id);
        }
        Ok(())
    }

    pub(super) fn cancel(&mut self, index: RobotIndex, id: TaskId) -> Result<(), &'static str> {
        let source = GoalSource::Operator(id);
        let referee = self.referees.get_mut(index.at()).and_then(Option::as_mut);
        let at = self.bodies.get(index.at()).map(|body| body.pose.position);
        let (Some(referee), Some(at)) = (referee, at) else { return Err(UNKNOWN) };
        let is_meant = |goal: GoalSource, _| (goal == source).then_some(TaskEnd::Cancelled);
        if referee.drop_tasks(&is_meant, self.tick, at, &mut self.journal) { Ok(()) } else { Err(NOT_ITS_TASK) }
    }

    /// The tasks of a robot that goes are dropped.
    pub(super) fn orphan(&mut self, slot: usize) {
        if let Some(referee) = self.referees[slot].as_mut().filter(|referee| referee.has_tasks()) {
            let here = self.bodies[slot].pose.position;
            referee.drop_tasks(&|_, _| Some(TaskEnd::RobotGone), self.tick, here, &mut self.journal);
        }
    }

    /// A robot that cannot reach the task of an operator for which it heads drops it, and goes on with the next one.
    pub(super) fn give_up_tasks(&mut self) {
        for index in std::mem::take(&mut self.stuck) {
            let slot = index.at();
            let Some(referee) = self.referees.get_mut(slot).and_then(Option::as_mut) else { continue };
            let Some(source) = referee.active_task().map(GoalSource::Operator) else { continue };
            let why = |goal: GoalSource, _| (goal == source).then_some(TaskEnd::Unreachable);
            referee.drop_tasks(&why, self.tick, self.bodies[slot].pose.position, &mut self.journal);
            // What the planner says of the next goal is news.
            self.plans[slot] = PlanState::Ready;
        }
    }

    /// Robots that are gone for good have no tasks any more, and no robot has one that is not done by its deadline.
    pub(super) fn drop_tasks(&mut self) {
        for (slot, referee) in self.referees.iter_mut().enumerate() {
            let Some(referee) = referee else { continue };
            let gone = self.presences[slot].gone().is_some();
            if gone && referee.has_tasks() || referee.deadline() <= self.tick {
                let tick = self.tick;
                let why = |_, deadline: u64| match deadline <= tick {
                    _ if gone => Some(TaskEnd::RobotGone),
                    true => Some(TaskEnd::Overdue),
                    false => None,
                };
                referee.drop_tasks(&why, tick, self.bodies[slot].pose.position, &mut self.journal);
            }
        }
        self.tasks_end = self.referees.iter().flatten().map(Referee::deadline).min().unwrap_or(u64::MAX);
    }
}
