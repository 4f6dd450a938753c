//! The authors' runs without their simulator: perfect poses, a kinematic unicycle, the programs' own order of planning
//! and moving.

use super::layouts::{Layout, radii_m};
use geometry::Capsule;
use model::random::Stream;
use model::{BodyKind, Drive, Limits};
use nalgebra::{Point2, Vector2};
use planners::amr_apf::{self, AmrApf};
use planners::dapf::{self, Dapf};
use planners::{Identity, Neighbor, Obstacle, PlanInput, Planner};

/// Limits of the authors' robots.
const LIMITS: Limits = Limits {
    speed_mps_max: 0.2,
    reverse_mps_max: 0.0,
    turning_radius_m_min: 0.0,
    turn_radps_max: 1.0,
    accel_mps2_max: f64::INFINITY,
    turn_accel_radps2_max: f64::INFINITY,
};

/// A method and how its run is scheduled.
#[derive(Clone, Debug)]
pub struct Program {
    /// The method with its parameters.
    pub method: Method,
    /// Control period, s.
    pub dt_s: f64,
    /// Into how many steps of motion a period is divided, during which the command holds.
    pub substeps: u32,
    /// Each robot moves before the next one plans, as in the program of 2025. Otherwise all plan on one snapshot.
    pub in_turn: bool,
    /// The goal counts as reached within this distance, m.
    pub tolerance_m: f64,
    /// Radii with which it plans, m: (robot, pillar).
    pub radii_m: (f64, f64),
    /// When to give up.
    pub steps_max: usize,
}

/// A method with its parameters.
#[derive(Clone, Debug)]
pub enum Method {
    /// AMR-APF.
    Amr(amr_apf::Params),
    /// Its baseline.
    Dapf(dapf::Params),
}

/// A preset of AMR-APF as the authors' program runs it, to the last digit.
pub fn amr(preset: amr_apf::Preset) -> Program {
    Program::amr(amr_apf::Params { exact: true, sgn_zero: true, ..amr_apf::Params::of(preset) })
}

/// The same without virtual obstacles around crowds.
pub fn amr_without_clusters(preset: amr_apf::Preset) -> Program {
    let Method::Amr(params) = amr(preset).method else { unreachable!("AMR-APF was asked for") };
    Program::amr(amr_apf::Params { clusters: amr_apf::Which::Off, ..params })
}

/// A variant of the baseline as the authors' program runs it, to the last digit.
pub fn dapf(variant: dapf::Variant) -> Program {
    Program::dapf(dapf::Params { exact: true, sgn_zero: true, ..dapf::Params::of(variant) })
}

impl Program {
    /// AMR-APF with these parameters, scheduled as the authors' program is.
    pub fn amr(params: amr_apf::Params) -> Program {
        let late = params.preset == amr_apf::Preset::H;
        let program = Program::new(Method::Amr(params), late);
        Program { tolerance_m: if late { 0.08 } else { 0.06 }, ..program }
    }

    /// The baseline with these parameters, scheduled as the authors' program is.
    pub fn dapf(params: dapf::Params) -> Program {
        let late = params.variant == dapf::Variant::H;
        let program = Program::new(Method::Dapf(params), late);
        Program { tolerance_m: if late { 0.08 } else { 0.07 }, ..program }
    }

    fn new(method: Method, late: bool) -> Program {
        let (dt_s, steps_max) = if late { (0.05, 4000) } else { (0.1, 2500) };
        Program { method, dt_s, substeps: 1, in_turn: late, tolerance_m: 0.08, radii_m: radii_m(late), steps_max }
    }

    /// The same with another control period.
    pub fn with_period(self, dt_s: f64) -> Program {
        let steps_max = (self.steps_max as f64 * self.dt_s / dt_s).round() as usize;
        Program { dt_s, steps_max, ..self }
    }

    /// The same, given up after this time.
    pub fn for_seconds(self, seconds: f64) -> Program {
        Program { steps_max: (seconds / self.dt_s).round() as usize, ..self }
    }

    /// Runs a layout.
    pub fn run(&self, layout: &Layout) -> Outcome {
        Run::new(self, layout).finish()
    }

    /// Runs a layout this often, with every start moved by up to `size_m` in x and in y.
    pub fn run_jittered(&self, layout: &Layout, seeds: u64, size_m: f64) -> Vec<Outcome> {
        (1..=seeds).map(|seed| self.run(&jittered(layout, seed, size_m))).collect()
    }

    /// The layout this often with everything moved by up to `size_m`, and with every choice among equally small
    /// rectangles around three robots. With the 0.05 mm to which layouts are stored, the results are as good as the
    /// nominal one.
    pub fn run_nearby(&self, layout: &Layout, seeds: u64, size_m: f64) -> Vec<Outcome> {
        let layouts: Vec<Layout> = (1..=seeds).map(|seed| all_moved(layout, seed, size_m)).collect();
        let programs = match &self.method {
            Method::Amr(params) if params.circle == amr_apf::Circle::Rectangle => (0..=3)
                .map(|rectangle_tie| Method::Amr(amr_apf::Params { rectangle_tie, ..params.clone() }))
                .map(|method| Program { method, ..self.clone() })
                .collect(),
            _ => vec![self.clone()],
        };
        programs.iter().flat_map(|program| layouts.iter().map(|layout| program.run(layout))).collect()
    }

