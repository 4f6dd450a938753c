//! A small synchronous simulator: all robots plan from the positions of the same instant, then all move. Papers whose
//! update order is another one have their own loop.

use crate::environment::{Disc, Environment, Robot, take, values};
use geometry::Capsule;
use model::{BodyKind, Drive, Limits, ParamValues};
use nalgebra::{Point2, Vector2};
use planners::{Identity, Neighbor, Obstacle, PlanInput, Planner};

/// What is run in an environment.
#[derive(Clone, Debug)]
pub struct Run<'a> {
    /// Where.
    pub environment: &'a Environment,
    /// Name of the method, the same for all robots.
    pub method: &'static str,
    /// Its parameters.
    pub params: ParamValues,
    /// How the bodies move.
    pub kind: BodyKind,
    /// Seed of the run.
    pub seed: u64,
    /// Age of the neighbours' poses, ticks.
    pub delay_ticks: usize,
    /// Whether the robots are told that age; the environments' own runs took old poses for fresh ones.
    pub age_known: bool,
    /// Speed limit, m/s.
    pub speed_mps_max: f64,
    /// Length of a tick, s.
    pub dt_s: f64,
    /// When to give up, s.
    pub t_max_s: f64,
}

/// What came of a run.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// When each robot was first within its tolerance, s.
    pub arrival_s: Vec<Option<f64>>,
    /// Smallest distance between two robots' surfaces after any move, m.
    pub robot_clearance: f64,
    /// Smallest distance between the surfaces of a robot and an obstacle after any move, m.
    pub obstacle_clearance: f64,
    /// Where each robot was after every tick, from its start on.
    pub paths: Vec<Vec<Point2<f64>>>,
    /// Where each robot's goal was at the end.
    pub goals: Vec<Point2<f64>>,
}

impl Outcome {
    /// Whether all robots arrived.
    pub fn arrives(&self) -> bool {
        self.arrival_s.iter().all(Option::is_some)
    }

    /// Where a robot was at the end.
    pub fn end(&self, robot: usize) -> Point2<f64> {
        *self.paths[robot].last().expect("a path has its start")
    }

    /// How far a robot drove, m.
    pub fn path_length(&self, robot: usize) -> f64 {
        self.paths[robot].windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
    }

    /// How far a robot was from its goal at the end, m.
    pub fn distance_to_goal(&self, robot: usize) -> f64 {
        (self.goals[robot] - self.end(robot)).norm()
    }

    /// The paths as points of a figure.
    pub fn line(&self, robot: usize) -> Vec<[f64; 2]> {
        self.paths[robot].iter().map(|p| [p.x, p.y]).collect()
    }
}

#[derive(Clone, Copy)]
struct Body {
    position: Point2<f64>,
    yaw_rad: f64,
    velocity: Vector2<f64>,
}

