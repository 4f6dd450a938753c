//! The method as a robot runs it: the same `Planner`, tick by tick, with its plan made in pieces.

use super::experiment::Experiment;
use crate::row::{Item, Rows};
use crate::scene::{Scene, scene};
use crate::stepper::{Rules, Run, Stepper, tidy};
use geometry::{ArmState, Elbow};
use model::BodyKind;

/// Length of a tick, s.
const DT_S: f64 = 0.05;
/// The runs give up after this time, s.
const LIMIT_S: f64 = 60.0;
/// How fast the joints of an arm turn at most, rad/s.
const ARM_RADPS: f64 = 2.0;

/// The robots of a scene plan with this method and its default parameters.
pub fn run(scene: &Scene, kind: BodyKind) -> Stepper {
    Run::as_in_a_fleet(scene, "pso-via-points", kind).run()
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
}

/// The arm of a scene, started in this sheet, until it arrives or time is up. Panics if it cannot start there.
pub fn run_arm(experiment: &Experiment, elbow: Elbow) -> ArmRun {
    let geometry = experiment.arm.expect("an arm");
    let run = Run { scenario: experiment.scenario.clone(), rules: Rules::snapshot(DT_S) }.for_seconds(LIMIT_S);
    let run = run.each(|robot| {
        let start_joints_rad = geometry.inverse(experiment.start, elbow).expect("the tip is within reach");
        robot.arm = robot.arm.map(|arm| model::ArmSetup { start_joints_rad, ..arm });
        robot.start = geometry.tip(start_joints_rad);
        (robot.start_yaw_rad, robot.limits.turn_radps_max) = (start_joints_rad[0] + start_joints_rad[1], ARM_RADPS);
    });
    let stepper = run.run();
    let joints_rad: Vec<[f64; 2]> = stepper.history.iter().filter_map(|bodies| bodies[0].joints_rad).collect();
    let shapes = || experiment.obstacles.iter().map(|obstacle| obstacle.shape);
    let moved = || joints_rad[1..].iter();
    let in_sheet = |joints: &[f64; 2]| ArmState { geometry, joints_rad: *joints }.elbow() == elbow;
    ArmRun {
        arrival_s: stepper.arrival_s(0),
        clearance_m: moved().map(|joints| geometry.clearance(*joints, shapes())).fold(f64::INFINITY, f64::min),
        within_limits: moved().all(|joints| geometry.within_limits(*joints, 0.0) && in_sheet(joints)),
        tip_path_m: stepper.path_length(0),
        joints_rad,
    }
}

pub(super) fn rows(rows: &mut Rows<'_>) {
    rows.about(
        "specification, section 4 (the swarm's mean length) and section 7",
        "planner pso-via-points with default parameters as a robot runs it: 1 m/s, ticks of 0.05 s, the plan in pieces",
        "ours: 0.3 m, 0.4 m for an arm. It stops 0.1 m before the goal, and drives on an early path while the swarm works",
    );
    for (name, specified) in [("pso_mass_point_1", 11.087), ("pso_mass_point_2", 11.401)] {
        for kind in [BodyKind::Point, BodyKind::Unicycle] {
            let outcome = run(scene(name), kind);
            let item = Item::new(format!("{name} as a robot, {kind:?}: path driven to the goal"));
            let driven = if outcome.all_arrived() { tidy(outcome.path_length(0)) } else { f64::NAN };
            rows.number(item, specified, driven, 0.3, "m");
        }
    }
    // The grid's shortest paths in one sheet, the stops of joint 1 kept: 11.657 m and 23.021 m, or none.
    for (name, elbow, specified) in [
        ("pso_arm_1", Elbow::Up, Some((11.304, 0.4))),
        ("pso_arm_elbow_flip", Elbow::Down, Some((23.021, 1.2))),
        ("pso_arm_elbow_flip", Elbow::Up, None),
    ] {
        let run = run_arm(&Experiment::new(scene(name)), elbow);
        let item = Item::new(format!("{name} as a robot, elbow {elbow:?}: path of the tip to the goal"));
        let item = item.note("within the limits of the joints and one sheet, no link touching an obstacle");
        let executed = run.within_limits && run.clearance_m >= 0.0;
        let length_m = run.tip_path_m;
        match specified {
            Some((specified_m, tolerance_m)) => {
                let driven = if run.arrival_s.is_some() && executed { tidy(length_m) } else { f64::NAN };
                let why =
                    "ours: 0.4 m; against a path on a grid with eight directions 5 %, by which that is longer at most";
                rows.number(item.why(why), specified_m, driven, tolerance_m, "m");
            }
            None => {
                let item =
                    item.note("the way is not executable: a stop of joint 1 lies in the only way that this sheet has");
                let ours = if run.arrival_s.is_none() && length_m == 0.0 { "stays put" } else { "moves" };
                rows.exact(item, "not executable: stays put".to_owned(), format!("not executable: {ours}"));
            }
        }
    }
}
