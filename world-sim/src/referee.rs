//! The referee of one robot: its goals, when it reached them, and how it drove there.

use crate::journal::Journal;
use crate::motion::Mover;
use crate::smoothness::Smoothness;
use nalgebra::{Point2, Vector2};
use planners::random::Stream;
use scenarios::{MAX_GOALS, Robot};
use std::collections::VecDeque;

/// Where a goal comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Source {
    /// The robot had it from the start.
    Scenario,
    /// A task of the timeline.
    Timeline,
    /// A task of an operator, by its number.
    Operator(u32),
}

#[derive(Clone, Copy, Debug)]
struct Goal {
    at: Point2<f64>,
    /// The heading to have there, rad; `None` is any.
    yaw_rad: Option<f64>,
    source: Source,
    /// Carried by the goal motion of the robot.
    moves: bool,
}

/// At the last goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Arrival {
    pub(crate) tick: u64,
    /// Driven until then, m.
    pub(crate) path_m: f64,
    pub(crate) ldj: Option<f64>,
}

/// What one robot has to do, and how it does.
pub(crate) struct Referee {
    slot: u32,
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
    mover: Option<Mover>,
    /// It has reached its last goal; a task takes that back.
    pub(crate) arrival: Option<Arrival>,
    pub(crate) goals_done: u32,
    pub(crate) tasks_done: u32,
    /// It was given a task, so its path compares with no plan of the scenario.
    pub(crate) tasked: bool,
    /// Driven so far, m.
    pub(crate) path_m: f64,
    smoothness: Smoothness,
    recent: Recent,
}

impl Referee {
    /// Of a robot that has not moved yet.
    pub(crate) fn new(slot: usize, robot: &Robot, seed: u64, dt_s: f64) -> Referee {
        let goal = |at: &Point2<f64>| Goal { at: *at, yaw_rad: None, source: Source::Scenario, moves: false };
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
            slot: slot as u32,
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
            goals_done: 0,
            tasks_done: 0,
            tasked: false,
            path_m: 0.0,
            smoothness: Smoothness::default(),
            recent: Recent::new(dt_s),
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
        let off = |wanted: f64| planners::drive::wrap(wanted - self.yaw_rad).abs();
        self.current.yaw_rad.is_none_or(|wanted| off(wanted) <= self.yaw_tolerance_rad)
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

    /// A new goal. False if as many as there may be are waiting.
    pub(crate) fn task(&mut self, at: Point2<f64>, yaw_rad: Option<f64>, now: bool, source: Source) -> bool {
        let goal = Goal { at, yaw_rad, source, moves: false };
        if now {
            self.waiting.clear();
            self.round.clear();
            self.current = goal;
        } else if self.arrival.is_some() {
            self.current = goal;
        } else if self.waiting.len() < MAX_GOALS {
            self.waiting.push_back(goal);
        } else {
            return false;
        }
        self.arrival = None;
        self.tasked = true;
        if !self.current.moves && !self.waiting.iter().any(|goal| goal.moves) {
            self.mover = None;
        }
        true
    }

    /// Takes the moving goal to where it is at `t_s`.
    pub(crate) fn move_goal(&mut self, t_s: f64) {
        if let Some(mover) = &mut self.mover {
            let (at, _) = mover.at(t_s);
            let goals = std::iter::once(&mut self.current).chain(&mut self.waiting);
            goals.filter(|goal| goal.moves).for_each(|goal| goal.at = at);
        }
    }

    /// A tick of the robot is over in which it took part: it drove so far (m) and ended at this velocity (m/s).
    pub(crate) fn drove(&mut self, distance_m: f64, velocity: Vector2<f64>) {
        self.path_m += distance_m;
        self.smoothness.push(velocity, self.dt_s);
    }

    /// Time goes on, whether the robot takes part or not.
    pub(crate) fn pass(&mut self, tick: u64) {
        self.recent.push(tick, self.path_m);
    }

    /// Which goals it has reached, being here at `tick`: several may lie within the tolerance.
    pub(crate) fn judge(&mut self, position: Point2<f64>, tick: u64, journal: &mut Journal) {
        // At most a whole round in a tick: all its goals may lie within the tolerance.
        let mut most = 1 + self.waiting.len() + self.round.len();
        while self.arrival.is_none() && (self.current.at - position).norm() <= self.tolerance_m && self.looks_right() {
            if most == 0 {
                return;
            }
            most -= 1;
            self.goals_done += 1;
            if self.current.source != Source::Scenario {
                self.tasks_done += 1;
                journal.note(tick, "task-done", self.slot, self.current.source.to_string());
            }
            match self.waiting.pop_front().or_else(|| self.next_round()) {
                Some(next) => self.current = next,
                None => {
                    let (path_m, ldj) = (self.path_m, self.smoothness.ldj(self.dt_s));
                    self.arrival = Some(Arrival { tick, path_m, ldj });
                    journal.note(tick, "arrived", self.slot, String::new());
                }
            }
        }
    }

    /// Smoothness until it arrived, or so far.
    pub(crate) fn ldj(&self) -> Option<f64> {
        self.arrival.map_or_else(|| self.smoothness.ldj(self.dt_s), |arrival| arrival.ldj)
    }

    /// Mean speed over the last ten seconds before `tick`, m/s, or since it joined if that is less.
    pub(crate) fn recent_speed_mps(&self, tick: u64) -> Option<f64> {
        self.recent.speed_mps(tick, self.path_m, self.dt_s)
    }
}

impl std::fmt::Display for Source {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Source::Scenario => write!(f, "scenario"),
            Source::Timeline => write!(f, "timeline"),
            Source::Operator(task) => write!(f, "task {task}"),
        }
    }
}

/// Path lengths of the last ten seconds, remembered ten times a second.
struct Recent {
    every_ticks: u64,
    capacity: usize,
    marks: VecDeque<(u64, f64)>,
}

impl Recent {
    const WINDOW_S: f64 = 10.0;
    const STEP_S: f64 = 0.1;

    fn new(dt_s: f64) -> Recent {
        let every_ticks = (Recent::STEP_S / dt_s).round().max(1.0);
        let capacity = (Recent::WINDOW_S / (every_ticks * dt_s)).ceil() as usize + 1;
        Recent { every_ticks: every_ticks as u64, capacity, marks: VecDeque::with_capacity(capacity) }
    }

    fn push(&mut self, tick: u64, path_m: f64) {
        if self.marks.is_empty() || tick.is_multiple_of(self.every_ticks) {
            if self.marks.len() == self.capacity {
                self.marks.pop_front();
            }
            self.marks.push_back((tick, path_m));
        }
    }

    fn speed_mps(&self, tick: u64, path_m: f64, dt_s: f64) -> Option<f64> {
        let &(then, path_then_m) = self.marks.front()?;
        (tick > then).then(|| (path_m - path_then_m) / ((tick - then) as f64 * dt_s))
    }
}
