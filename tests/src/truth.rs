//! What a run came to, recomputed from the place of every robot at every tick, by other means than the world's: every pair
//! in every tick (no grid, no bounding boxes), closest approaches from the minimum of a parabola and from
//! C. Ericson, "Real-Time Collision Detection", 5.1.9, insides from winding numbers, contacts from a memory of who
//! overlaps whom, arrivals from a referee of its own.
//!
//! What it shares with the world are the definitions. Between two ticks every centre moves straight and evenly (of a
//! unicycle: on the chord). Overlaps of less than 1 nm are none. How deep a polygon is entered is taken at the ends of
//! a tick. A robot that is new to the world comes from its start. The joints of an arm turn evenly; what its links come
//! near is looked up at many instants of a tick, so clearances are right to [`ARM_M`], and only contacts that are deeper
//! than that are for it to count.

use crate::recording::{Frame, at, has_arrived, is_silent};
use model::{AtEnd, Motion, Robot, Scenario, Shape, TimelineAction};
use nalgebra::{Point2, Vector2};
use std::collections::{HashSet, VecDeque};

const TOUCH_M: f64 = 1e-9;
/// What is said of arms is right to this, m, as long as no robot is faster than some metres per second.
pub const ARM_M: f64 = 1e-3;
/// Instants of a tick at which arms are looked at.
const INSTANTS: u32 = 200;

/// The outcome of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Truth {
    /// Robots at their last goal in the end.
    pub arrived: usize,
    /// Those that arrived and were never in contact.
    pub succeeded: usize,
    /// When the last of them arrived, s; `None` unless all did that did not leave.
    pub makespan_s: Option<f64>,
    /// Sum of the times of those that arrived, each since it joined, s.
    pub flowtime_s: f64,
    /// Path of all robots until they arrived, or in all, m.
    pub path_length_m: f64,
    /// The same of every robot, by slot.
    pub paths_m: Vec<f64>,
    /// How often each robot reversed its direction until it arrived, or in all, by slot.
    pub reversals: Vec<u32>,
    /// Times that two robots began to overlap.
    pub robot_contacts: u64,
    /// Times that a robot began to overlap an obstacle.
    pub obstacle_contacts: u64,
    /// Contacts that each robot was part of, by slot.
    pub contacts: Vec<u64>,
    /// Smallest distance between two robots, surface to surface, m.
    pub min_clearance_m: Option<f64>,
    /// Smallest distance of a robot to an obstacle, surface to surface, m.
    pub min_obstacle_clearance_m: Option<f64>,
}

