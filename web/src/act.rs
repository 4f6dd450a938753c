//! What the page asks a fleet to do, and what it is answered.

use model::{Fault, PaceChange, Rate, Task};
use protocol::operator_to_daemon::{Assign, NewRobot, NewTasks, Reply, Request};
use serde::{Deserialize, Serialize};

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
    /// Others do not hear the robot for so long, s.
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

/// What came of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Answer {
    /// It was done.
    pub(crate) done: bool,
    /// What was done, or why not.
    pub(crate) words: String,
    /// The way out.
    pub(crate) hint: Option<String>,
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

impl Answer {
    /// What the daemon said.
    pub(crate) fn of(reply: &Reply) -> Answer {
        let done = |words: String| Answer { done: true, words, hint: None };
        match reply {
            Reply::Tasked(records) => {
                let of = |record: &protocol::operator_to_daemon::TaskRecord| {
                    format!("task {} of {} is {}", record.id, record.robot, record.state.word())
                };
                done(records.iter().map(of).collect::<Vec<_>>().join("; "))
            }
            Reply::Joined { robot, joined_ms, neighbors, .. } => {
                done(format!("{robot} joined after {joined_ms:.0} ms and hears {neighbors}"))
            }
            Reply::Removed { robot } => done(format!("{robot} has left")),
            Reply::Injected { .. } => done("done".to_owned()),
            Reply::Pace(state) => {
                let paused = if state.paused { "paused" } else { "goes on" };
                done(format!("{paused} at tick {}", state.tick))
            }
            Reply::Stopping => done("the fleet ends".to_owned()),
            Reply::Refused { problem, hint } => Answer { done: false, words: problem.clone(), hint: hint.clone() },
            Reply::Failed { problem, hint } | Reply::Unconfirmed { problem, hint } => {
                Answer { done: false, words: problem.clone(), hint: Some(hint.clone()) }
            }
            Reply::Status(_) | Reply::Events(_) | Reply::Tasks(_) => {
                Answer { done: false, words: "the daemon said something else".to_owned(), hint: None }
            }
        }
    }

    /// It could not be asked for.
    pub(crate) fn failed(words: String) -> Answer {
        Answer { done: false, words, hint: None }
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

    #[test]
    fn a_refusal_keeps_its_words_and_its_way_out() {
        let refused = Reply::Refused { problem: "unknown robot `x`".to_owned(), hint: Some("known: a".to_owned()) };
        let answer = Answer::of(&refused);
        assert_eq!(
            (answer.done, answer.words.as_str(), answer.hint.as_deref()),
            (false, "unknown robot `x`", Some("known: a"))
        );
        assert!(Answer::of(&Reply::Stopping).done);
    }
}
