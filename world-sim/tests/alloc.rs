//! A tick in which nothing special happens asks for no memory.

#[path = "../../tests/counting.rs"]
mod counting;

use counting::calls;
use geometry::{ArmGeometry, Capsule};
use model::*;
use model::{BodyKind, Drive, Dynamics, Limits};
use nalgebra::{Point2, Vector2};
use shoal_world_sim::World;

/// Robots on circles beside each other that drift in and out of range, past an obstacle that moves.
fn rings(count: usize) -> Scenario {
    let limits = Limits {
        speed_mps_max: 2.0,
        reverse_mps_max: 0.0,
        turning_radius_m_min: 0.0,
        turn_radps_max: 2.0,
        accel_mps2_max: f64::INFINITY,
        turn_accel_radps2_max: f64::INFINITY,
    };
    let robot = |slot: usize| Robot {
        id: format!("r{slot}"),
        kind: BodyKind::Point,
        limits,
        arm: None,
        wheels: None,
        dynamics: Dynamics::default(),
        radius_m: 0.1,
        start: Point2::new(3.0 * slot as f64, 0.0),
        start_yaw_rad: 0.0,
        goals: vec![Point2::new(0.0, 99.0)],
        goal_yaw_rad: None,
        goal_yaw_tolerance_rad: 0.1,
        rounds: Some(1),
        goal_motion: None,
        goal_tolerance_m: 0.1,
        planner: "straight".to_owned(),
        params: Default::default(),
        filter: model::FilterKind::None,
        sensor_range_m: 3.0,
        radio_range_m: 3.5,
        radio_hysteresis_m: 0.1,
        sees_robots: true,
        knows_map: false,
        restart: Restart::NEVER,
        agent: None,
    };
    let motion = Motion::Orbit { center: [9.0, 8.0].into(), radius_m: 4.0, omega_radps: 1.0, phase_rad: 0.0 };
    let disc = Shape::Capsule(Capsule::disc(Point2::new(9.0, 8.0), 0.5));
    Scenario {
        name: "rings".to_owned(),
        description: String::new(),
        bounds: Bounds { x_m: [-5.0, 50.0], y_m: [-5.0, 20.0] },
        physics: model::Physics::Kinematic,
        clock: Clock { mode: Mode::Single, tick_hz: 50.0, seed: 1, ticks_max: 10_000, stop: Stop::Duration },
        fleet: Fleet {
            max_robots: count,
            straggler: StragglerPolicy::Hold,
            straggler_limit_s: 1.0,
            stuck_limit_s: 60.0,
            command_timeout_s: 1.0,
            start_limit_s: 1.0,
        },
        processes: Processes::default(),
        radio: Radio::PERFECT,
        obstacles: vec![Obstacle { shape: disc, motion: Some(motion) }],
        template: robot(0),
        map: None,
        templates_of_others: Vec::new(),
        robots: (0..count).map(robot).collect(),
        events: Vec::new(),
        warnings: Vec::new(),
        expect: Expect::default(),
    }
}

#[test]
fn steady_ticks_do_not_allocate() {
    check(&rings(12));
}

/// Arms that turn to and fro beside the rings, and touch nothing.
#[test]
fn arms_do_not_allocate_either() {
    let mut scenario = rings(12);
    for (slot, joints_rad) in [(12u32, [0.5, 0.5]), (13, [2.0, -0.5])] {
        let geometry = ArmGeometry {
            base: Point2::new(20.0 + 8.0 * (f64::from(slot) - 12.0), 6.3),
            links_m: [2.0, 1.5],
            link_radius_m: 0.1,
            joint_min_rad: [0.0, -1.5],
            joint_max_rad: [6.0, 1.5],
        };
        let mut robot = scenario.robots[0].clone();
        (robot.id, robot.kind) = (format!("arm{slot}"), BodyKind::TwoLinkArm);
        robot.arm = Some(ArmSetup { geometry, start_joints_rad: joints_rad });
        scenario.robots.push(robot);
    }
    scenario.fleet.max_robots = 14;
    check(&scenario);
}

fn check(scenario: &Scenario) {
    let mut world = World::new(scenario);
    let mut changes = 0;
    let mut tick = |world: &mut World| {
        world.due();
        let opening = world.open(&mut |_| true);
        changes += opening.neighbors.len() + opening.sensed.len();
        let angle = world.tick() as f64 / 50.0;
        world.close(&mut |instance| {
            let angle = angle + f64::from(instance.index.0);
            Some(match scenario.robots[instance.index.at()].kind {
                BodyKind::TwoLinkArm => Drive::Joints { rate_radps: [0.3 * angle.cos(), angle.sin()] },
                _ => Drive::Velocity(Vector2::new(angle.cos(), angle.sin())),
            })
        });
        assert!(!world.finished());
        world.take_notices().len()
    };
    // Two rounds to see every list at its longest, then one that must do with what there is.
    (0..630).for_each(|_| _ = tick(&mut world));
    let before = calls();
    let notices: usize = (0..315).map(|_| tick(&mut world)).sum();
    assert_eq!((calls() - before, notices), (0, 0));
    assert!(changes > 100, "the lists did change: {changes}");
}
