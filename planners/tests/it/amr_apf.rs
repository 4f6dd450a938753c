//! AMR-APF and DAPF: what the rows of `reproduce` do not say.

use crate::inputs::{IDENTITY, Scene, build, disc, robot};
use model::{BodyKind, Drive, ParamValue, ParamValues};
use shoal_planners::{Identity, Plan, Planner};

const DT_S: f64 = 0.1;

/// A unicycle of the authors' size at the origin, facing +x.
fn unicycle(goal: [f64; 2]) -> Scene {
    let mut scene = Scene { kind: BodyKind::Unicycle, radius_m: 0.22, ..Scene::new([0.0, 0.0], goal) };
    scene.limits.speed_mps_max = 0.2;
    scene.limits.turn_radps_max = 1.0;
    scene
}

fn twist(plan: &Plan) -> (f64, f64) {
    match plan.drive {
        Drive::Twist { speed_mps, turn_radps } => (speed_mps, turn_radps),
        other => panic!("a unicycle's drive, not {other:?}"),
    }
}

fn plan(method: &str, params: &str, scene: &Scene) -> Plan {
    build(method, params, IDENTITY).plan(&scene.input(0, DT_S))
}

/// Drives a scene on until `ticks` have passed; where it ends.
fn drive(planner: &mut dyn Planner, scene: &mut Scene, ticks: u64) {
    for tick in 0..ticks {
        let (v, w) = twist(&planner.plan(&scene.input(tick, DT_S)));
        scene.position += v * DT_S * nalgebra::Vector2::new(scene.yaw_rad.cos(), scene.yaw_rad.sin());
        scene.yaw_rad += w * DT_S;
    }
}

/// With sgn(0) = 0 the programs push a robot that faces a pillar exactly towards it, and creep into it.
#[test]
fn a_robot_that_faces_an_obstacle_exactly_goes_round_it() {
    for (params, passes) in [("", true), ("preset = \"p\"\nsgn_zero = true", false)] {
        let mut scene = unicycle([3.0, 0.0]);
        scene.obstacles = vec![disc(0, [1.5, 0.0], 0.11)];
        let mut planner = build("amr-apf", params, IDENTITY);
        let mut nearest = f64::INFINITY;
        for _ in 0..400 {
            drive(&mut *planner, &mut scene, 1);
            nearest = nearest.min((scene.position - scene.obstacles[0].shape.a).norm());
        }
        assert_eq!(nearest > 0.33, passes, "{params}: {nearest:.3}");
        if passes {
            assert!((scene.position - scene.goal).norm() < 0.1, "{:?}", scene.position);
        }
    }
}

/// The values of a preset are what is not given.
#[test]
fn a_preset_sets_what_is_not_given() {
    let mut scene = unicycle([3.0, 0.3]);
    scene.obstacles = vec![disc(0, [0.6, 0.08], 0.11)];
    let of = |params: &str| plan("amr-apf", params, &scene);
    assert_ne!(of("preset = \"c1\""), of("preset = \"p\""));
    assert_ne!(of("preset = \"p\""), of("preset = \"h\""));
    // C1 differs from P by its k_o here, and by how force becomes speed.
    let p_as_c1 = "preset = \"p\"\nk_o = 2.0\nspeed_rule = \"lifted\"\nturn_gain = 3.0";
    assert_eq!(of(p_as_c1).repulsive, of("preset = \"c1\"").repulsive);
    assert_eq!(of(p_as_c1).drive, of("preset = \"c1\"").drive);
    let wrong = ParamValues::from([("preset".to_owned(), ParamValue::Choice("c2".to_owned()))]);
    for method in ["amr-apf", "dapf"] {
        let method = shoal_planners::find(method).expect("it is registered");
        assert!((method.build)(&wrong, IDENTITY).is_err());
    }
}

