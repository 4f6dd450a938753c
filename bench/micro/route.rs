//! A course that has been driven once, by the method that is to be measured, so that a bench only has to look it up.

use planners::{METHODS, Method, PlanInput};
use shoal::verbs::bench::planners::course::{Course, with_defaults};
use std::fmt;

/// Ticks before those that are measured: a method that plans ahead has its plan by then.
pub(crate) const WARM_UP: usize = 200;
/// Ticks that are measured.
pub(crate) const MEASURED: usize = 1024;
const NEIGHBORS: [usize; 3] = [0, 4, 16];
const OBSTACLES: [usize; 2] = [0, 20];

/// A method, and how much there is around its robot.
#[derive(Clone, Copy)]
pub(crate) struct Cell {
    pub(crate) method: &'static Method,
    neighbors: usize,
    obstacles: usize,
}

impl Cell {
    /// Every cell of these methods.
    pub(crate) fn all(wanted: fn(&Method) -> bool) -> impl Iterator<Item = Cell> {
        let methods = METHODS.iter().copied().filter(move |method| wanted(method));
        methods.flat_map(|method| {
            OBSTACLES.into_iter().flat_map(move |obstacles| {
                NEIGHBORS.into_iter().map(move |neighbors| Cell { method, neighbors, obstacles })
            })
        })
    }
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}+{}", self.method.name, self.neighbors, self.obstacles)
    }
}

/// The course, tick by tick.
pub(crate) struct Route(Vec<Course>);

impl Route {
    /// Drives it.
    pub(crate) fn new(cell: &Cell) -> Route {
        let mut planner = with_defaults(cell.method);
        let mut course = Course::new(cell.method.kinds[0], cell.neighbors, cell.obstacles);
        let mut tick = || {
            let now = course.clone();
            course.drive(planner.plan(&now.input()).drive);
            now
        };
        Route((0..WARM_UP + MEASURED).map(|_| tick()).collect())
    }

    /// What a method is given in a tick of it.
    pub(crate) fn input(&self, tick: usize) -> PlanInput<'_> {
        self.0[tick].input()
    }
}
