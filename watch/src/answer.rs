//! What a daemon answers to what was asked of it, for people who look at the fleet.

use protocol::operator_to_daemon::{Reply, TaskRecord};
use serde::Serialize;

/// What came of a request.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Answer {
    /// It was done.
    pub done: bool,
    /// What was done, or why not.
    pub words: String,
    /// The way out.
    pub hint: Option<String>,
}

impl Answer {
    /// What the daemon said.
    pub fn of(reply: &Reply) -> Answer {
        let done = |words: String| Answer { done: true, words, hint: None };
        match reply {
            Reply::Tasked(records) => {
                let of =
                    |record: &TaskRecord| format!("task {} of {} is {}", record.id, record.robot, record.state.word());
                done(records.iter().map(of).collect::<Vec<_>>().join("; "))
            }
            Reply::Joined { robot, joined_ms, neighbors, .. } => {
                done(format!("{robot} joined after {joined_ms:.0} ms and hears {neighbors}"))
            }
            Reply::Removed { robot } => done(format!("{robot} has left")),
            Reply::Injected { .. } => done("done".to_owned()),
            Reply::Pace(state) => {
                let paused = if state.paused { "paused at" } else { "goes on from" };
                done(format!("{paused} tick {}", state.tick))
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
    pub fn failed(words: String) -> Answer {
        Answer { done: false, words, hint: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
