//! What the world showed its robots in the last ticks: a realtime agent may have planned from any of them.

use model::{Radio, RobotInstance};
use protocol::world_to_robot::{Odometry, Piece};
use std::collections::VecDeque;
use std::rc::Rc;
use world_sim::World;

/// Pieces that are copied together when one of them moves.
const CHUNK: usize = 32;
/// Simulated time that is kept, s.
const KEPT_S: f64 = 5.0;
/// Ticks that are kept at least, and at most.
const KEPT_TICKS: [u64; 2] = [64, 4096];

/// What a robot was shown in a tick in which it took part.
pub(crate) struct Seat {
    pub(crate) instance: RobotInstance,
    pub(crate) odometry: Odometry,
    pub(crate) radio: Radio,
    sensed: Rc<[u16]>,
}

/// A tick.
struct View {
    tick: u64,
    /// By slot.
    seats: Vec<Seat>,
    pieces: Vec<Rc<[Piece; CHUNK]>>,
}

/// The views of the last ticks, one per tick.
pub(crate) struct Views {
    kept: VecDeque<View>,
    ticks_max: u64,
    /// By slot, the pieces in sight.
    sensed: Vec<Rc<[u16]>>,
    pieces: Vec<Rc<[Piece; CHUNK]>>,
}

impl Views {
    pub(crate) fn new(tick_hz: f64) -> Views {
        let ticks_max = ((KEPT_S * tick_hz) as u64).clamp(KEPT_TICKS[0], KEPT_TICKS[1]);
        Views { kept: VecDeque::new(), ticks_max, sensed: Vec::new(), pieces: Vec::new() }
    }

    /// Keeps what the open tick of the world shows.
    pub(crate) fn keep(&mut self, world: &World) {
        // What is on the board of the world: a piece is written when it moves and somebody sees it.
        for index in world.opening().pieces {
            while index / CHUNK >= self.pieces.len() {
                self.pieces.push(Rc::new([Piece::default(); CHUNK]));
            }
            Rc::make_mut(&mut self.pieces[index / CHUNK])[index % CHUNK] = world.piece(*index);
        }
        self.sensed.resize_with(world.slots().max(self.sensed.len()), || Rc::from([]));
        let mut seats = Vec::with_capacity(world.participants().len());
        for instance in world.participants() {
            let slot = instance.index.at();
            if *self.sensed[slot] != *world.sensed(slot) {
                self.sensed[slot] = Rc::from(world.sensed(slot));
            }
            seats.push(Seat {
                instance: *instance,
                odometry: world.odometry(slot),
                radio: world.impairment(slot).radio(),
                sensed: Rc::clone(&self.sensed[slot]),
            });
        }
        self.kept.push_back(View { tick: world.tick(), seats, pieces: self.pieces.clone() });
        while self.kept.len() as u64 > self.ticks_max {
            self.kept.pop_front();
        }
    }

    /// The first and the last tick that are kept.
    pub(crate) fn range(&self) -> Option<(u64, u64)> {
        Some((self.kept.front()?.tick, self.kept.back()?.tick))
    }

    /// What a robot instance was shown in a tick, if it took part in it.
    pub(crate) fn seat(&self, tick: u64, instance: RobotInstance) -> Option<&Seat> {
        let seats = &self.view(tick)?.seats;
        let place = seats.binary_search_by_key(&instance.index, |seat| seat.instance.index).ok()?;
        Some(&seats[place]).filter(|seat| seat.instance == instance)
    }

    /// What was in its sight, into `pieces`.
    pub(crate) fn look(&self, seat: &Seat, pieces: &mut Vec<Piece>) {
        pieces.clear();
        let Some(view) = self.view(seat.odometry.tick) else { return };
        let piece = |index: &u16| view.pieces[usize::from(*index) / CHUNK][usize::from(*index) % CHUNK];
        pieces.extend(seat.sensed.iter().map(piece));
    }

    fn view(&self, tick: u64) -> Option<&View> {
        let first = self.kept.front()?.tick;
        self.kept.get(usize::try_from(tick.checked_sub(first)?).ok()?)
    }
}
