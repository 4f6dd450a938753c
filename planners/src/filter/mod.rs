//! The safety filter `shared-gap`: whatever a method plans, the robot drives into nothing.
//!
//! It stands behind every method. Before a method plans, the filter says which velocities are allowed
//! ([`PlanInput::allowed`](crate::PlanInput)); what the method answers is changed only if it does not fit, and as little as
//! possible.
//!
//! **What a robot promises.** A command takes a body somewhere, and what has speed cannot stop at once. The *claim* of a
//! robot is everywhere its centre may get to with its present command, braking from then on (`claim.rs`). A command whose claim
//! does not fit is not given. Braking always fits, because the claim of the command before held it.
//!
//! **Whose is what.** Each pair of robots has a line between them, and each keeps its claims on its own side. There are two ways
//! to come to that line, and one rule for those who have none:
//!
//! - [`Timing::Exact`] (`single` and `lockstep` with a perfect radio): every word is one tick old when it is heard, and says where
//!   its robot is now. Both compute the same line from the same words ([`gap`]).
//! - [`Timing::Loose`] (`realtime`; loss, delay, noise): neither robot knows what the other one has heard. One of the two offers lines, the
//!   other one accepts them, and each keeps to every line that the other one may still rely on ([`border`]).
//! - Without a line a robot stays out of reach of the other one: wherever that one may have got to since it was last heard of, at
//!   its greatest speed. If it may be here already, the robot brakes. That is safe whatever the other one does while this one
//!   moves. Where both stop at once, commands act for a tick alone and no words are counted on, half of the gap to where the other one is
//!   seen is as safe.
//!
//! **What stands and moves.** Obstacles are solid. What moves is where it is seen, and goes on as it goes. Who runs into a robot that
//! stands is not kept from it: the promise is that no robot with the filter drives into another one with it, or into what stands. A
//! robot that is heard and has no filter is something that moves.
//!
//! Limits: a robot that is not heard at all is an obstacle that moves. Bodies with weight (`physics = "rapier"`) do not go where
//! their commands say, and an arm is not a disc: there is no filter for these two.

pub mod border;
mod claim;
pub mod gap;

use crate::planner::{Obstacle, solid};
use border::{Pairs, Rule, Word};
use claim::Claim;
use gap::Side;
use geometry::HalfPlane;
use geometry::half_planes::nearest;
use model::kinematics::Pose;
use model::{BodyKind, Drive, Limits, Wheels};
use nalgebra::{Point2, Vector2};

/// What is kept back of the way that is free, as a share of it: rounding never adds up to a contact.
const SLACK: f64 = 1e-9;
/// Distance that is kept from everything, m; and what a body may use up of it by rounding, as a share of its way.
const RESERVE_M: f64 = 1e-6;
pub(crate) const ROUNDING: f64 = 1e-12;
/// A body that turns is steered round what is in its way if less than this share of its speed is left.
const HINDERED: f64 = 0.5;
/// It turns away from the line by this much more than it has to, rad.
const TILT: f64 = 0.05;
/// A command that differs by no more than this share of the greatest speed is the same command.
const SAME: f64 = 1e-6;
/// How often the part of a command that fits is halved.
const HALVINGS: usize = 24;

/// The body that is kept safe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Its slot.
    pub robot: u32,
    /// How it moves.
    pub kind: BodyKind,
    /// What it can do.
    pub limits: Limits,
    /// Its wheels, if it is a diff-drive.
    pub wheels: Option<Wheels>,
    /// Its radius, m.
    pub radius_m: f64,
    /// Length of a tick, s.
    pub dt_s: f64,
}

impl Body {
    /// The greatest way on which it comes to rest, m; zero if it stops at once.
    pub fn brake_m(&self) -> f64 {
        claim::brake_m(self)
    }
}

/// How sure it is when a command acts and when a word is heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Timing {
    /// Every command acts in its own tick alone, and every word is heard in the tick after it.
    Exact,
    /// A command may act for this many ticks from its own on, if the next one is late; after them the body stands. Words may be
    /// late or lost.
    Loose {
        /// At least 1.
        hold_ticks: u32,
    },
}

