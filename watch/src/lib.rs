//! A fleet, seen from outside: what a page, a terminal and a player of records show.
//!
//! ```text
//! frames (publish-subscribe) --.
//! odometry (the world's board) +--> Live --> Fleet    what stays: obstacles, robots, names
//! statistics, /proc -----------+        |--> Frame    where everything is, as often as it is asked for
//! the daemon (status, log) ----'        '--> Vitals   how everybody does, about once a second
//! ```
//! The robots do not notice: they are not asked, and what is read of them lies in shared memory anyway. The world writes its frames
//! only while they are asked for ([`Live::rest`]).

mod answer;
mod fleet;
mod frame;
mod live;
mod vitals;

pub use answer::Answer;
pub use fleet::{Arm, Fleet, Form, Member, Thing};
pub use frame::{Body, Frame};
pub use live::Live;
pub use vitals::{Link, Load, Pulse, Vitals};

use bus::BusError;
use std::path::PathBuf;

/// Why a fleet cannot be seen.
#[derive(Debug, thiserror::Error)]
pub enum WatchError {
    /// Its shared memory, or its daemon's socket.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// A file that its daemon left.
    #[error("`{0}`: {1}")]
    File(PathBuf, #[source] std::io::Error),
    /// Such a file is from another build.
    #[error("`{0}`: {1}")]
    Build(PathBuf, #[source] protocol::codec::CodecError),
    /// Its daemon said something else than it was asked for.
    #[error("daemon: unexpected reply")]
    Confused,
}
