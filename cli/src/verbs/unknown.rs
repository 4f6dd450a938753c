//! Words that are no verb: refused, with those that are.

use crate::args::Cli;
use crate::exit::Failure;
use clap::CommandFactory;
use std::ffi::OsString;
use std::path::Path;

/// Refuses what was said in place of a verb.
pub fn refuse(words: &[OsString]) -> Failure {
    refuse_below(&Cli::command(), "", words)
}

/// Refuses a page of man(1) for an unknown verb.
pub fn refuse_page(words: &[OsString]) -> Failure {
    let command = Cli::command();
    match words {
        [verb, rest @ ..]
            if !rest.is_empty()
                && let Some(found) = command.find_subcommand(verb) =>
        {
            refuse_below(found, &format!("{} ", verb.to_string_lossy()), rest)
        }
        _ => refuse_below(&command, "", words),
    }
}

/// Refuses what was said in place of a verb of `shoal task`.
pub fn refuse_task(words: &[OsString]) -> Failure {
    let command = Cli::command();
    let task = command.find_subcommand("task").cloned().unwrap_or(command);
    refuse_below(&task, "task ", words)
}

/// Refuses what was said in place of a fault of `shoal inject`.
pub fn refuse_inject(words: &[OsString]) -> Failure {
    let command = Cli::command();
    let inject = command.find_subcommand("inject").cloned().unwrap_or(command);
    refuse_below(&inject, "inject ", words)
}

/// Refuses what was said in place of a verb of `shoal bench`.
pub fn refuse_bench(words: &[OsString]) -> Failure {
    let command = Cli::command();
    let bench = command.find_subcommand("bench").cloned().unwrap_or(command);
    refuse_below(&bench, "bench ", words)
}

fn refuse_below(command: &clap::Command, before: &str, words: &[OsString]) -> Failure {
    let word = words.first().map(|word| word.to_string_lossy()).unwrap_or_default();
    let name = format!("{before}{word}");
    let known: Vec<&str> =
        command.get_subcommands().filter(|verb| !verb.is_hide_set()).map(clap::Command::get_name).collect();
    let failure = Failure::usage(format!("unknown verb `{name}`"));
    if before.is_empty() && (word.ends_with(".toml") || Path::new(&*word).is_file() || is_in_catalog(&word)) {
        return failure.hint(format!("to run a scenario: `shoal run {word}`"));
    }
    let list = known.join(", ");
    failure.hint(match planners::params::nearest(&word, known.iter().copied()) {
        Some(near) => format!("known verbs: {list} (did you mean `{near}`?)"),
        None => format!("known verbs: {list}"),
    })
}

fn is_in_catalog(word: &str) -> bool {
    scenarios::find_catalog(word).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exit;

    #[test]
    fn refusals_say_what_exists() {
        let check = |failure: Failure, message: &str, hint: &str| {
            assert_eq!(failure.code, exit::USAGE);
            let text = failure.to_string();
            assert!(text.contains(&format!("error: {message}\n")) && text.contains(hint), "{text}");
        };
        let say = |word: &str| refuse(&[word.into(), "more".into(), "--words".into()]);
        check(say("valdiate"), "unknown verb `valdiate`", "did you mean `validate`?");
        check(say("ring.toml"), "unknown verb `ring.toml`", "`shoal run ring.toml`");
        check(say("demo-15"), "unknown verb `demo-15`", "`shoal run demo-15`");
        check(refuse_task(&["sned".into()]), "unknown verb `task sned`", "did you mean `send`?");
    }
}
