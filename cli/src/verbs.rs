//! The verbs of the command line, one file each. `run` has a module of its own.

pub mod add;
pub mod bench;
pub mod clean;
pub mod doctor;
pub mod down;
pub mod export;
pub mod fleet;
pub mod inject;
pub mod internal;
pub mod latency;
pub mod logs;
pub mod metrics;
pub mod planners;
pub mod plot;
pub mod ps;
pub mod remove;
pub mod reproduce;
pub mod restart;
pub mod schema;
pub mod stress;
pub mod sweep;
pub mod task;
pub mod unbuilt;
pub mod up;
pub mod validate;
