//! What a robot meets on its way: a square with obstacles, neighbours that keep around it. The way is driven once, by the
//! method that is to be measured, so that a bench only has to look it up.

use nalgebra::{Point2, Vector2};
use planners::random::Stream;
use planners::{
    Capsule, Drive, Identity, Kind, Limits, METHODS, Method, Neighbor, Obstacle, ParamValues, PlanInput, Planner,
};
use std::fmt;

/// Ticks before those that are measured: a method that plans ahead has its plan by then.
pub(crate) const WARM_UP: usize = 200;
/// Ticks that are measured.
pub(crate) const MEASURED: usize = 1024;
pub(crate) const NEIGHBORS: [usize; 3] = [0, 4, 16];
pub(crate) const OBSTACLES: [usize; 2] = [0, 20];
pub(crate) const RADIUS_M: f64 = 0.2;

const DT_S: f64 = 0.02;
/// From the middle to a side; the way along the diagonal is longer than the robot comes.
const HALF_M: f64 = 12.0;
const LIMITS: Limits = Limits {
    speed_mps_max: 1.0,
    reverse_mps_max: 0.0,
    turn_radps_max: 2.0,
    accel_mps2_max: f64::INFINITY,
    turn_accel_radps2_max: f64::INFINITY,
};

/// A method, and how much there is around its robot.
#[derive(Clone, Copy)]
pub(crate) struct Cell {
    pub(crate) method: &'static Method,
    pub(crate) neighbors: usize,
    pub(crate) obstacles: usize,
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

    pub(crate) fn planner(&self) -> Box<dyn Planner> {
        let identity = Identity { seed: 1, robot: 0, incarnation: 0 };
        let planner = (self.method.build)(&ParamValues::new(), identity);
        planner.unwrap_or_else(|problem| panic!("{}: defaults fit: {problem}", self.method.name))
    }
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}+{}", self.method.name, self.neighbors, self.obstacles)
    }
}

/// One tick of the way.
pub(crate) struct Step {
    pub(crate) position: Point2<f64>,
    pub(crate) yaw_rad: f64,
    pub(crate) velocity: Vector2<f64>,
    pub(crate) neighbors: Vec<Neighbor>,
}

/// The way of a robot.
pub(crate) struct Route {
    kind: Kind,
    pub(crate) goal: Point2<f64>,
    pub(crate) obstacles: Vec<Obstacle>,
    pub(crate) steps: Vec<Step>,
}

impl Route {
    /// Drives it.
    pub(crate) fn new(cell: &Cell) -> Route {
        let corner = Point2::new(HALF_M, HALF_M);
        let obstacles = discs(cell.obstacles, [-corner, corner]);
        let steps = Vec::with_capacity(WARM_UP + MEASURED);
        let mut route = Route { kind: cell.method.kinds[0], goal: corner, obstacles, steps };
        let mut random = Stream::new(1, cell.neighbors as u32, 0, "micro-neighbours");
        let mut circle =
            || (random.between(1.0, 5.0), random.between(0.0, std::f64::consts::TAU), random.between(-0.3, 0.3));
        let circles: Vec<_> = (0..cell.neighbors).map(|_| circle()).collect();
        let mut planner = cell.planner();
        let (mut position, mut yaw_rad, mut velocity) = (-corner, std::f64::consts::FRAC_PI_4, Vector2::zeros());
        for tick in 0..WARM_UP + MEASURED {
            let time_s = tick as f64 * DT_S;
            let neighbor = |(&(distance_m, angle_rad, turn_radps), id): (&(f64, f64, f64), u32)| {
                let (sin, cos) = (angle_rad + turn_radps * time_s).sin_cos();
                let along = Vector2::new(-sin, cos) * (distance_m * turn_radps);
                Neighbor {
                    id,
                    position: position + Vector2::new(cos, sin) * distance_m,
                    yaw_rad: along.y.atan2(along.x),
                    velocity: velocity + along,
                    radius_m: RADIUS_M,
                    age_s: DT_S,
                    remaining_m: 5.0 + distance_m,
                    arrived: id % 8 == 0,
                    stopped: false,
                }
            };
            let neighbors = circles.iter().zip(1..).map(neighbor).collect();
            route.steps.push(Step { position, yaw_rad, velocity, neighbors });
            match planner.plan(&route.input(tick)).drive.within(&LIMITS) {
                Drive::Velocity(planned) => velocity = planned,
                Drive::Twist { speed_mps, turn_radps } => {
                    yaw_rad += turn_radps * DT_S;
                    velocity = Vector2::new(yaw_rad.cos(), yaw_rad.sin()) * speed_mps;
                }
                Drive::Joints { .. } => {}
            }
            position += velocity * DT_S;
        }
        route
    }

    /// What a method is given in a tick of it.
    pub(crate) fn input(&self, tick: usize) -> PlanInput<'_> {
        let Step { position, yaw_rad, velocity, neighbors } = &self.steps[tick];
        PlanInput {
            tick: tick as u64,
            dt_s: DT_S,
            position: *position,
            yaw_rad: *yaw_rad,
            velocity: *velocity,
            radius_m: RADIUS_M,
            kind: self.kind,
            limits: LIMITS,
            goal: self.goal,
            goal_tolerance_m: 0.2,
            arrived: false,
            obstacles: &self.obstacles,
            neighbors,
            map: &self.obstacles,
            arm: None,
        }
    }
}

/// Discs strewn over the square with room between them, and around these places.
fn discs(count: usize, free: [Point2<f64>; 2]) -> Vec<Obstacle> {
    let mut random = Stream::new(1, count as u32, 0, "micro-obstacles");
    let mut discs: Vec<Obstacle> = Vec::new();
    while discs.len() < count {
        let center = Point2::new(random.between(-HALF_M, HALF_M), random.between(-HALF_M, HALF_M));
        let apart = |disc: &Obstacle| (disc.shape.a - center).norm() > 1.2;
        if discs.iter().all(apart) && free.iter().all(|place| (place - center).norm() > 2.0) {
            let (id, shape) = (discs.len() as u32, Capsule::disc(center, 0.15));
            discs.push(Obstacle { id, shape, velocity: Vector2::zeros() });
        }
    }
    discs
}
