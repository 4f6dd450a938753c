//! Runs of the methods, as a robot's process runs them, in the paper's own order of updates.

use crate::scene::{Scene, discs, goal};
use crate::stepper::{Arrival, Rules, Run, Stepper};
use model::{ParamValue, ParamValues};
use nalgebra::{Point2, Vector2};
use planners::liquid::field::clearance;
use planners::liquid::{Law, Liquid, LiquidOnline, Progress, offline, online};
use planners::{Identity, Planner};

const IDENTITY: Identity = Identity { seed: 1, robot: 0, incarnation: 0 };
/// Length of a round, s: how far moving obstacles get.
const DT_S: f64 = 0.1;
/// Points reported along a step, for clearances.
const SAMPLES: usize = 10;
/// Ticks of a run of the descent: no run of the paper's scenes needs as many.
const TICKS_MAX: usize = 200_000;
/// Ways of the field give up after this time, s.
const FIELD_S: f64 = 120.0;

/// A scene with the parameters of a descent.
#[derive(Clone)]
pub(super) struct Setup {
    pub(super) scene: Scene,
    /// Parameters that are not the methods' defaults, which are the paper's.
    pub(super) changes: ParamValues,
    /// Gives up after this number of virtual obstacles; the specification tried up to 500 where a scene has no budget.
    pub(super) budget: u32,
}

/// What came of a descent.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Descent {
    pub(super) arrives: bool,
    pub(super) virtual_obstacles: Vec<Point2<f64>>,
    pub(super) rounds: usize,
    /// Where the robot was after each step that it drove, from its start on.
    pub(super) path: Vec<Point2<f64>>,
    /// Steps of the runs that were thought and not driven.
    pub(super) failed_runs: Vec<usize>,
    /// Steps of the run that was thought last: the one that is driven, unless the budget is used up.
    pub(super) last_run: usize,
}

impl Setup {
    pub(super) fn of(scene: &Scene, changes: &ParamValues) -> Setup {
        let mut setup = Setup { scene: scene.clone(), changes: changes.clone(), budget: 500 };
        let step_m = setup.law().step_m;
        let robot = setup.scene.robot_mut();
        // It makes a step in a tick, and arrives within one.
        (robot.goal_tolerance_m, robot.limits.speed_mps_max) = (step_m, step_m / DT_S);
        setup
    }

    /// The paper's law: the methods' defaults without what is ours.
    fn common(&self) -> ParamValues {
        let ours = [
            ("v_r_cap_steps", ParamValue::Float(0.0)),
            ("no_jumping", ParamValue::Bool(false)),
            ("neighbors", ParamValue::Bool(false)),
            ("virtual_max", ParamValue::Int(self.budget.into())),
        ];
        let ours = ours.map(|(name, value)| (name.to_owned(), value));
        ours.into_iter().chain(self.changes.clone()).collect()
    }

    pub(super) fn law(&self) -> Law {
        self.liquid().law().clone()
    }

    fn liquid(&self) -> Liquid {
        let mut values = self.common();
        values.insert("fallbacks".into(), ParamValue::Int(0));
        values.insert("rounds_max".into(), ParamValue::Int(100_000));
        Liquid::new(offline::Params::from_values(&values).expect("the parameters fit"), IDENTITY)
    }

    fn liquid_online(&self) -> LiquidOnline {
        let mut values = self.common();
        values.insert("lifetime_s".into(), ParamValue::Float(0.0));
        LiquidOnline::new(online::Params::from_values(&values).expect("the parameters fit"), IDENTITY)
    }

    /// Thinks, then drives what it found.
    pub(super) fn offline(&self) -> Descent {
        let over = |liquid: &Liquid| liquid.search().progress() == Progress::Failed;
        let stepper = self.drive(self.liquid(), over);
        let (arrives, path, search) = (stepper.all_arrived(), driven(&stepper), stepper.planners[0].search());
        // Driving found is driving thought, step for step.
        assert!(!arrives || path.len() == search.path().len(), "{}", self.scene.name);
        Descent {
            arrives,
            virtual_obstacles: search.virtual_obstacles().to_vec(),
            rounds: search.rounds(),
            path,
            failed_runs: search.failed_runs().to_vec(),
            last_run: search.path().len() - 1,
        }
    }

