//! A crowd planner: all turn right by as little as clears all pairs, and who has way is settled by the same rule on both
//! sides.
//!
//! Not from a paper. Robots tell each other what they are about beside their pose ([`Intent`]): the velocity that each would
//! have if it were alone (its wish), how far it has to go, and how much of its speed it has lost lately. From that:
//!
//! 1. **Way.** The wish leads along a short way on the known map ([`way`](crate::way)), without a map past what has been seen. Ways go
//!    round what stands in the direction in which robots go round each other, unless that is much longer.
//! 2. **One common right-hand turn.** If all robots turn their wishes to the right by b, the relative wishes turn by b too. b is the
//!    smallest turn after which none of the robots that are heard is on a course of contact. Rings and crossings become
//!    roundabouts, opposite streams become lanes. A robot turns at least as far as those close to its left that go the same way:
//!    otherwise the outermost of a stream, which has nothing before it, would keep the others from the side.
//! 3. **Right of way** (`has_way`): who has arrived gives way; of two that go the same way the one that is nearer to its
//!    goal goes first; of two that hinder each other and are stuck the one with the greater rank goes first. The rank is the
//!    direction in which the robot set out, so that all that go one way through a door go before all that come the other way. Who
//!    had to leave its goal again has the least. Who gives way takes the whole evasion, from the other one's wish; who has way takes
//!    none. A point that has arrived evades only the course of another one, as long as that gets on. Who makes room in a throng says
//!    so, and has way before those behind that want the same way: they go back as well, one after the other, until there is room.
//! 4. **Velocity.** The nearest to the turned wish within hard and soft half-planes. Hard: what the filter behind it allows, that is
//!    this robot's own part of each gap ([`filter`](crate::filter)). Soft: those of ORCA ([`orca`](crate::orca)) for a short
//!    horizon; where not all can hold they give way evenly.
//!    A body that has to turn first drives ahead meanwhile as far as all of them allow. It keeps a little farther from those that have
//!    way, and what it needs to turn it has not lost.
//! 5. **Last resort.** Without progress for a long time: aside for a short time, in a direction that the robot draws.
//!
//! All lengths are in radii of the robot and all times in radius by greatest speed, so that robots of any size do the same.
//!
//! | symbol | here      | unit | default | larger means                                  |
//! |--------|-----------|------|---------|-----------------------------------------------|
//! |        | `horizon` | r/v  | 1.5     | gives way earlier (soft half-planes)           |
//! |        | `turn_max_deg` | deg | 45   | wider roundabouts before robots close up       |
//! |        | `keeps_right` | r  | 4       | longer ways, on which fewer robots meet        |
//! |        | `heading_gain` | 1/s | 8.0  | a unicycle turns sharper                       |
//!
//! A robot that tells no intent is taken to go on as it goes, and shares every evasion.
//!
//! Known limits: without a map it finds out about dead ends by driving into them. Without the filter nothing keeps robots from
//! touching each other.

mod common_turn;

use crate::filter::ROUNDING;
use crate::guide::{Guide, Heading};
use crate::method::{Identity, Method, Symmetry, any_speed};
use crate::orca::{Mover, robot_plane};
use crate::params::ParamError;
use crate::planner::{Intent, Neighbor, Plan, PlanInput, Planner, solid};
use crate::steering::{arc_speed, steer_to_goal, stoppable_speed, turnable};
use crate::way::Ahead;
use geometry::half_planes::nearest_relaxed;
use geometry::{HalfPlane, heading, wrap};
use model::random::Stream;
use model::{BodyKind, Drive, ParamValues, PlanState};
use nalgebra::{Point2, Rotation2, Vector2};
use std::f64::consts::{PI, TAU};

/// Registry entry.
pub static METHOD: Method = Method {
    name: "lanes",
    summary: "a crowd planner: one common right-hand turn, right of way, shares of every gap",
    source: "",
    // It prefers the right, and the last resort is drawn.
    symmetry: Symmetry { rotation: false, reflection: false, ..Symmetry::FULL },
    kinds: BodyKind::MOBILE,
    params: Params::specs,
    speed_mps: any_speed,
    lengths: &[],
    wants_filter: true,
    follows_ways: true,
    build,
};

