//! The offline variant: runs from the start until one arrives. A search can be done in slices.

use super::field::{Field, Law};
use crate::planner::Obstacle;
use nalgebra::Point2;

/// K_v is divided by these, one after the other, as long as the search fails: 60, 10, 1.
const FALLBACK_DIVISORS: [f64; 3] = [1.0, 6.0, 60.0];

/// When a search gives up. Counted anew for every K_v that is tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Virtual obstacles.
    pub virtual_max: usize,
    /// Rounds.
    pub rounds_max: usize,
    /// How many smaller K_v are tried, up to 2.
    pub fallbacks: usize,
}

/// How far a search is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// There is more to do.
    Thinking,
    /// [`Search::path`] leads to the goal.
    Found,
    /// The budget is used up; the path is the last run's.
    Failed,
}

/// A search, its path and its counts.
#[derive(Clone, Debug)]
pub struct Search {
    budget: Budget,
    progress: Progress,
    goal: Point2<f64>,
    path: Vec<Point2<f64>>,
    virtual_obstacles: Vec<Point2<f64>>,
    failed_runs: Vec<usize>,
    rounds: usize,
    rounds_of_all: usize,
    fallback: usize,
}

impl Search {
    /// Room for a search; [`Search::begin`] starts one. Nothing is allocated later.
    pub fn new(budget: Budget) -> Search {
        Search {
            budget,
            progress: Progress::Failed,
            goal: Point2::origin(),
            path: Vec::with_capacity(budget.rounds_max + 2),
            virtual_obstacles: Vec::with_capacity(budget.virtual_max + 1),
            failed_runs: Vec::with_capacity(budget.virtual_max + 1),
            rounds: 0,
            rounds_of_all: 0,
            fallback: 0,
        }
    }

    /// Starts anew.
    pub fn begin(&mut self, start: Point2<f64>, goal: Point2<f64>) {
        self.progress = Progress::Thinking;
        self.goal = goal;
        self.fallback = 0;
        self.rounds_of_all = 0;
        self.restart(start);
    }

    fn restart(&mut self, start: Point2<f64>) {
        self.path.clear();
        self.path.push(start);
        self.virtual_obstacles.clear();
        self.failed_runs.clear();
        self.rounds = 0;
    }

    /// Goes on for up to so many rounds, each of A_nsd + 1 evaluations.
    pub fn advance(&mut self, law: &Law, agent_radius_m: f64, obstacles: &[Obstacle], rounds_max: usize) -> Progress {
        for _ in 0..rounds_max {
            if self.progress != Progress::Thinking {
                break;
            }
            self.round(law, agent_radius_m, obstacles);
        }
        // The last round may have been the last step: that the goal is reached costs nothing to see.
        if self.progress == Progress::Thinking && self.at_goal(law) {
            self.progress = Progress::Found;
        }
        self.progress
    }

    fn round(&mut self, law: &Law, agent_radius_m: f64, obstacles: &[Obstacle]) {
        let (start, q) = (self.path[0], self.path[self.path.len() - 1]);
        if self.at_goal(law) {
            self.progress = Progress::Found;
            return;
        }
        self.rounds += 1;
        self.rounds_of_all += 1;
        let virtual_obstacles = &self.virtual_obstacles;
        let k_v = law.k_v / FALLBACK_DIVISORS[self.fallback];
        let field = Field { law, k_v, agent_radius_m, goal: self.goal, obstacles, virtual_obstacles };
        if let Some(lower) = field.descend(q) {
            self.path.push(lower);
        } else if self.virtual_obstacles.len() < self.budget.virtual_max {
            // (13): a drop stays behind, and the next run starts where the robot is.
            self.virtual_obstacles.push(q);
            self.failed_runs.push(self.path.len() - 1);
            self.path.truncate(1);
        } else {
            self.fail(start);
            return;
        }
        if self.rounds >= self.budget.rounds_max && !self.at_goal(law) {
            self.fail(start);
        }
    }

    /// Tries the next smaller K_v, or gives up.
    fn fail(&mut self, start: Point2<f64>) {
        if self.fallback < self.budget.fallbacks.min(FALLBACK_DIVISORS.len() - 1) {
            self.fallback += 1;
            self.restart(start);
        } else {
            self.progress = Progress::Failed;
        }
    }

    fn at_goal(&self, law: &Law) -> bool {
        (self.path[self.path.len() - 1] - self.goal).norm() <= law.tolerance_m()
    }

    /// How far it is.
    pub fn progress(&self) -> Progress {
        self.progress
    }

    /// The goal of the search, m.
    pub fn goal(&self) -> Point2<f64> {
        self.goal
    }

    /// The present run, from the start, m. Its motion steps are one fewer than its points.
    pub fn path(&self) -> &[Point2<f64>] {
        &self.path
    }

    /// The virtual obstacles, in the order in which they were put up, m.
    pub fn virtual_obstacles(&self) -> &[Point2<f64>] {
        &self.virtual_obstacles
    }

    /// Steps of the runs that ended in those virtual obstacles.
    pub fn failed_runs(&self) -> &[usize] {
        &self.failed_runs
    }

    /// Rounds so far, with the present K_v.
    pub fn rounds(&self) -> usize {
        self.rounds
    }

    /// Rounds so far, with every K_v that was tried.
    pub fn rounds_of_all(&self) -> usize {
        self.rounds_of_all
    }

    /// By what K_v is divided at present: 1, unless the search fell back.
    pub fn k_v_divisor(&self) -> f64 {
        FALLBACK_DIVISORS[self.fallback]
    }
}
