//! `shoal inject`: faults on purpose, for robots of a running fleet.

use super::values::{parse_number, parse_seconds};
use super::{FleetArg, Format};
use clap::{Args, Subcommand};
use std::ffi::OsString;

/// `shoal inject`.
#[derive(Debug, Subcommand)]
#[command(after_help = "\
Examples:
  shoal inject kill r03
  shoal inject pause r03 --for 2.5
  shoal inject drop r03 --share 0.3 --for 10
  shoal inject resume r03

Events of a scenario's timeline do the same at a set time, see `shoal schema`.")]
pub enum InjectVerb {
    /// Kill the robot's process (SIGKILL); it comes back if the scenario restarts it
    Kill(InjectArgs),
    /// Stop the robot's process (SIGSTOP)
    Pause(LastingArgs),
    /// End the robot's pause and every other fault on it
    Resume(InjectArgs),
    /// Let no robot hear this one
    Mute(LastingArgs),
    /// Let the robot hear the others late
    Delay(DelayArgs),
    /// Let a part of what the robot hears get lost
    Drop(DropArgs),
    /// Add noise to the positions that the robot hears
    Noise(NoiseArgs),
    /// Make every plan of the robot take longer, in wall time
    SlowCpu(SlowCpuArgs),
    /// A word that is not a fault.
    #[command(external_subcommand)]
    Other(Vec<OsString>),
}

/// A robot, and what is said about every fault.
#[derive(Debug, Args)]
pub struct InjectArgs {
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// Id of the robot
    #[arg(value_name = "ROBOT")]
    pub robot: String,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// A fault that lasts.
#[derive(Debug, Args)]
pub struct LastingArgs {
    /// The robot.
    #[command(flatten)]
    pub target: InjectArgs,
    /// For how long, s of simulated time; by default until `shoal inject resume`
    #[arg(long = "for", value_name = "SECONDS", value_parser = parse_seconds)]
    pub for_s: Option<f64>,
}

/// `shoal inject delay`.
#[derive(Debug, Args)]
pub struct DelayArgs {
    /// The robot, and for how long.
    #[command(flatten)]
    pub lasting: LastingArgs,
    /// By how much, on top of the one tick that every pose takes
    #[arg(long, value_name = "N")]
    pub ticks: u32,
}

/// `shoal inject drop`.
#[derive(Debug, Args)]
pub struct DropArgs {
    /// The robot, and for how long.
    #[command(flatten)]
    pub lasting: LastingArgs,
    /// Share of the poses that are lost, 0 to 1
    #[arg(long, value_name = "SHARE", value_parser = parse_number)]
    pub share: f64,
}

/// `shoal inject noise`.
#[derive(Debug, Args)]
pub struct NoiseArgs {
    /// The robot, and for how long.
    #[command(flatten)]
    pub lasting: LastingArgs,
    /// Standard deviation of the error per axis, m
    #[arg(long, value_name = "M", value_parser = parse_number)]
    pub sigma: f64,
}

/// `shoal inject slow-cpu`.
#[derive(Debug, Args)]
pub struct SlowCpuArgs {
    /// The robot, and for how long.
    #[command(flatten)]
    pub lasting: LastingArgs,
    /// By how much every plan takes longer, ms, at most 1000
    #[arg(long, value_name = "MS", value_parser = parse_number)]
    pub ms: f64,
}
