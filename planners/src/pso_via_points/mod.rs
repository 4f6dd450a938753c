//! Via points of a potential-field path, moved by a particle swarm, joined by a spline: a planned path and a follower.
//!
//! F. A. Raheem, M. M. Badr, "Smoothed artificial potential field (APF) via points path planning algorithm based on
//! PSO", Al-Yarmouk journal, about 2017. For a point and for the tip of a planar two-link arm.
//!
//! | paper             | here                        | unit | default     | larger means                             |
//! |-------------------|-----------------------------|------|-------------|------------------------------------------|
//! | K_a               | `k_att`                     |      | 1           | straighter raw path                      |
//! | K_rep             | `k_rep`                     |      | 0.5 (0.2)   | wider raw path                           |
//! | d₀                | `influence`                 | m    | 1 (0.5)     | raw path turns away sooner               |
//! | n                 | `goal_power`                |      | 0           | weaker repulsion near the goal           |
//! | (-0.75, +0.5)     | `bias_x`, `bias_y`          |      | -0.75, 0.5  | last variant turns aside more            |
//! |                   | `bias_fade`                 | m    | 1           | bias fades further from the goal         |
//! | step              | `step`, `steps_max`         | m    | 0.05, 2000  | coarser, longer raw path                 |
//! | via points        | `via_points`                |      | 3 (5)       | more bends, slower to settle             |
//! | particles         | `particles`, `iterations`   |      | 40 (60), 200| better path, later                       |
//! | w, c1, c2         | `w`, `c1`, `c2`             |      | 0.7298, 1.4962 | more exploration; more pull           |
//! | velocity clamp    | `clamp`                     |      | 0.1 (0.05)  | particles move further at once           |
//! | search box        | `box_margin`                | m    | 1           | wider detours are found                  |
//! | samples           | `samples`                   |      | 200         | finer cost, slower                       |
//! | (none)            | `margin`, `penalty`         | m    | 0.1 (0.05), 100 (10) | keeps further away; more strictly |
//! |                   | `jitter`                    | m    | 0.1         | swarm starts wider                       |
//! |                   | `patience`, `gain`          |      | 50, 1 mm    | keeps trying longer; settles sooner      |
//! |                   | `look_ahead`                | m    | 0.2         | smoother, cuts corners                   |
//! |                   | `robot_gain`, `robot_range` |      | 0.1, 1 m    | wider around moving robots; sooner       |
//! |                   | `robot_turn`                |      | 1           | passes robots on the right sooner        |
//! |                   | `every_variant`, `grid`     | m    | true (false), 0.1 | tries more; coarser                |
//! |                   | `blocked`                   | s    | 2           | more patient before planning again       |
//! |                   | `heading_gain`              | 1/s  | 3           | a unicycle turns sharper                 |
//! |                   | `evaluations`               |      | 200000 (300000) | plans in fewer, longer ticks         |
//!
//! Values in parentheses are the presets of an arm. Symbols without a value in the paper have ours.
//!
//! Differs from the paper:
//! - (24) has the squares that its print lacks; the force is the whole gradient of (4), not (5), which lacks a term.
//! - The cost has a term for coming too near, without which the shortest spline is the straight line.
//! - The bias fades near the goal and comes last: plain field, (17, 18), (15, 16), faded bias. The swarm works on every
//!   variant that arrives; another variant must be clearly shorter.
//! - Distances are between surfaces; the spline is natural, over the length of its chords.
//! - An arm plans in the sheet it is in, and its joints never pass their stops. Where no raw path can be executed in that
//!   sheet, the base is the shortest path on the grid of the sheet's free space. An arm without a path stays put.
//! - For a body in the plane the base is the straight line where no raw path arrives, in ever wider boxes. That also
//!   reaches goals close to an obstacle, for which the specification would take n = 2: on the environments of all papers
//!   n = 2 made detours of it.
//!
//! In a running fleet: the plan is made in pieces, at most `evaluations` distance computations a tick (overdrawn by at
//! most one particle, or one check of a path). Until there is a path, a robot follows the field itself. Afterwards it
//! drives towards a point `look_ahead` further along the path, away from what is nearer than `margin`, and under the
//! push of other robots (the robot term of [`decentralized_apf`], partly turned as in (17) and
//! (18), so that robots that meet both give way to the right) and of whatever else moves. It plans again when something
//! new stands in its way, when it was pushed far off or made no progress for `blocked` (then slow robots count as
//! discs), and when the goal moved.
//!
//! Map of the folder: [`field`] the forces and the raw path; [`swarm`] the swarm; [`terrain`] what a path must keep
//! clear of; [`planning`] the plan in pieces; [`follow`] the follower; here the method, as a robot runs it.

