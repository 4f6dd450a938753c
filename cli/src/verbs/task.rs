//! `shoal task`: something to do for a robot of a running fleet.

use super::{fleet, unbuilt};
use crate::args::{Format, Pose, TaskSendArgs, TaskVerb};
use crate::exit::Failure;
use crate::out;
use model::Task;
use protocol::operator_to_daemon::{Reply, Request};
use serde_json::json;

/// Does what the verb says.
///
/// # Errors
/// When no fleet is running, its daemon does not answer or refuses, or the verb is not built.
pub fn run(verb: &TaskVerb) -> Result<(), Failure> {
    match verb {
        TaskVerb::Send(options) => send(options),
        TaskVerb::Other(words) => Err(unbuilt::refuse_task(words)),
    }
}

fn send(options: &TaskSendArgs) -> Result<(), Failure> {
    let address = fleet::choose(&options.fleet)?;
    let TaskSendArgs { id, goal: Pose { at_m: [x, y], yaw_rad }, now, .. } = options;
    let task = Task { goal: [*x, *y].into(), yaw_rad: *yaw_rad, now: *now };
    let request = Request::Task { robot: id.clone(), task };
    match fleet::ask(&address, &request)? {
        Reply::Tasked { id: task } => match options.format {
            Format::Json => out::json(&json!({
                "schema": "shoal.task/1", "fleet": address.id(), "task": task, "robot": id, "goal_m": [x, y],
                "goal_yaw_rad": yaw_rad, "now": now,
            })),
            Format::Text => {
                let when = if *now { "now" } else { "after the goals it has" };
                out::data(&format!("task {task}: robot `{id}` heads for {x},{y} {when}\n"))
            }
        },
        reply => Err(fleet::confused(&reply)),
    }
}
