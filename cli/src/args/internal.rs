//! What the daemon and the benches start this very file for.

use clap::{Args, Subcommand};
use std::path::PathBuf;

/// `shoal agent`, for the daemon.
#[derive(Debug, Args)]
pub struct AgentArgs {
    /// The root of the run.
    #[arg(long)]
    pub root: PathBuf,
    /// Slot of the robot.
    #[arg(long)]
    pub slot: u32,
    /// Life of the robot.
    #[arg(long)]
    pub incarnation: u32,
    /// The process that started this one.
    #[arg(long)]
    pub parent: u32,
}

/// `shoal world`, for the daemon.
#[derive(Debug, Args)]
pub struct WorldArgs {
    /// The root of the run.
    #[arg(long)]
    pub root: PathBuf,
    /// How often the world's process was replaced.
    #[arg(long, default_value_t = 0)]
    pub incarnation: u32,
    /// The process that started this one.
    #[arg(long)]
    pub parent: u32,
}

/// `shoal bare`, for `shoal bench`.
#[derive(Debug, Args)]
pub struct BareArgs {
    /// The process that started this one.
    #[arg(long)]
    pub parent: u32,
    /// What to wait for.
    #[command(subcommand)]
    pub wait: BareVerb,
}

/// What a bare process waits for.
#[derive(Debug, Subcommand)]
pub enum BareVerb {
    /// The others, at a barrier.
    Barrier {
        /// Where it is.
        #[arg(long)]
        root: PathBuf,
    },
    /// Time; it writes how late it was, ns, four bytes each, to standard output.
    Timer {
        /// The first period begins then, monotonic clock, ns.
        #[arg(long)]
        first_ns: u64,
        /// Length of a period, ns.
        #[arg(long)]
        period_ns: u64,
        /// How many.
        #[arg(long)]
        periods: usize,
    },
}

/// `shoal janitor`, for the daemon.
#[derive(Debug, Args)]
pub struct JanitorArgs {
    /// The root of the run.
    #[arg(long)]
    pub root: PathBuf,
    /// The process that started this one.
    #[arg(long)]
    pub parent: u32,
}

/// `shoal guardian`, for the daemon.
#[derive(Debug, Args)]
pub struct GuardianArgs {
    /// The root of the run.
    #[arg(long)]
    pub root: PathBuf,
}
