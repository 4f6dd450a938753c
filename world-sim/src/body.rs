//! A robot as the physics sees it: plain numbers, refreshed from its presence when a tick opens.

use model::kinematics::Pose;
use model::{BodyKind, Limits, Robot, RobotIndex, RobotInstance, Wheels};
use nalgebra::Point2;

/// The body of one slot, and what it can sense.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Body {
    pub(crate) instance: RobotInstance,
    pub(crate) kind: BodyKind,
    pub(crate) limits: Limits,
    /// Its wheels, if it is a diff-drive.
    pub(crate) wheels: Option<Wheels>,
    pub(crate) radius_m: f64,
    pub(crate) sensor_range_m: f64,
    pub(crate) radio_range_m: f64,
    pub(crate) radio_hysteresis_m: f64,
    pub(crate) sees_robots: bool,
    /// Its radio neither loses nor delays what it hears.
    pub(crate) hears_surely: bool,
    pub(crate) pose: Pose,
    /// Where it was when the present tick opened, m.
    pub(crate) from: Point2<f64>,
    /// It is somewhere, whether its process runs or not.
    pub(crate) in_world: bool,
    /// It plans in this tick.
    pub(crate) takes_part: bool,
    /// Others hear it in this tick.
    pub(crate) on_radio: bool,
    /// It has just entered, and others will hear it from the next tick on.
    pub(crate) speaks_first: bool,
}

impl Body {
    /// At its start, not in the world yet.
    pub(crate) fn new(slot: usize, robot: &Robot) -> Body {
        Body {
            instance: RobotInstance { index: RobotIndex::of(slot), incarnation: 0 },
            kind: robot.kind,
            limits: robot.limits,
            wheels: robot.wheels,
            radius_m: robot.radius_m,
            sensor_range_m: robot.sensor_range_m,
            radio_range_m: robot.radio_range_m,
            radio_hysteresis_m: robot.radio_hysteresis_m,
            sees_robots: robot.sees_robots,
            hears_surely: true,
            pose: Pose::resting(robot.start, robot.start_yaw_rad),
            from: robot.start,
            in_world: false,
            takes_part: false,
            on_radio: false,
            speaks_first: false,
        }
    }

    /// Its links are seen by sensors, also of robots that hear it: only its tip is heard.
    pub(crate) fn has_seen_links(&self) -> bool {
        self.in_world && self.is_arm()
    }

    /// Its body is not a disc but two links; its pose is that of its tip.
    pub(crate) fn is_arm(&self) -> bool {
        self.kind == BodyKind::TwoLinkArm
    }

    /// How far it drove in this tick, m.
    pub(crate) fn driven_m(&self) -> f64 {
        (self.pose.position - self.from).norm()
    }
}

#[cfg(test)]
pub(crate) mod testing {
    use super::*;

    /// A disc that takes part, is on the radio, and senses as far as it likes.
    pub(crate) fn disc_at(slot: usize, position: Point2<f64>, radius_m: f64) -> Body {
        let limits = Limits {
            speed_mps_max: 1.0,
            reverse_mps_max: 0.0,
            turning_radius_m_min: 0.0,
            turn_radps_max: 1.0,
            accel_mps2_max: f64::INFINITY,
            turn_accel_radps2_max: f64::INFINITY,
        };
        Body {
            instance: RobotInstance { index: RobotIndex::of(slot), incarnation: 0 },
            kind: BodyKind::Point,
            limits,
            wheels: None,
            radius_m,
            sensor_range_m: f64::INFINITY,
            radio_range_m: f64::INFINITY,
            radio_hysteresis_m: 0.0,
            sees_robots: true,
            hears_surely: true,
            pose: Pose::resting(position, 0.0),
            from: position,
            in_world: true,
            takes_part: true,
            on_radio: true,
            speaks_first: false,
        }
    }
}
