//! Straight to the goal, whatever stands in the way: the null method, one end of every comparison.
//!
//! | symbol | here           | unit  | default | larger means             |
//! |--------|----------------|-------|---------|--------------------------|
//! |        | `heading_gain` | 1/s   | 3.0     | a unicycle turns sharper |

use crate::method::{Identity, Method, Symmetry, any_speed};
use crate::params::ParamError;
use crate::planner::{Plan, PlanInput, Planner};
use crate::steering::steer_to_goal;
use model::{BodyKind, Drive, ParamValues};

/// Registry entry.
pub static METHOD: Method = Method {
    name: "straight",
    summary: "straight to the goal at full speed, blind to everything else",
    source: "",
    symmetry: Symmetry::FULL,
    kinds: BodyKind::MOBILE,
    params: Params::specs,
    speed_mps: any_speed,
    lengths: &[],
    wants_filter: false,
    follows_ways: false,
    build,
};

crate::params! {
    /// Parameters that a scenario can set.
    pub struct Params {
        /// Turn rate of a unicycle per radian of heading error. Larger: turns sharper.
        heading_gain: f64 = 3.0, "1/s", 0.0..=100.0;
    }
}

/// The method at work for one robot; it remembers nothing.
#[derive(Clone, Debug, Default)]
pub struct Straight {
    /// Parameters that a scenario can set.
    pub params: Params,
}

fn build(values: &ParamValues, _: Identity) -> Result<Box<dyn Planner>, ParamError> {
    Ok(Box::new(Straight { params: Params::from_values(values)? }))
}

impl Planner for Straight {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        let to_goal = input.goal - input.position;
        let distance = to_goal.norm();
        if input.arrived || distance <= input.goal_tolerance_m {
            return Plan { stopped: true, ..Plan::only(Drive::stop(input.kind)) };
        }
        // The last tick ends on the goal, not beyond it.
        let speed = input.limits.speed_mps_max.min(distance / input.dt_s);
        let velocity = to_goal / distance * speed;
        let drive = match input.kind {
            BodyKind::Point => Drive::Velocity(velocity),
            BodyKind::Unicycle | BodyKind::DiffDrive => steer_to_goal(velocity, self.params.heading_gain, input),
            BodyKind::TwoLinkArm => Drive::stop(input.kind),
        };
        Plan { attractive: velocity, ..Plan::only(drive) }
    }
}
