//! A plan in the making, in pieces: raw paths of the force variants in their order, a swarm on each that arrives, and
//! what remains when none does.

use super::field::{Bodies, Field, RawPath, Variant, Walk};
use super::swarm::{Settings, Swarm};
use super::terrain::{POSE_COST, Plane, Sheet, Terrain};
use crate::planner::Obstacle;
use geometry::arm::{Found, FreeSpace, GridSearch, Room, Through};
use geometry::spline::length;
use geometry::{ArmGeometry, ArmState, Capsule};
use model::random::Stream;
use nalgebra::Point2;

/// Points of the straight base line that is taken when no force variant arrives.
const LINE_POINTS: usize = 50;
/// The swarm on it is tried in boxes widened 1, 2, 4, 8 times.
const WIDENED_MAX: u32 = 4;
/// Distance computations that one grid point of the arm's free space stands for, without obstacles: two poses. One
/// settled point of the search counts as much.
const GRID_POINT_COST: i64 = 2 * POSE_COST as i64;

/// All that a plan is made with.
#[derive(Clone, Debug)]
pub struct Recipe {
    /// The field of the raw path.
    pub field: Field,
    /// Steps of the raw path.
    pub walk: Walk,
    /// The swarm.
    pub swarm: Settings,
    /// Clearance wanted, m.
    pub margin_m: f64,
    /// What missing clearance costs: per metre, sample and obstacle; for an arm, per sample that is not free.
    pub penalty: f64,
    /// Margin of an arm's joint 2 in the swarm, rad.
    pub joint2_margin_rad: f64,
    /// Spacing of the grid of an arm's free space, m.
    pub grid_m: f64,
    /// Go on with the other variants after the first that arrived, and keep the shortest path.
    pub every_variant: bool,
    /// Where no variant gives a path: go on with a swarm on the straight line, or for an arm with the shortest path on
    /// the grid. Not in the paper.
    pub fallback: bool,
}

/// What is planned for.
#[derive(Clone, Copy, Debug)]
pub struct Query<'a> {
    /// From where.
    pub start: Point2<f64>,
    /// To where.
    pub goal: Point2<f64>,
    /// Obstacles, pieces of one obstacle together.
    pub obstacles: &'a [Obstacle],
    /// Robot's radius, m.
    pub radius_m: f64,
    /// The arm, if it is one that plans; its sheet is the one it plans in.
    pub arm: Option<ArmState>,
}

/// What a finished path came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The swarm, on this variant's raw path.
    Swarm(Variant),
    /// The raw path of this variant, because the swarm's path was rejected.
    Raw(Variant),
    /// The swarm on the straight line or on the grid path.
    SwarmFallback,
    /// The grid path of an arm.
    Grid,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Stage {
    #[default]
    Idle,
    /// Walking the raw path of a variant, by its place in the order.
    Walk(usize),
    /// Swarm on the raw path of a variant, or on the fallback.
    Swarm(Option<usize>),
    /// Free space of an arm.
    Grid,
    /// Shortest path in it.
    Search,
}

/// A plan in the making.
#[derive(Debug, Default)]
pub struct Planning {
    stage: Stage,
    raw: RawPath,
    /// The first variant that arrived.
    arrived: Option<Variant>,
    swarm: Swarm,
    /// The best path so far, where it came from, and its length, m.
    best: Vec<Point2<f64>>,
    best_from: Option<(Origin, f64)>,
    /// Counts the paths that were better than the ones before.
    version: u64,
    /// How often the box of the straight line was widened.
    widened: u32,
    /// Best cost of the swarm when it was last looked at for a first path.
    looked_at: f64,
    grid: FreeSpace,
    search: GridSearch,
    shapes: Vec<Capsule>,
}

impl Planning {
    /// Takes all memory that a plan will need; an arm needs more at its first plan.
    pub fn reserve(&mut self, recipe: &Recipe) {
        let points = (recipe.walk.steps_max + 2).max(super::swarm::FINER * recipe.swarm.samples.max(2));
        self.raw.points.reserve(points);
        self.best.reserve(points);
        self.swarm.reserve(&recipe.swarm);
    }

    /// Starts a plan; whatever was in the making is dropped.
    pub fn begin(&mut self, query: &Query<'_>) {
        self.version += 1;
        self.best.clear();
        (self.best_from, self.arrived) = (None, None);
        self.walk(0, query);
    }

    /// Whether a plan is in the making.
    pub fn busy(&self) -> bool {
        self.stage != Stage::Idle
    }

    /// The best path so far.
    pub fn best(&self) -> Option<(&[Point2<f64>], Origin)> {
        self.best_from.map(|(origin, _)| (self.best.as_slice(), origin))
    }

    /// Grows whenever [`Planning::best`] has changed.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// The first force variant whose raw path arrived.
    pub fn arrived(&self) -> Option<Variant> {
        self.arrived
    }

