//! Orders to the world, and notices from it. Never in the tick.
//!
//! These are two streams between two long-lived processes, in which nothing may be lost or change places, whatever
//! happens to the daemon meanwhile: rings in files (`ring.rs` says why), and a named pipe that wakes the daemon.

use crate::bell::Bell;
use crate::node::Node;
use crate::queue::{NoticeQueue, OrderQueue, Sent};
use crate::ring::Ring;
use crate::{Address, BusError, Result};
use protocol::codec;
use protocol::daemon_to_world::Order;
use protocol::world_to_daemon::Notice;
use std::os::fd::{AsFd, BorrowedFd};

const ORDERS: &str = "orders";
const NOTICES: &str = "notices";
const NOTICES_BELL: &str = "notices.bell";
/// An order with a robot in it takes up to a few kilobytes.
const ORDERS_BYTES: usize = 256 * 1024;
/// Room for 8192 messages of up to 120 bytes; an `Expect` or `Kill` takes 16, so for 65 536 of those.
const NOTICES_BYTES: usize = 1024 * 1024;

pub(crate) const BYTES_NEEDED: u64 = (ORDERS_BYTES + NOTICES_BYTES) as u64;

/// Makes both streams.
pub(crate) fn create(address: &Address) -> Result<()> {
    Ring::create(address, ORDERS, ORDERS_BYTES)?;
    Ring::create(address, NOTICES, NOTICES_BYTES)?;
    Bell::create(address, NOTICES_BELL)
}

pub(crate) fn encoded<T: serde::Serialize>(what: &'static str, message: &T) -> Result<Vec<u8>> {
    codec::encode(message).map_err(|e| BusError::new(what, "encode it", e.to_string(), "this is a bug in shoal"))
}

/// The daemon's end of the orders.
///
/// An order that finds the ring full waits here ([`OrderQueue`]), and goes out with the next [`OrderSender::flush`]. Ring
/// the world afterwards ([`Gate::ring_world`](crate::Gate::ring_world)) if it may be asleep in the gate.
pub struct OrderSender {
    ring: Ring,
    waiting: OrderQueue,
}

impl OrderSender {
    /// Becomes the sender of orders. There must be one at a time.
    ///
    /// # Errors
    /// When the fleet's services are not there.
    pub fn open(node: &Node) -> Result<OrderSender> {
        Ok(OrderSender { ring: Ring::open(node.address(), ORDERS)?, waiting: OrderQueue::default() })
    }

    /// Hands an order over, or keeps it until there is room.
    ///
    /// # Errors
    /// When it is larger than everything that fits, which no order is.
    pub fn send(&mut self, order: &Order) -> Result<()> {
        let bytes = encoded("order", order)?;
        if !self.ring.could_hold(bytes.len()) {
            return Err(BusError::new("order", "send it", "it is too large", "this is a bug in shoal"));
        }
        self.waiting.add(order, bytes);
        self.flush();
        Ok(())
    }

    /// Hands over what waits, as far as there is room; how many orders wait still.
    pub fn flush(&mut self) -> usize {
        self.waiting.flush(&mut |bytes| self.ring.push(bytes))
    }
}

/// The world's end of the orders.
pub struct OrderReceiver {
    ring: Ring,
}

impl OrderReceiver {
    /// Becomes the receiver of orders. There must be one at a time.
    ///
    /// # Errors
    /// When the fleet's services are not there.
    pub fn open(node: &Node) -> Result<OrderReceiver> {
        Ok(OrderReceiver { ring: Ring::open(node.address(), ORDERS)? })
    }

    /// The next order, if there is one. No system call.
    pub fn take(&mut self) -> Option<Order> {
        take(&self.ring)
    }
}

/// The world's end of the notices. It never blocks.
///
/// While the daemon does not read (stopped, or dead), notices fill the ring: 8192 of up to 120 bytes at least. Then
/// [`Notice::Log`] entries are dropped and counted (the outcome holds the log as well), and all others wait in this
/// process's memory ([`NoticeQueue`]), in order, until there is room.
pub struct NoticeSender {
    ring: Ring,
    bell: Bell,
    waiting: NoticeQueue,
}

