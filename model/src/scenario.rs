//! A scenario after validation: every default filled in, every layout placed, every time turned into a tick.
//!
//! These types are what the world, the agents and the daemon work with. They are plain data; what a scenario file
//! may contain, and what is wrong with it, is the business of the other modules. Lengths m, angles rad, times s.

use crate::agent::AgentCommand;
use crate::body::{BodyKind, Dynamics, Limits, Physics, Wheels};
use crate::choice;
use crate::map::MapRef;
use crate::params::ParamValues;
use crate::problem::Problem;
use crate::radio::Radio;
use crate::timeline::{Fault, TimelineAction, TimelineEvent};
use geometry::{ArmGeometry, ArmState, Capsule, Map};
use nalgebra::Point2;
use serde::{Deserialize, Serialize};

/// Most robots that one fleet can hold, late joiners included.
pub const MAX_ROBOTS: usize = 1024;
/// Most pieces (discs, walls, polygon edges, second links of arms) that one world may have in all, those of its map apart.
pub const MAX_SHAPES: usize = 1024;
/// Most goals that one robot may have waiting.
pub const MAX_GOALS: usize = 64;
/// Largest number of a processor.
pub const CPU_MAX: u16 = 1023;

/// A whole experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scenario {
    /// Its name, for reports.
    pub name: String,
    /// What it shows, one line.
    pub description: String,
    /// The world's edges. They are not walls.
    pub bounds: Bounds,
    /// What moves its bodies.
    pub physics: Physics,
    /// How time passes.
    pub clock: Clock,
    /// How the fleet is run.
    pub fleet: Fleet,
    /// How its processes are scheduled; `single` has none.
    pub processes: Processes,
    /// How the radio behaves at the start.
    pub radio: Radio,
    /// What stands or moves in the world besides robots.
    pub obstacles: Vec<Obstacle>,
    /// What stands there besides: the walls of a map.
    #[serde(default)]
    pub map: Option<MapRef>,
    /// The robots; the index is the slot. Late joiners are among them.
    pub robots: Vec<Robot>,
    /// What a robot added while the fleet runs is where the request says nothing: the scenario's defaults.
    pub template: Robot,
    /// The same for robots of the other kinds that drive about, as far as the defaults fit them.
    pub templates_of_others: Vec<Robot>,
    /// What happens when, sorted by tick; equal ticks keep the order of the file.
    pub events: Vec<TimelineEvent>,
    /// When the run counts as a success.
    pub expect: Expect,
    /// What is questionable about it: for people, nothing depends on it.
    pub warnings: Vec<Problem>,
}

impl Scenario {
    /// What a robot of this kind that is added while the fleet runs is where the request says nothing; `None` where the
    /// defaults do not fit this kind.
    pub fn template_of(&self, kind: BodyKind) -> Option<&Robot> {
        [&self.template].into_iter().chain(&self.templates_of_others).find(|robot| robot.kind == kind)
    }

    /// The walls of its map, if it has one.
    pub fn walls(&self) -> Option<&Map> {
        self.map.as_ref().map(MapRef::map)
    }

    /// Whether a command may act longer than its tick, or a word may not be heard a tick later: in `realtime`, and with a radio that
    /// is not perfect at all times, or reaches not as far for all.
    pub fn is_loose(&self) -> bool {
        let disturbs = |event: &TimelineEvent| match event.what {
            TimelineAction::Radio { radio, .. } => radio != Radio::PERFECT,
            TimelineAction::Fault { fault, .. } => {
                matches!(fault, Fault::Delay { .. } | Fault::Drop { .. } | Fault::Noise { .. })
            }
            _ => false,
        };
        let mut ranges = self.robots.iter().map(|robot| robot.radio_range_m);
        let first = ranges.next();
        let one_sided = ranges.any(|range| Some(range) != first);
        self.clock.mode == Mode::Realtime
            || one_sided
            || self.radio != Radio::PERFECT
            || self.events.iter().any(disturbs)
    }

    /// How many pieces there are besides one per robot: those of the obstacles, and the second link of every arm.
    ///
    /// Pieces are numbered in the order of the obstacles, and the bodies of the robots come after them.
    pub fn shape_pieces(&self) -> u32 {
        let arms = self.robots.iter().filter(|robot| robot.arm.is_some()).count();
        self.obstacles.iter().map(|obstacle| obstacle.shape.piece_count() as u32).sum::<u32>() + arms as u32
    }
}

/// A rectangle, m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// Smallest and largest x.
    pub x_m: [f64; 2],
    /// Smallest and largest y.
    pub y_m: [f64; 2],
}

