//! The referee of one robot: its goals, when it reached them, and how it drove there.

use crate::journal::Journal;
use crate::progress::{Scale, Trail};
use geometry::Smoothness;
use model::random::Stream;
use model::{EventKind, GoalSource, MAX_GOALS, Mover, Robot, RobotIndex, Stall, Task, TaskEnd, TaskId, TaskStep};
use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Goal {
    at: Point2<f64>,
    /// The heading to have there, rad; `None` is any.
    yaw_rad: Option<f64>,
    source: GoalSource,
    /// Carried by the goal motion of the robot.
    moves: bool,
    priority: i32,
    /// From this tick on it is dropped.
    deadline: u64,
}

impl Goal {
    /// A goal that is there for as long as it takes, with the usual priority.
    fn at(at: Point2<f64>, source: GoalSource) -> Goal {
        Goal { at, yaw_rad: None, source, moves: false, priority: 0, deadline: u64::MAX }
    }

    fn is_task(&self) -> bool {
        self.source != GoalSource::Scenario
    }

    fn is_of_operator(&self) -> bool {
        matches!(self.source, GoalSource::Operator(_))
    }
}

/// At the last goal. A robot that gets out of its tolerance again is not there any more.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Arrival {
    pub(crate) tick: u64,
    /// Driven until then, m.
    pub(crate) path_m: f64,
    /// Driven until the edge of the tolerance, between the ticks, m.
    pub(crate) path_to_edge_m: f64,
    pub(crate) ldj: Option<f64>,
    pub(crate) reversals: u32,
}

/// What one robot has to do, and how it does.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct Referee {
    index: RobotIndex,
    tolerance_m: f64,
    yaw_tolerance_rad: f64,
    /// Where the body faces, rad.
    yaw_rad: f64,
    /// The goals of another round, and how often it goes through them; `None` is forever.
    round: Vec<Goal>,
    rounds: Option<u32>,
    pub(crate) rounds_done: u32,
    dt_s: f64,
    current: Goal,
    waiting: VecDeque<Goal>,
    #[serde(skip)]
    mover: Option<Mover>,
    /// It is at its last goal: since when. A task takes that back, and so does leaving the tolerance.
    pub(crate) arrival: Option<Arrival>,
    /// The present goal is the last one and has been counted: reached again, it is not counted again.
    counted: bool,
    pub(crate) goals_done: u32,
    pub(crate) tasks_done: u32,
    /// No goal that it has is dropped before this tick.
    deadline: u64,
    /// It was given a task, so its path compares with no plan of the scenario.
    pub(crate) tasked: bool,
    /// It was in an obstacle that stands, so its path was not a free one.
    pub(crate) trespassed: bool,
    /// Driven so far, m.
    pub(crate) path_m: f64,
    smoothness: Smoothness,
    trail: Trail,
    /// The place that it has not left, and since which tick.
    stays: Option<(Point2<f64>, u64)>,
}

impl Referee {
    /// Of a robot that has not moved yet.
    pub(crate) fn new(slot: usize, robot: &Robot, seed: u64, dt_s: f64) -> Referee {
        let goal = |at: &Point2<f64>| Goal::at(*at, GoalSource::Scenario);
        let mut waiting: VecDeque<Goal> = robot.goals.iter().map(goal).collect();
        if let Some(last) = waiting.back_mut() {
            last.yaw_rad = robot.goal_yaw_rad;
        }
        let round = if robot.rounds == Some(1) { Vec::new() } else { waiting.iter().copied().collect() };
        // Rounds begin while the robot runs: no memory is taken then.
        waiting.reserve(MAX_GOALS + round.len());
        let mover = match (waiting.back_mut(), &robot.goal_motion) {
            (Some(last), Some(motion)) => {
                last.moves = true;
                Some(Mover::new(motion, last.at, || Stream::new(seed, slot as u32, 0, "goal-walk")))
            }
            _ => None,
        };
        // A robot without a goal would be at it.
        let current = waiting.pop_front().unwrap_or_else(|| goal(&robot.start));
        Referee {
            index: RobotIndex::of(slot),
            tolerance_m: robot.goal_tolerance_m,
            yaw_tolerance_rad: robot.goal_yaw_tolerance_rad,
            yaw_rad: robot.start_yaw_rad,
            round,
            rounds: robot.rounds,
            rounds_done: 0,
            dt_s,
            current,
            waiting,
            mover,
            arrival: None,
            counted: false,
            goals_done: 0,
            tasks_done: 0,
            deadline: u64::MAX,
            tasked: false,
            trespassed: false,
            path_m: 0.0,
            smoothness: Smoothness::default(),
            trail: Trail::new(dt_s, robot.radius_m),
            stays: None,
        }
    }

