//! The system's allocator, counting: for tests that say where no memory is asked for, or how much. Each of them is a program of its own
//! and takes this file in by its path.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

struct Counting;

thread_local! {
    // Per thread, because other tests run at the same time.
    static CALLS: Cell<usize> = const { Cell::new(0) };
    static HELD: Cell<usize> = const { Cell::new(0) };
    static PEAK: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call goes to the system's allocator as it is; counting in a constant-initialised thread local without
// a destructor neither allocates nor unwinds.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        CALLS.set(CALLS.get() + 1);
        HELD.set(HELD.get() + layout.size());
        PEAK.set(PEAK.get().max(HELD.get()));
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        HELD.set(HELD.get().saturating_sub(layout.size()));
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// How often this thread has asked for memory so far.
#[allow(dead_code, reason = "not every program that counts asks for it")]
pub(crate) fn calls() -> usize {
    CALLS.get()
}

/// How much memory this thread holds, bytes.
#[allow(dead_code, reason = "not every program that counts asks for it")]
pub(crate) fn held() -> usize {
    HELD.get()
}

/// The most memory, in bytes, that this thread holds at any moment of some work, beyond what it holds before.
#[allow(dead_code, reason = "not every program that counts asks for it")]
pub(crate) fn peak_of<T>(work: impl FnOnce() -> T) -> (T, usize) {
    let before = HELD.get();
    PEAK.set(before);
    let done = work();
    (done, PEAK.get() - before)
}
