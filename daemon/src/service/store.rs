//! The database of a fleet that is left running: tasks, robots, events and runs, in one SQLite file.
//!
//! The daemon alone writes it; anybody may read it with their own tools (docs/running.md has the tables). What is kept here
//! has been written to the disk when the call returns (`synchronous = FULL`). Nothing is ever written into a file that is
//! not one of these.

use super::time::wall_ms;
use crate::error::{Error, Kind};
use model::{Task, TaskId, TaskState};
use protocol::operator_to_daemon::{Assign, TaskChange, TaskRecord};
use rusqlite::{Connection, ErrorCode, OpenFlags, Row, Transaction, params};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Its name in the state directory.
pub const FILE: &str = "fleet.db";
/// `shoa`: says whose file it is.
const APPLICATION_ID: i32 = 0x7368_6f61;
/// Goes up when the tables change.
const SCHEMA_VERSION: i32 = 1;
/// The longest wait for another program that writes.
const BUSY: Duration = Duration::from_millis(500);
/// Events that are kept; the oldest go.
const EVENTS_MAX: i64 = 100_000;
/// Ended tasks that a daemon takes over when it starts.
const ENDED_MAX: i64 = 1000;

const SCHEMA: &str = "
CREATE TABLE run (
    id INTEGER PRIMARY KEY,
    fleet TEXT NOT NULL,
    scenario TEXT NOT NULL,
    version TEXT NOT NULL,
    started_ms INTEGER NOT NULL,
    ended_ms INTEGER,
    ending TEXT
);
CREATE TABLE task (
    id INTEGER PRIMARY KEY,
    key TEXT UNIQUE,
    assign TEXT NOT NULL,
    robot TEXT NOT NULL,
    x_m REAL NOT NULL,
    y_m REAL NOT NULL,
    yaw_rad REAL,
    at_once INTEGER NOT NULL,
    priority INTEGER NOT NULL,
    deadline_s REAL,
    state TEXT NOT NULL,
    reason TEXT NOT NULL,
    sent_ms INTEGER NOT NULL,
    changed_ms INTEGER NOT NULL
);
CREATE INDEX task_by_state ON task (state);
CREATE TABLE task_step (
    task INTEGER NOT NULL REFERENCES task (id),
    number INTEGER NOT NULL,
    at_ms INTEGER NOT NULL,
    state TEXT NOT NULL,
    robot TEXT NOT NULL,
    reason TEXT NOT NULL,
    PRIMARY KEY (task, number)
) WITHOUT ROWID;
CREATE TABLE robot (
    name TEXT PRIMARY KEY,
    slot INTEGER NOT NULL,
    incarnation INTEGER NOT NULL,
    planner TEXT NOT NULL,
    state TEXT NOT NULL,
    changed_ms INTEGER NOT NULL
) WITHOUT ROWID;
CREATE TABLE event (
    id INTEGER PRIMARY KEY,
    run INTEGER NOT NULL REFERENCES run (id),
    at_ms INTEGER NOT NULL,
    tick INTEGER NOT NULL,
    robot TEXT,
    name TEXT NOT NULL,
    detail TEXT NOT NULL
);
";

/// The database, open.
pub struct Store {
    db: Connection,
    path: PathBuf,
    run: i64,
}

/// An entry of the run's log.
#[derive(Clone, Debug, PartialEq)]
pub struct EventRow {
    /// The tick at which it happened.
    pub tick: u64,
    /// The name of the robot that it is about, if it is about one.
    pub robot: Option<String>,
    /// Its name.
    pub name: &'static str,
    /// More about it; may be empty.
    pub detail: String,
}

/// A robot as it is now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RobotRow {
    /// Its name.
    pub name: String,
    /// Its index.
    pub slot: u32,
    /// Its incarnation.
    pub incarnation: u32,
    /// Its planner.
    pub planner: String,
    /// Its state, in a word.
    pub state: &'static str,
}

/// What is to be written together.
#[derive(Debug, Default)]
pub struct Batch {
    /// Tasks that are new or have changed.
    pub tasks: Vec<TaskRecord>,
    /// Robots that are new or have changed.
    pub robots: Vec<RobotRow>,
    /// Entries of the log.
    pub events: Vec<EventRow>,
}

impl Batch {
    /// Whether there is nothing to write.
    pub fn is_empty(&self) -> bool {
        self.tasks.is_empty() && self.robots.is_empty() && self.events.is_empty()
    }
}

