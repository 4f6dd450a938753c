//! The arms among the robots: their joints, and their links where they are.
//!
//! Geometry and kinematics are those of [`geometry::arm`]; here is only what a tick does to an arm.

use geometry::{ArmState, Capsule, towards, wrap};
use model::kinematics::Pose;
use model::{ArmSetup, Drive, Limits};
use nalgebra::{Point2, Vector2};

/// The arm of one slot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arm {
    pub(crate) slot: usize,
    /// Number of its first link among the pieces of robots; the second one comes next.
    pub(crate) piece: usize,
    pub(crate) state: ArmState,
    /// Its joints when the present tick opened, rad.
    pub(crate) from_rad: [f64; 2],
    /// How fast they turn, rad/s.
    pub(crate) rate_radps: [f64; 2],
}

impl Arm {
    /// As it stands at the start.
    pub(crate) fn new(slot: usize, piece: usize, setup: &ArmSetup) -> Arm {
        Arm { slot, piece, state: setup.start(), from_rad: setup.start_joints_rad, rate_radps: [0.0; 2] }
    }

    /// Stops at once, whatever the limits.
    pub(crate) fn halt(&mut self) {
        self.rate_radps = [0.0; 2];
    }

    /// One tick at rates as near to these as the limits allow.
    ///
    /// Rates change by no more than the limit of the acceleration, but they keep those of the joints and of the tip, at
    /// the pose in which the tick opens: a joint may brake harder than it may speed up. A joint that comes to the end of
    /// its range stands there.
    pub(crate) fn advance(&mut self, wanted_radps: [f64; 2], limits: &Limits, dt_s: f64) {
        let within = |rate_radps| match Drive::of_arm(&self.state, rate_radps, limits) {
            Drive::Joints { rate_radps } => rate_radps,
            Drive::Velocity(_) | Drive::Twist { .. } | Drive::Wheels { .. } => [0.0; 2],
        };
        let (wanted, change_max) = (within(wanted_radps), limits.turn_accel_radps2_max * dt_s);
        let rate = within([0, 1].map(|i| towards(self.rate_radps[i], wanted[i], change_max)));
        let before = self.state;
        self.state = before.moved(rate, dt_s);
        self.rate_radps = [0, 1].map(|i| {
            let stopped = self.state.joints_rad[i] != before.joints_rad[i] + rate[i] * dt_s;
            if stopped { 0.0 } else { rate[i] }
        });
    }

    /// Its tip, as the pose of a robot: the heading is that of the last link.
    pub(crate) fn pose(&self) -> Pose {
        let [first, second] = self.state.joints_rad;
        Pose {
            position: self.state.tip(),
            yaw_rad: wrap(first + second),
            velocity: self.state.tip_velocity(self.rate_radps),
            speed_mps: 0.0,
            turn_radps: self.rate_radps[0] + self.rate_radps[1],
            wheel_radps: [0.0; 2],
        }
    }

    /// Its links where they are.
    pub(crate) fn links(&self) -> [Capsule; 2] {
        self.state.geometry.bodies(self.state.joints_rad)
    }

    /// Its links at an instant of the tick, from 0 when it opens to 1 when it closes: the joints turn evenly.
    pub(crate) fn links_at(&self, instant: f64) -> [Capsule; 2] {
        let (from, to) = (self.from_rad, self.state.joints_rad);
        let joints_rad = match instant {
            0.0 => from,
            1.0 => to,
            _ => [0, 1].map(|i| from[i] + (to[i] - from[i]) * instant),
        };
        self.state.geometry.bodies(joints_rad)
    }

    /// No point of a link goes further in this tick, m.
    pub(crate) fn travel_m(&self, link: usize) -> f64 {
        let turned = [0, 1].map(|i| self.state.joints_rad[i] - self.from_rad[i]);
        let [first, second] = self.state.geometry.links_m;
        let of_elbow = first * turned[0].abs();
        if link == 0 { of_elbow } else { of_elbow + second * (turned[0] + turned[1]).abs() }
    }

