//! The world: the only one that knows where everything really is.
//!
//! [`World`] is a pure state machine. A tick is opened ([`World::open`]: orders and the timeline take effect, due
//! robots enter, everyone is told what it hears and sees), answered by the robots, and closed ([`World::close`]:
//! bodies, obstacles and goals move, contacts are swept, the referee judges). It has no clock, no I/O and no
//! threads, so the `single` runner and the world's process run the same code and reach the same trajectory hash.
//!
//! ```text
//! world       the tick                    presence    who takes part, and since when
//! arm         joints and links            links       how near links come to what
//! shortest    the path one could take
//! shapes      obstacles where they are    grid        who is near whom
//! ranges      who hears and sees what     contact     swept clearances
//! crossings   right of way                restarts    what follows the end of a process
//! referee     goals, arrival, path        progress    who gets nowhere
//! faults      what is done on purpose
//! journal     log and notices
//! attendance  which processes answer      pace        when periods begin
//! opener      when ticks of lockstep open
//! shell       the process                 recorder    everything into a file
//! figures     what the processes count, for the record
//! touch       where bodies touched first       walls       those of the map
//! outcome_file  what the process leaves   checkpoints  what another one can go on from
//! whole_file  a file, whole or not at all
//! ```

mod arm;
pub mod attendance;
mod body;
mod checkpoints;
mod contact;
mod crossings;
mod faults;
mod figures;
mod grid;
mod journal;
mod links;
mod moving;
pub mod opener;
pub mod outcome_file;
pub mod pace;
mod presence;
mod progress;
mod ranges;
pub mod recorder;
mod referee;
mod restarts;
mod shapes;
pub mod shell;
mod shortest;
mod touch;
mod walls;
pub mod whole_file;
mod world;

pub use presence::State as RobotState;
pub use world::{Checkpoint, CheckpointError, NOT_ITS_TASK, Opening, ROBOT_GONE, TOO_MANY_GOALS, World};
