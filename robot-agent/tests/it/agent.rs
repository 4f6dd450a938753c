//! What an agent tells others and asks of its body: flags, poses, and the joints of arms.

use geometry::ArmState;
use model::{Drive, Radio, RobotIndex, RobotInstance, Scenario, Wheels};
use nalgebra::{Point2, Vector2};
use planners::{Neighbor, Plan, PlanInput, Planner};
use protocol::daemon_to_robot::AgentSpec;
use protocol::robot_to_robot::SharedPose;
use protocol::robot_to_world::Command;
use protocol::world_to_robot::{NeighborRef, Odometry, Piece};
use scenarios::Overrides;
use shoal_robot_agent::{Agent, AgentInputs, Time};
use std::sync::{Arc, Mutex};

/// Two robots side by side, an arm, and a robot on wheels.
fn scenario() -> Scenario {
    let text = r#"
        [[robot]]
        id = "a"
        start_m = [0, 0]
        goal_m = [3, 4]
        [[robot]]
        id = "b"
        kind = "unicycle"
        start_m = [0, 2]
        goal_m = [5, 2]
        [[robot]]
        id = "arm"
        kind = "two-link-arm"
        planner = "pso-via-points"
        base_m = [0, -6]
        links_m = [2, 1]
        start_joints_rad = [0.5, 0.5]
        goal_m = [-2.5, -6]
        turn_radps_max = 2
        speed_mps_max = 0.6
        [[robot]]
        id = "wheels"
        kind = "diff-drive"
        start_m = [0, 6]
        goal_m = [5, 6]
    "#;
    scenarios::parse("agent.toml", text, &Overrides::default()).unwrap_or_else(|problems| panic!("{problems}"))
}

/// Answers what it is told to, and keeps what it was shown.
struct Scripted {
    plans: Arc<Mutex<Vec<Plan>>>,
    seen: Arc<Mutex<Vec<Seen>>>,
}

/// What a planner was shown in a tick.
#[derive(Clone, Debug)]
struct Seen {
    neighbors: Vec<Neighbor>,
    /// Centres and identities of what is an obstacle.
    obstacles: Vec<(Point2<f64>, u32)>,
    arm: Option<ArmState>,
    wheels: Option<Wheels>,
    turn_radps: f64,
}

impl Planner for Scripted {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        self.seen.lock().unwrap().push(Seen {
            neighbors: input.neighbors.to_vec(),
            obstacles: input.obstacles.iter().map(|obstacle| (obstacle.shape.a, obstacle.id)).collect(),
            arm: input.arm,
            wheels: input.wheels,
            turn_radps: input.turn_radps,
        });
        self.plans.lock().unwrap().pop().unwrap_or(Plan::only(Drive::stop(input.kind)))
    }
}

struct Robot {
    agent: Agent,
    plans: Arc<Mutex<Vec<Plan>>>,
    seen: Arc<Mutex<Vec<Seen>>>,
    board: SharedPose,
}

/// What an agent said and did in a tick.
struct Said {
    pose: SharedPose,
    drive: Drive,
}

impl Robot {
    fn new(scenario: &Scenario, slot: usize) -> Robot {
        let (plans, seen) = (Arc::default(), Arc::default());
        let planner = Scripted { plans: Arc::clone(&plans), seen: Arc::clone(&seen) };
        let spec = AgentSpec::new(
            scenario,
            &scenario.robots[slot],
            RobotInstance { index: RobotIndex::of(slot), incarnation: 0 },
        );
        Robot { agent: Agent::with_planner(spec, Box::new(planner)), plans, seen, board: SharedPose::default() }
    }

    /// A tick in which its method answers `plan`.
    fn step(&mut self, odometry: &Odometry, heard: &[(NeighborRef, SharedPose)], plan: Plan) -> Said {
        self.plans.lock().unwrap().push(plan);
        self.look(odometry, heard, &[], Time::Ticks)
    }

    /// A tick in which it also sees something.
    fn look(&mut self, odometry: &Odometry, heard: &[(NeighborRef, SharedPose)], pieces: &[Piece], time: Time) -> Said {
        // Where a pose is made there is an older one.
        let mut pose =
            SharedPose { x_m: f64::NAN, stamp_ns: 1, flags: u32::MAX, spare_m: 1.0, ..SharedPose::default() };
        let outputs = self
            .agent
            .step(&AgentInputs { odometry, heard, borders: &[], radio: Radio::PERFECT, pieces, time }, &mut pose);
        assert_eq!((pose.stamp_ns, pose.spare_m), (0, 0.0));
        self.board = pose;
        Said { pose, drive: outputs.drive }
    }

