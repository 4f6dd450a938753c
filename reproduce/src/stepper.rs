//! The one stepper of the papers' runs: all robots of a scenario in one thread, in the order in which the paper's own
//! program plans, moves and looks for arrivals. That order is what [`Rules`] says; the world of a fleet has another one.

use crate::scene::{Scene, disc_at, discs, goal, goal_mover, mover};
use geometry::ArmState;
use model::{BodyKind, Drive, Mover, ParamValue, ParamValues, Robot, Scenario};
use nalgebra::{Point2, Vector2};
use planners::{Identity, Neighbor, Obstacle, Plan, PlanInput, Planner};

/// The order of updates.
#[derive(Clone, Copy, Debug)]
pub struct Rules {
    /// Length of a tick, s.
    pub dt_s: f64,
    /// Each robot moves before the next one plans. Otherwise all plan on one snapshot, then all move.
    pub in_turn: bool,
    /// Into how many steps the motion of a unicycle in a tick is divided, during which its command holds.
    pub substeps: u32,
    /// In such a step a unicycle turns, then drives along its new heading. Otherwise it drives along its old one.
    pub turns_first: bool,
    /// Robots know velocities: their own, and those of others.
    pub velocities: bool,
    /// Age of the neighbours' poses, ticks.
    pub delay_ticks: usize,
    /// Whether the robots are told that age.
    pub age_known: bool,
    /// When a robot has arrived.
    pub arrival: Arrival,
}

/// When a robot has arrived.
#[derive(Clone, Copy, Debug)]
pub enum Arrival {
    /// After the first move that ends within its goal tolerance, slower than this, m/s. It goes on planning.
    Within {
        /// Speed, m/s.
        speed_mps: f64,
    },
    /// In the first tick after one that it began within its goal tolerance. From then on it stands.
    Noticed,
}

impl Rules {
    /// All plan on one snapshot of fresh poses; turns come before drives; a robot that comes within the tolerance has arrived.
    pub fn snapshot(dt_s: f64) -> Rules {
        Rules {
            dt_s,
            in_turn: false,
            substeps: 1,
            turns_first: true,
            velocities: true,
            delay_ticks: 0,
            age_known: false,
            arrival: Arrival::Within { speed_mps: f64::INFINITY },
        }
    }

    /// A snapshot of poses that are a tick old, which the robots know: what a fleet has in `lockstep`.
    pub fn as_in_a_fleet(dt_s: f64) -> Rules {
        Rules { delay_ticks: 1, age_known: true, ..Rules::snapshot(dt_s) }
    }
}

/// A run that can be made.
#[derive(Clone, Debug)]
pub struct Run {
    /// What is run, with planners, parameters, seed and duration. The length of a tick is that of the rules.
    pub scenario: Scenario,
    /// The order of updates.
    pub rules: Rules,
}

impl Run {
    /// A scene in which all robots have this planner, with ticks of the scene's length. The parameters are added to those
    /// that the scene gives the same planner.
    pub fn of(scene: &Scene, planner: &str, params: &[(&str, ParamValue)]) -> Run {
        let scenario = scene.scenario.clone();
        let run = Run { rules: Rules::snapshot(scenario.clock.dt_s()), scenario };
        run.each(|robot| {
            if robot.planner != planner {
                (robot.planner, robot.params) = (planner.to_owned(), ParamValues::new());
            }
            robot.params.extend(params.iter().map(|(name, value)| ((*name).to_owned(), value.clone())));
        })
    }

    /// A scene in which all robots have this planner with its default parameters, and bodies of this kind: as in a fleet
    /// at 1 m/s with ticks of 0.05 s, for a minute.
    pub fn as_in_a_fleet(scene: &Scene, planner: &str, kind: BodyKind) -> Run {
        let run = Run::of(scene, planner, &[]).for_seconds(60.0).under(Rules::as_in_a_fleet(0.05));
        run.each(|robot| {
            (robot.kind, robot.params, robot.limits.speed_mps_max) = (kind, ParamValues::new(), 1.0);
        })
    }

    /// The same with something changed in every robot.
    pub fn each(mut self, change: impl FnMut(&mut Robot)) -> Run {
        self.scenario.robots.iter_mut().for_each(change);
        self
    }