/// Recomputes a run from its frames, the first of which is for tick 0.
///
/// # Panics
/// When ticks are missing, or a frame's arrival flags are not what its positions say.
pub fn recompute(scenario: &Scenario, frames: &[Frame]) -> Truth {
    let robots = scenario.robots.len();
    let dt_s = scenario.clock.dt_s();
    let mut truth =
        Truth { paths_m: vec![0.0; robots], reversals: vec![0; robots], contacts: vec![0; robots], ..Truth::default() };
    // By slot: the ends of the ticks that the robot drove, and how many there were when it arrived.
    let mut driven: Vec<Vec<Point2<f64>>> = vec![Vec::new(); robots];
    let mut driven_until: Vec<usize> = vec![0; robots];
    let mut referees: Vec<Referee<'_>> = scenario.robots.iter().map(Referee::new).collect();
    let mut touching: HashSet<Pair> = HashSet::new();
    let (mut clearance_m, mut obstacle_clearance_m) = (f64::INFINITY, f64::INFINITY);

    for ticks in frames.windows(2) {
        let [before, after] = ticks else { unreachable!("windows of two") };
        let tick = before.tick;
        assert_eq!(after.tick, tick + 1, "a frame is missing");
        for event in scenario.events.iter().filter(|event| event.tick == tick) {
            if let TimelineAction::Task { robot, task } = event.what
                && after.robot(robot).is_some()
            {
                referees[robot].task(task.goal, task.now);
            }
        }

        let ways: Vec<Way> = after.robots().map(|body| Way::new(scenario, before, body)).collect();
        for way in &ways {
            let referee = &mut referees[way.slot];
            if referee.joined.is_none() {
                referee.joined = Some(tick);
                referee.judge([way.from; 2], tick, dt_s, truth.paths_m[way.slot]);
            }
            truth.paths_m[way.slot] += (way.to - way.from).norm();
            if !way.silent {
                let ends = &mut driven[way.slot];
                let first = Some(way.from).filter(|_| ends.is_empty());
                ends.extend(first.into_iter().chain([way.to]));
                let arrived_before = referee.arrival;
                referee.judge([way.from, way.to], tick + 1, dt_s, truth.paths_m[way.slot]);
                if referee.arrival.is_some() && referee.arrival != arrived_before {
                    driven_until[way.slot] = ends.len();
                }
            }
            let (says, is) = (way.arrived, referee.arrival.is_some());
            assert_eq!(says, is, "tick {}: whether `{}` has arrived", tick + 1, scenario.robots[way.slot].id);
        }

        for (index, a) in ways.iter().enumerate() {
            for b in &ways[index + 1..] {
                let radii = a.radius_m + b.radius_m;
                let (least, at_last) = if a.arm.is_some() || b.arm.is_some() {
                    let gap = |t| {
                        let pairs = a.bodies(t).into_iter().flat_map(|a| b.bodies(t).map(|b| (a, b)));
                        pairs.map(|([a0, a1], [b0, b1])| between_segments(a0, a1, b0, b1)).fold(f64::INFINITY, f64::min)
                    };
                    (least_of(gap) - radii, gap(1.0) - radii)
                } else {
                    (nearest_to_origin(b.from - a.from, b.to - a.to) - radii, (b.to - a.to).norm() - radii)
                };
                clearance_m = clearance_m.min(least);
                if begins(&mut touching, Pair::Robots(a.slot, b.slot), least, at_last) {
                    truth.robot_contacts += 1;
                    truth.contacts[a.slot] += 1;
                    truth.contacts[b.slot] += 1;
                }
            }
        }
        for (index, obstacle) in scenario.obstacles.iter().enumerate() {
            let reference = obstacle.shape.reference();
            let offset = |frame: &Frame| frame.obstacle(index).map_or(Vector2::zeros(), |body| at(body) - reference);
            let (first, last) = (offset(before), offset(after));
            for way in &ways {
                let (least, at_last) = if way.arm.is_some() {
                    let gap = |t| {
                        let offset = first + (last - first) * t;
                        let links = way.bodies(t).map(|[a, b]| [a - offset, b - offset]);
                        let near = links.map(|[a, b]| sweep(&obstacle.shape, a, b).min(depth(&obstacle.shape, a)));
                        near[0].min(near[1])
                    };
                    (least_of(gap) - way.radius_m, gap(1.0) - way.radius_m)
                } else {
                    let (from, to) = (way.from - first, way.to - last);
                    let ends = depth(&obstacle.shape, from).min(depth(&obstacle.shape, to));
                    let at_last = sweep(&obstacle.shape, to, to).min(depth(&obstacle.shape, to)) - way.radius_m;
                    (sweep(&obstacle.shape, from, to).min(ends) - way.radius_m, at_last)
                };
                obstacle_clearance_m = obstacle_clearance_m.min(least);
                if begins(&mut touching, Pair::Obstacle(way.slot, index), least, at_last) {
                    truth.obstacle_contacts += 1;
                    truth.contacts[way.slot] += 1;
                }
            }
        }
    }

    truth.min_clearance_m = Some(clearance_m).filter(|m| m.is_finite());
    truth.min_obstacle_clearance_m = Some(obstacle_clearance_m).filter(|m| m.is_finite());
    let last = frames.last();
    let (mut all, mut latest) = (true, None);
    for (slot, referee) in referees.iter().enumerate() {
        let left = referee.joined.is_some() && last.is_some_and(|frame| frame.robot(slot).is_none());
        match (referee.arrival, referee.joined) {
            (Some((tick, path_m)), Some(joined)) => {
                truth.arrived += 1;
                truth.succeeded += usize::from(truth.contacts[slot] == 0);
                truth.flowtime_s += (tick - joined) as f64 * dt_s;
                truth.paths_m[slot] = path_m;
                latest = latest.max(Some(tick));
            }
            _ => all &= left,
        }
        let ends = if referee.arrival.is_some() { &driven[slot][..driven_until[slot]] } else { &driven[slot][..] };
        truth.reversals[slot] = reversals(ends, 0.01 * referee.robot.radius_m);
    }
    truth.makespan_s = latest.filter(|_| all).map(|tick| tick as f64 * dt_s);
    truth.path_length_m = truth.paths_m.iter().sum();
    truth
}

