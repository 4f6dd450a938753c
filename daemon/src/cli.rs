//! The command line: what can be said, not what it does.

use clap::{Args, Parser, Subcommand, ValueEnum};
use std::ffi::OsString;
use std::path::PathBuf;

/// The scenario that `shoal run` takes when it is given none.
pub const DEFAULT_SCENARIO: &str = "demo-15";

/// Runs a fleet of robots the way it will really run: one process per robot, over shared memory.
#[derive(Debug, Parser)]
#[command(name = "shoal", version, about, arg_required_else_help = true, max_term_width = 100)]
#[command(subcommand_value_name = "VERB", subcommand_help_heading = "Verbs")]
#[command(after_help = "\
Examples:
  shoal run                            the demo: 15 robots, each a process
  shoal run demo-15 --mode lockstep    the same, reproducible and faster
  shoal run my.toml --report out.json  a scenario of your own, a report to keep
  shoal run ring-15 --record ring.rec  and then `shoal plot ring.rec` draws it
  shoal planners                       the methods that can steer a robot
  shoal reproduce                      what their papers report, and what we get
  shoal doctor                         can this machine run a fleet?

Exit codes: 0 as expected, 1 not as expected, 2 wrong command line or scenario,
3 the environment does not allow it, 4 time ran out, 130 interrupted")]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub verb: Verb,
}

/// What shoal can do.
#[derive(Debug, Subcommand)]
pub enum Verb {
    /// Run a scenario and report how it went
    Run(Box<RunArgs>),
    /// Draw a recorded run as SVG
    Plot(PlotArgs),
    /// Hold the methods against their papers
    Reproduce(ReproduceArgs),
    /// Run a fleet in real time, and say whether this machine keeps up
    Stress(StressArgs),
    /// Measure the parts
    #[command(subcommand, subcommand_value_name = "VERB", subcommand_help_heading = "Verbs")]
    Bench(BenchVerb),
    /// Check scenarios without running them
    Validate(ValidateArgs),
    /// Print the JSON Schema of scenario files
    Schema(SchemaArgs),
    /// List the methods that steer robots, or explain one
    Planners(PlannersArgs),
    /// Check whether this machine can run a fleet
    Doctor(DoctorArgs),
    /// Remove what fleets that were killed left behind
    Clean(CleanArgs),
    /// Show the robots of a running fleet
    Ps(PsArgs),
    /// Show how late and how old things are in a running fleet
    Latency(LatencyArgs),
    /// Let one more robot join a running fleet
    Add(AddArgs),
    /// Give a robot of a running fleet something to do
    #[command(subcommand, subcommand_value_name = "VERB", subcommand_help_heading = "Verbs")]
    Task(TaskVerb),
    /// The process of one robot; started by the daemon.
    #[command(hide = true)]
    Agent(AgentArgs),
    /// The process of the world; started by the daemon.
    #[command(hide = true)]
    World(WorldArgs),
    /// A process that only waits; started by `shoal bench`.
    #[command(hide = true)]
    Bare(BareArgs),
    /// Cleans after a daemon that was killed; started by the daemon.
    #[command(hide = true)]
    Guardian(GuardianArgs),
    /// A word that is no verb, or a verb that is not built yet.
    #[command(external_subcommand)]
    Other(Vec<OsString>),
}

/// How to print.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// For people
    #[default]
    Text,
    /// For programs
    Json,
}

/// How the processes keep time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ModeArg {
    /// Everything in one thread: fast, reproducible
    Single,
    /// One process per robot, tick by tick: reproducible
    Lockstep,
    /// One process per robot, each on its own timer: as it would drive
    Realtime,
}

impl From<ModeArg> for scenarios::Mode {
    fn from(mode: ModeArg) -> scenarios::Mode {
        match mode {
            ModeArg::Single => scenarios::Mode::Single,
            ModeArg::Lockstep => scenarios::Mode::Lockstep,
            ModeArg::Realtime => scenarios::Mode::Realtime,
        }
    }
}

/// The safety filter between a method and its robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FilterArg {
    /// Commands go out as planned
    None,
    /// No robot takes more than half of the gap (not built yet)
    #[value(hide = true)]
    HalfGap,
}

/// `shoal run`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal run                            the demo: 15 robots, each a process
  shoal run demo-15 --mode single      in one thread, as fast as it goes
  shoal run ring-15 --robots 8 --seed 7 --duration 30s
  shoal run my.toml --set clock.tick_hz=100 --set radio.drop=0.1
  shoal run my.toml --format json > report.json

SCENARIO is a file if it has a `/`, ends in .toml, or is a file that exists
here; else it is a name from the catalog (`shoal validate` lists them).

