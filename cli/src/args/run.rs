//! Runs of a scenario: `run`, and what is made of them: `plot`, `reproduce`.

use super::values::{parse_command, parse_duration};
use super::{DEFAULT_SCENARIO, Format, StartArgs};
use clap::{Args, ValueEnum};
use model::{AgentCommand, FilterKind};
use scenarios::Overrides;
use std::ffi::OsString;
use std::path::PathBuf;

/// `shoal run`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal run                            the demo: 15 robots, each a process
  shoal run demo-15 --mode single      in one thread, as fast as possible
  shoal run ring-15 --robots 8 --seed 7 --duration 30s
  shoal run my.toml --set clock.tick_hz=100 --set radio.drop=0.1
  shoal run my.toml --format json > report.json
  shoal run demo-15 --mode lockstep --rate 1
  shoal run ring-15 --agent 'python3 my.py'

SCENARIO is a file if it has a `/`, ends in .toml, or is a file that exists
here; `-` is standard input; else it is a name from the catalog (`shoal
validate` lists them).

The report goes to standard output, progress to standard error. The first Ctrl-C
ends the run and prints its report, the second ends it immediately.")]
pub struct RunArgs {
    /// A scenario file, or a name from the catalog
    #[arg(value_name = "SCENARIO", default_value = DEFAULT_SCENARIO)]
    pub scenario: OsString,
    /// Clock mode; by default the one of the scenario
    #[arg(long, value_name = "MODE")]
    pub mode: Option<ModeArg>,
    /// What the scenario is to be instead.
    #[command(flatten)]
    pub changes: ChangeArgs,
    /// End after this much simulated time: 60s, 1.5m, 500ms, or seconds
    #[arg(long, value_name = "TIME", value_parser = parse_duration, allow_hyphen_values = true)]
    pub duration: Option<f64>,
    /// How it begins.
    #[command(flatten)]
    pub start: StartArgs,
    /// Write the report to this file as JSON; `-` is standard output, instead of the text
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
    /// Write a record of every tick to this file, in MCAP format
    #[arg(long, value_name = "FILE.mcap")]
    pub record: Option<PathBuf>,
    /// Serve a page on which the fleet is watched and driven while it runs; in `lockstep`, real time is the rate then
    #[arg(long)]
    pub view: bool,
    /// Port of the page on 127.0.0.1; 0 is any that is free
    #[arg(long, value_name = "PORT", default_value_t = 0, requires = "view")]
    pub view_port: u16,
    /// Format of the report on standard output
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
    /// The folder of the files that a scenario on standard input names; a sweep says it
    #[arg(long, value_name = "DIR", hide = true)]
    pub beside: Option<PathBuf>,
}

/// What `run` and `up` change of a scenario.
#[derive(Debug, Args)]
pub struct ChangeArgs {
    /// Planner of every robot; `shoal planners` lists them
    #[arg(long, value_name = "NAME")]
    pub planner: Option<String>,
    /// Filter between planner and robot; by default that of the scenario
    #[arg(long, value_name = "FILTER")]
    pub filter: Option<FilterArg>,
    /// Agent of every robot: a program and its arguments, quoted as in a shell, as in --agent "python3 my.py"
    #[arg(long, value_name = "COMMAND", value_parser = parse_command, allow_hyphen_values = true)]
    pub agent: Option<AgentCommand>,
    /// Number of robots, for scenarios with a layout
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub robots: Option<usize>,
    /// Random seed
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub seed: Option<u64>,
    /// Set any key of the scenario, as in clock.tick_hz=100; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

impl ChangeArgs {
    /// As overrides of a scenario, with its clock mode and its duration, s, if they are to be others.
    pub fn overrides(&self, mode: Option<model::Mode>, duration_s: Option<f64>) -> Overrides {
        let ChangeArgs { planner, filter, agent, robots, seed, set } = self;
        Overrides {
            mode,
            planner: planner.clone(),
            filter: filter.map(FilterKind::from),
            agent: agent.clone(),
            robots: *robots,
            seed: *seed,
            duration_s,
            set: set.clone(),
        }
    }
}

/// How the processes keep time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ModeArg {
    /// Everything in one thread: fast, reproducible
    Single,
    /// One process per robot, tick by tick: reproducible
    Lockstep,
    /// One process per robot, each on its own timer: as on real robots
    Realtime,
}