/// How often a way through these places turns back by more than 90 degrees, looked at in steps of at least this length.
fn reversals(places: &[Point2<f64>], step_m: f64) -> u32 {
    let mut corners: Vec<Point2<f64>> = places.first().copied().into_iter().collect();
    for place in places {
        let away_m = (place - corners[corners.len() - 1]).norm();
        if away_m >= step_m && away_m > 0.0 {
            corners.push(*place);
        }
    }
    let turns_back = |at: &&[Point2<f64>]| {
        (at[1].x - at[0].x) * (at[2].x - at[1].x) + (at[1].y - at[0].y) * (at[2].y - at[1].y) < 0.0
    };
    corners.windows(3).filter(turns_back).count() as u32
}

/// What a robot does in one tick.
struct Way {
    slot: usize,
    from: Point2<f64>,
    to: Point2<f64>,
    radius_m: f64,
    silent: bool,
    arrived: bool,
    arm: Option<Turn>,
}

/// How an arm turns in one tick.
struct Turn {
    base: Point2<f64>,
    links_m: [f64; 2],
    from_rad: [f64; 2],
    to_rad: [f64; 2],
}

impl Way {
    fn new(scenario: &Scenario, before: &Frame, body: &protocol::world_to_observer::FrameBody) -> Way {
        let slot = body.index as usize;
        let (robot, earlier) = (&scenario.robots[slot], before.robot(slot));
        Way {
            slot,
            from: earlier.map_or(robot.start, at),
            to: at(body),
            radius_m: body.radius_m,
            silent: is_silent(body),
            arrived: has_arrived(body),
            arm: robot.arm.map(|arm| Turn {
                base: arm.geometry.base,
                links_m: arm.geometry.links_m,
                from_rad: earlier.map_or(arm.start_joints_rad, |body| body.joints_rad),
                to_rad: body.joints_rad,
            }),
        }
    }

    /// The cores of its bodies at an instant of the tick: of an arm its links, of everybody else twice its centre.
    fn bodies(&self, t: f64) -> [[Point2<f64>; 2]; 2] {
        let Some(Turn { base, links_m: [l1, l2], from_rad, to_rad }) = &self.arm else {
            return [[self.from + (self.to - self.from) * t; 2]; 2];
        };
        let [first, second] = [0, 1].map(|i| from_rad[i] * (1.0 - t) + to_rad[i] * t);
        let elbow = base + Vector2::new(l1 * first.cos(), l1 * first.sin());
        let whole = first + second;
        [[*base, elbow], [elbow, elbow + Vector2::new(l2 * whole.cos(), l2 * whole.sin())]]
    }
}

/// Who may overlap.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Pair {
    Robots(usize, usize),
    Obstacle(usize, usize),
}

/// Whether a pair begins to overlap in this tick; remembers whether it does at its end.
fn begins(touching: &mut HashSet<Pair>, pair: Pair, least: f64, at_last: f64) -> bool {
    let before = touching.contains(&pair);
    if at_last < -TOUCH_M {
        touching.insert(pair);
    } else {
        touching.remove(&pair);
    }
    !before && least < -TOUCH_M
}

/// The least value of a distance at many instants of a tick.
fn least_of(gap: impl Fn(f64) -> f64) -> f64 {
    (0..=INSTANTS).map(|i| gap(f64::from(i) / f64::from(INSTANTS))).fold(f64::INFINITY, f64::min)
}

/// Least distance from the origin of a point that runs evenly from one place to the other: its square is a parabola
/// in time.
fn nearest_to_origin(from: Vector2<f64>, to: Vector2<f64>) -> f64 {
    let way = to - from;
    let (a, b, c) = (way.norm_squared(), 2.0 * from.dot(&way), from.norm_squared());
    let t = if a > 0.0 { (-b / (2.0 * a)).clamp(0.0, 1.0) } else { 0.0 };
    if t == 1.0 { to.norm() } else { (a * t * t + b * t + c).max(0.0).sqrt() }
}

/// Least distance of a moving point to the surface of a shape, as if a polygon had no inside.
fn sweep(shape: &Shape, from: Point2<f64>, to: Point2<f64>) -> f64 {
    match shape {
        Shape::Capsule(capsule) => between_segments(from, to, capsule.a, capsule.b) - capsule.radius,
        Shape::Polygon(corners) => {
            edges(corners).map(|(a, b)| between_segments(from, to, a, b)).fold(f64::INFINITY, f64::min)
        }
    }
}

/// How deep a point is inside a polygon, as a negative number; infinite outside, and for everything else.
fn depth(shape: &Shape, p: Point2<f64>) -> f64 {
    match shape {
        Shape::Polygon(corners) if winding(corners, p) != 0 => -sweep(shape, p, p),
        _ => f64::INFINITY,
    }
}

