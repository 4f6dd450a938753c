//! `bench` and `stress`: what the parts take, and what the machine bears.

use super::Format;
use super::values::{parse_duration, parse_number, parse_robots};
use clap::{Args, Subcommand};
use std::ffi::OsString;

/// `shoal bench`.
#[derive(Debug, Subcommand)]
pub enum BenchVerb {
    /// Compare a tick of `lockstep` with a bare futex barrier
    Loop(BenchLoopArgs),
    /// Compare `realtime` at a high rate with bare timers
    Realtime(BenchRealtimeArgs),
    /// Measure the time from the first spawn to the first tick, and of a late join
    Startup(BenchStartupArgs),
    /// Measure the planning time of each planner
    Planners(BenchPlannersArgs),
    /// A word that is no verb.
    #[command(external_subcommand)]
    Other(Vec<OsString>),
}

/// `shoal bench loop`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal bench loop                     15, 64 and 200 robots; takes minutes
  shoal bench loop --robots 15 --planner straight --ticks 1000000
  shoal bench loop --format json > loop.json

The fleet and a futex barrier of the same number of bare processes are measured
alternately, so that a disturbance affects both. `straight` drives in an empty
world, `decentralized-apf` past ten obstacles; a robot hears at most 16 others.")]
pub struct BenchLoopArgs {
    /// Sizes of the fleets
    #[arg(long, value_name = "N,..", value_delimiter = ',', default_value = "15,64,200", value_parser = parse_robots)]
    pub robots: Vec<usize>,
    /// Only this planner: straight or decentralized-apf
    #[arg(long, value_name = "NAME", value_parser = ["straight", "decentralized-apf"])]
    pub planner: Option<String>,
    /// Ticks of each fleet
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = clap::value_parser!(u64).range(100..))]
    pub ticks: u64,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal bench realtime`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal bench realtime                 15 at 1 kHz, 64 at 200 Hz, 200 at 50 Hz
  shoal bench realtime --robots 30 --hz 500 --seconds 10
  shoal bench realtime --format json > realtime.json")]
pub struct BenchRealtimeArgs {
    /// Sizes of the fleets
    #[arg(long, value_name = "N,..", value_delimiter = ',', default_value = "15,64,200", value_parser = parse_robots)]
    pub robots: Vec<usize>,
    /// Periods per second; by default chosen by the size of the fleet
    #[arg(long, value_name = "HZ", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub hz: Option<u32>,
    /// Number of measurements; fleet and timers alternate
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repetitions: u32,
    /// Length of each measurement
    #[arg(long, value_name = "TIME", default_value = "3", value_parser = parse_duration, allow_hyphen_values = true)]
    pub seconds: f64,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal bench startup`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal bench startup
  shoal bench startup --robots 200 --repetitions 11 --format json")]
pub struct BenchStartupArgs {
    /// Sizes of the fleets
    #[arg(long, value_name = "N,..", value_delimiter = ',', default_value = "15,64,200", value_parser = parse_robots)]
    pub robots: Vec<usize>,
    /// Number of starts; fleet and bare processes alternate
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repetitions: u32,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal bench planners`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal bench planners                 every planner
  shoal bench planners apf rpoa        some of them
  shoal bench planners --format json > planners.json

Each figure is the time of one plan: the median and the 99th percentile. All
cells are measured alternately, so that a disturbance affects all of them.")]
pub struct BenchPlannersArgs {
    /// Only these planners
    #[arg(value_name = "NAME")]
    pub names: Vec<String>,
    /// Plans per planner and cell; fewer for a slow planner
    #[arg(long, value_name = "N", default_value_t = 3000, value_parser = clap::value_parser!(u32).range(1..))]
    pub plans: u32,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal stress`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal stress                             15 robots at 50 Hz for a minute
  shoal stress --robots 64 --duration 20s
  shoal stress --hz 200 --format json > stress.json

Every robot is a process that moves all the time and hears the robots around it.
The verdict is `valid`, `starved` or `impaired` and does not change the exit
code. The exit code is 1 if the fleet leaves files or processes behind.")]
pub struct StressArgs {
    /// Number of robots
    #[arg(long, value_name = "N", default_value_t = 15, allow_negative_numbers = true)]
    pub robots: usize,
    /// How long to run: 60s, 1.5m, 500ms, or seconds
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = parse_duration, allow_hyphen_values = true)]
    pub duration: f64,
    /// Periods per second of every process
    #[arg(long, value_name = "HZ", default_value_t = 50.0, value_parser = parse_number, allow_hyphen_values = true)]
    pub hz: f64,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}
