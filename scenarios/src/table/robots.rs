//! Keys of robots: one by one, by kind, by default, in a pattern.

use super::obstacles::MOTION;
use crate::types::{FilterChoice, Id, Interval, Joints, PlannerName, Pose, Rounds};
use geometry::Elbow;
use model::field::{Params, Table};
use model::kind::{Range, Section};
use model::{AgentCommand, BodyKind, MAX_GOALS, MAX_ROBOTS, RestartPolicy, choice, keys};
use nalgebra::Point2;
use std::f64::consts::{FRAC_PI_2, TAU};

pub(super) static DEFAULTS: Section = Section {
    title: "[defaults]",
    help: "Default values for every robot.",
    tag: None,
    groups: &[KindKey::KEYS, Mobile::KEYS, Body::KEYS, WheelKeys::KEYS],
};

pub(super) static KINDS: Section = Section {
    title: "[kinds]",
    help: "Default values by body kind. They override `[defaults]`; a `[[robot]]` overrides them.",
    tag: None,
    groups: &[Kinds::KEYS],
};

static KINDS_POINT: Section = Section {
    title: "[kinds.point]",
    help: "Default values for point robots.",
    tag: None,
    groups: &[Mobile::KEYS, Body::KEYS],
};

static KINDS_UNICYCLE: Section = Section {
    title: "[kinds.unicycle]",
    help: "Default values for unicycles.",
    tag: None,
    groups: &[Mobile::KEYS, Body::KEYS],
};

static KINDS_DIFF_DRIVE: Section = Section {
    title: "[kinds.diff-drive]",
    help: "Default values for diff-drives.",
    tag: None,
    groups: &[Mobile::KEYS, Body::KEYS, WheelKeys::KEYS],
};

static KINDS_ARM: Section = Section {
    title: "[kinds.two-link-arm]",
    help: "Default values for arms.",
    tag: None,
    groups: &[Body::KEYS, Arm::KEYS],
};

pub(super) static ROBOT: Section = Section {
    title: "[[robot]]",
    help: "One robot, or with the id of a robot of the layout, the keys that differ from the layout. Missing keys are \
           taken from the layout, then from `[kinds]`, then from `[defaults]`, then from the defaults listed here.",
    tag: None,
    groups: &[Robot::KEYS, KindKey::KEYS, Mobile::KEYS, Body::KEYS, WheelKeys::KEYS, PlacedArm::KEYS, Arm::KEYS],
};

keys! {
    /// What robots and defaults can have.
    pub(crate) keys KindKey {
        /// Body kind. point: any velocity in the plane; unicycle: forward speed and turn rate; diff-drive: the same, by two
        /// wheels on one axle; two-link-arm: fixed base, two joint rates.
        kind: BodyKind = BodyKind::Point, "";
    }
}

keys! {
    /// Keys of `[kinds]`.
    pub(crate) keys Kinds {
        /// Default values for point robots.
        point: Table => optional, "", &KINDS_POINT;
        /// Default values for unicycles.
        unicycle: Table => optional, "", &KINDS_UNICYCLE;
        /// Default values for diff-drives.
        #[name("diff-drive")]
        diff_drive: Table => optional, "", &KINDS_DIFF_DRIVE;
        /// Default values for arms.
        #[name("two-link-arm")]
        two_link_arm: Table => optional, "", &KINDS_ARM;
    }
}

keys! {
    /// What only a robot of the file has.
    pub(crate) keys Robot {
        /// Name of the robot.
        id: Id => required, "", 0..=32;
        /// Start position; of an arm, that of its tip.
        start_m: Point2<f64> => "that of the layout; required without a layout", "m";
        /// Last goal; of an arm, that of its tip. A third number is the heading of a unicycle or diff-drive there,
        /// rad.
        goal_m: Pose => "that of the layout; required without a layout", "m";
        /// Goals before the last one, in order.
        waypoints_m: Vec<Point2<f64>> = Vec::new(), "m", 0..=MAX_GOALS - 1;
        /// Number of rounds through its waypoints and its last goal. A robot with endless rounds never arrives and
        /// is not expected to.
        rounds: Rounds = Rounds(Some(1)), "";
        /// Motion of the last goal.
        goal_motion: Table => optional, "", &MOTION;
    }
}

