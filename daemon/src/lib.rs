//! The daemon: the processes of a fleet, from the first to the last.
//!
//! ```text
//! supervisor      the processes of one fleet, and what they share: does what the coordinator decides
//! coordinator     which process should run: pure
//! assign          which robots do which goals: pure     hearing      who hears a newcomer: pure
//! guardian        cleans after a killed daemon           janitor      clears away what dead processes left
//! processes       children, started, watched, reaped     logs         what they print
//! executables     agents of one's own                    scheduling   processors and classes of the processes
//! limits          what containers and users may have     descriptors  open files
//! rlimits         what a scenario lets agents have
//! signals         those that ask for the end             status       what `ps` shows
//! error           why it cannot be done
//! ```
//!
//! No command line, no exit code and no picture is named here.

pub mod assign;
pub mod coordinator;
pub mod descriptors;
pub mod detach;
pub mod error;
pub mod executables;
pub mod guardian;
pub mod hearing;
pub mod janitor;
pub mod limits;
mod logs;
pub mod processes;
mod rlimits;
pub mod scheduling;
pub mod service;
pub mod signals;
pub mod status;
pub mod supervisor;

pub use error::{Error, Kind};