    /// The same with a parameter of every robot's planner.
    pub fn with(self, name: &str, value: ParamValue) -> Run {
        self.each(|robot| drop(robot.params.insert(name.to_owned(), value.clone())))
    }

    /// The same with another seed.
    pub fn seeded(mut self, seed: u64) -> Run {
        self.scenario.clock.seed = seed;
        self
    }

    /// The same with this time limit.
    pub fn for_seconds(mut self, seconds: f64) -> Run {
        self.scenario.clock.ticks_max = (seconds * self.scenario.clock.tick_hz).round() as u64;
        self
    }

    /// The same with the rules changed.
    pub fn under(self, rules: Rules) -> Run {
        Run { rules, ..self }
    }

    /// Runs until all robots have arrived or time is up.
    pub fn run(&self) -> Stepper {
        let mut stepper = Stepper::new(&self.scenario, self.rules);
        stepper.run(self.ticks());
        stepper
    }

    /// What is run, in words: robots, planner, parameters, ticks.
    pub fn words(&self) -> String {
        let robots = &self.scenario.robots;
        let robot = &robots[0];
        let params: Vec<String> = robot.params.iter().map(|(name, value)| format!("{name} = {value}")).collect();
        let params = if params.is_empty() { String::new() } else { format!(" with {}", params.join(", ")) };
        let count = if robots.len() == 1 { "one robot".to_owned() } else { format!("{} robots", robots.len()) };
        let Rules { dt_s, delay_ticks, .. } = self.rules;
        let age = match delay_ticks {
            0 => "fresh poses".to_owned(),
            ticks => format!("poses {ticks} ticks old"),
        };
        let limit_s = self.scenario.clock.ticks_max as f64 / self.scenario.clock.tick_hz;
        let kind = format!("{:?}", robot.kind).to_lowercase();
        format!("{count} ({kind}), planner {}{params}; ticks of {dt_s} s, {age}, at most {limit_s} s", robot.planner)
    }

    /// The papers' programs add up their time until it has reached the limit, which takes one tick more where the sum
    /// rounds down. It shows only where robots chatter for ever, in which of two places they end.
    pub(crate) fn ticks(&self) -> usize {
        let (dt_s, clock) = (self.rules.dt_s, &self.scenario.clock);
        let limit_s = clock.ticks_max as f64 / clock.tick_hz;
        std::iter::successors(Some(0.0), |t| Some(t + dt_s)).take_while(|t| *t < limit_s).count()
    }
}

/// Where a robot is and what it does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Where it is; of an arm, where its tip is.
    pub position: Point2<f64>,
    /// Its heading, rad; of an arm, the sum of its joints.
    pub yaw_rad: f64,
    /// How it moved in the last tick, m/s.
    pub velocity: Vector2<f64>,
    /// How it turned in the last tick, rad/s; of an arm, how its joints did together.
    pub turn_radps: f64,
    /// The joints of an arm, rad.
    pub joints_rad: Option<[f64; 2]>,
    /// It has arrived.
    pub arrived: bool,
    /// It stands still on purpose.
    pub stopped: bool,
}

/// The least distance so far, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Surface to surface.
    pub clearance_m: f64,
    /// Centre to centre.
    pub centres_m: f64,
}

/// A run under way.
pub struct Stepper<P = Box<dyn Planner>> {
    /// What is run. Its clock does not count: the rules and the caller say how long a tick and a run are.
    pub scenario: Scenario,
    /// The order of updates.
    pub rules: Rules,
    /// The planners of the robots.
    pub planners: Vec<P>,
    /// All robots at the start and after every tick.
    pub history: Vec<Vec<Body>>,
    /// The number of ticks after which each robot had arrived.
    pub arrival_ticks: Vec<Option<usize>>,
    /// Between two robots, after any move.
    pub robots: Nearest,
    /// Between a robot and an obstacle, after any move.
    pub obstacles: Nearest,
    /// How robots have moved so far in this tick.
    bodies: Vec<Body>,
    /// Distance to the goal at the beginning of the last tick, m.
    last_m: Vec<f64>,
    /// How goals and obstacles move.
    movers: [Vec<Option<Mover>>; 2],
    /// Where the goals are now, m.
    goals: Vec<Point2<f64>>,
    /// Where the obstacles are now.
    seen: Vec<Obstacle>,
    neighbors: Vec<Neighbor>,
}

