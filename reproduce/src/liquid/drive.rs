//! Runs of the methods, as a robot's process runs them, with the paper's own update order.

use crate::environment::{Environment, number, values};
use geometry::Capsule;
use model::{BodyKind, Drive, Limits, ParamValue, ParamValues};
use nalgebra::{Point2, Vector2};
use planners::liquid::field::clearance;
use planners::liquid::{Law, Liquid, LiquidOnline, Progress, offline, online};
use planners::{Identity, Obstacle, PlanInput, Planner};

const NOBODY: Identity = Identity { seed: 1, robot: 0, incarnation: 0 };
/// Points reported along a step, for clearances.
const SAMPLES: usize = 10;
/// Ticks of a run of the descent: no run of the paper's environments needs as many.
const TICKS_MAX: usize = 200_000;

/// An environment with the parameters of a descent.
#[derive(Clone)]
pub(super) struct Setup {
    pub(super) environment: Environment,
    /// Parameters of `liquid`, as they stand in the file, changed by an expectation.
    pub(super) params: toml::Table,
    /// Gives up after so many virtual obstacles.
    pub(super) budget: Option<usize>,
    /// Length of a round, s: how far moving obstacles get.
    pub(super) dt_s: f64,
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
    pub(super) fn of(environment: &Environment, changes: &toml::Table) -> Setup {
        let mut params = environment.params.get("liquid").cloned().unwrap_or_else(standard);
        params.extend(changes.clone());
        Setup { environment: environment.clone(), params, budget: None, dt_s: 0.1 }
    }

    /// The paper's law: the parameters that both variants have, without what is ours.
    fn common(&self) -> ParamValues {
        let number = |key| number(&self.params, key);
        let mut table = toml::Table::new();
        for (name, key) in [("step_m", "step"), ("k_o", "K_O"), ("k_t", "K_t"), ("k_v", "K_v"), ("v_r_m", "V_r")] {
            table.insert(name.into(), toml::Value::Float(number(key)));
        }
        table.insert("directions".into(), toml::Value::Integer(number("directions") as i64));
        table.insert("tolerance_steps".into(), toml::Value::Float(number("arrival_tolerance") / number("step")));
        table.insert("v_r_cap_steps".into(), toml::Value::Float(0.0));
        table.insert("no_jumping".into(), toml::Value::Boolean(false));
        table.insert("neighbors".into(), toml::Value::Boolean(false));
        // The specification tried up to 500 where a file has no budget.
        table.insert("virtual_max".into(), toml::Value::Integer(self.budget.unwrap_or(500) as i64));
        values(&table)
    }

    pub(super) fn law(&self) -> Law {
        self.liquid().law().clone()
    }

    fn liquid(&self) -> Liquid {
        let mut values = self.common();
        values.insert("fallbacks".into(), ParamValue::Int(0));
        values.insert("rounds_max".into(), ParamValue::Int(100_000));
        Liquid::new(offline::Params::from_values(&values).expect("the parameters fit"), NOBODY)
    }

    fn liquid_online(&self) -> LiquidOnline {
        let mut values = self.common();
        values.insert("lifetime_s".into(), ParamValue::Float(0.0));
        LiquidOnline::new(online::Params::from_values(&values).expect("the parameters fit"), NOBODY)
    }

    /// The obstacles at time `t`, s.
    pub(super) fn obstacles(&self, t: f64) -> Vec<Obstacle> {
        let disc = |(id, disc): (u32, &crate::environment::Disc)| Obstacle {
            id,
            shape: Capsule::disc(disc.center_at(t), disc.radius),
            velocity: (disc.center_at(t + self.dt_s) - disc.center_at(t)) / self.dt_s,
        };
        (0..).zip(&self.environment.obstacles).map(disc).collect()
    }

    /// Thinks, then drives what it found.
    pub(super) fn offline(&self) -> Descent {
        let mut liquid = self.liquid();
        let over = |liquid: &Liquid| liquid.search().progress() == Progress::Failed;
        let (arrives, path) = self.drive(&mut liquid, over);
        let search = liquid.search();
        // Driving found is driving thought, step for step.
        assert!(!arrives || path.len() == search.path().len(), "{}", self.environment.name);
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
        let mut liquid = self.liquid_online();
        let (arrives, path) = self.drive(&mut liquid, LiquidOnline::gave_up);
        Descent {
            arrives,
            virtual_obstacles: liquid.virtual_obstacles().to_vec(),
            rounds: liquid.rounds(),
            last_run: path.len() - 1,
            path,
            failed_runs: Vec::new(),
        }
    }

    /// A point robot that makes a step in a tick, until it is at the goal, or until `over`.
    fn drive<P: Planner>(&self, planner: &mut P, over: impl Fn(&P) -> bool) -> (bool, Vec<Point2<f64>>) {
        let robot = &self.environment.robots[0];
        let tolerance = number(&self.params, "arrival_tolerance");
        let speed_mps_max = number(&self.params, "step") / self.dt_s;
        let mut path = vec![robot.start];
        let mut q = robot.start;
        let still = self.environment.obstacles.iter().all(|disc| disc.motion.is_none());
        let mut obstacles = self.obstacles(0.0);
        for tick in 0..TICKS_MAX {
            if (q - robot.goal).norm() <= tolerance {
                return (true, path);
            }
            if !still {
                obstacles = self.obstacles(tick as f64 * self.dt_s);
            }
            let map = if still { &*obstacles } else { &[] };
            let input = PlanInput {
                goal_tolerance_m: tolerance,
                goal_yaw_rad: None,
                goal_yaw_tolerance_rad: 0.1,
                ..input(tick, self.dt_s, q, Vector2::zeros(), robot, speed_mps_max, &obstacles, map)
            };
            let Drive::Velocity(velocity) = planner.plan(&input).drive else { panic!("a point gets a velocity") };
            if velocity != Vector2::zeros() {
                q += velocity * self.dt_s;
                path.push(q);
            } else if over(planner) {
                break;
            }
        }
        (false, path)
    }
}

