//! `shoal ps`: the robots of the running fleets.

mod unanswered;

pub(crate) use unanswered::processes;

use super::fleet;
use crate::args::{Format, PsArgs};
use crate::exit::{self, Failure};
use crate::out;
use bus::Address;
use bus::clean::FleetEntry;
use bus::clock;
use model::{Mode, ProcessState};
use protocol::operator_to_daemon::{Reply, Request, RobotStatus, Status};
use report::numbers::fixed;
use report::{Column, Page, table};
use serde_json::{Value, json};

/// A newest tick that is older is worth a word, s.
const TICK_AGE_S_MAX: f64 = 1.0;

/// Shows them. A fleet whose daemon does not answer is shown as far as it can be seen without it, which is said; exit code
/// 3 if it cannot be seen at all.
///
/// # Errors
/// When the fleet that was named is not running.
pub fn run(options: &PsArgs) -> Result<i32, Failure> {
    let entries = match options.fleet.fleet {
        Some(_) => vec![fleet::choose_entry(&options.fleet)?],
        None => fleet::running()?,
    };
    let (mut fleets, mut failures) = (Vec::new(), Vec::new());
    for entry in &entries {
        let address = &entry.address;
        match seen(entry) {
            Ok(status) => fleets.push((Shown::of(entry), status)),
            // It has ended since it was listed, or another command was clearing it away.
            Err(_) if goes(address) => {}
            Err(failure) => failures.push((address.id(), failure)),
        }
    }
    match options.format {
        Format::Json => {
            let mut list: Vec<Value> = fleets.iter().map(|(shown, status)| fleet_json(shown, status)).collect();
            list.extend(failures.iter().map(|(id, failure)| json!({ "fleet": id, "error": failure.to_string() })));
            out::measured(&json!({ "schema": "shoal.ps/1", "fleets": list }))?;
        }
        Format::Text => {
            let mut page = Page::new(out::stdout_width());
            for (shown, status) in &fleets {
                fleet_text(&mut page, shown, status);
            }
            if fleets.is_empty() && failures.is_empty() {
                page.words("no fleet is running", 0);
            }
            out::data(&page.into_text())?;
        }
    }
    for (id, failure) in &failures {
        out::talk(&format!("fleet {id} does not answer:"));
        out::fail(failure);
    }
    Ok(if failures.is_empty() { exit::OK } else { exit::ENVIRONMENT })
}

/// Whether a fleet goes within a moment: what is left of one that has ended is in the way of questions while it is cleared away.
fn goes(address: &Address) -> bool {
    const LOOKS: u32 = 100;
    const LOOK_EVERY_NS: u64 = 10_000_000;
    (0..LOOKS).any(|look| {
        if look > 0 {
            clock::sleep_until_ns(clock::now_ns() + LOOK_EVERY_NS);
        }
        !address.root().exists()
    })
}

/// A fleet, as its daemon describes it; if that does not answer, which is said, as far as it can be seen without it.
///
/// # Errors
/// When neither is possible.
pub(super) fn seen(entry: &FleetEntry) -> Result<Status, Failure> {
    let address = &entry.address;
    if fleet::is_orphan(entry) {
        let name = entry.name.as_deref().unwrap_or(address.id());
        let seen = unanswered::status(address)?;
        out::talk(&format!("fleet {name}: its daemon has ended, and the fleet goes on without it"));
        out::talk(&fleet::orphan_hint(name));
        return Ok(seen);
    }
    status(address).or_else(|failure: Failure| {
        let seen = unanswered::status(address).map_err(|_| failure.clone())?;
        out::talk(&format!("fleet {}: {}", address.id(), failure.message()));
        out::talk(&format!("fleet {}: shown is what can be seen without its daemon", address.id()));
        Ok(seen)
    })
}

fn status(address: &Address) -> Result<Status, Failure> {
    match fleet::ask(address, &Request::Status)? {
        Reply::Status(status) => Ok(status),
        reply => Err(fleet::confused(&reply)),
    }
}

