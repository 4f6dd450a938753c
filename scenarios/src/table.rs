//! The key table: every key that a scenario file may contain, said once.
//!
//! The walker checks files against it, resolving takes defaults from it, and the JSON Schema and the help are
//! printed from it. A new key costs one line here and one where it is used.

use crate::keys::Type::*;
use crate::keys::{ANY, Key, LARGE, Range, Section, Type, computed, optional, preset, required};
use crate::paper::PAPER;
use model::{CPU_MAX, MAX_GOALS, MAX_ROBOTS, MAX_SHAPES, Radio};

/// Most entries of the timeline.
const MAX_EVENTS: usize = 10_000;

const POSITIVE: Range = Range { min: 0.0, min_included: false, max: LARGE, infinite: false };
pub(crate) const NOT_NEGATIVE: Range = Range { min: 0.0, min_included: true, max: LARGE, infinite: false };
const UNLIMITED: Range = Range { min: 0.0, min_included: false, max: LARGE, infinite: true };
const SHARE: Range = Range { min: 0.0, min_included: true, max: 1.0, infinite: false };

/// A whole file.
pub(crate) static ROOT: Section = Section {
    title: "the top level",
    help: "One experiment: a world, a fleet, a timeline and what is expected of them.",
    tag: None,
    groups: &[&[
        computed("name", Text(64), "the name of the file", "Name of the scenario, for reports."),
        preset("description", Text(500), "\"\"", "Description in one line."),
        optional("world", Table(&WORLD), "The edges of the world."),
        optional("clock", Table(&CLOCK), "Clock: mode, tick rate, duration."),
        optional("fleet", Table(&FLEET), "Capacity and time limits of the fleet."),
        optional("processes", Table(&PROCESSES), "Processors and scheduling classes of the processes."),
        optional("radio", Table(&RADIO), "Faults of the radio, from the start."),
        optional("defaults", Table(&DEFAULTS), "Default values for every robot."),
        optional("kinds", Table(&KINDS), "Default values by body kind; they override `defaults`."),
        optional("planners", Methods, "Parameters by planner, for the whole fleet."),
        optional("layout", Table(&LAYOUT), "Robots in a pattern. They come before the `robot` entries."),
        optional("robot", Tables(&ROBOT, MAX_ROBOTS), "Robots one by one."),
        optional("obstacle", Tables(&OBSTACLE, MAX_SHAPES), "Obstacles, fixed or moving."),
        optional("event", Tables(&EVENT, MAX_EVENTS), "Timeline of events."),
        optional("expect", Table(&EXPECT), "Conditions under which the run is a success."),
        optional("paper", Table(&PAPER), "What a paper says about this scenario; only `shoal reproduce` reads it."),
    ]],
};

static WORLD: Section = Section {
    title: "[world]",
    help: "The edges of the world. They are not walls, but starts and goals must lie inside. No coordinate may be larger \
           than 1e7 m.",
    tag: None,
    groups: &[&[
        preset("x_m", Interval, "[-10, 10]", "Smallest and largest x."),
        preset("y_m", Interval, "[-10, 10]", "Smallest and largest y."),
    ]],
};

static CLOCK: Section = Section {
    title: "[clock]",
    help: "Clock: mode, tick rate, duration.",
    tag: None,
    groups: &[&[
        preset(
            "mode",
            Choice(&["realtime", "lockstep", "single"]),
            "\"lockstep\"",
            "realtime: each process on its own timer; lockstep: all processes tick by tick; single: one thread.",
        ),
        preset(
            "tick_hz",
            Float(Range { min: 1.0, min_included: true, max: 10_000.0, infinite: false }),
            "50",
            "Ticks per second of simulated time.",
        ),
        preset("seed", Int { min: 0, max: u64::MAX as i128 }, "1", "Seed of every random stream."),
        preset("duration_s", Float(POSITIVE), "60", "Simulated time limit of the run."),
        preset(
            "stop",
            Choice(&["arrived", "duration"]),
            "\"arrived\"",
            "arrived: ends when all robots are at their last goals and no event is pending; duration: ends at duration_s.",
        ),
    ]],
};