    /// The swarm at work, or the last one.
    pub fn swarm(&mut self) -> &mut Swarm {
        &mut self.swarm
    }

    /// Works until `budget` distance computations are spent (overdrawn by at most one raw path, one particle or one
    /// check of a path) or the plan is done. The query must be the same until then.
    pub fn advance(&mut self, recipe: &Recipe, query: &Query<'_>, stream: &mut Stream, budget: &mut i64) {
        if query.arm.is_some() {
            self.shapes.clear();
            self.shapes.extend(query.obstacles.iter().map(|obstacle| obstacle.shape));
        }
        while self.busy() && *budget > 0 {
            match self.stage {
                Stage::Idle => {}
                Stage::Walk(order) => self.advance_walk(order, recipe, query, stream, budget),
                Stage::Swarm(order) => {
                    // The two kinds of terrain are two types, so that the loops over samples know theirs.
                    let plane = plane(recipe, query);
                    match query.arm {
                        Some(arm) => {
                            let sheet = sheet(recipe, query, &arm);
                            self.advance_swarm(order, &sheet, recipe, query, stream, budget);
                        }
                        None => self.advance_swarm(order, &plane, recipe, query, stream, budget),
                    }
                }
                Stage::Grid | Stage::Search => match query.arm {
                    Some(arm) => self.advance_grid(&arm, recipe, query, stream, budget),
                    None => self.stage = Stage::Idle,
                },
            }
        }
    }

    fn walk(&mut self, order: usize, query: &Query<'_>) {
        self.stage = Stage::Walk(order);
        self.raw.begin(query.start);
    }

    fn advance_walk(
        &mut self,
        order: usize,
        recipe: &Recipe,
        query: &Query<'_>,
        stream: &mut Stream,
        budget: &mut i64,
    ) {
        let variant = Variant::ORDER[order];
        let ring = query.arm.map(|arm| (arm.geometry.base, arm.geometry.reach().0, arm.geometry.reach().1));
        let bodies = Bodies { obstacles: query.obstacles, ring, radius_m: query.radius_m };
        let cost = bodies.evaluations() as i64;
        let steps = (*budget / cost).max(1);
        let before = self.raw.points.len();
        // A path across a wide world has longer steps, so that it can arrive at all.
        let step_m = recipe.walk.step_m.max(3.0 * (query.goal - query.start).norm() / recipe.walk.steps_max as f64);
        let walk = Walk { step_m, tolerance_m: recipe.walk.tolerance_m.max(step_m), ..recipe.walk };
        let force = |q| recipe.field.force(variant, q, query.goal, &bodies);
        let ended = self.raw.advance(force, query.goal, &walk, steps as usize);
        *budget -= cost * (self.raw.points.len() - before + 1) as i64;
        if !ended {
            return;
        }
        // What an arm cannot do in its sheet is not worth a swarm: via points do not move to the other side of the base.
        let possible = query.arm.is_none_or(|arm| sheet(recipe, query, &arm).passes(&self.raw.points));
        if self.raw.arrived {
            self.arrived.get_or_insert(variant);
        }
        if self.raw.arrived && possible {
            self.begin_swarm(Some(order), &recipe.swarm, stream);
        } else {
            self.next_variant(order, recipe, query, stream);
        }
    }

    fn begin_swarm(&mut self, order: Option<usize>, settings: &Settings, stream: &mut Stream) {
        self.swarm.begin(settings, &self.raw.points, stream);
        self.looked_at = f64::INFINITY;
        self.stage = Stage::Swarm(order);
    }

    fn advance_swarm(
        &mut self,
        order: Option<usize>,
        terrain: &impl Terrain,
        recipe: &Recipe,
        query: &Query<'_>,
        stream: &mut Stream,
        budget: &mut i64,
    ) {
        let ended = self.swarm.advance(terrain, stream, budget);
        let origin = order.map_or(Origin::SwarmFallback, |order| Origin::Swarm(Variant::ORDER[order]));
        // The first path is taken as soon as there is one; later ones when they are finished.
        let cost = self.swarm.history().last().copied().unwrap_or(f64::INFINITY);
        if !ended && (self.best_from.is_some() || cost >= self.looked_at) {
            return;
        }
        self.looked_at = cost;
        *budget -= (super::swarm::FINER * recipe.swarm.samples * (query.obstacles.len() + 1)) as i64;
        let mut found = false;
        if let Some(path) = self.swarm.fine_path(terrain) {
            let path_m = length(path);
            found = true;
            if improves(self.best_from, origin, path_m) {
                self.best.clear();
                self.best.extend_from_slice(path);
                self.best_from = Some((origin, path_m));
                self.version += 1;
            }
        }
        if !ended {
            return;
        }
        if !found && terrain.passes(&self.raw.points) {
            let origin = order.map_or(Origin::Grid, |order| Origin::Raw(Variant::ORDER[order]));
            let path_m = length(&self.raw.points);
            if improves(self.best_from, origin, path_m) {
                self.best.clear();
                self.best.extend_from_slice(&self.raw.points);
                self.best_from = Some((origin, path_m));
                self.version += 1;
            }
        }
        match order {
            Some(order) => self.next_variant(order, recipe, query, stream),
            // Ever wider, as the way round may be.
            None if query.arm.is_none() && self.best_from.is_none() && self.widened + 1 < WIDENED_MAX => {
                self.begin_line(self.widened + 1, recipe, query, stream);
            }
            None => self.stage = Stage::Idle,
        }
    }

