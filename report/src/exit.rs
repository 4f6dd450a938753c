//! Exit codes: how a run ended, in one number. Part of the report, and what the command line ends with.

/// The run met its expectations; the verb did what it was asked.
pub const OK: i32 = 0;
/// The run ended, but not as expected.
pub const EXPECTATIONS: i32 = 1;
/// The command line or the scenario is wrong.
pub const USAGE: i32 = 2;
/// The environment does not allow it: shared memory, limits, a missing executable, a dead world.
pub const ENVIRONMENT: i32 = 3;
/// Time ran out before all robots arrived.
pub const TIME_OUT: i32 = 4;
/// Interrupted by Ctrl-C or a signal that asks to end.
pub const INTERRUPTED: i32 = 130;
