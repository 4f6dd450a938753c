//! The pure core of an agent: what it learned since the last tick goes in, what it says and does comes out.

use crate::map::map_of;
use crate::radio::{Receiver, SeenRobot};
use geometry::ArmState;
use model::kinematics::Pose;
use model::{BodyKind, Drive, FilterKind, MapRef, Mode, Physics, PlanState, Radio, RobotInstance};
use nalgebra::{Point2, Vector2};
use planners::filter::border::{Rule, Word};
use planners::filter::{Body, Filter, Timing, Told, rounded_up};
use planners::{Chassis, Identity, Intent, Neighbor, Obstacle, ParamError, PlanInput, Planner, SENSED_WALLS_MAX};
use protocol::daemon_to_robot::AgentSpec;
use protocol::robot_to_robot::{SharedBorder, SharedBorders, SharedIntent, SharedPose};
use protocol::robot_to_world::Command;
use protocol::world_to_robot::{NeighborRef, Odometry, Piece};

pub use crate::radio::Time;

/// A pose that is not older than this was heard just now: every pose is one tick old when it is heard, and in `realtime`
/// up to one period.
const FRESH_TICKS: f64 = 1.5;

/// In `realtime`, a command of a robot with a filter acts for this many ticks at most: if its agent is late by more, it stands.
const HOLD_TICKS: u32 = 2;

/// Everything an agent learned for this tick.
pub struct AgentInputs<'a> {
    /// Where it is and where to go.
    pub odometry: &'a Odometry,
    /// Whom it hears and the pose that counts of each, sorted by slot: the newest of a tick before this one, or in
    /// `realtime` the newest.
    pub heard: &'a [(NeighborRef, SharedPose)],
    /// What each of them says to this robot about the border between the two; empty in fleets without borders.
    pub borders: &'a [SharedBorder],
    /// What the radio does at this tick to what it hears.
    pub radio: Radio,
    /// What it sees, sorted by piece index.
    pub pieces: &'a [Piece],
    /// How to tell the age of a pose.
    pub time: Time,
}

/// Everything an agent does in a tick. What it says is the pose that [`Agent::step`] fills in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AgentOutputs {
    /// What it asks of its body, within its limits.
    pub drive: Drive,
    /// Whether its method has a plan.
    pub plan: PlanState,
    /// How much of the greatest speed its filter changed it by.
    pub filtered: f32,
    /// For how many ticks it may act; zero: as long as the fleet lets commands act.
    pub hold_ticks: u32,
}

impl AgentOutputs {
    /// Makes `command` what goes on its board for the world: computed from this odometry, written at `stamp_ns`.
    pub fn command(&self, odometry: &Odometry, stamp_ns: u64, command: &mut Command) {
        *command = Command {
            tick: odometry.tick,
            stamp_ns,
            odometry_stamp_ns: odometry.stamp_ns,
            incarnation: odometry.incarnation,
            hold_ticks: self.hold_ticks,
            filtered: self.filtered,
            ..Command::default()
        };
        command.set_drive(self.drive);
        command.set_plan(self.plan);
    }
}

/// Why an agent cannot be built from its spec.
#[derive(Debug, thiserror::Error)]
pub enum AgentError {
    /// The method does not exist in this executable.
    #[error("robot `{robot}`: unknown planner `{planner}`")]
    UnknownPlanner {
        /// The robot.
        robot: String,
        /// The method it asks for.
        planner: String,
    },
    /// A program that brings its own planner cannot make it.
    #[error("robot `{robot}`: {problem}")]
    Own {
        /// The robot.
        robot: String,
        /// Why.
        problem: String,
    },
    /// The method refuses its parameters.
    #[error("robot `{robot}`: planner `{planner}`: {problem}")]
    Params {
        /// The robot.
        robot: String,
        /// Its method.
        planner: String,
        /// Why.
        problem: ParamError,
    },
}

/// What the odometry that an agent has just read asks of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Duty {
    /// Nothing yet: it is for an earlier life of the robot.
    Wait,
    /// To end: the robot has left, or another life has taken its place.
    Leave,
    /// To show that it lives: the robot is held or paused, or this is not what it should answer.
    ShowLife,
    /// To plan and to answer.
    Plan,
}