choice! {
    /// How the processes keep time.
    #[derive(Default, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Mode {
        /// All cores in one thread.
        Single = "single",
        /// Real processes; the world opens a tick and waits for every robot's answer.
        #[default]
        Lockstep = "lockstep",
        /// Real processes, each on its own timer.
        Realtime = "realtime",
    }
}

/// How time passes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clock {
    /// Who waits for whom.
    pub mode: Mode,
    /// Ticks per second of simulated time.
    pub tick_hz: f64,
    /// Seed of every random stream.
    pub seed: u64,
    /// The run ends at this tick at the latest.
    pub ticks_max: u64,
    /// When the run ends before that.
    pub stop: Stop,
}

impl Clock {
    /// Length of a tick, s.
    pub fn dt_s(&self) -> f64 {
        1.0 / self.tick_hz
    }
}

choice! {
    /// When a run ends.
    #[derive(Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Stop {
        /// When every robot is at its last goal and nothing is left to come, or the time is up.
        Arrived = "arrived",
        /// When the time is up.
        Duration = "duration",
    }
}

/// How the fleet is run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fleet {
    /// Slots; the fleet's services are made for this many robots.
    pub max_robots: usize,
    /// What happens to a robot that does not answer.
    pub straggler: StragglerPolicy,
    /// `lockstep`: a robot that keeps a tick waiting for this long (its own time, not that of a loaded machine), s, is a
    /// straggler.
    pub straggler_limit_s: f64,
    /// `realtime`: a robot whose newest command is older than this is stopped, s.
    pub command_timeout_s: f64,
    /// An agent that is not ready this long after its start counts as dead, s (wall time).
    pub start_limit_s: f64,
    /// A robot that takes part and stays where it is for this long does not get to the task of an operator that it heads
    /// for, s.
    pub stuck_limit_s: f64,
}

choice! {
    /// What stands between the method of a robot and its body.
    #[derive(Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum FilterKind {
        /// Nothing: the body does what the method plans.
        None = "none",
        /// Robots keep to their shares of the gaps between them, and touch nobody.
        SharedGap = "shared-gap",
    }
}

choice! {
    /// What happens to a robot whose process is stopped or over the limit. Death is not a matter of policy.
    #[derive(Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum StragglerPolicy {
        /// The fleet waits for it until the limit, then holds it.
        Wait = "wait",
        /// It stands still, and comes back when it answers again.
        Hold = "hold",
        /// It is killed and stays where it stands.
        Drop = "drop",
    }
}

/// How the processes of a fleet are scheduled, and what they may use. The trajectories do not depend on it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Processes {
    /// The world's process.
    pub world: Scheduling,
    /// The process of every robot, in all its lives.
    pub agents: Scheduling,
    /// Limits of the process of every robot.
    pub agent_limits: ProcessLimits,
}

/// What one process may use at most. `None` is what the process that starts it may use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProcessLimits {
    /// Private writable memory, MiB.
    pub memory_mib: Option<u32>,
    /// Open files.
    pub files: Option<u32>,
}

/// Where a process runs, and which processes it has to let pass.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Scheduling {
    /// Processors that it may use, ascending; none: those of whoever starts it.
    pub cpus: Vec<u16>,
    /// Its scheduling class; `None`: that of whoever starts it.
    pub class: Option<Class>,
}

/// A scheduling class of Linux, see sched(7).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Class {
    /// `SCHED_OTHER`: what processes usually have.
    Other,
    /// `SCHED_BATCH`: the same, but waking up takes the processor from nobody.
    Batch,
    /// `SCHED_FIFO`: before all that is not real-time, for as long as it likes.
    Fifo {
        /// 1 to 99; a larger one goes first.
        priority: u8,
    },
    /// `SCHED_RR`: the same, taking turns with those of the same priority.
    Rr {
        /// 1 to 99; a larger one goes first.
        priority: u8,
    },
}

choice! {
    /// A scheduling class without its priority.
    pub enum ClassName {
        /// `SCHED_OTHER`.
        Other = "other",
        /// `SCHED_BATCH`.
        Batch = "batch",
        /// `SCHED_FIFO`.
        Fifo = "fifo",
        /// `SCHED_RR`.
        Rr = "rr",
    }
}

impl Class {
    /// The class without its priority.
    pub fn name(self) -> ClassName {
        match self {
            Class::Other => ClassName::Other,
            Class::Batch => ClassName::Batch,
            Class::Fifo { .. } => ClassName::Fifo,
            Class::Rr { .. } => ClassName::Rr,
        }
    }

