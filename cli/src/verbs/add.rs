//! `shoal add`: one more robot joins a running fleet.

use super::fleet;
use crate::args::{AddArgs, Format};
use crate::exit::Failure;
use crate::out;
use protocol::operator_to_daemon::{NewRobot, Reply, Request};
use serde_json::json;

/// Asks the daemon to let it in. It enters the world a moment later, when its process is ready.
///
/// # Errors
/// When no fleet is running, its daemon does not answer, or there is no room for such a robot.
pub fn run(options: &AddArgs) -> Result<(), Failure> {
    let address = fleet::choose(&options.fleet)?;
    let request = Request::Add(NewRobot {
        id: options.id.clone(),
        start_m: options.start,
        start_yaw_rad: options.yaw,
        goal_m: options.goal.at_m,
        goal_yaw_rad: options.goal.yaw_rad,
        planner: options.planner.clone(),
        kind: options.kind.clone(),
    });
    match fleet::ask(&address, &request)? {
        Reply::Added { robot, index } => match options.format {
            Format::Json => {
                out::json(&json!({ "schema": "shoal.add/1", "fleet": address.id(), "robot": robot, "slot": index }))
            }
            Format::Text => out::data(&format!("robot `{robot}` joins fleet {}\n", address.id())),
        },
        reply => Err(fleet::confused(&reply)),
    }
}