    /// Where it is to go now; when it has arrived, where that was. m.
    pub(crate) fn goal(&self) -> Point2<f64> {
        self.current.at
    }

    /// The heading to have there, rad; `None` is any.
    pub(crate) fn goal_yaw_rad(&self) -> Option<f64> {
        self.current.yaw_rad
    }

    /// The body faces there now, rad.
    pub(crate) fn faces(&mut self, yaw_rad: f64) {
        self.yaw_rad = yaw_rad;
    }

    /// Whether the body looks as the present goal wants it to.
    fn looks_right(&self) -> bool {
        let off = |wanted: f64| geometry::wrap(wanted - self.yaw_rad).abs();
        self.current.yaw_rad.is_none_or(|wanted| off(wanted) <= self.yaw_tolerance_rad)
    }

    /// There is no goal after the present one.
    fn is_last(&self) -> bool {
        let last_round = self.rounds.is_some_and(|rounds| self.rounds_done + 1 >= rounds);
        self.waiting.is_empty() && (self.counted || self.round.is_empty() || last_round)
    }

    /// The first goal of another round, if there is to be one; the others wait.
    fn next_round(&mut self) -> Option<Goal> {
        self.rounds_done += u32::from(!self.tasked || !self.round.is_empty());
        if self.round.is_empty() || self.rounds.is_some_and(|rounds| self.rounds_done >= rounds) {
            return None;
        }
        self.waiting.extend(&self.round);
        self.waiting.pop_front()
    }

    /// Goals left, the present one included.
    pub(crate) fn goals_left(&self) -> u32 {
        if self.arrival.is_some() { 0 } else { 1 + self.waiting.len() as u32 }
    }

    /// For how many ticks the robot, which takes part, has stayed near the place where it is (m), while it heads for the task
    /// of an operator. Near is within the size of its body or of the tolerance of its goal, whatever it does there.
    pub(crate) fn stays(&mut self, tick: u64, position: Point2<f64>, radius_m: f64) -> u64 {
        if self.counted || !self.current.is_of_operator() {
            self.stays = None;
            return 0;
        }
        let near_m = 2.0 * radius_m.max(self.tolerance_m);
        let stayed = self.stays.filter(|(at, _)| (position - at).norm() <= near_m);
        tick - self.stays.insert(stayed.unwrap_or((position, tick))).1
    }

    /// The robot does not take part, so that it cannot get on.
    pub(crate) fn rests(&mut self) {
        self.stays = None;
    }

    /// The task of an operator that it heads for.
    pub(crate) fn active_task(&self) -> Option<TaskId> {
        self.tasks().find_map(|(id, active)| active.then_some(id))
    }

    /// A new goal for the robot, which is `here` (m). False if as many as there may be are waiting.
    pub(crate) fn task(
        &mut self,
        task: &Task,
        source: GoalSource,
        tick: u64,
        here: Point2<f64>,
        journal: &mut Journal,
    ) -> bool {
        let ticks = task.deadline_s.map_or(u64::MAX, |deadline_s| (deadline_s / self.dt_s).ceil() as u64);
        let (yaw_rad, priority, deadline) = (task.yaw_rad, task.priority, tick.saturating_add(ticks));
        let goal = Goal { yaw_rad, priority, deadline, ..Goal::at(task.goal, source) };
        if task.now {
            self.drop_tasks(&|_, _| Some(TaskEnd::Replaced), tick, here, journal);
            self.waiting.clear();
            self.round.clear();
            self.begin(goal, journal);
        } else if self.counted {
            self.begin(goal, journal);
        } else if self.waiting.len() < MAX_GOALS {
            let before = self.waiting.iter().position(|waiting| waiting.priority < priority);
            self.waiting.insert(before.unwrap_or(self.waiting.len()), goal);
        } else {
            return false;
        }
        (self.arrival, self.counted) = (None, false);
        self.tasked = true;
        if !self.current.moves && !self.waiting.iter().any(|goal| goal.moves) {
            self.mover = None;
        }
        self.deadline = self.deadline.min(deadline);
        true
    }

    /// The robot heads for this goal from now on.
    fn begin(&mut self, goal: Goal, journal: &mut Journal) {
        (self.current, self.stays) = (goal, None);
        journal.task_step(goal.source, TaskStep::Active);
    }