fn edges(corners: &[Point2<f64>]) -> impl Iterator<Item = (Point2<f64>, Point2<f64>)> {
    (0..corners.len()).map(|i| (corners[i], corners[(i + 1) % corners.len()]))
}

/// How often a closed line runs round a point.
fn winding(corners: &[Point2<f64>], p: Point2<f64>) -> i32 {
    let angle = |(a, b): (Point2<f64>, Point2<f64>)| (a - p).perp(&(b - p)).atan2((a - p).dot(&(b - p)));
    (edges(corners).map(angle).sum::<f64>() / std::f64::consts::TAU).round() as i32
}

/// Ericson 5.1.9: the nearest points of two segments, by clamping one parameter after the other.
fn between_segments(p1: Point2<f64>, q1: Point2<f64>, p2: Point2<f64>, q2: Point2<f64>) -> f64 {
    let (d1, d2, r) = (q1 - p1, q2 - p2, p1 - p2);
    let (a, e, f) = (d1.norm_squared(), d2.norm_squared(), d2.dot(&r));
    let (s, t) = if a == 0.0 && e == 0.0 {
        (0.0, 0.0)
    } else if a == 0.0 {
        (0.0, (f / e).clamp(0.0, 1.0))
    } else {
        let c = d1.dot(&r);
        if e == 0.0 {
            ((-c / a).clamp(0.0, 1.0), 0.0)
        } else {
            let b = d1.dot(&d2);
            let denominator = a * e - b * b;
            // Nearly parallel: any s will do, t makes up for it.
            let s = if denominator > 1e-12 * a * e { ((b * f - c * e) / denominator).clamp(0.0, 1.0) } else { 0.0 };
            let t = (b * s + f) / e;
            if t < 0.0 {
                ((-c / a).clamp(0.0, 1.0), 0.0)
            } else if t > 1.0 {
                (((b - c) / a).clamp(0.0, 1.0), 1.0)
            } else {
                (s, t)
            }
        }
    };
    let best = ((p1 + d1 * s) - (p2 + d2 * t)).norm();
    // Where the way is parallel to a wall, or tiny, the ends are as near as anything between them and more exact.
    [(p1, p2, d2, e), (q1, p2, d2, e), (p2, p1, d1, a), (q2, p1, d1, a)].into_iter().fold(best, |best, (p, o, d, n)| {
        let t = if n > 0.0 { ((p - o).dot(&d) / n).clamp(0.0, 1.0) } else { 0.0 };
        best.min((p - (o + d * t)).norm())
    })
}

/// Goals and arrival of one robot.
struct Referee<'a> {
    robot: &'a Robot,
    current: Goal,
    waiting: VecDeque<Goal>,
    joined: Option<u64>,
    /// The present goal has been reached before.
    done: bool,
    /// The tick, and the path driven until then, m.
    arrival: Option<(u64, f64)>,
}

#[derive(Clone, Copy)]
struct Goal {
    at: Point2<f64>,
    moves: bool,
}

impl Referee<'_> {
    fn new(robot: &Robot) -> Referee<'_> {
        let mut waiting: VecDeque<Goal> = robot.goals.iter().map(|at| Goal { at: *at, moves: false }).collect();
        waiting.back_mut().expect("a robot has a goal").moves = robot.goal_motion.is_some();
        let current = waiting.pop_front().expect("a robot has a goal");
        Referee { robot, current, waiting, joined: None, done: false, arrival: None }
    }

    fn task(&mut self, at: Point2<f64>, now: bool) {
        let goal = Goal { at, moves: false };
        if now {
            self.waiting.clear();
        }
        if now || self.done {
            self.current = goal;
        } else {
            self.waiting.push_back(goal);
        }
        (self.arrival, self.done) = (None, false);
    }

    fn judge(&mut self, [from, to]: [Point2<f64>; 2], tick: u64, dt_s: f64, path_m: f64) {
        let goal_of = |goal: Goal| match (&self.robot.goal_motion, goal.moves) {
            (Some(motion), true) => on_the_way(motion, tick as f64 * dt_s),
            _ => goal.at,
        };
        let tolerance_m = self.robot.goal_tolerance_m;
        if (goal_of(self.current) - to).norm() > tolerance_m && !self.current.moves {
            self.arrival = None;
        }
        let mut here = from;
        while self.arrival.is_none() {
            let goal = goal_of(self.current);
            if self.waiting.is_empty() {
                if (goal - to).norm() <= tolerance_m {
                    (self.arrival, self.done) = (Some((tick, path_m)), true);
                }
                return;
            }
            // On the rest of the way of this tick, from the nearest point to the goal back to where its tolerance begins.
            let (rest, ahead) = (to - here, goal - here);
            let nearest =
                if rest.norm() > 0.0 { (ahead.dot(&rest) / rest.norm_squared()).clamp(0.0, 1.0) } else { 0.0 };
            let distance = |t: f64| (goal - (here + rest * t)).norm();
            if distance(nearest).min(distance(1.0)) > tolerance_m {
                return;
            }
            let (mut outside, mut inside) = (0.0, nearest);
            while distance(0.0) > tolerance_m && inside - outside > 1e-15 {
                let middle = 0.5 * (outside + inside);
                *(if distance(middle) > tolerance_m { &mut outside } else { &mut inside }) = middle;
            }
            here += rest * if distance(0.0) > tolerance_m { inside } else { 0.0 };
            self.current = self.waiting.pop_front().expect("there is one");
        }
    }
}

