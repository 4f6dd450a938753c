//! What the processes of a fleet say to each other, one file per arrow:
//!
//! ```text
//! daemon ----- daemon_to_robot (its spec, a file) -----> robot-agent
//! daemon ----- daemon_to_world (spec, orders) ---------> world-sim
//! daemon <---- world_to_daemon (notices, outcome) ------ world-sim
//! world-sim -- world_to_robot (boards) ----------------> robot-agent
//! robot-agent  robot_to_world (its board) -------------> world-sim
//! robot-agent  robot_to_robot (its board) -------------> robot-agent
//! world-sim -- world_to_observer (frames) -------------> anyone
//! world-sim,
//! robot-agent  inputs (in the record) ----------------> a replay
//! operator --- operator_to_daemon (request, reply) ----> daemon
//! ```
//!
//! Messages of the loop are plain memory (`repr(C)`, versioned type names), made where their readers find them and
//! copied out by each.
//! Everything else is bincode, through [`codec`].

/// Version of everything that the processes of a fleet share: goes up with every change of a message, a board, the gate, or a
/// file of theirs. A daemon may take over a fleet of its own version only.
pub const FLEET_VERSION: u32 = 7;

/// Version of docs/agent-protocol.md, which says what an agent reads and writes: goes up with every change of that. A test holds
/// the layouts in it against the code.
pub const AGENT_PROTOCOL: u32 = 3;

pub mod codec;
pub mod daemon_to_robot;
pub mod daemon_to_world;
pub mod inputs;
pub mod operator_to_daemon;
pub mod robot_to_robot;
pub mod robot_to_world;
pub mod world_to_daemon;
pub mod world_to_observer;
pub mod world_to_robot;
