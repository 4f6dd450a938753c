//! The command line as people and scripts meet it: what it refuses and how, what it prints and where.
//!
//! Long texts are snapshots: `INSTA_UPDATE=always cargo test -p shoal --test cli`, and then read every difference.
#![expect(clippy::disallowed_methods, reason = "these tests write scenarios for the executable to read")]

mod errors;
mod files;
mod help;
mod output;
mod packaging;
mod setup;
mod support;
mod sweep;
mod verbs;
