//! The authors' runs without their simulator: perfect poses, a kinematic unicycle, the programs' own order of planning
//! and moving.

use super::layouts::radii_m;
use crate::scene::Scene;
use crate::stepper::{Arrival, Body, Rules, Stepper};
use geometry::Capsule;
use model::random::Stream;
use model::{Obstacle, Robot, Scenario, Shape};
use nalgebra::{Point2, Vector2};
use planners::amr_apf::{self, AmrApf};
use planners::dapf::{self, Dapf};
use planners::{Identity, Planner};

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
    pub fn run(&self, layout: &Scene) -> Outcome {
        self.finish(self.begin(layout))
    }

    /// A layout with everybody at the start.
    pub fn begin(&self, layout: &Scene) -> Stepper {
        self.stepper(layout, |robot| self.planner(robot))
    }

    /// The same with these planners.
    pub(super) fn stepper<P: Planner>(&self, layout: &Scene, planner: impl Fn(u32) -> P) -> Stepper<P> {
        let scenario = self.scenario(layout);
        let planners = (0..scenario.robots.len() as u32).map(planner).collect();
        let rules = Rules {
            in_turn: self.in_turn,
            substeps: self.substeps,
            turns_first: false,
            velocities: false,
            arrival: Arrival::Noticed,
            ..Rules::snapshot(self.dt_s)
        };
        Stepper::with_planners(&scenario, rules, planners)
    }

    /// Runs until all have arrived, or for as long as the program gives it.
    pub fn finish(&self, mut stepper: Stepper) -> Outcome {
        stepper.run(self.steps_max);
        let robots = 0..stepper.bodies().len();
        Outcome {
            path_m: robots.map(|robot| stepper.path_length(robot)).collect(),
            steps: stepper.arrival_ticks,
            robots_m: stepper.robots.centres_m,
            pillars_m: stepper.obstacles.centres_m,
            poses: stepper.history.split_off(1),
            dt_s: self.dt_s,
        }
    }

    /// The scenario of a layout, with what the program takes robots and pillars for.
    fn scenario(&self, layout: &Scene) -> Scenario {
        let (mut scenario, (_, pillar_m)) = (layout.scenario.clone(), self.radii_m);
        let pillars = scenario.obstacles.iter().map(|pillar| pillar.shape.reference());
        let discs = pillars.chain(layout.paper.added_discs.iter().copied());
        let disc = |at| Obstacle { shape: Shape::Capsule(Capsule::disc(at, pillar_m)), motion: None };
        scenario.obstacles = discs.map(disc).collect();
        scenario.robots.iter_mut().for_each(|robot| self.prepare(robot));
        scenario
    }

    /// Makes a robot what the program takes it for.
    pub fn prepare(&self, robot: &mut Robot) {
        (robot.radius_m, robot.goal_tolerance_m) = (self.radii_m.0, self.tolerance_m);
    }

    /// Runs a layout this often, with every start moved by up to `size_m` in x and in y.
    pub fn run_jittered(&self, layout: &Scene, seeds: u64, size_m: f64) -> Vec<Outcome> {
        (1..=seeds).map(|seed| self.run(&jittered(layout, seed, size_m))).collect()
    }

    /// The layout this often with everything moved by up to `size_m`, and with every choice among equally small
    /// rectangles around three robots. With the 0.05 mm to which layouts are stored, the results are as good as the
    /// nominal one.
    pub fn run_nearby(&self, layout: &Scene, seeds: u64, size_m: f64) -> Vec<Outcome> {
        let layouts: Vec<Scene> = (1..=seeds).map(|seed| all_moved(layout, seed, size_m)).collect();
        let programs = match &self.method {
            Method::Amr(params) if self.has_ties() => (0..=3)
                .map(|rectangle_tie| Method::Amr(amr_apf::Params { rectangle_tie, ..params.clone() }))
                .map(|method| Program { method, ..self.clone() })
                .collect(),
            _ => vec![self.clone()],
        };
        programs.iter().flat_map(|program| layouts.iter().map(|layout| program.run(layout))).collect()
    }

    /// Whether it may have to choose among equally small rectangles.
    pub fn has_ties(&self) -> bool {
        matches!(&self.method, Method::Amr(params) if params.circle == amr_apf::Circle::Rectangle)
    }

    /// The planner of a robot.
    pub fn planner(&self, robot: u32) -> Box<dyn Planner> {
        let identity = Identity { seed: 1, robot, incarnation: 0 };
        match &self.method {
            Method::Amr(params) => Box::new(AmrApf::new(params.clone(), identity)),
            Method::Dapf(params) => Box::new(Dapf::new(params.clone(), identity)),
        }
    }
}

/// A vector with components of up to this size, from a stream of one's own.
fn offset(stream: &mut Stream, size_m: f64) -> Vector2<f64> {
    Vector2::new(stream.between(-size_m, size_m), stream.between(-size_m, size_m))
}

/// The layout with every start moved.
pub fn jittered(layout: &Scene, seed: u64, size_m: f64) -> Scene {
    let mut layout = layout.clone();
    for (slot, robot) in layout.scenario.robots.iter_mut().enumerate() {
        robot.start += offset(&mut Stream::new(seed, slot as u32, 0, "amr-apf jitter"), size_m);
    }
    layout
}

/// The layout with starts, goals and pillars moved.
fn all_moved(layout: &Scene, seed: u64, size_m: f64) -> Scene {
    let mut stream = Stream::new(seed, 0, 0, "amr-apf nearby");
    let mut moved = |p: &mut Point2<f64>| *p += offset(&mut stream, size_m);
    let mut layout = layout.clone();
    for pillar in &mut layout.scenario.obstacles {
        let mut at = pillar.shape.reference();
        moved(&mut at);
        pillar.shape = Shape::Capsule(Capsule::disc(at, 0.0));
    }
    layout.paper.added_discs.iter_mut().for_each(&mut moved);
    for robot in &mut layout.scenario.robots {
        moved(&mut robot.start);
        robot.goals.iter_mut().for_each(&mut moved);
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
    /// All robots after each cycle.
    pub poses: Vec<Vec<Body>>,
    /// Control period, s.
    pub dt_s: f64,
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