impl Store {
    /// Opens the database in a state directory; makes it if there is none.
    ///
    /// # Errors
    /// When there is a file that is not one of these, is damaged, or is of another version; when the disk is full.
    pub fn open(directory: &Path) -> Result<Store, Error> {
        let path = directory.join(FILE);
        let is_new = match std::fs::symlink_metadata(&path) {
            Ok(meta) if meta.is_file() && meta.len() > 0 => false,
            Ok(meta) if meta.is_file() => {
                return Err(foreign(&path, "it is empty: it was cut off, or something else made it"));
            }
            Ok(_) => return Err(foreign(&path, "it is not a file")),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => true,
            Err(error) => return Err(foreign(&path, &error.to_string())),
        };
        // Under another name until it is whole: a daemon that is killed here leaves nothing that looks damaged.
        let draft = directory.join(format!("{FILE}.new"));
        if is_new {
            let _ = std::fs::remove_file(&draft);
            make_private(&draft).map_err(|error| foreign(&path, &error.to_string()))?;
            create(&draft).map_err(|error| failed(&path, &error))?;
            std::fs::rename(&draft, &path).map_err(|error| foreign(&path, &error.to_string()))?;
        }
        let db = connect(&path, OpenFlags::SQLITE_OPEN_READ_WRITE).and_then(|db| {
            check(&db, &path)?;
            db.pragma_update(None, "journal_mode", "wal").map_err(|error| failed(&path, &error))?;
            db.pragma_update(None, "synchronous", "full").map_err(|error| failed(&path, &error))?;
            Ok(db)
        })?;
        Ok(Store { db, path, run: 0 })
    }

