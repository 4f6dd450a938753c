//! How the bodies of robots move during a tick. The world moves them by it, and a robot foresees by it where it will be.

use crate::{BodyKind, Drive, Limits, Wheels};
use geometry::{towards, wrap};
use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};

/// Where a body is and how it moves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// m.
    pub position: Point2<f64>,
    /// rad, in (-π, π].
    pub yaw_rad: f64,
    /// In the world frame, m/s.
    pub velocity: Vector2<f64>,
    /// Forward speed of a unicycle or a diff-drive, m/s, negative in reverse.
    pub speed_mps: f64,
    /// Turn rate of a unicycle or a diff-drive, or of the last link of an arm, rad/s.
    pub turn_radps: f64,
    /// Rates of the wheels of a diff-drive, left and right, rad/s.
    pub wheel_radps: [f64; 2],
}

impl Pose {
    /// Standing still.
    pub fn resting(position: Point2<f64>, yaw_rad: f64) -> Pose {
        let yaw_rad = wrap(yaw_rad);
        Pose { position, yaw_rad, velocity: Vector2::zeros(), speed_mps: 0.0, turn_radps: 0.0, wheel_radps: [0.0; 2] }
    }

    /// Stops at once, whatever the limits: a robot that nobody steers stands.
    pub fn halt(&mut self) {
        *self = Pose { velocity: Vector2::zeros(), speed_mps: 0.0, turn_radps: 0.0, wheel_radps: [0.0; 2], ..*self };
    }

    /// One tick of `dt_s` under a drive that [fits] the body.
    pub fn advance(&mut self, drive: Drive, limits: &Limits, dt_s: f64) {
        match drive.within(limits) {
            Drive::Velocity(wanted) => self.slide(wanted, limits, dt_s),
            Drive::Twist { speed_mps, turn_radps } => {
                self.speed_mps = towards(self.speed_mps, speed_mps, limits.accel_mps2_max * dt_s);
                let turn_radps = towards(self.turn_radps, turn_radps, limits.turn_accel_radps2_max * dt_s);
                // A body that is slow to brake its turn still turns no tighter than it can.
                let turn_max = limits.turn_at(self.speed_mps);
                self.turn_radps = turn_radps.clamp(-turn_max, turn_max);
                self.roll(dt_s);
            }
            // These move arms and wheels: the pose of an arm's tip follows from its joints, for wheels see below.
            Drive::Joints { .. } | Drive::Wheels { .. } => {}
        }
    }

    /// The same for a body on wheels: each wheel gets as near to the rate that is asked of it as its acceleration allows.
    ///
    /// Each rate is on its way from one that is within all limits to another such, so all of them hold at any time.
    pub fn advance_on(&mut self, wheels: &Wheels, drive: Drive, limits: &Limits, dt_s: f64) {
        let Some(wanted_radps) = wheels.rates_for(drive, limits) else { return };
        self.wheel_radps = wheels.towards(self.wheel_radps, wanted_radps, dt_s);
        (self.speed_mps, self.turn_radps) = wheels.twist_of(self.wheel_radps);
        self.roll(dt_s);
    }

    /// A point: the velocity changes at the start of the tick and then stays.
    fn slide(&mut self, wanted: Vector2<f64>, limits: &Limits, dt_s: f64) {
        let change = wanted - self.velocity;
        let change_max = limits.accel_mps2_max * dt_s;
        let size = change.norm();
        self.velocity = if size <= change_max { wanted } else { self.velocity + change * (change_max / size) };
        self.position += self.velocity * dt_s;
    }

    /// A unicycle or a diff-drive on the exact arc: its chord has the direction of the yaw half way, and the length of the arc times
    /// sin h / h, where h is half the angle turned.
    fn roll(&mut self, dt_s: f64) {
        let half = 0.5 * self.turn_radps * dt_s;
        let (sin, cos) = (self.yaw_rad + half).sin_cos();
        let chord = self.speed_mps * dt_s * sinc(half);
        self.position += Vector2::new(cos, sin) * chord;
        self.yaw_rad = wrap(self.yaw_rad + 2.0 * half);
        let (sin, cos) = self.yaw_rad.sin_cos();
        self.velocity = Vector2::new(cos, sin) * self.speed_mps;
    }
}

/// Whether a body of this kind can follow the drive: the right form, and finite.
pub fn fits(kind: BodyKind, drive: &Drive) -> bool {
    let form = match drive {
        Drive::Velocity(_) => kind == BodyKind::Point,
        Drive::Twist { .. } => BodyKind::ROLLING.contains(&kind),
        Drive::Wheels { .. } => kind == BodyKind::DiffDrive,
        Drive::Joints { .. } => kind == BodyKind::TwoLinkArm,
    };
    form && drive.is_finite()
}

