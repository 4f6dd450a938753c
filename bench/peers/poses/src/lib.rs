//! One loop for every transport: a robot reads the newest pose of every other one, takes a step, publishes its own, 50
//! times a second. What differs from transport to transport is behind [`Transport`]; everything else, what is measured
//! included, is the same code.
//!
//! **What is measured.** Robot i of N is `due` at `start + k * period + i * period / N`, on an absolute timer. It has
//! `woken` when the sleep returns; `used` is the moment at which it has the newest poses of all others in hand.
//!
//! - *age*: `used` less the stamp that the writer put into the pose just before it handed it to the transport.
//! - *late*: `woken` less `due`: the timer's own lateness, and the wait for a processor that others keep busy.
//! - *added*: the age beyond the phase offset of writer and reader and the reader's own lateness. It is `used` less
//!   `woken`, and a whole period for every pose of that writer that was due before the reader was and is not in hand:
//!   on its way still, lost, or not written in time. Zero if transport and scheduler took no time at all. A pose that
//!   is younger than it had to be, because the reader woke late, takes nothing off.
//! - *lost*: poses that the reader never had in hand at any of its steps, of those that it should have.

pub mod agent;
pub mod clock;
pub mod latest;
pub mod link;
pub mod pose;
pub mod samples;

pub use agent::{Args, run};
pub use latest::Latest;
pub use pose::Pose;

/// Rate of the loop, Hz.
pub const RATE_HZ: u64 = 50;
/// Period of the loop, ns.
pub const PERIOD_NS: u64 = 1_000_000_000 / RATE_HZ;
/// Ticks before anything is recorded.
pub const WARM_UP_TICKS: u64 = RATE_HZ / 2;

/// Why something of a peer did not work, in words.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// How poses get from robot to robot.
pub trait Transport {
    /// Opens what can be opened by now; called again and again until every other robot has been heard.
    ///
    /// # Errors
    /// When the transport can never connect. Somebody who is not there yet is not an error.
    fn connect(&mut self) -> Result<(), Failure> {
        Ok(())
    }

    /// Tells everybody this robot's pose.
    ///
    /// # Errors
    /// When the transport is broken. A pose that it may drop, it drops.
    fn publish(&mut self, pose: &Pose) -> Result<(), Failure>;

    /// The newest pose of another robot that is here by now; `None` before the first one. Must not wait.
    fn newest(&mut self, robot: usize) -> Option<Pose>;
}
