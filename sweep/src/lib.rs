//! Sweeps: scenarios x planners x varied keys x seeds, each a run of its own, and what all of them together say.
//!
//! ```text
//! Plan --run(i)--> Run --execute--> Record --line--> runs.jsonl
//!                                     |
//!                  all Records --summarize--> Summary --text::render--> people
//!                                     |          '-----JSON-----------> programs
//!                                     '--database, box plots
//! ```
//! `plan`, `record`, `statistics`, `row`, `assertion`, `summary` and `text` are pure. The shells are `execute` (a run in this thread),
//! `pool` (threads), `directory` (files, locks) and `database` (SQLite).
//!
//! The result of a sweep depends on its plan alone: records are put in the order of the plan, and neither wall time nor
//! processor time is in the summary or in the database. So a sweep that was killed and resumed has the result of one that
//! was not.

pub mod assertion;
pub mod database;
pub mod directory;
mod error;
pub mod execute;
pub mod plan;
pub mod pool;
pub mod record;
pub mod row;
pub mod statistics;
pub mod summary;
pub mod text;

pub use assertion::Assertion;
pub use error::{Error, ErrorKind};
pub use plan::{Plan, Run, ScenarioSource, Varied};
pub use record::Record;
pub use summary::Summary;