    /// The word for it in a scenario.
    pub fn word(self) -> &'static str {
        self.name().word()
    }

    /// Its priority, if it is a real-time class.
    pub fn priority(self) -> Option<u8> {
        match self {
            Class::Other | Class::Batch => None,
            Class::Fifo { priority } | Class::Rr { priority } => Some(priority),
        }
    }
}

/// Numbers of processors as Linux writes them, `0-3,8`; `cpus` ascend.
pub fn cpu_list(cpus: &[u16]) -> String {
    let runs = cpus.chunk_by(|a, b| a + 1 == *b).map(|run| match run {
        [first, .., last] => format!("{first}-{last}"),
        [only] => only.to_string(),
        [] => String::new(),
    });
    runs.collect::<Vec<_>>().join(",")
}

/// Something in the world that is not a robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Obstacle {
    /// Its shape at the start.
    pub shape: Shape,
    /// How it moves; `None` stands still.
    pub motion: Option<Motion>,
}

/// A shape in the world frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Shape {
    /// A disc, a wall, or a wall with thickness.
    Capsule(Capsule),
    /// A filled simple polygon, corners in order.
    Polygon(Vec<Point2<f64>>),
}

impl Shape {
    /// How many capsules it is made of.
    pub fn piece_count(&self) -> usize {
        match self {
            Shape::Capsule(_) => 1,
            Shape::Polygon(corners) => corners.len(),
        }
    }

    /// The capsules it is made of: one, or the edges of a polygon.
    pub fn pieces(&self) -> Vec<Capsule> {
        match self {
            Shape::Capsule(capsule) => vec![*capsule],
            Shape::Polygon(corners) => {
                let n = corners.len();
                (0..n).map(|i| Capsule::segment(corners[i], corners[(i + 1) % n])).collect()
            }
        }
    }

    /// The point that a motion carries: the middle of a capsule's core, the mean of a polygon's corners.
    pub fn reference(&self) -> Point2<f64> {
        match self {
            Shape::Capsule(capsule) => nalgebra::center(&capsule.a, &capsule.b),
            Shape::Polygon(corners) => {
                let sum: nalgebra::Vector2<f64> = corners.iter().map(|corner| corner.coords).sum();
                Point2::from(sum / corners.len() as f64)
            }
        }
    }
}

/// How an obstacle, or a goal, moves. It is a function of time alone; nothing in the world changes it.
/// The shape keeps its orientation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Motion {
    /// On a circle: `center + radius (cos, sin)(omega t + phase)`.
    Orbit {
        /// Centre of the circle, m.
        center: Point2<f64>,
        /// Radius of the circle, m.
        radius_m: f64,
        /// Angular speed, rad/s, counter-clockwise.
        omega_radps: f64,
        /// Angle at t = 0, rad.
        phase_rad: f64,
    },
    /// Straight on, reflected at the edges of a rectangle (the reference point is).
    Bounce {
        /// Velocity at t = 0, m/s.
        velocity_mps: [f64; 2],
        /// The rectangle.
        within: Bounds,
    },
    /// A new seeded random heading every `turn_every_s`, reflected at the edges of a rectangle.
    RandomWalk {
        /// Speed, m/s.
        speed_mps: f64,
        /// Time between turns, s.
        turn_every_s: f64,
        /// The rectangle.
        within: Bounds,
    },
    /// From point to point at constant speed, starting at the first.
    Waypoints {
        /// The points, m.
        points: Vec<Point2<f64>>,
        /// Speed, m/s.
        speed_mps: f64,
        /// What comes after the last point.
        then: AtEnd,
    },
}

choice! {
    /// What a motion along waypoints does at its end.
    #[derive(Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum AtEnd {
        /// Straight to the first point and round again.
        Loop = "loop",
        /// Back the way it came, and so on.
        PingPong = "ping-pong",
        /// It stays.
        Stop = "stop",
    }
}

