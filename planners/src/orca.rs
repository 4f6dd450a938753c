//! Optimal reciprocal collision avoidance.
//!
//! J. van den Berg, S. J. Guy, M. Lin, D. Manocha, "Reciprocal n-Body Collision Avoidance", Robotics Research (ISRR 2009),
//! Springer Tracts in Advanced Robotics 70, 2011, pp. 3-19.
//!
//! | paper       | here              | unit | default          | larger means                                    |
//! |-------------|-------------------|------|------------------|-------------------------------------------------|
//! | τ           | `horizon_s`       | s    | 10 r / v         | gives way earlier, wider                        |
//! | τ (sec. 5.4)| `wall_horizon_s`  | s    | 5 r / v          | brakes earlier before walls                     |
//! | r           | `inflation`       |      | 1.05             | keeps farther from robots and obstacles         |
//! | v^pref      | `bias_deg`        | deg  | 0                | turns the preferred velocity to the right       |
//! | v^pref      | `heading_gain`    | 1/s  | 3.0              | a unicycle turns sharper                        |
//!
//! Horizons follow the body: r is its radius and v its greatest speed, so that one set of parameters is right for robots of
//! any size.
//!
//! Differs from the paper:
//! - The preferred velocity leads along the shortest way on the known map ([`way`](crate::way)), and straight to the goal
//!   without a map; the paper leaves it open. With a bias it is turned to the right while other robots are near.
//! - What another robot does is taken from its own word: where its last command has taken it, and that command as its
//!   velocity. A robot that does not say goes on as it was last heard.
//! - Robots that have arrived, and what moves without being heard, do not give way: all of the evasion is taken.
//! - The linear program takes the half-planes in the order of distance, not in a random one, as the authors' library does.
//!
//! Known limits: plain ORCA (no bias) stands still for good in exact rings, and bodies overlap in dense crowds, where the
//! half-planes have no velocity in common (sec. 5.3).

use crate::guide::{Guide, Heading};
use crate::method::{Identity, Method, Symmetry, any_speed};
use crate::params::ParamError;
use crate::planner::{Neighbor, Obstacle, Plan, PlanInput, Planner};
use crate::steering::steer_to_goal;
use geometry::half_planes::nearest_relaxed;
use geometry::{Capsule, HalfPlane};
use model::{BodyKind, Drive, ParamValues, PlanState};
use nalgebra::{Point2, Rotation2, Vector2};

/// Registry entry.
pub static METHOD: Method = Method {
    name: "orca",
    summary: "optimal reciprocal collision avoidance: half-planes of velocities, a linear program",
    source: "van den Berg, Guy, Lin, Manocha 2011, Robotics Research, STAR 70",
    // Ways round discs have corners in fixed directions.
    symmetry: Symmetry { rotation: false, ..Symmetry::FULL },
    kinds: BodyKind::MOBILE,
    params: Params::specs,
    speed_mps: any_speed,
    lengths: &[],
    wants_filter: false,
    follows_ways: true,
    build,
};

/// Horizons in units of radius by speed, if the scenario sets none.
const HORIZON: f64 = 10.0;
const WALL_HORIZON: f64 = 5.0;
/// A piece whose line another one has drawn already: slack, as a share of the radius.
const COVERED: f64 = 1e-5;

crate::params! {
    /// Parameters that a scenario can set.
    pub struct Params {
        /// Time τ for which velocities are free of contacts with robots. Larger: gives way earlier and wider. The default
        /// follows the body: 10 radii at full speed.
        horizon_s: f64 = 2.0, "s", 0.01..=1000.0;
        /// The same for obstacles. Larger: brakes earlier before walls. The default follows the body: 5 radii at full speed.
        wall_horizon_s: f64 = 1.0, "s", 0.01..=1000.0;
        /// Factor on all radii. Larger: keeps farther from robots and obstacles.
        inflation: f64 = 1.05, "", 1.0..=3.0;
        /// Turn of the preferred velocity to the right while other robots are near. Larger: wider circles round each other.
        bias_deg: f64 = 0.0, "", -90.0..=90.0;
        /// Turn rate of a unicycle per radian of heading error. Larger: turns sharper.
        heading_gain: f64 = 3.0, "1/s", 0.0..=100.0;
    }
}