    /// Drops the tasks for which `why` gives a reason; it is told where a task comes from and its deadline (tick). A robot
    /// that has no other goal then stays `here` (m). Whether any was dropped.
    pub(crate) fn drop_tasks(
        &mut self,
        why: &dyn Fn(GoalSource, u64) -> Option<TaskEnd>,
        tick: u64,
        here: Point2<f64>,
        journal: &mut Journal,
    ) -> bool {
        let (index, mut dropped) = (self.index, false);
        let mut drops = |goal: &Goal| {
            let why = why(goal.source, goal.deadline).filter(|_| goal.is_task());
            if let Some(why) = why {
                journal.note(tick, index, EventKind::TaskDropped { source: goal.source, why });
                journal.task_step(goal.source, TaskStep::Dropped(why));
                dropped = true;
            }
            why.is_some()
        };
        self.waiting.retain(|goal| !drops(goal));
        if !self.counted && drops(&self.current) {
            match self.waiting.pop_front().or_else(|| self.next_round()) {
                Some(next) => self.begin(next, journal),
                None => (self.current, self.counted) = (Goal::at(here, GoalSource::Scenario), true),
            }
        }
        let current = Some(&self.current).filter(|_| !self.counted);
        let deadlines = self.waiting.iter().chain(current).map(|goal| goal.deadline);
        self.deadline = deadlines.min().unwrap_or(u64::MAX);
        dropped
    }

    /// The tasks of operators that it has: the number of each, and whether the robot heads for it now.
    pub(crate) fn tasks(&self) -> impl Iterator<Item = (TaskId, bool)> {
        let current = Some((&self.current, true)).filter(|_| !self.counted);
        let goals = current.into_iter().chain(self.waiting.iter().map(|goal| (goal, false)));
        goals.filter_map(|(goal, active)| match goal.source {
            GoalSource::Operator(id) => Some((id, active)),
            GoalSource::Scenario | GoalSource::Timeline => None,
        })
    }

    /// After it has been read from a checkpoint: what is not kept there follows from the scenario.
    pub(crate) fn resume(&mut self, robot: &Robot, seed: u64) {
        if self.current.moves || self.waiting.iter().any(|goal| goal.moves) {
            self.mover = Referee::new(self.index.at(), robot, seed, self.dt_s).mover;
        }
        let room = MAX_GOALS + self.round.len();
        self.waiting.reserve(room.saturating_sub(self.waiting.len()));
    }

    /// The first deadline of its tasks, as a tick; one that is done may be among them.
    pub(crate) fn deadline(&self) -> u64 {
        self.deadline
    }

    /// Whether it has a task that is not done.
    pub(crate) fn has_tasks(&self) -> bool {
        !self.counted && self.current.is_task() || self.waiting.iter().any(Goal::is_task)
    }

    /// Takes the moving goal to where it is at `t_s`.
    pub(crate) fn move_goal(&mut self, t_s: f64) {
        if let Some(mover) = &mut self.mover {
            let (at, _) = mover.at(t_s);
            let goals = std::iter::once(&mut self.current).chain(&mut self.waiting);
            goals.filter(|goal| goal.moves).for_each(|goal| goal.at = at);
        }
    }

    /// A tick of the robot is over in which it took part: it drove so far (m) from one place to the other, and ended at this
    /// velocity (m/s).
    pub(crate) fn drove(&mut self, distance_m: f64, way: [Point2<f64>; 2], velocity: Vector2<f64>) {
        self.path_m += distance_m;
        self.smoothness.push(velocity, self.dt_s);
        self.trail.drove(way);
    }

    /// Time goes on, whether the robot takes part or not.
    pub(crate) fn pass(&mut self, tick: u64, position: Point2<f64>) {
        self.trail.pass(tick, position, self.path_m, self.goals_done);
    }

    /// Which goals it has reached in the tick that ends with `tick`, in which it went straight from one place to the other.
    /// Goals on the way count when the way touches their tolerance, several in one tick if they come in order. At the last
    /// one it has to be when the tick ends, and to stay: it arrives when it comes into the tolerance for good. A goal that
    /// moves has been caught once and for all. Where a heading is asked for, it has to be there at the end of a tick as well.
    pub(crate) fn judge(&mut self, [from, to]: [Point2<f64>; 2], tick: u64, journal: &mut Journal) {
        let away = self.distance_m(to) > self.tolerance_m || !self.looks_right();
        if self.arrival.is_some() && !self.current.moves && away {
            self.arrival = None;
            journal.note_quietly(tick, self.index, || EventKind::OffGoal { distance_m: self.distance_m(to) });
        }
        // How far on its way it is, as a share of it.
        let mut done = 0.0;
        // At most a whole round in a tick: all its goals may lie within the tolerance.
        let mut most = 1 + self.waiting.len() + self.round.len();
        while self.arrival.is_none() && most > 0 {
            most -= 1;
            let there = self.distance_m(to) <= self.tolerance_m && self.looks_right();
            let in_passing = self.current.yaw_rad.is_none() && !self.is_last();
            match touched([from, to], self.current.at, self.tolerance_m, done) {
                Some(share) if there || in_passing => done = share,
                _ if !there => return,
                _ => done = 1.0,
            }
            if !self.counted {
                self.goals_done += 1;
                if self.current.source != GoalSource::Scenario {
                    self.tasks_done += 1;
                    journal.note(tick, self.index, EventKind::TaskDone { source: self.current.source });
                    journal.task_step(self.current.source, TaskStep::Done);
                }
            }
            let next = self.waiting.pop_front().or_else(|| if self.counted { None } else { self.next_round() });
            match next {
                Some(next) => self.begin(next, journal),
                None => {
                    let (path_m, ldj) = (self.path_m, self.smoothness.ldj(self.dt_s));
                    let path_to_edge_m = path_m - (1.0 - done) * (to - from).norm();
                    let reversals = self.trail.reversals();
                    self.arrival = Some(Arrival { tick, path_m, path_to_edge_m, ldj, reversals });
                    if !std::mem::replace(&mut self.counted, true) {
                        journal.note(tick, self.index, EventKind::Arrived);
                    }
                }
            }
        }
    }