impl<'a> Run<'a> {
    /// A method with a parameter set, after what belongs to the run is taken out of it. Points, fresh poses; without
    /// `v_max` in the set the speed is not limited.
    pub fn new(environment: &'a Environment, method: &'static str, mut set: toml::Table) -> Run<'a> {
        let (dt_s, t_max_s) = (take(&mut set, "dt"), take(&mut set, "t_max"));
        let speed_mps_max = if set.contains_key("v_max") { take(&mut set, "v_max") } else { f64::INFINITY };
        // The robots have it too.
        let arrival_tolerance = take(&mut set, "arrival_tolerance");
        assert!(environment.robots.iter().all(|robot| robot.arrival_tolerance == arrival_tolerance));
        Run {
            environment,
            method,
            params: values(&set),
            kind: BodyKind::Point,
            seed: 1,
            delay_ticks: 0,
            age_known: false,
            speed_mps_max,
            dt_s,
            t_max_s,
        }
    }

    /// Runs until all robots have arrived or time is up. Panics if the parameters do not fit the method: they stand in
    /// data files that are compiled in.
    pub fn run(&self) -> Outcome {
        let method = planners::find(self.method).expect("the method exists");
        let n = self.environment.robots.len();
        let mut planners: Vec<Box<dyn Planner>> = (0..n as u32)
            .map(|robot| Identity { seed: self.seed, robot, incarnation: 0 })
            .map(|identity| (method.build)(&self.params, identity).unwrap_or_else(|problem| panic!("{problem}")))
            .collect();
        let start = |robot: &Robot| {
            let to_goal = robot.goal - robot.start;
            Body { position: robot.start, yaw_rad: to_goal.y.atan2(to_goal.x), velocity: Vector2::zeros() }
        };
        let mut history: Vec<Vec<Body>> = vec![self.environment.robots.iter().map(start).collect()];
        let mut outcome = Outcome {
            arrival_s: vec![None; n],
            robot_clearance: f64::INFINITY,
            obstacle_clearance: f64::INFINITY,
            paths: Vec::new(),
            goals: Vec::new(),
        };
        for tick in 0..self.ticks() {
            let t = tick as f64 * self.dt_s;
            let obstacles = self.obstacles(t);
            let heard = &history[tick.saturating_sub(self.delay_ticks)];
            let moved = (0..n)
                .map(|i| {
                    let body = history[tick][i];
                    let neighbors = self.neighbors(heard, i);
                    let robot = &self.environment.robots[i];
                    let plan = planners[i].plan(&PlanInput {
                        tick: tick as u64,
                        dt_s: self.dt_s,
                        position: body.position,
                        yaw_rad: body.yaw_rad,
                        velocity: body.velocity,
                        radius_m: robot.radius,
                        kind: self.kind,
                        limits: limits(self.speed_mps_max),
                        goal: robot.goal_at(t),
                        goal_tolerance_m: robot.arrival_tolerance,
                        goal_yaw_rad: None,
                        goal_yaw_tolerance_rad: 0.1,
                        arrived: outcome.arrival_s[i].is_some(),
                        obstacles: &obstacles,
                        neighbors: &neighbors,
                        map: &obstacles,
                        arm: None,
                    });
                    body.moved(plan.drive, self.dt_s)
                })
                .collect();
            history.push(moved);
            self.observe(tick + 1, &history[tick + 1], &mut outcome);
            if outcome.arrives() {
                break;
            }
        }
        let end_s = (history.len() - 1) as f64 * self.dt_s;
        outcome.goals = self.environment.robots.iter().map(|robot| robot.goal_at(end_s)).collect();
        outcome.paths = (0..n).map(|i| history.iter().map(|bodies| bodies[i].position).collect()).collect();
        outcome
    }

    /// The environments' own runs added up their time until it reached `t_max`, which takes one tick more where the sum
    /// rounds down. It shows only where robots chatter for ever, in which of two places they end.
    fn ticks(&self) -> usize {
        std::iter::successors(Some(0.0), |t| Some(t + self.dt_s)).take_while(|t| *t < self.t_max_s).count()
    }

    fn obstacles(&self, t: f64) -> Vec<Obstacle> {
        let velocity = |disc: &Disc| (disc.center_at(t + self.dt_s) - disc.center_at(t)) / self.dt_s;
        let discs = self.environment.obstacles.iter().zip(0..);
        let still = |disc: &Disc, id: u32| disc_at(id, disc.center_at(t), disc.radius);
        discs.map(|(disc, id)| Obstacle { velocity: velocity(disc), ..still(disc, id) }).collect()
    }

    fn neighbors(&self, heard: &[Body], own: usize) -> Vec<Neighbor> {
        (0..heard.len())
            .filter(|other| *other != own)
            .map(|other| Neighbor {
                id: other as u32,
                position: heard[other].position,
                yaw_rad: heard[other].yaw_rad,
                velocity: heard[other].velocity,
                radius_m: self.environment.robots[other].radius,
                age_s: if self.age_known { self.delay_ticks as f64 * self.dt_s } else { 0.0 },
                remaining_m: (self.environment.robots[other].goal - heard[other].position).norm(),
                arrived: false,
                stopped: false,
            })
            .collect()
    }

    fn observe(&self, tick: usize, bodies: &[Body], outcome: &mut Outcome) {
        let t = tick as f64 * self.dt_s;
        let Environment { robots, obstacles, .. } = self.environment;
        for (i, (body, robot)) in bodies.iter().zip(robots).enumerate() {
            if (body.position - robot.goal_at(t)).norm() <= robot.arrival_tolerance {
                outcome.arrival_s[i].get_or_insert(t);
            }
            for (other, other_robot) in bodies.iter().zip(robots).skip(i + 1) {
                let gap = (body.position - other.position).norm() - robot.radius - other_robot.radius;
                outcome.robot_clearance = outcome.robot_clearance.min(gap);
            }
            for disc in obstacles {
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
            Drive::Joints { .. } => self,
            // The turn comes first: the position moves along the heading after it.
            Drive::Twist { speed_mps, turn_radps } => {
                let yaw_rad = self.yaw_rad + turn_radps * dt_s;
                let velocity = speed_mps * Vector2::new(yaw_rad.cos(), yaw_rad.sin());
                Body { position: self.position + velocity * dt_s, yaw_rad, velocity }
            }
        }
    }
}

/// A body without inertia; a unicycle turns with 3 rad/s at most and does not drive backwards.
fn limits(speed_mps_max: f64) -> Limits {
    Limits {
        speed_mps_max,
        reverse_mps_max: 0.0,
        turning_radius_m_min: 0.0,
        turn_radps_max: 3.0,
        accel_mps2_max: f64::INFINITY,
        turn_accel_radps2_max: f64::INFINITY,
    }
}

/// A disc that stands still.
pub fn disc_at(id: u32, center: Point2<f64>, radius: f64) -> Obstacle {
    Obstacle { id, shape: Capsule::disc(center, radius), velocity: Vector2::zeros() }
}

/// What a point robot without extent is given that stands at the origin, for worked examples.
pub fn at_origin(goal: Point2<f64>, obstacles: &[Obstacle]) -> PlanInput<'_> {
    PlanInput {
        tick: 0,
        dt_s: 0.05,
        position: Point2::origin(),
        yaw_rad: 0.0,
        velocity: Vector2::zeros(),
        radius_m: 0.0,
        kind: BodyKind::Point,
        limits: limits(1.0),
        goal,
        goal_tolerance_m: 0.1,
        goal_yaw_rad: None,
        goal_yaw_tolerance_rad: 0.1,
        arrived: false,
        obstacles,
        neighbors: &[],
        map: obstacles,
        arm: None,
    }
}

/// Without the noise of the last digits, which no reader of a table wants.
pub(crate) fn tidy(x: f64) -> f64 {
    (x * 1e9).round() / 1e9
}
