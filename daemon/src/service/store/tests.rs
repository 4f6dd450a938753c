#![expect(clippy::disallowed_methods, reason = "databases are files")]

use super::*;
use std::os::unix::fs::FileExt;
use tempfile::TempDir;

fn record(id: u32, states: &[(TaskState, &str)]) -> TaskRecord {
    let robot = "r01".to_owned();
    let step = |(number, (state, reason)): (usize, &(TaskState, &str))| TaskChange {
        at_ms: 1000 * u64::from(id) + number as u64,
        state: *state,
        robot: robot.clone(),
        reason: (*reason).to_owned(),
    };
    let steps: Vec<TaskChange> = states.iter().enumerate().map(step).collect();
    TaskRecord {
        id: TaskId(id),
        key: id.is_multiple_of(2).then(|| format!("order-{id}")),
        assign: if id == 3 { Assign::Optimal } else { Assign::Robot(robot.clone()) },
        robot,
        task: Task {
            yaw_rad: Some(0.1 + f64::from(id)),
            priority: -2,
            deadline_s: Some(30.5),
            ..Task::to([1.0 / 3.0, -2.0])
        },
        state: states[states.len() - 1].0,
        steps,
    }
}

fn keep(store: &mut Store, tasks: Vec<TaskRecord>) -> Result<(), Error> {
    store.keep(&Batch { tasks, ..Batch::default() })
}

#[test]
fn what_was_kept_is_there_again() {
    let directory = TempDir::new().unwrap();
    let mut store = Store::open(directory.path()).unwrap();
    assert_eq!(store.tasks().unwrap(), (Vec::new(), TaskId(0)));
    store.begin_run("abcd234", "demo-15").unwrap();
    use TaskState::{Active, Assigned, Done, Failed, Queued};
    let (first, second) = (record(2, &[(Queued, "")]), record(3, &[(Queued, ""), (Failed, "gone")]));
    keep(&mut store, vec![first, second.clone()]).unwrap();
    let first = record(2, &[(Queued, ""), (Assigned, ""), (Active, "")]);
    keep(&mut store, vec![first.clone()]).unwrap();
    drop(store);
    let mut store = Store::open(directory.path()).unwrap();
    assert_eq!(store.tasks().unwrap(), (vec![first, second.clone()], TaskId(4)));
    let first = record(2, &[(Queued, ""), (Assigned, ""), (Active, ""), (Done, "")]);
    keep(&mut store, vec![first.clone()]).unwrap();
    assert_eq!(store.tasks().unwrap().0, [first, second]);
    // A key is that of one task for ever.
    let taken = TaskRecord { key: Some("order-2".to_owned()), ..record(9, &[(Queued, "")]) };
    let both = vec![record(8, &[(Queued, "")]), taken];
    assert!(keep(&mut store, both).is_err());
    assert_eq!(store.tasks().unwrap().1, TaskId(4), "all of it or nothing");
}

#[test]
fn events_and_robots_are_kept_within_bounds() {
    let directory = TempDir::new().unwrap();
    let mut store = Store::open(directory.path()).unwrap();
    store.begin_run("abcd234", "demo-15").unwrap();
    let event =
        |tick: u64| EventRow { tick, robot: Some("r01".to_owned()), name: "died", detail: "signal 9".to_owned() };
    let robot = |incarnation: u32| RobotRow {
        name: "r01".to_owned(),
        slot: 1,
        incarnation,
        planner: "apf".to_owned(),
        state: "running",
    };
    let whole =
        Batch { events: (0..EVENTS_MAX as u64).map(event).collect(), robots: vec![robot(0)], ..Batch::default() };
    store.keep(&whole).unwrap();
    store.keep(&Batch { events: (0..7).map(event).collect(), robots: vec![robot(3)], ..Batch::default() }).unwrap();
    let count = |sql: &str| store.db.query_row(sql, [], |row| row.get::<_, i64>(0)).unwrap();
    assert_eq!(count("SELECT count(*) FROM event"), EVENTS_MAX);
    assert_eq!(count("SELECT incarnation FROM robot WHERE name = 'r01'"), 3);
    assert_eq!(count("SELECT run FROM event LIMIT 1"), 1);
    store.end_run("stopped").unwrap();
    store.begin_run("abcd235", "demo-15").unwrap();
    store.begin_run("abcd236", "demo-15").unwrap();
    let endings: Vec<Option<String>> = {
        let mut query = store.db.prepare("SELECT ending FROM run ORDER BY id").unwrap();
        query.query_map([], |row| row.get(0)).unwrap().map(Result::unwrap).collect()
    };
    assert_eq!(endings, [Some("stopped".to_owned()), Some("killed".to_owned()), None]);
}

