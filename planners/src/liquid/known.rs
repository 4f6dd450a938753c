//! What the offline robot takes to be there and to stay: the map, what it has seen standing still, and robots that
//! have arrived. What it has seen once it remembers, so that a robot without a map learns its world. If it is asked to,
//! it also keeps what moves, where it is now and for as long as it is in sight.

use crate::planner::{Neighbor, Obstacle, PlanInput};
use nalgebra::Vector2;

/// What is slower than this stands still, m/s.
pub const STILL_MPS: f64 = 0.01;

/// Room for what is seen later, pieces; more costs an allocation.
const ROOM: usize = 256;

/// The obstacles of a robot's plans, sorted by id.
#[derive(Clone, Debug, Default)]
pub struct Known {
    obstacles: Vec<Obstacle>,
    has_map: bool,
    keeps_moving: bool,
}

/// What a tick's input says that was not known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct News {
    /// Something stands there that was not known, or stands elsewhere.
    pub standing: bool,
    /// Something that moves came, moved on or went out of sight.
    pub moving: bool,
}

/// A robot that has arrived, as an obstacle. The ids of robots count down from the greatest, out of the way of others.
pub fn parked(neighbor: &Neighbor) -> Obstacle {
    Obstacle {
        id: u32::MAX - neighbor.id,
        shape: geometry::Capsule::disc(neighbor.position, neighbor.radius_m),
        velocity: Vector2::zeros(),
    }
}

/// Whether an obstacle moves.
pub fn moves(obstacle: &Obstacle) -> bool {
    obstacle.velocity.norm() > STILL_MPS
}

impl Known {
    /// Nothing yet; `keeps_moving` says whether what moves counts.
    pub fn new(keeps_moving: bool) -> Known {
        Known { keeps_moving, ..Known::default() }
    }

    /// The obstacles, the pieces of each standing together.
    pub fn obstacles(&self) -> &[Obstacle] {
        &self.obstacles
    }

    /// Learns from a tick's input: what is there that was not known, or is elsewhere, by more than `slack_m`.
    pub fn notice(&mut self, input: &PlanInput<'_>, robots: bool, slack_m: f64) -> News {
        let mut news = News::default();
        if !self.has_map {
            self.has_map = true;
            self.obstacles.reserve(input.map.len() + input.obstacles.len() + ROOM);
            self.obstacles.extend(input.map.iter().filter(|obstacle| !moves(obstacle)));
            self.obstacles.sort_by_key(|obstacle| obstacle.id);
            news.standing = !self.obstacles.is_empty();
        }
        if self.keeps_moving {
            // Where it is out of sight is not known.
            let in_sight = |id: u32| input.obstacles.binary_search_by_key(&id, |seen| seen.id).is_ok();
            let before = self.obstacles.len();
            self.obstacles.retain(|known| !moves(known) || in_sight(known.id));
            news.moving = self.obstacles.len() < before;
        }
        for pieces in input.obstacles.chunk_by(|a, b| a.id == b.id) {
            if !pieces.iter().any(moves) {
                news.standing |= self.see(pieces, slack_m);
            } else if self.keeps_moving {
                news.moving |= self.see(pieces, slack_m);
            } else {
                self.forget(pieces[0].id);
            }
        }
        if robots {
            for neighbor in input.neighbors {
                if neighbor.arrived {
                    news.standing |= self.see(&[parked(neighbor)], slack_m);
                } else {
                    self.forget(parked(neighbor).id);
                }
            }
        }
        news
    }

    fn see(&mut self, pieces: &[Obstacle], slack_m: f64) -> bool {
        let id = pieces[0].id;
        let from = self.obstacles.partition_point(|known| known.id < id);
        let known = self.obstacles[from..].partition_point(|known| known.id == id);
        let same = |a: &Obstacle, b: &Obstacle| {
            let moved = (a.shape.a - b.shape.a).norm().max((a.shape.b - b.shape.b).norm());
            moved <= slack_m && (a.shape.radius - b.shape.radius).abs() <= slack_m
        };
        if let ([piece], 1) = (pieces, known) {
            // A thing of one piece can be seen to have moved; of others, only some pieces may be in sight.
            let known = &mut self.obstacles[from];
            let news = !same(piece, known);
            // Whether it still moves is news of another kind.
            *known = if news { *piece } else { Obstacle { velocity: piece.velocity, ..*known } };
            return news;
        }
        let mut news = false;
        let is_known = |piece: &Obstacle| self.obstacles[from..from + known].iter().any(|known| same(known, piece));
        if pieces.iter().any(|piece| piece.velocity != Vector2::zeros()) && !pieces.iter().all(is_known) {
            // Slow as it is, it has moved: what was known of it is no longer there, and would pile up.
            self.obstacles.drain(from..from + known);
        }
        for piece in pieces {
            let known = self.obstacles[from..].partition_point(|known| known.id == id);
            if !self.obstacles[from..from + known].iter().any(|known| same(known, piece)) {
                self.obstacles.insert(from + known, *piece);
                news = true;
            }
        }
        news
    }

    fn forget(&mut self, id: u32) {
        if self.obstacles.binary_search_by_key(&id, |known| known.id).is_ok() {
            self.obstacles.retain(|known| known.id != id);
        }
    }
}
