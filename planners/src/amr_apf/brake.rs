//! The guard against contact, which the paper lacks: no faster towards a thing than lets the robot stop before it.

use super::field::{Own, wrap};
use super::speed::Twist;
use crate::planner::PlanInput;
use crate::steering::stoppable_speed;
use model::Limits;
use nalgebra::{Point2, Vector2};

/// Cosine of the bearing from which on a thing lies beside the robot.
const TOWARDS_MIN: f64 = 1e-6;

/// A thing to brake for, as the robot sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Near {
    /// From surface to surface, m.
    clear_m: f64,
    /// Its bearing relative to the own heading, rad.
    off_rad: f64,
    /// How fast it comes nearer by itself, m/s.
    closing_mps: f64,
    /// It is a robot that may drive towards this one, which brakes as well.
    drives: bool,
}

impl Near {
    /// What stands or moves on its course.
    pub(crate) fn thing(own: &Own, at: Point2<f64>, clear_m: f64, velocity: Vector2<f64>) -> Near {
        let along = at - own.position;
        let closing_mps = along.try_normalize(0.0).map_or(0.0, |along| -along.dot(&velocity));
        Near { clear_m, off_rad: wrap(along.y.atan2(along.x) - own.heading_rad), closing_mps, drives: false }
    }

    /// Another robot on its way. Where it drives next is not known, so each of the two takes half of the room.
    pub(crate) fn robot(own: &Own, at: Point2<f64>, clear_m: f64) -> Near {
        Near { drives: true, ..Near::thing(own, at, clear_m, Vector2::zeros()) }
    }
}

/// From this clearance on nothing limits the speed of a body, m: for a thing that moves that fast itself.
pub(crate) fn reach_m(keep_m: f64, thing_mps: f64, input: &PlanInput<'_>) -> f64 {
    let closing_mps = input.limits.speed_mps_max + thing_mps;
    keep_m + 6.0 * input.dt_s * closing_mps + closing_mps * closing_mps / input.limits.accel_mps2_max
}

/// The command with a speed at which the robot keeps `keep_m` from everything: in a tick it uses up half of the room
/// that is left, or a quarter if the other one is on its way too.
pub(crate) fn brake(twist: Twist, near: &[Near], keep_m: f64, input: &PlanInput<'_>) -> Twist {
    let turned_rad = turned_rad(twist, input);
    let most = |thing: &Near| {
        // Of the headings in this tick the one that leads nearest.
        let towards = (thing.off_rad.abs() - turned_rad).max(0.0).cos();
        if towards < TOWARDS_MIN {
            return f64::INFINITY;
        }
        // The other robot's place is a tick old.
        let (moved_m, ticks) = if thing.drives { (input.limits.speed_mps_max * input.dt_s, 4.0) } else { (0.0, 2.0) };
        let room_m = (thing.clear_m - keep_m - moved_m).max(0.0);
        let speed_mps = (room_m / (ticks * input.dt_s)).min(stoppable_speed(room_m, &input.limits));
        (speed_mps - thing.closing_mps).max(0.0) / towards
    };
    Twist { speed_mps: near.iter().map(most).fold(twist.speed_mps, f64::min), ..twist }
}