    /// From a place to the present goal, or to the last one, m.
    pub(crate) fn distance_m(&self, place: Point2<f64>) -> f64 {
        (self.current.at - place).norm()
    }

    /// The tolerance of its goals, m.
    pub(crate) fn tolerance_m(&self) -> f64 {
        self.tolerance_m
    }

    /// Smoothness until it arrived, or so far.
    pub(crate) fn ldj(&self) -> Option<f64> {
        self.arrival.map_or_else(|| self.smoothness.ldj(self.dt_s), |arrival| arrival.ldj)
    }

    /// How often it reversed its direction of driving until it arrived, or so far.
    pub(crate) fn reversals(&self) -> u32 {
        self.arrival.map_or_else(|| self.trail.reversals(), |arrival| arrival.reversals)
    }

    /// Mean speed over the last 10 s, or since it joined, m/s.
    pub(crate) fn speed_mps(&self, tick: u64) -> Option<f64> {
        self.trail.speed_mps(tick, self.path_m)
    }

    /// Whether it gets nowhere, being here at `tick` and not at its goal; see [`crate::progress`].
    pub(crate) fn stall(
        &self,
        tick: u64,
        position: Point2<f64>,
        scale: Scale,
        remaining_m: &mut dyn FnMut(Point2<f64>) -> f64,
    ) -> Option<Stall> {
        self.trail.stall(tick, position, self.path_m, self.goals_done, scale, remaining_m)
    }
}

/// The first point of a straight way within `radius` of a centre, as a share of the way, not before `done`.
fn touched([from, to]: [Point2<f64>; 2], center: Point2<f64>, radius: f64, done: f64) -> Option<f64> {
    let (way, back) = (to - from, from - center);
    let (a, b, c) = (way.norm_squared(), back.dot(&way), back.norm_squared() - radius * radius);
    let root = (b * b - a * c).sqrt(); // not a number if it misses
    let (enters, leaves) =
        if a > 0.0 { ((-b - root) / a, (-b + root) / a) } else { (0.0, if c <= 0.0 { 1.0 } else { -1.0 }) };
    if enters <= 1.0 && leaves >= done { Some(enters.max(done)) } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_touches_what_it_passes_and_not_what_lies_behind_it() {
        let way = [Point2::new(0.0, 0.0), Point2::new(10.0, 0.0)];
        let touched = |x: f64, y: f64, done: f64| touched(way, Point2::new(x, y), 0.5, done);
        assert_eq!(touched(5.0, 0.0, 0.0), Some(0.45));
        assert_eq!(touched(5.0, 0.0, 0.5), Some(0.5), "still within it");
        assert_eq!(touched(5.0, 0.0, 0.6), None, "passed before");
        assert_eq!(touched(5.0, 0.5, 0.0), Some(0.5));
        assert_eq!(touched(5.0, 0.51, 0.0), None);
        assert_eq!(touched(0.3, 0.0, 0.0), Some(0.0));
        assert_eq!(touched(-0.6, 0.0, 0.0), None);
        assert!(touched(10.4, 0.0, 0.0).is_some_and(|share| (share - 0.99).abs() < 1e-9));
        assert_eq!(touched(10.6, 0.0, 0.0), None);
        let rest = [Point2::new(1.0, 1.0); 2];
        assert_eq!(super::touched(rest, Point2::new(1.0, 1.2), 0.2 + 1e-12, 0.0), Some(0.0));
        assert_eq!(super::touched(rest, Point2::new(1.0, 1.3), 0.2, 0.0), None);
    }
}