impl NoticeSender {
    /// Becomes the sender of notices. There must be one at a time.
    ///
    /// # Errors
    /// When the fleet's services are not there.
    pub fn open(node: &Node) -> Result<NoticeSender> {
        let (ring, bell) = (Ring::open(node.address(), NOTICES)?, Bell::open(node.address(), NOTICES_BELL)?);
        Ok(NoticeSender { ring, bell, waiting: NoticeQueue::default() })
    }

    /// Hands a notice over and wakes the daemon.
    pub fn send(&mut self, notice: &Notice) {
        self.flush();
        let Ok(bytes) = encoded("notice", notice) else {
            // No notice holds anything that cannot be encoded.
            return self.ring.count_lost(1);
        };
        match self.waiting.send(notice, bytes, &mut |bytes| self.ring.push(bytes)) {
            Sent::Pushed => self.ring_bell(),
            Sent::Waits => {}
            Sent::LeftOut => self.ring.count_left_out(),
            Sent::Lost => self.ring.count_lost(1),
        }
    }

    /// Hands over what waits, as far as there is room; how many notices wait still. To be called now and then (each
    /// tick: it costs nothing when nothing waits).
    pub fn flush(&mut self) -> usize {
        let before = self.waiting.len();
        let after = self.waiting.flush(&mut |bytes| self.ring.push(bytes));
        if after < before {
            self.ring_bell();
        }
        after
    }

    /// This process ends: what waits still is lost, and counted.
    pub fn abandon(&mut self) {
        self.ring.count_lost(self.waiting.abandon());
    }

    /// Entries of the log that were left out so far.
    pub fn left_out(&self) -> u64 {
        self.ring.left_out()
    }

    /// One write per batch: the flag is cleared by the reader before it looks, so either it sees the message that was
    /// pushed before this exchange, or this exchange finds the flag clear and writes.
    fn ring_bell(&self) {
        if !self.ring.swap_rung(true) {
            self.bell.ring();
        }
    }
}

/// The daemon's end of the notices, with a descriptor for `poll`: readable when there is something to take.
///
/// Call [`NoticeReceiver::take`] until it gives nothing, and only then sleep.
pub struct NoticeReceiver {
    ring: Ring,
    bell: Bell,
}

impl NoticeReceiver {
    /// Becomes the receiver of notices. There must be one at a time; a new one goes on where a dead one stopped.
    ///
    /// # Errors
    /// When the fleet's services are not there.
    pub fn open(node: &Node) -> Result<NoticeReceiver> {
        Ok(NoticeReceiver {
            ring: Ring::open(node.address(), NOTICES)?,
            bell: Bell::open(node.address(), NOTICES_BELL)?,
        })
    }

    /// The next notice, if there is one. A system call only once per batch.
    pub fn take(&mut self) -> Option<Notice> {
        if let Some(notice) = take(&self.ring) {
            return Some(notice);
        }
        if !self.ring.is_rung() {
            // A notice that came since the first look set the flag after it was pushed.
            return take(&self.ring);
        }
        self.ring.swap_rung(false);
        self.bell.drain();
        take(&self.ring)
    }

    /// Entries of the log that were left out so far, see [`NoticeSender`].
    pub fn left_out(&self) -> u64 {
        self.ring.left_out()
    }

    /// Other notices that are lost, although the daemon should have acted on them.
    pub fn lost(&self) -> u64 {
        self.ring.lost()
    }
}

impl AsFd for NoticeReceiver {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.bell.as_fd()
    }
}

/// What cannot be decoded is skipped: both ends are the same build, so it would be damage.
fn take<T: serde::de::DeserializeOwned>(ring: &Ring) -> Option<T> {
    loop {
        if let Ok(message) = codec::decode(&ring.pop()?) {
            return Some(message);
        }
    }
}