crate::params! {
    /// Parameters that a scenario can set.
    pub struct Params {
        /// Horizon of the soft half-planes, in units of radius by speed. Larger: gives way earlier.
        horizon: f64 = 1.5, "", 0.1..=100.0;
        /// Greatest common turn to the right while nothing is lost by it. Larger: wider roundabouts.
        turn_max_deg: f64 = 45.0, "", 0.0..=90.0;
        /// By how much its way may be longer, in radii and for each obstacle, to have the obstacle on its left, as all others have. 0: the
        /// shortest way.
        keeps_right: f64 = 4.0, "", 0.0..=1000.0;
        /// Turn rate of a unicycle per radian of heading error. Larger: turns sharper.
        heading_gain: f64 = 8.0, "1/s", 0.0..=100.0;
    }
}

/// Horizon against the wish of a robot that has way and is hindered, in units of radius by speed.
const HORIZON_HINDERED: f64 = 4.0;
/// Share of the headway lost from which on a robot is hindered.
const HINDERED: f32 = 0.25;
/// The same from which on it is stuck.
const STUCK: f32 = 0.5;
/// Ranks begin with this direction, rad: one in which few set out.
const FIRST_DIRECTION: f64 = -109.0 * PI / 180.0;
/// A robot that gives way to another one nearer than this, in radii, makes room for it, and those behind make room in turn.
const YIELDS_WITHIN: f64 = 0.7;
/// Cosine of the angle between two wishes from which on they go the same way.
const SAME_WAY: f64 = 0.3;
/// Time over which speed and headway are averaged, in units of radius by speed.
const LATELY: f64 = 8.0;
/// And how much longer for a body that has to turn first, in the time in which it turns by a radian: it has not lost what it needs for
/// that.
const LATELY_TURNS: f64 = 10.0;
/// What a body that has to turn first keeps more, in radii, from one that has way: it could not make room for it in time.
const TURNS_BESIDE: f64 = 0.2;
/// One nearer than this, in radii, touches it: then it does not back off for that.
const TOUCHES: f64 = 0.01;
/// Of the sum of radii: what is kept beside it.
const KEEPS_BESIDE: f64 = 1.1;
/// Relative wishes below this share of the speed go nowhere.
const SLOW: f64 = 0.02;
/// Time without progress after which the robot goes aside, and for how long, in units of radius by speed.
const PATIENCE: f64 = 30.0;
const ASIDE: f64 = 8.0;
/// What counts as progress, in radii.
const PROGRESS: f64 = 0.1;

/// What a robot has said, as both sides know it: rules that two robots apply to each other look at nothing else.
#[derive(Clone, Copy, Debug)]
struct Said {
    id: u32,
    arrived: bool,
    /// The velocity that it was about to have, m/s.
    command: Vector2<f64>,
    intent: Intent,
}

/// Another robot.
#[derive(Clone, Copy, Debug)]
struct Other {
    /// Where it is now, m.
    at: Point2<f64>,
    radius_m: f64,
    /// It says what it is about.
    tells: bool,
    said: Said,
}

/// A piece of an obstacle, as the robot sees it.
#[derive(Clone, Copy, Debug)]
struct Wall {
    /// From the robot's centre to the nearest point of its core, m.
    offset: Vector2<f64>,
    /// Between the surfaces, m.
    gap_m: f64,
    velocity: Vector2<f64>,
}

