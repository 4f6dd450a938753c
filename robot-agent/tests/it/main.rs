//! The agent as its callers see it.

mod agent;
mod ways;
