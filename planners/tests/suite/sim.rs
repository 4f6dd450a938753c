//! A small synchronous simulator: all robots plan from the positions of the same instant, then all move.

use crate::environment::{Disc, Environment};
use crate::inputs::{LIMITS, values};
use nalgebra::{Point2, Vector2};
use shoal_planners::{Drive, Identity, Kind, Limits, Neighbor, Obstacle, ParamValues, PlanInput, Planner};

/// How a run differs from the plain one.
#[derive(Clone, Debug)]
pub(crate) struct Variant {
    pub(crate) method: &'static str,
    pub(crate) kind: Kind,
    pub(crate) params: ParamValues,
    /// Age of the neighbours' poses, ticks.
    pub(crate) delay_ticks: usize,
    /// Whether the robots are told that age; the environments' own runs took old poses for fresh ones.
    pub(crate) age_known: bool,
    pub(crate) speed_mps_max: f64,
    pub(crate) dt_s: f64,
    pub(crate) t_max_s: f64,
}

/// What came of a run.
#[derive(Debug)]
pub(crate) struct Outcome {
    /// When each robot was first within its tolerance, s.
    pub(crate) arrival_s: Vec<Option<f64>>,
    /// Smallest distances between surfaces after any move, m.
    pub(crate) robot_clearance: f64,
    pub(crate) obstacle_clearance: f64,
    /// Where the robots were at the end, and all the way.
    pub(crate) end: Vec<Point2<f64>>,
    pub(crate) paths: Vec<Vec<Point2<f64>>>,
}

#[derive(Clone, Copy)]
struct Body {
    position: Point2<f64>,
    yaw_rad: f64,
    velocity: Vector2<f64>,
}

impl Variant {
    /// A row of an environment: its named parameter set, with what belongs to the run taken out.
    pub(crate) fn row(environment: &Environment, set: &str, kind: Kind, delay_ticks: usize) -> Variant {
        let mut table = environment.params[set].clone();
        let mut take = |key: &str| table.remove(key).and_then(|v| v.as_float()).expect("the set has the key");
        let (speed_mps_max, dt_s, t_max_s) = (take("v_max"), take("dt"), take("t_max"));
        take("arrival_tolerance");
        if kind == Kind::Unicycle {
            table.extend(environment.params["differential"].clone());
        }
        let (method, params) = ("decentralized-apf", values(&table));
        Variant { method, kind, params, delay_ticks, age_known: false, speed_mps_max, dt_s, t_max_s }
    }

    pub(crate) fn run(&self, environment: &Environment) -> Outcome {
        let method = shoal_planners::find(self.method).expect("the method exists");
        let n = environment.robots.len();
        let mut planners: Vec<Box<dyn Planner>> = (0..n as u32)
            .map(|robot| Identity { seed: 1, robot, incarnation: 0 })
            .map(|identity| (method.build)(&self.params, identity).expect("the parameters fit"))
            .collect();
        let start = |robot: &crate::environment::Robot| {
            let position = Point2::from(robot.start);
            let to_goal = Point2::from(robot.goal) - position;
            Body { position, yaw_rad: to_goal.y.atan2(to_goal.x), velocity: Vector2::zeros() }
        };
        let mut history: Vec<Vec<Body>> = vec![environment.robots.iter().map(start).collect()];
        let mut outcome = Outcome {
            arrival_s: vec![None; n],
            robot_clearance: f64::INFINITY,
            obstacle_clearance: f64::INFINITY,
            end: Vec::new(),
            paths: Vec::new(),
        };
        let ticks = self.ticks();
        for tick in 0..ticks {
            let obstacles = self.obstacles(environment, tick);
            let heard = &history[tick.saturating_sub(self.delay_ticks)];
            let moved = (0..n)
                .map(|i| {
                    let body = history[tick][i];
                    let neighbors = self.neighbors(environment, heard, i);
                    let robot = &environment.robots[i];
                    let plan = planners[i].plan(&PlanInput {
                        tick: tick as u64,
                        dt_s: self.dt_s,
                        position: body.position,
                        yaw_rad: body.yaw_rad,
                        velocity: body.velocity,
                        radius_m: robot.radius,
                        kind: self.kind,
                        limits: self.limits(),
                        goal: robot.goal.into(),
                        goal_tolerance_m: robot.arrival_tolerance,
                        arrived: outcome.arrival_s[i].is_some(),
                        obstacles: &obstacles,
                        neighbors: &neighbors,
                        map: &obstacles,
                    });
                    body.moved(plan.drive, self.dt_s)
                })
                .collect();
            history.push(moved);
            self.observe(environment, tick + 1, &history[tick + 1], &mut outcome);
            if outcome.arrival_s.iter().all(Option::is_some) {
                break;
            }
        }
        outcome.end = history[history.len() - 1].iter().map(|body| body.position).collect();
        outcome.paths = (0..n).map(|i| history.iter().map(|bodies| bodies[i].position).collect()).collect();
        outcome
    }

