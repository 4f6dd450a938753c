//! `bench` and `stress`: what the parts take, and what the machine bears.

use super::Format;
use super::values::{parse_duration, parse_number, parse_robots};
use clap::{Args, Subcommand};
use std::ffi::OsString;

/// `shoal bench`.
#[derive(Debug, Subcommand)]
pub enum BenchVerb {
    /// A tick of `lockstep` beside a bare futex barrier
    Loop(BenchLoopArgs),
    /// `realtime` at a high rate beside bare timers
    Realtime(BenchRealtimeArgs),
    /// From the first spawn to the first tick, and one more robot
    Startup(BenchStartupArgs),
    /// How long each method takes to plan a tick
    Planners(BenchPlannersArgs),
    /// A word that is no verb, or a verb that is not built yet.
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

The fleet and as many bare processes at a futex barrier take turns, so that what
disturbs one disturbs the other. `straight` drives in an empty world,
`decentralized-apf` past ten obstacles; a robot hears 16 others at most.")]
pub struct BenchLoopArgs {
    /// Sizes of the fleets
    #[arg(long, value_name = "N,..", value_delimiter = ',', default_value = "15,64,200", value_parser = parse_robots)]
    pub robots: Vec<usize>,
    /// Only this method: straight or decentralized-apf
    #[arg(long, value_name = "NAME", value_parser = ["straight", "decentralized-apf"])]
    pub planner: Option<String>,
    /// Ticks of each fleet
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = clap::value_parser!(u64).range(100..))]
    pub ticks: u64,
    /// How to print
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
    /// Periods per second; without it, what fits the size of the fleet
    #[arg(long, value_name = "HZ", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub hz: Option<u32>,
    /// How often each is measured, fleet and timers by turns
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repetitions: u32,
    /// How long each is measured
    #[arg(long, value_name = "TIME", default_value = "3", value_parser = parse_duration, allow_hyphen_values = true)]
    pub seconds: f64,
    /// How to print
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
    /// How often each is started, fleet and bare processes by turns
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repetitions: u32,
    /// How to print
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal bench planners`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal bench planners                 every method
  shoal bench planners apf rpoa        some of them
  shoal bench planners --format json > planners.json

Every figure is of one plan: the median, and what 99 of 100 take at most. All
cells take turns, so that a disturbance does not hit one of them alone.")]
pub struct BenchPlannersArgs {
    /// Only these methods
    #[arg(value_name = "NAME")]
    pub names: Vec<String>,
    /// Plans per method and cell; a slow method makes fewer
    #[arg(long, value_name = "N", default_value_t = 3000, value_parser = clap::value_parser!(u32).range(1..))]
    pub plans: u32,
    /// How to print
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

Every robot is a process that drives all the time and hears those around it.
The verdict is `valid`, `starved` or `impaired`; it does not change the exit
code, what a fleet leaves behind does (1).")]
pub struct StressArgs {
    /// So many robots
    #[arg(long, value_name = "N", default_value_t = 15, allow_negative_numbers = true)]
    pub robots: usize,
    /// For so long: 60s, 1.5m, 500ms, or seconds
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = parse_duration, allow_hyphen_values = true)]
    pub duration: f64,
    /// Periods per second of every process
    #[arg(long, value_name = "HZ", default_value_t = 50.0, value_parser = parse_number, allow_hyphen_values = true)]
    pub hz: f64,
    /// How to print
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}
