//! The processes of a fleet: what the daemon starts this very file for.

use crate::args::{AgentArgs, BareArgs, BareVerb, WorldArgs};
use crate::exit::Failure;
use bus::{Address, bare};
use model::{RobotIndex, RobotInstance};
use robot_agent::shell::{Args, ShellError as AgentError};
use std::io::Write;
use world_sim::shell::ShellError as WorldError;

/// `shoal agent`: the process of one robot.
///
/// # Errors
/// When its fleet is gone, or its spec does not fit.
pub fn agent(options: &AgentArgs) -> Result<(), Failure> {
    let instance = RobotInstance { index: RobotIndex(options.slot), incarnation: options.incarnation };
    let args = Args { root: options.root.clone(), instance, parent: options.parent };
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
    world_sim::shell::main(&options.root, options.parent, options.incarnation).map_err(|error| match error {
        WorldError::Bus(error) => error.into(),
        error => Failure::environment(error.to_string()),
    })
}

/// `shoal bare`: a process that only waits.
///
/// # Errors
/// When its barrier is gone, or nobody reads what it writes.
pub fn bare(options: &BareArgs) -> Result<(), Failure> {
    if !bus::process::die_with_parent(options.parent) {
        return Ok(());
    }
    match &options.wait {
        BareVerb::Barrier { root } => bare::Barrier::open(&Address::at(root)?)?.serve(),
        BareVerb::Timer { first_ns, period_ns, periods } => {
            let late_ns = bare::timer(*first_ns, *period_ns, *periods);
            let bytes: Vec<u8> = late_ns.into_iter().flat_map(u32::to_ne_bytes).collect();
            std::io::stdout()
                .write_all(&bytes)
                .map_err(|error| Failure::environment(format!("standard output: cannot write: {error}")))?;
        }
    }
    Ok(())
}