/// What this odometry asks of the agent of a robot instance. `counts`: it is that of the open tick, or new enough for a command.
pub fn duty(instance: RobotInstance, odometry: &Odometry, counts: bool) -> Duty {
    if odometry.incarnation > instance.incarnation {
        Duty::Leave
    } else if odometry.incarnation < instance.incarnation {
        Duty::Wait
    } else if odometry.has(Odometry::FLAG_LEFT) {
        Duty::Leave
    } else if odometry.has(Odometry::FLAG_PRESENT) && counts {
        Duty::Plan
    } else {
        Duty::ShowLife
    }
}

/// One robot's agent.
pub struct Agent {
    spec: AgentSpec,
    planner: Box<dyn Planner>,
    chassis: Chassis,
    filter: Option<Filter>,
    receiver: Receiver,
    neighbors: Vec<Neighbor>,
    told: Vec<Told>,
    obstacles: Vec<Obstacle>,
    /// Of the obstacles, the bodies of robots.
    bodies: Vec<Obstacle>,
    /// All robots in sight, sorted by slot.
    seen: Vec<SeenRobot>,
    /// Its greatest speed, m/s, and the greatest distance on which it comes to rest, m, as its poses tell them.
    speed_mps_max: f32,
    brake_m: f32,
    map: Vec<Obstacle>,
    /// Walls of the map that it senses: how far they are, m, and which they are.
    sensed: Vec<(f64, u32)>,
}

impl Agent {
    /// An agent with the method that its spec names.
    ///
    /// # Errors
    /// When there is no such method, or it refuses its parameters. A validated scenario has neither.
    pub fn new(spec: AgentSpec) -> Result<Agent, AgentError> {
        let planner = planner_of(&spec)?;
        Ok(Agent::with_planner(spec, planner))
    }

    /// An agent with this method, whatever its spec names: how a user brings a planner that shoal does not have.
    pub fn with_planner(spec: AgentSpec, planner: Box<dyn Planner>) -> Agent {
        let receiver = Receiver::new(spec.clock.seed, spec.instance);
        let map = map_of(&spec);
        let filter = filter_of(&spec);
        let (speed_mps_max, brake_m) = (spec.robot.limits.speed_mps_max, body_of(&spec).brake_m());
        Agent {
            spec,
            planner,
            chassis: Chassis::default(),
            filter,
            receiver,
            neighbors: Vec::new(),
            told: Vec::new(),
            obstacles: Vec::new(),
            bodies: Vec::new(),
            seen: Vec::new(),
            speed_mps_max: rounded_up(speed_mps_max),
            brake_m: rounded_up(brake_m),
            map,
            sensed: Vec::new(),
        }
    }

    /// What it was told at the start.
    pub fn spec(&self) -> &AgentSpec {
        &self.spec
    }

