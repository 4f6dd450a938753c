//! The robot's side: one process per robot.
//!
//! [`agent`] is the pure core: odometry, poses heard and pieces seen go in, a pose and a drive come out.
//! [`radio`] is what stands between a neighbour's board and the planner: which pose counts, and the faults of a
//! scenario. [`shell`] connects the core to shared memory and to time, and takes no decision about robots.

pub mod agent;
pub mod radio;
pub mod shell;

pub use agent::{Agent, AgentInputs, AgentOutputs, Time};
