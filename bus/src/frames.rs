//! Whole frames for whoever watches: iceoryx2 publish-subscribe, one slice per tick.

use crate::node::{Ipc, Node, of_world};
use crate::{BusError, Result};
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::*;
use iceoryx2::service::builder::publish_subscribe::Builder;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory as Factory;
use protocol::world_to_observer::{FrameBody, FrameHeader};

/// Observers at the same time, dead ones that were not cleared away included.
const SUBSCRIBERS_MAX: usize = 8;
/// How many frames an observer may be behind before it misses the oldest ones.
const BUFFER: usize = 64;
/// Frames that exist at the same time. All observers hold the same newest 64, and each one that it is copying out.
const CHUNKS_MAX: usize = BUFFER + 2 * SUBSCRIBERS_MAX + 8;

/// What keeps the service alive.
pub(crate) type FrameService = Factory<Ipc, [FrameBody], FrameHeader>;

/// Room that frames of this many bodies take in shared memory, bytes.
pub(crate) fn bytes_needed(bodies: usize) -> u64 {
    let frame = 128 + bodies * size_of::<FrameBody>();
    // A connection holds its queues and a byte per chunk.
    (CHUNKS_MAX * frame + SUBSCRIBERS_MAX * 4 * 4096) as u64
}

/// Makes the service.
pub(crate) fn create(node: &Node, incarnation: u32) -> Result<FrameService> {
    builder(node, incarnation).create().map_err(|e| failed("create the service", e))
}

fn builder(node: &Node, incarnation: u32) -> Builder<[FrameBody], FrameHeader, Ipc> {
    node.service(&of_world("frames", incarnation))
        .publish_subscribe::<[FrameBody]>()
        .user_header::<FrameHeader>()
        .max_publishers(1)
        .max_subscribers(SUBSCRIBERS_MAX)
        .max_nodes(2 * SUBSCRIBERS_MAX + 8)
        .subscriber_max_buffer_size(BUFFER)
        .subscriber_max_borrowed_samples(1)
        // A slow observer misses frames; it never holds up the world.
        .enable_safe_overflow(true)
}

/// Opens the service, which keeps it alive.
pub(crate) fn open(node: &Node, incarnation: u32) -> Result<FrameService> {
    builder(node, incarnation).open().map_err(|e| failed("open the service", e))
}

fn failed(action: &'static str, cause: impl std::fmt::Debug) -> BusError {
    BusError::port("service `frames`", action, cause)
}

/// The world's end.
pub struct FramePublisher {
    publisher: Publisher<Ipc, [FrameBody], FrameHeader>,
    service: FrameService,
}

impl FramePublisher {
    /// Becomes the one who publishes for this incarnation of the world, frames of at most this many bodies ([`Sizes::frame_bodies_max`](crate::Sizes)).
    ///
    /// # Errors
    /// When the fleet's services are not there, or somebody else publishes.
    pub fn open(node: &Node, bodies_max: usize, incarnation: u32) -> Result<FramePublisher> {
        let service = open(node, incarnation)?;
        let publisher = service
            .publisher_builder()
            .initial_max_slice_len(bodies_max)
            .allocation_strategy(AllocationStrategy::Static)
            .max_loaned_samples(1)
            .override_sample_preallocation(|needed| needed.min(CHUNKS_MAX))
            .create()
            .map_err(|e| failed("become the publisher", e))?;
        Ok(FramePublisher { publisher, service })
    }

    /// Whether anybody watches: one load. An observer that was killed counts until the janitor has been there.
    pub fn is_watched(&self) -> bool {
        self.service.dynamic_config().number_of_subscribers() > 0
    }

    /// Publishes a frame; how many observers it went to. With nobody watching it returns at once, and a frame for which
    /// there is no room goes to nobody: the loop does not fail for its onlookers.
    pub fn publish(&mut self, header: FrameHeader, bodies: &[FrameBody]) -> usize {
        debug_assert!(bodies.len() <= self.publisher.initial_max_slice_len());
        if !self.is_watched() {
            return 0;
        }
        let Ok(mut sample) = self.publisher.loan_slice_uninit(bodies.len()) else { return 0 };
        *sample.user_header_mut() = header;
        sample.write_from_slice(bodies).send().unwrap_or(0)
    }
}

/// An observer's end.
pub struct FrameSubscriber {
    subscriber: Subscriber<Ipc, [FrameBody], FrameHeader>,
}

impl FrameSubscriber {
    /// Begins to watch this incarnation of the world: frames from now on.
    ///
    /// # Errors
    /// When the fleet's services are not there, or too many watch already.
    pub fn open(node: &Node, incarnation: u32) -> Result<FrameSubscriber> {
        let subscriber = open(node, incarnation)?
            .subscriber_builder()
            .buffer_size(BUFFER)
            .create()
            .map_err(|e| failed("become a subscriber", e))?;
        Ok(FrameSubscriber { subscriber })
    }

    /// The oldest frame that was not taken yet. Ticks that are missing between two frames were overwritten.
    ///
    /// # Errors
    /// When iceoryx2 cannot reach the world.
    pub fn take(&mut self) -> Result<Option<(FrameHeader, Vec<FrameBody>)>> {
        let sample = self.subscriber.receive().map_err(|e| failed("receive a frame", e))?;
        Ok(sample.map(|sample| (*sample.user_header(), sample.payload().to_vec())))
    }
}