impl From<ModeArg> for model::Mode {
    fn from(mode: ModeArg) -> model::Mode {
        match mode {
            ModeArg::Single => model::Mode::Single,
            ModeArg::Lockstep => model::Mode::Lockstep,
            ModeArg::Realtime => model::Mode::Realtime,
        }
    }
}

/// What stands between a method and its robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FilterArg {
    /// Commands go out as planned
    None,
    /// Each robot keeps to its share of every gap
    SharedGap,
}

impl From<FilterArg> for FilterKind {
    fn from(filter: FilterArg) -> FilterKind {
        match filter {
            FilterArg::None => FilterKind::None,
            FilterArg::SharedGap => FilterKind::SharedGap,
        }
    }
}

/// `shoal plot`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal run ring-15 --mode single --record ring.mcap
  shoal plot ring.mcap                 draws ring.svg
  shoal plot ring.mcap --out - | less  on standard output
  shoal plot out.json                  the record that a report names

The name of the picture is printed.")]
pub struct PlotArgs {
    /// A file written by `shoal run --record`, or the report of such a run
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// Output file; by default beside the record. `-` is standard output
    #[arg(long, value_name = "FILE.svg")]
    pub out: Option<PathBuf>,
}

/// `shoal replay`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal run demo-15 --record demo.mcap
  shoal replay demo.mcap                     what happened in the run
  shoal replay demo.mcap --verify            is it what the record says?
  shoal replay demo.mcap --against two.mcap  where do two runs part?

Exit codes: 0 equal, 1 not equal, 2 not a record. A record that is cut off is
compared as far as it goes.")]
pub struct ReplayArgs {
    /// A file written by `shoal run --record`
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// Compute the run again from its recorded inputs, and name the first difference
    #[arg(long, conflicts_with = "against")]
    pub verify: bool,
    /// Compare it with this record, tick by tick, robots by their names
    #[arg(long, value_name = "FILE")]
    pub against: Option<PathBuf>,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal export`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal export run.mcap --to mcap-ros2       run.ros2.mcap, for rosbag2
  shoal export run.mcap --to csv             run.csv: a line per body and tick
  shoal export run.mcap --to jsonl --out - | jq 'select(.type == \"event\")'

The name of the file is printed.")]
pub struct ExportArgs {
    /// A file written by `shoal run --record`
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// Format of the export
    #[arg(long, value_name = "FORMAT")]
    pub to: ExportTo,
    /// Output file; by default beside the record. `-` is standard output
    #[arg(short, long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// What a record can be exported to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ExportTo {
    /// MCAP with messages of ROS 2: /tf, poses, markers and log
    McapRos2,
    /// A table: a line per body and tick
    Csv,
    /// JSON lines: the run, frames, events, the outcome
    Jsonl,
}

/// `shoal reproduce`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal reproduce                      every paper
  shoal reproduce rpoa                 one paper
  shoal reproduce amr-apf --runs 11    its fleets from 11 starts
  shoal reproduce --out figures        the figures too, as CSV and SVG
  shoal reproduce rpoa --explain \"claim: free from local minima\"

The verdict of a row is `paper` (within a stated tolerance of what the paper
prints), `specification` (within the tolerance of its specification; the note
says why not of the paper) or `differs`. Exit code 0: every row that differs is
known to, and its note says why. 1: a row differs without a known reason, or
a starved or impaired fleet left a row without evidence. 130: interrupted; the
rows measured until then are printed.")]
pub struct ReproduceArgs {
    /// Only this paper
    #[arg(value_name = "PAPER")]
    pub paper: Option<String>,
    /// Number of starts of each fleet of real processes; 0 skips these fleets
    #[arg(long, value_name = "N", default_value_t = 5, allow_negative_numbers = true)]
    pub runs: u32,
    /// Write the figures to this directory, as CSV and SVG
    #[arg(long, value_name = "DIR", conflicts_with = "explain")]
    pub out: Option<PathBuf>,
    /// Show one row in full: its source, how it is computed, tolerance and verdict
    #[arg(long, value_name = "ROW")]
    pub explain: Option<String>,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}
