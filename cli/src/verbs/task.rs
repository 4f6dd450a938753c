//! `shoal task`: something to do for the robots of a running fleet, and what became of it.

use super::{fleet, unknown};
use crate::args::{AssignArg, Format, OneTaskArgs, TaskListArgs, TaskSendArgs, TaskVerb, TaskWaitArgs};
use crate::exit::{self, Failure};
use crate::out;
use bus::{Address, clock};
use daemon::service::written;
use model::{Task, TaskState};
use protocol::operator_to_daemon::{Assign, NewTasks, Reply, Request, TaskChange, TaskFilter, TaskRecord};
use report::{Column, Page, table};
use serde_json::{Value, json};

/// How often `wait` looks.
const LOOK_EVERY_NS: u64 = 50_000_000;
/// More than a fleet keeps.
const ALL: u32 = u32::MAX;

/// Does what the verb says; the exit code.
///
/// # Errors
/// When no fleet is running, its daemon does not answer or refuses, or the verb is not built.
pub fn run(verb: &TaskVerb) -> Result<i32, Failure> {
    match verb {
        TaskVerb::Send(options) => send(options),
        TaskVerb::List(options) => list(options).map(|()| exit::OK),
        TaskVerb::Show(options) => show(options).map(|()| exit::OK),
        TaskVerb::Cancel(options) => cancel(options).map(|()| exit::OK),
        TaskVerb::Wait(options) => wait(options),
        TaskVerb::Other(words) => Err(unknown::refuse_task(words)),
    }
}

fn send(options: &TaskSendArgs) -> Result<i32, Failure> {
    let hint = "goals are X,Y in metres, as in 4,-2.5, or X,Y,YAW with a heading in rad";
    let (robot, goals) = options.robot_and_goals().map_err(|why| Failure::usage(why).hint(hint))?;
    let assign = match (robot, options.assign) {
        (Some(robot), _) => Assign::Robot(robot.to_owned()),
        (None, Some(AssignArg::Optimal)) => Assign::Optimal,
        (None, Some(AssignArg::Auction)) => Assign::Auction,
        (None, _) => Assign::Nearest,
    };
    let TaskSendArgs { now, priority, deadline: deadline_s, .. } = *options;
    let task =
        |goal: &crate::args::Pose| Task { yaw_rad: goal.yaw_rad, now, priority, deadline_s, ..Task::to(goal.at_m) };
    let tasks: Vec<Task> = goals.iter().map(task).collect();
    if now && tasks.len() > 1 && robot.is_some() {
        return Err(Failure::usage("`--now` is for one goal: each would replace the one before")
            .hint("send the first goal with `--now`, and then the others"));
    }
    let address = fleet::choose(&options.fleet)?;
    let request = Request::Task(NewTasks { assign, tasks, key: options.id.clone() });
    let records = match fleet::ask(&address, &request)? {
        Reply::Tasked(records) => records,
        reply => return Err(fleet::confused(&reply)),
    };
    match options.format {
        // One task is an object of its own, as before there were several.
        Format::Json => match &records[..] {
            [record] => {
                let mut value = json!({ "schema": "shoal.task/1", "fleet": address.id() });
                if let (Value::Object(into), Value::Object(from)) = (&mut value, task_json(record, false)) {
                    into.extend(from);
                }
                out::json(&value)?;
            }
            records => out::json(&document(&address, records, false))?,
        },
        Format::Text => {
            let lines: String = records.iter().map(|record| sent_text(record) + "\n").collect();
            out::data(&lines)?;
        }
    }
    let refused = records.iter().any(|record| record.state == TaskState::Refused);
    Ok(if refused { exit::EXPECTATIONS } else { exit::OK })
}

