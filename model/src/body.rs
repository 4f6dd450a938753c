//! How bodies move, and what a robot asks of its body.

use crate::choice;
use geometry::{ArmState, towards};
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

choice! {
    /// How a body moves.
    #[derive(Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum BodyKind {
        /// A holonomic point: any velocity in the plane.
        Point = "point",
        /// A unicycle: forward speed and turn rate.
        Unicycle = "unicycle",
        /// Two driven wheels on one axle: forward speed and turn rate, or the rates of the wheels.
        DiffDrive = "diff-drive",
        /// A planar arm of two links that stands where it stands: joint rates. Its position is that of its tip.
        TwoLinkArm = "two-link-arm",
    }
}

impl BodyKind {
    /// The kinds that drive about.
    pub const MOBILE: &[BodyKind] = &[BodyKind::Point, BodyKind::Unicycle, BodyKind::DiffDrive];
    /// The kinds that have a heading and drive along it: methods give them a [`Drive::Twist`].
    pub const ROLLING: &[BodyKind] = &[BodyKind::Unicycle, BodyKind::DiffDrive];
}

/// What a body can do. An infinite acceleration means that the body follows at once.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Greatest speed, m/s; of an arm, that of its tip.
    pub speed_mps_max: f64,
    /// Greatest reverse speed of a unicycle or a diff-drive, m/s, not negative; zero means that it cannot drive backwards.
    pub reverse_mps_max: f64,
    /// Smallest radius on which a unicycle can turn, m; zero means that it can turn where it stands, as a diff-drive always
    /// can. With more it steers like a car.
    pub turning_radius_m_min: f64,
    /// Greatest turn rate of a unicycle or a diff-drive, and of each joint of an arm, rad/s.
    pub turn_radps_max: f64,
    /// Greatest change of speed (unicycle) or of velocity (point), m/s²; of a diff-drive, while its turn rate stays.
    pub accel_mps2_max: f64,
    /// Greatest change of turn rate of a unicycle, rad/s²; of a diff-drive, while its speed stays.
    pub turn_accel_radps2_max: f64,
}

impl Limits {
    /// Greatest turn rate at a speed that the turning radius leaves, rad/s; infinite without one.
    #[inline]
    pub fn turn_at(&self, speed_mps: f64) -> f64 {
        if self.turning_radius_m_min > 0.0 { speed_mps.abs() / self.turning_radius_m_min } else { f64::INFINITY }
    }
}

/// What a robot asks of its body for one tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Drive {
    /// A velocity in the world frame, m/s (point).
    Velocity(Vector2<f64>),
    /// Forward speed, m/s, and turn rate, rad/s (unicycle, diff-drive).
    Twist {
        /// Forward speed, m/s.
        speed_mps: f64,
        /// Turn rate, rad/s, counter-clockwise.
        turn_radps: f64,
    },
    /// Rates of the joints, the one at the base first, rad/s, counter-clockwise (two-link arm).
    Joints {
        /// The rates, rad/s.
        rate_radps: [f64; 2],
    },
    /// Rates of the wheels, the left one first, rad/s, forwards (diff-drive).
    Wheels {
        /// The rates, rad/s.
        rate_radps: [f64; 2],
    },
}

impl Drive {
    /// Stand still, in the form that a body of this kind understands.
    #[inline]
    pub fn stop(kind: BodyKind) -> Drive {
        match kind {
            BodyKind::Point => Drive::Velocity(Vector2::zeros()),
            BodyKind::Unicycle | BodyKind::DiffDrive => Drive::Twist { speed_mps: 0.0, turn_radps: 0.0 },
            BodyKind::TwoLinkArm => Drive::Joints { rate_radps: [0.0; 2] },
        }
    }