/// The method at work for one robot.
pub struct Lanes {
    params: Params,
    /// Own slot.
    robot: u32,
    /// In which direction it goes aside.
    draws: Stream,
    guide: Guide,
    /// Where it heads, and the rank with which it set out.
    heads: Option<(Point2<f64>, f64)>,
    /// It has been at this goal.
    has_arrived: bool,
    /// What it said in the last tick.
    said: Option<Said>,
    /// Where it was then, m, and which tick that was.
    was: (Point2<f64>, u64),
    /// The way out of an obstacle that its centre is in.
    way_out: Option<Vector2<f64>>,
    slow: f64,
    lag: f64,
    /// The least way that was left so far, m, and the tick of that.
    best: (f64, u64),
    /// It goes aside by this angle, rad, until this tick.
    aside: Option<(f64, u64)>,
    /// It makes room for one that has way.
    yields: bool,
    others: Vec<Other>,
    walls: Vec<Wall>,
    blocked: Vec<(f64, f64, bool)>,
    planes: Vec<HalfPlane>,
    room: Vec<HalfPlane>,
}

fn build(values: &ParamValues, identity: Identity) -> Result<Box<dyn Planner>, ParamError> {
    Ok(Box::new(Lanes::new(Params::from_values(values)?, identity)))
}

impl Planner for Lanes {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        let speed = input.limits.speed_mps_max;
        if speed <= 0.0 {
            return Plan { stopped: true, ..Plan::only(Drive::stop(input.kind)) };
        }
        let (wish, left_m, corner, state) = self.wish(input);
        let rank = self.heads.map_or(0.0, |(_, rank)| if self.has_arrived { rank - 1.0 } else { rank });
        let unit_s = input.radius_m / speed;
        self.hear(input);
        self.recall(input);
        self.see(input);
        let turn = if self.has_arrived { 0.0 } else { self.common_turn(input, wish, left_m, corner) };
        let aside = self.aside(input, left_m, unit_s);
        let wanted = Rotation2::new(aside - turn) * wish;
        let hard = self.draw(input, unit_s);
        let wanted = self.way_out.map_or(wanted, |out| out * speed);
        let best = nearest_relaxed(&self.planes, hard, speed, wanted, &mut self.room);
        let velocity = best * kept_share(&self.planes[..hard], best);

        // A point goes where it is told; what turns has to be watched.
        let went = if input.kind == BodyKind::Point { velocity } else { input.velocity };
        let turns_s = if input.kind == BodyKind::Point { 0.0 } else { LATELY_TURNS / input.limits.turn_radps_max };
        let share = (input.dt_s / (LATELY * unit_s + turns_s)).min(1.0);
        let wishes = wish.norm();
        if wishes > SLOW * speed {
            self.slow += share * ((1.0 - went.norm() / wishes).max(0.0) - self.slow);
            self.lag += share * (1.0 - went.dot(&wish) / (wishes * speed.min(wishes)) - self.lag);
        } else {
            (self.slow, self.lag) = (0.0, 0.0);
        }
        let intent =
            Intent { wish, left_m, rank, corner, slow: self.slow as f32, lag: self.lag as f32, yields: self.yields };
        let said = Said { id: self.robot, arrived: input.arrived, command: velocity, intent };
        (self.said, self.was) = (Some(said), (input.position, input.tick));
        let drive = match input.kind {
            BodyKind::Point => Drive::Velocity(velocity),
            BodyKind::Unicycle | BodyKind::DiffDrive => self.turn_towards(velocity, wanted, input),
            BodyKind::TwoLinkArm => Drive::stop(input.kind),
        };
        Plan { attractive: wish, repulsive: velocity - wish, state, intent: Some(intent), ..Plan::only(drive) }
    }
}

impl Lanes {
    /// The method with these parameters, for this robot.
    pub fn new(params: Params, identity: Identity) -> Lanes {
        let guide = Guide::keeping_right(params.keeps_right);
        Lanes {
            params,
            robot: identity.robot,
            draws: Stream::new(identity.seed, identity.robot, identity.incarnation, "lanes-aside"),
            guide,
            heads: None,
            has_arrived: false,
            said: None,
            was: (Point2::origin(), 0),
            way_out: None,
            slow: 0.0,
            lag: 0.0,
            best: (f64::INFINITY, 0),
            aside: None,
            yields: false,
            others: Vec::new(),
            walls: Vec::new(),
            blocked: Vec::new(),
            planes: Vec::new(),
            room: Vec::new(),
        }
    }