static FLEET: Section = Section {
    title: "[fleet]",
    help: "Capacity and time limits of the fleet.",
    tag: None,
    groups: &[&[
        computed(
            "max_robots",
            Int { min: 1, max: MAX_ROBOTS as i128 },
            "the robots of the file and 8 more, at most 1024",
            "Maximum number of robots, those added to the running fleet included.",
        ),
        preset(
            "straggler",
            Choice(&["wait", "hold", "drop"]),
            "\"wait\"",
            "Policy for a robot that does not answer: wait for it up to the limit, hold it still, or drop it.",
        ),
        preset(
            "straggler_limit_s",
            Float(POSITIVE),
            "10",
            "A robot that keeps a tick waiting for this long, computing, asleep or stopped, is a straggler.",
        ),
        computed(
            "command_timeout_s",
            Float(POSITIVE),
            "0.25, at least 5 ticks",
            "`realtime`: a robot is stopped when the odometry behind its newest command is older; at least three ticks.",
        ),
        preset(
            "start_limit_s",
            Float(POSITIVE),
            "30",
            "An agent that is not ready after this time, waits for a processor not counted, counts as dead.",
        ),
    ]],
};

static PROCESSES: Section = Section {
    title: "[processes]",
    help: "Processors and scheduling classes of the fleet's processes. Ignored by `single`, which has no processes.",
    tag: None,
    groups: &[&[
        optional("world", Table(&PROCESSES_WORLD), "The world's process."),
        optional("agents", Table(&PROCESSES_AGENTS), "The process of every robot, late joiners and restarts too."),
    ]],
};

static PROCESSES_WORLD: Section =
    Section { title: "[processes.world]", help: "The world's process.", tag: None, groups: &[SCHEDULING] };
static PROCESSES_AGENTS: Section =
    Section { title: "[processes.agents]", help: "The process of every robot.", tag: None, groups: &[SCHEDULING] };

const SCHEDULING: &[Key] = &[
    computed("cpus", Numbers(CPU_MAX), "those that shoal itself may use", "Processors that the process may use."),
    computed(
        "scheduling",
        Choice(&["other", "batch", "fifo", "rr"]),
        "that of shoal itself",
        "Scheduling class, see sched(7). The real-time classes fifo and rr need a permission.",
    ),
    computed("priority", Int { min: 1, max: 99 }, "1", "Real-time priority; only with fifo and rr."),
];

static RADIO: Section = Section {
    title: "[radio]",
    help: "Faults of the radio between robots, from the start. A robot in sensor range is seen, whatever the radio loses or delays, unless sees_robots is false.",
    tag: None,
    groups: &[&[
        preset("delay_ticks", DELAY, "0", "Additional delay of heard poses; every pose is at least one tick old."),
        preset("drop", Float(SHARE), "0", "Share of poses that are lost."),
        preset("noise_m", Float(NOT_NEGATIVE), "0", "Standard deviation of the error on a heard position, per axis."),
    ]],
};

/// Starts or goals of a layout.
const PLACES: Type = Pairs { min: 1, max: MAX_ROBOTS };
const DELAY: Type = Int { min: 0, max: Radio::DELAY_TICKS_MAX as i128 };
const KIND: Type = Choice(&["point", "unicycle", "two-link-arm"]);

pub(crate) static DEFAULTS: Section = Section {
    title: "[defaults]",
    help: "Default values for every robot.",
    tag: None,
    groups: &[&[KIND_KEY], MOBILE, BODY],
};

const KIND_KEY: Key = preset(
    "kind",
    KIND,
    "\"point\"",
    "Body kind. point: any velocity in the plane; unicycle: forward speed and turn rate; two-link-arm: fixed base, two joint rates.",
);

static KINDS: Section = Section {
    title: "[kinds]",
    help: "Default values by body kind. They override `[defaults]`; a `[[robot]]` overrides them.",
    tag: None,
    groups: &[&[
        optional("point", Table(&KINDS_POINT), "Default values for point robots."),
        optional("unicycle", Table(&KINDS_UNICYCLE), "Default values for unicycles."),
        optional("two-link-arm", Table(&KINDS_ARM), "Default values for arms."),
    ]],
};

static KINDS_POINT: Section =
    Section { title: "[kinds.point]", help: "Default values for point robots.", tag: None, groups: &[MOBILE, BODY] };
static KINDS_UNICYCLE: Section =
    Section { title: "[kinds.unicycle]", help: "Default values for unicycles.", tag: None, groups: &[MOBILE, BODY] };
pub(crate) static KINDS_ARM: Section =
    Section { title: "[kinds.two-link-arm]", help: "Default values for arms.", tag: None, groups: &[BODY, ARM] };