    /// Drives while it thinks.
    pub(super) fn online(&self) -> Descent {
        let stepper = self.drive(self.liquid_online(), LiquidOnline::gave_up);
        let (path, liquid) = (driven(&stepper), &stepper.planners[0]);
        Descent {
            arrives: stepper.all_arrived(),
            virtual_obstacles: liquid.virtual_obstacles().to_vec(),
            rounds: liquid.rounds(),
            last_run: path.len() - 1,
            path,
            failed_runs: Vec::new(),
        }
    }

    /// Runs until the robot is at the goal, or stands because all is `over`.
    fn drive<P: Planner>(&self, planner: P, over: impl Fn(&P) -> bool) -> Stepper<P> {
        let mut stepper = Stepper::with_planners(&self.scene.scenario, Rules::snapshot(DT_S), vec![planner]);
        while !stepper.all_arrived() && stepper.ticks() < TICKS_MAX {
            stepper.step();
            if stepper.bodies()[0].velocity == Vector2::zeros() && over(&stepper.planners[0]) {
                break;
            }
        }
        stepper
    }
}

/// Where the robot was, without the ticks in which it stood and thought.
fn driven<P>(stepper: &Stepper<P>) -> Vec<Point2<f64>> {
    let bodies = stepper.history.iter().map(|bodies| bodies[0]);
    bodies
        .enumerate()
        .filter(|(i, body)| *i == 0 || body.velocity != Vector2::zeros())
        .map(|(_, b)| b.position)
        .collect()
}

impl Descent {
    /// Steps driven.
    pub(super) fn steps(&self) -> usize {
        self.path.len() - 1
    }

    /// Virtual obstacles / rounds / steps.
    pub(super) fn counts(&self) -> String {
        format!("{}/{}/{}", self.virtual_obstacles.len(), self.rounds, self.steps())
    }

    /// Smallest distance to an inflated disc along the path, m.
    pub(super) fn clearance(&self, scene: &Scene) -> f64 {
        let (obstacles, radius_m) = (discs(&scene.scenario), scene.robot().radius_m);
        let along = |ends: &[Point2<f64>]| {
            let point = |k: usize| ends[0] + (ends[1] - ends[0]) * (k as f64 / SAMPLES as f64);
            (0..=SAMPLES).map(|k| clearance(&obstacles, radius_m, point(k))).fold(f64::INFINITY, f64::min)
        };
        self.path.windows(2).map(along).fold(f64::INFINITY, f64::min)
    }
}

/// Khatib's field, of first or second order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    First,
    Second,
}

/// A run of Khatib's field in a scene, with the gains and the ticks of the specification.
pub(super) fn khatib(scene: &Scene, order: Order) -> Stepper {
    let (dt_s, k_rep, influence_m, word) = match order {
        Order::First => (0.1, 1.0, 0.6, "first"),
        Order::Second => (0.01, 0.25, 0.8, "second"),
    };
    let params = [
        ("k_att", ParamValue::Float(1.0)),
        ("attract_cap_m", ParamValue::Float(0.0)),
        ("k_rep", ParamValue::Float(k_rep)),
        ("influence_m", ParamValue::Float(influence_m)),
        ("order", ParamValue::Choice(word.to_owned())),
        ("damping", ParamValue::Float(1.0)),
    ];
    let (speed_mps_max, speed_arrived_mps) = match order {
        Order::First => (1.0, f64::INFINITY),
        Order::Second => (f64::INFINITY, 0.2),
    };
    let run = Run::of(scene, "apf", &params).each(|robot| robot.limits.speed_mps_max = speed_mps_max);
    let rules = Rules { arrival: Arrival::Within { speed_mps: speed_arrived_mps }, ..Rules::snapshot(dt_s) };
    let mut stepper = Stepper::new(&run.scenario, rules);
    stepper.run((FIELD_S / dt_s).round() as usize);
    stepper
}

/// Size of the box visited in the last 10 s, m.
pub(super) fn tail_extent(stepper: &Stepper) -> f64 {
    let (path, ticks) = (stepper.path(0), (10.0 / stepper.rules.dt_s).round() as usize);
    let tail = &path[path.len().saturating_sub(ticks)..];
    let (mut low, mut high) = (tail[0], tail[0]);
    for p in tail {
        (low, high) = (low.inf(p), high.sup(p));
    }
    (high - low).amax()
}

/// Start and goal of the robot.
pub(super) fn ends(scene: &Scene) -> (Point2<f64>, Point2<f64>) {
    (scene.robot().start, goal(scene.robot()))
}
