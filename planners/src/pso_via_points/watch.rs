//! What a robot on its path keeps an eye on: what stands around, what is new, and whether it still gets on.

use super::follow::Follower;
use super::terrain::Plane;
use crate::planner::{Neighbor, Obstacle, PlanInput};
use geometry::Capsule;
use nalgebra::{Point2, Vector2};

/// What moves slower than this stands still, m/s.
const STILL_MPS: f64 = 0.05;
/// Obstacles remembered beyond the map, and robots that count as discs, at most.
const REMEMBERED_MAX: usize = 4096;
const PARKED_MAX: usize = 64;
/// Space for obstacles not yet seen that is taken at the beginning.
const UNSEEN: usize = 256;
/// A robot that counts as a disc moves on when it is this far from where it stood, m.
const MOVED_ON_M: f64 = 0.1;
/// Robots within this distance, surface to surface, count as discs when there is no progress, m.
const BLOCKER_RANGE_M: f64 = 1.5;
/// Further than this from its path a robot plans again, m.
const STRAYED_M: f64 = 0.5;
/// A goal that moves further than this is a new one, m; while a plan is in the making it may move further.
const GOAL_MOVED_M: f64 = 0.1;
const GOAL_MOVED_BUSY_M: f64 = 1.0;
/// Progress below this part of full speed is none.
const PROGRESS: f64 = 0.1;
/// Waiting after a plan in vain doubles up to this many times.
const PATIENCE_DOUBLED_MAX: u32 = 3;

/// What to do about the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Decision {
    /// Nothing.
    GoOn,
    /// Keep the path, and look for a better one from here.
    PlanAgain,
    /// The path cannot be driven: forget it, and look for another.
    DropPath,
}

/// Memory of the surroundings.
#[derive(Debug, Default)]
pub(super) struct Watch {
    /// Sensed, standing still, and not on the map; sorted by id.
    remembered: Vec<Obstacle>,
    /// Robots that count as discs: id, and where they stand.
    parked: Vec<(u32, Capsule)>,
    /// What the plan goes by: the map, what is remembered, and robots that stand.
    solid: Vec<Obstacle>,
    /// Something new stands in the way of the path.
    obstructed: bool,
    /// The path turned out not to be executable.
    given_up: bool,
    /// How far along the path the robot was when it last made progress, and when; s.
    mark_m: f64,
    mark_s: f64,
    now_s: f64,
    plans_in_vain: u32,
    /// Pieces on the map when the last plan began.
    map_len: usize,
}

impl Watch {
    pub(super) fn reserve(&mut self, input: &PlanInput<'_>) {
        self.remembered.reserve(input.obstacles.len() + UNSEEN);
        self.parked.reserve(PARKED_MAX);
        self.solid.reserve(input.map.len() + input.obstacles.len() + UNSEEN + PARKED_MAX);
    }

    /// What the plan in the making, or the last one, goes by.
    pub(super) fn solid(&self) -> &[Obstacle] {
        &self.solid
    }

    /// Where this robot stands, if it counts as a disc.
    pub(super) fn parked(&self, neighbor: &Neighbor) -> Option<Capsule> {
        self.parked.iter().find(|(id, _)| *id == neighbor.id).map(|(_, disc)| *disc)
    }

    /// The path turned out not to be executable.
    pub(super) fn give_up(&mut self) {
        self.given_up = true;
    }

    /// A path was taken.
    pub(super) fn took_path(&mut self, input: &PlanInput<'_>, at_m: f64) {
        self.plans_in_vain = 0;
        (self.mark_m, self.mark_s) = (at_m, input.tick as f64 * input.dt_s);
    }

    /// Takes in what is sensed and heard.
    pub(super) fn look(&mut self, input: &PlanInput<'_>, path: &Follower, margin_m: f64) {
        self.now_s = input.tick as f64 * input.dt_s;
        self.parked.retain(|(id, disc)| {
            let heard = input.neighbors.iter().find(|neighbor| neighbor.id == *id);
            heard.is_some_and(|neighbor| (neighbor.position - disc.a).norm() <= MOVED_ON_M)
        });
        for obstacle in input.obstacles {
            if obstacle.velocity.norm() > STILL_MPS {
                self.remembered.retain(|other| other.id != obstacle.id);
            } else if !contains(input.map, obstacle) && !contains(&self.remembered, obstacle) {
                self.remember(obstacle);
                self.obstructed |= in_the_way(obstacle.shape, path, input.radius_m + margin_m);
            }
        }
        if input.map.len() != self.map_len {
            self.map_len = input.map.len();
            self.obstructed |= input.map.iter().any(|piece| in_the_way(piece.shape, path, input.radius_m + margin_m));
        }
        for neighbor in input.neighbors {
            let stands = neighbor.arrived || neighbor.stopped;
            if stands && neighbor.velocity.norm() <= STILL_MPS && self.parked(neighbor).is_none() {
                let disc = Capsule::disc(neighbor.position, neighbor.radius_m);
                // A robot on its own goal is in the way of nobody's path that has another.
                if in_the_way(disc, path, input.radius_m + margin_m) && self.park(neighbor) {
                    self.obstructed = true;
                }
            }
        }
    }

    fn remember(&mut self, obstacle: &Obstacle) {
        if self.remembered.len() < REMEMBERED_MAX {
            let place = self.remembered.partition_point(|other| other.id <= obstacle.id);
            self.remembered.insert(place, *obstacle);
        }
    }

