//! `shoal restart`: a robot of a running fleet gets a new process.

use super::add::join;
use super::fleet;
use crate::args::{Format, OneRobotArgs};
use crate::exit::Failure;
use crate::out;
use protocol::operator_to_daemon::Request;

/// Restarts it. When this returns, the new process takes part and hears its neighbours, and they hear it.
///
/// # Errors
/// When no fleet is running, its daemon does not answer, or there is no such robot.
pub fn run(options: &OneRobotArgs) -> Result<(), Failure> {
    let address = fleet::choose(&options.fleet)?;
    let joined = join(&address, &Request::Restart { robot: options.robot.clone() })?;
    match options.format {
        Format::Json => out::json(&joined.json("shoal.restart/1", address.id())),
        Format::Text => out::data(
            &joined.told(|robot, incarnation| format!("robot `{robot}` has a new process (incarnation {incarnation})")),
        ),
    }
}
