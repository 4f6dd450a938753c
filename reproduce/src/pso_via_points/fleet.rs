//! The method as a robot runs it: the same `Planner`, tick by tick, with its plan made in pieces.

use super::experiment::Experiment;
use crate::environment::{Environment, environment};
use crate::row::{Item, Rows};
use crate::simulate::{Outcome, Run, tidy};
use geometry::{ArmState, Elbow};
use model::{BodyKind, Drive, Limits, ParamValues};
use nalgebra::Vector2;
use planners::{Identity, PlanInput, find};

/// Length of a tick, s.
const DT_S: f64 = 0.05;
/// Limits of the arm: the tip's speed and the joints' rates.
const ARM_LIMITS: Limits = Limits {
    speed_mps_max: 1.0,
    reverse_mps_max: 0.0,
    turning_radius_m_min: 0.0,
    turn_radps_max: 2.0,
    accel_mps2_max: f64::INFINITY,
    turn_accel_radps2_max: f64::INFINITY,
};

/// A robot of an environment that plans with this method and its default parameters, at 1 m/s.
pub fn run(environment: &Environment, kind: BodyKind) -> Outcome {
    let run = Run {
        environment,
        method: "pso-via-points",
        params: ParamValues::new(),
        kind,
        seed: 1,
        delay_ticks: 1,
        age_known: true,
        speed_mps_max: 1.0,
        dt_s: DT_S,
        t_max_s: 60.0,
    };
    run.run()
}

/// What became of an arm.
#[derive(Debug)]
pub struct ArmRun {
    /// Its joints after every tick, from the start on, rad.
    pub joints_rad: Vec<[f64; 2]>,
    /// When its tip arrived, s.
    pub arrival_s: Option<f64>,
    /// Smallest distance between its links and an obstacle, m.
    pub clearance_m: f64,
    /// Whether its joints always kept their limits, and never changed the sheet.
    pub within_limits: bool,
    /// How far its tip moved, m.
    pub tip_path_m: f64,
    /// Fastest joint, rad/s.
    pub joint_radps_max: f64,
}

/// The arm of an environment, started in this sheet, until it arrives or time is up.
pub fn run_arm(experiment: &Experiment, elbow: Elbow, t_max_s: f64) -> ArmRun {
    let method = find("pso-via-points").expect("the method exists");
    let identity = Identity { seed: 1, robot: 0, incarnation: 0 };
    let mut planner = (method.build)(&ParamValues::new(), identity).expect("defaults fit");
    let mut arm = experiment.arm_at(experiment.start, elbow);
    let shapes = || experiment.obstacles.iter().map(|obstacle| obstacle.shape);
    let mut run = ArmRun {
        joints_rad: vec![arm.joints_rad],
        arrival_s: None,
        clearance_m: f64::INFINITY,
        within_limits: true,
        tip_path_m: 0.0,
        joint_radps_max: 0.0,
    };
    let mut velocity = Vector2::zeros();
    for tick in 0..(t_max_s / DT_S) as u64 {
        let before = arm.tip();
        let drive = planner.plan(&input(experiment, &arm, velocity, tick)).drive.within(&ARM_LIMITS);
        let Drive::Joints { rate_radps } = drive else { panic!("an arm is asked for joint rates, not for {drive:?}") };
        arm = arm.moved(rate_radps, DT_S);
        velocity = (arm.tip() - before) / DT_S;
        run.joints_rad.push(arm.joints_rad);
        run.clearance_m = run.clearance_m.min(arm.geometry.clearance(arm.joints_rad, shapes()));
        run.within_limits &= arm.geometry.within_limits(arm.joints_rad, 0.0) && arm.elbow() == elbow;
        run.tip_path_m += (arm.tip() - before).norm();
        run.joint_radps_max = rate_radps.iter().fold(run.joint_radps_max, |fastest, rate| fastest.max(rate.abs()));
        if (arm.tip() - experiment.goal).norm() <= 0.1 {
            run.arrival_s = Some((tick + 1) as f64 * DT_S);
            break;
        }
    }
    run
}

