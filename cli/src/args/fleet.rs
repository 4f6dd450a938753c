//! Running fleets, from a second terminal: `ps`, `latency`, `add`, `remove`, `restart`.

use super::Format;
use super::values::{Pose, parse_number, parse_point, parse_pose};
use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};
use model::Metric;
use std::path::PathBuf;

/// Which of the running fleets is meant.
#[derive(Clone, Debug, Args)]
pub struct FleetArg {
    /// Name or id of the fleet, if several are running; `shoal ps` lists them
    #[arg(long, value_name = "FLEET")]
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
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal latency`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal latency                        the fleet, then every robot: pose age
  shoal latency --metric wake          every robot: wake-up lateness
  shoal latency r03                    everything about one robot
  shoal latency r03 --pairs            pose ages by neighbour
  shoal latency --metric reaction --histogram
  shoal latency --svg ages.svg
  shoal latency --record run.mcap      of a run that has ended

The statistics are read from shared memory; the processes are not disturbed.")]
pub struct LatencyArgs {
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// Show what a record holds, instead of a running fleet
    #[arg(long, value_name = "FILE", conflicts_with_all = ["fleet", "pairs", "histogram", "svg"])]
    pub record: Option<PathBuf>,
    /// Only these robots
    #[arg(value_name = "ROBOT")]
    pub robots: Vec<String>,
    /// Metric of the table of robots and of the histogram
    #[arg(long, value_enum, value_name = "METRIC", default_value_t)]
    pub metric: MetricArg,
    /// List the neighbours of each robot and the ages of their poses
    #[arg(long)]
    pub pairs: bool,
    /// Print a histogram
    #[arg(long)]
    pub histogram: bool,
    /// Draw the histogram to this file; `-` is standard output, instead of the figures
    #[arg(long, value_name = "FILE.svg")]
    pub svg: Option<PathBuf>,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// A metric, by the name that the command line has for it: that of its field without the unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MetricArg(pub Metric);

impl Default for MetricArg {
    fn default() -> MetricArg {
        MetricArg(Metric::PoseAge)
    }
}

impl ValueEnum for MetricArg {
    fn value_variants<'a>() -> &'a [MetricArg] {
        const {
            let (mut all, mut index) = ([MetricArg(Metric::PoseAge); Metric::ALL.len()], 0);
            while index < all.len() {
                all[index] = MetricArg(Metric::ALL[index]);
                index += 1;
            }
            &{ all }
        }
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let MetricArg(metric) = self;
        let name = metric.field().trim_end_matches("_us").replace('_', "-");
        Some(PossibleValue::new(name).help(metric.help()))
    }
}

/// `shoal metrics`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal metrics
  shoal metrics --fleet abcd234 > /var/lib/node_exporter/shoal.prom

It reads what `shoal ps` and `shoal latency` read; the robots are not disturbed.")]
pub struct MetricsArgs {
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
}

/// `shoal add`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal add --start 0,-8 --goal 0,8
  shoal add --id scout --start -3,0 --goal 3,0 --kind unicycle --yaw 1.57
  shoal add --count 5 --layout random
  shoal add --count 8 --layout ring --set radius_m=4 --set center_m=[0,2]

It returns when the robot takes part, hears all robots in its range, and is
heard by them. Layouts are those of `[layout]` in scenarios.")]
pub struct AddArgs {
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// Name of the robot; generated if omitted
    #[arg(long, value_name = "ID")]
    pub id: Option<String>,
    /// Start position, m
    #[arg(long, value_name = "X,Y", value_parser = parse_point, allow_hyphen_values = true)]
    #[arg(required_unless_present = "layout")]
    pub start: Option<[f64; 2]>,
    /// Goal position, m, and for a unicycle or diff-drive its heading there, rad
    #[arg(long, value_name = "X,Y[,YAW]", value_parser = parse_pose, allow_hyphen_values = true)]
    #[arg(required_unless_present = "layout")]
    pub goal: Option<Pose>,
    /// Heading at the start, rad; by default towards the goal
    #[arg(long, value_name = "RAD", value_parser = parse_number, allow_hyphen_values = true)]
    pub yaw: Option<f64>,
    /// Number of robots
    #[arg(long, value_name = "N", requires = "layout")]
    pub count: Option<usize>,
    /// Pattern of their starts and goals
    #[arg(long, value_name = "LAYOUT", requires = "count", conflicts_with_all = ["id", "start", "goal", "yaw"])]
    pub layout: Option<String>,
    /// A key of the layout, such as `radius_m=4`
    #[arg(long, value_name = "KEY=VALUE", requires = "layout")]
    pub set: Vec<String>,
    /// Seed of what is random in the layout; by default that of the scenario
    #[arg(long, value_name = "SEED", requires = "layout")]
    pub seed: Option<u64>,
    /// Planner; by default the one of the scenario's defaults
    #[arg(long, value_name = "NAME")]
    pub planner: Option<String>,
    /// Body kind, point, unicycle or diff-drive; by default the one of the scenario's defaults
    #[arg(long, value_name = "KIND")]
    pub kind: Option<String>,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal remove` and `shoal restart`.
#[derive(Debug, Args)]
pub struct OneRobotArgs {
    /// The robot
    #[arg(value_name = "ROBOT")]
    pub robot: String,
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// After the help of `shoal remove`.
pub(super) const REMOVE_HELP: &str = "\
Examples:
  shoal remove r03

The robot leaves between two ticks, and its process ends. Tasks that were sent
to it by name fail; tasks for which shoal chose it go to other robots. Its name
can be used again by `shoal add --id`.";

/// After the help of `shoal restart`.
pub(super) const RESTART_HELP: &str = "\
Examples:
  shoal restart r03

The process of the robot is killed, if it has one, and a new one takes over its
body, goals and tasks. A robot that is dead for good or was dropped comes back.
The rest of the fleet goes on; in `lockstep` it waits for the new process.";