    fn last(&self) -> Seen {
        self.seen.lock().unwrap().last().unwrap().clone()
    }
}

fn odometry(tick: u64, flags: u32) -> Odometry {
    Odometry { tick, goal_x_m: 3.0, goal_y_m: 4.0, flags: flags | Odometry::FLAG_PRESENT, ..Odometry::default() }
}

const GO: Drive = Drive::Velocity(Vector2::new(0.5, 0.0));
const STAND: Drive = Drive::Velocity(Vector2::new(0.0, 0.0));

#[test]
fn a_robot_is_stopped_when_its_method_says_so() {
    let mut robot = Robot::new(&scenario(), 0);
    let mut stopped = |drive, stopped| {
        let plan = Plan { stopped, ..Plan::only(drive) };
        robot.step(&odometry(0, 0), &[], plan).pose.has(SharedPose::FLAG_STOPPED)
    };
    assert!(stopped(STAND, true), "on purpose");
    assert!(!stopped(STAND, false), "standing still is not yet a purpose: it may turn on the spot, or see no way");
    assert!(stopped(GO, true), "its own word counts");
    assert!(!stopped(GO, false));
}

#[test]
fn flags_and_the_way_left_travel_with_the_pose_and_with_nothing_else() {
    let scenario = scenario();
    let (mut speaker, mut listener) = (Robot::new(&scenario, 0), Robot::new(&scenario, 1));
    let who = NeighborRef { index: 0, incarnation: 0 };
    for (tick, (flags, stopped)) in
        [(0, false), (0, true), (Odometry::FLAG_ARRIVED, true), (0, false)].iter().enumerate()
    {
        let (tick, plan) = (tick as u64, Plan { stopped: *stopped, ..Plan::only(STAND) });
        let pose = speaker.step(&odometry(tick, *flags), &[], plan).pose;
        let arrived = *flags == Odometry::FLAG_ARRIVED;
        assert_eq!((pose.has(SharedPose::FLAG_ARRIVED), pose.has(SharedPose::FLAG_STOPPED)), (arrived, *stopped));
        assert_eq!(pose.remaining_m, if arrived { 0.0 } else { 5.0 }, "the distance, not the goal");
        // Heard one tick later, as always.
        listener.step(
            &odometry(tick + 1, 0),
            &[(who, speaker.board)],
            Plan::only(Drive::stop(model::BodyKind::Unicycle)),
        );
        let [heard] = listener.last().neighbors[..] else { panic!("one neighbour is heard") };
        assert_eq!(
            (heard.id, heard.arrived, heard.stopped, heard.remaining_m),
            (0, arrived, *stopped, pose.remaining_m)
        );
    }
}

/// A robot that is heard and seen is one body: as it says while its word is fresh, where it is seen when it is not.
#[test]
fn who_is_heard_late_is_where_it_is_seen() {
    let mut robot = Robot::new(&scenario(), 0);
    let piece = |x_m, obstacle, robot| Piece { ax_m: x_m, bx_m: x_m, vx_mps: 0.5, obstacle, robot, ..Piece::default() };
    // A wall, the body of robot 1, that of robot 4, of which nothing is heard, and a silent one.
    let pieces = [piece(3.0, 0, 0), piece(7.0, 3, 2), piece(8.0, 6, 5), piece(9.0, 7, 6)];
    let who = NeighborRef { index: 1, incarnation: 0 };
    let said = |tick, x_m, stamp_ns| {
        let flags = SharedPose::FLAG_SPOKEN;
        [(who, SharedPose { tick, x_m, yaw_rad: 2.0, vx_mps: 0.1, stamp_ns, flags, ..SharedPose::default() })]
    };
    let unheard = [(Point2::new(3.0, 0.0), 0), (Point2::new(8.0, 0.0), 6), (Point2::new(9.0, 0.0), 7)];
    let dt_s = robot.agent.spec().clock.dt_s();
    let ms = 1_000_000;
    // What it heard, when, and where robot 1 is then for its method, with which velocity and age.
    let at = |now_ns| Time::Stamps { now_ns };
    let table = [
        (1, said(0, 6.9, 0), Time::Ticks, (6.9, 0.1, dt_s)),
        (3, said(0, 6.9, 0), Time::Ticks, (7.0, 0.5, 0.0)),
        (4, said(3, 6.8, 500 * ms), Time::Ticks, (6.8, 0.1, dt_s)),
        (5, said(3, 6.8, 500 * ms), at(520 * ms), (6.8, 0.1, 0.02)),
        (6, said(3, 6.8, 500 * ms), at(540 * ms), (7.0, 0.5, 0.0)),
    ];
    for (tick, heard, time, (x_m, vx_mps, age_s)) in table {
        robot.look(&odometry(tick, 0), &heard, &pieces, time);
        let [neighbor] = robot.last().neighbors[..] else { panic!("one neighbour is heard") };
        assert_eq!((neighbor.position.x, neighbor.velocity.x, neighbor.yaw_rad), (x_m, vx_mps, 2.0), "tick {tick}");
        assert!((neighbor.age_s - age_s).abs() < 1e-12, "tick {tick}: {}", neighbor.age_s);
        assert_eq!(robot.last().obstacles, unheard, "tick {tick}");
    }
    robot.look(&odometry(7, 0), &[(who, SharedPose::default())], &pieces, Time::Ticks);
    assert_eq!(robot.last().neighbors.len(), 1, "what it said once counts until it is out of range");
    robot.look(&odometry(8, 0), &[], &pieces, Time::Ticks);
    assert_eq!((robot.last().neighbors.len(), robot.last().obstacles.len()), (0, 4));
}