/// What a robot with a filter says beside its pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Promise {
    /// The far end of its claim, m. The near end is where it says it will be at the next tick ([`Timing::Exact`]) or where it is.
    pub far: Point2<f64>,
    /// Its centre stays this near the line between the two ends, m.
    pub spare_m: f32,
}

/// What was heard last of another robot, as it was told. Of each neighbour there is one, in the same order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Told {
    /// Its slot.
    pub robot: u32,
    /// The life of it.
    pub incarnation: u32,
    /// It has been heard; else all that is known of it is what is seen.
    pub is_heard: bool,
    /// The tick of which it spoke.
    pub tick: u64,
    /// Where it was then, m.
    pub at: Point2<f64>,
    /// Where its command takes it within a tick, m.
    pub next: Option<Point2<f64>>,
    /// Where it is now, if it is seen, m.
    pub seen: Option<Point2<f64>>,
    /// Its velocity then, or as it is seen, m/s.
    pub velocity: Vector2<f64>,
    /// Its radius, m.
    pub radius_m: f64,
    /// Its greatest speed, m/s.
    pub speed_mps_max: f64,
    /// The greatest distance on which it comes to rest, m.
    pub brake_m: f64,
    /// What it promises, if it has a filter.
    pub promise: Option<Promise>,
    /// What it says to this robot about the border between the two.
    pub word: Option<Word>,
}

/// The ways that a line leaves free: d · `normal` ≤ `room_m` for every displacement d of the robot's centre.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Line {
    normal: Vector2<f64>,
    room_m: f64,
}

/// What this robot said last.
#[derive(Clone, Copy, Debug)]
struct Said {
    tick: u64,
    at: Point2<f64>,
    next: Point2<f64>,
    promise: Promise,
}

/// The filter of one robot.
pub struct Filter {
    body: Body,
    timing: Timing,
    pairs: Pairs,
    said: Option<Said>,
    /// The command that it gave last, and the tick of it.
    given: Option<(u64, Drive)>,
    /// The command that may still act in this tick, and for how many ticks.
    still: Option<(Drive, u32)>,
    /// It has to brake, whatever it plans.
    must_stop: bool,
    lines: Vec<Line>,
    allowed: Vec<HalfPlane>,
    /// Where it may get to with its last command.
    held: Claim,
    /// Where it may get to with the command that is looked at.
    tried: Claim,
}

impl Filter {
    /// The filter of this body.
    pub fn new(body: Body, timing: Timing) -> Filter {
        Filter {
            body,
            timing,
            pairs: Pairs::new(body.robot),
            said: None,
            given: None,
            still: None,
            must_stop: false,
            lines: Vec::new(),
            allowed: Vec::new(),
            held: Claim::default(),
            tried: Claim::default(),
        }
    }

    /// For how many ticks a command may act; the world stops the body after them.
    pub fn hold_ticks(&self) -> u32 {
        match self.timing {
            Timing::Exact => 1,
            Timing::Loose { hold_ticks } => hold_ticks.max(1),
        }
    }

    /// Draws the lines of this tick, from what has been heard and what is seen: obstacles, and the bodies of robots that are not
    /// heard. The half-planes of velocities that they leave.
    pub fn draw(
        &mut self,
        tick: u64,
        pose: &Pose,
        told: &[Told],
        obstacles: &[Obstacle],
        bodies: &[Obstacle],
    ) -> &[HalfPlane] {
        self.lines.clear();
        self.must_stop = false;
        // Before it gives a new command, its last one may act on: longer if the world has gone back a few ticks since.
        self.still = self.given.and_then(|(given, drive)| {
            let ticks = (given + u64::from(self.hold_ticks())).saturating_sub(tick);
            (ticks > 0).then_some((drive, u32::try_from(ticks).unwrap_or(u32::MAX)))
        });
        claim::held(&self.body, pose, self.still, &mut self.held);
        self.draw_obstacles(pose, obstacles, 1.0);
        // One that is not heard yet may come as near itself.
        self.draw_obstacles(pose, bodies, 0.5);
        match self.timing {
            Timing::Exact => self.draw_shares(tick, pose, told),
            Timing::Loose { .. } => self.draw_borders(tick, pose, told),
        }
        self.allow();
        &self.allowed
    }