keys! {
    /// What robots that drive about, their kinds and defaults can have.
    pub(crate) keys Mobile {
        /// Heading at the start; not for an arm.
        start_yaw_rad: f64 => "towards its first goal", "rad", Range::ANY;
        /// Body radius; not for an arm.
        radius_m: f64 = 0.2, "m", Range::POSITIVE;
        /// Maximum reverse speed of a unicycle or diff-drive; 0: no reverse.
        reverse_mps_max: f64 = 0.0, "m/s", Range::NOT_NEGATIVE;
        /// Smallest radius on which a unicycle can turn, as a car has it; 0: it can turn where it stands. Not for a
        /// diff-drive.
        turning_radius_m_min: f64 = 0.0, "m", Range::NOT_NEGATIVE;
        /// Maximum acceleration, of the speed (unicycle) or the velocity (point); a diff-drive has
        /// wheel_accel_radps2_max instead.
        accel_mps2_max: f64 = f64::INFINITY, "m/s²", Range::UNLIMITED;
        /// Mass of the body. Kinematic physics ignores it.
        mass_kg: f64 = model::Dynamics::DEFAULT.mass_kg, "kg", Range::POSITIVE;
        /// Coefficient of friction between its wheels or feet and the ground. Kinematic physics ignores it.
        grip: f64 = model::Dynamics::DEFAULT.grip, "", Range::POSITIVE;
    }
}

keys! {
    /// What diff-drives, their kind and defaults can have.
    pub(crate) keys WheelKeys {
        /// Radius of the wheels of a diff-drive. The defaults are those of a TurtleBot3 Burger.
        wheel_radius_m: f64 = model::Wheels::BURGER.radius_m, "m", Range::POSITIVE;
        /// Distance between the two wheels of a diff-drive.
        track_m: f64 = model::Wheels::BURGER.track_m, "m", Range::POSITIVE;
        /// Maximum speed of each wheel of a diff-drive. If a command asks for more, both slow down and the curve stays.
        wheel_radps_max: f64 = model::Wheels::BURGER.speed_radps_max, "rad/s", Range::POSITIVE;
        /// Maximum acceleration of each wheel of a diff-drive.
        wheel_accel_radps2_max: f64 = model::Wheels::BURGER.accel_radps2_max, "rad/s²", Range::UNLIMITED;
        /// Maximum torque of the motor of each wheel of a diff-drive. Kinematic physics ignores it.
        wheel_torque_nm_max: f64 = model::Wheels::BURGER.torque_nm_max, "Nm", Range::UNLIMITED;
    }
}

keys! {
    /// What only an arm can have that stands somewhere.
    pub(crate) keys PlacedArm {
        /// Base position of an arm; required for arms.
        base_m: Point2<f64> => optional, "m";
        /// Joints of an arm at the start, instead of start_m; the second from the first link.
        start_joints_rad: Joints => optional, "rad", Range::ANY;
        /// Which way an arm holds its tip at start_m: up is with the second joint below 0.
        elbow: Elbow => "up if that pose is possible and free, else down", "";
    }
}

keys! {
    /// What arms and their kind can have.
    pub(crate) keys Arm {
        /// Link lengths of an arm, the link at the base first; required for arms.
        links_m: Joints => optional, "m", Range::POSITIVE;
        /// Radius of the links of an arm.
        link_radius_m: f64 = 0.05, "m", Range::NOT_NEGATIVE;
        /// Smallest joint angles of an arm: of the first from +x, of the second from the first link,
        /// counter-clockwise.
        joint_min_rad: Joints = Joints([0.0, -FRAC_PI_2]), "rad", Range::ANY;
        /// Maximum joint angles of an arm. A joint stops at its limit, even where the limits are a full turn apart.
        joint_max_rad: Joints = Joints([TAU, FRAC_PI_2]), "rad", Range::ANY;
    }
}

