//! `shoal add`: one more robot joins a running fleet.

use super::fleet;
use crate::args::{AddArgs, Format};
use crate::exit::Failure;
use crate::out;
use protocol::operator_to_daemon::{NewRobot, Reply, Request};
use serde_json::json;

/// Asks the daemon to let it in. When this returns, it takes part and hears its neighbours, and they hear it.
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
        Reply::Joined { robot, index, incarnation, joined_ms, neighbors } => match options.format {
            Format::Json => out::json(&json!({
                "schema": "shoal.add/1", "fleet": address.id(), "robot": robot, "slot": index,
                "incarnation": incarnation, "joined_ms": joined_ms, "neighbors": neighbors,
            })),
            Format::Text => out::data(&format!(
                "robot `{robot}` has joined fleet {}: {}, {joined_ms:.0} ms\n",
                address.id(),
                hears(neighbors)
            )),
        },
        reply => Err(fleet::confused(&reply)),
    }
}

/// The neighbours of a robot, in words.
pub(super) fn hears(neighbors: u32) -> String {
    match neighbors {
        0 => "no neighbours in range".to_owned(),
        1 => "it and 1 neighbour hear each other".to_owned(),
        more => format!("it and {more} neighbours hear each other"),
    }
}
