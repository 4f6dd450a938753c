//! What lies between a method and the body of a unicycle or a diff-drive: the gear, the turning radius, the wheels, and the
//! heading at the goal.
//!
//! Methods plan for a body that drives ahead and can turn where it stands. Four things make that right for others:
//!
//! - **Gear.** A body that may reverse does so while that brings it to its goal sooner: the method is shown the body the
//!   other way round, and its answer is driven backwards. The gear changes only for a clear gain, so that it does not flip.
//! - **Turning radius.** Where a method turns tighter than the body can (or where it stands), the body turns as tight as it
//!   can while it drives, backwards where it may: a turn in several moves. A goal inside the turning circle is driven away
//!   from, until the circle lies beside it.
//! - **Wheels.** The two wheels of a diff-drive are shared by speed and turn: while one of them brakes and the other has to
//!   speed up, the body goes on as fast as before. Methods count on its brakes, so braking comes first, and the turn gets
//!   what the wheels have left.
//! - **Heading at the goal.** Once the robot is there, it turns where it stands. A body that cannot is right only if it
//!   comes that way.

use crate::planner::{Plan, PlanInput, Planner};
use crate::steering::turn_towards;
use geometry::wrap;
use model::{BodyKind, Drive, Limits, Wheels};
use nalgebra::Vector2;
use std::f64::consts::PI;

/// The gear changes if the other one takes less than this share of the time.
const GEAR_SHARE: f64 = 0.8;
/// Of the speed limit: how fast a body goes that only drives because it cannot turn where it stands.
const MOVES_SHARE: f64 = 0.3;
/// Turn rate per radian while turning to the heading at the goal, 1/s.
const DOCK_GAIN: f64 = 3.0;

/// The chassis of one robot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Chassis {
    reversing: bool,
}

impl Chassis {
    /// What the method plans, made right for the body. A body that does not roll gets the plan as it is.
    pub fn plan(&mut self, planner: &mut dyn Planner, input: &PlanInput<'_>) -> Plan {
        if !BodyKind::ROLLING.contains(&input.kind) {
            return planner.plan(input);
        }
        self.choose_gear(input);
        let shown = self.shown(input);
        let plan = planner.plan(&shown);
        let (twist, stopped) = match (self.dock(input), plan.drive) {
            (Some(turn_radps), _) => ((0.0, turn_radps), true),
            (None, Drive::Twist { speed_mps, turn_radps }) => {
                let (speed_mps, turn_radps) =
                    drivable(speed_mps, turn_radps, &shown, input.limits.turning_radius_m_min);
                ((if self.reversing { -speed_mps } else { speed_mps }, turn_radps), plan.stopped)
            }
            // In reverse the left wheel of the body is the right one of the plan.
            (None, Drive::Wheels { rate_radps: [left, right] }) if self.reversing => {
                return Plan { drive: Drive::Wheels { rate_radps: [-right, -left] }, ..plan };
            }
            _ => return plan,
        };
        let drive = Drive::Twist { speed_mps: twist.0, turn_radps: twist.1 };
        let drive = input.wheels.map_or(drive, |wheels| braking_first(drive, &wheels, input));
        Plan { drive, stopped, ..plan }
    }

    /// The body as the method sees it.
    fn shown<'a>(&self, input: &PlanInput<'a>) -> PlanInput<'a> {
        let mut shown = *input;
        shown.limits.turning_radius_m_min = 0.0;
        if self.reversing {
            shown.yaw_rad = wrap(input.yaw_rad + PI);
            let Limits { speed_mps_max, reverse_mps_max, .. } = input.limits;
            (shown.limits.speed_mps_max, shown.limits.reverse_mps_max) = (reverse_mps_max, speed_mps_max);
        }
        shown
    }

    /// Turning where it stands and then going straight: which way is it sooner there?
    fn choose_gear(&mut self, input: &PlanInput<'_>) {
        let Limits { speed_mps_max, reverse_mps_max, turn_radps_max, turning_radius_m_min, .. } = input.limits;
        let to_goal = input.goal - input.position;
        let distance = to_goal.norm();
        if reverse_mps_max <= 0.0 || input.arrived {
            self.reversing = false;
            return;
        }
        if distance <= input.goal_tolerance_m || inside_circle(to_goal, input.yaw_rad, turning_radius_m_min) {
            return; // Whatever it is doing, the way out of here is to go on with it.
        }
        let off = wrap(to_goal.y.atan2(to_goal.x) - input.yaw_rad).abs();
        let ahead_s = off / turn_radps_max + distance / speed_mps_max;
        let back_s = (PI - off) / turn_radps_max + distance / reverse_mps_max;
        let (stays_s, changes_s) = if self.reversing { (back_s, ahead_s) } else { (ahead_s, back_s) };
        if changes_s < GEAR_SHARE * stays_s {
            self.reversing = !self.reversing;
        }
    }

    /// The turn rate that brings a robot at its goal to its heading there; nothing while it is not there.
    fn dock(&self, input: &PlanInput<'_>) -> Option<f64> {
        let there = (input.goal - input.position).norm() <= input.goal_tolerance_m;
        let yaw_rad = input.goal_yaw_rad.filter(|_| there && input.limits.turning_radius_m_min == 0.0)?;
        let error = wrap(yaw_rad - input.yaw_rad);
        let limits = &input.limits;
        // The last tick ends on the heading, not beyond it.
        let within_tick = error.abs() / input.dt_s;
        let turn = turn_towards(error, DOCK_GAIN, limits).clamp(-within_tick, within_tick);
        Some(turn.clamp(-limits.turn_radps_max, limits.turn_radps_max))
    }
}

