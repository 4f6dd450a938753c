//! Fleets that are left running: `up`, `down`, `logs`.

use super::values::parse_duration;
use super::{ChangeArgs, FleetArg, Format, StartArgs};
use clap::{Args, ValueEnum};
use std::ffi::OsString;
use std::path::PathBuf;

/// `shoal up`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal up demo-15 --name lab --detach   returns when the fleet runs
  shoal task send r03 4,-2 --fleet lab
  shoal logs -f --fleet lab
  shoal down --fleet lab
  shoal up demo-15 --name lab            in the foreground, until Ctrl-C
  shoal up --adopt --name lab --detach   a new daemon for a fleet without one

The fleet runs until `shoal down`, whatever the scenario says of its end. Its
state directory, for this user only, holds the database of tasks, robots and
events (fleet.db), the log (log.jsonl) and the last report (report.json). Tasks
that were not done when the fleet ended are given to their robots again by the
next `shoal up` with the same directory.

The fleet goes on when its daemon is killed: its robots drive, but nobody can be
restarted and no command is answered until another daemon adopts it.")]
pub struct UpArgs {
    /// A scenario file, or a name from the catalog
    #[arg(value_name = "SCENARIO", required_unless_present = "adopt")]
    pub scenario: Option<OsString>,
    /// Take over the fleet of this name if its daemon has ended; start SCENARIO if no such fleet runs
    #[arg(long)]
    pub adopt: bool,
    /// Name of the fleet; by default that of the scenario
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,
    /// State directory; by default $XDG_STATE_HOME/shoal/NAME or ~/.local/state/shoal/NAME
    #[arg(long, value_name = "DIR")]
    pub state: Option<PathBuf>,
    /// End the fleet if it has no daemon for this long, as in 10m; by default it goes on
    #[arg(long, value_name = "TIME", value_parser = parse_duration, allow_hyphen_values = true)]
    pub orphan_limit: Option<f64>,
    /// Run in the background; return when the fleet runs
    #[arg(long)]
    pub detach: bool,
    /// Clock mode
    #[arg(long, value_enum, value_name = "MODE", default_value_t)]
    pub mode: ServiceModeArg,
    /// What the scenario is to be instead.
    #[command(flatten)]
    pub changes: ChangeArgs,
    /// How it begins.
    #[command(flatten)]
    pub start: StartArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// How the processes of a fleet that is left running keep time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ServiceModeArg {
    /// Each robot on its own timer, as on real robots
    #[default]
    Realtime,
    /// Tick by tick, as fast as the slowest process
    Lockstep,
}

impl From<ServiceModeArg> for model::Mode {
    fn from(mode: ServiceModeArg) -> model::Mode {
        match mode {
            ServiceModeArg::Realtime => model::Mode::Realtime,
            ServiceModeArg::Lockstep => model::Mode::Lockstep,
        }
    }
}

/// `shoal down`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal down                     the only fleet, in good order
  shoal down --fleet lab --force immediately

The fleet is asked to end; what has not ended after the limit is killed. A
foreground `shoal run` ends as after Ctrl-C: it prints its report.")]
pub struct DownArgs {
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// Kill the fleet without asking it
    #[arg(long)]
    pub force: bool,
    /// Kill the fleet if it has not ended by itself after this time
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "15s", allow_hyphen_values = true)]
    pub limit: f64,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal logs`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal logs                      all that is kept, of the only fleet
  shoal logs r03 world -f         what concerns them, and what follows
  shoal logs --since 10m --level warn
  shoal logs --state DIR          of a fleet that does not run any more")]
pub struct LogsArgs {
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// Only entries about these robots, or from `daemon` or `world`
    #[arg(value_name = "ROBOT")]
    pub about: Vec<String>,
    /// Print new entries as they come, until the fleet ends
    #[arg(short, long)]
    pub follow: bool,
    /// Only entries since then: 2026-11-28T10:00:00, or as long ago as 10m
    #[arg(long, value_name = "TIME")]
    pub since: Option<String>,
    /// Only entries of at least this level
    #[arg(long, value_enum, value_name = "LEVEL", default_value = "debug")]
    pub level: LevelArg,
    /// State directory of the fleet, if it is not running
    #[arg(long, value_name = "DIR", conflicts_with = "fleet")]
    pub state: Option<PathBuf>,
    /// Output format; JSON is one object a line, as in the file
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// How much an entry of the log matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LevelArg {
    /// Everything
    Debug,
    /// What happens in good order, and worse
    Info,
    /// What should not happen often, and worse
    Warn,
    /// What needs attention
    Error,
}