    /// Velocities of the middles of its links, m/s.
    pub(crate) fn link_velocities(&self) -> [Vector2<f64>; 2] {
        let [base_rate, elbow_rate] = self.rate_radps;
        let elbow = self.state.geometry.elbow(self.state.joints_rad) - self.base();
        let of_elbow = base_rate * Vector2::new(-elbow.y, elbow.x);
        let of_tip = self.state.tip_velocity([base_rate, elbow_rate]);
        [0.5 * of_elbow, 0.5 * (of_elbow + of_tip)]
    }

    /// Where it is fixed.
    pub(crate) fn base(&self) -> Point2<f64> {
        self.state.geometry.base
    }

    /// Nothing of it is ever further from its base, m.
    pub(crate) fn reach_m(&self) -> f64 {
        let geometry = &self.state.geometry;
        geometry.links_m[0] + geometry.links_m[1] + geometry.link_radius_m
    }
}

/// The arm of a slot, of arms in the order of their slots.
pub(crate) fn of_slot(arms: &[Arm], slot: usize) -> Option<&Arm> {
    arms.binary_search_by_key(&slot, |arm| arm.slot).ok().map(|index| &arms[index])
}

/// The same to be changed.
pub(crate) fn of_slot_mut(arms: &mut [Arm], slot: usize) -> Option<&mut Arm> {
    arms.binary_search_by_key(&slot, |arm| arm.slot).ok().map(|index| &mut arms[index])
}

/// The robot that a piece of robots belongs to, and which link it is if that is an arm.
pub(crate) fn owner(arms: &[Arm], piece: usize) -> (usize, Option<usize>) {
    let before = arms.partition_point(|arm| arm.piece + 1 < piece);
    match arms.get(before).filter(|arm| arm.piece <= piece) {
        Some(arm) => (arm.slot, Some(piece - arm.piece)),
        None => (piece - before, None),
    }
}

#[cfg(test)]
pub(crate) mod testing {
    use super::*;
    use geometry::ArmGeometry;
    use std::f64::consts::{PI, TAU};

    /// An arm at the origin whose joints turn almost freely.
    pub(crate) fn arm_at(slot: usize, joints_rad: [f64; 2]) -> Arm {
        let geometry = ArmGeometry {
            base: Point2::origin(),
            links_m: [1.5, 1.0],
            link_radius_m: 0.1,
            joint_min_rad: [-TAU, -PI],
            joint_max_rad: [TAU, PI],
        };
        Arm::new(slot, slot, &ArmSetup { geometry, start_joints_rad: joints_rad })
    }
}

#[cfg(test)]
mod tests {
    use super::testing::arm_at;
    use super::*;
    use proptest::prelude::*;

    const LIMITS: Limits = Limits {
        speed_mps_max: 100.0,
        reverse_mps_max: 0.0,
        turning_radius_m_min: 0.0,
        turn_radps_max: 2.0,
        accel_mps2_max: f64::INFINITY,
        turn_accel_radps2_max: f64::INFINITY,
    };

    #[test]
    fn a_joint_stops_at_the_end_of_its_range_and_leaves_it_again() {
        let mut arm = arm_at(0, [0.0, 3.0]);
        for _ in 0..10 {
            arm.advance([0.0, 1.0], &LIMITS, 0.05);
        }
        assert_eq!((arm.state.joints_rad[1], arm.rate_radps[1]), (std::f64::consts::PI, 0.0));
        assert_eq!(arm.pose().velocity, Vector2::zeros());
        arm.advance([0.0, -1.0], &LIMITS, 0.05);
        assert!((arm.state.joints_rad[1] - (std::f64::consts::PI - 0.05)).abs() < 1e-12);
        assert_eq!(arm.rate_radps[1], -1.0);
    }