pub(crate) static ROBOT: Section = Section {
    title: "[[robot]]",
    help: "One robot, or with the id of a robot of the layout, the keys that differ from the layout. Missing keys are \
           taken from the layout, then from `[kinds]`, then from `[defaults]`, then from the defaults listed here.",
    tag: None,
    groups: &[
        &[
            required("id", Id(32), "Name of the robot."),
            computed(
                "start_m",
                Pair,
                "that of the layout; required without a layout",
                "Start position; of an arm, that of its tip.",
            ),
            computed(
                "goal_m",
                Pose,
                "that of the layout; required without a layout",
                "Last goal; of an arm, that of its tip. A third number is the heading of a unicycle there, rad.",
            ),
            preset("waypoints_m", Pairs { min: 0, max: MAX_GOALS - 1 }, "[]", "Goals before the last one, in order."),
            preset(
                "rounds",
                ForeverOrCount,
                "1",
                "Number of rounds through its waypoints and its last goal. A robot with endless rounds never arrives and is \
                 not expected to.",
            ),
            optional("goal_motion", Table(&MOTION), "Motion of the last goal."),
            KIND_KEY,
        ],
        MOBILE,
        BODY,
        PLACED_ARM,
        ARM,
    ],
};

/// What robots that drive about, kinds and defaults can say.
pub(crate) const MOBILE: &[Key] = &[
    computed("start_yaw_rad", Float(ANY), "towards its first goal", "Heading at the start; not for an arm."),
    preset("radius_m", Float(POSITIVE), "0.2", "Body radius; not for an arm."),
    preset("reverse_mps_max", Float(NOT_NEGATIVE), "0", "Maximum reverse speed of a unicycle; 0: no reverse."),
    preset(
        "turning_radius_m_min",
        Float(NOT_NEGATIVE),
        "0",
        "Smallest radius on which a unicycle can turn, as a car has it; 0: it can turn where it stands.",
    ),
    preset(
        "accel_mps2_max",
        Float(UNLIMITED),
        "inf",
        "Maximum acceleration, of the speed (unicycle) or the velocity (point).",
    ),
];

/// What only an arm can say that stands somewhere.
pub(crate) const PLACED_ARM: &[Key] = &[
    optional("base_m", Pair, "Base position of an arm; required for arms."),
    optional(
        "start_joints_rad",
        Joints(ANY),
        "Joints of an arm at the start, instead of start_m; the second from the first link.",
    ),
    computed(
        "elbow",
        Choice(&["up", "down"]),
        "up if that pose is possible and free, else down",
        "Which way an arm holds its tip at start_m: up is with the second joint below 0.",
    ),
];

/// What arms and their kind can say.
pub(crate) const ARM: &[Key] = &[
    optional("links_m", Joints(POSITIVE), "Link lengths of an arm, the link at the base first; required for arms."),
    preset("link_radius_m", Float(NOT_NEGATIVE), "0.05", "Radius of the links of an arm."),
    preset(
        "joint_min_rad",
        Joints(ANY),
        "[0, -1.5707963267948966]",
        "Smallest joint angles of an arm: of the first from +x, of the second from the first link, counter-clockwise.",
    ),
    preset(
        "joint_max_rad",
        Joints(ANY),
        "[6.283185307179586, 1.5707963267948966]",
        "Maximum joint angles of an arm. A joint stops at its limit, even where the limits are a full turn apart.",
    ),
];

/// What robots, kinds and defaults can say.
const BODY: &[Key] = &[
    preset("speed_mps_max", Float(POSITIVE), "1", "Maximum speed; of an arm, that of its tip."),
    preset("turn_radps_max", Float(POSITIVE), "3", "Maximum turn rate of a unicycle, and of each joint of an arm."),
    preset(
        "turn_accel_radps2_max",
        Float(UNLIMITED),
        "inf",
        "Maximum angular acceleration of a unicycle, and of each joint of an arm.",
    ),
    preset("goal_tolerance_m", Float(POSITIVE), "0.1", "A goal counts as reached within this distance."),
    preset(
        "goal_yaw_tolerance_rad",
        Float(POSITIVE),
        "0.1",
        "A heading at a goal counts as reached within this angle.",
    ),
    preset("planner", Planner, "\"decentralized-apf\"", "Planner."),
    optional("params", Params, "Parameters of the planner; they override `[planners]`."),
    preset("sensor_range_m", Float(POSITIVE), "5", "Sensor range, from the centre (of an arm, the tip) to a surface."),
    preset("radio_range_m", Float(POSITIVE), "10", "Radio range, centre to centre (of an arm, from the tip)."),
    preset(
        "radio_hysteresis_m",
        Float(NOT_NEGATIVE),
        "0.5",
        "Hysteresis: a neighbour is dropped only beyond the range plus this distance.",
    ),
    preset(
        "sees_robots",
        Bool,
        "true",
        "Whether its sensors also see robots that are on the radio: those it does not hear are obstacles, those it heard late are where they are seen. Without, it sees only robots that are silent.",
    ),
    preset("knows_map", Bool, "false", "Whether the planner knows the map of fixed obstacles."),
    preset(
        "restart",
        Choice(&["never", "on-failure"]),
        "\"never\"",
        "Whether the process is restarted when it exits unexpectedly.",
    ),
    preset(
        "restart_limit",
        Int { min: 1, max: 1000 },
        "3",
        "Maximum number of restarts, with `restart = \"on-failure\"`.",
    ),
    preset("restart_delay_s", Float(NOT_NEGATIVE), "1", "Delay before a restart."),
    optional(
        "agent",
        Text(4096),
        "The executable to start as its agent: a path, relative to where shoal is started. PATH is not searched.",
    ),
];

