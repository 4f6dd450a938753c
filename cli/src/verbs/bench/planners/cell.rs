//! How long the plans of a method take on a course.

use super::course::{Course, with_defaults};
use super::{Measured, Target, target};
use bus::clock;
use planners::{Method, Planner};

/// A method at work in one world.
pub(super) struct Cell {
    method: &'static Method,
    planner: Box<dyn Planner>,
    course: Course,
    /// Of the plans that count.
    took_ns: Vec<u64>,
    first_ns: Option<u64>,
    max_ns: u64,
    /// Where the target is about processor time.
    cpu_max_ns: Option<u64>,
    used_ns: u64,
}

impl Cell {
    pub(super) fn new(method: &'static Method, neighbors: usize, obstacles: usize) -> Cell {
        Cell {
            method,
            planner: with_defaults(method),
            course: Course::new(method.kinds[0], neighbors, obstacles),
            took_ns: Vec::new(),
            first_ns: None,
            max_ns: 0,
            cpu_max_ns: matches!(target(method.name), Target::SliceUs(_)).then_some(0),
            used_ns: 0,
        }
    }

    /// Time spent in plans, s.
    pub(super) fn used_s(&self) -> f64 {
        self.used_ns as f64 * 1e-9
    }

    /// Plans a tick, and drives.
    pub(super) fn plan(&mut self, clock_ns: u64, counted: bool) {
        let input = self.course.input();
        let cpu_before_ns = self.cpu_max_ns.map(|_| cpu_ns());
        let before = clock::now_ns();
        let plan = std::hint::black_box(self.planner.plan(std::hint::black_box(&input)));
        let took_ns = (clock::now_ns() - before).saturating_sub(clock_ns);
        if let (Some(max_ns), Some(before_ns)) = (&mut self.cpu_max_ns, cpu_before_ns) {
            *max_ns = (*max_ns).max(cpu_ns() - before_ns);
        }
        if counted {
            self.took_ns.push(took_ns);
        }
        self.first_ns.get_or_insert(took_ns);
        self.max_ns = self.max_ns.max(took_ns);
        self.used_ns += took_ns;
        self.course.drive(plan.drive);
    }

    pub(super) fn measured(&self) -> Option<Measured> {
        let mut sorted = self.took_ns.clone();
        sorted.sort_unstable();
        let us = |ns: u64| ns as f64 * 1e-3;
        let at = |share: f64| Some(us(*sorted.get(((sorted.len().checked_sub(1)?) as f64 * share).round() as usize)?));
        let input = self.course.input();
        Some(Measured {
            planner: self.method.name,
            neighbors: input.neighbors.len(),
            obstacles: input.obstacles.len(),
            plans: sorted.len(),
            p50_us: at(0.5)?,
            p99_us: at(0.99)?,
            max_us: us(self.max_ns),
            cpu_max_us: self.cpu_max_ns.map(us),
            first_us: us(self.first_ns?),
        })
    }
}

/// Time of the processor that this thread has used, ns.
fn cpu_ns() -> u64 {
    let used = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    used.tv_sec.unsigned_abs() * 1_000_000_000 + used.tv_nsec.unsigned_abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use planners::METHODS;

    #[test]
    fn every_method_drives_in_every_cell() {
        for method in METHODS {
            let mut cell = Cell::new(method, 4, 10);
            let start = cell.course.input().position;
            (0..30).for_each(|_| cell.plan(0, true));
            let end = cell.course.input().position;
            assert!(end.x.is_finite() && (end - start).norm() > 0.1, "{}", method.name);
            assert_eq!(cell.measured().map(|measured| measured.plans), Some(30));
        }
    }
}
