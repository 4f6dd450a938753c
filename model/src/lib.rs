//! The nouns of shoal: plain data that every other crate speaks of. Lengths m, angles rad, times s.
//!
//! Nothing here reads a file, a clock or the command line, and nothing can fail for lack of one.

pub mod agent;
pub mod body;
pub mod event;
pub mod field;
pub mod ids;
pub mod key;
pub mod kind;
pub mod kinematics;
pub mod map;
pub mod measure;
pub mod motion;
pub mod outcome;
pub mod pace;
pub mod params;
pub mod plan;
pub mod problem;
pub mod radio;
pub mod random;
pub mod scenario;
pub mod state;
pub mod task;
pub mod timeline;
pub mod value;

pub use agent::AgentCommand;
pub use body::{BodyKind, Drive, Dynamics, Limits, Physics, Wheels};
pub use event::{Event, EventKind, EventName, Partner, Silence, Touch};
pub use ids::{RobotIndex, RobotInstance};
pub use map::{MapProblem, MapRef};
pub use measure::{Cause, Metric, PerCause, PerMetric};
pub use motion::Mover;
pub use outcome::{FilterCount, Gone, Outcome, RobotOutcome, Stall};
pub use pace::{PaceChange, PaceState, Rate};
pub use params::{ParamValue, ParamValues};
pub use plan::PlanState;
pub use problem::Problem;
pub use radio::Radio;
pub use scenario::*;
pub use state::{ProcessState, RobotState};
pub use task::{GoalSource, Task, TaskEnd, TaskId, TaskState, TaskStep};
pub use timeline::{Fault, FaultSource, TimelineAction, TimelineEvent};