    /// The command that is given in place of a wanted one: the wanted one if it fits.
    pub fn keep(&mut self, tick: u64, pose: &Pose, wanted: Drive) -> Drive {
        let drive = self.fitting(pose, wanted);
        self.given = Some((tick, drive));
        drive
    }

    /// How much of the greatest speed a command differs from the wanted one by; zero if they count as the same.
    pub fn change(&self, wanted: Drive, given: Drive) -> f32 {
        let speed = self.body.limits.speed_mps_max.max(f64::MIN_POSITIVE);
        let size = match (self.plain(wanted), self.plain(given)) {
            (Drive::Velocity(wanted), Drive::Velocity(given)) => (wanted - given).norm() / speed,
            (Drive::Twist { speed_mps: wanted, turn_radps: turn_wanted }, Drive::Twist { speed_mps, turn_radps }) => {
                let turn = self.body.limits.turn_radps_max.max(f64::MIN_POSITIVE);
                ((wanted - speed_mps).abs() / speed).max((turn_wanted - turn_radps).abs() / turn)
            }
            _ => 0.0,
        };
        if size > SAME { size as f32 } else { 0.0 }
    }

    /// What it says of the command that it has just given: `next` is where that takes it within a tick.
    pub fn promise(&mut self, tick: u64, pose: &Pose, next: &Pose) -> Promise {
        let near = match self.timing {
            Timing::Exact => {
                claim::held(&self.body, next, None, &mut self.tried);
                next.position
            }
            Timing::Loose { .. } => {
                // The command before may act on as long as this one has not come.
                let (_, drive) = self.given.unwrap_or((tick, Drive::stop(self.body.kind)));
                claim::of(&self.body, pose, self.still, drive, self.hold_ticks(), &mut self.tried);
                self.tried.join(&self.held);
                pose.position
            }
        };
        let (far, beside_m) = self.tried.as_segment();
        let promise = Promise { far: near + far, spare_m: rounded_up(beside_m) };
        self.said = Some(Said { tick, at: pose.position, next: next.position, promise });
        promise
    }

