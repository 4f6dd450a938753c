//! A recorded run, computed again: from what the world and the agents were told ([`protocol::inputs`]) the pure cores come to
//! every frame, event and command once more, and [`Verifier`] says whether these are the recorded ones, bit by bit, or
//! which is the first that is not. [`compare`] holds two records against each other.
//!
//! ```text
//! verifier   the world again, and everything that the record says of it
//! fleet      the agents again, whose inputs the world and the others have made
//! views      what the world showed its robots in the last ticks
//! verdict    what came out          compare    two records
//! of_record  the parts of a record in their order
//! ```
//!
//! The world goes by the recorded commands, and the agents by the world: so a command that is not what its agent computes
//! is found where it is, and everything after it is still held against its own inputs. In `single` and `lockstep` an
//! agent's inputs follow from the world. In `realtime` its notes say what it had, and its step waits here until those
//! whom it heard have made theirs, whatever the order in which notes come.

pub mod compare;
mod fleet;
pub mod of_record;
mod verdict;
mod verifier;
mod views;

pub use verdict::{Difference, Unverified, Verdict, Why};
pub use verifier::Verifier;
