//! A planner that shoal does not have, in an executable of its own.
//!
//! Build it, and name it in a scenario:
//!
//! ```text
//! cargo build --release --example own_planner
//! shoal run head-on --set defaults.agent='"target/release/examples/own_planner"'
//! ```
//!
//! It heads for the goal, and gives way to the right of whoever is near and ahead.

use nalgebra::{Rotation2, Vector2};
use planners::{Drive, Plan, PlanInput, Planner};
use robot_agent::shell::{self, Args};
use std::io::Write;
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
    #[expect(clippy::disallowed_methods, reason = "an agent is told who it is on its command line")]
    let args = Args::parse(std::env::args().skip(1));
    let result = args.and_then(|args| shell::run(&args, &mut |_| Ok(Box::new(KeepRight)), &mut |_| {}));
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "error: {error}");
            ExitCode::from(3)
        }
    }
}
