//! A ring of bytes between two processes: as much room, and as little, as the real one has.

use std::collections::VecDeque;

/// Before every message: its length.
const LENGTH: usize = 8;

#[derive(Default)]
pub(crate) struct Ring {
    capacity: usize,
    used: usize,
    messages: VecDeque<Vec<u8>>,
    /// How often a message found no room.
    pub(crate) refusals: u64,
}

impl Ring {
    pub(crate) fn new(capacity: usize) -> Ring {
        Ring { capacity, ..Ring::default() }
    }

    pub(crate) fn push(&mut self, message: &[u8]) -> bool {
        let size = LENGTH + message.len().next_multiple_of(8);
        assert!(size <= self.capacity, "a message of {size} bytes would never fit");
        if self.used + size > self.capacity {
            self.refusals += 1;
            return false;
        }
        self.used += size;
        self.messages.push_back(message.to_vec());
        true
    }

    pub(crate) fn pop(&mut self) -> Option<Vec<u8>> {
        let message = self.messages.pop_front()?;
        self.used -= LENGTH + message.len().next_multiple_of(8);
        Some(message)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.messages.is_empty()
    }
}
