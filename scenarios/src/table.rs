//! The key table: every key that a scenario file may contain, declared once.
//!
//! The walker checks files against it, readers ask with its keys, and the JSON Schema and the reference are printed from
//! it. A new key costs one declaration here and one use where it is read.

mod obstacles;
mod robots;

pub(crate) use obstacles::{Motion, MotionKind, Obstacle, ObstacleShape};
pub(crate) use robots::{Arm, Body, KindKey, Kinds, Layout, LayoutKind, Mobile, PlacedArm, Robot, WheelKeys};

use crate::paper::PAPER;
use crate::types::{Arrivals, Interval, Pose};
use model::field::{ParamsByPlanner, Table, Tables};
use model::kind::{Kind, Range, Section};
use model::{CPU_MAX, ClassName, MAX_ROBOTS, MAX_SHAPES, Mode, Physics, Stop, StragglerPolicy, choice, keys};
use obstacles::OBSTACLE;
use robots::{DEFAULTS, KINDS, LAYOUT, ROBOT};

/// Most entries of the timeline.
const MAX_EVENTS: usize = 10_000;

/// A whole file.
pub(crate) static ROOT: Section = Section {
    title: "the top level",
    help: "One experiment: a world, a fleet, a timeline and what is expected of them.",
    tag: None,
    groups: &[Root::KEYS],
};

keys! {
    /// The sections of a file.
    pub(crate) keys Root {
        /// Name of the scenario, for reports.
        name: String => "the name of the file", "", 0..=64;
        /// Description in one line.
        description: String = String::new(), "", 0..=500;
        /// The edges of the world, and what moves its bodies.
        world: Table => optional, "", &WORLD;
        /// Clock: mode, tick rate, duration.
        clock: Table => optional, "", &CLOCK;
        /// Capacity and time limits of the fleet.
        fleet: Table => optional, "", &FLEET;
        /// Processors, scheduling classes and limits of the processes.
        processes: Table => optional, "", &PROCESSES;
        /// Faults of the radio, from the start.
        radio: Table => optional, "", &RADIO;
        /// Default values for every robot.
        defaults: Table => optional, "", &DEFAULTS;
        /// Default values by body kind; they override `defaults`.
        kinds: Table => optional, "", &KINDS;
        /// Parameters by planner, for the whole fleet.
        planners: ParamsByPlanner => optional, "";
        /// Robots in a pattern. They come before the `robot` entries.
        layout: Table => optional, "", &LAYOUT;
        /// Robots one by one.
        robot: Tables => optional, "", (&ROBOT, MAX_ROBOTS);
        /// Obstacles, fixed or moving.
        obstacle: Tables => optional, "", (&OBSTACLE, MAX_SHAPES);
        /// Timeline of events.
        event: Tables => optional, "", (&EVENT, MAX_EVENTS);
        /// Conditions under which the run is a success.
        expect: Table => optional, "", &EXPECT;
        /// What a paper says about this scenario; only `shoal reproduce` reads it.
        paper: Table => optional, "", &PAPER;
    }
}

static WORLD: Section = Section {
    title: "[world]",
    help: "The edges of the world, its map, and what moves its bodies. The edges are not walls, but starts and goals must lie \
           inside. No coordinate may be larger than 1e7 m.",
    tag: None,
    groups: &[World::KEYS],
};

keys! {
    /// Keys of `[world]`.
    pub(crate) keys World {
        /// Smallest and largest x.
        x_m: Interval => "[-10, 10], or those of the map", "m";
        /// Smallest and largest y.
        y_m: Interval => "[-10, 10], or those of the map", "m";
        /// File with the walls of the world: .yaml of ROS map_server (with a PGM or PNG), .map of MovingAI, or .geojson with
        /// polygons in metres. The path is relative to the scenario's file.
        map: String => optional, "", 1..=4096;
        /// What cells of a map_server map are that are neither free nor occupied.
        map_unknown: UnknownCells = UnknownCells::Obstacle, "";
        /// Side of a cell of a MovingAI map.
        map_cell_m: f64 => "1", "m", 0.001..=1000.0;
        /// kinematic: bodies move as they are asked to, and contacts are counted; rapier: bodies have mass and push each
        /// other, walls stop them, wheels and feet hold no more than their grip.
        physics: Physics = Physics::Kinematic, "";
    }
}

choice! {
    /// How unknown cells are treated.
    pub(crate) enum UnknownCells {
        Obstacle = "obstacle",
        Free = "free",
    }
}

static CLOCK: Section =
    Section { title: "[clock]", help: "Clock: mode, tick rate, duration.", tag: None, groups: &[Clock::KEYS] };

