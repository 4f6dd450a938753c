//! What a method is given and what it answers.

use geometry::{ArmState, Capsule, HalfPlane, Map};
use model::{BodyKind, Drive, Limits, PlanState, Wheels};
use nalgebra::{Point2, Vector2};

/// Everything a method may look at in one tick. All of it is in the world frame.
#[derive(Clone, Copy, Debug)]
pub struct PlanInput<'a> {
    /// The tick being planned, counted from the start of the run.
    pub tick: u64,
    /// Length of a tick, s.
    pub dt_s: f64,
    /// Own position, m; of an arm, that of its tip.
    pub position: Point2<f64>,
    /// Own heading, rad. A point robot keeps the heading it started with.
    pub yaw_rad: f64,
    /// Own velocity in the world frame, m/s.
    pub velocity: Vector2<f64>,
    /// Own turn rate, rad/s; of an arm, that of its last link.
    pub turn_radps: f64,
    /// Own body radius, m.
    pub radius_m: f64,
    /// How the body moves.
    pub kind: BodyKind,
    /// What the body can do.
    pub limits: Limits,
    /// Where the robot heads now, m.
    pub goal: Point2<f64>,
    /// The goal counts as reached within this distance, m.
    pub goal_tolerance_m: f64,
    /// The heading that the robot is to have at its goal, rad; `None` is any. The body turns to it by itself once it is
    /// there, see [`Chassis`](crate::Chassis): a method need not look at this.
    pub goal_yaw_rad: Option<f64>,
    /// That heading counts as reached within this angle, rad.
    pub goal_yaw_tolerance_rad: f64,
    /// The goal is the last one and has been reached: what is planned from here on is how to stay.
    pub arrived: bool,
    /// What the sensors see within range: fixed and moving obstacles, and the bodies of robots that are not heard. Sorted by [`Obstacle::id`]; the edges of one polygon share an id and stand together.
    pub obstacles: &'a [Obstacle],
    /// The robots heard on the radio, sorted by [`Neighbor::id`].
    pub neighbors: &'a [Neighbor],
    /// The fixed obstacles of the whole world, for methods that plan on a map. Sorted like `obstacles`. The walls of a map are
    /// among them if all together are at most [`MAX_SHAPES`](model::MAX_SHAPES).
    pub map: &'a [Obstacle],
    /// The walls of the map of the scenario, however many, if it has one and the robot knows it. Those in sensor range are among
    /// `obstacles` as well.
    pub walls: Option<&'a Map>,
    /// Own joints and build, if the body is an arm (`BodyKind::TwoLinkArm`).
    pub arm: Option<ArmState>,
    /// Own wheels, if the body has them (`BodyKind::DiffDrive`): such a body also understands [`Drive::Wheels`].
    pub wheels: Option<Wheels>,
    /// The velocities that the [filter](crate::filter) behind the method allows; empty without one. A method need not look at them,
    /// but what it plans outside them is changed. Standing still is always allowed.
    pub allowed: &'a [HalfPlane],
}

/// Ids from here on are those of walls of a map: this, and the index of the wall. Obstacles and robots have smaller ones.
pub const FIRST_WALL: u32 = 1 << 16;
/// Of the walls of a map that a robot senses, `obstacles` holds at most this many: the nearest.
pub const SENSED_WALLS_MAX: usize = 256;

/// A piece of an obstacle: a disc, a wall, or an edge of a polygon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Obstacle {
    /// Names the obstacle; the edges of a polygon share it.
    pub id: u32,
    /// Its shape where it is now.
    pub shape: Capsule,
    /// Its velocity, m/s; zero for what stands still.
    pub velocity: Vector2<f64>,
}

impl Obstacle {
    /// A wall of a map.
    pub fn wall(index: u32, shape: Capsule) -> Obstacle {
        Obstacle { id: FIRST_WALL + index, shape, velocity: Vector2::zeros() }
    }

    /// Whether it is a wall of a map.
    pub fn is_wall(&self) -> bool {
        self.id >= FIRST_WALL
    }
}

/// Of every obstacle the piece nearest to `position`: one obstacle, one push. Relies on the pieces of an obstacle
/// standing together. The inside of a polygon is solid: for a position in it the answer is a disc that reaches to its
/// nearest edge, so that the distance is negative and the way out leads over that edge.
pub fn nearest_by_id(obstacles: &[Obstacle], position: Point2<f64>) -> impl Iterator<Item = Obstacle> + Clone {
    obstacles.chunk_by(|a, b| a.id == b.id).filter_map(move |pieces| match pieces {
        // Most obstacles are discs: no distance to compute.
        [only] => Some(*only),
        _ => {
            let nearest = nearest(pieces, position)?;
            Some(Obstacle { shape: solid(pieces, position).unwrap_or(nearest.shape), ..*nearest })
        }
    })
}

fn nearest(pieces: &[Obstacle], position: Point2<f64>) -> Option<&Obstacle> {
    pieces.iter().min_by(|a, b| a.shape.distance(position).total_cmp(&b.shape.distance(position)))
}