    /// The poses used in the last step: whose, and when it was written (ns).
    pub fn used(&self) -> impl Iterator<Item = (NeighborRef, u64)> + '_ {
        self.receiver.in_use().map(|(who, pose)| (who, pose.stamp_ns))
    }

    /// One tick. `pose` becomes what the robot tells those that hear it, every field of it; the stamp is the shell's to
    /// fill in.
    pub fn step(&mut self, inputs: &AgentInputs<'_>, pose: &mut SharedPose) -> AgentOutputs {
        let odometry = inputs.odometry;
        let dt_s = self.spec.clock.dt_s();
        self.receiver.receive(odometry.tick, inputs.time, inputs.radio, inputs.heard, inputs.borders);
        self.neighbors.clear();
        self.neighbors.extend(self.receiver.neighbors(odometry.tick, dt_s, inputs.time));
        let position = Point2::new(odometry.x_m, odometry.y_m);
        self.see(inputs.pieces);
        self.sense(position);
        let robot = &self.spec.robot;

        let velocity = Vector2::new(odometry.vx_mps, odometry.vy_mps);
        let goal = Point2::new(odometry.goal_x_m, odometry.goal_y_m);
        let arrived = odometry.has(Odometry::FLAG_ARRIVED);
        let joints_rad = odometry.joints_rad;
        let body = self.body(odometry);
        let allowed = match &mut self.filter {
            None => &[],
            Some(filter) => {
                self.told.clear();
                self.told.extend(self.receiver.told(odometry.tick, &self.seen, robot.limits.speed_mps_max));
                filter.draw(odometry.tick, &body, &self.told, &self.obstacles, &self.bodies)
            }
        };
        let arm = robot.arm.map(|setup| ArmState { geometry: setup.geometry, joints_rad });
        let plan = self.chassis.plan(
            &mut *self.planner,
            &PlanInput {
                tick: odometry.tick,
                dt_s,
                position,
                yaw_rad: odometry.yaw_rad,
                velocity,
                turn_radps: odometry.turn_radps,
                radius_m: robot.radius_m,
                kind: robot.kind,
                limits: robot.limits,
                goal,
                goal_tolerance_m: robot.goal_tolerance_m,
                goal_yaw_rad: odometry.has(Odometry::FLAG_GOAL_YAW).then_some(odometry.goal_yaw_rad),
                goal_yaw_tolerance_rad: robot.goal_yaw_tolerance_rad,
                arrived,
                obstacles: &self.obstacles,
                neighbors: &self.neighbors,
                map: &self.map,
                walls: self.spec.walls.as_ref().filter(|_| robot.knows_map).map(MapRef::map),
                arm,
                wheels: robot.wheels,
                allowed,
            },
        );
        let drive = match (plan.drive, arm, robot.wheels) {
            (Drive::Joints { rate_radps }, Some(arm), _) => Drive::of_arm(&arm, rate_radps, &robot.limits),
            (Drive::Wheels { .. }, _, Some(wheels)) => {
                let rates = wheels.rates_for(plan.drive, &robot.limits);
                rates.map_or(plan.drive, |rate_radps| Drive::Wheels { rate_radps })
            }
            (drive, ..) => drive.within(&robot.limits),
        };

        let wanted = drive;
        let drive = self.filter.as_mut().map_or(wanted, |filter| filter.keep(odometry.tick, &body, wanted));
        let filtered = self.filter.as_ref().map_or(0.0, |filter| filter.change(wanted, drive));
        let next = self.foresee(&body, drive);
        let promise = match (&mut self.filter, &next) {
            (Some(filter), Some(next)) => Some(filter.promise(odometry.tick, &body, next)),
            _ => None,
        };
        let next = next.map(|next| next.position);
        let mut flags = SharedPose::FLAG_SPOKEN;
        if arrived {
            flags |= SharedPose::FLAG_ARRIVED;
        }
        if plan.stopped {
            flags |= SharedPose::FLAG_STOPPED;
        }
        if next.is_some() {
            flags |= SharedPose::FLAG_NEXT;
        }
        if promise.is_some() {
            flags |= SharedPose::FLAG_PROMISE;
        }
        if let Some(intent) = plan.intent {
            flags |= SharedPose::FLAG_INTENT;
            if intent.yields {
                flags |= SharedPose::FLAG_YIELDS;
            }
            if intent.corner.is_some() {
                flags |= SharedPose::FLAG_CORNER;
            }
        }
        let next = next.unwrap_or(position);
        *pose = SharedPose {
            tick: odometry.tick,
            stamp_ns: 0,
            x_m: odometry.x_m,
            y_m: odometry.y_m,
            yaw_rad: odometry.yaw_rad,
            vx_mps: odometry.vx_mps,
            vy_mps: odometry.vy_mps,
            radius_m: robot.radius_m,
            joints_rad,
            remaining_m: if arrived { 0.0 } else { (goal - position).norm() },
            next_x_m: next.x,
            next_y_m: next.y,
            far_x_m: promise.map_or(0.0, |promise| promise.far.x),
            far_y_m: promise.map_or(0.0, |promise| promise.far.y),
            spare_m: promise.map_or(0.0, |promise| promise.spare_m),
            brake_m: self.brake_m,
            intent: plan.intent.map(shared).unwrap_or_default(),
            pull: plan.attractive.cast().into(),
            push: plan.repulsive.cast().into(),
            flags,
            speed_mps_max: self.speed_mps_max,
        };
        let hold_ticks = match (&self.filter, self.spec.clock.mode) {
            (Some(filter), Mode::Realtime) => filter.hold_ticks(),
            _ => 0,
        };
        AgentOutputs { drive, plan: plan.state, filtered, hold_ticks }
    }

    /// Makes `borders` what it says to others about borders after a step, every field of it.
    pub fn tell_borders(&mut self, tick: u64, borders: &mut SharedBorders) {
        *borders = SharedBorders { tick, ..SharedBorders::default() };
        let Some(filter) = &mut self.filter else { return };
        for (place, (robot, incarnation, word)) in borders.borders.iter_mut().zip(filter.words()) {
            *place = shared_border(robot, incarnation, word);
        }
    }

    /// Whether it talks to others about borders.
    pub fn has_borders(&self) -> bool {
        self.filter.is_some() && self.spec.is_loose
    }

    /// The body as it is now.
    fn body(&self, odometry: &Odometry) -> Pose {
        let robot = &self.spec.robot;
        let mut pose = Pose::resting(Point2::new(odometry.x_m, odometry.y_m), odometry.yaw_rad);
        pose.velocity = Vector2::new(odometry.vx_mps, odometry.vy_mps);
        if BodyKind::ROLLING.contains(&robot.kind) {
            let (sin, cos) = odometry.yaw_rad.sin_cos();
            (pose.speed_mps, pose.turn_radps) = (pose.velocity.dot(&Vector2::new(cos, sin)), odometry.turn_radps);
        }
        if let Some(wheels) = robot.wheels {
            pose.wheel_radps = wheels.rates_of(pose.speed_mps, pose.turn_radps);
        }
        pose
    }

    /// The body at the next tick if the world gets this drive in time; nothing of one that has weight, or that does not drive
    /// about.
    fn foresee(&self, body: &Pose, drive: Drive) -> Option<Pose> {
        let robot = &self.spec.robot;
        if self.spec.physics != Physics::Kinematic || !BodyKind::MOBILE.contains(&robot.kind) {
            return None;
        }
        let mut pose = *body;
        match robot.wheels {
            Some(wheels) => pose.advance_on(&wheels, drive, &robot.limits, self.spec.clock.dt_s()),
            None => pose.advance(drive, &robot.limits, self.spec.clock.dt_s()),
        }
        Some(pose)
    }

    /// Sorts what is seen into obstacles and neighbours. A robot that was heard just now is known from its own word; one
    /// whose word is older is where it is seen, and from one of which nothing is known its body is an obstacle.
    fn see(&mut self, pieces: &[Piece]) {
        let fresh_s = FRESH_TICKS * self.spec.clock.dt_s();
        self.obstacles.clear();
        self.bodies.clear();
        self.seen.clear();
        for piece in pieces {
            // Bodies are numbered as their robots are.
            if let Some(robot) = piece.robot() {
                self.seen.push(SeenRobot {
                    index: robot.0,
                    at: Point2::new(piece.ax_m, piece.ay_m),
                    velocity: Vector2::new(piece.vx_mps, piece.vy_mps),
                    radius_m: piece.radius_m,
                });
            }
            let place = piece
                .robot()
                .and_then(|robot| self.neighbors.binary_search_by_key(&robot.0, |neighbor| neighbor.id).ok());
            match place.map(|place| &mut self.neighbors[place]) {
                None => {
                    self.obstacles.push(obstacle(piece));
                    if piece.robot().is_some() {
                        self.bodies.push(obstacle(piece));
                    }
                }
                Some(neighbor) if neighbor.age_s <= fresh_s => {}
                Some(neighbor) => {
                    neighbor.position = Point2::new(piece.ax_m, piece.ay_m);
                    neighbor.velocity = Vector2::new(piece.vx_mps, piece.vy_mps);
                    neighbor.age_s = 0.0;
                    neighbor.next = None;
                }
            }
        }
    }

    /// Adds the walls of the map that are in range of its sensors here. A sensor sees as far as it does whatever stands before
    /// it, as for obstacles.
    fn sense(&mut self, position: Point2<f64>) {
        let Some(walls) = &self.spec.walls else { return };
        let (map, range_m) = (walls.map(), self.spec.robot.sensor_range_m);
        map.nearest(position, range_m, SENSED_WALLS_MAX, &mut self.sensed);
        self.obstacles.extend(self.sensed.iter().map(|(_, index)| Obstacle::wall(*index, map.wall(*index as usize))));
    }
}

