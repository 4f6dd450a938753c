//! How a fleet begins, as `run` and `up` are asked to: paused, or held to a rate.

use crate::args::StartArgs;
use crate::exit::Failure;
use daemon::supervisor::Start;
use model::Mode;

/// How a fleet in this clock mode begins.
///
/// # Errors
/// With exit code 2, when that mode cannot.
pub fn start(options: &StartArgs, mode: Mode) -> Result<Start<'static>, Failure> {
    let asked = if options.paused { "--paused" } else { "--rate" };
    let refused = |why: &str| {
        Err(Failure::usage(format!("`{asked}`: {why}"))
            .hint("add `--mode lockstep`: every robot is a process there, and waits for the ticks"))
    };
    match mode {
        Mode::Realtime if options.paused || options.rate.is_some() => {
            refused("in `realtime` every robot has its own timer: there are no ticks to hold")
        }
        Mode::Single if options.paused => refused("in `single` no other command reaches the run to let it go on"),
        _ => Ok(Start { paused: options.paused, rate: options.rate.unwrap_or_default(), ..Start::default() }),
    }
}