    #[test]
    fn pieces_and_slots_are_two_ways_to_count() {
        let arms: Vec<Arm> =
            [1, 2, 5].iter().enumerate().map(|(i, slot)| Arm { piece: slot + i, ..arm_at(*slot, [0.0; 2]) }).collect();
        let owners: Vec<_> = (0..11).map(|piece| owner(&arms, piece)).collect();
        let link = |slot, link| (slot, Some(link));
        let expected = [(0, None), link(1, 0), link(1, 1), link(2, 0), link(2, 1), (3, None), (4, None)];
        assert_eq!(owners[..7], expected);
        assert_eq!(owners[7..], [link(5, 0), link(5, 1), (6, None), (7, None)]);
        assert_eq!(
            (0..9).map(|piece| owner(&[], piece)).collect::<Vec<_>>(),
            (0..9).map(|s| (s, None)).collect::<Vec<_>>()
        );
        assert!(of_slot(&arms, 2).is_some_and(|arm| arm.slot == 2) && of_slot(&arms, 3).is_none());
    }

    proptest! {
        #[test]
        fn limits_hold_whatever_is_asked(
            joints in (-3.0..3.0f64, -3.0..3.0f64), speed in 0.1..3.0f64, accel in 0.5..50.0f64, dt in 0.005..0.1f64,
            asks in prop::collection::vec((-9.0..9.0f64, -9.0..9.0f64), 1..40)
        ) {
            let limits = Limits { speed_mps_max: speed, turn_accel_radps2_max: accel, ..LIMITS };
            let mut arm = arm_at(0, [joints.0, joints.1]);
            for (first, second) in asks {
                let before = arm;
                arm.advance([first, second], &limits, dt);
                let moved = [0, 1].map(|i| arm.state.joints_rad[i] - before.state.joints_rad[i]);
                prop_assert!(arm.state.geometry.within_limits(arm.state.joints_rad, 0.0));
                prop_assert!(moved.iter().all(|angle| angle.abs() <= limits.turn_radps_max * dt + 1e-12));
                let rate = moved.map(|angle| angle / dt);
                prop_assert!(before.state.tip_velocity(rate).norm() <= speed + 1e-9 || rate != before.rate_radps);
                for i in 0..2 {
                    // Nobody speeds up faster than allowed; braking may be harder.
                    let faster = arm.rate_radps[i].abs() - before.rate_radps[i].abs();
                    prop_assert!(faster <= accel * dt + 1e-9, "joint {i}: {faster}");
                }
            }
        }

        #[test]
        fn what_is_said_of_velocities_is_what_many_small_steps_show(
            joints in (-3.0..3.0f64, -3.0..3.0f64), rate in (-2.0..2.0f64, -2.0..2.0f64)
        ) {
            let mut arm = arm_at(0, [joints.0, joints.1]);
            let (links, tip) = (arm.links(), arm.pose().position);
            let dt = 1e-6;
            arm.advance([rate.0, rate.1], &LIMITS, dt);
            let pose = arm.pose();
            prop_assert!(((pose.position - tip) / dt - pose.velocity).norm() < 1e-4);
            let middle = |link: &Capsule| nalgebra::center(&link.a, &link.b);
            for (i, velocity) in arm.link_velocities().iter().enumerate() {
                let moved = (middle(&arm.links()[i]) - middle(&links[i])) / dt;
                prop_assert!((moved - velocity).norm() < 1e-4, "link {i}: {moved} {velocity}");
            }
        }

        #[test]
        fn no_point_of_a_link_goes_further_than_its_travel(
            from in (-3.0..3.0f64, -3.0..3.0f64), turned in (-1.5..1.5f64, -1.5..1.5f64)
        ) {
            let mut arm = arm_at(0, [from.0, from.1]);
            arm.state.joints_rad = [from.0 + turned.0, from.1 + turned.1];
            prop_assert_eq!((arm.links_at(0.0)[1].a, arm.links_at(1.0)), (arm.state.geometry.elbow(arm.from_rad), arm.links()));
            for link in 0..2 {
                for share in [0.0, 0.3, 1.0] {
                    let at = |t: f64| {
                        let Capsule { a, b, .. } = arm.links_at(t)[link];
                        a + (b - a) * share
                    };
                    let steps = 500;
                    let at_step = |i: i32| at(f64::from(i) / f64::from(steps));
                    let length: f64 = (0..steps).map(|i| (at_step(i + 1) - at_step(i)).norm()).sum();
                    prop_assert!(length <= arm.travel_m(link) + 1e-9, "link {link}: {length}");
                }
            }
        }
    }
}
