//! An agent for tests: it steers as its scenario says, and tells the others that it is somewhere else.
//!
//! Its published pose is off by `SHOAL_LIE_M` metres along y (default 0), and it says that it has `SHOAL_MORE_M` metres more
//! to go than it has (default 0). Ground truth is untouched, so whatever others do about it they learned from this robot's own
//! board.

use robot_agent::planner_of;
use std::process::ExitCode;

fn main() -> ExitCode {
    let (lie_m, more_m) = (told("SHOAL_LIE_M"), told("SHOAL_MORE_M"));
    robot_agent::run_adjusted(planner_of, |pose, _| {
        pose.y_m += lie_m;
        pose.remaining_m += more_m;
    })
}

fn told(name: &str) -> f64 {
    #[expect(clippy::disallowed_methods, reason = "tests tell it how much to lie")]
    let text = std::env::var(name);
    text.ok().and_then(|text| text.parse().ok()).unwrap_or(0.0)
}
