//! `sweep.db`: the runs and robots of a sweep as SQLite tables (docs/sweep.md has them). It is rewritten when all runs have
//! ended, in the order of the plan, so its rows do not depend on how the sweep got there.

use crate::plan::Plan;
use crate::record::{Record, RobotRecord};
use rusqlite::{Connection, params};
use std::fs::{self, File};
use std::path::Path;

/// Its name in the directory of a sweep.
pub const FILE: &str = "sweep.db";
/// Its name until it is whole.
const DRAFT: &str = ".sweep.db.tmp";
/// `shos`: says whose file it is.
const APPLICATION_ID: i32 = 0x7368_6f73;
/// Goes up when the tables change.
const SCHEMA_VERSION: i32 = 3;

const SCHEMA: &str = "
CREATE TABLE run (
    run INTEGER PRIMARY KEY,
    scenario TEXT NOT NULL,
    planner TEXT,
    varied TEXT NOT NULL,
    seed INTEGER NOT NULL,
    success INTEGER NOT NULL,
    robots INTEGER NOT NULL,
    robots_due INTEGER NOT NULL,
    arrived INTEGER NOT NULL,
    robot_contacts INTEGER NOT NULL,
    obstacle_contacts INTEGER NOT NULL,
    makespan_s REAL,
    flowtime_s REAL,
    mean_time_s REAL,
    path_ratio_mean REAL,
    time_lost_s_mean REAL,
    goals_done INTEGER NOT NULL,
    throughput_per_s REAL,
    min_clearance_m REAL,
    min_obstacle_clearance_m REAL,
    ldj_mean REAL,
    reversals_per_m REAL,
    crossings INTEGER NOT NULL,
    right_of_way_violations INTEGER NOT NULL,
    deadlocked INTEGER NOT NULL,
    livelocked INTEGER NOT NULL,
    oscillating INTEGER NOT NULL,
    ticks INTEGER NOT NULL,
    trajectory_hash TEXT NOT NULL,
    command TEXT NOT NULL
);
CREATE TABLE robot (
    run INTEGER NOT NULL REFERENCES run (run),
    slot INTEGER NOT NULL,
    id TEXT NOT NULL,
    planner TEXT NOT NULL,
    arrived INTEGER NOT NULL,
    time_s REAL,
    path_length_m REAL NOT NULL,
    path_ratio REAL,
    time_lost_s REAL,
    goals_done INTEGER NOT NULL,
    contacts INTEGER NOT NULL,
    final_distance_m REAL,
    state TEXT NOT NULL,
    end_speed_mps REAL,
    ldj REAL,
    reversals_per_m REAL,
    PRIMARY KEY (run, slot)
) WITHOUT ROWID;
";

/// Writes the database, whole or not at all; one that is there is replaced.
///
/// # Errors
/// In words, when it cannot be written.
pub(crate) fn write(path: &Path, plan: &Plan, records: &[Record]) -> Result<(), String> {
    // The directory is locked: no other process makes one.
    let draft = path.with_file_name(DRAFT);
    let _ = fs::remove_file(&draft);
    let filled = fill(&draft, plan, records).map_err(|error| error.to_string());
    let synced = filled.and_then(|()| {
        let file = File::options().write(true).open(&draft);
        file.and_then(|file| file.sync_all()).and_then(|()| fs::rename(&draft, path)).map_err(|error| error.to_string())
    });
    synced.inspect_err(|_| _ = fs::remove_file(&draft))
}

/// Whether a name is that of a database that a killed sweep left half made.
pub(crate) fn is_draft(name: &str) -> bool {
    name == DRAFT
}

fn fill(path: &Path, plan: &Plan, records: &[Record]) -> rusqlite::Result<()> {
    let mut db = Connection::open(path)?;
    // It has no name yet: what is cut off is made again.
    db.pragma_update(None, "journal_mode", "memory")?;
    db.pragma_update(None, "synchronous", "off")?;
    let transaction = db.transaction()?;
    transaction.execute_batch(SCHEMA)?;
    transaction.pragma_update(None, "application_id", APPLICATION_ID)?;
    transaction.pragma_update(None, "user_version", SCHEMA_VERSION)?;
    {
        let marks = |n: usize| vec!["?"; n].join(", ");
        let mut run = transaction.prepare(&format!("INSERT INTO run VALUES ({})", marks(30)))?;
        let mut robot = transaction.prepare(&format!("INSERT INTO robot VALUES ({})", marks(16)))?;
        for record in records {
            let varied = serde_json::to_string(&record.varied).expect("texts");
            run.execute(params![
                record.run as i64,
                record.scenario,
                record.planner,
                varied,
                record.seed as i64,
                record.success,
                record.robots as i64,
                record.robots_due as i64,
                record.arrived as i64,
                record.robot_contacts as i64,
                record.obstacle_contacts as i64,
                record.makespan_s,
                record.flowtime_s,
                record.mean_time_s,
                record.path_ratio_mean,
                record.time_lost_s_mean,
                record.goals_done as i64,
                record.throughput_per_s,
                record.min_clearance_m,
                record.min_obstacle_clearance_m,
                record.ldj_mean,
                record.reversals_per_m,
                record.crossings as i64,
                record.right_of_way_violations as i64,
                record.deadlocked as i64,
                record.livelocked as i64,
                record.oscillating as i64,
                record.ticks as i64,
                record.trajectory_hash,
                plan.run(record.run).command().join(" "),
            ])?;
            for (slot, fate) in (0_i64..).zip(&record.per_robot) {
                let RobotRecord { id, planner, arrived, time_s, path_length_m, path_ratio, contacts, .. } = fate;
                let contacts = *contacts as i64;
                let row = params![
                    record.run as i64,
                    slot,
                    id,
                    planner,
                    arrived,
                    time_s,
                    path_length_m,
                    path_ratio,
                    fate.time_lost_s,
                    fate.goals_done,
                    contacts,
                    fate.final_distance_m,
                    fate.state,
                    fate.end_speed_mps,
                    fate.ldj,
                    fate.reversals_per_m
                ];
                robot.execute(row)?;
            }
        }
    }
    transaction.commit()
}
