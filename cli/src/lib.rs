//! The command line: what can be said, and what follows from it.
//!
//! ```text
//! args, verbs     what can be said                run          a scenario from its text to its report
//! source          where scenarios come from       file, record what people keep
//! progress, out   what people see during a run    sink         where a report goes
//! talk, repeats   standard error                  exit         codes and failures
//! own_limits      what the process itself needs
//! ```

pub mod args;
pub mod begin;
mod beside;
pub mod exit;
pub mod file;
pub mod out;
pub mod own_limits;
pub mod progress;
pub mod record;
pub mod repeats;
pub mod run;
pub mod sink;
pub mod source;
pub mod talk;
pub mod verbs;