    /// Whether every number in it is finite.
    #[inline]
    pub fn is_finite(&self) -> bool {
        match *self {
            Drive::Velocity(v) => v.x.is_finite() && v.y.is_finite(),
            Drive::Twist { speed_mps, turn_radps } => speed_mps.is_finite() && turn_radps.is_finite(),
            Drive::Joints { rate_radps } | Drive::Wheels { rate_radps } => {
                rate_radps.iter().all(|rate| rate.is_finite())
            }
        }
    }

    /// The same request within the limits: a velocity keeps its direction, a twist is cut part by part (and turns no
    /// tighter than its speed allows), and joint rates shrink together, so that the tip keeps its course. The speed of a
    /// tip depends on the pose of its arm, which is not known here: [`Drive::of_arm`] limits it too. Rates of wheels stay as
    /// they are: what they come to depends on the wheels, see [`Wheels::rates_for`].
    #[inline]
    pub fn within(&self, limits: &Limits) -> Drive {
        match *self {
            Drive::Velocity(v) => Drive::Velocity(v.cap_magnitude(limits.speed_mps_max)),
            Drive::Twist { speed_mps, turn_radps } => {
                let speed_mps = speed_mps.clamp(-limits.reverse_mps_max, limits.speed_mps_max);
                let turn_max = limits.turn_radps_max.min(limits.turn_at(speed_mps));
                Drive::Twist { speed_mps, turn_radps: turn_radps.clamp(-turn_max, turn_max) }
            }
            Drive::Joints { rate_radps: [first, second] } => {
                let fastest = first.abs().max(second.abs());
                let scale = if fastest > limits.turn_radps_max { limits.turn_radps_max / fastest } else { 1.0 };
                Drive::Joints { rate_radps: [first * scale, second * scale] }
            }
            Drive::Wheels { .. } => *self,
        }
    }

    /// Joint rates of an arm within the limits: both shrink together until each joint and the tip keep theirs.
    #[inline]
    pub fn of_arm(arm: &ArmState, rate_radps: [f64; 2], limits: &Limits) -> Drive {
        let tip = arm.tip_velocity(rate_radps).norm();
        let scale = if tip > limits.speed_mps_max { limits.speed_mps_max / tip } else { 1.0 };
        Drive::Joints { rate_radps: rate_radps.map(|rate| rate * scale) }.within(limits)
    }
}

/// The two driven wheels of a diff-drive, beside its centre. The defaults are those of a TurtleBot3 Burger.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wheels {
    /// Radius of each wheel, m.
    pub radius_m: f64,
    /// Distance between the two wheels, m.
    pub track_m: f64,
    /// Greatest speed of a wheel, either way, rad/s.
    pub speed_radps_max: f64,
    /// Greatest change of the speed of a wheel, rad/s²; infinite means that it follows at once.
    pub accel_radps2_max: f64,
    /// Greatest torque of the motor of each wheel, Nm; infinite does not limit it. Kinematic physics does not read it.
    pub torque_nm_max: f64,
}

impl Default for Wheels {
    fn default() -> Wheels {
        Wheels::BURGER
    }
}

impl Wheels {
    /// Those of a TurtleBot3 Burger, which drives 0.22 m/s; they follow at once.
    pub const BURGER: Wheels = Wheels {
        radius_m: 0.033,
        track_m: 0.16,
        speed_radps_max: 6.67,
        accel_radps2_max: f64::INFINITY,
        torque_nm_max: f64::INFINITY,
    };

    /// The most that they give a body: forwards and backwards, turning where it stands, and how fast each of these changes
    /// while the other one stays.
    pub fn limits(&self) -> Limits {
        let [speed_mps_max, accel_mps2_max] = [self.speed_radps_max, self.accel_radps2_max].map(|x| self.radius_m * x);
        Limits {
            speed_mps_max,
            reverse_mps_max: speed_mps_max,
            turning_radius_m_min: 0.0,
            turn_radps_max: 2.0 * speed_mps_max / self.track_m,
            accel_mps2_max,
            turn_accel_radps2_max: 2.0 * accel_mps2_max / self.track_m,
        }
    }

