//! Messages from one process to another, in order, through a file that outlives both.
//!
//! iceoryx2's ports tie what is under way to the two processes that are connected: when one dies, the queue between
//! them goes with it, and a full queue is overwritten or blocks. Orders and notices must survive a daemon that is
//! stopped, killed and replaced. So they travel in a ring of bytes: one writer, one reader, two counters. A writer that
//! dies in the middle of a message has not counted it; the next one writes over it.

use crate::map::Mapping;
use crate::{Address, Result};
use std::sync::atomic::Ordering::{AcqRel, Acquire, Relaxed, Release};

const MAGIC: u64 = u64::from_le_bytes(*b"shoalRg1");
/// Bytes ever written; only the writer changes it.
const HEAD: usize = 64;
/// Messages that found no room and could be left out, and those that could not; only the writer changes them.
const LEFT_OUT: usize = 72;
const LOST: usize = 80;
/// Bytes ever read; only the reader changes it.
const TAIL: usize = 128;
/// The reader's bell has been rung since it last looked.
const RUNG: usize = 192;
const DATA: usize = 256;
/// Before every message: its length, padded so that a length never wraps around the end.
const LENGTH: usize = 8;

pub(crate) struct Ring {
    map: Mapping,
    capacity: usize,
}

impl Ring {
    /// Makes a ring of so many bytes, a multiple of eight.
    pub(crate) fn create(address: &Address, name: &str, capacity: usize) -> Result<()> {
        debug_assert!(capacity.is_multiple_of(8));
        Mapping::create(address, name, DATA + capacity, |map| map.u64_at(0).store(MAGIC, Release)).map(drop)
    }

    pub(crate) fn open(address: &Address, name: &str) -> Result<Ring> {
        let map = Mapping::open(address, name, MAGIC)?;
        let capacity = map.len().saturating_sub(DATA);
        Ok(Ring { map, capacity })
    }

    /// Adds a message; `false` if there is no room for it now.
    pub(crate) fn push(&self, message: &[u8]) -> bool {
        let head = self.map.u64_at(HEAD).load(Relaxed);
        let used = head.wrapping_sub(self.map.u64_at(TAIL).load(Acquire));
        let size = LENGTH + message.len().next_multiple_of(8);
        if used as usize + size > self.capacity {
            return false;
        }
        self.copy(head, &(message.len() as u64).to_ne_bytes(), |at, bytes| self.map.write(at, bytes));
        self.copy(head + LENGTH as u64, message, |at, bytes| self.map.write(at, bytes));
        self.map.u64_at(HEAD).store(head + size as u64, Release);
        true
    }

    /// Whether a message of this length would ever fit.
    pub(crate) fn could_hold(&self, len: usize) -> bool {
        LENGTH + len.next_multiple_of(8) <= self.capacity
    }

    /// Takes the oldest message. Two loads if there is none.
    pub(crate) fn pop(&self) -> Option<Vec<u8>> {
        let tail = self.map.u64_at(TAIL).load(Relaxed);
        let there = self.map.u64_at(HEAD).load(Acquire).wrapping_sub(tail);
        if there == 0 {
            return None;
        }
        let mut length = [0_u8; LENGTH];
        self.fetch(tail, &mut length);
        let len = u64::from_ne_bytes(length) as usize;
        let size = LENGTH.saturating_add(len.checked_next_multiple_of(8).unwrap_or(usize::MAX));
        if size as u64 > there || size > self.capacity {
            // Somebody wrote into the file who should not have. Start over behind it.
            self.map.u64_at(TAIL).store(tail + there, Release);
            return None;
        }
        let mut message = vec![0; len];
        self.fetch(tail + LENGTH as u64, &mut message);
        self.map.u64_at(TAIL).store(tail + size as u64, Release);
        Some(message)
    }

    pub(crate) fn count_left_out(&self) {
        let left_out = self.map.u64_at(LEFT_OUT);
        left_out.store(left_out.load(Relaxed) + 1, Relaxed);
    }

    pub(crate) fn left_out(&self) -> u64 {
        self.map.u64_at(LEFT_OUT).load(Relaxed)
    }

    pub(crate) fn count_lost(&self, messages: u64) {
        let lost = self.map.u64_at(LOST);
        lost.store(lost.load(Relaxed) + messages, Relaxed);
    }

    pub(crate) fn lost(&self) -> u64 {
        self.map.u64_at(LOST).load(Relaxed)
    }

    /// Sets or clears the flag that saves a system call per message: the bell is rung only if it was clear.
    pub(crate) fn swap_rung(&self, rung: bool) -> bool {
        self.map.u32_at(RUNG).swap(u32::from(rung), AcqRel) != 0
    }

    pub(crate) fn is_rung(&self) -> bool {
        self.map.u32_at(RUNG).load(Acquire) != 0
    }

    /// Splits a range of the ring where it wraps.
    fn copy(&self, position: u64, bytes: &[u8], put: impl Fn(usize, &[u8])) {
        let at = (position % self.capacity as u64) as usize;
        let (first, second) = bytes.split_at(bytes.len().min(self.capacity - at));
        put(DATA + at, first);
        put(DATA, second);
    }

    fn fetch(&self, position: u64, bytes: &mut [u8]) {
        let at = (position % self.capacity as u64) as usize;
        let until_end = bytes.len().min(self.capacity - at);
        let (first, second) = bytes.split_at_mut(until_end);
        self.map.read(DATA + at, first);
        self.map.read(DATA, second);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]
        /// What goes in comes out, in order, across any wrap; what does not fit leaves no trace.
        #[test]
        fn it_is_a_queue(steps in proptest::collection::vec((any::<bool>(), 0_usize..70), 1..200)) {
            let address = Address::create().unwrap();
            Ring::create(&address, "ring", 256).unwrap();
            let (writer, reader) = (Ring::open(&address, "ring").unwrap(), Ring::open(&address, "ring").unwrap());
            crate::clean::sweep(&address);
            let mut expected = std::collections::VecDeque::new();
            for (i, (push, len)) in steps.into_iter().enumerate() {
                if push {
                    let message: Vec<u8> = (0..len).map(|j| (i + j) as u8).collect();
                    if writer.push(&message) {
                        expected.push_back(message);
                    } else {
                        prop_assert!(!expected.is_empty(), "an empty ring takes everything that fits it");
                    }
                } else {
                    prop_assert_eq!(reader.pop(), expected.pop_front());
                }
            }
            for message in expected {
                prop_assert_eq!(reader.pop(), Some(message));
            }
            prop_assert_eq!(reader.pop(), None);
        }
    }
}