impl Stepper {
    /// The scenario with the planners that it names. Panics if parameters do not fit a planner: they stand in the code.
    pub fn new(scenario: &Scenario, rules: Rules) -> Self {
        let planners = (0..).zip(&scenario.robots).map(|(slot, robot)| planner(scenario.clock.seed, slot, robot));
        Stepper::with_planners(scenario, rules, planners.collect())
    }
}

/// The planner that a robot of the scenario has.
pub fn planner(seed: u64, slot: u32, robot: &Robot) -> Box<dyn Planner> {
    let method = planners::find(&robot.planner).expect("the method exists");
    let identity = Identity { seed, robot: slot, incarnation: 0 };
    (method.build)(&robot.params, identity).unwrap_or_else(|problem| panic!("{}: {problem}", robot.planner))
}

impl<P: Planner> Stepper<P> {
    /// The scenario with these planners instead of those that it names.
    pub fn with_planners(scenario: &Scenario, rules: Rules, planners: Vec<P>) -> Self {
        let none = Nearest { clearance_m: f64::INFINITY, centres_m: f64::INFINITY };
        let scenario = scenario.clone();
        let (count, seed) = (scenario.robots.len(), scenario.clock.seed);
        let bodies: Vec<Body> = scenario.robots.iter().map(at_start).collect();
        let mut stepper = Stepper {
            rules,
            planners,
            history: vec![bodies.clone()],
            arrival_ticks: vec![None; count],
            robots: none,
            obstacles: none,
            bodies,
            last_m: vec![f64::INFINITY; count],
            movers: [
                scenario.robots.iter().map(goal_mover).collect(),
                (0..).zip(&scenario.obstacles).map(|(i, obstacle)| mover(obstacle, seed, i)).collect(),
            ],
            goals: scenario.robots.iter().map(goal).collect(),
            seen: discs(&scenario),
            neighbors: Vec::with_capacity(count),
            scenario,
        };
        stepper.look(0);
        stepper
    }

    /// Adds a robot.
    pub fn join(&mut self, robot: Robot, planner: P) {
        self.bodies.push(at_start(&robot));
        self.movers[0].push(goal_mover(&robot));
        self.goals.push(goal(&robot));
        self.planners.push(planner);
        self.arrival_ticks.push(None);
        self.last_m.push(f64::INFINITY);
        self.scenario.robots.push(robot);
    }

    /// Gives a robot another goal.
    pub fn send(&mut self, robot: usize, goal: Point2<f64>) {
        (self.scenario.robots[robot].goals, self.goals[robot], self.movers[0][robot]) = (vec![goal], goal, None);
        (self.arrival_ticks[robot], self.last_m[robot]) = (None, f64::INFINITY);
        self.bodies[robot].arrived = false;
    }

    /// The robots as they are now.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// The number of ticks so far.
    pub fn ticks(&self) -> usize {
        self.history.len() - 1
    }

    /// Whether all robots have arrived.
    pub fn all_arrived(&self) -> bool {
        self.arrival_ticks.iter().all(Option::is_some)
    }

    /// Runs until all robots have arrived, or for this many ticks in all.
    pub fn run(&mut self, ticks: usize) {
        while self.ticks() < ticks && !self.all_arrived() {
            self.step();
        }
    }

    /// One tick of all robots.
    pub fn step(&mut self) {
        let mut drives = Vec::with_capacity(self.bodies.len());
        for slot in 0..self.bodies.len() {
            let command = self.plan(slot);
            if self.rules.in_turn {
                self.bodies[slot] = self.moved(slot, command);
            } else {
                drives.push(command);
            }
        }
        for (slot, command) in drives.into_iter().enumerate() {
            self.bodies[slot] = self.moved(slot, command);
        }
        let tick = self.history.len();
        self.look(tick);
        self.judge(tick);
        self.history.push(self.bodies.clone());
    }

