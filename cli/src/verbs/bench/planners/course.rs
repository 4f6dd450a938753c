//! What a robot meets while its plans are timed: to and fro between the corners of a square of obstacles, with neighbours
//! that keep around it.

use geometry::Capsule;
use model::random::Stream;
use model::{BodyKind, Drive, Limits, ParamValues};
use nalgebra::{Point2, Vector2};
use planners::{Identity, Method, Neighbor, Obstacle, PlanInput, Planner};
use std::rc::Rc;

const DT_S: f64 = 0.05;
/// Half the side of the square, m.
const HALF_M: f64 = 9.0;
const RADIUS_M: f64 = 0.2;
/// Who has not arrived after so many ticks gets its next goal all the same.
const TICKS_PER_GOAL_MAX: u32 = 1000;
const LIMITS: Limits = Limits {
    speed_mps_max: 1.0,
    reverse_mps_max: 0.0,
    turning_radius_m_min: 0.0,
    turn_radps_max: 2.0,
    accel_mps2_max: f64::INFINITY,
    turn_accel_radps2_max: f64::INFINITY,
};

/// A robot on its course at one tick.
#[derive(Clone)]
pub struct Course {
    kind: BodyKind,
    obstacles: Rc<[Obstacle]>,
    neighbors: Vec<Neighbor>,
    /// Where the neighbours are, seen from the robot, and how they go round it, rad/s.
    places: Rc<[(f64, f64, f64)]>,
    position: Point2<f64>,
    yaw_rad: f64,
    velocity: Vector2<f64>,
    turn_radps: f64,
    goal: Point2<f64>,
    since_goal: u32,
    tick: u64,
}

impl Course {
    /// The beginning of it, for a body of this kind: the same for the same numbers.
    pub fn new(kind: BodyKind, neighbors: usize, obstacles: usize) -> Course {
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
        let mut place =
            || (random.between(1.0, 5.0), random.between(0.0, std::f64::consts::TAU), random.between(-0.3, 0.3));
        let mut course = Course {
            kind,
            obstacles: discs.into_iter().zip(0..).map(obstacle).collect(),
            neighbors: Vec::with_capacity(neighbors),
            places: (0..neighbors).map(|_| place()).collect(),
            position: corners[0],
            yaw_rad: std::f64::consts::FRAC_PI_4,
            velocity: Vector2::zeros(),
            turn_radps: 0.0,
            goal: corners[1],
            since_goal: 0,
            tick: 0,
        };
        course.gather_neighbors();
        course
    }

    /// What its method is given.
    pub fn input(&self) -> PlanInput<'_> {
        PlanInput {
            tick: self.tick,
            dt_s: DT_S,
            position: self.position,
            yaw_rad: self.yaw_rad,
            velocity: self.velocity,
            turn_radps: self.turn_radps,
            radius_m: RADIUS_M,
            kind: self.kind,
            limits: LIMITS,
            goal: self.goal,
            goal_tolerance_m: RADIUS_M,
            goal_yaw_rad: None,
            goal_yaw_tolerance_rad: 0.1,
            arrived: false,
            obstacles: &self.obstacles,
            neighbors: &self.neighbors,
            map: &self.obstacles,
            walls: None,
            arm: None,
            wheels: None,
            allowed: &[],
        }
    }

    /// Drives like this for a tick, within its limits.
    pub fn drive(&mut self, drive: Drive) {
        match drive.within(&LIMITS) {
            Drive::Velocity(velocity) => self.velocity = velocity,
            Drive::Twist { speed_mps, turn_radps } => {
                self.yaw_rad += turn_radps * DT_S;
                self.turn_radps = turn_radps;
                self.velocity = Vector2::new(self.yaw_rad.cos(), self.yaw_rad.sin()) * speed_mps;
            }
            Drive::Joints { .. } | Drive::Wheels { .. } => {}
        }
        self.position += self.velocity * DT_S;
        self.tick += 1;
        self.since_goal += 1;
        if (self.goal - self.position).norm() < RADIUS_M || self.since_goal >= TICKS_PER_GOAL_MAX {
            // From corner to corner: across, along, across, along.
            self.goal = Point2::new(self.goal.y, -self.goal.x);
            self.since_goal = 0;
        }
        self.gather_neighbors();
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
                radius_m: RADIUS_M,
                age_s: DT_S,
                remaining_m: 5.0 + distance,
                arrived: id % 8 == 0,
                stopped: false,
                next: None,
                intent: None,
            }
        }));
    }
}

/// A method with its defaults.
///
/// # Panics
/// When it refuses them: they are its own.
pub fn with_defaults(method: &Method) -> Box<dyn Planner> {
    let identity = Identity { seed: 1, robot: 0, incarnation: 0 };
    let planner = (method.build)(&ParamValues::new(), identity);
    planner.unwrap_or_else(|problem| panic!("{}: defaults fit: {problem}", method.name))
}