keys! {
    /// Keys of `[clock]`.
    pub(crate) keys Clock {
        /// realtime: each process on its own timer; lockstep: all processes tick by tick; single: one thread.
        mode: Mode = Mode::Lockstep, "";
        /// Ticks per second of simulated time.
        tick_hz: f64 = 50.0, "Hz", 1.0..=10_000.0;
        /// Seed of every random stream.
        seed: u64 = 1, "";
        /// Simulated time limit of the run.
        duration_s: f64 = 60.0, "s", Range::POSITIVE;
        /// arrived: ends when all robots are at their last goals and no event is pending; duration: ends at
        /// duration_s.
        stop: Stop = Stop::Arrived, "";
    }
}

static FLEET: Section =
    Section { title: "[fleet]", help: "Capacity and time limits of the fleet.", tag: None, groups: &[Fleet::KEYS] };

keys! {
    /// Keys of `[fleet]`.
    pub(crate) keys Fleet {
        /// Maximum number of robots, those added to the running fleet included.
        max_robots: usize => "the robots of the file and 8 more, at most 1024", "", 1..=MAX_ROBOTS;
        /// Policy for a robot that does not answer: wait for it up to the limit, hold it still, or drop it.
        straggler: StragglerPolicy = StragglerPolicy::Wait, "";
        /// A robot that keeps a tick waiting for this long, computing, asleep or stopped, is a straggler.
        straggler_limit_s: f64 = 10.0, "s", Range::POSITIVE;
        /// `realtime`: a robot is stopped when the odometry behind its newest command is older; at least three
        /// ticks.
        command_timeout_s: f64 => "0.25, at least 5 ticks", "s", Range::POSITIVE;
        /// An agent that is not ready after this time, waits for a processor not counted, counts as dead.
        start_limit_s: f64 = 30.0, "s", Range::POSITIVE;
        /// A robot that stays where it is for this long cannot reach the task that an operator sent.
        stuck_limit_s: f64 = 60.0, "s", Range::POSITIVE;
    }
}

static PROCESSES: Section = Section {
    title: "[processes]",
    help: "Processors, scheduling classes and limits of the fleet's processes. Ignored by `single`, which has no processes.",
    tag: None,
    groups: &[Processes::KEYS],
};

keys! {
    /// Keys of `[processes]`.
    pub(crate) keys Processes {
        /// The world's process.
        world: Table => optional, "", &PROCESSES_WORLD;
        /// The process of every robot, late joiners and restarts too.
        agents: Table => optional, "", &PROCESSES_AGENTS;
    }
}

static PROCESSES_WORLD: Section =
    Section { title: "[processes.world]", help: "The world's process.", tag: None, groups: &[Scheduling::KEYS] };

static PROCESSES_AGENTS: Section = Section {
    title: "[processes.agents]",
    help: "The process of every robot.",
    tag: None,
    groups: &[Scheduling::KEYS, AgentLimits::KEYS],
};

keys! {
    /// How a process is scheduled.
    pub(crate) keys Scheduling {
        /// Processors that the process may use.
        cpus: Vec<u16> => "those that shoal itself may use", "", 0..=CPU_MAX;
        /// Scheduling class, see sched(7). The real-time classes fifo and rr need a permission.
        scheduling: ClassName => "that of shoal itself", "";
        /// Real-time priority; only with fifo and rr.
        priority: u8 => "1", "", 1..=99;
    }
}

keys! {
    /// What the process of a robot may use.
    pub(crate) keys AgentLimits {
        /// Maximum private writable memory of the process, RLIMIT_DATA: heap, stacks of its threads, variables. The
        /// executable and shared memory do not count.
        memory_mib_max: u32 => "that of shoal itself", "MiB", 1..=1_048_576;
        /// Maximum number of open files of the process, RLIMIT_NOFILE.
        files_max: u32 => "that of shoal itself", "", 1..=1_048_576;
    }
}

static RADIO: Section = Section {
    title: "[radio]",
    help: "Faults of the radio between robots, from the start. A robot in sensor range is seen, whatever the radio loses or delays, unless sees_robots is false.",
    tag: None,
    groups: &[Radio::KEYS],
};

keys! {
    /// Keys of `[radio]`.
    pub(crate) keys Radio {
        /// Additional delay of heard poses; every pose is at least one tick old.
        delay_ticks: u32 = 0, "ticks", 0..=model::Radio::DELAY_TICKS_MAX;
        /// Share of poses that are lost.
        drop: f64 = 0.0, "", 0.0..=1.0;
        /// Standard deviation of the error on a heard position, per axis.
        noise_m: f64 = 0.0, "m", Range::NOT_NEGATIVE;
    }
}

static EVENT: Section = Section {
    title: "[[event]]",
    help: "An event of the timeline. It takes effect at the beginning of a tick.",
    tag: Some("kind"),
    groups: &[Event::KEYS],
};

choice! {
    /// What happens.
    pub(crate) enum EventKind {
        Join = "join",
        Leave = "leave",
        Task = "task",
        Kill = "kill",
        Pause = "pause",
        Resume = "resume",
        Mute = "mute",
        Delay = "delay",
        Drop = "drop",
        Noise = "noise",
        SlowCpu = "slow-cpu",
        Radio = "radio",
    }
}

