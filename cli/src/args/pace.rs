//! The pace of fleets: `pause`, `resume`, `step`, and how `run` and `up` begin.

use super::values::parse_duration;
use super::{FleetArg, Format};
use clap::Args;
use model::Rate;

/// How `run` and `up` begin.
#[derive(Clone, Copy, Debug, Args)]
pub struct StartArgs {
    /// Open no tick before `shoal resume` or `shoal step`; in `lockstep`
    #[arg(long)]
    pub paused: bool,
    /// Simulated time per wall time: 1 is real time, 0.1 slow motion; in `lockstep` and `single`
    #[arg(long, value_name = "FACTOR", value_parser = parse_rate, allow_hyphen_values = true)]
    pub rate: Option<Rate>,
}

/// `shoal pause`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal pause
  shoal step 10            ten ticks, and then none
  shoal resume --rate 0.1  slow motion

For fleets in `lockstep`. It returns when the open tick has been done. No robot
knows of it, and the trajectories are the same. Tasks and faults are taken while
the fleet is paused, robots join when it goes on.")]
pub struct PauseArgs {
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal resume`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal resume
  shoal resume --rate 2    twice real time, also if the fleet is not paused
  shoal resume --rate max  as fast as the processes can

For fleets in `lockstep`. A fleet that cannot keep up with its rate goes as fast
as it can.")]
pub struct ResumeArgs {
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// Simulated time per wall time, or `max`; by default the rate that the fleet had
    #[arg(long, value_name = "FACTOR", value_parser = parse_rate, allow_hyphen_values = true)]
    pub rate: Option<Rate>,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal step`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal step               one tick
  shoal step 50 --fleet lab

For fleets in `lockstep`. It returns when the ticks have been done, and prints
the tick that the fleet has reached; the fleet is paused then, also if it was
not before. Exit code 4: not done within the timeout; the steps go on.")]
pub struct StepArgs {
    /// Number of ticks
    #[arg(value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    #[arg(allow_negative_numbers = true)]
    pub ticks: u64,
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// Wait no longer: 60s, 1.5m, 500ms, or seconds of wall time
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "10m", allow_hyphen_values = true)]
    pub timeout: f64,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// A rate as people write it: a factor, or `max`.
fn parse_rate(text: &str) -> Result<Rate, String> {
    let rate = match text.trim() {
        "max" => Rate::Max,
        number => Rate::Factor(number.parse().map_err(|_| format!("`{number}` is neither a number nor `max`"))?),
    };
    rate.problem().map_or(Ok(rate), Err)
}