/// The method that a spec names.
///
/// # Errors
/// When there is no such method, or it refuses its parameters.
pub fn planner_of(spec: &AgentSpec) -> Result<Box<dyn Planner>, AgentError> {
    let (robot, instance) = (&spec.robot, spec.instance);
    let method = planners::find(&robot.planner)
        .ok_or_else(|| AgentError::UnknownPlanner { robot: robot.id.clone(), planner: robot.planner.clone() })?;
    let identity = Identity { seed: spec.clock.seed, robot: instance.index.0, incarnation: instance.incarnation };
    (method.build)(&robot.params, identity).map_err(|problem| AgentError::Params {
        robot: robot.id.clone(),
        planner: robot.planner.clone(),
        problem,
    })
}

/// The body of the robot, as its filter needs to know it.
fn body_of(spec: &AgentSpec) -> Body {
    Body {
        robot: spec.instance.index.0,
        kind: spec.robot.kind,
        limits: spec.robot.limits,
        wheels: spec.robot.wheels,
        radius_m: spec.robot.radius_m,
        dt_s: spec.clock.dt_s(),
    }
}

/// The filter that a spec asks for.
fn filter_of(spec: &AgentSpec) -> Option<Filter> {
    let timing = match (spec.is_loose, spec.clock.mode) {
        (false, _) => Timing::Exact,
        (true, Mode::Realtime) => Timing::Loose { hold_ticks: HOLD_TICKS },
        (true, _) => Timing::Loose { hold_ticks: 1 },
    };
    match spec.robot.filter {
        FilterKind::None => None,
        FilterKind::SharedGap => Some(Filter::new(body_of(spec), timing)),
    }
}