fn sent_text(record: &TaskRecord) -> String {
    let TaskRecord { id, robot, task: Task { goal, now, .. }, state, .. } = record;
    match state {
        TaskState::Refused => format!("task {id}: robot `{robot}` does not take it: {}", reason(record)),
        TaskState::Queued | TaskState::Assigned | TaskState::Active => {
            let when = if *now { "now" } else { "after the goals it has" };
            format!("task {id}: robot `{robot}` heads for {},{} {when}", goal.x, goal.y)
        }
        state => format!("task {id}: {} by robot `{robot}`", state.word()),
    }
}

fn list(options: &TaskListArgs) -> Result<(), Failure> {
    let address = fleet::choose(&options.fleet)?;
    let filter = TaskFilter {
        robot: options.robot.clone(),
        states: options.state.iter().map(|state| state.0).collect(),
        newest: options.newest,
        ..TaskFilter::default()
    };
    let records = ask(&address, filter)?;
    match options.format {
        Format::Json => out::json(&document(&address, &records, false)),
        Format::Text if records.is_empty() => out::data("no task\n"),
        Format::Text => out::data(&table_text(&records, out::stdout_width())),
    }
}

fn table_text(records: &[TaskRecord], width: usize) -> String {
    let columns = [
        Column::right("task", 0),
        Column::left("id", 4, 24),
        Column::left("robot", 1, 32),
        Column::left("state", 0, 10),
        Column::right("goal m", 2),
        Column::right("priority", 6),
        Column::left("assigned", 7, 10),
        Column::left("reason", 3, 60),
    ];
    let row = |record: &TaskRecord| {
        let Task { goal, priority, .. } = record.task;
        vec![
            record.id.to_string(),
            record.key.clone().unwrap_or_default(),
            record.robot.clone(),
            record.state.word().to_owned(),
            format!("{:.2},{:.2}", goal.x, goal.y),
            priority.to_string(),
            assign_word(&record.assign).to_owned(),
            reason(record).to_owned(),
        ]
    };
    let rows: Vec<Vec<String>> = records.iter().map(row).collect();
    let mut page = Page::new(width);
    for line in table(&columns, &rows, 0, page.width()) {
        page.line(&line);
    }
    page.into_text()
}

fn show(options: &OneTaskArgs) -> Result<(), Failure> {
    let address = fleet::choose(&options.fleet)?;
    let records = ask(&address, TaskFilter { which: vec![options.task.clone()], newest: 1, ..TaskFilter::default() })?;
    match (options.format, &records[..]) {
        (Format::Json, records) => out::json(&document(&address, records, true)),
        (Format::Text, records) => out::data(&records.iter().map(whole_text).collect::<String>()),
    }
}

fn whole_text(record: &TaskRecord) -> String {
    let Task { goal, yaw_rad, now, priority, deadline_s } = record.task;
    let yaw = yaw_rad.map_or_else(String::new, |yaw_rad| format!(", heading {yaw_rad} rad"));
    let key = record.key.as_ref().map_or_else(String::new, |key| format!(" ({key})"));
    let deadline = deadline_s.map_or_else(String::new, |deadline_s| format!(", deadline {deadline_s} s"));
    let at_once = if now { ", at once" } else { "" };
    let mut text = format!(
        "task {}{key}: {}\n  goal {},{}{yaw}; priority {priority}{deadline}{at_once}; robot `{}`, {}\n",
        record.id,
        record.state.word(),
        goal.x,
        goal.y,
        record.robot,
        match record.assign {
            Assign::Robot(_) => "named by the sender".to_owned(),
            _ => format!("chosen: {}", assign_word(&record.assign)),
        }
    );
    for step in &record.steps {
        let why = if step.reason.is_empty() { String::new() } else { format!(": {}", step.reason) };
        text += &format!("  {}  {:<9} {}{why}\n", written(step.at_ms), step.state.word(), step.robot);
    }
    text
}