    /// Moves goals and obstacles to where they are after this number of ticks.
    fn look(&mut self, tick: usize) {
        let (dt_s, t) = (self.rules.dt_s, tick as f64 * self.rules.dt_s);
        let [goals, obstacles] = &mut self.movers;
        for (goal, mover) in self.goals.iter_mut().zip(goals) {
            *goal = mover.as_mut().map_or(*goal, |mover| mover.at(t).0);
        }
        for (obstacle, mover) in self.seen.iter_mut().zip(obstacles) {
            let Some(mover) = mover else { continue };
            let (now, next) = (mover.at(t).0, mover.at(t + dt_s).0);
            *obstacle = Obstacle { velocity: (next - now) / dt_s, ..disc_at(obstacle.id, now, obstacle.shape.radius) };
        }
    }

    /// What a robot is asked to do in this tick; nothing if it stands at its goal for good.
    fn plan(&mut self, slot: usize) -> Option<Plan> {
        let (goal, body, robot) = (self.goals[slot], self.bodies[slot], &self.scenario.robots[slot]);
        if matches!(self.rules.arrival, Arrival::Noticed) {
            if self.last_m[slot] < robot.goal_tolerance_m {
                // The tick that only notices counts.
                self.arrival_ticks[slot].get_or_insert(self.history.len());
                return None;
            }
            self.last_m[slot] = (goal - body.position).norm();
        }
        self.hear(slot);
        let (tick, robot) = (self.ticks() as u64, &self.scenario.robots[slot]);
        Some(self.planners[slot].plan(&PlanInput {
            tick,
            dt_s: self.rules.dt_s,
            position: body.position,
            yaw_rad: body.yaw_rad,
            velocity: body.velocity,
            turn_radps: body.turn_radps,
            radius_m: robot.radius_m,
            kind: robot.kind,
            limits: robot.limits,
            goal,
            goal_tolerance_m: robot.goal_tolerance_m,
            goal_yaw_rad: robot.goal_yaw_rad,
            goal_yaw_tolerance_rad: robot.goal_yaw_tolerance_rad,
            arrived: body.arrived,
            obstacles: &self.seen,
            neighbors: &self.neighbors,
            map: &self.seen,
            walls: None,
            arm: arm_of(robot, &body),
            wheels: robot.wheels,
            allowed: &[],
        }))
    }

    /// Collects what a robot hears of the others.
    fn hear(&mut self, own: usize) {
        let Rules { dt_s, delay_ticks, age_known, .. } = self.rules;
        let heard = match delay_ticks {
            0 => &self.bodies,
            _ => &self.history[self.ticks().saturating_sub(delay_ticks)],
        };
        self.neighbors.clear();
        for (slot, (body, robot)) in
            heard.iter().zip(&self.scenario.robots).enumerate().filter(|(slot, _)| *slot != own)
        {
            self.neighbors.push(Neighbor {
                id: slot as u32,
                position: body.position,
                yaw_rad: body.yaw_rad,
                velocity: body.velocity,
                radius_m: robot.radius_m,
                age_s: if age_known { delay_ticks as f64 * dt_s } else { 0.0 },
                remaining_m: (goal(robot) - body.position).norm(),
                arrived: body.arrived,
                stopped: body.stopped,
                next: None,
                intent: None,
            });
        }
    }

    /// A robot after a tick in which it does this.
    fn moved(&self, slot: usize, plan: Option<Plan>) -> Body {
        let (mut body, robot, rules) = (self.bodies[slot], &self.scenario.robots[slot], self.rules);
        let Some(plan) = plan else { return Body { arrived: true, stopped: true, ..body } };
        body.stopped = plan.stopped;
        let drive = match (plan.drive, robot.wheels) {
            (Drive::Wheels { rate_radps }, Some(wheels)) => {
                let (speed_mps, turn_radps) = wheels.twist_of(rate_radps);
                Drive::Twist { speed_mps, turn_radps }
            }
            (drive, _) => drive,
        };
        match drive {
            Drive::Velocity(velocity) => {
                body.position += velocity * rules.dt_s;
                body.velocity = velocity;
            }
            Drive::Twist { speed_mps, turn_radps } => {
                let dt_s = rules.dt_s / f64::from(rules.substeps);
                for _ in 0..rules.substeps {
                    let turned_rad = body.yaw_rad + turn_radps * dt_s;
                    let along_rad = if rules.turns_first { turned_rad } else { body.yaw_rad };
                    body.velocity = speed_mps * Vector2::new(along_rad.cos(), along_rad.sin());
                    body.position += body.velocity * dt_s;
                    body.yaw_rad = turned_rad;
                }
                body.turn_radps = turn_radps;
            }
            Drive::Joints { .. } => {
                let Drive::Joints { rate_radps } = plan.drive.within(&robot.limits) else { return body };
                let Some(arm) = arm_of(robot, &body).map(|arm| arm.moved(rate_radps, rules.dt_s)) else { return body };
                body.velocity = (arm.tip() - body.position) / rules.dt_s;
                body = Body { joints_rad: Some(arm.joints_rad), position: arm.tip(), ..body };
                body.yaw_rad = arm.joints_rad[0] + arm.joints_rad[1];
                body.turn_radps = rate_radps[0] + rate_radps[1];
            }
            Drive::Wheels { .. } => {} // a body without wheels
        }
        if !rules.velocities {
            (body.velocity, body.turn_radps) = (Vector2::zeros(), 0.0);
        }
        body
    }