/// The method at work for one robot.
pub struct Orca {
    params: Params,
    /// Horizons that the scenario does not set follow the body.
    follows_body: [bool; 2],
    guide: Guide,
    walls: Vec<Wall>,
    /// The robots that are heard: the gap to each, m, whether it has arrived, and how it moves.
    others: Vec<(f64, bool, Mover)>,
    planes: Vec<HalfPlane>,
    room: Vec<HalfPlane>,
}

fn build(values: &ParamValues, _: Identity) -> Result<Box<dyn Planner>, ParamError> {
    let follows_body = [Params::horizon_s.given(values).is_none(), Params::wall_horizon_s.given(values).is_none()];
    Ok(Box::new(Orca { follows_body, ..Orca::new(Params::from_values(values)?) }))
}

impl Planner for Orca {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        let speed = input.limits.speed_mps_max;
        let (wish, state) = self.preferred(input);
        let radius_m = input.radius_m * self.params.inflation;
        let scale_s = input.radius_m / speed.max(f64::MIN_POSITIVE);
        let [horizon_s, wall_horizon_s] = [
            if self.follows_body[0] { HORIZON * scale_s } else { self.params.horizon_s },
            if self.follows_body[1] { WALL_HORIZON * scale_s } else { self.params.wall_horizon_s },
        ]
        .map(|horizon_s| horizon_s.max(input.dt_s));
        let me = Mover { position: input.position, velocity: input.velocity, radius_m };

        self.planes.clear();
        wall_planes(&me, input.obstacles, wall_horizon_s, speed * wall_horizon_s, &mut self.walls, &mut self.planes);
        let walls = self.planes.len();
        self.others.clear();
        for neighbor in input.neighbors {
            let other = mover(neighbor, self.params.inflation, input.dt_s);
            let gap_m = (other.position - me.position).norm() - me.radius_m - other.radius_m;
            self.others.push((gap_m, neighbor.arrived, other));
        }
        // Where no velocity fits, the order counts; of equal distances it is that of the robots.
        self.others.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut near = false;
        for (gap_m, arrived, other) in &self.others {
            near |= !arrived && *gap_m <= speed * horizon_s;
            let share = if *arrived { 1.0 } else { 0.5 };
            self.planes.push(robot_plane(&me, other, horizon_s, input.dt_s, share));
        }
        let moving = input.obstacles.iter().filter(|obstacle| obstacle.velocity != Vector2::zeros());
        for obstacle in moving {
            let position = obstacle.shape.nearest_core(me.position);
            let radius_m = obstacle.shape.radius * self.params.inflation;
            let other = Mover { position, velocity: obstacle.velocity, radius_m };
            self.planes.push(robot_plane(&me, &other, horizon_s, input.dt_s, 1.0));
        }
        let turned = if near { Rotation2::new(-self.params.bias_deg.to_radians()) * wish } else { wish };
        let velocity = nearest_relaxed(&self.planes, walls, speed, turned, &mut self.room);
        let drive = match input.kind {
            BodyKind::Point => Drive::Velocity(velocity),
            BodyKind::Unicycle | BodyKind::DiffDrive => steer_to_goal(velocity, self.params.heading_gain, input),
            BodyKind::TwoLinkArm => Drive::stop(input.kind),
        };
        Plan { attractive: wish, repulsive: velocity - wish, state, ..Plan::only(drive) }
    }
}

impl Orca {
    /// The method with these parameters.
    pub fn new(params: Params) -> Orca {
        Orca {
            params,
            follows_body: [false; 2],
            guide: Guide::default(),
            walls: Vec::new(),
            others: Vec::new(),
            planes: Vec::new(),
            room: Vec::new(),
        }
    }

