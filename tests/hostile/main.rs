//! Files and messages that were made to do harm: each is refused or read, and the memory for it is bounded by its size.
//!
//! A file that took forever would show as a test that does not end.
#![expect(clippy::disallowed_methods, reason = "these tests write files for shoal to read, and take their time")]

#[path = "../counting.rs"]
mod counting;
mod maps;
mod messages;
mod random;
mod records;
mod requests;
mod scenarios;
