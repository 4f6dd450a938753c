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
        BodyKind::Unicycle | BodyKind::TwoLinkArm => input.yaw_rad,
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
        BodyKind::Unicycle => {
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