static MOTION: Section = Section {
    title: "motion",
    help: "Motion as a function of time. The body is placed at the start of its motion.",
    tag: Some("kind"),
    groups: &[&[
        required("kind", Choice(&["orbit", "bounce", "random-walk", "waypoints"]), "Kind of motion."),
        required("center_m", Pair, "Centre of the circle.").only(&["orbit"]),
        computed("radius_m", Float(POSITIVE), "the distance from the centre", "Radius of the circle.").only(&["orbit"]),
        required("omega_radps", Float(ANY), "Angular speed, counter-clockwise.").only(&["orbit"]),
        computed("phase_rad", Float(ANY), "its direction from the centre", "Angle at the start.").only(&["orbit"]),
        required("velocity_mps", Pair, "Velocity at the start.").only(&["bounce"]),
        required("speed_mps", Float(POSITIVE), "Speed.").only(&["random-walk", "waypoints"]),
        preset(
            "turn_every_s",
            Float(Range { min: 0.01, min_included: true, max: LARGE, infinite: false }),
            "2",
            "Time between random turns.",
        )
        .only(&["random-walk"]),
        computed("x_m", Interval, "the world's", "Interval of x in which the motion stays.").only(&["bounce", "random-walk"]),
        computed("y_m", Interval, "the world's", "Interval of y in which the motion stays.").only(&["bounce", "random-walk"]),
        required("points_m", Pairs { min: 2, max: 64 }, "Points visited in order, starting at the first.")
            .only(&["waypoints"]),
        preset(
            "then",
            Choice(&["loop", "ping-pong", "stop"]),
            "\"loop\"",
            "After the last point: loop goes straight to the first, ping-pong goes back through the points, stop stays.",
        )
        .only(&["waypoints"]),
    ]],
};

static LAYOUT: Section = Section {
    title: "[layout]",
    help: "Robots in a pattern. Their ids are the prefix and a number; their bodies are taken from `[defaults]`.",
    tag: Some("kind"),
    groups: &[&[
        required(
            "kind",
            Choice(&["circle-swap", "ring", "grid", "line", "random", "list"]),
            "circle-swap: across a circle; ring: round a circle; grid: a block that moves; line: two facing lines that swap; random; list: as listed.",
        ),
        required("robots", Int { min: 1, max: MAX_ROBOTS as i128 }, "Number of robots."),
        preset("id_prefix", Id(24), "\"r\"", "Ids are r00, r01 and so on."),
        preset("center_m", Pair, "[0, 0]", "Centre of the pattern.").only(&["circle-swap", "ring", "grid", "line"]),
        required("radius_m", Float(POSITIVE), "Radius of the circle.").only(&["circle-swap", "ring"]),
        preset("phase_rad", Float(ANY), "0", "Direction of the first robot from the centre.")
            .only(&["circle-swap", "ring"]),
        computed(
            "shift",
            Int { min: 1, max: MAX_ROBOTS as i128 },
            "half the robots",
            "A robot's goal is the start of the robot this many positions further round.",
        )
        .only(&["ring"]),
        preset("spacing_m", Float(POSITIVE), "1.5", "Centre to centre, along rows and columns.")
            .only(&["grid", "line"]),
        computed("columns", Int { min: 1, max: MAX_ROBOTS as i128 }, "as square as possible", "Robots in a row.")
            .only(&["grid"]),
        required("offset_m", Pair, "Displacement of the block from start to goal.").only(&["grid"]),
        required("gap_m", Float(POSITIVE), "Distance between the lines.").only(&["line"]),
        preset(
            "spread_m",
            Float(NOT_NEGATIVE),
            "0.2",
            "Minimum free space round every start and goal, surface to surface.",
        )
        .only(&["random"]),
        preset("goal_distance_m_min", Float(NOT_NEGATIVE), "0", "Minimum distance from a robot's start to its goal.")
            .only(&["random"]),
        required("starts_m", PLACES, "Start positions, in order; only the first `robots` entries are used.")
            .only(&["list"]),
        required("goals_m", PLACES, "Goals, in the same order.").only(&["list"]),
        computed("x_m", Interval, "the world's", "Starts and goals lie within these x.").only(&["random"]),
        computed("y_m", Interval, "the world's", "Starts and goals lie within these y.").only(&["random"]),
        preset("jitter_m", Float(NOT_NEGATIVE), "0", "Maximum random displacement of starts, drawn from the seed.")
            .only(&["circle-swap", "ring", "grid", "line", "list"]),
    ]],
};

