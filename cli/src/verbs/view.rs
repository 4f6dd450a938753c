//! `shoal view`: the page on which fleets are watched and driven.

use super::fleet;
use crate::args::ViewArgs;
use crate::exit::{self, Failure};
use crate::{out, record};
use daemon::signals::Interrupted;
use std::path::Path;
use web::{Options, Tape, WebError};

/// Serves it until it is interrupted; as part of a run, until that ends.
///
/// # Errors
/// With exit code 2 when the fleet must exist and does not, with 3 when the port cannot be had.
pub fn run(options: &ViewArgs) -> Result<(), Failure> {
    if let Some(parent) = options.parent
        && !bus::process::die_with_parent(parent)
    {
        return Ok(());
    }
    let interrupted = Interrupted::watch(exit::INTERRUPTED)?;
    let fleet = match options.fleet.fleet {
        Some(_) => Some(fleet::choose_entry(&options.fleet)?),
        None => None,
    };
    let tapes = options.records.iter().map(|path| open(path)).collect::<Result<_, _>>()?;
    let options = Options { port: options.port, fleet, ends_with_fleet: options.parent.is_some(), tapes };
    let mut printed = Ok(());
    let part_of_run = options.ends_with_fleet;
    let mut ready = |url: &str| {
        printed = out::data(&format!("{url}\n"));
        if !part_of_run {
            out::talk("open this address in a browser; Ctrl-C ends the view");
        }
    };
    web::serve(options, &mut ready, &mut || interrupted.yes()).map_err(|error| match error {
        WebError::Port(port, cause) => {
            Failure::environment(format!("port {port}: {cause}")).hint("without `--port`, a free one is taken")
        }
        WebError::Io(cause) => Failure::environment(format!("view: {cause}")),
    })?;
    printed
}

/// A record, with what is wrong with it said the way all verbs say it.
fn open(path: &Path) -> Result<Tape, Failure> {
    let record = record::open(path)?;
    record::tell_gaps(path, &record);
    Tape::of(path, record).map_err(|error| record::refused(path, &error))
}
