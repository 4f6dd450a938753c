//! What a fleet has that is left running: a name, and a directory in which everything is that outlives its processes.

mod log;
mod state;
mod store;
mod time;

pub use log::{Entry, FILE as LOG_FILE, Level, LogFile, parts, read_entry};
pub use state::{StateDir, check_name, default_state};
pub use store::{Batch, EventRow, FILE as DATABASE_FILE, RobotRow, Store};
pub use time::{parse_time, wall_ms, written};

use std::time::Duration;

/// A fleet that is left running.
pub struct Service {
    /// Its name.
    pub name: String,
    /// Its directory, which is this process's alone.
    pub state: StateDir,
    /// Its database.
    pub store: Store,
    /// Its log.
    pub log: LogFile,
    /// How long the fleet may be without a daemon before its guardian ends it; `None`: for ever.
    pub orphan_limit: Option<Duration>,
}

impl Service {
    /// Takes the directory of a fleet of this name, and what it holds.
    ///
    /// # Errors
    /// When another process has it, it cannot be written, or its database is not one of these.
    pub fn open(name: &str, state: StateDir) -> Result<Service, crate::Error> {
        let store = Store::open(state.path())?;
        let log = LogFile::open(state.path())?;
        Ok(Service { name: name.to_owned(), state, store, log, orphan_limit: None })
    }
}