static OBSTACLE: Section = Section {
    title: "[[obstacle]]",
    help: "An obstacle, fixed or moving.",
    tag: Some("shape"),
    groups: &[&[
        required("shape", Choice(&["disc", "segment", "capsule", "polygon"]), "Shape of the obstacle."),
        required("center_m", Pair, "Centre.").only(&["disc"]),
        required("from_m", Pair, "One end.").only(&["segment", "capsule"]),
        required("to_m", Pair, "The other end.").only(&["segment", "capsule"]),
        required("radius_m", Float(POSITIVE), "Radius of a disc, half the thickness of a capsule.")
            .only(&["disc", "capsule"]),
        required("corners_m", Pairs { min: 3, max: MAX_SHAPES }, "Corners in order; the inside is solid.")
            .only(&["polygon"]),
        optional("motion", Table(&MOTION), "Motion of the obstacle."),
    ]],
};

static EVENT: Section = Section {
    title: "[[event]]",
    help: "An event of the timeline. It takes effect at the beginning of a tick.",
    tag: Some("kind"),
    groups: &[&[
        required("at_s", Float(NOT_NEGATIVE), "Time of the event; rounded to a tick."),
        required(
            "kind",
            Choice(&["join", "leave", "task", "kill", "pause", "radio"]),
            "join: the robot enters (it is absent before); leave; task: a new goal; kill and pause: of the robot's process; radio: new radio settings.",
        ),
        required("robot", Text(32), "Id of the robot.").only(&["join", "leave", "task", "kill", "pause"]),
        required("goal_m", Pose, "The goal; a third number is the heading of a unicycle there, rad.").only(&["task"]),
        preset("now", Bool, "false", "Replace the present goals instead of queueing the new one.").only(&["task"]),
        required("for_s", Float(POSITIVE), "Length of the pause; rounded to ticks, at least one.").only(&["pause"]),
        optional("robot", Text(32), "Id of the receiving robot; by default all robots.").only(&["radio"]),
        computed("delay_ticks", DELAY, "as in `[radio]`", "Additional delay of heard poses from this time on.")
            .only(&["radio"]),
        computed("drop", Float(SHARE), "as in `[radio]`", "Share of poses that are lost from this time on.")
            .only(&["radio"]),
        computed(
            "noise_m",
            Float(NOT_NEGATIVE),
            "as in `[radio]`",
            "Standard deviation of the position noise from this time on.",
        )
        .only(&["radio"]),
    ]],
};

static EXPECT: Section = Section {
    title: "[expect]",
    help: "Conditions under which the run is a success.",
    tag: None,
    groups: &[&[
        preset("arrived", AllOrCount, "\"all\"", "Minimum number of robots that arrive."),
        preset(
            "contacts_max",
            Int { min: 0, max: u64::MAX as i128 },
            "0",
            "Maximum number of contacts, with robots and obstacles.",
        ),
        optional("makespan_s_max", Float(POSITIVE), "Maximum time until all have arrived."),
        optional("clearance_m_min", Float(ANY), "Minimum clearance to robots and obstacles."),
    ]],
};

/// Every section that a file can contain, each once, the whole file first.
pub(crate) fn all_sections() -> Vec<&'static Section> {
    fn collect(section: &'static Section, found: &mut Vec<&'static Section>) {
        if found.iter().any(|known| std::ptr::eq(*known, section)) {
            return;
        }
        found.push(section);
        for key in section.keys() {
            if let Type::Table(inner) | Type::Tables(inner, _) = key.ty {
                collect(inner, found);
            }
        }
    }
    let mut found = Vec::new();
    collect(&ROOT, &mut found);
    found
}
