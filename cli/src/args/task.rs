//! Tasks of a running fleet: `task send`, `list`, `show`, `cancel`, `wait`.

use super::values::{Pose, parse_duration, parse_pose};
use super::{FleetArg, Format};
use clap::{Args, Subcommand, ValueEnum};
use model::TaskState;
use std::ffi::OsString;

const SHOW_EXAMPLES: &str = "\
Examples:
  shoal task show 17
  shoal task show order-17 --format json";

const CANCEL_EXAMPLES: &str = "\
Examples:
  shoal task cancel 17

The command returns when the robot has dropped the task. Without another goal
the robot stays where it is.";

/// `shoal task`.
#[derive(Debug, Subcommand)]
pub enum TaskVerb {
    /// Send robots to goals
    Send(TaskSendArgs),
    /// List the tasks of a fleet
    List(TaskListArgs),
    /// Show what has become of a task
    #[command(after_help = SHOW_EXAMPLES)]
    Show(OneTaskArgs),
    /// Cancel a task
    #[command(after_help = CANCEL_EXAMPLES)]
    Cancel(OneTaskArgs),
    /// Wait until tasks are done
    Wait(TaskWaitArgs),
    /// A word that is no verb.
    #[command(external_subcommand)]
    Other(Vec<OsString>),
}

/// `shoal task send`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal task send r03 4,-2                  after its present goals
  shoal task send r03 4,-2 6,0              two goals, one after the other
  shoal task send r03 4,-2,1.57             a unicycle faces +y there
  shoal task send r03 4,-2 --now            immediately; drops its other goals
  shoal task send --assign nearest 4,-2     the robot with the shortest way
  shoal task send --assign optimal 4,-2 0,3 -5,1
                                            the least sum of ways
  shoal task send --assign auction 4,-2 0,3 the robots bid for the goals
  shoal task send r03 4,-2 --id order-17    sent twice, it is one task

The command returns when the robots have the tasks. Tasks of robots that were
chosen by `--assign` go to another robot if theirs leaves or dies for good.")]
pub struct TaskSendArgs {
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// The robot, and its goals: X,Y in m, and for a unicycle or diff-drive its heading there, rad; only goals with `--assign`
    #[arg(value_name = "ROBOT|X,Y[,YAW]", required = true, num_args = 1..)]
    pub words: Vec<String>,
    /// Choose the robots instead of naming one
    #[arg(long, value_enum, value_name = "RULE")]
    pub assign: Option<AssignArg>,
    /// Replace the present goals; otherwise the goal is queued behind them
    #[arg(long)]
    pub now: bool,
    /// Go before waiting goals of a lower priority; the goals of the scenario have priority 0
    #[arg(long, value_name = "N", default_value_t = 0, allow_hyphen_values = true)]
    pub priority: i32,
    /// Give up what is not done after this much simulated time: 60s, 1.5m, or seconds
    #[arg(long, value_name = "TIME", value_parser = parse_duration, allow_hyphen_values = true)]
    pub deadline: Option<f64>,
    /// Name of the task, for its sender: letters, digits, `-`, `_`, `.` and `:`
    #[arg(long, value_name = "NAME")]
    pub id: Option<String>,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

impl TaskSendArgs {
    /// The robot that is named, if one is, and the goals.
    ///
    /// # Errors
    /// When a word is not a goal, in words.
    pub fn robot_and_goals(&self) -> Result<(Option<&str>, Vec<Pose>), String> {
        let (robot, goals) = match (self.assign, &self.words[..]) {
            (None, [robot, goals @ ..]) => (Some(robot.as_str()), goals),
            (_, goals) => (None, goals),
        };
        if goals.is_empty() {
            return Err("no goal is given: write X,Y in metres behind the robot, as in `r03 4,-2`".to_owned());
        }
        let pose =
            |word: &String| parse_pose(word).map_err(|why| format!("goal `{}`: {why}", word.trim().escape_debug()));
        Ok((robot, goals.iter().map(pose).collect::<Result<_, _>>()?))
    }
}

/// How the robots of tasks are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AssignArg {
    /// For one goal after the other, the robot with the shortest way to it
    Nearest,
    /// The robots with the least sum of ways, at most one goal each as far as there are robots
    Optimal,
    /// One goal after the other, to the robot with the lowest bid: what it says is left of its way, and the way to the goal
    Auction,
}

/// `shoal task list`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal task list
  shoal task list --robot r03 --state active --state assigned
  shoal task list --format json")]
pub struct TaskListArgs {
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// Only the tasks of this robot
    #[arg(long, value_name = "ROBOT")]
    pub robot: Option<String>,
    /// Only tasks in this state; may be repeated
    #[arg(long, value_enum, value_name = "STATE")]
    pub state: Vec<TaskStateArg>,
    /// Only the newest ones
    #[arg(long, value_name = "N", default_value_t = 100)]
    pub newest: u32,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// A state of tasks, by its word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TaskStateArg(pub TaskState);

impl ValueEnum for TaskStateArg {
    fn value_variants<'a>() -> &'a [TaskStateArg] {
        const {
            let (mut all, mut index) = ([TaskStateArg(TaskState::Queued); TaskState::ALL.len()], 0);
            while index < all.len() {
                all[index] = TaskStateArg(TaskState::ALL[index]);
                index += 1;
            }
            &{ all }
        }
    }

    fn to_possible_value(&self) -> Option<clap::builder::PossibleValue> {
        Some(clap::builder::PossibleValue::new(self.0.word()))
    }
}

/// `shoal task show` and `shoal task cancel`.
#[derive(Debug, Args)]
pub struct OneTaskArgs {
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// Number of the task, or the name that its sender gave it
    #[arg(value_name = "TASK")]
    pub task: String,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal task wait`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal task wait 17 18 19
  shoal task wait --all --timeout 5m

Exit codes: 0 all of them are done, 1 one has failed or was cancelled or
refused, 4 the time is over.")]
pub struct TaskWaitArgs {
    /// Which fleet.
    #[command(flatten)]
    pub fleet: FleetArg,
    /// Numbers of the tasks, or the names that their senders gave them
    #[arg(value_name = "TASK", required_unless_present = "all", conflicts_with = "all")]
    pub tasks: Vec<String>,
    /// All tasks that are not at their end now
    #[arg(long)]
    pub all: bool,
    /// Wait no longer: 60s, 1.5m, 500ms, or seconds of wall time
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "10m", allow_hyphen_values = true)]
    pub timeout: f64,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}
