//! The running fleets, seen from a second terminal.

use crate::args::FleetArg;
use crate::exit::{self, Failure};
use bus::clean::{FleetEntry, STATE_FILE, list_fleets};
use bus::{Address, Helmsman, OperatorClient, helm};
use protocol::codec;
use protocol::operator_to_daemon::{Reply, Request};
use std::path::PathBuf;
use std::time::Duration;

/// A daemon that has not answered after this long has been stopped, or is too busy to count on.
pub const PATIENCE: Duration = Duration::from_secs(5);

/// The fleets that somebody looks after, by id.
///
/// # Errors
/// When `/dev/shm` cannot be read.
pub fn running() -> Result<Vec<FleetEntry>, Failure> {
    Ok(list_fleets()?.into_iter().filter(|fleet| !fleet.abandoned).collect())
}

/// The fleet that is meant.
///
/// # Errors
/// With exit code 3 when none is running, with 2 when it must be named or does not exist.
pub fn choose(wanted: &FleetArg) -> Result<Address, Failure> {
    choose_entry(wanted).map(|fleet| fleet.address)
}

/// The fleet that is meant, with its name.
///
/// # Errors
/// As [`choose`].
pub fn choose_entry(wanted: &FleetArg) -> Result<FleetEntry, Failure> {
    let mut fleets = running()?;
    if let Some(id) = &wanted.fleet
        && !fleets.iter().any(|fleet| fleet.address.id() == id || fleet.name.as_ref() == Some(id))
        && let Some(uid) = bus::clean::owner_of(id)
    {
        let problem = format!("fleet `{id}`: it belongs to another user (uid {uid})");
        return Err(Failure::usage(problem).hint(format!("ask as that user: `sudo -u '#{uid}' shoal ...`")));
    }
    let names: Vec<(&str, Option<&str>)> =
        fleets.iter().map(|fleet| (fleet.address.id(), fleet.name.as_deref())).collect();
    let index = pick(wanted.fleet.as_deref(), &names)?;
    Ok(fleets.swap_remove(index))
}

/// Which of the running fleets, by id or name.
fn pick(wanted: Option<&str>, ids: &[(&str, Option<&str>)]) -> Result<usize, Failure> {
    let list: Vec<&str> = ids.iter().map(|(id, name)| name.unwrap_or(id)).collect();
    let list = list.join(", ");
    match (wanted, ids) {
        (_, []) => Err(Failure::environment("no fleet is running")
            .hint("start one: `shoal up`, or `shoal run` in another terminal")),
        (None, [_]) => Ok(0),
        (None, _) => {
            Err(Failure::usage(format!("{} fleets are running", ids.len()))
                .hint(format!("add `--fleet FLEET`: {list}")))
        }
        (Some(wanted), _) => {
            ids.iter().position(|(id, name)| *id == wanted || *name == Some(wanted)).ok_or_else(|| {
                Failure::usage(format!("fleet `{}`: not running", wanted.escape_debug()))
                    .hint(format!("running fleets: {list}"))
            })
        }
    }
}

/// Asks the daemon of a fleet.
///
/// # Errors
/// With exit code 3 when it cannot be asked, does not answer, does not know yet, or its machine fails; with 2 when it refuses.
pub fn ask(address: &Address, request: &Request) -> Result<Reply, Failure> {
    let reply = OperatorClient::new(address).ask(request, PATIENCE).map_err(|error| match request {
        Request::Status => Failure::from(error),
        _ => Failure::from(error)
            .hint("the command may or may not have taken effect: `shoal ps` shows the robots and their goals"),
    })?;
    match reply {
        Reply::Refused { problem, hint } => Err(Failure::from_text(exit::USAGE, &problem).hints(hint)),
        Reply::Failed { problem, hint } | Reply::Unconfirmed { problem, hint } => {
            Err(Failure::from_text(exit::ENVIRONMENT, &problem).hint(hint))
        }
        reply => Ok(reply),
    }
}

/// Whether a fleet goes on although its daemon has ended.
pub fn is_orphan(fleet: &FleetEntry) -> bool {
    helm::is_left_running(&fleet.address) && Helmsman::of(&fleet.address).is_some_and(|daemon| !daemon.lives())
}

/// What can be done about a fleet that goes on without a daemon.
pub fn orphan_hint(name: &str) -> String {
    format!("`shoal up --adopt --name {name}` takes it over; `shoal down --fleet {name}` ends it")
}

/// The state directory of a fleet that was left running.
pub fn state_of(address: &Address) -> Option<PathBuf> {
    #[expect(clippy::disallowed_methods, reason = "the verb reads what the daemon left")]
    let path = std::fs::read_to_string(address.file(STATE_FILE)).ok()?;
    Some(PathBuf::from(path))
}

/// What the daemon left in a file of the fleet's root.
///
/// # Errors
/// With exit code 3, when it is not there or not readable.
pub fn left<T: serde::de::DeserializeOwned>(address: &Address, name: &str) -> Result<T, Failure> {
    let path = address.file(name);
    #[expect(clippy::disallowed_methods, reason = "the verb reads what the daemon left")]
    let bytes = std::fs::read(&path)
        .map_err(|error| Failure::environment(format!("fleet `{}`: `{}`: {error}", address.id(), path.display())))?;
    codec::decode(&bytes).map_err(|error| {
        Failure::environment(format!("fleet `{}`: `{}`: {error}", address.id(), path.display()))
            .hint("all processes of a fleet must come from the same build")
    })
}

/// The daemon answered something else.
pub fn confused(reply: &Reply) -> Failure {
    Failure::environment(format!("daemon: unexpected reply: {reply:?}"))
        .hint("all processes of a fleet must come from the same build")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_only_fleet_needs_no_name() {
        let check = |wanted: Option<&str>, ids: &[&str], expected: Result<usize, i32>| {
            let ids: Vec<(&str, Option<&str>)> = ids.iter().map(|id| (*id, (*id == "def").then_some("lab"))).collect();
            assert_eq!(pick(wanted, &ids).map_err(|failure| failure.code), expected, "{wanted:?} {ids:?}");
        };
        check(None, &["abc"], Ok(0));
        check(Some("abc"), &["abc"], Ok(0));
        check(Some("def"), &["abc", "def"], Ok(1));
        check(Some("lab"), &["abc", "def"], Ok(1));
        check(None, &["abc", "def"], Err(exit::USAGE));
        check(Some("xyz"), &["abc", "def"], Err(exit::USAGE));
        check(None, &[], Err(exit::ENVIRONMENT));
        check(Some("abc"), &[], Err(exit::ENVIRONMENT));
    }
}
