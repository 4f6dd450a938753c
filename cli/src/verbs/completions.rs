//! `shoal completions`: what a shell needs to complete the words of shoal.

mod words;

use crate::args::CompletionsArgs;
use crate::exit::Failure;
use crate::out;

pub use words::answer;

/// Prints it.
///
/// # Errors
/// When standard output cannot be written.
pub fn run(options: &CompletionsArgs) -> Result<(), Failure> {
    let text = words::registration(options.shell)
        .map_err(|error| Failure::environment(format!("completions for {}: {error}", options.shell.name())))?;
    out::data(&String::from_utf8_lossy(&text))
}
