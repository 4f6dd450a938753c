//! `shoal bench`: how long the parts take. Figures of this machine at this moment: where there are
//! targets, they stand beside them, and the exit code does not depend on them.

mod crew;
mod figures;
mod lockstep;
pub mod planners;
mod realtime;
mod scene;
mod startup;

use super::unknown;
use crate::args::BenchVerb;
use crate::exit::Failure;

/// Measures, prints, and says how to exit.
///
/// # Errors
/// With exit code 2, when what was asked for is not there.
pub fn run(verb: &BenchVerb) -> Result<i32, Failure> {
    match verb {
        BenchVerb::Loop(options) => lockstep::run(options),
        BenchVerb::Realtime(options) => realtime::run(options),
        BenchVerb::Startup(options) => startup::run(options),
        BenchVerb::Planners(options) => planners::run(options),
        BenchVerb::Other(words) => Err(unknown::refuse_bench(words)),
    }
}