keys! {
    /// Keys of `[[event]]`.
    pub(crate) keys Event {
        /// Time of the event; rounded to a tick.
        at_s: f64 => required, "s", Range::NOT_NEGATIVE;
        /// join: the robot enters (it is absent before); leave; task: a new goal; kill and pause: of the robot's
        /// process; mute: no robot hears it; delay, drop and noise: of the poses that it hears; slow-cpu: its plans
        /// take longer; resume: ends its pause and these faults; radio: new radio settings, to stay.
        kind: EventKind => required, "";
        /// Id of the robot.
        #[only(EventKind::Join, EventKind::Leave, EventKind::Task, EventKind::Kill, EventKind::Pause, EventKind::Resume, EventKind::Mute, EventKind::Delay, EventKind::Drop, EventKind::Noise, EventKind::SlowCpu)]
        robot: String => required, "", 0..=32;
        /// The goal; a third number is the heading of a unicycle or diff-drive there, rad.
        #[only(EventKind::Task)]
        goal_m: Pose => required, "m";
        /// Replace the present goals instead of queueing the new one.
        #[only(EventKind::Task)]
        now: bool = false, "";
        /// Length of the pause or fault; rounded to ticks, at least one. By default until a `resume` of the robot.
        #[only(EventKind::Pause, EventKind::Mute, EventKind::Delay, EventKind::Drop, EventKind::Noise, EventKind::SlowCpu)]
        for_s: f64 => optional, "s", Range::POSITIVE;
        /// Additional delay of the poses that the robot hears.
        #[only(EventKind::Delay)]
        #[name("delay_ticks")]
        late_ticks: u32 => required, "ticks", 0..=model::Radio::DELAY_TICKS_MAX;
        /// Share of the poses that the robot does not hear.
        #[only(EventKind::Drop)]
        #[name("drop")]
        lost: f64 => required, "", 0.0..=1.0;
        /// Standard deviation of the position noise on the poses that the robot hears.
        #[only(EventKind::Noise)]
        #[name("noise_m")]
        sigma_m: f64 => required, "m", Range::NOT_NEGATIVE;
        /// Every plan of the robot takes longer by this wall time. `single` has no processes, and takes no longer.
        #[only(EventKind::SlowCpu)]
        slow_s: f64 => required, "s", 0.0..=model::Fault::SLOW_MS_MAX * 1e-3;
        /// Id of the receiving robot; by default all robots.
        #[only(EventKind::Radio)]
        #[name("robot")]
        receiver: String => optional, "", 0..=32;
        /// Additional delay of heard poses from this time on.
        #[only(EventKind::Radio)]
        delay_ticks: u32 => "as in `[radio]`", "ticks", 0..=model::Radio::DELAY_TICKS_MAX;
        /// Share of poses that are lost from this time on.
        #[only(EventKind::Radio)]
        drop: f64 => "as in `[radio]`", "", 0.0..=1.0;
        /// Standard deviation of the position noise from this time on.
        #[only(EventKind::Radio)]
        noise_m: f64 => "as in `[radio]`", "m", Range::NOT_NEGATIVE;
    }
}

static EXPECT: Section = Section {
    title: "[expect]",
    help: "Conditions under which the run is a success.",
    tag: None,
    groups: &[Expect::KEYS],
};

keys! {
    /// Keys of `[expect]`.
    pub(crate) keys Expect {
        /// Minimum number of robots that arrive.
        arrived: Arrivals = Arrivals(None), "";
        /// Maximum number of contacts, with robots and obstacles.
        contacts_max: u64 = 0, "";
        /// Maximum time until all have arrived.
        makespan_s_max: f64 => optional, "s", Range::POSITIVE;
        /// Minimum clearance to robots and obstacles.
        clearance_m_min: f64 => optional, "m", Range::ANY;
        /// No contact begins from the first to the second of these times; `contacts_max` still counts all of them.
        no_contact_s: Interval => optional, "s";
        /// Maximum time until a robot whose process ended, on purpose or not, takes part again.
        rejoin_s_max: f64 => optional, "s", Range::POSITIVE;
        /// All tasks that are given until this time, by the timeline or by operators, are done by then. A task that is
        /// refused, dropped or cancelled is not done.
        tasks_done_by_s: f64 => optional, "s", Range::POSITIVE;
    }
}

/// Every section that a file can contain, each once, the whole file first.
pub(crate) fn all_sections() -> Vec<&'static Section> {
    fn collect(section: &'static Section, found: &mut Vec<&'static Section>) {
        if found.contains(&section) {
            return;
        }
        found.push(section);
        for key in section.keys() {
            if let Kind::Table(inner) | Kind::Tables(inner, _) = key.kind() {
                collect(inner, found);
            }
        }
    }
    let mut found = Vec::new();
    collect(&ROOT, &mut found);
    found
}