#[test]
fn an_arm_is_shown_its_joints_and_tells_them() {
    let scenario = scenario();
    let geometry = scenario.robots[2].arm.unwrap().geometry;
    let mut arm = Robot::new(&scenario, 2);
    let joints_rad = [0.7, -0.4];
    let tip = geometry.tip(joints_rad);
    let odometry = Odometry {
        x_m: tip.x,
        y_m: tip.y,
        yaw_rad: 0.3,
        joints_rad,
        flags: Odometry::FLAG_PRESENT,
        ..Odometry::default()
    };
    let ask = |first, second| Plan::only(Drive::Joints { rate_radps: [first, second] });
    let outputs = arm.step(&odometry, &[], ask(0.1, -0.2));
    assert_eq!(arm.last().arm, Some(ArmState { geometry, joints_rad }));
    assert_eq!((outputs.pose.joints_rad, outputs.pose.x_m, outputs.pose.y_m), (joints_rad, tip.x, tip.y));
    assert_eq!(outputs.pose.radius_m, 0.05);
    assert_eq!(outputs.drive, Drive::Joints { rate_radps: [0.1, -0.2] });

    // Beyond the limit of the tip both rates shrink together.
    let Drive::Joints { rate_radps: [first, second] } = arm.step(&odometry, &[], ask(2.0, 4.0)).drive else {
        panic!("an arm turns its joints");
    };
    assert!((second - 2.0 * first).abs() < 1e-12 && first > 0.0);
    let speed = ArmState { geometry, joints_rad }.tip_velocity([first, second]).norm();
    assert!((speed - 0.6).abs() < 1e-9, "{speed}");

    let mut robot = Robot::new(&scenario, 0);
    assert_eq!(robot.step(&odometry, &[], Plan::only(STAND)).pose.joints_rad, joints_rad, "what the odometry says");
    assert_eq!(robot.last().arm, None);
}

/// A method is shown the wheels and may command them; what they cannot do is cut so that the curve stays.
#[test]
fn wheels_are_commanded_within_what_they_can() {
    let scenario = scenario();
    let mut robot = Robot::new(&scenario, 3);
    let odometry = Odometry { turn_radps: 0.5, goal_x_m: 5.0, flags: Odometry::FLAG_PRESENT, ..Odometry::default() };
    let mut ask = |rate_radps| robot.step(&odometry, &[], Plan::only(Drive::Wheels { rate_radps })).drive;
    assert_eq!(ask([1.0, -0.5]), Drive::Wheels { rate_radps: [1.0, -0.5] });
    assert_eq!(ask([20.0, 10.0]), Drive::Wheels { rate_radps: [6.67, 3.335] });
    // It may not reverse, so it does not.
    assert_eq!(ask([-1.0, -1.0]), Drive::Wheels { rate_radps: [0.0, 0.0] });
    assert_eq!(robot.last().wheels, Some(Wheels::BURGER));
    assert_eq!(robot.last().turn_radps, 0.5);
    let mut other = Robot::new(&scenario, 1);
    other.step(&odometry, &[], Plan::only(Drive::Twist { speed_mps: 0.0, turn_radps: 0.0 }));
    assert_eq!(other.last().wheels, None);
}

#[test]
fn commands_hold_every_drive() {
    let rate_radps = [0.25, -0.5];
    let twist = Drive::Twist { speed_mps: 1.0, turn_radps: -2.0 };
    let drives = [GO, twist, Drive::Joints { rate_radps }, Drive::Wheels { rate_radps }];
    for drive in drives {
        let mut command = Command::default();
        command.set_drive(drive);
        assert_eq!(command.drive(), Some(drive));
    }
    assert_eq!(Command { form: 9, ..Command::default() }.drive(), None);
}