/// Which fleet a status is of.
struct Shown<'a> {
    id: &'a str,
    name: Option<&'a str>,
    state_directory: Option<String>,
}

impl<'a> Shown<'a> {
    fn of(entry: &'a FleetEntry) -> Shown<'a> {
        let state_directory = fleet::state_of(&entry.address).map(|path| path.to_string_lossy().into_owned());
        Shown { id: entry.address.id(), name: entry.name.as_deref(), state_directory }
    }
}

fn fleet_json(shown: &Shown<'_>, status: &Status) -> Value {
    let mut value = json!({ "fleet": shown.id, "name": shown.name, "state_directory": shown.state_directory });
    if status.daemon_pid == 0 {
        value["orphaned"] = true.into();
    }
    let status = serde_json::to_value(status).expect("a status has string keys only");
    if let (Value::Object(into), Value::Object(from)) = (&mut value, status) {
        into.extend(from);
    }
    value
}

fn fleet_text(page: &mut Page, shown: &Shown<'_>, status: &Status) {
    let id = shown.name.map_or_else(|| shown.id.to_owned(), |name| format!("{name} ({})", shown.id));
    let arrived = status.robots.iter().filter(|robot| robot.arrived).count();
    page.gap();
    page.words(
        &format!(
            "fleet {id}: {}, {}, {:.1} s (tick {}), {arrived} of {} arrived, {}, world {}{}",
            status.scenario,
            status.mode.word(),
            status.time_s,
            status.tick,
            status.robots.len(),
            if status.daemon_pid == 0 { "no daemon".to_owned() } else { format!("daemon {}", status.daemon_pid) },
            status.world_pid,
            world_words(status)
        ),
        2,
    );
    let mut columns = vec![
        Column::left("robot", 0, 32),
        Column::right("pid", 1),
        Column::left("state", 0, 13),
        Column::right("restarts", 5),
        Column::right("position m", 2),
        Column::right("goal m", 3),
        Column::right("done", 6),
        Column::right("left", 4),
        Column::left("method", 7, 20),
    ];
    let mut rows: Vec<Vec<String>> = status.robots.iter().map(robot_row).collect();
    // A slot whose robot has left goes on counting incarnations.
    if status.robots.iter().any(|robot| robot.incarnation != robot.restarts) {
        let at = 1 + columns.iter().position(|column| column.head == "restarts").unwrap_or_default();
        columns.insert(at, Column::right("incarnation", 5));
        for (row, robot) in rows.iter_mut().zip(&status.robots) {
            row.insert(at, robot.incarnation.to_string());
        }
    }
    for line in table(&columns, &rows, 2, page.width()) {
        page.line(&line);
    }
}

/// What is wrong with the world, if anything is, and its pace, if it is not the usual one.
fn world_words(status: &Status) -> String {
    let state = match status.world_state {
        ProcessState::Running => String::new(),
        state => format!(" ({})", state.word()),
    };
    let pace = match (status.paused, status.rate) {
        (true, _) => ", paused".to_owned(),
        (false, Some(rate)) if status.mode != Mode::Realtime => format!(", at {rate} times real time"),
        (false, _) => String::new(),
    };
    let age = match status.tick_age_s.filter(|age_s| *age_s > TICK_AGE_S_MAX && !status.paused) {
        Some(age_s) => format!(", last tick {age_s:.1} s ago"),
        None => String::new(),
    };
    let waits = match &status.waits_for[..] {
        [] => String::new(),
        robots => format!(", waits for {}", report::judge::some_of(robots.iter().map(String::as_str).collect())),
    };
    state + &pace + &age + &waits
}

fn robot_row(robot: &RobotStatus) -> Vec<String> {
    let point = |place: Option<[f64; 2]>| {
        place.map_or_else(|| "-".to_string(), |[x, y]| format!("{},{}", fixed(x, 2), fixed(y, 2)))
    };
    // A robot that has arrived still runs; that it has is what one looks for.
    let state = if robot.arrived && robot.state == ProcessState::Running { "arrived" } else { robot.state.word() };
    vec![
        robot.id.clone(),
        robot.pid.map_or("-".to_string(), |pid| pid.to_string()),
        state.to_string(),
        robot.restarts.to_string(),
        point(robot.position_m),
        point(robot.goal_m),
        robot.goals_done.to_string(),
        robot.goals_left.to_string(),
        robot.planner.clone(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::RobotIndex;

    #[test]
    fn a_fleet_as_a_table() {
        let robot = |slot: u32, state: ProcessState| RobotStatus {
            id: format!("r{slot:02}"),
            index: RobotIndex(slot),
            incarnation: u32::from(slot == 1),
            restarts: u32::from(slot == 1),
            pid: (state == ProcessState::Running).then_some(4700 + slot),
            state,
            planner: "apf".into(),
            position_m: (state != ProcessState::Awaited).then_some([-1.234, 5.0]),
            goal_m: (state != ProcessState::Awaited).then_some([10.0, -20.5]),
            arrived: slot == 0,
            goals_done: 1,
            goals_left: slot,
        };
        let status = Status {
            scenario: "demo-15".into(),
            mode: Mode::Realtime,
            tick: 512,
            time_s: 10.24,
            daemon_pid: 4600,
            world_pid: 4601,
            world_state: ProcessState::Running,
            tick_age_s: Some(0.013),
            paused: false,
            rate: Some(1.0),
            waits_for: Vec::new(),
            robots: [ProcessState::Running, ProcessState::Running, ProcessState::Dead, ProcessState::Awaited]
                .into_iter()
                .zip(0..)
                .map(|(state, slot)| robot(slot, state))
                .collect(),
        };
        let shown = Shown { id: "abcd234", name: None, state_directory: None };
        let mut text = String::new();
        for width in [80, 40] {
            let mut page = Page::new(width);
            fleet_text(&mut page, &shown, &status);
            text += &page.into_text();
        }
        let mut again = status.clone();
        again.robots.truncate(2);
        again.robots[0].incarnation = 3;
        let mut page = Page::new(90);
        fleet_text(&mut page, &shown, &again);
        text += &page.into_text();
        insta::assert_snapshot!(text);
        let json = fleet_json(&shown, &status);
        assert_eq!(world_words(&status), "");
        let waits = Status { tick_age_s: Some(3.21), waits_for: vec!["r01".into(), "r02".into()], ..status.clone() };
        assert_eq!(world_words(&waits), ", last tick 3.2 s ago, waits for r01, r02");
        let lockstep = Status { mode: Mode::Lockstep, rate: Some(0.5), tick_age_s: Some(9.0), ..status.clone() };
        assert_eq!(world_words(&lockstep), ", at 0.5 times real time, last tick 9.0 s ago");
        assert_eq!(world_words(&Status { paused: true, ..lockstep }), ", paused");
        let stopped = Status { world_state: ProcessState::Stopped, tick_age_s: Some(3.21), ..status };
        assert_eq!(world_words(&stopped), " (stopped), last tick 3.2 s ago");
        assert_eq!((&json["fleet"], &json["robots"][1]["pid"]), (&json!("abcd234"), &json!(4701)));
        let absent = &json["robots"][3];
        assert_eq!(
            (&absent["slot"], &absent["state"], &absent["position_m"]),
            (&json!(3), &json!("awaited"), &json!(null))
        );
    }
    #[test]
    #[expect(clippy::disallowed_methods, reason = "another command that clears a fleet away meanwhile")]
    fn a_fleet_that_is_being_cleared_away_is_waited_for() {
        let address = Address::create().unwrap();
        let root = address.root().to_path_buf();
        let clearing = std::thread::spawn(move || {
            std::thread::sleep(std::time::Duration::from_millis(50));
            std::fs::remove_dir_all(root).unwrap();
        });
        assert!(goes(&address));
        clearing.join().unwrap();
    }
}