    /// The rates, left and right, rad/s, at which the body drives at this forward speed, m/s, and turn rate, rad/s.
    #[inline]
    pub fn rates_of(&self, speed_mps: f64, turn_radps: f64) -> [f64; 2] {
        let aside_mps = 0.5 * self.track_m * turn_radps;
        [(speed_mps - aside_mps) / self.radius_m, (speed_mps + aside_mps) / self.radius_m]
    }

    /// Forward speed, m/s, and turn rate, rad/s, of the body at these rates, left and right, rad/s.
    #[inline]
    pub fn twist_of(&self, [left, right]: [f64; 2]) -> (f64, f64) {
        (0.5 * self.radius_m * (left + right), self.radius_m * (right - left) / self.track_m)
    }

    /// These rates, or if one of them is more than the greatest speed of a wheel, both in proportion: the curve stays.
    #[inline]
    pub fn within(&self, [left, right]: [f64; 2]) -> [f64; 2] {
        let fastest = left.abs().max(right.abs());
        if fastest <= self.speed_radps_max {
            return [left, right];
        }
        // Divided first: so the faster one is exactly at its limit.
        [left / fastest * self.speed_radps_max, right / fastest * self.speed_radps_max]
    }

    /// The rates, left and right, rad/s, that a drive asks for, within what wheels and body can do; nothing if it is not a
    /// drive for wheels.
    #[inline]
    pub fn rates_for(&self, drive: Drive, limits: &Limits) -> Option<[f64; 2]> {
        let twist = match drive {
            Drive::Twist { .. } => drive,
            Drive::Wheels { rate_radps } => {
                let rate_radps = self.within(rate_radps);
                let (speed_mps, turn_radps) = self.twist_of(rate_radps);
                let twist = Drive::Twist { speed_mps, turn_radps };
                if twist.within(limits) == twist {
                    return Some(rate_radps);
                }
                twist
            }
            Drive::Velocity(_) | Drive::Joints { .. } => return None,
        };
        let Drive::Twist { speed_mps, turn_radps } = twist.within(limits) else { return None };
        Some(self.within(self.rates_of(speed_mps, turn_radps)))
    }

    /// The rates of the wheels, rad/s, after `dt_s` on their way from `rate_radps` to `wanted_radps`: each changes by no
    /// more than its acceleration allows.
    #[inline]
    pub fn towards(&self, rate_radps: [f64; 2], wanted_radps: [f64; 2], dt_s: f64) -> [f64; 2] {
        let change_max = self.accel_radps2_max * dt_s;
        [0, 1].map(|side| towards(rate_radps[side], wanted_radps[side], change_max))
    }
}

/// What physics with forces needs to know of a body; kinematic physics does not read it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Dynamics {
    /// Its mass, kg.
    pub mass_kg: f64,
    /// Coefficient of Coulomb friction between it and what it touches: robots, obstacles, walls.
    pub friction: f64,
    /// Coefficient of friction between its wheels or feet and the ground: it is driven by no more than this share of its
    /// weight.
    pub grip: f64,
}

impl Dynamics {
    /// What a body has of which nothing is said.
    pub const DEFAULT: Dynamics = Dynamics { mass_kg: 1.0, friction: 0.3, grip: 0.8 };
}

impl Default for Dynamics {
    fn default() -> Dynamics {
        Dynamics::DEFAULT
    }
}

