//! Places on the machine: how many fleets the tests hold at the same time.

use std::sync::{Condvar, Mutex, PoisonError};

/// Fleets at the same time: every one is a handful of processes, and the machine may have two cores.
const FLEETS_MAX: usize = 3;

/// Places that a test has taken; given back when it is dropped.
pub(crate) struct Permit(usize);

static TAKEN: Mutex<usize> = Mutex::new(0);
static FREED: Condvar = Condvar::new();

impl Permit {
    /// Waits until this number of places is free, and takes them.
    pub(crate) fn take(fleets: usize) -> Permit {
        assert!(fleets <= FLEETS_MAX);
        let taken = TAKEN.lock().unwrap_or_else(PoisonError::into_inner);
        let mut taken =
            FREED.wait_while(taken, |taken| *taken + fleets > FLEETS_MAX).unwrap_or_else(PoisonError::into_inner);
        *taken += fleets;
        Permit(fleets)
    }
}

impl Drop for Permit {
    fn drop(&mut self) {
        *TAKEN.lock().unwrap_or_else(PoisonError::into_inner) -= self.0;
        FREED.notify_all();
    }
}