pub mod field;
pub mod follow;
mod params;
pub mod planning;
pub mod swarm;
pub mod terrain;
mod watch;

pub use params::Params;

use crate::decentralized_apf::{self, DecentralizedApf};
use crate::method::{Identity, Length, Method, Symmetry, any_speed};
use crate::params::ParamError;
use crate::planner::{Plan, PlanInput, Planner, nearest_by_id};
use crate::steering::steer_to_goal;
use field::{Bodies, Variant};
use follow::Follower;
use geometry::ArmState;
use geometry::arm::Room;
use model::random::Stream;
use model::{BodyKind, Drive, ParamValues, PlanState};
use nalgebra::{Point2, Vector2};
use planning::{Planning, Query};
use terrain::{Plane, Sheet, Terrain};
use watch::Watch;

/// Registry entry.
pub static METHOD: Method = Method {
    name: "pso-via-points",
    summary: "potential-field path, smoothed and shortened by a particle swarm, then followed",
    source: "Raheem and Badr 2017, Al-Yarmouk journal",
    // The box and the bias have fixed directions.
    symmetry: Symmetry { rotation: false, translation: true, reflection: false, neighbor_order: true },
    kinds: BodyKind::ALL,
    params: Params::specs,
    speed_mps: any_speed,
    lengths: &[
        Length::of("influence", 1),
        Length::of("step", 1),
        Length::of("bias_fade", 1),
        Length::of("box_margin", 1),
        Length::of("margin", 1),
        Length::of("jitter", 1),
        Length::of("look_ahead", 1),
        Length::of("robot_gain", 3),
        Length::of("robot_range", 1),
    ],
    wants_filter: false,
    follows_ways: false,
    build,
};

/// Points at which the way to another path is looked at.
const JOIN_POINTS: usize = 11;
/// Nearer than this to the goal of the raw path counts as there, m.
const RAW_TOLERANCE_M: f64 = 0.1;

/// The method at work for one robot.
pub struct PsoViaPoints {
    in_plane: Params,
    as_arm: Params,
    stream: Stream,
    robots: DecentralizedApf,
    planning: Planning,
    /// The version of the plan that was last looked at.
    seen_version: u64,
    path: Follower,
    /// A better path being tried on.
    next: Follower,
    watch: Watch,
    /// What is being planned for.
    asked: Option<Asked>,
    /// Kind that memory was taken for.
    prepared: Option<bool>,
}

/// What the plan in the making, or the last one, was asked for.
#[derive(Clone, Copy, Debug)]
struct Asked {
    start: Point2<f64>,
    goal: Point2<f64>,
    arm: Option<ArmState>,
}

fn build(values: &ParamValues, identity: Identity) -> Result<Box<dyn Planner>, ParamError> {
    let in_plane = Params::from_values(values)?;
    Ok(Box::new(PsoViaPoints::new(in_plane, Params::arm().with(values), identity)))
}

impl PsoViaPoints {
    /// The method with these parameters for a body in the plane and for an arm, for this robot.
    pub fn new(in_plane: Params, as_arm: Params, identity: Identity) -> PsoViaPoints {
        let Params { robot_gain: eta, robot_range: p_r, .. } = in_plane;
        let robots = decentralized_apf::Params { eta, p_r, ..decentralized_apf::Params::default() };
        PsoViaPoints {
            in_plane,
            as_arm,
            stream: Stream::new(identity.seed, identity.robot, identity.incarnation, "pso"),
            robots: DecentralizedApf::new(robots, identity),
            planning: Planning::default(),
            seen_version: 0,
            path: Follower::default(),
            next: Follower::default(),
            watch: Watch::default(),
            asked: None,
            prepared: None,
        }
    }

    /// The path being followed: what is left of it, from the point before the robot.
    pub fn path(&self) -> &[Point2<f64>] {
        self.path.rest()
    }

    /// Whether a plan is in the making.
    pub fn busy(&self) -> bool {
        self.planning.busy()
    }

    fn params(&self, kind: BodyKind) -> &Params {
        if kind == BodyKind::TwoLinkArm { &self.as_arm } else { &self.in_plane }
    }

    /// Memory for all that comes, taken once.
    fn prepare(&mut self, input: &PlanInput<'_>) {
        let is_arm = input.kind == BodyKind::TwoLinkArm;
        if self.prepared == Some(is_arm) {
            return;
        }
        self.prepared = Some(is_arm);
        let recipe = self.params(input.kind).recipe(RAW_TOLERANCE_M);
        self.planning.reserve(&recipe);
        let points = (recipe.walk.steps_max + 2).max(swarm::FINER * recipe.swarm.samples.max(2));
        self.path.reserve(points);
        self.next.reserve(points);
        self.watch.reserve(input);
    }