    /// What it says to others about the borders between them and it, the most urgent first.
    pub fn words(&mut self) -> impl Iterator<Item = (u32, u32, Word)> + '_ {
        self.pairs.words()
    }

    /// No more than a share of the gap to anything is used; what moves is kept clear of for as long as a command acts.
    fn draw_obstacles(&mut self, pose: &Pose, obstacles: &[Obstacle], share: f64) {
        let (act_s, reach_m) = (self.act_s(), self.reach_m());
        for pieces in obstacles.chunk_by(|a, b| a.id == b.id) {
            if solid(pieces, pose.position).is_some() {
                continue; // Its centre is inside: every way leads out.
            }
            for piece in pieces {
                let offset = piece.shape.nearest_core(pose.position) - pose.position;
                let distance_m = offset.norm();
                let gap_m = distance_m - piece.shape.radius - self.body.radius_m;
                if share * gap_m > reach_m + piece.velocity.norm() * act_s || distance_m <= 0.0 {
                    continue;
                }
                let normal = offset / distance_m;
                self.leave(normal, share * (gap_m + (piece.velocity.dot(&normal) * act_s).min(0.0)));
            }
        }
    }

    /// Lines that both sides compute from the words of the last tick.
    fn draw_shares(&mut self, tick: u64, pose: &Pose, told: &[Told]) {
        let said = self.said.filter(|said| said.tick + 1 == tick && said.next == pose.position);
        for other in told {
            let theirs = other.promise.zip(other.next).filter(|_| other.tick + 1 == tick);
            let (Some(said), Some((promise, next))) = (said, theirs) else {
                self.stay_away(tick, pose, other);
                continue;
            };
            let mine = Side {
                robot: self.body.robot,
                at: said.next,
                far: said.promise.far,
                radius_m: self.body.radius_m + f64::from(said.promise.spare_m),
                command: (said.next - said.at) / self.body.dt_s,
            };
            let theirs = Side {
                robot: other.robot,
                at: next,
                far: promise.far,
                radius_m: other.radius_m + f64::from(promise.spare_m),
                command: (next - other.at) / self.body.dt_s,
            };
            let reach_m = self.reach_m() + other.speed_mps_max * self.body.dt_s + other.brake_m;
            if let Some((normal, bound)) = gap::own_share(&mine, &theirs, self.body.dt_s, reach_m) {
                self.leave(normal, self.room_m(pose, normal, bound));
            }
        }
    }

    /// Lines that the two have agreed on.
    fn draw_borders(&mut self, tick: u64, pose: &Pose, told: &[Told]) {
        self.pairs.meet(told);
        // There is nothing to say yet to a robot that has never been heard.
        for (place, other) in told.iter().enumerate().filter(|(_, other)| other.is_heard) {
            let clear_m = self.clear_m(tick, pose, other);
            let me = border::Me {
                at: pose.position,
                velocity: pose.velocity,
                radius_m: self.body.radius_m,
                claim: &self.held,
                reach_m: self.reach_m(),
                act_s: self.act_s(),
                dt_s: self.body.dt_s,
                is_out_of_reach: self.held.farthest_m() <= clear_m,
            };
            self.pairs.talk(place, tick, &me, other);
        }
        for (place, other) in told.iter().enumerate() {
            let mut apart = false;
            for index in 0..self.pairs.rules(place).len() {
                match self.pairs.rules(place)[index].1 {
                    Rule::Apart => apart = true,
                    Rule::Line { normal, offset_m } => {
                        let (normal, bound) =
                            if self.body.robot < other.robot { (normal, offset_m) } else { (-normal, -offset_m) };
                        self.leave(normal, self.room_m(pose, normal, bound));
                    }
                }
            }
            if apart {
                self.stay_away(tick, pose, other);
            }
        }
    }

    /// A line that leaves this much room (m) in a direction, of which a little is kept back.
    fn leave(&mut self, normal: Vector2<f64>, room_m: f64) {
        self.lines.push(Line { normal, room_m: (room_m - RESERVE_M).max(0.0) });
    }

    /// How far the robot may go if every point x of its disc is to keep x · `normal` ≤ `bound`, m.
    fn room_m(&self, pose: &Pose, normal: Vector2<f64>, bound: f64) -> f64 {
        bound - pose.position.coords.dot(&normal) - self.body.radius_m
    }

    /// For how long a new command may act, s.
    fn act_s(&self) -> f64 {
        f64::from(self.hold_ticks()) * self.body.dt_s
    }

    /// How far the robot may get with a new command or the one before it, and while it brakes after that, m.
    fn reach_m(&self) -> f64 {
        let ticks = self.still.map_or(0, |(_, ticks)| ticks).max(self.hold_ticks());
        self.body.limits.speed_mps_max * f64::from(ticks) * self.body.dt_s + claim::brake_m(&self.body)
    }

    /// How far the robot can go before it comes to where the other one may be by the time that this one rests, m.
    fn clear_m(&self, tick: u64, pose: &Pose, other: &Told) -> f64 {
        let (at, since) = where_it_is(other, tick, self.timing);
        let ticks = (since + u64::from(self.hold_ticks())) as f64 + claim::brake_ticks(&self.body);
        let theirs_m = other.speed_mps_max * ticks * self.body.dt_s + other.brake_m;
        (at - pose.position).norm() - self.body.radius_m - other.radius_m - theirs_m
    }

    /// Without a line: out of reach of the other one, or not at all.
    fn stay_away(&mut self, tick: u64, pose: &Pose, other: &Told) {
        let stop_at_once = self.hold_ticks() == 1 && other.brake_m == 0.0 && claim::brake_m(&self.body) == 0.0;
        // Where words count at once, the other one may have heard this one and use more than a half.
        let halves = stop_at_once && self.timing != Timing::Exact;
        if !other.is_heard && halves && other.seen.is_some() {
            return; // Its body is seen, and half of the gap to it is kept.
        }
        let is_plain = other.is_heard && other.promise.is_none();
        if is_plain || (halves && other.seen.is_some()) {
            let since_s = tick.saturating_sub(other.tick) as f64 * self.body.dt_s;
            let at = other.seen.unwrap_or(other.at + other.velocity * since_s);
            let Some(normal) = (at - pose.position).try_normalize(0.0) else { return };
            let gap_m = (at - pose.position).norm() - self.body.radius_m - other.radius_m;
            let comes_m = if is_plain { (other.velocity.dot(&normal) * self.act_s()).min(0.0) } else { 0.0 };
            let room_m = 0.5 * (gap_m + comes_m);
            if room_m < self.reach_m() {
                self.leave(normal, room_m);
            }
            return;
        }
        let clear_m = self.clear_m(tick, pose, other);
        if clear_m < 0.0 {
            self.must_stop = true;
        } else if clear_m < self.reach_m()
            && let Some(normal) = (where_it_is(other, tick, self.timing).0 - pose.position).try_normalize(0.0)
        {
            self.lines.push(Line { normal, room_m: clear_m });
        }
    }

    /// The half-planes of velocities, for a body that goes where it is told.
    fn allow(&mut self) {
        self.allowed.clear();
        let Body { limits, dt_s, .. } = self.body;
        let act_s = self.act_s();
        if self.must_stop {
            // No direction is better than another one.
            for normal in [Vector2::x(), Vector2::y(), -Vector2::x(), -Vector2::y()] {
                self.allowed.push(HalfPlane::below(normal, 0.0));
            }
            return;
        }
        for line in &self.lines {
            let room_m = line.room_m * (1.0 - SLACK);
            let mut most = braked_speed(room_m, act_s, limits.accel_mps2_max);
            if let Some((Drive::Velocity(old), ticks)) = self.still {
                let drifts_m = old.dot(&line.normal).max(0.0) * f64::from(ticks) * dt_s;
                most = most.min(((room_m - drifts_m) / dt_s).max(0.0));
            }
            if most < limits.speed_mps_max {
                self.allowed.push(HalfPlane::below(line.normal, most));
            }
        }
    }

    /// Whether the claim of this command keeps to all lines.
    fn fits(&mut self, pose: &Pose, drive: Drive) -> bool {
        claim::of(&self.body, pose, self.still, drive, self.hold_ticks(), &mut self.tried);
        let (lines, tried) = (&self.lines, &self.tried);
        let rounding_m = ROUNDING * tried.farthest_m();
        lines.iter().all(|line| tried.most_m(line.normal) <= line.room_m + rounding_m)
    }

    fn fitting(&mut self, pose: &Pose, wanted: Drive) -> Drive {
        let stop = Drive::stop(self.body.kind);
        if !self.must_stop && self.fits(pose, wanted) {
            return wanted;
        }
        match self.plain(wanted) {
            Drive::Velocity(_) if self.must_stop => stop,
            Drive::Velocity(velocity) => {
                let Ok(best) = nearest(&self.allowed, self.body.limits.speed_mps_max, velocity) else { return stop };
                self.greatest_part(pose, |share| Drive::Velocity(best * share)).unwrap_or(stop)
            }
            // Turning on the spot needs no room.
            Drive::Twist { turn_radps, .. } if self.must_stop && self.body.limits.accel_mps2_max.is_infinite() => {
                Drive::Twist { speed_mps: 0.0, turn_radps }
            }
            Drive::Twist { speed_mps, turn_radps } if !self.must_stop => {
                let slower = self.part_of_speed(pose, speed_mps, turn_radps);
                if slower.is_some_and(|(share, _)| share >= HINDERED) || speed_mps <= 0.0 {
                    return slower.map_or(stop, |(_, drive)| drive);
                }
                let round = self.round(pose, speed_mps, turn_radps);
                let better = round.filter(|(speed, _)| slower.is_none_or(|(share, _)| share * speed_mps < *speed));
                better.or(slower).map_or(stop, |(_, drive)| drive)
            }
            _ => stop,
        }
    }

    /// The same turn with as much of the speed as fits, and the share of it.
    fn part_of_speed(&mut self, pose: &Pose, speed_mps: f64, turn_radps: f64) -> Option<(f64, Drive)> {
        let drive = |share: f64| Drive::Twist { speed_mps: speed_mps * share, turn_radps };
        let share = self.greatest_share(pose, drive)?;
        Some((share, drive(share)))
    }

    /// The way round what is in the way of a body that turns: towards the nearest velocity that is allowed. How far it gets on
    /// as it wanted to, m/s, and the command.
    fn round(&mut self, pose: &Pose, speed_mps: f64, turn_radps: f64) -> Option<(f64, Drive)> {
        let Body { limits, dt_s, .. } = self.body;
        let heading = |yaw_rad: f64| Vector2::new(yaw_rad.cos(), yaw_rad.sin());
        let wanted = heading(pose.yaw_rad + turn_radps * dt_s) * speed_mps;
        let mut best = nearest(&self.allowed, limits.speed_mps_max, wanted).ok()?;
        for plane in &self.allowed {
            if plane.excess(best) > -TILT * best.norm() {
                // To the side of the line that is allowed.
                best += Vector2::new(-plane.direction.y, plane.direction.x) * (TILT * best.norm());
            }
        }
        let way = best.try_normalize(SAME * limits.speed_mps_max)?;
        let error = geometry::wrap(geometry::heading(way) - pose.yaw_rad);
        let turn = crate::steering::turn_towards(error, 1.0 / dt_s, &limits);
        let ahead = best.norm() * error.cos().max(0.0);
        let Drive::Twist { speed_mps: ahead, turn_radps } =
            (Drive::Twist { speed_mps: ahead, turn_radps: turn }).within(&limits)
        else {
            return None;
        };
        let (share, drive) = self.part_of_speed(pose, ahead, turn_radps)?;
        Some((share * ahead * heading(pose.yaw_rad).dot(&(wanted / speed_mps)).max(0.0), drive))
    }

    /// The greatest part of a command that fits; nothing if even none of it does not.
    fn greatest_part(&mut self, pose: &Pose, part: impl Fn(f64) -> Drive) -> Option<Drive> {
        self.greatest_share(pose, &part).map(part)
    }

    fn greatest_share(&mut self, pose: &Pose, part: impl Fn(f64) -> Drive) -> Option<f64> {
        if self.fits(pose, part(1.0)) {
            return Some(1.0);
        }
        if !self.fits(pose, part(0.0)) {
            return None;
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if self.fits(pose, part(middle)) {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(low)
    }

    /// Wheels as a twist.
    fn plain(&self, drive: Drive) -> Drive {
        match (drive, self.body.wheels) {
            (Drive::Wheels { rate_radps }, Some(wheels)) => {
                let (speed_mps, turn_radps) = wheels.twist_of(rate_radps);
                Drive::Twist { speed_mps, turn_radps }
            }
            _ => drive,
        }
    }
}

/// Where another robot was last known to be, and how many ticks ago that was.
fn where_it_is(other: &Told, tick: u64, timing: Timing) -> (Point2<f64>, u64) {
    match (other.seen, other.next) {
        (Some(seen), _) => (seen, 0),
        (None, Some(next)) if timing == Timing::Exact => (next, tick.saturating_sub(other.tick + 1)),
        _ => (other.at, tick.saturating_sub(other.tick)),
    }
}

/// A length as short as a message has room for, and no smaller: nothing that is not negative becomes less.
pub fn rounded_up(length_m: f64) -> f32 {
    let rounded = length_m as f32;
    if f64::from(rounded) < length_m { rounded.next_up() } else { rounded }
}

/// Greatest speed towards something at this distance from which a body that acts on for `act_s` then stops before it, m/s.
fn braked_speed(room_m: f64, act_s: f64, accel_mps2: f64) -> f64 {
    if accel_mps2.is_infinite() {
        room_m / act_s
    } else {
        accel_mps2 * ((act_s * act_s + 2.0 * room_m / accel_mps2).sqrt() - act_s)
    }
}

#[cfg(test)]
mod tests;