choice! {
    /// What moves the bodies of a world.
    #[derive(Default, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Physics {
        /// Bodies move as they are asked to, within their limits, and pass through each other.
        #[default]
        Kinematic = "kinematic",
        /// Rigid bodies with masses, forces and contacts.
        Rapier = "rapier",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn wheels() -> impl Strategy<Value = Wheels> {
        let numbers = (0.01..0.3f64, 0.05..1.0f64, 0.5..40.0f64);
        numbers.prop_map(|(radius_m, track_m, speed_radps_max)| Wheels {
            radius_m,
            track_m,
            speed_radps_max,
            ..Wheels::default()
        })
    }

    /// 0.033 m at 6.67 rad/s: 0.22 m/s, and 2.75 rad/s on wheels that are 0.16 m apart.
    #[test]
    fn the_default_is_a_burger() {
        let limits = Wheels::default().limits();
        assert!(
            (limits.speed_mps_max - 0.22).abs() < 2e-4 && (limits.turn_radps_max - 2.75).abs() < 2e-3,
            "{limits:?}"
        );
        assert_eq!((limits.accel_mps2_max, limits.turn_accel_radps2_max), (f64::INFINITY, f64::INFINITY));
    }

    #[test]
    fn each_wheel_goes_its_own_way_to_its_rate() {
        let wheels = Wheels { accel_radps2_max: 10.0, ..Wheels::default() };
        assert_eq!(wheels.towards([1.0, 1.0], [5.0, 0.5], 0.1), [2.0, 0.5]);
        assert_eq!(Wheels::default().towards([1.0, 1.0], [5.0, 0.5], 0.1), [5.0, 0.5]);
    }

    #[test]
    fn only_twists_and_rates_are_for_wheels() {
        let (wheels, limits) = (Wheels::default(), Wheels::default().limits());
        assert_eq!(wheels.rates_for(Drive::stop(BodyKind::Point), &limits), None);
        assert_eq!(wheels.rates_for(Drive::stop(BodyKind::TwoLinkArm), &limits), None);
        assert_eq!(wheels.rates_for(Drive::stop(BodyKind::DiffDrive), &limits), Some([0.0; 2]));
    }

    proptest! {
        #[test]
        fn a_twist_comes_back_from_its_rates(wheels in wheels(), speed in -2.0..2.0f64, turn in -9.0..9.0f64) {
            let (speed_mps, turn_radps) = wheels.twist_of(wheels.rates_of(speed, turn));
            prop_assert!((speed_mps - speed).abs() < 1e-12 && (turn_radps - turn).abs() < 1e-12 * (1.0 + 1.0 / wheels.track_m));
        }

        #[test]
        fn wheels_that_are_asked_for_too_much_keep_the_curve(wheels in wheels(), left in -99.0..99.0f64, right in -99.0..99.0f64) {
            let [l, r] = wheels.within([left, right]);
            prop_assert!(l.abs() <= wheels.speed_radps_max && r.abs() <= wheels.speed_radps_max);
            prop_assert!((l * right - r * left).abs() < 1e-9 * (1.0 + left.abs() * right.abs()), "{l} {r}");
            prop_assert!(l * left >= 0.0 && r * right >= 0.0, "neither turns round");
            let as_asked = left.abs().max(right.abs()) <= wheels.speed_radps_max;
            prop_assert_eq!(as_asked, [l, r] == [left, right]);
        }

        #[test]
        fn what_is_asked_ends_within_the_limits_of_wheels_and_body(
            wheels in wheels(), first in -99.0..99.0f64, second in -99.0..99.0f64, as_twist: bool, share in 0.1..1.0f64
        ) {
            let most = wheels.limits();
            let limits = Limits { speed_mps_max: share * most.speed_mps_max, reverse_mps_max: 0.0, ..most };
            let drive = if as_twist {
                Drive::Twist { speed_mps: first, turn_radps: second }
            } else {
                Drive::Wheels { rate_radps: [first, second] }
            };
            let rates = wheels.rates_for(drive, &limits).expect("it is for wheels");
            prop_assert!(rates.iter().all(|rate| rate.abs() <= wheels.speed_radps_max));
            let (speed_mps, turn_radps) = wheels.twist_of(rates);
            prop_assert!((-1e-9..=limits.speed_mps_max + 1e-9).contains(&speed_mps), "{speed_mps}");
            prop_assert!(turn_radps.abs() <= limits.turn_radps_max + 1e-9, "{turn_radps}");
        }
    }
}