keys! {
    /// What robots, kinds and defaults can have.
    pub(crate) keys Body {
        /// Maximum speed; of an arm, that of its tip. Of a diff-drive at most what its wheels give, wheel_radius_m
        /// times wheel_radps_max, which is also the default.
        speed_mps_max: f64 = 1.0, "m/s", Range::POSITIVE;
        /// Maximum turn rate of a unicycle, and of each joint of an arm. Of a diff-drive at most what its wheels give,
        /// twice its maximum speed divided by track_m, which is also the default.
        turn_radps_max: f64 = 3.0, "rad/s", Range::POSITIVE;
        /// Maximum angular acceleration of a unicycle, and of each joint of an arm; a diff-drive has
        /// wheel_accel_radps2_max instead.
        turn_accel_radps2_max: f64 = f64::INFINITY, "rad/s²", Range::UNLIMITED;
        /// Coefficient of friction between its body and others, obstacles and walls. Kinematic physics ignores it.
        friction: f64 = model::Dynamics::DEFAULT.friction, "", Range::NOT_NEGATIVE;
        /// A goal counts as reached within this distance.
        goal_tolerance_m: f64 = 0.1, "m", Range::POSITIVE;
        /// A heading at a goal counts as reached within this angle.
        goal_yaw_tolerance_rad: f64 = 0.1, "rad", Range::POSITIVE;
        /// Planner.
        planner: PlannerName = PlannerName("lanes".to_string()), "";
        /// Parameters of the planner; they override `[planners]`.
        params: Params => optional, "";
        /// The filter between planner and body. shared-gap: whatever is planned, the robot keeps to its share of every gap and
        /// touches nothing that stands; none: the body does what is planned; auto: shared-gap for planners that count on it,
        /// else none. Kinematic physics and bodies that drive about only.
        filter: FilterChoice = FilterChoice::Auto, "";
        /// Sensor range, from the centre (of an arm, the tip) to a surface.
        sensor_range_m: f64 = 5.0, "m", Range::POSITIVE;
        /// Radio range, centre to centre (of an arm, from the tip).
        radio_range_m: f64 = 10.0, "m", Range::POSITIVE;
        /// Hysteresis: a neighbour is dropped only beyond the range plus this distance.
        radio_hysteresis_m: f64 = 0.5, "m", Range::NOT_NEGATIVE;
        /// Whether its sensors also see robots that are on the radio: those it does not hear are obstacles, those
        /// it heard late are where they are seen. Without, it sees only robots that are silent.
        sees_robots: bool = true, "";
        /// Whether the planner knows the map of fixed obstacles.
        knows_map: bool = false, "";
        /// Whether the process is restarted when it ends without having been asked to: never; on-failure: after a
        /// signal, an exit code other than 0, or a failed start; always: after exit code 0 as well.
        restart: RestartPolicy = RestartPolicy::Never, "";
        /// Maximum number of restarts within restart_window_s. After that the robot stays dead.
        restart_limit: u32 = 3, "", 1..=1000;
        /// Restarts older than this do not count, neither for restart_limit nor for restart_backoff; simulated time.
        restart_window_s: f64 => "the whole run", "s", Range::POSITIVE;
        /// Delay before a restart.
        restart_delay_s: f64 = 1.0, "s", Range::NOT_NEGATIVE;
        /// Factor from the delay of one restart to that of the next within restart_window_s.
        restart_backoff: f64 = 1.0, "", 1.0..=1000.0;
        /// Maximum delay before a restart, with restart_backoff.
        restart_delay_max_s: f64 = f64::INFINITY, "s", Range::UNLIMITED;
        /// The program to start as its agent: the path of an executable, relative to where shoal is started (PATH is not
        /// searched), or a list of a program and its arguments, as in ["python3", "my.py"], whose program is looked up in
        /// PATH if it has no `/`.
        agent: AgentCommand => optional, "";
    }
}