fn cancel(options: &OneTaskArgs) -> Result<(), Failure> {
    let address = fleet::choose(&options.fleet)?;
    let records = match fleet::ask(&address, &Request::Cancel(options.task.clone()))? {
        Reply::Tasks(records) => records,
        reply => return Err(fleet::confused(&reply)),
    };
    match options.format {
        Format::Json => out::json(&document(&address, &records, false)),
        Format::Text => {
            let line = |record: &TaskRecord| {
                format!("task {} of robot `{}` is {}\n", record.id, record.robot, record.state.word())
            };
            out::data(&records.iter().map(line).collect::<String>())
        }
    }
}

fn wait(options: &TaskWaitArgs) -> Result<i32, Failure> {
    let address = fleet::choose(&options.fleet)?;
    let all = TaskFilter { newest: ALL, ..TaskFilter::default() };
    let which = match options.all {
        false => options.tasks.clone(),
        true => {
            let open = TaskFilter { states: open_states(), ..all.clone() };
            ask(&address, open)?.iter().map(|record| record.id.to_string()).collect()
        }
    };
    let until_ns = clock::now_ns().saturating_add((options.timeout.min(1e9) * 1e9) as u64);
    let records = loop {
        let records = match which.is_empty() {
            true => Vec::new(),
            false => ask(&address, TaskFilter { which: which.clone(), ..all.clone() })?,
        };
        if records.iter().all(|record| record.state.is_final()) || clock::now_ns() > until_ns {
            break records;
        }
        clock::sleep_until_ns(clock::now_ns() + LOOK_EVERY_NS);
    };
    match options.format {
        Format::Json => out::json(&document(&address, &records, false))?,
        Format::Text if records.is_empty() => out::data("no task\n")?,
        Format::Text => out::data(&table_text(&records, out::stdout_width()))?,
    }
    let open = records.iter().filter(|record| !record.state.is_final()).count();
    if open > 0 {
        out::talk(&format!("{open} of {} tasks are not at their end after {} s", records.len(), options.timeout));
        return Ok(exit::TIME_OUT);
    }
    let done = records.iter().all(|record| record.state == TaskState::Done);
    Ok(if done { exit::OK } else { exit::EXPECTATIONS })
}

fn open_states() -> Vec<TaskState> {
    TaskState::ALL.iter().copied().filter(|state| !state.is_final()).collect()
}

fn ask(address: &Address, filter: TaskFilter) -> Result<Vec<TaskRecord>, Failure> {
    match fleet::ask(address, &Request::Tasks(filter))? {
        Reply::Tasks(records) => Ok(records),
        reply => Err(fleet::confused(&reply)),
    }
}

fn reason(record: &TaskRecord) -> &str {
    record.steps.last().map_or("", |step| step.reason.as_str())
}

fn assign_word(assign: &Assign) -> &'static str {
    match assign {
        Assign::Robot(_) => "robot",
        Assign::Nearest => "nearest",
        Assign::Optimal => "optimal",
        Assign::Auction => "auction",
    }
}

fn document(address: &Address, records: &[TaskRecord], whole: bool) -> Value {
    let tasks: Vec<Value> = records.iter().map(|record| task_json(record, whole)).collect();
    json!({ "schema": "shoal.tasks/1", "fleet": address.id(), "tasks": tasks })
}

fn task_json(record: &TaskRecord, whole: bool) -> Value {
    let Task { goal, yaw_rad, now, priority, deadline_s } = record.task;
    let mut value = json!({
        "task": record.id, "id": record.key, "robot": record.robot, "state": record.state, "reason": reason(record),
        "goal_m": [goal.x, goal.y], "goal_yaw_rad": yaw_rad, "now": now, "priority": priority,
        "deadline_s": deadline_s, "assign": assign_word(&record.assign),
    });
    if whole {
        let step = |step: &TaskChange| json!({ "time": written(step.at_ms), "state": step.state, "robot": step.robot, "reason": step.reason });
        value["steps"] = record.steps.iter().map(step).collect();
    }
    value
}
