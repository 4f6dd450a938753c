//! The processes of a fleet: what the daemon starts this very file for.

use crate::cli::{AgentArgs, WorldArgs};
use crate::exit::Failure;
use protocol::Seat;
use robot_agent::shell::{Args, ShellError as AgentError};
use world_sim::shell::ShellError as WorldError;

/// `shoal agent`: the process of one robot.
///
/// # Errors
/// When its fleet is gone, or its spec does not fit.
pub fn agent(options: &AgentArgs) -> Result<(), Failure> {
    let seat = Seat { slot: options.slot, incarnation: options.incarnation };
    let args = Args { root: options.root.clone(), seat, parent: options.parent };
    robot_agent::shell::main(&args).map_err(|error| match error {
        AgentError::Bus(error) => error.into(),
        AgentError::Usage(_) => Failure::usage(error.to_string()),
        error => Failure::environment(error.to_string()),
    })
}

/// `shoal world`: the process of the world.
///
/// # Errors
/// When its fleet is gone, or its scenario cannot be read.
pub fn world(options: &WorldArgs) -> Result<(), Failure> {
    world_sim::shell::main(&options.root, options.parent).map_err(|error| match error {
        WorldError::Bus(error) => error.into(),
        error => Failure::environment(error.to_string()),
    })
}