/// sin h / h. The two terms of the series are exact to rounding where they are used.
fn sinc(h: f64) -> f64 {
    if h.abs() < 1e-4 { 1.0 - h * h / 6.0 } else { h.sin() / h }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LIMITS: Limits = Limits {
        speed_mps_max: 1.5,
        reverse_mps_max: 0.5,
        turning_radius_m_min: 0.0,
        turn_radps_max: 2.0,
        accel_mps2_max: 3.0,
        turn_accel_radps2_max: 8.0,
    };
    const NO_LAG: Limits = Limits { accel_mps2_max: f64::INFINITY, turn_accel_radps2_max: f64::INFINITY, ..LIMITS };

    #[test]
    fn a_point_follows_at_once_without_an_acceleration_limit() {
        let mut pose = Pose::resting(Point2::new(1.0, 2.0), 0.5);
        pose.advance(Drive::Velocity(Vector2::new(3.0, 0.0)), &NO_LAG, 0.1);
        assert_eq!(pose.velocity, Vector2::new(1.5, 0.0));
        assert_eq!(pose.position, Point2::new(1.0 + 1.5 * 0.1, 2.0));
        assert_eq!(pose.yaw_rad, 0.5, "a point keeps its heading");
    }

    #[test]
    fn an_infinitesimal_turn_is_the_limit_of_turning() {
        for turn in [0.0, 1e-12, 1e-7, 1e-4, 1.9e-3, 2.1e-3] {
            let mut pose = Pose::resting(Point2::origin(), 0.3);
            pose.advance(Drive::Twist { speed_mps: 1.0, turn_radps: turn }, &NO_LAG, 0.1);
            let half: f64 = 0.3 + 0.05 * turn;
            let straight = Point2::new(half.cos(), half.sin()) * 0.1;
            assert!((pose.position - straight).norm() < 1e-9, "{turn}: {:?}", pose.position);
        }
    }

    fn wheels() -> impl Strategy<Value = Wheels> {
        (0.01..0.2f64, 0.1..0.6f64, 1.0..30.0f64, 1.0..300.0f64).prop_map(|(radius_m, track_m, speed, accel)| Wheels {
            radius_m,
            track_m,
            speed_radps_max: speed,
            accel_radps2_max: accel,
            torque_nm_max: f64::INFINITY,
        })
    }

    #[test]
    fn wheels_turn_a_body_where_it_stands_and_drive_it_ahead() {
        let wheels = Wheels::default();
        let mut pose = Pose::resting(Point2::origin(), 0.0);
        pose.advance_on(&wheels, Drive::Wheels { rate_radps: [-2.0, 2.0] }, &wheels.limits(), 1.0);
        assert_eq!((pose.position, pose.speed_mps), (Point2::origin(), 0.0));
        assert!((pose.yaw_rad - 0.033 * 4.0 / 0.16).abs() < 1e-12, "{pose:?}");
        pose.yaw_rad = 0.0;
        pose.advance_on(&wheels, Drive::Wheels { rate_radps: [2.0, 2.0] }, &wheels.limits(), 1.0);
        assert!((pose.position - Point2::new(0.066, 0.0)).norm() < 1e-12, "{pose:?}");
    }

    proptest! {
        #[test]
        fn no_wheel_is_faster_or_changes_faster_than_it_can(
            wheels in wheels(), dt in 0.005..0.2f64, share in 0.2..1.0f64, reverse in 0.0..1.0f64,
            asks in prop::collection::vec((-60.0..60.0f64, -60.0..60.0f64, any::<bool>()), 1..40)
        ) {
            let most = wheels.limits();
            let limits = Limits {
                speed_mps_max: share * most.speed_mps_max,
                reverse_mps_max: reverse * most.speed_mps_max,
                turn_radps_max: share * most.turn_radps_max,
                ..most
            };
            let mut pose = Pose::resting(Point2::origin(), 0.0);
            for (first, second, as_twist) in asks {
                let before = pose;
                let drive = if as_twist {
                    Drive::Twist { speed_mps: 0.1 * first, turn_radps: second }
                } else {
                    Drive::Wheels { rate_radps: [first, second] }
                };
                pose.advance_on(&wheels, drive, &limits, dt);
                for (rate, from) in pose.wheel_radps.iter().zip(before.wheel_radps) {
                    prop_assert!(rate.abs() <= wheels.speed_radps_max, "{pose:?}");
                    prop_assert!((rate - from).abs() <= wheels.accel_radps2_max * dt * (1.0 + 1e-12), "{pose:?}");
                }
                // The body keeps its limits also on the way from one drive to the next.
                prop_assert!(pose.speed_mps <= limits.speed_mps_max + 1e-12, "{pose:?}");
                prop_assert!(pose.speed_mps >= -limits.reverse_mps_max - 1e-12, "{pose:?}");
                prop_assert!(pose.turn_radps.abs() <= limits.turn_radps_max + 1e-9, "{pose:?}");
                prop_assert_eq!((pose.speed_mps, pose.turn_radps), wheels.twist_of(pose.wheel_radps));
                prop_assert!((pose.position - before.position).norm() <= pose.speed_mps.abs() * dt + 1e-12);
            }
        }

        #[test]
        fn wheels_that_follow_at_once_drive_as_a_unicycle(
            wheels in wheels(), dt in 0.005..0.2f64, yaw in -3.0..3.0f64,
            shares in prop::collection::vec((-0.5..0.5f64, -0.5..0.5f64), 1..40)
        ) {
            let wheels = Wheels { accel_radps2_max: f64::INFINITY, ..wheels };
            let limits = wheels.limits();
            let mut unicycle = Pose::resting(Point2::new(0.3, -0.1), yaw);
            let mut on_wheels = unicycle;
            for (speed, turn) in shares {
                // Half of each at most: together no more than the wheels give.
                let drive = Drive::Twist { speed_mps: speed * limits.speed_mps_max, turn_radps: turn * limits.turn_radps_max };
                unicycle.advance(drive, &limits, dt);
                on_wheels.advance_on(&wheels, drive, &limits, dt);
                prop_assert!((on_wheels.position - unicycle.position).norm() < 1e-12, "{on_wheels:?} {unicycle:?}");
                prop_assert!(wrap(on_wheels.yaw_rad - unicycle.yaw_rad).abs() < 1e-12, "{on_wheels:?} {unicycle:?}");
            }
        }

        #[test]
        fn the_arc_is_what_many_small_steps_reach(
            yaw in -3.0..3.0f64, speed in -0.5..1.5f64, turn in -2.0..2.0f64, dt in 0.001..0.5f64
        ) {
            let mut pose = Pose::resting(Point2::new(0.4, -0.7), yaw);
            pose.advance(Drive::Twist { speed_mps: speed, turn_radps: turn }, &NO_LAG, dt);
            let (steps, mut p, mut angle) = (20_000, Point2::new(0.4, -0.7), yaw);
            let h = dt / f64::from(steps);
            for _ in 0..steps {
                // Mid-point rule: second order, so that few steps are enough.
                let middle = angle + 0.5 * turn * h;
                p += Vector2::new(middle.cos(), middle.sin()) * speed * h;
                angle += turn * h;
            }
            prop_assert!((pose.position - p).norm() < 1e-9);
            prop_assert!(wrap(pose.yaw_rad - angle).abs() < 1e-9);
        }

        #[test]
        fn limits_hold_whatever_is_asked(
            asks in prop::collection::vec((-9.0..9.0f64, -9.0..9.0f64), 1..40), unicycle: bool, dt in 0.005..0.2f64
        ) {
            let mut pose = Pose::resting(Point2::origin(), 0.0);
            for (first, second) in asks {
                let before = pose;
                let drive = if unicycle {
                    Drive::Twist { speed_mps: first, turn_radps: second }
                } else {
                    Drive::Velocity(Vector2::new(first, second))
                };
                pose.advance(drive, &LIMITS, dt);
                let driven = (pose.position - before.position).norm();
                prop_assert!(driven <= LIMITS.speed_mps_max * dt + 1e-12);
                prop_assert!(pose.velocity.norm() <= LIMITS.speed_mps_max + 1e-12);
                if unicycle {
                    prop_assert!(pose.speed_mps >= -LIMITS.reverse_mps_max);
                    prop_assert!(pose.turn_radps.abs() <= LIMITS.turn_radps_max);
                    prop_assert!((pose.speed_mps - before.speed_mps).abs() <= LIMITS.accel_mps2_max * dt + 1e-12);
                    let turned = (pose.turn_radps - before.turn_radps).abs();
                    prop_assert!(turned <= LIMITS.turn_accel_radps2_max * dt + 1e-12);
                } else {
                    let change = (pose.velocity - before.velocity).norm();
                    prop_assert!(change <= LIMITS.accel_mps2_max * dt + 1e-12);
                }
            }
        }
    }
}