pub(super) static LAYOUT: Section = Section {
    title: "[layout]",
    help: "Robots in a pattern. Their ids are the prefix and a number; their bodies are taken from `[defaults]`.",
    tag: Some("kind"),
    groups: &[Layout::KEYS],
};

choice! {
    /// The pattern of a layout.
    pub(crate) enum LayoutKind {
        CircleSwap = "circle-swap",
        Ring = "ring",
        Grid = "grid",
        Line = "line",
        Random = "random",
        List = "list",
        Scen = "scen",
    }
}

keys! {
    /// Keys of `[layout]`.
    pub(crate) keys Layout {
        /// circle-swap: across a circle; ring: round a circle; grid: a block that moves; line: two facing lines
        /// that swap; random; list: as listed; scen: the first problems of a MovingAI .scen for the map.
        kind: LayoutKind => required, "";
        /// Number of robots.
        robots: usize => required, "", 1..=MAX_ROBOTS;
        /// Ids are r00, r01 and so on.
        id_prefix: Id = Id("r".to_string()), "", 0..=24;
        /// Centre of the pattern.
        #[only(LayoutKind::CircleSwap, LayoutKind::Ring, LayoutKind::Grid, LayoutKind::Line)]
        center_m: Point2<f64> = Point2::origin(), "m";
        /// Radius of the circle.
        #[only(LayoutKind::CircleSwap, LayoutKind::Ring)]
        radius_m: f64 => required, "m", Range::POSITIVE;
        /// Direction of the first robot from the centre.
        #[only(LayoutKind::CircleSwap, LayoutKind::Ring)]
        phase_rad: f64 = 0.0, "rad", Range::ANY;
        /// A robot's goal is the start of the robot this many positions further round.
        #[only(LayoutKind::Ring)]
        shift: usize => "half the robots", "", 1..=MAX_ROBOTS;
        /// Centre to centre, along rows and columns.
        #[only(LayoutKind::Grid, LayoutKind::Line)]
        spacing_m: f64 = 1.5, "m", Range::POSITIVE;
        /// Robots in a row.
        #[only(LayoutKind::Grid)]
        columns: usize => "as square as possible", "", 1..=MAX_ROBOTS;
        /// Displacement of the block from start to goal.
        #[only(LayoutKind::Grid)]
        offset_m: [f64; 2] => required, "m";
        /// Distance between the lines.
        #[only(LayoutKind::Line)]
        gap_m: f64 => required, "m", Range::POSITIVE;
        /// Minimum free space round every start and goal, surface to surface.
        #[only(LayoutKind::Random)]
        spread_m: f64 = 0.2, "m", Range::NOT_NEGATIVE;
        /// Minimum distance from a robot's start to its goal.
        #[only(LayoutKind::Random)]
        goal_distance_m_min: f64 = 0.0, "m", Range::NOT_NEGATIVE;
        /// Start positions, in order; only the first `robots` entries are used.
        #[only(LayoutKind::List)]
        starts_m: Vec<Point2<f64>> => required, "m", 1..=MAX_ROBOTS;
        /// Goals, in the same order.
        #[only(LayoutKind::List)]
        goals_m: Vec<Point2<f64>> => required, "m", 1..=MAX_ROBOTS;
        /// The .scen file; its path is relative to the scenario's file.
        #[only(LayoutKind::Scen)]
        scen: String => required, "", 1..=4096;
        /// Starts and goals lie within these x.
        #[only(LayoutKind::Random)]
        x_m: Interval => "the world's", "m";
        /// Starts and goals lie within these y.
        #[only(LayoutKind::Random)]
        y_m: Interval => "the world's", "m";
        /// Maximum random displacement of starts, drawn from the seed.
        #[only(LayoutKind::CircleSwap, LayoutKind::Ring, LayoutKind::Grid, LayoutKind::Line, LayoutKind::List)]
        jitter_m: f64 = 0.0, "m", Range::NOT_NEGATIVE;
    }
}
