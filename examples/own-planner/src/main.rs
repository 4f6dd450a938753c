//! A planner outside shoal, in an executable of its own: heads for the goal and turns right before a robot ahead.

use robot_agent::model::Drive;
use robot_agent::nalgebra::{Rotation2, Vector2};
use robot_agent::planners::{Plan, PlanInput, Planner};
use std::process::ExitCode;

struct KeepRight;

impl Planner for KeepRight {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        let ahead = input.goal - input.position;
        let mut velocity = ahead.cap_magnitude(input.limits.speed_mps_max);
        for neighbor in input.neighbors {
            let offset = neighbor.position - input.position;
            let clearance = offset.norm() - neighbor.radius_m - input.radius_m;
            if clearance < 1.0 && offset.dot(&ahead) > 0.0 {
                velocity = Rotation2::new(-1.0) * velocity;
                break;
            }
        }
        if input.arrived {
            velocity = Vector2::zeros();
        }
        Plan::only(Drive::Velocity(velocity))
    }
}

fn main() -> ExitCode {
    robot_agent::run(|_spec| Ok(Box::new(KeepRight)))
}