    /// The environments' own runs added up their time until it reached `t_max`, which takes one tick more where the sum
    /// rounds down. It shows only where robots chatter for ever, in which of two places they end.
    fn ticks(&self) -> usize {
        std::iter::successors(Some(0.0), |t| Some(t + self.dt_s)).take_while(|t| *t < self.t_max_s).count()
    }

    fn limits(&self) -> Limits {
        Limits { speed_mps_max: self.speed_mps_max, ..LIMITS }
    }

    fn obstacles(&self, environment: &Environment, tick: usize) -> Vec<Obstacle> {
        let t = tick as f64 * self.dt_s;
        let velocity = |disc: &Disc| (disc.center_at(t + self.dt_s) - disc.center_at(t)) / self.dt_s;
        let discs = environment.obstacles.iter().enumerate();
        discs
            .map(|(i, disc)| Obstacle {
                id: i as u32,
                shape: shoal_planners::Capsule::disc(disc.center_at(t), disc.radius),
                velocity: velocity(disc),
            })
            .collect()
    }

    fn neighbors(&self, environment: &Environment, heard: &[Body], own: usize) -> Vec<Neighbor> {
        (0..heard.len())
            .filter(|other| *other != own)
            .map(|other| Neighbor {
                id: other as u32,
                position: heard[other].position,
                yaw_rad: heard[other].yaw_rad,
                velocity: heard[other].velocity,
                radius_m: environment.robots[other].radius,
                age_s: if self.age_known { self.delay_ticks as f64 * self.dt_s } else { 0.0 },
                remaining_m: (Point2::from(environment.robots[other].goal) - heard[other].position).norm(),
                arrived: false,
                stopped: false,
            })
            .collect()
    }

    fn observe(&self, environment: &Environment, tick: usize, bodies: &[Body], outcome: &mut Outcome) {
        let t = tick as f64 * self.dt_s;
        for (i, (body, robot)) in bodies.iter().zip(&environment.robots).enumerate() {
            if (body.position - Point2::from(robot.goal)).norm() <= robot.arrival_tolerance {
                outcome.arrival_s[i].get_or_insert(t);
            }
            for (other, other_robot) in bodies.iter().zip(&environment.robots).skip(i + 1) {
                let gap = (body.position - other.position).norm() - robot.radius - other_robot.radius;
                outcome.robot_clearance = outcome.robot_clearance.min(gap);
            }
            for disc in &environment.obstacles {
                let gap = (body.position - disc.center_at(t)).norm() - robot.radius - disc.radius;
                outcome.obstacle_clearance = outcome.obstacle_clearance.min(gap);
            }
        }
    }
}

impl Body {
    fn moved(self, drive: Drive, dt_s: f64) -> Body {
        match drive {
            Drive::Velocity(velocity) => Body { position: self.position + velocity * dt_s, velocity, ..self },
            // The turn comes first: the position moves along the heading after it.
            Drive::Twist { speed_mps, turn_radps } => {
                let yaw_rad = self.yaw_rad + turn_radps * dt_s;
                let velocity = speed_mps * Vector2::new(yaw_rad.cos(), yaw_rad.sin());
                Body { position: self.position + velocity * dt_s, yaw_rad, velocity }
            }
        }
    }
}
