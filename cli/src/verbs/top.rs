//! `shoal top`: a running fleet in the terminal.

use super::fleet;
use crate::args::{Format, TopArgs};
use crate::exit::{self, Failure};
use crate::out;
use bus::clean::FleetEntry;
use daemon::signals::Interrupted;
use std::io::IsTerminal;
use top::{End, Look, TopError};

/// Rows of a screen that goes to no terminal: at least these, and all robots.
const ROWS_MIN: usize = 24;

/// Shows it until a key, a signal or the end of the fleet; or once. The exit code.
///
/// # Errors
/// When no fleet is running or it cannot be seen; with exit code 2 when there is no terminal that it could be shown in.
pub fn run(options: &TopArgs) -> Result<i32, Failure> {
    let entry = fleet::choose_entry(&options.fleet)?;
    let name = entry.name.as_deref();
    let failed = |error: TopError| failure(&entry, &error);
    if options.once || options.format == Format::Json {
        let look = top::look(&entry.address, name).map_err(failed)?;
        match options.format {
            Format::Json => out::measured(&look.json())?,
            Format::Text => out::data(&screen(&look))?,
        }
        return Ok(exit::OK);
    }
    check_terminal()?;
    let interrupted = Interrupted::watch(exit::INTERRUPTED)?;
    match top::run(&entry.address, name, &|| interrupted.yes()).map_err(failed)? {
        End::Quit => Ok(exit::OK),
        End::Over => {
            out::talk(&format!("fleet {} has ended", name.unwrap_or(entry.address.id())));
            Ok(exit::OK)
        }
        End::Interrupted | End::TerminalGone => Ok(exit::INTERRUPTED),
    }
}

/// One screen, as large as the terminal, if there is one.
fn screen(look: &Look) -> String {
    let size = |cells: usize| u16::try_from(cells).unwrap_or(u16::MAX);
    // Half of what is below the header is the table's.
    let rows = out::stdout_rows().unwrap_or_else(|| ROWS_MIN.max(2 * look.robots() + 6));
    look.text(size(out::stdout_width()), size(rows))
}

fn check_terminal() -> Result<(), Failure> {
    #[expect(clippy::disallowed_methods, reason = "the shell of the command line reads the environment")]
    let kind = std::env::var("TERM").unwrap_or_default();
    let problem = if !std::io::stdout().is_terminal() {
        "standard output is not a terminal".to_owned()
    } else if !std::io::stdin().is_terminal() {
        "standard input is not a terminal".to_owned()
    } else if matches!(kind.as_str(), "" | "dumb") {
        format!("the terminal cannot be drawn on: TERM is `{}`", kind.escape_debug())
    } else {
        return Ok(());
    };
    Err(Failure::usage(format!("top: {problem}"))
        .hint("`shoal top --once` prints one screen, `--format json` one object; `shoal ps` shows the robots"))
}

fn failure(entry: &FleetEntry, error: &TopError) -> Failure {
    let name = entry.name.as_deref().unwrap_or(entry.address.id());
    Failure::environment(format!("fleet `{name}`: {error}"))
        .hint("`shoal ps` shows the fleets; all processes of a fleet must come from the same build")
}
