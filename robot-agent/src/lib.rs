//! The robot's side: one process per robot.
//!
//! [`agent`] is the pure core: odometry, poses heard and pieces seen go in, a pose and a drive come out.
//! [`radio`] is what stands between a neighbour's board and the planner: which pose counts, and the faults of a
//! scenario. [`shell`] connects the core to shared memory ([`ports`]) and to time, and takes no decision about robots.
//! `map` is what it knows of what stands. [`note`] is what a step leaves to a replay, where a run is recorded.
//!
//! A planner outside shoal needs this crate alone: [`run`] is its `main`, and [`planners`], [`model`], [`geometry`] and
//! [`nalgebra`] are re-exported. `examples/own-planner` shows it.

pub mod agent;
pub mod executable;
mod map;
pub mod note;
pub mod ports;
pub mod radio;
pub mod shell;

pub use agent::{Agent, AgentError, AgentInputs, AgentOutputs, Duty, Time, duty, planner_of};
pub use executable::{run, run_adjusted};
pub use map::links_of;
pub use protocol::daemon_to_robot::AgentSpec;
pub use {geometry, model, nalgebra, planners};