/// One robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Robot {
    /// Its name: `[a-z][a-z0-9_-]{0,31}`.
    pub id: String,
    /// How it moves.
    pub kind: BodyKind,
    /// What its body can do.
    pub limits: Limits,
    /// What it is built like, if it is an arm.
    pub arm: Option<ArmSetup>,
    /// Its wheels, if it is a diff-drive.
    pub wheels: Option<Wheels>,
    /// What physics with forces needs to know of its body.
    pub dynamics: Dynamics,
    /// Body radius, m; of an arm, half the thickness of its links.
    pub radius_m: f64,
    /// Where it starts, m; of an arm, where its tip starts.
    pub start: Point2<f64>,
    /// Its heading at the start, rad; of an arm, the direction of its last link.
    pub start_yaw_rad: f64,
    /// Its goals, in order; at least one. Those of an arm are for its tip.
    pub goals: Vec<Point2<f64>>,
    /// The heading that it is to have at the last of them, rad; `None` is any.
    pub goal_yaw_rad: Option<f64>,
    /// That heading counts as reached within this angle, rad.
    pub goal_yaw_tolerance_rad: f64,
    /// How often it goes through its goals, at least once; `None` is forever: it never arrives.
    pub rounds: Option<u32>,
    /// How its last goal moves; `None` stands still.
    pub goal_motion: Option<Motion>,
    /// A goal counts as reached within this distance, m.
    pub goal_tolerance_m: f64,
    /// Name of its method.
    pub planner: String,
    /// The method's parameters that differ from the default.
    pub params: ParamValues,
    /// What stands between its method and its body.
    pub filter: FilterKind,
    /// How far its sensors see, from its centre (the tip of an arm) to the surface of what is seen, m.
    pub sensor_range_m: f64,
    /// How far its radio hears, centre to centre (the tip of an arm), m.
    pub radio_range_m: f64,
    /// A neighbour once heard is kept until it is this much further away, m.
    pub radio_hysteresis_m: f64,
    /// Whether its sensors see robots on the radio as well; else it sees only those that are silent.
    pub sees_robots: bool,
    /// Whether the method may look at the map of fixed obstacles.
    pub knows_map: bool,
    /// What happens when its process ends, unless it was asked to.
    pub restart: Restart,
    /// The program to start as its agent; `None` is shoal itself.
    pub agent: Option<AgentCommand>,
}

/// An arm as it stands at the start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArmSetup {
    /// How it is built.
    pub geometry: ArmGeometry,
    /// Its joints at the start, rad.
    pub start_joints_rad: [f64; 2],
}

impl ArmSetup {
    /// The arm at the start.
    pub fn start(&self) -> ArmState {
        ArmState { geometry: self.geometry, joints_rad: self.start_joints_rad }
    }
}

crate::choice! {
    /// After which ends a process is started again.
    #[derive(Serialize, Deserialize)]
    pub enum RestartPolicy {
        /// After none.
        Never = "never",
        /// After a signal, an exit code other than 0, or a start that failed.
        OnFailure = "on-failure",
        /// After exit code 0 as well.
        Always = "always",
    }
}

/// What happens when the process of a robot ends without having been asked to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Restart {
    /// After which ends it is started again.
    pub policy: RestartPolicy,
    /// Maximum number of restarts within the window.
    pub limit: u32,
    /// Length of the window that ends with the newest death, ticks; `None` is the whole run.
    pub window_ticks: Option<u64>,
    /// Delay before the first restart in the window, ticks.
    pub delay_ticks: u64,
    /// Each further restart in the window has this times the delay of the one before.
    pub backoff: f64,
    /// Maximum delay, ticks.
    pub delay_ticks_max: u64,
}

impl Restart {
    /// No restart.
    pub const NEVER: Restart = Restart {
        policy: RestartPolicy::Never,
        limit: 0,
        window_ticks: None,
        delay_ticks: 1,
        backoff: 1.0,
        delay_ticks_max: u64::MAX,
    };

    /// A number of restarts after failures, always with the same delay.
    pub const fn on_failure(limit: u32, delay_ticks: u64) -> Restart {
        Restart { policy: RestartPolicy::OnFailure, limit, delay_ticks, ..Restart::NEVER }
    }
}

/// When a run counts as a success.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Expect {
    /// At least so many robots arrive; `None` is all of them.
    pub arrived_min: Option<usize>,
    /// At most so many contacts, robots and obstacles together.
    pub contacts_max: u64,
    /// All arrive within this time, s; `None` does not matter.
    pub makespan_s_max: Option<f64>,
    /// The smallest clearance (to robots and to obstacles) is at least this, m; `None` does not matter.
    pub clearance_m_min: Option<f64>,
    /// No contact begins from the first to the second of these times, s; `None` does not matter.
    pub no_contact_s: Option<[f64; 2]>,
    /// A robot whose process ended takes part again within this time, s; `None` does not matter.
    pub rejoin_s_max: Option<f64>,
    /// All tasks that are given until this time are done by then, s; `None` does not matter.
    pub tasks_done_by_s: Option<f64>,
}