/// How far the heading may turn before the robot stands, rad: in this tick alone if it brakes at once.
fn turned_rad(twist: Twist, input: &PlanInput<'_>) -> f64 {
    let Limits { accel_mps2_max, turn_accel_radps2_max, .. } = input.limits;
    let turns_on = turn_accel_radps2_max.is_finite();
    let turn_radps = if turns_on { twist.turn_radps.abs().max(input.turn_radps.abs()) } else { twist.turn_radps.abs() };
    turn_radps * (input.dt_s + input.velocity.norm() / accel_mps2_max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{self, LIMITS};
    use std::f64::consts::FRAC_PI_2;

    /// At the origin, facing +x, ticks of 0.1 s.
    fn input(limits: Limits) -> PlanInput<'static> {
        PlanInput { limits, ..testing::input() }
    }

    const OWN: Own =
        Own { position: Point2::new(0.0, 0.0), heading_rad: 0.0, goal: Point2::new(9.0, 0.0), sgn_zero: false };

    fn speed(near: Near, turn_radps: f64, limits: Limits) -> f64 {
        brake(Twist { speed_mps: 0.2, turn_radps }, &[near], 0.02, &input(limits)).speed_mps
    }

    fn check(near: Near, turn_radps: f64, expected: f64) {
        let found = speed(near, turn_radps, LIMITS);
        assert!((found - expected).abs() < 1e-12, "{near:?}, {turn_radps}: {found} instead of {expected}");
    }

    fn pillar(at: [f64; 2], clear_m: f64, velocity: [f64; 2]) -> Near {
        Near::thing(&OWN, at.into(), clear_m, velocity.into())
    }

    /// 0.04 m clear, 0.02 m of them to keep: 0.02 m of room, half of it in 0.1 s.
    #[test]
    fn half_of_the_room_in_a_tick() {
        check(pillar([0.4, 0.0], 0.04, [0.0, 0.0]), 0.0, 0.1);
        check(pillar([0.4, 0.0], 0.06, [0.0, 0.0]), 0.0, 0.2);
        check(pillar([0.4, 0.0], 0.02, [0.0, 0.0]), 0.0, 0.0);
        check(pillar([0.4, 0.0], -0.1, [0.0, 0.0]), 0.0, 0.0);
    }

    /// Obliquely only the component towards the thing counts, and what lies beside or behind does not.
    #[test]
    fn only_what_is_ahead_counts() {
        check(pillar([0.2, 0.2], 0.04, [0.0, 0.0]), 0.0, 0.1 * 2f64.sqrt());
        check(pillar([0.0, 0.4], 0.0, [0.0, 0.0]), 0.0, 0.2);
        check(pillar([-0.4, 0.0], 0.0, [0.0, 0.0]), 0.0, 0.2);
        // Who turns by 0.1 rad in the tick may come to face it.
        check(pillar([0.4 * 0.1f64.cos(), 0.4 * 0.1f64.sin()], 0.04, [0.0, 0.0]), -1.0, 0.1);
        check(pillar([0.4 * 0.1f64.cos(), 0.4 * 0.1f64.sin()], 0.04, [0.0, 0.0]), 1.0, 0.1);
        let beside = FRAC_PI_2 + 0.05;
        check(pillar([beside.cos(), beside.sin()], 0.02, [0.0, 0.0]), 1.0, 0.0);
    }

    /// What comes nearer by itself takes its part of the speed away, what goes away gives it.
    #[test]
    fn a_moving_thing_has_a_course() {
        check(pillar([0.4, 0.0], 0.04, [-0.03, 0.5]), 0.0, 0.07);
        check(pillar([0.4, 0.0], 0.04, [0.03, 0.0]), 0.0, 0.13);
        check(pillar([0.4, 0.0], 0.04, [-1.0, 0.0]), 0.0, 0.0);
    }

    /// A robot that may come towards us: 0.12 m clear, less 0.02 m to keep and 0.02 m of a tick at 0.2 m/s, a quarter of
    /// it in 0.1 s. Two that face each other use up half of the room together.
    #[test]
    fn two_robots_share_the_room() {
        let robot = |clear_m| Near::robot(&OWN, Point2::new(0.5, 0.0), clear_m);
        check(robot(0.08), 0.0, 0.1);
        check(robot(0.12), 0.0, 0.2);
        check(robot(0.04), 0.0, 0.0);
    }

    /// What is left out does not limit anything: at its edge the full speed is allowed.
    #[test]
    fn the_reach_is_far_enough() {
        for (accel_mps2_max, speed_mps) in [(f64::INFINITY, 0.0), (f64::INFINITY, 1.5), (0.3, 0.0), (0.3, 1.5)] {
            let limits = Limits { accel_mps2_max, ..LIMITS };
            let reach_m = reach_m(0.02, speed_mps, &input(limits));
            assert!((0.1..12.0).contains(&reach_m), "{reach_m}");
            let near =
                [pillar([9.0, 0.0], reach_m, [-speed_mps, 0.0]), Near::robot(&OWN, Point2::new(9.0, 0.0), reach_m)];
            for near in near {
                assert_eq!(speed(near, 0.0, limits), 0.2, "{near:?}");
            }
        }
    }

    /// At 0.125 m/s² it stops within half of 0.02 m from √(0.125 · 0.02) = 0.05 m/s, within half of 0.08 m from 0.1 m/s.
    #[test]
    fn slow_brakes_begin_sooner() {
        let limits = Limits { accel_mps2_max: 0.125, ..LIMITS };
        assert!((speed(pillar([0.4, 0.0], 0.04, [0.0, 0.0]), 0.0, limits) - 0.05).abs() < 1e-12);
        assert!((speed(pillar([0.4, 0.0], 0.10, [0.0, 0.0]), 0.0, limits) - 0.1).abs() < 1e-12);
    }

    /// From 0.2 m/s it takes 1.6 s to stand. Meanwhile it turns on, 1.7 rad at 1 rad/s with the tick before: it may come to
    /// face what is beside it now.
    #[test]
    fn slow_brakes_look_where_the_turn_leads() {
        let limits = Limits { accel_mps2_max: 0.125, turn_accel_radps2_max: 0.5, ..LIMITS };
        let beside = pillar([0.0, 0.4], 0.04, [0.0, 0.0]);
        let at = |turn_radps, asked_radps, limits| {
            let input = PlanInput { velocity: Vector2::new(0.2, 0.0), turn_radps, ..input(limits) };
            brake(Twist { speed_mps: 0.2, turn_radps: asked_radps }, &[beside], 0.02, &input).speed_mps
        };
        assert!((at(0.0, 1.0, limits) - 0.05).abs() < 1e-12);
        assert!((at(1.0, 0.0, limits) - 0.05).abs() < 1e-12, "what is not asked for any more goes on for a while");
        assert_eq!(at(0.0, 0.0, limits), 0.2);
        assert_eq!(at(1.0, 0.0, LIMITS), 0.2, "a body that follows at once");
    }

    /// The nearest of several decides; the turn stays.
    #[test]
    fn the_least_speed_of_all() {
        let near = [pillar([0.4, 0.0], 0.06, [0.0, 0.0]), pillar([0.4, 0.0], 0.03, [0.0, 0.0])];
        let twist = brake(Twist { speed_mps: 0.2, turn_radps: 0.7 }, &near, 0.02, &input(LIMITS));
        assert!((twist.speed_mps - 0.05).abs() < 1e-12);
        assert_eq!(twist.turn_radps, 0.7);
    }
}