fn shared_border(robot: u32, incarnation: u32, word: Word) -> SharedBorder {
    let blank = SharedBorder { robot, incarnation, ..SharedBorder::default() };
    match word {
        Word::Offer { number, rule: Rule::Line { normal, offset_m } } => SharedBorder {
            number,
            normal_x: normal.x,
            normal_y: normal.y,
            offset_m,
            form: SharedBorder::FORM_LINE,
            ..blank
        },
        Word::Offer { number, rule: Rule::Apart } => SharedBorder { number, form: SharedBorder::FORM_APART, ..blank },
        Word::Accept { number, heard } => SharedBorder {
            number,
            form: SharedBorder::FORM_ACCEPTED,
            heard_after: heard.saturating_sub(number).try_into().unwrap_or(u32::MAX),
            ..blank
        },
    }
}

fn shared(intent: Intent) -> SharedIntent {
    let corner = intent.corner.unwrap_or_default();
    SharedIntent {
        wish_x_mps: intent.wish.x,
        wish_y_mps: intent.wish.y,
        left_m: intent.left_m,
        rank: intent.rank,
        corner_x_m: corner.x,
        corner_y_m: corner.y,
        slow: intent.slow,
        lag: intent.lag,
    }
}

fn obstacle(piece: &Piece) -> Obstacle {
    Obstacle {
        id: piece.obstacle,
        shape: geometry::Capsule {
            a: Point2::new(piece.ax_m, piece.ay_m),
            b: Point2::new(piece.bx_m, piece.by_m),
            radius: piece.radius_m,
        },
        velocity: Vector2::new(piece.vx_mps, piece.vy_mps),
    }
}
