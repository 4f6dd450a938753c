//! An agent for tests: it steers as its scenario says, and tells the others that it is somewhere else.
//!
//! Its published pose is off by `SHOAL_LIE_M` metres along y (default 0). Ground truth is untouched, so whatever the
//! other robots do about it they learned from this robot's own board.

use robot_agent::planner_of;
use std::process::ExitCode;

fn main() -> ExitCode {
    #[expect(clippy::disallowed_methods, reason = "tests tell it how much to lie")]
    let lie_m: f64 = std::env::var("SHOAL_LIE_M").ok().and_then(|text| text.parse().ok()).unwrap_or(0.0);
    robot_agent::run_adjusted(planner_of, |pose, _| pose.y_m += lie_m)
}
