//! Open files: how many descriptors each process of a fleet needs, and how many it may have.
//!
//! The numbers are what the processes have open (`tests/e2e` counts them in `/proc`), and a few more for what is opened
//! for a moment. A board is counted once per process that opens it.

use rustix::event::{EventfdFlags, eventfd};
use rustix::io::Errno;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// Descriptors that the open board of one robot takes.
pub const PER_BOARD: u64 = 5;
/// The world besides those: node, board, gate, rings, frames, record, outcome.
const WORLD: u64 = 20;
/// An agent besides those of others: node, the world's board, its own.
const AGENT: u64 = 17;
/// The daemon, which opens the board of one robot at a time; some of it for operators and for starting processes.
const DAEMON: u64 = 42 + PER_BOARD;
/// What is open for a moment while a board is opened.
const PASSING: u64 = 8;

/// What the daemon needs, besides what it has inherited.
pub fn of_daemon() -> u64 {
    DAEMON
}

/// What the world needs with this many robots.
pub fn of_world(robots: usize) -> u64 {
    WORLD + PASSING + PER_BOARD * robots as u64
}

/// What an agent needs that hears this many robots at once.
pub fn of_agent(heard: usize) -> u64 {
    AGENT + PASSING + PER_BOARD * heard as u64
}

/// How many robots a fleet can have under this limit, if all of them hear each other.
pub fn robots_max(limit: u64) -> u64 {
    limit.saturating_sub(WORLD + PASSING) / PER_BOARD
}

/// Takes what the hard limit allows, for this process and those that it starts; how many descriptors each may have.
pub fn raise_limit() -> u64 {
    let limit = getrlimit(Resource::Nofile);
    // Refused nowhere: the soft limit may always go up to the hard one. If it is, the soft one counts.
    let raised = setrlimit(Resource::Nofile, Rlimit { current: limit.maximum, maximum: limit.maximum });
    let counts = if raised.is_ok() { limit.maximum } else { limit.current };
    counts.unwrap_or(u64::MAX)
}

/// Whether fewer descriptors are left than opening a board takes, and what the kernel says to that.
pub(crate) fn exhausted() -> Option<Errno> {
    let mut held = Vec::new();
    for _ in 0..PASSING {
        match eventfd(0, EventfdFlags::CLOEXEC) {
            Ok(fd) => held.push(fd),
            Err(errno @ (Errno::MFILE | Errno::NFILE)) => return Some(errno),
            Err(_) => return None,
        }
    }
    None
}

/// Descriptors that this process has open; `None` where `/proc` does not show them.
pub fn open_now() -> Option<u64> {
    let entries = std::fs::read_dir("/proc/self/fd").ok()?;
    // The listing itself is one of them.
    Some((entries.count() as u64).saturating_sub(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_allows_as_many_robots_as_the_world_can_read() {
        for limit in [0, 27, 64, 256, 1024, 4096, 1_048_576] {
            let robots = robots_max(limit);
            assert!(robots == 0 || of_world(robots as usize) <= limit, "{limit}: {robots}");
            assert!(of_world(robots as usize + 1) > limit, "{limit}: {robots}");
            assert!(robots == 0 || of_agent(robots as usize - 1) <= limit, "{limit}: an agent hears all others");
        }
    }

    #[test]
    fn there_are_descriptors_left() {
        assert_eq!(exhausted(), None);
        assert!(open_now().is_some_and(|open| open >= 3));
    }
}