    /// Tasks that are not at their end, and the newest of the others; and the first number that is free.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn tasks(&self) -> Result<(Vec<TaskRecord>, TaskId), Error> {
        let read = || -> rusqlite::Result<_> {
            let ended = "('done', 'failed', 'cancelled', 'refused')";
            let sql = format!(
                "SELECT * FROM task WHERE state NOT IN {ended} OR id IN \
                 (SELECT id FROM task WHERE state IN {ended} ORDER BY id DESC LIMIT {ENDED_MAX}) ORDER BY id"
            );
            let mut query = self.db.prepare(&sql)?;
            let mut records: Vec<TaskRecord> = query.query_map([], record_of)?.collect::<rusqlite::Result<_>>()?;
            let mut steps =
                self.db.prepare("SELECT at_ms, state, robot, reason FROM task_step WHERE task = ? ORDER BY number")?;
            for record in &mut records {
                let step = |row: &Row<'_>| {
                    Ok(TaskChange {
                        at_ms: row.get::<_, i64>(0)?.unsigned_abs(),
                        state: state_of(&row.get::<_, String>(1)?, 1)?,
                        robot: row.get(2)?,
                        reason: row.get(3)?,
                    })
                };
                record.steps = steps.query_map([record.id.0], step)?.collect::<rusqlite::Result<_>>()?;
            }
            let last: Option<u32> = self.db.query_row("SELECT max(id) FROM task", [], |row| row.get(0))?;
            Ok((records, TaskId(last.map_or(0, |last| last.saturating_add(1)))))
        };
        read().map_err(|error| failed(&self.path, &error))
    }

    /// A run of the fleet begins: what is written from here on belongs to it.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn begin_run(&mut self, fleet: &str, scenario: &str) -> Result<(), Error> {
        let begin = || -> rusqlite::Result<i64> {
            // A run without an end was killed.
            self.db.execute("UPDATE run SET ending = 'killed' WHERE ended_ms IS NULL AND ending IS NULL", [])?;
            self.db.execute("DELETE FROM robot", [])?;
            self.db.execute(
                "INSERT INTO run (fleet, scenario, version, started_ms) VALUES (?, ?, ?, ?)",
                params![fleet, scenario, env!("CARGO_PKG_VERSION"), wall_ms() as i64],
            )?;
            Ok(self.db.last_insert_rowid())
        };
        self.run = begin().map_err(|error| failed(&self.path, &error))?;
        Ok(())
    }

    /// Goes on with the run of a fleet whose daemon has ended.
    ///
    /// # Errors
    /// When it cannot be read, or written.
    pub fn resume_run(&mut self, fleet: &str, scenario: &str) -> Result<(), Error> {
        let sql = "SELECT id FROM run WHERE fleet = ? AND ended_ms IS NULL ORDER BY id DESC LIMIT 1";
        match self.db.query_row(sql, [fleet], |row| row.get(0)) {
            Ok(run) => self.run = run,
            Err(rusqlite::Error::QueryReturnedNoRows) => self.begin_run(fleet, scenario)?,
            Err(error) => return Err(failed(&self.path, &error)),
        }
        Ok(())
    }

    /// The run has ended, in these words.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn end_run(&mut self, ending: &str) -> Result<(), Error> {
        let ended = self.db.execute(
            "UPDATE run SET ended_ms = ?, ending = ? WHERE id = ?",
            params![wall_ms() as i64, ending, self.run],
        );
        ended.map(drop).map_err(|error| failed(&self.path, &error))
    }

    /// Writes all of it, or nothing. When this returns it is on the disk.
    ///
    /// # Errors
    /// When the disk is full, or the database damaged or locked; in one line.
    pub fn keep(&mut self, batch: &Batch) -> Result<(), Error> {
        let run = self.run;
        let keep = |db: &mut Connection| -> rusqlite::Result<()> {
            let transaction = db.transaction()?;
            batch.tasks.iter().try_for_each(|record| keep_task(&transaction, record))?;
            let at_ms = wall_ms() as i64;
            for robot in &batch.robots {
                transaction
                    .prepare_cached("INSERT OR REPLACE INTO robot VALUES (?, ?, ?, ?, ?, ?)")?
                    .execute(params![robot.name, robot.slot, robot.incarnation, robot.planner, robot.state, at_ms])?;
            }
            for event in &batch.events {
                let sql = "INSERT INTO event (run, at_ms, tick, robot, name, detail) VALUES (?, ?, ?, ?, ?, ?)";
                let row = params![run, at_ms, event.tick as i64, event.robot, event.name, event.detail];
                transaction.prepare_cached(sql)?.execute(row)?;
            }
            if !batch.events.is_empty() {
                let oldest = transaction.last_insert_rowid() - EVENTS_MAX;
                transaction.prepare_cached("DELETE FROM event WHERE id <= ?")?.execute([oldest])?;
            }
            transaction.commit()
        };
        keep(&mut self.db).map_err(|error| failed(&self.path, &error))
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

fn connect(path: &Path, flags: OpenFlags) -> Result<Connection, Error> {
    let flags = flags | OpenFlags::SQLITE_OPEN_NO_MUTEX | OpenFlags::SQLITE_OPEN_NOFOLLOW;
    let db = Connection::open_with_flags(path, flags).map_err(|error| failed(path, &error))?;
    db.busy_timeout(BUSY).map_err(|error| failed(path, &error))?;
    Ok(db)
}

/// An empty file that its owner alone may read: SQLite gives its other files the same permissions.
fn make_private(path: &Path) -> std::io::Result<()> {
    std::fs::OpenOptions::new().write(true).create_new(true).mode(0o600).open(path).map(drop)
}

fn create(path: &Path) -> rusqlite::Result<()> {
    let mut db = Connection::open(path)?;
    let transaction = db.transaction()?;
    transaction.execute_batch(SCHEMA)?;
    transaction.pragma_update(None, "application_id", APPLICATION_ID)?;
    transaction.pragma_update(None, "user_version", SCHEMA_VERSION)?;
    transaction.commit()
}

/// Whether it is a database of this kind and version, and whole.
fn check(db: &Connection, path: &Path) -> Result<(), Error> {
    let pragma = |name: &str| db.pragma_query_value(None, name, |row| row.get::<_, i32>(0));
    let id = pragma("application_id").map_err(|error| failed(path, &error))?;
    if id != APPLICATION_ID {
        return Err(foreign(path, "it is a database of another program"));
    }
    let version = pragma("user_version").map_err(|error| failed(path, &error))?;
    if version != SCHEMA_VERSION {
        let cause = format!("it has version {version} of the tables, this executable has version {SCHEMA_VERSION}");
        return Err(foreign(path, &cause));
    }
    let found: String =
        db.query_row("PRAGMA quick_check(1)", [], |row| row.get(0)).map_err(|error| failed(path, &error))?;
    if found != "ok" {
        return Err(foreign(path, &format!("it is damaged: {found}")));
    }
    Ok(())
}

fn keep_task(transaction: &Transaction<'_>, record: &TaskRecord) -> rusqlite::Result<()> {
    let (Some(first), Some(last)) = (record.steps.first(), record.steps.last()) else { return Ok(()) };
    let Task { goal, yaw_rad, now, priority, deadline_s } = record.task;
    let sql = "INSERT INTO task VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?) \
               ON CONFLICT (id) DO UPDATE SET robot = excluded.robot, state = excluded.state, reason = excluded.reason, \
               changed_ms = excluded.changed_ms";
    transaction.prepare_cached(sql)?.execute(params![
        record.id.0,
        record.key,
        assign_word(&record.assign),
        record.robot,
        goal.x,
        goal.y,
        yaw_rad,
        now,
        priority,
        deadline_s,
        record.state.word(),
        last.reason,
        first.at_ms as i64,
        last.at_ms as i64,
    ])?;
    let mut step = transaction.prepare_cached("INSERT OR IGNORE INTO task_step VALUES (?, ?, ?, ?, ?, ?)")?;
    for (number, change) in record.steps.iter().enumerate() {
        let TaskChange { at_ms, state, robot, reason } = change;
        step.execute(params![record.id.0, number as i64, *at_ms as i64, state.word(), robot, reason])?;
    }
    Ok(())
}

/// How a robot was chosen, as the table has it.
fn assign_word(assign: &Assign) -> &'static str {
    match assign {
        Assign::Robot(_) => "robot",
        Assign::Nearest => "nearest",
        Assign::Optimal => "optimal",
        Assign::Auction => "auction",
    }
}