    /// The velocity of a robot that is alone, the way that is left, and the corner that comes next.
    fn wish(&mut self, input: &PlanInput<'_>) -> (Vector2<f64>, f64, Option<Point2<f64>>, PlanState) {
        let speed = input.limits.speed_mps_max;
        let ahead = match self.guide.explore(input) {
            Heading::To(ahead) => Some(ahead),
            Heading::Nowhere => None,
            Heading::Searching => {
                // How long the way is will be known when there is one.
                self.heads = None;
                return (Vector2::zeros(), (input.goal - input.position).norm(), None, PlanState::Planning);
            }
        };
        let left_m = ahead.map_or((input.goal - input.position).norm(), |ahead| ahead.left_m);
        if self.heads.is_none_or(|(goal, _)| goal != input.goal) {
            let rank = rank_of(input.goal - input.position);
            (self.heads, self.has_arrived) = (Some((input.goal, rank)), false);
            (self.best, self.aside) = ((left_m, input.tick), None);
        }
        let Some(Ahead { at, is_goal, .. }) = ahead else {
            return (Vector2::zeros(), left_m, None, PlanState::GaveUp);
        };
        self.has_arrived |= input.arrived;
        if input.arrived {
            return (Vector2::zeros(), 0.0, None, PlanState::Ready);
        }
        let offset = at - input.position;
        let stops = (offset.norm() / input.dt_s).min(stoppable_speed(offset.norm(), &input.limits));
        let most = if is_goal { stops.min(speed) } else { speed };
        let wish = offset.try_normalize(1e-12).map_or(Vector2::zeros(), |ahead| ahead * most);
        (wish, left_m, (!is_goal).then_some(at), PlanState::Ready)
    }

    /// What the others have said, and where they are now.
    fn hear(&mut self, input: &PlanInput<'_>) {
        self.others.clear();
        self.others.extend(input.neighbors.iter().map(|neighbor| other(neighbor, input.dt_s)));
    }

    /// What stands and moves around it; of an obstacle that its centre is in, only the way out.
    fn see(&mut self, input: &PlanInput<'_>) {
        self.walls.clear();
        self.way_out = None;
        for pieces in input.obstacles.chunk_by(|a, b| a.id == b.id) {
            if let Some(inside) = solid(pieces, input.position) {
                self.way_out = (input.position - inside.a).try_normalize(0.0);
                continue;
            }
            self.walls.extend(pieces.iter().map(|piece| {
                let offset = piece.shape.nearest_core(input.position) - input.position;
                let gap_m = offset.norm() - piece.shape.radius - input.radius_m;
                Wall { offset, gap_m, velocity: piece.velocity }
            }));
        }
    }

    /// What the robot did since it spoke last is what the others have heard that it would do, to the last bit. After a pause
    /// they have heard nothing that counts.
    fn recall(&mut self, input: &PlanInput<'_>) {
        let (at, tick) = self.was;
        match &mut self.said {
            Some(said) if tick + 1 == input.tick => said.command = (input.position - at) / input.dt_s,
            said => *said = None,
        }
    }

    /// An angle to go aside by, rad: without progress for a long time.
    fn aside(&mut self, input: &PlanInput<'_>, left_m: f64, unit_s: f64) -> f64 {
        // Who has to turn first needs more of it.
        let turns_s = if input.kind == BodyKind::Point { 0.0 } else { PI / input.limits.turn_radps_max };
        let ticks = |units: f64| ((units * unit_s + turns_s) / input.dt_s).ceil() as u64;
        if left_m < self.best.0 - PROGRESS * input.radius_m || self.has_arrived {
            self.best = (left_m, input.tick);
        }
        if let Some((angle, until)) = self.aside {
            if input.tick < until {
                return angle;
            }
            (self.aside, self.best) = (None, (left_m, input.tick));
        }
        if input.tick.saturating_sub(self.best.1) > ticks(PATIENCE) {
            let drawn = (4.0 * self.draws.unit()) as usize;
            let angle = [60f64, 130.0, -60.0, -130.0][drawn].to_radians();
            self.aside = Some((angle, input.tick + ticks(ASIDE)));
            return angle;
        }
        0.0
    }