/// If these pieces are the edges of a polygon with `position` inside: a disc around a place behind the position that reaches
/// to the nearest edge. None for a position on the edge.
pub fn solid(pieces: &[Obstacle], position: Point2<f64>) -> Option<Capsule> {
    /// The disc must not become a point.
    const BEHIND_M_MIN: f64 = 1e-3;
    if pieces.len() < 3 || !encloses(pieces, position) {
        return None;
    }
    let out = nearest(pieces, position)?.shape.nearest_core(position) - position;
    let (depth, direction) = (out.norm(), out.try_normalize(1e-12)?);
    let behind = depth.max(BEHIND_M_MIN);
    Some(Capsule::disc(position - direction * behind, behind + depth))
}

/// Whether the edges of a polygon run round a point (even-odd rule). Only some edges, as when not all are in sight, enclose
/// nothing: every corner has to be the end of one edge and the beginning of another.
fn encloses(edges: &[Obstacle], p: Point2<f64>) -> bool {
    let crosses = |edge: &&Obstacle| {
        let (a, b) = (edge.shape.a, edge.shape.b);
        (a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x
    };
    let word = |corner: Point2<f64>| {
        let mixed = corner.x.to_bits().wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ corner.y.to_bits().rotate_left(32);
        mixed.wrapping_mul(0xff51_afd7_ed55_8ccd) ^ mixed >> 29
    };
    let balance = |sum: u64, edge: &Obstacle| sum.wrapping_add(word(edge.shape.a)).wrapping_sub(word(edge.shape.b));
    edges.iter().filter(crosses).count() % 2 == 1 && edges.iter().fold(0, balance) == 0
}

/// Another robot, as its own latest message describes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbor {
    /// Names the robot for the length of a run: its slot.
    pub id: u32,
    /// Its position when it spoke, m.
    pub position: Point2<f64>,
    /// Its heading when it spoke, rad.
    pub yaw_rad: f64,
    /// Its velocity when it spoke, m/s.
    pub velocity: Vector2<f64>,
    /// Its body radius, m.
    pub radius_m: f64,
    /// How old that message is, s.
    pub age_s: f64,
    /// Distance it still has to its goal, m: the scalar behind right of way.
    pub remaining_m: f64,
    /// It has reached its last goal.
    pub arrived: bool,
    /// It stands still on purpose.
    pub stopped: bool,
    /// Where the command that it gave when it spoke takes it within a tick, m: in kinematic worlds, if its message is one
    /// tick old, exactly where it is now. `None`: it does not say, or its body does not go where it is asked to.
    pub next: Option<Point2<f64>>,
    /// What it intends, if its method says so.
    pub intent: Option<Intent>,
}

impl Neighbor {
    /// Where the robot is now, m, and the velocity with which it came there, m/s. If its message is one tick old and says where
    /// its command took it (`true`), both are its own word; otherwise it is taken to go on as it was last heard.
    pub fn now(&self, dt_s: f64) -> (Point2<f64>, Vector2<f64>, bool) {
        /// A message that is not older than this many ticks is of the tick before.
        const FRESH_TICKS: f64 = 1.5;
        match self.next.filter(|_| self.age_s > 0.0 && self.age_s <= FRESH_TICKS * dt_s) {
            Some(next) => (next, (next - self.position) / dt_s, true),
            None => (self.position + self.velocity * self.age_s, self.velocity, false),
        }
    }
}

/// What a method tells other robots of what it is about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intent {
    /// The velocity that the robot would have if it were alone, m/s.
    pub wish: Vector2<f64>,
    /// Length of the way to its goal that is left, m.
    pub left_m: f64,
    /// Of two that are stuck in each other's way, the one with the greater rank goes first. It is constant on the way to a goal, and
    /// below 0 once the robot has been there.
    pub rank: f64,
    /// The next corner of its way; `None` if the goal comes next, m.
    pub corner: Option<Point2<f64>>,
    /// The share of its speed that it has lost lately, 0 to 1.
    pub slow: f32,
    /// The share of its headway that it has lost lately, 0 for one that gets on as it wishes, 2 for one that is driven back.
    pub lag: f32,
    /// It makes room for one that has way, and may have to go back.
    pub yields: bool,
}

/// What a method answers. The two terms travel along so that a log explains itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// What the body should do during the tick, before limits and filters.
    pub drive: Drive,
    /// The part that pulls to the goal, in the method's own unit.
    pub attractive: Vector2<f64>,
    /// The part that pushes away from things, in the method's own unit.
    pub repulsive: Vector2<f64>,
    /// The robot stands still on purpose: told to the others, see [`Neighbor::stopped`].
    pub stopped: bool,
    /// Whether the method has a plan at all.
    pub state: PlanState,
    /// What is told to the others beside the pose.
    pub intent: Option<Intent>,
}

impl Plan {
    /// A plan without field terms, of a robot on its way.
    pub fn only(drive: Drive) -> Plan {
        Plan {
            drive,
            attractive: Vector2::zeros(),
            repulsive: Vector2::zeros(),
            stopped: false,
            state: PlanState::Ready,
            intent: None,
        }
    }
}

/// A method at work for one robot.
pub trait Planner: Send {
    /// Plans one tick. The answer is finite for every finite input within a million metres, whatever overlaps
    /// whatever; it has the form that the kind of body understands. Planning does not allocate.
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan;
}

impl<P: Planner + ?Sized> Planner for Box<P> {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        (**self).plan(input)
    }
}
