//! `shoal restart`: a robot of a running fleet gets a new process.

use super::add::hears;
use super::fleet;
use crate::args::{Format, RestartArgs};
use crate::exit::Failure;
use crate::out;
use protocol::operator_to_daemon::{Reply, Request};
use serde_json::json;

/// Restarts it. When this returns, the new process takes part and hears its neighbours, and they hear it.
///
/// # Errors
/// When no fleet is running, its daemon does not answer, or there is no such robot.
pub fn run(options: &RestartArgs) -> Result<(), Failure> {
    let address = fleet::choose(&options.fleet)?;
    match fleet::ask(&address, &Request::Restart { robot: options.robot.clone() })? {
        Reply::Joined { robot, index, incarnation, joined_ms, neighbors } => match options.format {
            Format::Json => out::json(&json!({
                "schema": "shoal.restart/1", "fleet": address.id(), "robot": robot, "slot": index,
                "incarnation": incarnation, "joined_ms": joined_ms, "neighbors": neighbors,
            })),
            Format::Text => out::data(&format!(
                "robot `{robot}` has a new process (incarnation {incarnation}): {}, {joined_ms:.0} ms\n",
                hears(neighbors)
            )),
        },
        reply => Err(fleet::confused(&reply)),
    }
}
