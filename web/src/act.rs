//! What the page asks a fleet to do.

use model::{Fault, PaceChange, Rate, Task};
use protocol::operator_to_daemon::{Assign, NewRobot, NewTasks, Request};
use serde::Deserialize;

/// Something to do. Lengths in m.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub(crate) enum Act {
    /// A goal for a robot.
    Task { robot: String, at_m: [f64; 2], now: bool },
    /// One more robot.
    Add { start_m: [f64; 2], goal_m: [f64; 2] },
    /// A robot is to leave.
    Remove { robot: String },
    /// A robot is to get a new process.
    Restart { robot: String },
    /// A robot's process is killed.
    Kill { robot: String },
    /// A robot's process is stopped.
    Halt { robot: String },
    /// It goes on; faults that last end.
    GoOn { robot: String },
    /// Other robots do not hear the robot for this time, s.
    Mute { robot: String, for_s: f64 },
    /// No further tick opens; in `lockstep`.
    Pause,
    /// Ticks follow one another again.
    Resume,
    /// This many ticks, and then none.
    Step { ticks: u64 },
    /// Simulated time per wall time; 0 is as fast as the processes can.
    Rate { factor: f64 },
    /// The fleet is to end.
    Stop,
}

impl Act {
    /// What the daemon is asked for.
    pub(crate) fn request(&self) -> Request {
        let inject = |robot: &str, fault, for_s| Request::Inject { robot: robot.to_owned(), fault, for_s };
        match self {
            Act::Task { robot, at_m, now } => Request::Task(NewTasks {
                assign: Assign::Robot(robot.clone()),
                tasks: vec![Task { now: *now, ..Task::to(*at_m) }],
                key: None,
            }),
            Act::Add { start_m, goal_m } => {
                Request::Add(NewRobot { start_m: *start_m, goal_m: *goal_m, ..NewRobot::default() })
            }
            Act::Remove { robot } => Request::Remove { robot: robot.clone() },
            Act::Restart { robot } => Request::Restart { robot: robot.clone() },
            Act::Kill { robot } => inject(robot, Fault::Kill, None),
            Act::Halt { robot } => inject(robot, Fault::Pause, None),
            Act::GoOn { robot } => inject(robot, Fault::Resume, None),
            Act::Mute { robot, for_s } => inject(robot, Fault::Mute, Some(*for_s)),
            Act::Pause => Request::Pace(PaceChange::Pause),
            Act::Resume => Request::Pace(PaceChange::Resume { rate: None }),
            Act::Step { ticks } => Request::Pace(PaceChange::Step { ticks: *ticks }),
            Act::Rate { factor } => {
                let rate = if *factor == 0.0 { Rate::Max } else { Rate::Factor(*factor) };
                Request::Pace(PaceChange::Resume { rate: Some(rate) })
            }
            Act::Stop => Request::Stop,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_page_says_becomes_a_request() {
        let read = |text: &str| serde_json::from_str::<Act>(text);
        let task = read(r#"{"do":"task","robot":"r1","at_m":[1,2],"now":true}"#).unwrap().request();
        let Request::Task(task) = task else { panic!("{task:?}") };
        assert_eq!((task.assign, task.tasks[0].now), (Assign::Robot("r1".to_owned()), true));
        let kill = read(r#"{"do":"kill","robot":"r1"}"#).unwrap().request();
        assert_eq!(kill, Request::Inject { robot: "r1".to_owned(), fault: Fault::Kill, for_s: None });
        let rate = |factor: &str| read(&format!(r#"{{"do":"rate","factor":{factor}}}"#)).unwrap().request();
        assert_eq!(rate("0"), Request::Pace(PaceChange::Resume { rate: Some(Rate::Max) }));
        assert_eq!(rate("0.5"), Request::Pace(PaceChange::Resume { rate: Some(Rate::Factor(0.5)) }));
        for wrong in [
            "",
            "{}",
            r#"{"do":"fly","robot":"r1"}"#,
            r#"{"do":"kill"}"#,
            r#"{"do":"kill","robot":"r1","more":1}"#,
            r#"{"do":"task","robot":"r1","at_m":[1],"now":true}"#,
            r#"{"do":"task","robot":"r1","at_m":[null,1],"now":true}"#,
        ] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