    fn planner(&self, robot: u32) -> Box<dyn Planner> {
        let identity = Identity { seed: 1, robot, incarnation: 0 };
        match &self.method {
            Method::Amr(params) => Box::new(AmrApf::new(params.clone(), identity)),
            Method::Dapf(params) => Box::new(Dapf::new(params.clone(), identity)),
        }
    }
}

/// The layout with every start moved.
pub fn jittered(layout: &Layout, seed: u64, size_m: f64) -> Layout {
    let mut layout = layout.clone();
    for (robot, job) in layout.jobs.iter_mut().enumerate() {
        let mut stream = Stream::new(seed, robot as u32, 0, "amr-apf jitter");
        job.start += Vector2::new(stream.between(-size_m, size_m), stream.between(-size_m, size_m));
    }
    layout
}

/// The layout with starts, goals and pillars moved.
fn all_moved(layout: &Layout, seed: u64, size_m: f64) -> Layout {
    let mut stream = Stream::new(seed, 0, 0, "amr-apf nearby");
    let mut moved = |p: &mut Point2<f64>| {
        *p += Vector2::new(stream.between(-size_m, size_m), stream.between(-size_m, size_m));
    };
    let mut layout = layout.clone();
    layout.pillars.iter_mut().for_each(&mut moved);
    for job in &mut layout.jobs {
        moved(&mut job.start);
        moved(&mut job.goal);
    }
    layout
}

/// What came of a run.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Cycles of each robot up to and with the one in which it notices that it has arrived.
    pub steps: Vec<Option<usize>>,
    /// Way of each robot, m.
    pub path_m: Vec<f64>,
    /// Smallest distance between the centres of two robots, m.
    pub robots_m: f64,
    /// Smallest distance between the centres of a robot and a pillar, m.
    pub pillars_m: f64,
    /// Poses of all robots after each step: x, y, heading.
    pub poses: Vec<Vec<[f64; 3]>>,
    dt_s: f64,
}

impl Outcome {
    /// Whether all robots arrived.
    pub fn all_arrived(&self) -> bool {
        self.steps.iter().all(Option::is_some)
    }

    /// How many robots arrived.
    pub fn arrived(&self) -> usize {
        self.steps.iter().flatten().count()
    }

    /// Cycles of the slowest robot, if all arrived.
    pub fn slowest(&self) -> Option<usize> {
        self.steps.iter().copied().collect::<Option<Vec<_>>>().map(|steps| steps.into_iter().max().unwrap_or(0))
    }

    /// Operation time: that of the slowest robot that arrived, s. The cycle that only notices it does not count.
    pub fn time_s(&self) -> f64 {
        self.steps.iter().flatten().max().map_or(0.0, |steps| (*steps - 1) as f64 * self.dt_s)
    }

    /// Mean way, m: also of the robots that never arrived.
    pub fn mean_path_m(&self) -> f64 {
        self.path_m.iter().sum::<f64>() / self.path_m.len() as f64
    }
}

/// What a robot did in a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// Forward speed, m/s.
    pub speed_mps: f64,
    /// Turn rate, rad/s.
    pub turn_radps: f64,
    /// What it tells the others.
    pub stopped: bool,
    /// It has noticed that it arrived.
    pub arrived: bool,
}

/// A run that is under way.
pub struct Run<'a> {
    program: &'a Program,
    obstacles: Vec<Obstacle>,
    robots: Vec<Robot>,
    neighbors: Vec<Neighbor>,
    outcome: Outcome,
    step: usize,
}

struct Robot {
    planner: Box<dyn Planner>,
    position: Point2<f64>,
    yaw_rad: f64,
    goal: Point2<f64>,
    /// Distance to the goal as of the previous cycle, m.
    last_m: f64,
    arrived: bool,
    stopped: bool,
}