fn input<'a>(experiment: &'a Experiment, arm: &ArmState, velocity: Vector2<f64>, tick: u64) -> PlanInput<'a> {
    PlanInput {
        tick,
        dt_s: DT_S,
        position: arm.tip(),
        yaw_rad: arm.joints_rad[0] + arm.joints_rad[1],
        velocity,
        radius_m: 0.0,
        kind: BodyKind::TwoLinkArm,
        limits: ARM_LIMITS,
        goal: experiment.goal,
        goal_tolerance_m: 0.1,
        goal_yaw_rad: None,
        goal_yaw_tolerance_rad: 0.1,
        arrived: false,
        obstacles: &experiment.obstacles,
        neighbors: &[],
        map: &experiment.obstacles,
        arm: Some(*arm),
    }
}

pub(super) fn rows(rows: &mut Rows<'_>) {
    let note = "not in the specification: our planner as a robot runs it, 1 m/s, ticks of 0.05 s, plan in pieces";
    for (name, oracle) in [("pso_mass_point_1", 11.087), ("pso_mass_point_2", 11.401)] {
        for kind in [BodyKind::Point, BodyKind::Unicycle] {
            let outcome = run(environment(name), kind);
            let item = |what: &str| Item::new(format!("{name} as a robot, {kind:?}: {what}")).note(note);
            rows.exact(item("arrives"), true, outcome.arrives());
            let driven = tidy(outcome.path_length(0));
            // It stops 0.1 m before the goal.
            rows.number(item("path driven"), oracle, driven, 0.3, "m");
            let ok = outcome.obstacle_clearance >= 0.05;
            let clearance = format!("{} m", tidy(outcome.obstacle_clearance));
            rows.push(item("clearance"), None, clearance, "at least half the margin, 0.05 m".to_owned(), ok);
        }
    }
    for (name, elbow, length_m) in [
        ("pso_arm_1", Elbow::Up, Some(11.34)),
        ("pso_arm_1", Elbow::Down, None),
        ("pso_arm_elbow_flip", Elbow::Up, None),
        ("pso_arm_elbow_flip", Elbow::Down, None),
    ] {
        arm_rows(rows, name, elbow, length_m, note);
    }
}

fn arm_rows(rows: &mut Rows<'_>, name: &str, elbow: Elbow, length_m: Option<f64>, note: &str) {
    let experiment = Experiment::new(environment(name));
    let run = run_arm(&experiment, elbow, 60.0);
    let item = |what: &str| Item::new(format!("{name} as a robot, elbow {elbow:?}: {what}")).note(note);
    rows.exact(item("joints keep their limits and the sheet"), true, run.within_limits);
    let touched = run.clearance_m < 0.0;
    rows.exact(item("a link touches an obstacle"), false, touched);
    // The stop of joint 1 lies in the only way that this sheet has.
    let refused = name == "pso_arm_elbow_flip" && elbow == Elbow::Up;
    rows.exact(item(if refused { "stays put" } else { "arrives" }), true, (run.arrival_s.is_none()) == refused);
    if refused {
        rows.number(item("distance moved"), 0.0, tidy(run.tip_path_m), 0.0, "m");
    } else if let Some(length_m) = length_m {
        // It stops 0.1 m before the goal, and drives on an early path while the swarm works.
        rows.number(item("path of the tip"), length_m, tidy(run.tip_path_m), 0.4, "m");
    } else {
        // The grid path of the sheet that its joints can follow, within the tolerance of a grid with eight directions.
        let ok = (15.0..=23.2).contains(&run.tip_path_m);
        let bound = "the way round, at most the grid path's 23.02 m and 1 %".to_owned();
        rows.push(
            item("path of the tip"),
            Some("23.021 m".to_owned()),
            format!("{} m", tidy(run.tip_path_m)),
            bound,
            ok,
        );
    }
}
