//! End to end: the executable as people run it, with real processes, real signals and real shared memory. Few tests,
//! each of something that only processes can show.
//!
//! Every fleet has a root of its own, so tests run side by side; `support.rs` bounds how many fleets there are at once.
//! Nothing here waits for a time: conditions are looked for until a deadline that no machine needs.
#![expect(clippy::disallowed_methods, reason = "these tests start processes, wait for them and look at files")]
#![expect(clippy::print_stderr, reason = "a failed test shows what the processes said")]

mod agents;
mod crashes;
mod endings;
mod environment;
mod faults;
mod hygiene;
mod inject;
mod latency;
mod lies;
mod lives;
mod metrics;
mod operators;
mod orphans;
mod pace;
mod places;
mod processes;
mod replays;
mod rlimits;
mod scheduling;
mod service;
mod session;
mod signals;
mod standstill;
mod support;
mod tasks;
mod timeline;
mod top;
mod web;
mod words;
