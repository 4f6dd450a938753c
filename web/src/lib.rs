//! The page on which a fleet is watched and driven, and its server.
//!
//! ```text
//! Live --feed--> newest texts --server--> page/ (HTML, CSS, JavaScript, embedded)
//! Tape (a record) ----------------'  '--- act <-- clicks
//! ```
//! A process of its own, on one thread and one more per fleet that is looked at. Who may look and act is decided in `guard`.

mod act;
mod feed;
mod guard;
mod json;
mod server;
mod tape;

pub use server::{Options, WebError, serve};
pub use tape::Tape;
