//! The two-link arm: limits, and what methods do that do not know arms.

use crate::inputs::{LIMITS, Scene, every_method};
use geometry::{ArmGeometry, ArmState, Elbow};
use model::{BodyKind, Drive};
use nalgebra::Vector2;
use std::f64::consts::{PI, TAU};

fn geometry(base: [f64; 2], links_m: [f64; 2], low: [f64; 2], high: [f64; 2]) -> ArmGeometry {
    ArmGeometry { base: base.into(), links_m, link_radius_m: 0.05, joint_min_rad: low, joint_max_rad: high }
}

/// The paper's arm.
pub(crate) fn papers() -> ArmGeometry {
    ArmGeometry { link_radius_m: 0.0, ..geometry([0.0, 0.0], [3.5, 3.5], [0.0, -PI / 2.0], [TAU, PI / 2.0]) }
}

#[test]
fn rates_move_the_tip_and_keep_the_limits() {
    let arm = ArmState { geometry: papers(), joints_rad: [1.0, -0.8] };
    let rates = [0.3, -0.5];
    let moved = arm.moved(rates, 1e-6);
    let velocity = (moved.tip() - arm.tip()) / 1e-6;
    assert!((velocity - arm.tip_velocity(rates)).norm() < 1e-4);
    // The tip's limit: both joints slow down alike.
    let Drive::Joints { rate_radps } = Drive::of_arm(&arm, rates.map(|rate| 3.0 * rate), &LIMITS) else {
        panic!("joints")
    };
    assert!((arm.tip_velocity(rate_radps).norm() - LIMITS.speed_mps_max).abs() < 1e-9);
    assert!((rate_radps[0] * rates[1] - rate_radps[1] * rates[0]).abs() < 1e-12);
    // The joints' limit.
    let fast = Drive::Joints { rate_radps: [6.0, -1.0] }.within(&LIMITS);
    assert_eq!(fast, Drive::Joints { rate_radps: [3.0, -0.5] });
    // Stops.
    assert_eq!(arm.moved([-100.0, 100.0], 1.0).joints_rad, [0.0, PI / 2.0]);
    let back = arm.rates_to([1.5, -0.3], 0.5);
    assert!((back[0] - 1.0).abs() < 1e-12 && (back[1] - 1.0).abs() < 1e-12);
}

/// Methods for bodies that drive let an arm stand.
#[test]
fn methods_that_do_not_know_arms_stop_them() {
    let mut scene = Scene::new([6.0, 0.5], [-3.5, 5.0]);
    scene.kind = BodyKind::TwoLinkArm;
    let geometry = papers();
    let joints_rad = geometry.inverse(scene.position, Elbow::Up).expect("in reach");
    for (method, mut planner) in every_method() {
        let mut input = scene.input(0, 0.05);
        // Without its arm no method can move it.
        assert_eq!(planner.plan(&input).drive, Drive::stop(BodyKind::TwoLinkArm), "{}", method.name);
        input.arm = Some(ArmState { geometry, joints_rad });
        let drive = planner.plan(&input).drive;
        if method.name != "pso-via-points" {
            assert_eq!(drive, Drive::stop(BodyKind::TwoLinkArm), "{}", method.name);
        }
    }
    assert_eq!(Drive::stop(BodyKind::TwoLinkArm), Drive::Joints { rate_radps: [0.0; 2] });
    assert_eq!(Vector2::<f64>::zeros(), ArmState { geometry, joints_rad }.tip_velocity([0.0; 2]));
}
