//! `shoal remove`: a robot leaves a running fleet.

use super::fleet;
use crate::args::{Format, OneRobotArgs};
use crate::exit::Failure;
use crate::out;
use protocol::operator_to_daemon::{Reply, Request};
use serde_json::json;

/// Takes it out. When this returns it has left the world; its process ends by itself a moment later.
///
/// # Errors
/// When no fleet is running, its daemon does not answer, or there is no such robot.
pub fn run(options: &OneRobotArgs) -> Result<(), Failure> {
    let address = fleet::choose(&options.fleet)?;
    match fleet::ask(&address, &Request::Remove { robot: options.robot.clone() })? {
        Reply::Removed { robot } => match options.format {
            Format::Json => out::json(&json!({ "schema": "shoal.remove/1", "fleet": address.id(), "robot": robot })),
            Format::Text => out::data(&format!("robot `{robot}` has left fleet {}\n", address.id())),
        },
        reply => Err(fleet::confused(&reply)),
    }
}