    /// Starts a plan from here, with what is known now.
    fn begin(&mut self, input: &PlanInput<'_>) {
        self.watch.begin(input);
        let asked = Asked { start: input.position, goal: input.goal, arm: input.arm };
        self.asked = Some(asked);
        self.planning.begin(&query(&asked, &self.watch, input));
        self.seen_version = self.planning.version();
    }

    /// Goes on with the plan, and changes to its path when that is better than the present one.
    fn work(&mut self, input: &PlanInput<'_>) {
        let Some(asked) = self.asked else { return };
        let params = if input.kind == BodyKind::TwoLinkArm { &self.as_arm } else { &self.in_plane };
        let (recipe, mut budget) = (params.recipe(RAW_TOLERANCE_M), i64::from(params.evaluations));
        let query = query(&asked, &self.watch, input);
        self.planning.advance(&recipe, &query, &mut self.stream, &mut budget);
        if self.planning.version() == self.seen_version {
            return;
        }
        self.seen_version = self.planning.version();
        let Some((path, _)) = self.planning.best() else { return };
        self.next.take(path, input.position);
        let ahead = self.next.ahead(params.look_ahead).unwrap_or(input.position);
        let gap_m = self.next.ahead(0.0).map_or(0.0, |on| (on - input.position).norm());
        let shorter = self.next.remaining_m() + gap_m < self.path.remaining_m();
        let wanted = shorter || !self.path.has_path() || self.path.end() != self.next.end();
        // What lies between the robot and the path it would change to.
        let join = std::array::from_fn::<_, JOIN_POINTS, _>(|i| {
            input.position + (i as f64 / (JOIN_POINTS - 1) as f64) * (ahead - input.position)
        });
        let free = match input.arm {
            Some(arm) => {
                let elbow = asked.arm.map_or(arm.elbow(), |asked| asked.elbow());
                let (geometry, obstacles, room) = (&arm.geometry, self.watch.solid(), Room::default());
                let joint1_rad = Some(arm.joints_rad[0]);
                let sheet = Sheet { geometry, elbow, obstacles, room, penalty: 0.0, joint1_rad };
                sheet.passes(&join)
            }
            None => {
                let (obstacles, radius_m) = (self.watch.solid(), input.radius_m);
                let plane = Plane { obstacles, radius_m, margin_m: params.margin, penalty: 0.0 };
                plane.passes(&join) && self.watch.still_free(self.next.rest(), input, params.margin)
            }
        };
        if wanted && free {
            std::mem::swap(&mut self.path, &mut self.next);
            self.watch.took_path(input, self.path.at_m());
        }
    }

    /// What the robot would do alone: along the path, or along the field until there is one.
    fn alone(&self, input: &PlanInput<'_>) -> Vector2<f64> {
        let to_goal = input.goal - input.position;
        let speed_max = input.limits.speed_mps_max;
        // A point that is nearer than what the body drives in a tick would be driven past.
        let look_ahead_m = self.in_plane.look_ahead.max(speed_max * input.dt_s);
        if let Some(ahead) = self.path.ahead(look_ahead_m) {
            let last = self.path.remaining_m() <= look_ahead_m;
            let along = if last { to_goal } else { ahead - input.position };
            // The last tick ends on the goal, not beyond it.
            let speed = if last { speed_max.min(to_goal.norm() / input.dt_s) } else { speed_max };
            return along.try_normalize(0.0).unwrap_or_default() * speed;
        }
        let variant = self.planning.arrived().unwrap_or(Variant::Plain);
        let bodies = Bodies { obstacles: self.watch.solid(), ring: None, radius_m: input.radius_m };
        let field = self.in_plane.recipe(RAW_TOLERANCE_M).field;
        field.force(variant, input.position, input.goal, &bodies).cap_magnitude(speed_max)
    }

    /// Away from robots and moving things within `robot_range`, and from everything else within `margin`.
    fn pushes(&self, input: &PlanInput<'_>) -> Vector2<f64> {
        let mut push = Vector2::zeros();
        for obstacle in nearest_by_id(input.obstacles, input.position) {
            push += match watch::as_robot(&obstacle, input.position) {
                Some(robot) => self.robots.neighbor_push(&robot, input),
                None => self.wall_push(&obstacle.shape, input),
            };
        }
        for neighbor in input.neighbors {
            push += match self.watch.parked(neighbor) {
                Some(disc) => self.wall_push(&disc, input),
                None => self.passing(self.robots.neighbor_push(neighbor, input)),
            };
        }
        push
    }