    fn park(&mut self, neighbor: &Neighbor) -> bool {
        let room = self.parked.len() < PARKED_MAX;
        if room {
            self.parked.push((neighbor.id, Capsule::disc(neighbor.position, neighbor.radius_m)));
        }
        room
    }

    /// Whether to plan again.
    pub(super) fn decide(
        &mut self,
        input: &PlanInput<'_>,
        path: &Follower,
        asked_goal: Option<Point2<f64>>,
        busy: bool,
        blocked_s: f64,
    ) -> Decision {
        let Some(asked_goal) = asked_goal else { return Decision::DropPath };
        let obstructed = std::mem::take(&mut self.obstructed);
        if std::mem::take(&mut self.given_up) || (obstructed && path.has_path()) {
            return Decision::DropPath;
        }
        let goal_moved = (input.goal - asked_goal).norm();
        if goal_moved > GOAL_MOVED_BUSY_M {
            return Decision::DropPath;
        }
        if path.at_m() > self.mark_m + PROGRESS * input.limits.speed_mps_max * blocked_s {
            (self.mark_m, self.mark_s) = (path.at_m(), self.now_s);
        }
        if busy {
            return Decision::GoOn;
        }
        if goal_moved > GOAL_MOVED_M.max(input.goal_tolerance_m) {
            return Decision::PlanAgain;
        }
        if !path.has_path() {
            let wait_s = blocked_s * f64::from(1u32 << self.plans_in_vain);
            if self.now_s - self.mark_s < wait_s {
                return Decision::GoOn;
            }
            self.plans_in_vain = (self.plans_in_vain + 1).min(PATIENCE_DOUBLED_MAX);
            self.park_blockers(input);
            return Decision::DropPath;
        }
        if path.ahead(0.0).is_some_and(|on| (on - input.position).norm() > STRAYED_M) {
            return Decision::PlanAgain;
        }
        if self.now_s - self.mark_s > blocked_s && path.remaining_m() > input.goal_tolerance_m {
            self.park_blockers(input);
            return Decision::PlanAgain;
        }
        Decision::GoOn
    }

    /// Slow robots near by count as discs from now on.
    fn park_blockers(&mut self, input: &PlanInput<'_>) {
        for neighbor in input.neighbors {
            let gap = (neighbor.position - input.position).norm() - neighbor.radius_m - input.radius_m;
            let slow = neighbor.velocity.norm() <= PROGRESS.max(0.2) * input.limits.speed_mps_max;
            if slow && gap <= BLOCKER_RANGE_M && self.parked(neighbor).is_none() {
                self.park(neighbor);
            }
        }
    }

    /// A plan begins: what it goes by is fixed now.
    pub(super) fn begin(&mut self, input: &PlanInput<'_>) {
        (self.mark_m, self.mark_s) = (f64::NEG_INFINITY, input.tick as f64 * input.dt_s);
        self.map_len = input.map.len();
        self.solid.clear();
        self.solid.extend_from_slice(input.map);
        self.solid.extend_from_slice(&self.remembered);
        // Ids of robots and of obstacles are counted apart; these only keep the discs from being taken for one body.
        let ids = (0..=u32::MAX).rev();
        let discs = self.parked.iter().zip(ids);
        self.solid.extend(discs.map(|((_, shape), id)| Obstacle { id, shape: *shape, velocity: Vector2::zeros() }));
    }

    /// Whether a path that has just been found keeps clear of what was seen since it was begun.
    pub(super) fn still_free(&self, path: &[Point2<f64>], input: &PlanInput<'_>, margin_m: f64) -> bool {
        use super::terrain::Terrain;
        let obstacles = self.remembered.as_slice();
        Plane { obstacles, radius_m: input.radius_m, margin_m, penalty: 0.0 }.passes(path)
    }
}

/// Whether a sorted list holds this very piece.
fn contains(sorted: &[Obstacle], piece: &Obstacle) -> bool {
    let first = sorted.partition_point(|other| other.id < piece.id);
    sorted[first..].iter().take_while(|other| other.id == piece.id).any(|other| other.shape == piece.shape)
}

/// Whether a shape comes nearer than `reach_m` to what is left of the path.
fn in_the_way(shape: Capsule, path: &Follower, reach_m: f64) -> bool {
    let near =
        |pair: &[Point2<f64>]| geometry::segment_distance(pair[0], pair[1], shape.a, shape.b) - shape.radius < reach_m;
    path.rest().windows(2).any(near)
}

/// What moves is met like a robot that speaks: by its nearest point, now.
pub(super) fn as_robot(obstacle: &Obstacle, position: Point2<f64>) -> Option<Neighbor> {
    (obstacle.velocity.norm() > STILL_MPS).then(|| Neighbor {
        id: u32::MAX,
        position: obstacle.shape.nearest_core(position),
        yaw_rad: 0.0,
        velocity: obstacle.velocity,
        radius_m: obstacle.shape.radius,
        age_s: 0.0,
        remaining_m: f64::INFINITY,
        arrived: false,
        stopped: false,
        next: None,
        intent: None,
    })
}

/// Robots and what moves, as shapes where they are.
pub(super) fn moving_bodies(input: &PlanInput<'_>) -> impl Iterator<Item = Capsule> {
    let robots = input.neighbors.iter().map(|neighbor| Capsule::disc(neighbor.position, neighbor.radius_m));
    let things = input.obstacles.iter().filter(|obstacle| obstacle.velocity.norm() > STILL_MPS);
    robots.chain(things.map(|obstacle| obstacle.shape))
}
