//! `shoal top`.

use super::{FleetArg, Format};
use clap::Args;

/// `shoal top`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal top                     the only running fleet, until q
  shoal top --fleet lab
  shoal top --once              one screen of text, without a terminal
  shoal top --format json | jq .verdict

Keys: ? shows them all; g sends the selected robot to a goal, x kills its
process, p stops it, space pauses a fleet in `lockstep`, q quits. The robots do
not notice that they are watched, and the fleet goes on without it.")]
pub struct TopArgs {
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// Print one screen and end; it takes a second, in which shares of processors are measured
    #[arg(long)]
    pub once: bool,
    /// Output format; JSON is one object, as with `--once`
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}
