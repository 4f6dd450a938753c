//! The `main` of an agent's executable, for planners that are built outside shoal.

use crate::agent::{AgentError, AgentOutputs};
use crate::shell::{self, Args};
use planners::Planner;
use protocol::daemon_to_robot::AgentSpec;
use protocol::robot_to_robot::SharedPose;
use std::io::Write;
use std::process::ExitCode;

/// Runs this process as the agent of a robot until the robot leaves or the run ends.
///
/// `build` makes the planner from the robot's specification: its name, body, planner parameters and clock. The last
/// arguments of the process, from `--root` on, are those that `shoal run` gives to every agent. Errors are printed on
/// standard error; the exit code is then 3.
pub fn run(build: impl FnMut(&AgentSpec) -> Result<Box<dyn Planner>, AgentError>) -> ExitCode {
    run_adjusted(build, |_, _| {})
}

/// Like [`run`]; `adjust` may change the pose and the command of every step before they are published.
pub fn run_adjusted(
    mut build: impl FnMut(&AgentSpec) -> Result<Box<dyn Planner>, AgentError>,
    mut adjust: impl FnMut(&mut SharedPose, &mut AgentOutputs),
) -> ExitCode {
    #[expect(clippy::disallowed_methods, reason = "an agent gets its robot and its run from its command line")]
    let args = Args::after_own(std::env::args().skip(1));
    match args.and_then(|args| shell::run(&args, &mut build, &mut adjust)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "error: {error}");
            ExitCode::from(3)
        }
    }
}
