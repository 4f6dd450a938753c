//! A robot that drives to and fro, and how long its plans take.

use super::{Measured, Target, target};
use bus::clock;
use nalgebra::{Point2, Vector2};
use planners::random::Stream;
use planners::{Capsule, Drive, Identity, Kind, Limits, Method, Neighbor, Obstacle, PlanInput, Planner};

const DT_S: f64 = 0.05;
/// Half the side of the square, m.
const HALF_M: f64 = 9.0;
/// Who has not arrived after so many ticks gets its next goal all the same.
const TICKS_PER_GOAL_MAX: u32 = 1000;
const LIMITS: Limits = Limits {
    speed_mps_max: 1.0,
    reverse_mps_max: 0.0,
    turn_radps_max: 2.0,
    accel_mps2_max: f64::INFINITY,
    turn_accel_radps2_max: f64::INFINITY,
};

/// A method at work in one world.
pub(super) struct Cell {
    method: &'static Method,
    planner: Box<dyn Planner>,
    kind: Kind,
    obstacles: Vec<Obstacle>,
    neighbors: Vec<Neighbor>,
    /// Where the neighbours are, seen from the robot, and how they go round it, rad/s.
    places: Vec<(f64, f64, f64)>,
    position: Point2<f64>,
    yaw_rad: f64,
    velocity: Vector2<f64>,
    goal: Point2<f64>,
    since_goal: u32,
    tick: u64,
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
        let identity = Identity { seed: 1, robot: 0, incarnation: 0 };
        let planner = (method.build)(&planners::ParamValues::new(), identity);
        let planner = planner.unwrap_or_else(|problem| panic!("{}: defaults fit: {problem}", method.name));
        let mut random = Stream::new(1, obstacles as u32, 0, "bench-obstacles");
        let corners = [[-1.0, -1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, 1.0]].map(|[x, y]| Point2::new(x, y) * HALF_M);
        let mut discs: Vec<Point2<f64>> = Vec::new();
        while discs.len() < obstacles {
            let at = Point2::new(random.between(-HALF_M, HALF_M), random.between(-HALF_M, HALF_M));
            let free = |other: &Point2<f64>, room: f64| (at - other).norm() > room;
            if corners.iter().all(|corner| free(corner, 2.0)) && discs.iter().all(|disc| free(disc, 1.2)) {
                discs.push(at);
            }
        }
        let obstacle = |(center, id): (Point2<f64>, u32)| Obstacle {
            id,
            shape: Capsule::disc(center, 0.15),
            velocity: Vector2::zeros(),
        };
        let mut random = Stream::new(1, neighbors as u32, 0, "bench-neighbours");
        let places = (0..neighbors)
            .map(|_| (random.between(1.0, 5.0), random.between(0.0, std::f64::consts::TAU), random.between(-0.3, 0.3)))
            .collect();
        Cell {
            method,
            planner,
            kind: method.kinds[0],
            obstacles: discs.into_iter().zip(0..).map(obstacle).collect(),
            neighbors: Vec::with_capacity(neighbors),
            places,
            position: corners[0],
            yaw_rad: std::f64::consts::FRAC_PI_4,
            velocity: Vector2::zeros(),
            goal: corners[1],
            since_goal: 0,
            tick: 0,
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
        self.gather_neighbors();
        let input = PlanInput {
            tick: self.tick,
            dt_s: DT_S,
            position: self.position,
            yaw_rad: self.yaw_rad,
            velocity: self.velocity,
            radius_m: 0.2,
            kind: self.kind,
            limits: LIMITS,
            goal: self.goal,
            goal_tolerance_m: 0.2,
            arrived: false,
            obstacles: &self.obstacles,
            neighbors: &self.neighbors,
            map: &self.obstacles,
            arm: None,
        };
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
        self.drive(plan.drive.within(&LIMITS));
    }

    fn gather_neighbors(&mut self) {
        let time_s = self.tick as f64 * DT_S;
        self.neighbors.clear();
        self.neighbors.extend(self.places.iter().zip(1..).map(|(&(distance, angle, turn), id)| {
            let (sin, cos) = (angle + turn * time_s).sin_cos();
            let along = Vector2::new(-sin, cos) * (distance * turn);
            Neighbor {
                id,
                position: self.position + Vector2::new(cos, sin) * distance,
                yaw_rad: along.y.atan2(along.x),
                velocity: self.velocity + along,
                radius_m: 0.2,
                age_s: DT_S,
                remaining_m: 5.0 + distance,
                arrived: id % 8 == 0,
                stopped: false,
            }
        }));
    }

    fn drive(&mut self, drive: Drive) {
        match drive {
            Drive::Velocity(velocity) => self.velocity = velocity,
            Drive::Twist { speed_mps, turn_radps } => {
                self.yaw_rad += turn_radps * DT_S;
                self.velocity = Vector2::new(self.yaw_rad.cos(), self.yaw_rad.sin()) * speed_mps;
            }
            Drive::Joints { .. } => {}
        }
        self.position += self.velocity * DT_S;
        self.tick += 1;
        self.since_goal += 1;
        if (self.goal - self.position).norm() < 0.2 || self.since_goal >= TICKS_PER_GOAL_MAX {
            // From corner to corner: across, along, across, along.
            self.goal = Point2::new(self.goal.y, -self.goal.x);
            self.since_goal = 0;
        }
    }

    pub(super) fn measured(&self) -> Option<Measured> {
        let mut sorted = self.took_ns.clone();
        sorted.sort_unstable();
        let us = |ns: u64| ns as f64 * 1e-3;
        let at = |share: f64| Some(us(*sorted.get(((sorted.len().checked_sub(1)?) as f64 * share).round() as usize)?));
        Some(Measured {
            planner: self.method.name,
            neighbors: self.neighbors.len(),
            obstacles: self.obstacles.len(),
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
            let start = cell.position;
            (0..30).for_each(|_| cell.plan(0, true));
            assert!(cell.position.x.is_finite() && (cell.position - start).norm() > 0.1, "{}", method.name);
            assert_eq!(cell.measured().map(|measured| measured.plans), Some(30));
        }
    }
}
