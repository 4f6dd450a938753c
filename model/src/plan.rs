//! Whether a planner has a plan.

use serde::{Deserialize, Serialize};

/// Whether a method has a plan, for the report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PlanState {
    /// It knows what to do.
    #[default]
    Ready,
    /// It is still looking for a way; until there is one the robot waits, or makes do.
    Planning,
    /// It found none, and will not look again until something changes.
    GaveUp,
}

impl PlanState {
    /// Its word in events and reports.
    pub fn word(self) -> &'static str {
        match self {
            PlanState::Ready => "ready",
            PlanState::Planning => "planning",
            PlanState::GaveUp => "gave-up",
        }
    }
}