/// Where a goal that follows waypoints is.
fn on_the_way(motion: &Motion, t_s: f64) -> Point2<f64> {
    let Motion::Waypoints { points, speed_mps, then: AtEnd::Stop } = motion else {
        panic!("no test needs a goal with this motion yet: {motion:?}");
    };
    let mut left_s = t_s;
    for leg in points.windows(2) {
        let lasts_s = (leg[1] - leg[0]).norm() / speed_mps;
        if left_s <= lasts_s {
            return leg[0] + (leg[1] - leg[0]) * (left_s / lasts_s);
        }
        left_s -= lasts_s;
    }
    points[points.len() - 1]
}

/// Whether two numbers agree to rounding: to a billionth, or a thousandth of a nanometre.
pub fn agree(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * a.abs().max(b.abs()) + 1e-12
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::Capsule;

    fn p(x: f64, y: f64) -> Point2<f64> {
        Point2::new(x, y)
    }

    #[test]
    fn segments_by_hand() {
        let check = |a: [Point2<f64>; 2], b: [Point2<f64>; 2], expected: f64| {
            for (a, b) in [(a, b), (b, a), ([a[1], a[0]], b), (a, [b[1], b[0]])] {
                let found = between_segments(a[0], a[1], b[0], b[1]);
                assert!((found - expected).abs() < 1e-12, "{a:?} {b:?}: {found}");
            }
        };
        check([p(0.0, 0.0), p(1.0, 0.0)], [p(0.0, 1.0), p(1.0, 1.0)], 1.0);
        check([p(0.0, 0.0), p(1.0, 0.0)], [p(3.0, 0.0), p(4.0, 0.0)], 2.0);
        check([p(0.0, 0.0), p(2.0, 2.0)], [p(0.0, 2.0), p(2.0, 0.0)], 0.0);
        check([p(0.0, 0.0), p(2.0, 0.0)], [p(1.0, 0.5), p(1.0, 3.0)], 0.5);
        check([p(0.0, 0.0), p(0.0, 0.0)], [p(3.0, 4.0), p(3.0, 4.0)], 5.0);
        check([p(0.0, 0.0), p(0.0, 0.0)], [p(-1.0, 1.0), p(5.0, 1.0)], 1.0);
    }

    #[test]
    fn a_passing_point_is_nearest_between_its_ends() {
        assert_eq!(nearest_to_origin(Vector2::new(-1.0, 0.5), Vector2::new(1.0, 0.5)), 0.5);
        assert_eq!(nearest_to_origin(Vector2::new(1.0, 0.0), Vector2::new(2.0, 0.0)), 1.0);
        assert_eq!(nearest_to_origin(Vector2::new(3.0, 4.0), Vector2::new(3.0, 4.0)), 5.0);
    }

    #[test]
    fn only_polygons_have_an_inside() {
        let square = Shape::Polygon(vec![p(0.0, 0.0), p(0.0, 2.0), p(2.0, 2.0), p(2.0, 0.0)]);
        assert_eq!(depth(&square, p(1.0, 0.5)), -0.5);
        assert_eq!(depth(&square, p(3.0, 0.5)), f64::INFINITY);
        assert_eq!(depth(&Shape::Capsule(Capsule::disc(p(0.0, 0.0), 1.0)), p(0.0, 0.0)), f64::INFINITY);
    }
}
