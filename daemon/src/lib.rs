//! The daemon and the command line: everything of shoal that is not a message, a method, a robot or a world.
//!
//! ```text
//! cli, verbs      what can be said                run          a scenario from its text to its report
//! source          where scenarios come from       single       all cores in one thread
//! report          what came out                   supervisor   the processes of a fleet, and what they share
//! progress, out   what people see meanwhile       coordinator  which process should run: pure
//! exit            codes and failures              guardian     cleans after a killed daemon
//! file, record    what people keep                picture      the same as SVG
//! numbers         how many digits              limits       what containers and users may have
//! measured        from statistics to latencies    scheduling   processors and classes of the processes
//! ```

pub mod cli;
pub mod coordinator;
pub mod descriptors;
pub mod ending;
pub mod executables;
pub mod exit;
pub mod file;
pub mod guardian;
pub mod janitor;
pub mod limits;
mod logs;
pub mod measured;
pub mod numbers;
pub mod out;
pub mod own_limits;
pub mod picture;
pub mod processes;
pub mod progress;
pub mod record;
pub mod repeats;
pub mod report;
pub mod run;
pub mod scheduling;
pub mod signals;
pub mod single;
pub mod source;
pub mod status;
pub mod supervisor;
pub mod talk;
pub mod verbs;