    /// v^pref: along the way, slower only where a tick at full speed would go past the goal.
    fn preferred(&mut self, input: &PlanInput<'_>) -> (Vector2<f64>, PlanState) {
        let speed = input.limits.speed_mps_max;
        let ahead = match self.guide.follow(input) {
            Heading::To(ahead) => ahead,
            Heading::Searching => return (Vector2::zeros(), PlanState::Planning),
            Heading::Nowhere => return (Vector2::zeros(), PlanState::GaveUp),
        };
        let offset = ahead.at - input.position;
        let fast = if ahead.is_goal { offset / input.dt_s } else { offset * (speed / offset.norm().max(1e-12)) };
        (fast.cap_magnitude(speed), PlanState::Ready)
    }
}

/// A disc that moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mover {
    pub(crate) position: Point2<f64>,
    pub(crate) velocity: Vector2<f64>,
    pub(crate) radius_m: f64,
}

/// Where a neighbour is now and how it moves, from what it said last.
fn mover(neighbor: &Neighbor, inflation: f64, dt_s: f64) -> Mover {
    let (position, velocity, _) = neighbor.now(dt_s);
    Mover { position, velocity, radius_m: neighbor.radius_m * inflation }
}

/// ORCA^τ of one disc with respect to another (eqs. 2 to 5, fig. 3): this disc takes `share` of the change that is needed.
pub(crate) fn robot_plane(me: &Mover, other: &Mover, horizon_s: f64, dt_s: f64, share: f64) -> HalfPlane {
    let (offset, relative) = (other.position - me.position, me.velocity - other.velocity);
    let (reach, square) = (me.radius_m + other.radius_m, offset.norm_squared());
    let overlap = square <= reach * reach;
    // Discs that overlap are to be apart at the end of the tick.
    let tau = if overlap { dt_s } else { horizon_s };
    let from_cap = relative - offset / tau;
    let along = from_cap.dot(&offset);
    if overlap || along < 0.0 && along * along > reach * reach * from_cap.norm_squared() {
        // The round end of the cone is nearest.
        let outward = from_cap.try_normalize(0.0).unwrap_or(-Vector2::x());
        let change = outward * (reach / tau - from_cap.norm());
        return HalfPlane { point: me.velocity + change * share, direction: Vector2::new(outward.y, -outward.x) };
    }
    let leg = (square - reach * reach).sqrt();
    let left = offset.perp(&from_cap) > 0.0;
    let (sin, cos) = (reach / square, leg / square);
    let direction = match left {
        true => Vector2::new(offset.x * cos - offset.y * sin, offset.x * sin + offset.y * cos),
        false => -Vector2::new(offset.x * cos + offset.y * sin, -offset.x * sin + offset.y * cos),
    };
    let change = direction * relative.dot(&direction) - relative;
    HalfPlane { point: me.velocity + change * share, direction }
}

/// One end of a wall.
#[derive(Clone, Copy)]
struct End {
    at: Vector2<f64>,
    convex: bool,
}