/// The parameters of all environments that have any.
fn standard() -> toml::Table {
    crate::environment::environment("liquid_free").params("liquid").clone()
}

#[expect(clippy::too_many_arguments, reason = "each is a field of the input, in its order")]
fn input<'a>(
    tick: usize,
    dt_s: f64,
    position: Point2<f64>,
    velocity: Vector2<f64>,
    robot: &crate::environment::Robot,
    speed_mps_max: f64,
    obstacles: &'a [Obstacle],
    map: &'a [Obstacle],
) -> PlanInput<'a> {
    PlanInput {
        tick: tick as u64,
        dt_s,
        position,
        yaw_rad: 0.0,
        velocity,
        radius_m: robot.radius,
        kind: BodyKind::Point,
        limits: Limits {
            speed_mps_max,
            reverse_mps_max: 0.0,
            turning_radius_m_min: 0.0,
            turn_radps_max: 0.0,
            accel_mps2_max: f64::INFINITY,
            turn_accel_radps2_max: f64::INFINITY,
        },
        goal: robot.goal,
        goal_tolerance_m: robot.arrival_tolerance,
        goal_yaw_rad: None,
        goal_yaw_tolerance_rad: 0.1,
        arrived: false,
        obstacles,
        neighbors: &[],
        map,
        arm: None,
    }
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
    pub(super) fn clearance(&self, environment: &Environment) -> f64 {
        let obstacles = Setup::of(environment, &toml::Table::new()).obstacles(0.0);
        let radius = environment.robots[0].radius;
        let along = |ends: &[Point2<f64>]| {
            let point = |k: usize| ends[0] + (ends[1] - ends[0]) * (k as f64 / SAMPLES as f64);
            (0..=SAMPLES).map(|k| clearance(&obstacles, radius, point(k))).fold(f64::INFINITY, f64::min)
        };
        self.path.windows(2).map(along).fold(f64::INFINITY, f64::min)
    }
}

/// A run of Khatib's field.
#[derive(Clone, Debug)]
pub(super) struct Khatib {
    pub(super) arrival_s: Option<f64>,
    pub(super) path: Vec<Point2<f64>>,
    pub(super) dt_s: f64,
}

impl Khatib {
    /// Runs a parameter set of an environment.
    pub(super) fn run(environment: &Environment, set: &str) -> Khatib {
        let table = environment.params(set);
        let number = |key| number(table, key);
        let second = number("order") == 2.0;
        let float = |name: &str, value: f64| (name.to_owned(), ParamValue::Float(value));
        let mut params: ParamValues = [
            float("k_att", number("k_p")),
            float("attract_cap_m", 0.0),
            float("k_rep", number("eta")),
            float("influence_m", number("rho0")),
        ]
        .into();
        let order = if second { "second" } else { "first" };
        params.insert("order".into(), ParamValue::Choice(order.into()));
        if second {
            params.extend([float("damping", number("k_v"))]);
        }
        let speed_mps_max = if second { f64::INFINITY } else { number("v_max") };
        let speed_arrived = if second { number("arrival_speed") } else { f64::INFINITY };
        let (dt_s, t_max_s, tolerance) = (number("dt"), number("t_max"), number("arrival_tolerance"));

        let method = planners::find("apf").expect("the method exists");
        let mut planner = (method.build)(&params, NOBODY).expect("the parameters fit");
        let obstacles = Setup::of(environment, &toml::Table::new()).obstacles(0.0);
        let robot = &environment.robots[0];
        let (mut q, mut v) = (robot.start, Vector2::zeros());
        let mut run = Khatib { arrival_s: None, path: vec![q], dt_s };
        let ticks = (t_max_s / dt_s).round() as usize;
        for tick in 0..ticks {
            let input = input(tick, dt_s, q, v, robot, speed_mps_max, &obstacles, &obstacles);
            let Drive::Velocity(velocity) = planner.plan(&input).drive else { panic!("a point gets a velocity") };
            v = velocity;
            q += v * dt_s;
            run.path.push(q);
            if (q - robot.goal).norm() <= tolerance && v.norm() < speed_arrived {
                run.arrival_s = Some((tick + 1) as f64 * dt_s);
                break;
            }
        }
        run
    }

    pub(super) fn end(&self) -> Point2<f64> {
        self.path[self.path.len() - 1]
    }

    pub(super) fn distance_to_goal(&self, environment: &Environment) -> f64 {
        (self.end() - environment.robots[0].goal).norm()
    }

    /// Size of the box visited in the last 10 s, m.
    pub(super) fn tail_extent(&self) -> f64 {
        let ticks = (10.0 / self.dt_s).round() as usize;
        let tail = &self.path[self.path.len().saturating_sub(ticks)..];
        let (mut low, mut high) = (tail[0], tail[0]);
        for p in tail {
            (low, high) = (low.inf(p), high.sup(p));
        }
        (high - low).amax()
    }
}