    /// A swarm on the straight line, in a box widened this often.
    fn begin_line(&mut self, widened: u32, recipe: &Recipe, query: &Query<'_>, stream: &mut Stream) {
        self.widened = widened;
        self.raw.points.clear();
        let part = |i: usize| i as f64 / (LINE_POINTS - 1) as f64;
        self.raw.points.extend((0..LINE_POINTS).map(|i| query.start + part(i) * (query.goal - query.start)));
        let box_m = recipe.swarm.box_m * f64::from(1u32 << widened);
        let settings = Settings { box_m, aside_m: box_m, ..recipe.swarm };
        self.begin_swarm(None, &settings, stream);
    }

    /// After a variant is done with.
    fn next_variant(&mut self, order: usize, recipe: &Recipe, query: &Query<'_>, stream: &mut Stream) {
        if order + 1 < Variant::ORDER.len() && (recipe.every_variant || self.best_from.is_none()) {
            self.walk(order + 1, query);
        } else if self.best_from.is_some() || !recipe.fallback {
            self.stage = Stage::Idle;
        } else if let Some(arm) = query.arm {
            self.grid.begin(&arm.geometry, recipe.grid_m);
            self.stage = Stage::Grid;
        } else {
            self.begin_line(0, recipe, query, stream);
        }
    }

    fn advance_grid(
        &mut self,
        arm: &ArmState,
        recipe: &Recipe,
        query: &Query<'_>,
        stream: &mut Stream,
        budget: &mut i64,
    ) {
        let through = Through::SheetWithStops(arm.elbow());
        if self.stage == Stage::Grid {
            let cost = GRID_POINT_COST + 8 * self.shapes.len() as i64;
            let points = (*budget / cost).max(1);
            *budget -= points * cost;
            let room = Room { joint2_rad: recipe.joint2_margin_rad, clearance_m: recipe.margin_m };
            if self.grid.advance(&arm.geometry, &self.shapes, room, points as usize) {
                let found = self.search.begin(&self.grid, query.start, query.goal, through);
                self.stage = if found == Found::NotYet { Stage::Search } else { Stage::Idle };
            }
            return;
        }
        let points = (*budget / GRID_POINT_COST).max(1);
        *budget -= points * GRID_POINT_COST;
        match self.search.advance(&self.grid, through, points as usize) {
            Found::NotYet => {}
            Found::Nothing => self.stage = Stage::Idle,
            Found::Path => {
                self.raw.points.clear();
                self.raw.points.push(query.start);
                self.search.path(&self.grid, &mut self.raw.points);
                self.raw.points.push(query.goal);
                self.begin_swarm(None, &recipe.swarm, stream);
            }
        }
    }
}

/// Whether a path is worth having instead of the one before. Of the same swarm the later one is, for it costs less. A
/// little shorter is not enough for another variant: then two robots in mirrored places would choose their sides by
/// chance.
fn improves(best: Option<(Origin, f64)>, origin: Origin, path_m: f64) -> bool {
    const WORTH: f64 = 0.99;
    match best {
        None => true,
        Some((before, _)) if before == origin => true,
        Some((_, best_m)) => path_m < WORTH * best_m,
    }
}

/// The terrain of a body in the plane.
pub fn plane<'a>(recipe: &Recipe, query: &Query<'a>) -> Plane<'a> {
    let Recipe { margin_m, penalty, .. } = *recipe;
    Plane { obstacles: query.obstacles, radius_m: query.radius_m, margin_m, penalty }
}

/// The terrain of an arm in its sheet.
pub fn sheet<'a>(recipe: &Recipe, query: &Query<'a>, arm: &'a ArmState) -> Sheet<'a> {
    let room = Room { joint2_rad: recipe.joint2_margin_rad, clearance_m: recipe.margin_m };
    let (geometry, elbow): (&ArmGeometry, _) = (&arm.geometry, arm.elbow());
    let Recipe { penalty, .. } = *recipe;
    Sheet { geometry, elbow, obstacles: query.obstacles, room, penalty, joint1_rad: Some(arm.joints_rad[0]) }
}