/// The walls of a standing obstacle that face the robot. They run counter-clockwise round what is solid.
fn walls_of(me: &Mover, pieces: &[Obstacle], walls: &mut Vec<Wall>) {
    let count = pieces.len();
    let is_closed = count > 2 && pieces.iter().zip(pieces.iter().cycle().skip(1)).all(|(p, q)| p.shape.b == q.shape.a);
    let turns = |piece: &Obstacle| (piece.shape.a - me.position).perp(&(piece.shape.b - me.position));
    let turned = if is_closed {
        pieces.iter().map(turns).sum::<f64>() < 0.0
    } else {
        // Of what is seen in parts, the nearest wall faces the robot; of two that meet there, the one that it faces more.
        let nearer = |p: &&Obstacle, q: &&Obstacle| {
            let key = |piece: &Obstacle| {
                let length = (piece.shape.b - piece.shape.a).norm();
                (piece.shape.distance(me.position), -turns(piece).abs() / length)
            };
            let (p, q) = (key(p), key(q));
            p.0.total_cmp(&q.0).then(p.1.total_cmp(&q.1))
        };
        pieces.iter().min_by(nearer).is_some_and(|piece| turns(piece) > 0.0)
    };
    let edge = |index: usize| {
        let index = index % count;
        let shape = pieces[if turned { count - 1 - index } else { index }].shape;
        let (a, b) = (shape.a - me.position, shape.b - me.position);
        if turned { (b, a, shape.radius) } else { (a, b, shape.radius) }
    };
    let joined = |end: Vector2<f64>, beginning: Vector2<f64>| count > 1 && end == beginning;
    for index in 0..count {
        let (a, b, radius) = edge(index);
        let Some(along) = (b - a).try_normalize(0.0).filter(|along| a.perp(along) <= 0.0) else { continue };
        // The walls that it is joined to; one that ends freely turns back there.
        let (before, after) = (edge(index + count - 1), edge(index + 1));
        let back = if joined(before.1, a) { before.1 - before.0 } else { -along };
        let ahead = if joined(b, after.0) { after.1 - after.0 } else { -along };
        let [back, ahead] = [back, ahead].map(|next| next.try_normalize(0.0).unwrap_or(-along));
        let start = End { at: a, convex: !joined(before.1, a) || back.perp(&along) >= 0.0 };
        let end = End { at: b, convex: !joined(b, after.0) || along.perp(&ahead) >= 0.0 };
        let nearest = Capsule::segment(a.into(), b.into()).nearest_core(Point2::origin());
        walls.push(Wall {
            start,
            end,
            along,
            back,
            ahead,
            radius: me.radius_m + radius,
            distance_m: nearest.coords.norm(),
        });
    }
}

/// Half-planes of standing obstacles (sec. 5.4): for each wall, the nearest first, the side of its velocity obstacle that is
/// nearest to the present velocity. Walls that the half-planes of nearer ones keep away already have none. A disc is what a
/// robot is that stands and does not give way.
fn wall_planes(
    me: &Mover,
    obstacles: &[Obstacle],
    horizon_s: f64,
    reach_m: f64,
    walls: &mut Vec<Wall>,
    planes: &mut Vec<HalfPlane>,
) {
    walls.clear();
    for pieces in obstacles.chunk_by(|a, b| a.id == b.id).filter(|pieces| pieces[0].velocity == Vector2::zeros()) {
        match pieces {
            [Obstacle { shape, .. }] if shape.a == shape.b => {
                let other = Mover { position: shape.a, velocity: Vector2::zeros(), radius_m: shape.radius };
                if shape.distance(me.position) - me.radius_m <= reach_m {
                    planes.push(robot_plane(me, &other, horizon_s, horizon_s, 1.0));
                }
            }
            _ => walls_of(me, pieces, walls),
        }
    }
    walls.retain(|wall| wall.distance_m - wall.radius <= reach_m);
    walls.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
    for wall in walls.iter() {
        let margin = wall.radius / horizon_s;
        let is_covered = |plane: &HalfPlane| {
            let outside = |at: Vector2<f64>| plane.excess(at / horizon_s) - margin >= -COVERED * margin;
            outside(wall.start.at) && outside(wall.end.at)
        };
        if !planes.iter().any(is_covered) {
            planes.extend(wall.plane(me.velocity, horizon_s));
        }
    }
}

/// A wall as seen by a robot at the origin.
struct Wall {
    start: End,
    end: End,
    /// From its start to its end.
    along: Vector2<f64>,
    /// Directions of the walls before and after it.
    back: Vector2<f64>,
    ahead: Vector2<f64>,
    /// Half its thickness and the radius of the robot, m.
    radius: f64,
    distance_m: f64,
}

