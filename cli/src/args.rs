//! The command line: what can be said, not what it does. One file for each kind of verb.

mod bench;
mod check;
mod fleet;
mod inject;
mod internal;
mod pace;
mod run;
mod service;
mod setup;
mod sweep;
mod task;
mod top;
mod values;
mod view;

pub use bench::*;
pub use check::*;
pub use fleet::*;
pub use inject::*;
pub use internal::*;
pub use pace::*;
pub use run::*;
pub use service::*;
pub use setup::*;
pub use sweep::*;
pub use task::*;
pub use top::*;
pub use values::{Pose, not_an_option, parse_duration, parse_point, parse_pose};
pub use view::*;

use clap::{Parser, Subcommand, ValueEnum};
use std::ffi::OsString;

/// The scenario that `shoal run` takes when it is given none.
pub const DEFAULT_SCENARIO: &str = "demo-15";

/// Run a fleet of robots with one process per robot, communicating through shared memory.
#[derive(Debug, Parser)]
#[command(name = "shoal", version, about, arg_required_else_help = true, max_term_width = 100)]
#[command(subcommand_value_name = "VERB", subcommand_help_heading = "Verbs")]
#[command(after_help = "\
Examples:
  shoal run                            the demo: 15 robots, each a process
  shoal run demo-15 --mode lockstep    the same, reproducible and faster
  shoal run my.toml --report out.json  a scenario of your own, a report to keep
  shoal run ring-15 --record r.mcap    and then `shoal plot r.mcap` draws it
  shoal planners                       the planners that a robot can use
  shoal reproduce                      compare the planners with their papers
  shoal sweep ring-15 --planner apf    many seeds, and planners, in one table
  shoal doctor                         can this machine run a fleet?

Exit codes: 0 all expectations met, 1 an expectation failed, 2 invalid command
line or scenario, 3 the environment does not allow the run, 4 time ran out,
130 interrupted")]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub verb: Verb,
}

/// What shoal can do.
#[derive(Debug, Subcommand)]
pub enum Verb {
    /// Run a scenario and print its report
    Run(Box<RunArgs>),
    /// Start a fleet that runs until it is stopped
    Up(Box<UpArgs>),
    /// End a running fleet
    Down(DownArgs),
    /// Draw a recorded run as SVG
    Plot(PlotArgs),
    /// Show a recorded run, compute it again and compare, or compare two
    Replay(ReplayArgs),
    /// Convert a recorded run to ROS 2, CSV or JSON lines
    Export(ExportArgs),
    /// Compare the planners with the results in their papers
    Reproduce(ReproduceArgs),
    /// Compare planners over scenarios, seeds and values of keys
    Sweep(Box<SweepArgs>),
    /// Run a fleet in real time and report whether this machine keeps up
    Stress(StressArgs),
    /// Benchmark the runtime and the planners
    #[command(subcommand, subcommand_value_name = "VERB", subcommand_help_heading = "Verbs")]
    Bench(BenchVerb),
    /// Check scenarios without running them
    Validate(ValidateArgs),
    /// Print all keys of scenario files: JSON Schema or text
    Schema(SchemaArgs),
    /// List the planners, or describe one
    Planners(PlannersArgs),
    /// Make a scenario to begin with
    New(NewArgs),
    /// Check whether this machine can run a fleet
    Doctor(DoctorArgs),
    /// Remove the files of fleets that were killed
    Clean(CleanArgs),
    /// Show the robots of a running fleet
    Ps(PsArgs),
    /// Show a running fleet in the terminal, with keys to drive it
    Top(TopArgs),
    /// Show the log of a fleet started with `shoal up`
    Logs(LogsArgs),
    /// Show latencies and pose ages of a running fleet
    Latency(LatencyArgs),
    /// Serve a page on which running fleets are watched and driven
    View(ViewArgs),
    /// Print what is known of a running fleet in the text format of Prometheus
    Metrics(MetricsArgs),
    /// Pause a running fleet between two ticks
    Pause(PauseArgs),
    /// Let a paused fleet go on, or change the rate of a running one
    Resume(ResumeArgs),
    /// Do some ticks of a fleet, and pause it
    Step(StepArgs),
    /// Add a robot to a running fleet
    Add(AddArgs),
    /// Take a robot out of a running fleet
    #[command(after_help = fleet::REMOVE_HELP)]
    Remove(OneRobotArgs),
    /// Give a robot of a running fleet a new process
    #[command(after_help = fleet::RESTART_HELP)]
    Restart(OneRobotArgs),
    /// Send tasks to robots of a running fleet, and follow them
    #[command(subcommand, subcommand_value_name = "VERB", subcommand_help_heading = "Verbs")]
    Task(TaskVerb),
    /// Put a fault on a robot of a running fleet
    #[command(subcommand, subcommand_value_name = "FAULT", subcommand_help_heading = "Faults")]
    Inject(InjectVerb),
    /// Print what a shell needs to complete words
    Completions(CompletionsArgs),
    /// Print or write man pages
    Man(ManArgs),
    /// The process of one robot; started by the daemon.
    #[command(hide = true)]
    Agent(AgentArgs),
    /// The process of the world; started by the daemon.
    #[command(hide = true)]
    World(WorldArgs),
    /// A process that only waits; started by `shoal bench`.
    #[command(hide = true)]
    Bare(BareArgs),
    /// Clears away what dead processes of a fleet hold; started by the daemon.
    #[command(hide = true)]
    Janitor(JanitorArgs),
    /// Cleans after a daemon that was killed; started by the daemon.
    #[command(hide = true)]
    Guardian(GuardianArgs),
    /// A word that is no verb.
    #[command(external_subcommand)]
    Other(Vec<OsString>),
}

/// Output format.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Human-readable text
    #[default]
    Text,
    /// JSON
    Json,
}

#[cfg(test)]
mod tests;