impl<'a> Run<'a> {
    /// Everybody at the start.
    pub fn new(program: &'a Program, layout: &Layout) -> Run<'a> {
        let (_, pillar_m) = program.radii_m;
        let pillar = |(id, at): (usize, &Point2<f64>)| Obstacle {
            id: id as u32,
            shape: Capsule::disc(*at, pillar_m),
            velocity: Vector2::zeros(),
        };
        let mut run = Run {
            program,
            obstacles: layout.pillars.iter().enumerate().map(pillar).collect(),
            robots: Vec::new(),
            neighbors: Vec::new(),
            outcome: Outcome {
                steps: Vec::new(),
                path_m: Vec::new(),
                robots_m: f64::INFINITY,
                pillars_m: f64::INFINITY,
                poses: Vec::new(),
                dt_s: program.dt_s,
            },
            step: 0,
        };
        layout.jobs.iter().for_each(|job| run.join(job));
        run
    }

    /// Adds a robot.
    pub fn join(&mut self, job: &super::layouts::Job) {
        self.robots.push(Robot {
            planner: self.program.planner(self.robots.len() as u32),
            position: job.start,
            yaw_rad: job.heading_rad,
            goal: job.goal,
            last_m: f64::INFINITY,
            arrived: false,
            stopped: false,
        });
        self.outcome.steps.push(None);
        self.outcome.path_m.push(0.0);
    }

    /// Gives a robot another goal.
    pub fn send(&mut self, robot: usize, goal: Point2<f64>) {
        let robot_state = &mut self.robots[robot];
        (robot_state.goal, robot_state.last_m, robot_state.arrived) = (goal, f64::INFINITY, false);
        self.outcome.steps[robot] = None;
    }

    /// One cycle of everybody; and what it ordered.
    pub fn step(&mut self) -> Vec<Command> {
        self.step += 1;
        let mut commands = Vec::new();
        for i in 0..self.robots.len() {
            let command = self.plan(i);
            if self.program.in_turn {
                self.advance(i, &command);
            }
            commands.push(command);
        }
        if !self.program.in_turn {
            for (i, command) in commands.iter().enumerate() {
                self.advance(i, command);
            }
        }
        self.observe();
        commands
    }

    /// Runs until all have arrived, or for as long as the program gives it.
    pub fn finish(mut self) -> Outcome {
        while self.step < self.program.steps_max && !self.all_arrived() {
            self.step();
        }
        self.outcome
    }

    /// What came of it so far.
    pub fn outcome(&self) -> &Outcome {
        &self.outcome
    }

    /// Whether all have arrived.
    pub fn all_arrived(&self) -> bool {
        self.robots.iter().all(|robot| robot.arrived)
    }

    fn plan(&mut self, i: usize) -> Command {
        let (radius_m, _) = self.program.radii_m;
        let robot = &mut self.robots[i];
        // Arrival is noticed one cycle late.
        if robot.last_m < self.program.tolerance_m {
            self.outcome.steps[i].get_or_insert(self.step);
            return Command { speed_mps: 0.0, turn_radps: 0.0, stopped: true, arrived: true };
        }
        robot.last_m = (robot.goal - robot.position).norm();
        self.neighbors.clear();
        for (id, other) in self.robots.iter().enumerate().filter(|(id, _)| *id != i) {
            self.neighbors.push(Neighbor {
                id: id as u32,
                position: other.position,
                yaw_rad: other.yaw_rad,
                velocity: Vector2::zeros(),
                radius_m,
                age_s: 0.0,
                remaining_m: (other.goal - other.position).norm(),
                arrived: other.arrived,
                stopped: other.stopped,
            });
        }
        let robot = &mut self.robots[i];
        let plan = robot.planner.plan(&PlanInput {
            tick: self.step as u64,
            dt_s: self.program.dt_s,
            position: robot.position,
            yaw_rad: robot.yaw_rad,
            velocity: Vector2::zeros(),
            radius_m,
            kind: BodyKind::Unicycle,
            limits: LIMITS,
            goal: robot.goal,
            goal_tolerance_m: self.program.tolerance_m,
            goal_yaw_rad: None,
            goal_yaw_tolerance_rad: 0.1,
            arrived: false,
            obstacles: &self.obstacles,
            neighbors: &self.neighbors,
            map: &self.obstacles,
            arm: None,
        });
        match plan.drive {
            Drive::Twist { speed_mps, turn_radps } => {
                Command { speed_mps, turn_radps, stopped: plan.stopped, arrived: false }
            }
            other => unreachable!("a unicycle gets a twist, not {other:?}"),
        }
    }

    fn advance(&mut self, i: usize, command: &Command) {
        let (v, w) = (command.speed_mps, command.turn_radps);
        let robot = &mut self.robots[i];
        let dt = self.program.dt_s / f64::from(self.program.substeps);
        for _ in 0..self.program.substeps {
            let (sin, cos) = robot.yaw_rad.sin_cos();
            robot.position += Vector2::new(v * cos * dt, v * sin * dt);
            robot.yaw_rad += w * dt;
            self.outcome.path_m[i] += v * dt;
        }
        (robot.stopped, robot.arrived) = (command.stopped, command.arrived);
    }

    fn observe(&mut self) {
        for (i, robot) in self.robots.iter().enumerate() {
            for other in &self.robots[i + 1..] {
                self.outcome.robots_m = self.outcome.robots_m.min((other.position - robot.position).norm());
            }
            for pillar in &self.obstacles {
                let distance = (pillar.shape.a - robot.position).norm();
                self.outcome.pillars_m = self.outcome.pillars_m.min(distance);
            }
        }
        let poses = self.robots.iter().map(|robot| [robot.position.x, robot.position.y, robot.yaw_rad]);
        self.outcome.poses.push(poses.collect());
    }
}