    /// Judges distances and arrivals after a move.
    fn judge(&mut self, tick: usize) {
        for slot in 0..self.bodies.len() {
            let (body, robot) = (self.bodies[slot], &self.scenario.robots[slot]);
            for (other, other_robot) in self.bodies.iter().zip(&self.scenario.robots).skip(slot + 1) {
                self.robots.add((body.position - other.position).norm(), robot.radius_m, other_robot.radius_m);
            }
            for disc in self.seen.iter().map(|obstacle| obstacle.shape) {
                self.obstacles.add((body.position - disc.a).norm(), robot.radius_m, disc.radius);
            }
            let Arrival::Within { speed_mps } = self.rules.arrival else { continue };
            let near = (body.position - self.goals[slot]).norm() <= robot.goal_tolerance_m;
            if near && body.velocity.norm() < speed_mps {
                self.arrival_ticks[slot].get_or_insert(tick);
                self.bodies[slot].arrived = true;
            }
        }
    }

    /// When each robot had arrived, s.
    pub fn arrival_s(&self, robot: usize) -> Option<f64> {
        self.arrival_ticks[robot].map(|ticks| ticks as f64 * self.rules.dt_s)
    }

    /// Where a robot was, from its start on.
    pub fn path(&self, robot: usize) -> Vec<Point2<f64>> {
        self.history.iter().filter_map(|bodies| bodies.get(robot)).map(|body| body.position).collect()
    }

    /// The same, as the points of a figure.
    pub fn line(&self, robot: usize) -> Vec<[f64; 2]> {
        line(&self.path(robot))
    }

    /// How far a robot drove, m.
    pub fn path_length(&self, robot: usize) -> f64 {
        self.path(robot).windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
    }

    /// How far a robot is from its goal, m.
    pub fn distance_to_goal(&self, robot: usize) -> f64 {
        (self.goals[robot] - self.end(robot)).norm()
    }

    /// Where a robot is, m.
    pub fn end(&self, robot: usize) -> Point2<f64> {
        self.bodies[robot].position
    }

    /// The least distance of a robot from a robot or an obstacle, surface to surface, m.
    pub fn clearance_m(&self) -> f64 {
        self.robots.clearance_m.min(self.obstacles.clearance_m)
    }
}

impl Nearest {
    fn add(&mut self, centres_m: f64, own_m: f64, other_m: f64) {
        let clearance_m = centres_m - own_m - other_m;
        if clearance_m < self.clearance_m {
            *self = Nearest { clearance_m, centres_m };
        }
    }
}

fn at_start(robot: &Robot) -> Body {
    Body {
        position: robot.start,
        yaw_rad: robot.start_yaw_rad,
        velocity: Vector2::zeros(),
        turn_radps: 0.0,
        joints_rad: robot.arm.map(|arm| arm.start_joints_rad),
        arrived: false,
        stopped: false,
    }
}

fn arm_of(robot: &Robot, body: &Body) -> Option<ArmState> {
    Some(ArmState { geometry: robot.arm?.geometry, joints_rad: body.joints_rad? })
}

/// Points of a figure.
pub fn line(path: &[Point2<f64>]) -> Vec<[f64; 2]> {
    path.iter().map(|p| [p.x, p.y]).collect()
}

/// Without the noise of the last digits, which no reader of a table wants.
pub fn tidy(x: f64) -> f64 {
    (x * 1e9).round() / 1e9
}
