//! Whether a planner has a plan.

use serde::{Deserialize, Serialize};

crate::choice! {
    /// Whether a planner has a plan, for the report.
    #[derive(Default, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum PlanState {
        /// It knows what to do.
        #[default]
        Ready = "ready",
        /// It is still looking for a way; until there is one the robot waits, or makes do.
        Planning = "planning",
        /// It found none, and will not look again until something changes.
        GaveUp = "gave-up",
    }
}
