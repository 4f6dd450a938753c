//! `shoal new`: a scenario to begin with.

use crate::args::NewArgs;
use crate::exit::Failure;
use crate::file::Files;
use crate::out;

/// The scenario: every key that it sets has a comment.
const FLEET: &str = include_str!("new/fleet.toml");
const NAME: &str = "fleet.toml";

/// Makes the directory and the scenario in it, and says what comes next.
///
/// # Errors
/// With exit code 2 if there is such a file already, with 3 if it cannot be written.
pub fn run(options: &NewArgs) -> Result<(), Failure> {
    let directory = &options.directory;
    let path = directory.join(NAME);
    let shown = path.display();
    if path.symlink_metadata().is_ok() {
        return Err(Failure::usage(format!("scenario `{shown}`: there is such a file already"))
            .hint(format!("to run it: `shoal run {shown}`; or give another directory")));
    }
    std::fs::create_dir_all(directory).map_err(|error| {
        Failure::environment(format!("directory `{}`: cannot make it: {error}", directory.display()))
            .hint("give a directory that you may write to")
    })?;
    Files::new().write("scenario", "DIRECTORY", &path)?.write(FLEET.as_bytes())?;
    out::data(&format!(
        "{shown} is a scenario of four robots. What comes next:\n  shoal run {shown} --view       watch it drive\n  \
         shoal validate {shown}         after a change: is it valid?\n  shoal run {shown} --mode single --record run.mcap\n  \
         shoal planners                      other planners for it\n  shoal schema --format text          all keys of scenarios\n"
    ))
}