    /// The push of a moving robot, and a part of it turned by +90 degrees as in (17), (18): two robots that meet both
    /// give way to their right.
    fn passing(&self, push: Vector2<f64>) -> Vector2<f64> {
        push + self.in_plane.robot_turn * Vector2::new(-push.y, push.x)
    }

    /// From 0 at `margin` (or half the clearance that the goal itself has) to twice the speed limit in contact: a robot
    /// that was pushed aside keeps off the wall.
    fn wall_push(&self, shape: &geometry::Capsule, input: &PlanInput<'_>) -> Vector2<f64> {
        let goal_clearance = shape.distance(input.goal) - input.radius_m;
        let margin = self.in_plane.margin.min(0.5 * goal_clearance.max(0.0));
        let (distance, away) = field::surface(shape, input.position);
        let clearance = distance - input.radius_m;
        if clearance >= margin {
            return Vector2::zeros();
        }
        let depth = if clearance > 0.0 { 1.0 - clearance / margin } else { 1.0 };
        2.0 * input.limits.speed_mps_max * depth * away
    }

    /// Joint rates along the path, in the sheet it was planned in; a stop where the next pose is not free.
    fn joints(&mut self, input: &PlanInput<'_>) -> Drive {
        let stop = Drive::stop(BodyKind::TwoLinkArm);
        let (Some(arm), Some(Asked { arm: Some(asked), .. })) = (input.arm, self.asked) else { return stop };
        let reach_m = self.as_arm.look_ahead.min(input.limits.speed_mps_max * input.dt_s);
        let Some(ahead) = self.path.ahead(reach_m) else { return stop };
        let room = Room::default();
        let (geometry, elbow, obstacles) = (&arm.geometry, asked.elbow(), self.watch.solid());
        let sheet = Sheet { geometry, elbow, obstacles, room, penalty: 0.0, joint1_rad: None };
        let Some(pose) = sheet.pose(ahead, room) else {
            self.watch.give_up();
            return stop;
        };
        let pose = geometry.nearest_in_range(pose, arm.joints_rad[0]);
        let drive = Drive::of_arm(&arm, arm.rates_to(pose, input.dt_s), &input.limits);
        let Drive::Joints { rate_radps } = drive else { return stop };
        let then = arm.moved(rate_radps, input.dt_s);
        let clearance = |joints| geometry.clearance(joints, watch::moving_bodies(input));
        // Away from what came too near is always allowed.
        let near = clearance(then.joints_rad);
        if near < self.as_arm.margin && near <= clearance(arm.joints_rad) { stop } else { drive }
    }
}

fn query<'a>(asked: &Asked, watch: &'a Watch, input: &PlanInput<'_>) -> Query<'a> {
    let Asked { start, goal, arm } = *asked;
    Query { start, goal, obstacles: watch.solid(), radius_m: input.radius_m, arm }
}

impl Planner for PsoViaPoints {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        let stay = Plan { stopped: true, ..Plan::only(Drive::stop(input.kind)) };
        let is_arm = input.kind == BodyKind::TwoLinkArm;
        if input.arrived || (is_arm && input.arm.is_none()) {
            return stay;
        }
        self.prepare(input);
        self.path.advance(input.position);
        self.watch.look(input, &self.path, self.params(input.kind).margin);
        let asked = self.asked.map(|asked| asked.goal);
        match self.watch.decide(input, &self.path, asked, self.planning.busy(), self.params(input.kind).blocked) {
            watch::Decision::GoOn => {}
            watch::Decision::PlanAgain => self.begin(input),
            watch::Decision::DropPath => {
                self.path.clear();
                self.begin(input);
            }
        }
        self.work(input);
        let state = match (self.path.has_path(), self.planning.busy()) {
            (true, _) => PlanState::Ready,
            (false, true) => PlanState::Planning,
            (false, false) => PlanState::GaveUp,
        };
        if (input.goal - input.position).norm() <= input.goal_tolerance_m {
            return stay;
        }
        if is_arm {
            let drive = self.joints(input);
            return Plan { stopped: drive == stay.drive, state, ..Plan::only(drive) };
        }
        let (attractive, repulsive) = (self.alone(input), self.pushes(input));
        let velocity = (attractive + repulsive).cap_magnitude(input.limits.speed_mps_max);
        let drive = match input.kind {
            BodyKind::Unicycle | BodyKind::DiffDrive => steer_to_goal(velocity, self.in_plane.heading_gain, input),
            BodyKind::Point | BodyKind::TwoLinkArm => Drive::Velocity(velocity),
        };
        Plan { attractive, repulsive, state, ..Plan::only(drive) }
    }
}
