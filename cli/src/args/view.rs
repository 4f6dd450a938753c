//! `shoal view`.

use super::FleetArg;
use clap::Args;
use std::path::PathBuf;

/// `shoal view`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal view                    all running fleets of this user, in the browser
  shoal view --fleet lab
  shoal view --port 8080        for a tunnel: ssh -L 8080:127.0.0.1:8080 HOST
  shoal view run.mcap           plays a record
  shoal view lanes.mcap orca.mcap   compares two records

It prints the address to open and serves until Ctrl-C. The address is for this
machine only and holds a token that is new each time: without it the server
answers nothing. On the page, fleets can be driven as well: tasks, new robots,
faults. The robots do not notice that they are watched.")]
pub struct ViewArgs {
    /// Records to play, two at most; by default running fleets are shown
    #[arg(value_name = "RECORD", num_args = 0..=2, conflicts_with = "fleet")]
    pub records: Vec<PathBuf>,
    /// Which fleet; by default all of this user.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// Port on 127.0.0.1; 0 is any that is free
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    pub port: u16,
    /// Started by `shoal run --view`: ends with its fleet, and with this process
    #[arg(long, hide = true, value_name = "PID")]
    pub parent: Option<u32>,
}