    /// The twist of a body that has to turn to this velocity first: meanwhile it drives ahead as fast as all half-planes allow, but no
    /// faster than it gets on in the direction that it wants.
    fn turn_towards(&self, velocity: Vector2<f64>, wanted: Vector2<f64>, input: &PlanInput<'_>) -> Drive {
        // No faster than it is there within a tick.
        let gain = self.params.heading_gain.min(1.0 / input.dt_s);
        let drive = steer_to_goal(velocity, gain, input);
        let Drive::Twist { speed_mps, turn_radps } = drive else { return drive };
        let ahead = Vector2::new(input.yaw_rad.cos(), input.yaw_rad.sin());
        let most = input.limits.speed_mps_max;
        let free = most * kept_share(&self.planes, ahead * most);
        let error = if velocity.norm() > 0.0 { wrap(heading(velocity) - input.yaw_rad) } else { 0.0 };
        let meanwhile = free.min(ahead.dot(&wanted)) * turnable(error, gain, &input.limits);
        Drive::Twist { speed_mps: speed_mps.max(meanwhile.min(arc_speed(input))), turn_radps }
    }

    /// The half-planes of velocities; how many of them are hard.
    fn draw(&mut self, input: &PlanInput<'_>, unit_s: f64) -> usize {
        let (speed, dt_s) = (input.limits.speed_mps_max, input.dt_s);
        self.planes.clear();
        self.planes.extend(input.allowed);
        if input.allowed.is_empty() {
            for wall in &self.walls {
                let Some(toward) = wall.offset.try_normalize(0.0) else { continue };
                let free_m = (wall.gap_m + wall.velocity.dot(&toward) * dt_s).max(0.0);
                let most = (free_m / dt_s).min(stoppable_speed(free_m, &input.limits));
                if most < speed {
                    self.planes.push(HalfPlane::below(toward, most));
                }
            }
        }
        let me = self.said.unwrap_or(Said {
            id: self.robot,
            arrived: input.arrived,
            command: input.velocity,
            intent: Intent {
                wish: input.velocity,
                left_m: 0.0,
                rank: 0.0,
                corner: None,
                slow: 0.0,
                lag: 0.0,
                yields: false,
            },
        });
        let hard = self.planes.len();
        let own = Mover { position: input.position, velocity: me.command, radius_m: input.radius_m };
        self.yields = false;
        for other in &self.others {
            let way = if other.tells && self.said.is_some() { has_way(&me, &other.said) } else { None };
            let gap_m = (other.at - input.position).norm() - input.radius_m - other.radius_m;
            let same = cosine(me.intent.wish, other.said.intent.wish) > SAME_WAY;
            if way == Some(false)
                && gap_m < YIELDS_WITHIN * input.radius_m
                && (!same || other.said.intent.yields)
                && !me.arrived
            {
                self.yields = true;
            }
            let (velocity, share, horizon) = match way {
                Some(true) => continue,
                Some(false) => {
                    let Intent { wish, lag, yields, .. } = other.said.intent;
                    let hindered = lag > HINDERED;
                    // Who has arrived evades the course of one that gets on, and makes room for one that does not. What has to turn first
                    // cannot wait so long.
                    let can_wait = me.arrived && input.kind == BodyKind::Point;
                    let velocity = if can_wait && !hindered {
                        other.said.command
                    } else if same && yields {
                        -wish
                    } else {
                        wish
                    };
                    (velocity, 1.0, if hindered { HORIZON_HINDERED } else { self.params.horizon })
                }
                None => (other.said.command, 0.5, self.params.horizon),
            };
            let horizon_s = (horizon * unit_s).max(dt_s);
            let turns = input.kind != BodyKind::Point && way == Some(false) && !other.said.arrived;
            let beside_m = if turns && gap_m > TOUCHES * input.radius_m { TURNS_BESIDE * input.radius_m } else { 0.0 };
            let it = Mover { position: other.at, velocity, radius_m: other.radius_m + beside_m };
            if gap_m < (2.0 * speed + velocity.norm()) * horizon_s {
                self.planes.push(robot_plane(&own, &it, horizon_s, dt_s, share));
            }
        }
        // What moves and keeps no rules is evaded by this robot alone.
        for wall in self.walls.iter().filter(|wall| wall.velocity != Vector2::zeros()) {
            let horizon_s = (HORIZON_HINDERED * unit_s).max(dt_s);
            let radius_m = wall.offset.norm() - wall.gap_m - input.radius_m;
            // It may turn: as much room is kept beside it as beside a robot.
            let radius_m = radius_m + (KEEPS_BESIDE - 1.0) * (radius_m + input.radius_m);
            let it = Mover { position: input.position + wall.offset, velocity: wall.velocity, radius_m };
            if wall.gap_m < (speed + wall.velocity.norm()) * horizon_s {
                self.planes.push(robot_plane(&own, &it, horizon_s, dt_s, 1.0));
            }
        }
        hard
    }
}