fn record_of(row: &Row<'_>) -> rusqlite::Result<TaskRecord> {
    let robot: String = row.get("robot")?;
    let assign = match row.get::<_, String>("assign")?.as_str() {
        "nearest" => Assign::Nearest,
        "optimal" => Assign::Optimal,
        "auction" => Assign::Auction,
        _ => Assign::Robot(robot.clone()),
    };
    let goal = [row.get::<_, f64>("x_m")?, row.get("y_m")?];
    let task = Task {
        yaw_rad: row.get("yaw_rad")?,
        now: row.get("at_once")?,
        priority: row.get("priority")?,
        deadline_s: row.get("deadline_s")?,
        ..Task::to(goal)
    };
    Ok(TaskRecord {
        id: TaskId(row.get("id")?),
        key: row.get("key")?,
        assign,
        robot,
        task,
        state: state_of(&row.get::<_, String>("state")?, 10)?,
        steps: Vec::new(),
    })
}

fn state_of(word: &str, column: usize) -> rusqlite::Result<TaskState> {
    let known = TaskState::ALL.iter().find(|state| state.word() == word).copied();
    known.ok_or_else(|| {
        let cause = format!("`{word}` is not the state of a task").into();
        rusqlite::Error::FromSqlConversionFailure(column, rusqlite::types::Type::Text, cause)
    })
}

/// A file that must not be written into.
fn foreign(path: &Path, cause: &str) -> Error {
    Error::new(Kind::State, format!("database `{}`: {cause}", path.display()))
        .detail("it was not touched")
        .hint("move it away, or choose another directory with `--state DIR`")
}

fn failed(path: &Path, error: &rusqlite::Error) -> Error {
    let (cause, hint) = match error.sqlite_error_code() {
        Some(ErrorCode::DiskFull) => {
            ("the disk is full", "make room; what could not be kept is said, and the fleet goes on")
        }
        Some(ErrorCode::NotADatabase) => return foreign(path, "it is not a database"),
        Some(ErrorCode::DatabaseCorrupt) => return foreign(path, &format!("it is damaged: {error}")),
        Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => {
            ("another program is writing it", "only the daemon writes it; end the other program's transaction")
        }
        Some(ErrorCode::ReadOnly | ErrorCode::PermissionDenied) => ("it may not be written", "check its permissions"),
        _ => {
            return Error::new(Kind::State, format!("database `{}`: {error}", path.display()))
                .hint("is the disk full, or the file damaged? `sqlite3 FILE 'PRAGMA integrity_check'`");
        }
    };
    Error::new(Kind::State, format!("database `{}`: {cause}", path.display())).hint(hint)
}

#[cfg(test)]
mod tests;
