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
    let note = "not in the specification: our planner as a robot runs it, 1 m/s, ticks of 0.05 s, plan in pieces";
    for (name, oracle) in [("pso_mass_point_1", 11.087), ("pso_mass_point_2", 11.401)] {
        for kind in [BodyKind::Point, BodyKind::Unicycle] {
            let outcome = run(scene(name), kind);
            let item = |what: &str| Item::new(format!("{name} as a robot, {kind:?}: {what}")).note(note);
            rows.exact(item("arrives"), true, outcome.all_arrived());
            let driven = tidy(outcome.path_length(0));
            // It stops 0.1 m before the goal.
            rows.number(item("path driven"), oracle, driven, 0.3, "m");
            let ok = outcome.obstacles.clearance_m >= 0.05;
            let clearance = format!("{} m", tidy(outcome.obstacles.clearance_m));
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
    let experiment = Experiment::new(scene(name));
    let run = run_arm(&experiment, elbow);
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
