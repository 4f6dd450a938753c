//! What a robot asks of its body.

use iceoryx2::prelude::ZeroCopySend;
use model::{Drive, PlanState};

/// The command of one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.Command.v4")]
pub struct Command {
    /// The tick of the odometry that it was computed from.
    pub tick: u64,
    /// When it was written, monotonic clock, ns. Zero: never.
    pub stamp_ns: u64,
    /// When the odometry behind it was written, monotonic clock, ns.
    pub odometry_stamp_ns: u64,
    /// Which form, see the `FORM_*` constants.
    pub form: u32,
    /// The life of the robot that wrote it.
    pub incarnation: u32,
    /// Velocity along x, m/s; or forward speed, m/s; or rate of the joint at the base or of the left wheel, rad/s.
    pub first: f64,
    /// Velocity along y, m/s; or turn rate, rad/s; or rate of the joint at the elbow or of the right wheel, rad/s.
    pub second: f64,
    /// Whether its method has a plan, see the `PLAN_*` constants.
    pub plan: u32,
    /// It acts for this many ticks at most, from its own on, if no newer one comes; zero: as long as the fleet lets commands act.
    pub hold_ticks: u32,
    /// How much of the greatest speed the filter has changed it by; zero: it is what the method planned.
    pub filtered: f32,
    /// Keeps the layout explicit.
    pub reserved: u32,
}

impl Command {
    /// No command yet.
    pub const FORM_NONE: u32 = 0;
    /// A velocity in the world frame.
    pub const FORM_VELOCITY: u32 = 1;
    /// A forward speed and a turn rate.
    pub const FORM_TWIST: u32 = 2;
    /// The rates of two joints.
    pub const FORM_JOINTS: u32 = 3;
    /// The rates of two wheels.
    pub const FORM_WHEELS: u32 = 4;

    /// The method has a plan.
    pub const PLAN_READY: u32 = 0;
    /// The method is looking for one.
    pub const PLAN_PLANNING: u32 = 1;
    /// The method has given up.
    pub const PLAN_GAVE_UP: u32 = 2;

    /// Fills in whether there is a plan.
    pub fn set_plan(&mut self, state: PlanState) {
        self.plan = match state {
            PlanState::Ready => Command::PLAN_READY,
            PlanState::Planning => Command::PLAN_PLANNING,
            PlanState::GaveUp => Command::PLAN_GAVE_UP,
        };
    }

    /// Whether there is a plan; a number without a meaning counts as one.
    pub fn plan_state(&self) -> PlanState {
        match self.plan {
            Command::PLAN_PLANNING => PlanState::Planning,
            Command::PLAN_GAVE_UP => PlanState::GaveUp,
            _ => PlanState::Ready,
        }
    }

    /// Fills in the drive.
    pub fn set_drive(&mut self, drive: Drive) {
        (self.form, self.first, self.second) = match drive {
            Drive::Velocity(v) => (Command::FORM_VELOCITY, v.x, v.y),
            Drive::Twist { speed_mps, turn_radps } => (Command::FORM_TWIST, speed_mps, turn_radps),
            Drive::Joints { rate_radps: [first, second] } => (Command::FORM_JOINTS, first, second),
            Drive::Wheels { rate_radps: [left, right] } => (Command::FORM_WHEELS, left, right),
        };
    }

    /// The drive in it; `None` for a form that nobody knows.
    pub fn drive(&self) -> Option<Drive> {
        match self.form {
            Command::FORM_VELOCITY => Some(Drive::Velocity(nalgebra::Vector2::new(self.first, self.second))),
            Command::FORM_TWIST => Some(Drive::Twist { speed_mps: self.first, turn_radps: self.second }),
            Command::FORM_JOINTS => Some(Drive::Joints { rate_radps: [self.first, self.second] }),
            Command::FORM_WHEELS => Some(Drive::Wheels { rate_radps: [self.first, self.second] }),
            _ => None,
        }
    }
}