/// Whether the first of two robots has way; nothing if neither has. It is the opposite if the two change places.
fn has_way(a: &Said, b: &Said) -> Option<bool> {
    if a.arrived != b.arrived {
        return Some(b.arrived);
    }
    if a.arrived {
        return None;
    }
    let first = |mine: f64, theirs: f64| if mine == theirs { a.id < b.id } else { mine < theirs };
    if cosine(a.intent.wish, b.intent.wish) > SAME_WAY {
        // A robot that makes room needs room itself.
        if a.intent.yields != b.intent.yields {
            return Some(a.intent.yields);
        }
        Some(first(a.intent.left_m, b.intent.left_m))
    } else if is_stuck(a, b) {
        Some(first(-a.intent.rank, -b.intent.rank))
    } else {
        None
    }
}

/// Whether two robots that are in each other's way do not get on: both, or the one that has not been at its goal yet.
fn is_stuck(a: &Said, b: &Said) -> bool {
    let [mine, theirs] = [a, b].map(|said| said.intent.lag > STUCK || said.intent.rank < 0.0);
    mine && theirs && a.intent.lag.max(b.intent.lag) > STUCK
}

/// The rank of a robot whose goal is in this direction: 0 to 1, counter-clockwise.
fn rank_of(toward: Vector2<f64>) -> f64 {
    ((toward.y.atan2(toward.x) - FIRST_DIRECTION) / TAU).rem_euclid(1.0)
}

/// Cosine of the angle between two vectors; the same if they change places.
fn cosine(a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    let lengths = a.norm() * b.norm();
    if lengths > 0.0 { a.dot(&b) / lengths } else { 0.0 }
}

/// How much of a velocity keeps within half-planes in which standing still is: less than all where rounding has led out.
fn kept_share(planes: &[HalfPlane], velocity: Vector2<f64>) -> f64 {
    let share = |plane: &HalfPlane| {
        let room = -plane.excess(Vector2::zeros());
        let used = room + plane.excess(velocity);
        if used > room + ROUNDING * velocity.norm() { (room / used).max(0.0) } else { 1.0 }
    };
    planes.iter().map(share).fold(1.0, f64::min)
}

/// A neighbour, from what it said last.
fn other(neighbor: &Neighbor, dt_s: f64) -> Other {
    let (at, command, _) = neighbor.now(dt_s);
    let going = Intent {
        wish: command,
        left_m: neighbor.remaining_m,
        rank: 0.0,
        corner: None,
        slow: 0.0,
        lag: 0.0,
        yields: false,
    };
    Other {
        at,
        radius_m: neighbor.radius_m,
        tells: neighbor.intent.is_some(),
        said: Said { id: neighbor.id, arrived: neighbor.arrived, command, intent: neighbor.intent.unwrap_or(going) },
    }
}

#[cfg(test)]
mod tests;
