//! How the processes of a fleet reach each other: the one crate that names iceoryx2's ports, and the owner of the
//! few pieces of shared memory that iceoryx2 has no form for.
//!
//! ```text
//! world_board   world -> robots     odometry, neighbours, things in sight        iceoryx2 blackboard
//! robot_board   robot -> everybody  poses and command, one board per life        iceoryx2 blackboard
//! gate          world <-> robots    tick, answers, stop, start, progress         futex words in a file
//! frames        world -> observers  whole frames                                 iceoryx2 publish-subscribe
//! control       daemon <-> world    orders and notices                           ring in a file, and a bell
//! queue         the same             what becomes of a message that finds its ring full    pure
//! notes         robots -> record    what a replay has to know of their steps       rings in files
//! operator      operator -> daemon  requests and replies                         unix socket
//! stats         any -> daemon       latency histograms and counters              counters in a file
//! blame         any -> daemon       why a period was late                        the same file
//! helm          anybody             which process is the daemon, which the world   files in the root, and a lock
//! descriptors   anybody              how many open files a process needs               limits of the kernel
//! bare          nobody              the floor under the gate, to measure it by   futex words in a file
//! ```
//!
//! A fleet lives in an [`Address`]: one directory on tmpfs, which only its owner may enter, and which holds everything
//! that the fleet shares, iceoryx2's memory included (`variant.rs`). Whoever removes it has removed the fleet
//! ([`clean`]); a [`Lease`] says whether a daemon or a guardian still looks after it.
//!
//! Nothing in here decides anything about robots, nothing spins, and no wait is without a bound.

pub mod address;
pub mod bare;
mod bell;
pub mod blame;
mod board;
pub mod clean;
pub mod clock;
pub mod control;
pub mod descriptors;
pub mod error;
pub mod footing;
pub mod frames;
pub mod gate;
pub mod helm;
#[cfg(test)]
mod layout;
pub mod lock;
mod maker;
mod map;
pub mod node;
pub mod notes;
pub mod operator;
pub mod process;
pub mod queue;
mod ring;
pub mod robot_board;
pub mod services;
pub mod sizes;
pub mod stats;
mod variant;
pub mod world_board;

pub use address::Address;
pub use clean::{FleetEntry, SweepReport};
pub use control::{NoticeReceiver, NoticeSender, OrderReceiver, OrderSender};
pub use error::BusError;
pub use footing::Footing;
pub use frames::{FramePublisher, FrameSubscriber};
pub use gate::{Gate, Progress, TickWait};
pub use helm::{Helm, Helmsman};
pub use lock::Lease;
pub use map::{attach_map, attach_ways, freeze_map, freeze_ways};
pub use node::Node;
pub use operator::{Noise, OperatorClient, OperatorServer, Responder};
pub use robot_board::{Poses, RobotReader, RobotWriter};
pub use services::Services;
pub use sizes::Sizes;
pub use stats::{Counter, Percentiles, StatsSnapshot, StatsWriter, Strips};
pub use world_board::{ToldNeighbors, WorldObserver, WorldReader, WorldWriter};

/// What every fallible call of this crate returns.
pub type Result<T, E = BusError> = std::result::Result<T, E>;