/// A body stands if its wheels come to rest within this share of a tick: what is measured of a body that turns where it stands
/// is not exactly zero, and must not be braked for.
const STANDS: f64 = 1e-3;

/// The twist that the wheels come to in this tick if all that they can change goes to the brakes first, and what is left to
/// the turn. A body that need not brake, or whose wheels follow at once, gets what it asks for.
fn braking_first(drive: Drive, wheels: &Wheels, input: &PlanInput<'_>) -> Drive {
    let Some(wanted) = wheels.rates_for(drive, &input.limits).filter(|_| wheels.accel_radps2_max.is_finite()) else {
        return drive;
    };
    let speed_mps = Vector2::new(input.yaw_rad.cos(), input.yaw_rad.sin()).dot(&input.velocity);
    // What both wheels have in common drives the body, what they differ by turns it.
    let parts = |[left, right]: [f64; 2]| (0.5 * (left + right), 0.5 * (right - left));
    let (common, differing) = parts(wheels.rates_of(speed_mps, input.turn_radps));
    let (common_wanted, differing_wanted) = parts(wanted);
    let change_max = wheels.accel_radps2_max * input.dt_s;
    if common.abs() <= STANDS * change_max {
        return drive;
    }
    // Brakes go no further than to stand.
    let common_wanted = if common < 0.0 { common_wanted.min(0.0) } else { common_wanted.max(0.0) };
    if common_wanted.abs() >= common.abs() {
        return drive;
    }
    let braked = (common_wanted - common).clamp(-change_max, change_max);
    let rest = change_max - braked.abs();
    let common = common + braked;
    let room = (wheels.speed_radps_max - common.abs()).max(0.0);
    let differing = (differing + (differing_wanted - differing).clamp(-rest, rest)).clamp(-room, room);
    let (speed_mps, turn_radps) = wheels.twist_of([common - differing, common + differing]);
    Drive::Twist { speed_mps, turn_radps }
}

/// Whether the goal lies inside the tightest circle to its side: no turn leads there.
fn inside_circle(to_goal: Vector2<f64>, yaw_rad: f64, radius_m: f64) -> bool {
    let heading = Vector2::new(yaw_rad.cos(), yaw_rad.sin());
    let (along, aside) = (heading.dot(&to_goal), heading.perp(&to_goal));
    along.hypot(aside.abs() - radius_m) < radius_m
}

/// Forward speed and turn rate as wished, made drivable on arcs of at least this radius.
fn drivable(speed_mps: f64, turn_radps: f64, input: &PlanInput<'_>, radius_m: f64) -> (f64, f64) {
    let Limits { speed_mps_max, reverse_mps_max, turn_radps_max, .. } = input.limits;
    if speed_mps <= 0.0 && turn_radps == 0.0 {
        return (speed_mps, turn_radps);
    }
    let to_goal = input.goal - input.position;
    let away = !input.arrived && inside_circle(to_goal, input.yaw_rad, radius_m);
    if radius_m == 0.0 || turn_radps.abs() * radius_m <= speed_mps.abs() {
        return (speed_mps, turn_radps);
    }
    let moves_mps = (turn_radps.abs() * radius_m).min(turn_radps_max * radius_m);
    if away {
        return (speed_mps.max(moves_mps.min(MOVES_SHARE * speed_mps_max)), 0.0);
    }
    // Who turns tightly is about to turn round: backwards where the body may, since what it turns from lies ahead.
    let speed_mps = if speed_mps <= 0.0 && reverse_mps_max > 0.0 {
        -moves_mps.min(MOVES_SHARE * reverse_mps_max)
    } else {
        speed_mps.max(moves_mps.min(MOVES_SHARE * speed_mps_max))
    };
    let turn_max = speed_mps.abs() / radius_m;
    (speed_mps, turn_radps.clamp(-turn_max, turn_max))
}