impl Wall {
    fn plane(&self, velocity: Vector2<f64>, horizon_s: f64) -> Option<HalfPlane> {
        let Wall { start, end, along, radius, .. } = *self;
        let length = (end.at - start.at).norm();
        let s = -start.at.dot(&along) / length.max(f64::MIN_POSITIVE);
        let beside = (start.at + along * (s * length)).norm_squared() <= radius * radius;
        let touches = |at: Vector2<f64>| at.norm_squared() <= radius * radius;
        // The robot touches it: no velocity further into it.
        let off = |at: Vector2<f64>| at.try_normalize(0.0).map(|toward| HalfPlane::below(toward, 0.0));
        if s < 0.0 && touches(start.at) {
            return start.convex.then(|| off(start.at)).flatten();
        }
        if s > 1.0 && touches(end.at) {
            let its_own = end.convex && end.at.perp(&self.ahead) >= 0.0;
            return its_own.then(|| off(end.at)).flatten();
        }
        if (0.0..1.0).contains(&s) && beside {
            return Some(HalfPlane { point: Vector2::zeros(), direction: -along });
        }
        // The legs of the cone. Seen along the wall, one end alone makes the cone.
        let (left, right) = match (s < 0.0 && beside, s > 1.0 && beside) {
            (true, _) => (start, start),
            (_, true) => (end, end),
            _ => (start, end),
        };
        let leg = |at: Vector2<f64>, side: f64| {
            let square = at.norm_squared();
            let (sin, cos) = (side * radius / square, (square - radius * radius).max(0.0).sqrt() / square);
            Vector2::new(at.x * cos - at.y * sin, at.x * sin + at.y * cos)
        };
        let one = left.at == right.at;
        if one && !left.convex {
            return None;
        }
        let mut left_leg = if left.convex { leg(left.at, 1.0) } else { -along };
        let mut right_leg = if right.convex { leg(right.at, -1.0) } else { along };
        // A leg never points into the next wall: then that wall's own line counts.
        let (before, after) = match one {
            true if left.at == start.at => (self.back, along),
            true => (along, self.ahead),
            false => (self.back, self.ahead),
        };
        let (mut left_foreign, mut right_foreign) = (false, false);
        if left.convex && left_leg.perp(&-before) >= 0.0 {
            (left_leg, left_foreign) = (-before, true);
        }
        if right.convex && right_leg.perp(&after) <= 0.0 {
            (right_leg, right_foreign) = (after, true);
        }
        let (left_cap, right_cap) = (left.at / horizon_s, right.at / horizon_s);
        let cap = right_cap - left_cap;
        let t = if one { 0.5 } else { (velocity - left_cap).dot(&cap) / cap.norm_squared() };
        let (on_left, on_right) = ((velocity - left_cap).dot(&left_leg), (velocity - right_cap).dot(&right_leg));
        let round = |cap: Vector2<f64>| {
            let outward = (velocity - cap).try_normalize(0.0)?;
            let direction = Vector2::new(outward.y, -outward.x);
            Some(HalfPlane { point: cap + outward * (radius / horizon_s), direction })
        };
        if t < 0.0 && on_left < 0.0 || one && on_left < 0.0 && on_right < 0.0 {
            return round(left_cap);
        }
        if t > 1.0 && on_right < 0.0 {
            return round(right_cap);
        }
        let to = |at: Vector2<f64>| (velocity - at).norm_squared();
        let to_cap = if !(0.0..=1.0).contains(&t) || one { f64::INFINITY } else { to(left_cap + cap * t) };
        let to_left = if on_left < 0.0 { f64::INFINITY } else { to(left_cap + left_leg * on_left) };
        let to_right = if on_right < 0.0 { f64::INFINITY } else { to(right_cap + right_leg * on_right) };
        let line = |at: Vector2<f64>, direction: Vector2<f64>| {
            let outward = Vector2::new(-direction.y, direction.x);
            HalfPlane { point: at + outward * (radius / horizon_s), direction }
        };
        if to_cap <= to_left && to_cap <= to_right {
            Some(line(left_cap, -along))
        } else if to_left <= to_right {
            (!left_foreign).then(|| line(left_cap, left_leg))
        } else {
            (!right_foreign).then(|| line(right_cap, -right_leg))
        }
    }
}

#[cfg(test)]
mod tests;