/// A margin makes a small body as wide as the authors' robot.
#[test]
fn a_margin_is_part_of_every_robots_radius() {
    for (method, wide, narrow) in [
        ("amr-apf", "safety_m = 0.07", "safety_m = 0.07\nmargin_m = 0.1"),
        ("dapf", "safety_m = 0.07", "safety_m = 0.07\nmargin_m = 0.1"),
    ] {
        let mut scene = unicycle([3.0, 0.3]);
        scene.obstacles = vec![disc(0, [0.6, 0.3], 0.11)];
        scene.neighbors = vec![robot(1, [0.6, -0.4])];
        let as_wide = plan(method, wide, &scene).repulsive;
        scene.radius_m -= 0.1;
        scene.neighbors[0].radius_m -= 0.1;
        assert!((plan(method, narrow, &scene).repulsive - as_wide).norm() < 1e-9, "{method}");
    }
}

/// A crowd that stands around a robot holds it, but not for ever.
#[test]
fn a_crowd_does_not_hold_a_robot_for_ever() {
    let mut scene = unicycle([9.0, 0.0]);
    scene.neighbors =
        [[0.8, 0.6], [0.8, -0.6], [-0.8, 0.6], [-0.8, -0.6]].into_iter().zip(1..).map(|(p, id)| robot(id, p)).collect();
    let mut planner = build("amr-apf", "preset = \"fixed\"\ncrowd_wait_s = 2.0\nc_adj = 4.0", IDENTITY);
    let mut stopped = (0..60).map(|tick| planner.plan(&scene.input(tick, DT_S)).stopped);
    assert_eq!(stopped.by_ref().take_while(|stopped| *stopped).count(), 20);
    assert!(stopped.take(19).all(|stopped| !stopped));
    let mut for_ever = build("amr-apf", "preset = \"p\"\nc_adj = 4.0", IDENTITY);
    assert!((0..200).all(|tick| for_ever.plan(&scene.input(tick, DT_S)).stopped));
}

/// Of two robots the one with the shorter way waits, if asked to; of two equal ones the higher slot.
#[test]
fn the_baseline_can_yield() {
    let mut scene = unicycle([3.0, 0.0]);
    scene.neighbors = vec![robot(1, [0.45, 0.0])];
    for (remaining_m, arrived, slot, params, waits) in [
        (4.0, false, 0, "right_of_way = true", true),
        (2.0, false, 0, "right_of_way = true", false),
        (3.0, false, 0, "right_of_way = true", false),
        (3.0, false, 2, "right_of_way = true", true),
        (4.0, true, 0, "right_of_way = true", false),
        (4.0, false, 0, "", false),
    ] {
        (scene.neighbors[0].remaining_m, scene.neighbors[0].arrived) = (remaining_m, arrived);
        let mut planner = build("dapf", params, Identity { robot: slot, ..IDENTITY });
        let plan = planner.plan(&scene.input(0, DT_S));
        assert_eq!(plan.stopped, waits, "{remaining_m} m, slot {slot}, {params}");
        assert_eq!(waits, plan.drive == Drive::stop(BodyKind::Unicycle));
    }
}

/// A robot that fell silent is in the way for a while, then forgotten.
#[test]
fn silence_makes_a_robot_an_obstacle_and_then_nothing() {
    let mut scene = unicycle([3.0, 0.0]);
    let alone = plan("amr-apf", "", &scene);
    scene.neighbors = vec![robot(1, [0.7, 0.1])];
    for (age_s, felt) in [(0.1, true), (1.0, true), (2.5, false)] {
        scene.neighbors[0].age_s = age_s;
        assert_eq!(plan("amr-apf", "", &scene) != alone, felt, "{age_s} s");
    }
}

#[test]
fn an_arrived_robot_stays() {
    let mut scene = unicycle([0.0, 0.0]);
    (scene.arrived, scene.neighbors) = (true, vec![robot(1, [0.3, 0.0])]);
    for method in ["amr-apf", "dapf"] {
        for kind in [BodyKind::Point, BodyKind::Unicycle] {
            scene.kind = kind;
            assert_eq!(plan(method, "", &scene), Plan { stopped: true, ..Plan::only(Drive::stop(kind)) });
        }
    }
}
