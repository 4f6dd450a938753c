//! The harness of the tests.
//!
//! ```text
//! recording   a whole fleet in one thread, every tick of it kept
//! truth       what a run came to, recomputed from those ticks by other means than the world's
//! build       scenarios from short texts and from the catalog; sweeps over seeds
//! process     shoal as a real process, that ends with the test
//! ```

pub mod build;
pub mod process;
pub mod recording;
pub mod truth;

pub use build::{catalog, catalog_names, scenario, seeds};
pub use recording::{Frame, Recording};
