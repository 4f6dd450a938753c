//! What becomes of a message that finds its ring full: kept in order until there is room, said once, or left out and
//! counted. Pure: where the ring is, and who reads it, is the business of `control.rs`.

use protocol::daemon_to_world::Order;
use protocol::world_to_daemon::Notice;
use std::collections::VecDeque;

/// Notices that wait in the world's memory when the ring is full. Beyond this the daemon has been gone for so long, and
/// the run has been so busy, that counting is all that is left.
pub const BACKLOG_MAX: usize = 65_536;

/// What adds a message to the ring, or says that there is no room for it now.
pub type Push<'a> = dyn FnMut(&[u8]) -> bool + 'a;

/// Orders that wait for room, in order. A fact that waits already is not added again, so those that wait are bounded by
/// the facts that there are of a fleet, and by the requests that the daemon lets wait.
#[derive(Default)]
pub struct OrderQueue {
    waiting: VecDeque<Vec<u8>>,
}

impl OrderQueue {
    /// Adds an order, encoded as these bytes, behind those that wait. It goes out with the next [`OrderQueue::flush`].
    pub fn add(&mut self, order: &Order, bytes: Vec<u8>) {
        // While the world is stopped the same fact may come again and again: once is enough. Requests of operators are
        // each different, and bounded by the daemon.
        let is_fact = matches!(order, Order::Absent { .. } | Order::Stop);
        if !(is_fact && self.waiting.contains(&bytes)) {
            self.waiting.push_back(bytes);
        }
    }

    /// Hands over what waits, as far as there is room; how many orders wait still.
    pub fn flush(&mut self, push: &mut Push<'_>) -> usize {
        flush(&mut self.waiting, push)
    }

    /// How many orders wait.
    pub fn len(&self) -> usize {
        self.waiting.len()
    }

    /// Whether none waits.
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }
}

/// What became of a notice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sent {
    /// It is in the ring.
    Pushed,
    /// It waits for room.
    Waits,
    /// It is an entry of the log, and is left out. That has to be counted.
    LeftOut,
    /// It is lost, although the daemon should have acted on it. That has to be counted.
    Lost,
}

/// Notices that wait for room, in order. Entries of the log do not wait: the outcome holds the log as well.
#[derive(Default)]
pub struct NoticeQueue {
    waiting: VecDeque<Vec<u8>>,
}

impl NoticeQueue {
    /// Hands a notice over, encoded as these bytes, unless others wait before it.
    pub fn send(&mut self, notice: &Notice, bytes: Vec<u8>, push: &mut Push<'_>) -> Sent {
        if self.waiting.is_empty() && push(&bytes) {
            Sent::Pushed
        } else if matches!(notice, Notice::Log(_)) {
            Sent::LeftOut
        } else if self.waiting.len() >= BACKLOG_MAX {
            Sent::Lost
        } else {
            self.waiting.push_back(bytes);
            Sent::Waits
        }
    }

    /// Hands over what waits, as far as there is room; how many notices wait still.
    pub fn flush(&mut self, push: &mut Push<'_>) -> usize {
        flush(&mut self.waiting, push)
    }

    /// The world's process ends, and what waits still is lost: how many notices.
    pub fn abandon(&mut self) -> u64 {
        std::mem::take(&mut self.waiting).len() as u64
    }

    /// How many notices wait.
    pub fn len(&self) -> usize {
        self.waiting.len()
    }

    /// Whether none waits.
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }
}

fn flush(waiting: &mut VecDeque<Vec<u8>>, push: &mut Push<'_>) -> usize {
    while waiting.front().is_some_and(|bytes| push(bytes)) {
        waiting.pop_front();
    }
    waiting.len()
}
