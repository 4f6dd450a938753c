//! What a process needs of its limits before it does anything.

use crate::exit::Failure;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// Opening iceoryx2's services takes some 150 KiB of stack, reading a command line some 100; and some room.
const STACK_NEEDED: u64 = 1 << 20;
/// The default limit of Linux.
const STACK_USUAL: u64 = 8 << 20;

/// Takes the stack that is needed, as far as it may, and has a file that has become as large as it may be be an error of
/// the write instead of the end of the process. Children inherit both. To be called first of all, on a stack that may be
/// tiny.
///
/// # Errors
/// With exit code 3, when the stack would overflow.
pub fn prepare() -> Result<(), Failure> {
    // SAFETY: ignoring a signal runs no code of ours.
    unsafe { libc::signal(libc::SIGXFSZ, libc::SIG_IGN) };
    let Rlimit { current, maximum } = getrlimit(Resource::Stack);
    let of = |limit: Option<u64>| limit.unwrap_or(u64::MAX);
    if of(current) >= STACK_USUAL {
        return Ok(());
    }
    let wanted = STACK_USUAL.min(of(maximum));
    let raised = setrlimit(Resource::Stack, Rlimit { current: Some(wanted), maximum }).is_ok();
    let stack = if raised { wanted } else { of(current) };
    if stack >= STACK_NEEDED {
        return Ok(());
    }
    Err(Failure::environment(format!(
        "stack: the limit is {} KiB, shoal needs {} KiB",
        stack / 1024,
        STACK_NEEDED / 1024
    ))
    .hint("raise it: `ulimit -s 8192`, or `ulimit -Ss` where the hard limit allows"))
}
