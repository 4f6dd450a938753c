//! What a shell offers when a word is begun: verbs and options as the command line has them, and the names that depend on the
//! moment: robots and fleets that are running, scenarios, planners.

use crate::args::{Cli, Shell};
use crate::verbs::fleet;
use bus::OperatorClient;
use clap::{Command, CommandFactory};
use clap_complete::engine::{
    ArgValueCandidates, ArgValueCompleter, CompletionCandidate, PathCompleter, ValueCompleter,
};
use clap_complete::env::{CompleteEnv, Shells};
use protocol::operator_to_daemon::{Reply, Request};
use std::ffi::OsStr;
use std::io;
use std::time::Duration;

/// The variable with which a shell asks, and says which shell it is.
const VARIABLE: &str = "SHOAL_COMPLETE";
/// How long a fleet is waited for when its robots are listed.
const PATIENCE: Duration = Duration::from_millis(500);

/// Answers a shell that asks for words, and ends the process. Does nothing if no shell asks.
pub fn answer() {
    CompleteEnv::with_factory(command).var(VARIABLE).complete();
}

/// What a shell has to read to ask from now on.
///
/// # Errors
/// When the text cannot be made.
pub(super) fn registration(shell: Shell) -> io::Result<Vec<u8>> {
    let mut text = Vec::new();
    let shells = Shells::builtins();
    let known = shells.completer(shell.name()).ok_or(io::ErrorKind::Unsupported)?;
    known.write_registration(VARIABLE, "shoal", "shoal", "shoal", &mut text)?;
    Ok(text)
}

/// The command line, with what its values can be.
fn command() -> Command {
    with_words(Cli::command())
}

fn with_words(command: Command) -> Command {
    let is_planners = command.get_name() == "planners";
    command
        .mut_args(|arg| {
            let value = arg.get_value_names().and_then(|names| names.first()).map(|name| name.as_str().to_owned());
            match (arg.get_long(), value.as_deref()) {
                (Some("planner" | "baseline"), _) => arg.add(ArgValueCandidates::new(planners)),
                (None, Some("NAME")) if is_planners => arg.add(ArgValueCandidates::new(planners)),
                (_, Some("FLEET")) => arg.add(ArgValueCandidates::new(fleets)),
                (_, Some("ROBOT" | "ROBOT|X,Y[,YAW]")) => arg.add(ArgValueCandidates::new(robots)),
                (_, Some("SCENARIO")) => arg.add(ArgValueCompleter::new(scenarios_from)),
                (_, Some("RECORD")) => arg.add(files("mcap")),
                _ => arg,
            }
        })
        .mut_subcommands(with_words)
}

fn files(ending: &'static str) -> ArgValueCompleter {
    ArgValueCompleter::new(
        PathCompleter::file().filter(move |path| path.is_dir() || path.extension() == Some(ending.as_ref())),
    )
}

fn planners() -> Vec<CompletionCandidate> {
    let words = planners::METHODS.iter();
    words.map(|method| CompletionCandidate::new(method.name).help(Some(method.summary.into()))).collect()
}

fn scenarios_from(begun: &OsStr) -> Vec<CompletionCandidate> {
    let begins = |name: &str| begun.to_str().is_some_and(|begun| name.starts_with(begun));
    let catalog = scenarios::catalog().iter().filter(|entry| begins(entry.name));
    let mut words: Vec<_> = catalog.map(|entry| CompletionCandidate::new(entry.name)).collect();
    let is_scenario = |path: &std::path::Path| path.is_dir() || path.extension() == Some("toml".as_ref());
    words.extend(PathCompleter::file().filter(is_scenario).complete(begun));
    words
}

fn fleets() -> Vec<CompletionCandidate> {
    let running = fleet::running().unwrap_or_default().into_iter();
    running.map(|fleet| CompletionCandidate::new(fleet.name.unwrap_or_else(|| fleet.address.id().to_owned()))).collect()
}

/// Those of all fleets: which one is meant may not have been typed yet.
fn robots() -> Vec<CompletionCandidate> {
    let of_fleet =
        |fleet: &bus::clean::FleetEntry| match OperatorClient::new(&fleet.address).ask(&Request::Status, PATIENCE) {
            Ok(Reply::Status(status)) => status.robots.into_iter().map(|robot| robot.id).collect(),
            // A shell has no place for an error.
            _ => Vec::new(),
        };
    let running = fleet::running().unwrap_or_default();
    running.iter().flat_map(of_fleet).map(CompletionCandidate::new).collect()
}
