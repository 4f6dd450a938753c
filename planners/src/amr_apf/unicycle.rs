//! A point robot drives as a unicycle whose heading the method remembers.

use super::field::Own;
use super::speed::Twist;
use crate::planner::PlanInput;
use crate::steering::{stoppable_speed, turning_speed};
use geometry::wrap;
use model::{BodyKind, Drive};
use nalgebra::Vector2;

/// The robot as the forces see it. A point robot starts facing its goal.
pub(crate) fn own(input: &PlanInput<'_>, remembered_rad: Option<f64>, sgn_zero: bool) -> Own {
    let heading_rad = match input.kind {
        BodyKind::Unicycle | BodyKind::DiffDrive | BodyKind::TwoLinkArm => input.yaw_rad,
        BodyKind::Point => remembered_rad.unwrap_or_else(|| {
            let to_goal = input.goal - input.position;
            if to_goal.norm() > 0.0 { to_goal.y.atan2(to_goal.x) } else { input.yaw_rad }
        }),
    };
    Own { position: input.position, heading_rad, goal: input.goal, sgn_zero }
}

/// The command in the form that the body understands. The laws keep their speed up to the goal; a body that accelerates
/// slowly comes there more slowly, so that it stops within the tolerance, and does not circle round it.
pub(crate) fn drive(twist: Twist, own: &Own, input: &PlanInput<'_>, remembered_rad: &mut Option<f64>) -> Drive {
    let Twist { speed_mps, turn_radps } = twist;
    let to_goal = own.goal - own.position;
    let speed_mps = speed_mps.min(stoppable_speed(to_goal.norm(), &input.limits));
    match input.kind {
        BodyKind::TwoLinkArm => Drive::stop(input.kind),
        BodyKind::Unicycle | BodyKind::DiffDrive => {
            let speed_mps = speed_mps.min(turning_speed(to_goal, own.heading_rad, &input.limits));
            // A body that cannot turn that fast drives the same curve, slower.
            let over = turn_radps.abs() / input.limits.turn_radps_max;
            let speed_mps = if over > 1.0 { speed_mps / over } else { speed_mps };
            Drive::Twist { speed_mps, turn_radps }.within(&input.limits)
        }
        BodyKind::Point => {
            let heading = wrap(own.heading_rad + turn_radps * input.dt_s);
            *remembered_rad = Some(heading);
            Drive::Velocity(speed_mps * Vector2::new(heading.cos(), heading.sin()))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{self, LIMITS};
    use model::Limits;
    use nalgebra::Point2;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn input(kind: BodyKind, limits: Limits) -> PlanInput<'static> {
        PlanInput {
            position: Point2::new(1.0, 1.0),
            yaw_rad: 0.3,
            kind,
            limits,
            goal: Point2::new(1.0, 3.0),
            ..testing::input()
        }
    }

    /// A unicycle has its own heading, a point that of the unicycle that it drives as: first towards its goal.
    #[test]
    fn headings() {
        let point = input(BodyKind::Point, LIMITS);
        assert_eq!(own(&input(BodyKind::Unicycle, LIMITS), Some(2.0), false).heading_rad, 0.3);
        assert_eq!(own(&point, None, false).heading_rad, FRAC_PI_2);
        assert_eq!(own(&point, Some(2.0), false).heading_rad, 2.0);
        assert_eq!(own(&PlanInput { goal: point.position, ..point }, None, false).heading_rad, 0.3);
    }

    /// A point drives along the heading that it has after the turn, and remembers it.
    #[test]
    fn a_point_drives_as_a_unicycle() {
        let point = input(BodyKind::Point, LIMITS);
        let mut remembered = Some(PI - 0.02);
        let own = own(&point, remembered, false);
        let drive = drive(Twist { speed_mps: 0.1, turn_radps: 0.5 }, &own, &point, &mut remembered);
        let heading: f64 = 0.03 - PI;
        assert!((remembered.expect("it is remembered") - heading).abs() < 1e-12);
        let Drive::Velocity(velocity) = drive else { panic!("a point gets a velocity") };
        assert!((velocity - 0.1 * Vector2::new(heading.cos(), heading.sin())).norm() < 1e-12);
    }

    /// A body that turns half as fast as asked drives the same curve at half the speed.
    #[test]
    fn a_slow_turner_keeps_the_curve() {
        let of = |speed_mps, turn_radps| {
            let unicycle = input(BodyKind::Unicycle, LIMITS);
            let own = own(&unicycle, None, false);
            drive(Twist { speed_mps, turn_radps }, &own, &unicycle, &mut None)
        };
        assert_eq!(of(0.2, 0.5), Drive::Twist { speed_mps: 0.2, turn_radps: 0.5 });
        assert_eq!(of(0.2, 2.0), Drive::Twist { speed_mps: 0.1, turn_radps: 1.0 });
        assert_eq!(of(0.2, -4.0), Drive::Twist { speed_mps: 0.05, turn_radps: -1.0 });
    }

    /// Two metres before the goal a body that brakes with a drives at most at √(a · 2).
    #[test]
    fn a_slow_brake_comes_slowly() {
        let limits = Limits { accel_mps2_max: 0.005, ..LIMITS };
        for (kind, speed_mps) in [(BodyKind::Unicycle, 0.1), (BodyKind::Point, 0.1)] {
            let body = input(kind, limits);
            let own = own(&body, Some(FRAC_PI_2), false);
            let found = match drive(Twist { speed_mps: 0.2, turn_radps: 0.0 }, &own, &body, &mut None) {
                Drive::Twist { speed_mps, .. } => speed_mps,
                Drive::Velocity(velocity) => velocity.norm(),
                other => panic!("{other:?}"),
            };
            assert!((found - speed_mps).abs() < 1e-12, "{found}");
        }
    }

    /// A body whose turn rate grows by 0.04 rad/s² and that has to turn by 1 rad before its goal 2 m away: 2 / (2 √(1 / 0.04)) = 0.2;
    /// with 0.01 rad/s² half of that.
    #[test]
    fn a_slow_steering_comes_slowly() {
        for (turn_accel_radps2_max, speed_mps) in [(0.04, 0.2), (0.01, 0.1)] {
            let body = input(BodyKind::Unicycle, Limits { turn_accel_radps2_max, ..LIMITS });
            let own = Own { heading_rad: FRAC_PI_2 - 1.0, ..own(&body, None, false) };
            let Drive::Twist { speed_mps: found, .. } =
                drive(Twist { speed_mps: 0.2, turn_radps: 0.0 }, &own, &body, &mut None)
            else {
                panic!("a unicycle gets a twist")
            };
            assert!((found - speed_mps).abs() < 1e-12, "{found}");
        }
    }
}
