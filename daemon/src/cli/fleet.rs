//! Running fleets, from a second terminal: `ps`, `latency`, `add`, `task`.

use super::Format;
use super::values::{Pose, parse_number, parse_point, parse_pose};
use clap::{Args, Subcommand, ValueEnum};
use std::ffi::OsString;
use std::path::PathBuf;

/// Which of the running fleets is meant.
#[derive(Clone, Debug, Args)]
pub struct FleetArg {
    /// The fleet, if several are running; `shoal ps` names them
    #[arg(long, value_name = "ID")]
    pub fleet: Option<String>,
}

/// `shoal ps`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal ps
  shoal ps --format json")]
pub struct PsArgs {
    /// Which fleet; without it, all that are running.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// How to print
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal latency`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal latency                        the fleet, then every robot: pose age
  shoal latency --metric wake          every robot: how late it wakes up
  shoal latency r03                    everything about one robot
  shoal latency r03 --pairs            whose poses it used, how old
  shoal latency --metric reaction --histogram
  shoal latency --svg ages.svg

It reads what the processes count into shared memory, and costs them nothing.")]
pub struct LatencyArgs {
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// These robots; without any, all
    #[arg(value_name = "ROBOT")]
    pub robots: Vec<String>,
    /// What the table of robots and the histogram show
    #[arg(long, value_enum, value_name = "METRIC", default_value_t)]
    pub metric: MetricArg,
    /// List whose poses every robot used, and how old they were
    #[arg(long)]
    pub pairs: bool,
    /// Draw a histogram
    #[arg(long)]
    pub histogram: bool,
    /// Draw the histogram into this file; `-` is standard output, instead of the figures
    #[arg(long, value_name = "FILE.svg")]
    pub svg: Option<PathBuf>,
    /// How to print
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// What is measured in a fleet, by the name that the command line has for it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum MetricArg {
    /// Age of a neighbour's pose when the planner uses it
    #[default]
    PoseAge,
    /// How late a process wakes up
    Wake,
    /// Time in the planner
    Plan,
    /// Time from waking up to the command
    Step,
    /// Age of a command when it acts in the world
    CommandAge,
    /// From the odometry to the moment that the command computed from it acts
    Reaction,
}

/// `shoal add`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal add --start 0,-8 --goal 0,8
  shoal add --id scout --start -3,0 --goal 3,0 --kind unicycle --yaw 1.57")]
pub struct AddArgs {
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// Its name; without it, one is found
    #[arg(long, value_name = "ID")]
    pub id: Option<String>,
    /// Where it starts, m
    #[arg(long, value_name = "X,Y", value_parser = parse_point, allow_hyphen_values = true)]
    pub start: [f64; 2],
    /// Where it is to go, m, and for a unicycle the heading that it is to have there, rad
    #[arg(long, value_name = "X,Y[,YAW]", value_parser = parse_pose, allow_hyphen_values = true)]
    pub goal: Pose,
    /// Its heading at the start, rad; without it, towards its goal
    #[arg(long, value_name = "RAD", value_parser = parse_number, allow_hyphen_values = true)]
    pub yaw: Option<f64>,
    /// Its method; without it, the scenario's default
    #[arg(long, value_name = "NAME")]
    pub planner: Option<String>,
    /// How it moves: point or unicycle; without it, the scenario's default
    #[arg(long, value_name = "KIND")]
    pub kind: Option<String>,
    /// How to print
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal task`.
#[derive(Debug, Subcommand)]
pub enum TaskVerb {
    /// Send a robot to a place
    Send(TaskSendArgs),
    /// A word that is no verb, or a verb that is not built yet.
    #[command(external_subcommand)]
    Other(Vec<OsString>),
}

/// `shoal task send`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal task send r03 4,-2                  after the goals it has
  shoal task send r03 4,-2,1.57             a unicycle is to face +y there
  shoal task send r03 4,-2 --now            at once, and forget the others")]
pub struct TaskSendArgs {
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// The robot
    #[arg(value_name = "ID")]
    pub id: String,
    /// Where to, m, and for a unicycle the heading that it is to have there, rad
    #[arg(value_name = "X,Y[,YAW]", value_parser = parse_pose, allow_hyphen_values = true)]
    pub goal: Pose,
    /// Head there at once; otherwise the goal queues behind those it has
    #[arg(long)]
    pub now: bool,
    /// How to print
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}