The report goes to standard output, progress to standard error. The first Ctrl-C
ends the run and reports what there is, the second ends it at once.")]
pub struct RunArgs {
    /// A scenario file, or a name from the catalog
    #[arg(value_name = "SCENARIO", default_value = DEFAULT_SCENARIO)]
    pub scenario: OsString,
    /// How time passes; without it, as the scenario says
    #[arg(long, value_name = "MODE")]
    pub mode: Option<ModeArg>,
    /// The method for every robot; `shoal planners` lists them
    #[arg(long, value_name = "NAME")]
    pub planner: Option<String>,
    /// So many robots, for scenarios with a layout
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub robots: Option<usize>,
    /// Seed of everything random
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub seed: Option<u64>,
    /// End after this much simulated time: 60s, 1.5m, 500ms, or seconds
    #[arg(long, value_name = "TIME", value_parser = parse_duration, allow_hyphen_values = true)]
    pub duration: Option<f64>,
    /// The safety filter between method and robot
    #[arg(long, value_name = "FILTER", default_value = "none")]
    pub filter: FilterArg,
    /// Set any key of the scenario, as in clock.tick_hz=100; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Write the report to this file as JSON
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
    /// Record every tick in this file, for `shoal plot`
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// How to print the report on standard output
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal plot`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal run ring-15 --mode single --record ring.rec
  shoal plot ring.rec                  draws ring.svg
  shoal plot ring.rec --out - | less   on standard output
  shoal plot out.json                  the record that a report names

It prints the name of the picture.")]
pub struct PlotArgs {
    /// What `shoal run --record` wrote, or the report of such a run
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// Where to draw; without it, beside the record. `-` is standard output
    #[arg(long, value_name = "FILE.svg")]
    pub out: Option<PathBuf>,
}

/// `shoal reproduce`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal reproduce                      every paper
  shoal reproduce rpoa                 one of them
  shoal reproduce amr-apf --runs 11    its fleets from eleven starts
  shoal reproduce --out figures        the figures too, as CSV and SVG

A row holds when ours is within the tolerance of the oracle, the reference
implementation of the paper's specification, or of the paper. Exit code 0: all
rows hold. 1: some do not; what is known of the reason is in their notes.
130: interrupted, after the rows that there are.")]
pub struct ReproduceArgs {
    /// Only this paper
    #[arg(value_name = "PAPER")]
    pub paper: Option<String>,
    /// Starts of each fleet that runs as real processes; 0 runs none of them
    #[arg(long, value_name = "N", default_value_t = 5, allow_negative_numbers = true)]
    pub runs: u32,
    /// Write the figures into this directory, as CSV and SVG
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// How to print
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

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

/// `shoal validate`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal validate my.toml           every problem at once, with line numbers
  shoal validate scenarios/*.toml
  shoal validate                   the catalog that ships with shoal")]
pub struct ValidateArgs {
    /// Scenario files or names from the catalog; none is the whole catalog
    #[arg(value_name = "FILE")]
    pub scenarios: Vec<OsString>,
    /// How to print
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal schema`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  shoal schema > shoal.schema.json          and point your editor at it")]
pub struct SchemaArgs {
    /// How to print; a schema is JSON either way
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal planners`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal planners       one line per method
  shoal planners apf   its parameters: units, defaults, ranges, meaning")]
pub struct PlannersArgs {
    /// Explain this one
    #[arg(value_name = "NAME")]
    pub name: Option<String>,
    /// How to print
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal doctor`.
#[derive(Debug, Args)]
pub struct DoctorArgs {
    /// How to print
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal clean`.
#[derive(Debug, Args)]
pub struct CleanArgs {
    /// How to print
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

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

/// `shoal stress`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal stress                             15 robots at 50 Hz for a minute
  shoal stress --robots 64 --duration 20s
  shoal stress --hz 200 --format json > stress.json

Every robot is a process that drives all the time and hears those around it.
The verdict is `valid` or `starved`; neither changes the exit code, what a
fleet leaves behind does (1).")]
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
    /// Draw the histogram into this file
    #[arg(long, value_name = "FILE.svg")]
    pub svg: Option<PathBuf>,
    /// How to print
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
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
    /// Where it is to go, m
    #[arg(long, value_name = "X,Y", value_parser = parse_point, allow_hyphen_values = true)]
    pub goal: [f64; 2],
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
  shoal task send r03 4,-2 --now            at once, and forget the others")]
pub struct TaskSendArgs {
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// The robot
    #[arg(value_name = "ID")]
    pub id: String,
    /// Where to, m
    #[arg(value_name = "X,Y", value_parser = parse_point, allow_hyphen_values = true)]
    pub goal: [f64; 2],
    /// Head there at once; otherwise the goal queues behind those it has
    #[arg(long)]
    pub now: bool,
    /// How to print
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

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

/// `shoal guardian`, for the daemon.
#[derive(Debug, Args)]
pub struct GuardianArgs {
    /// The root of the run.
    #[arg(long)]
    pub root: PathBuf,
}

/// A time as people write it, in seconds: `60s`, `1.5m`, `500ms`, `2h`, or a plain number of seconds.
pub fn parse_duration(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit_s = match &text[digits.len()..] {
        "" | "s" | "sec" => 1.0,
        "ms" => 1e-3,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        unit => return Err(format!("unknown unit `{unit}`; write 60s, 1.5m, 500ms, or seconds")),
    };
    match digits.trim_end().parse::<f64>() {
        Ok(number) if number.is_finite() && number > 0.0 => Ok(number * unit_s),
        Ok(_) => Err("a duration is more than zero".to_string()),
        Err(_) => Err("not a time; write 60s, 1.5m, 500ms, or seconds".to_string()),
    }
}

/// How many robots a bench is to have: one less than a fleet can hold, because one more joins.
fn parse_robots(text: &str) -> Result<usize, String> {
    let most = scenarios::MAX_ROBOTS - 1;
    match text.trim().parse() {
        Ok(robots) if (1..=most).contains(&robots) => Ok(robots),
        _ => Err(format!("`{text}` is not a number of robots; write sizes from 1 to {most}, as in 15,64,200")),
    }
}

/// A point as people write it: `X,Y`, m.
pub fn parse_point(text: &str) -> Result<[f64; 2], String> {
    let Some((x, y)) = text.split_once(',') else {
        return Err("not a point; write X,Y in metres, as in 4,-2.5".to_string());
    };
    Ok([parse_number(x)?, parse_number(y)?])
}

fn parse_number(text: &str) -> Result<f64, String> {
    let text = text.trim();
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(format!("`{text}` is not a number")),
    }
}

#[cfg(test)]
#[path = "cli_tests.rs"]
mod tests;
