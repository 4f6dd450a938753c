//! Where processes and robots are: the words of `ps` and of reports.

use serde::{Deserialize, Serialize};

crate::choice! {
    /// Where a process of a fleet is, as `ps` shows it.
    #[derive(Default, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum ProcessState {
        /// Not started yet, and not needed yet.
        #[default]
        Awaited = "awaited",
        /// Started, not yet in the world.
        Starting = "starting",
        /// In the world; of the world itself: it runs.
        Running = "running",
        /// Stopped by the timeline.
        Paused = "paused",
        /// Stopped by a signal from outside the fleet.
        Stopped = "stopped",
        /// Its robot left the world as it should.
        Left = "left",
        /// It died.
        Dead = "dead",
        /// It died once more than its robot's `restart_limit` allows, and is not restarted.
        RestartLimit = "restart-limit",
        /// It ended.
        Ended = "ended",
        /// The world had no place for its robot.
        Refused = "refused",
    }
}

crate::choice! {
    /// What became of a robot, as reports say it.
    #[derive(Default, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum RobotState {
        /// At its last goal.
        Arrived = "arrived",
        /// Not arrived: it made progress, or did not take part at the end.
        #[default]
        UnderWay = "under-way",
        /// It stands, and does not get there.
        Deadlocked = "deadlocked",
        /// It drives, but comes no nearer.
        Livelocked = "livelocked",
        /// It drives, but reverses all the time.
        Oscillating = "oscillating",
        /// Its planner is still looking for a way.
        Planning = "planning",
        /// Its planner found no way.
        GaveUp = "gave-up",
        /// It was not there at the end.
        Gone = "gone",
    }
}

#[cfg(test)]
mod tests {
    use crate::{AtEnd, BodyKind, Gone, Mode, PlanState, ProcessState, RobotState, Stall, Stop, StragglerPolicy};

    #[test]
    fn the_word_in_json_is_the_word_in_tables() {
        macro_rules! check {
            ($($choice:ty)+) => {
                $(for choice in <$choice>::ALL {
                    assert_eq!(serde_json::to_value(choice).unwrap(), choice.word());
                })+
            };
        }
        check! { AtEnd BodyKind Gone Mode PlanState ProcessState RobotState Stall Stop StragglerPolicy }
    }
}