#[test]
fn files_that_are_not_a_store_are_refused_and_left_as_they_are() {
    let check = |make: &dyn Fn(&Path), cause: &str| {
        let directory = TempDir::new().unwrap();
        let path = directory.path().join(FILE);
        make(&path);
        let before = std::fs::read(&path).unwrap();
        let error = Store::open(directory.path()).map(|_| ()).unwrap_err();
        assert!(error.message.contains(cause) && error.message.contains(FILE), "{cause}: {error}");
        assert!(error.hints.iter().any(|hint| hint.contains("--state")), "{error:?}");
        assert_eq!(std::fs::read(&path).unwrap(), before, "{cause}: it was written");
    };
    let made = |path: &Path| {
        let mut store = Store::open(path.parent().unwrap()).unwrap();
        keep(&mut store, (0..200).map(|id| record(id, &[(TaskState::Queued, "")])).collect()).unwrap();
        // All of it in one file.
        store.db.pragma_update(None, "journal_mode", "delete").unwrap();
    };
    check(&|path| std::fs::write(path, "").unwrap(), "it is empty");
    check(&|path| std::fs::write(path, "a text of some length, and no database").unwrap(), "not a database");
    check(&|path| Connection::open(path).unwrap().execute_batch("CREATE TABLE mine (x)").unwrap(), "another program");
    check(
        &|path| {
            made(path);
            Connection::open(path).unwrap().pragma_update(None, "user_version", SCHEMA_VERSION + 1).unwrap();
        },
        "version 2",
    );
    check(
        &|path| {
            made(path);
            let file = std::fs::OpenOptions::new().write(true).open(path).unwrap();
            file.set_len(file.metadata().unwrap().len() / 2).unwrap();
        },
        "damaged",
    );
    check(
        &|path| {
            made(path);
            let file = std::fs::OpenOptions::new().write(true).open(path).unwrap();
            let pages = file.metadata().unwrap().len() / 4096;
            (2..pages).for_each(|page| file.write_all_at(&[0x5a; 4096], page * 4096).unwrap());
        },
        "damaged",
    );
}

#[test]
fn others_may_read_while_it_is_written() {
    let directory = TempDir::new().unwrap();
    let mut store = Store::open(directory.path()).unwrap();
    let reader = connect(&directory.path().join(FILE), OpenFlags::SQLITE_OPEN_READ_ONLY).unwrap();
    let mut query = reader.prepare("SELECT id FROM task").unwrap();
    for id in 0..20 {
        keep(&mut store, vec![record(id, &[(TaskState::Queued, "")])]).unwrap();
        let seen = query.query_map([], |row| row.get::<_, u32>(0)).unwrap().map(Result::unwrap).max();
        assert_eq!(seen, Some(id));
    }
    // A program that writes is waited for, within bounds, and then it is an error.
    let writer = connect(&directory.path().join(FILE), OpenFlags::SQLITE_OPEN_READ_WRITE).unwrap();
    writer.execute_batch("BEGIN IMMEDIATE").unwrap();
    let error = keep(&mut store, vec![record(30, &[(TaskState::Queued, "")])]).unwrap_err();
    assert!(error.message.contains("another program is writing"), "{error}");
    writer.execute_batch("ROLLBACK").unwrap();
    keep(&mut store, vec![record(30, &[(TaskState::Queued, "")])]).unwrap();
}
