//! `shoal new`: a scenario to begin with, and a planner in Python for it.

use crate::args::NewArgs;
use crate::exit::Failure;
use crate::file::Files;
use crate::out;

/// The scenario: every key that it sets has a comment.
const FLEET: &str = include_str!("new/fleet.toml");
/// What the scenario says about its planner; with `--python` it says something else.
const PLANNER_OF_SHOAL: &str = "\
# `shoal planners` lists the planners; `shoal planners lanes` explains one and its parameters.
planner = \"lanes\"
";
const PLANNER_IN_PYTHON: &str = "\
# The process of each robot: a program and its arguments. A path is relative to the directory in which shoal is started.
agent = [\"python3\", \"planner.py\"]
";
/// The planner, a script.
const PLANNER: &str = include_str!("new/planner.py");

/// Makes the directory and the files in it, and says what comes next.
///
/// # Errors
/// With exit code 2 if there is such a file already, with 3 if it cannot be written. No file is written unless all can be.
pub fn run(options: &NewArgs) -> Result<(), Failure> {
    let directory = &options.directory;
    let path = directory.join("fleet.toml");
    let shown = path.display();
    let fleet = FLEET.replace(PLANNER_OF_SHOAL, if options.python { PLANNER_IN_PYTHON } else { PLANNER_OF_SHOAL });
    let mut contents = vec![("scenario", path.clone(), fleet.as_str())];
    if options.python {
        contents.push(("planner", directory.join("planner.py"), PLANNER));
    }
    for (what, path, _) in &contents {
        if path.symlink_metadata().is_ok() {
            let run = if *what == "scenario" { format!("to run it: `shoal run {shown}`; or ") } else { String::new() };
            let message = format!("{what} `{}`: there is such a file already", path.display());
            return Err(Failure::usage(message).hint(format!("{run}give another directory")));
        }
    }
    std::fs::create_dir_all(directory).map_err(|error| {
        Failure::environment(format!("directory `{}`: cannot make it: {error}", directory.display()))
            .hint("give a directory that you may write to")
    })?;
    let mut files = Files::new();
    let prepared: Result<Vec<_>, Failure> =
        (contents.iter()).map(|(what, path, content)| Ok((files.write(what, "DIRECTORY", path)?, content))).collect();
    for (file, content) in prepared? {
        file.write(content.as_bytes())?;
    }
    if options.python {
        let planner = directory.join("planner.py");
        return out::data(&format!(
            "{shown} is a scenario of four robots, {} their planner. What comes next:\n  cd {}\n  \
             shoal run fleet.toml --view         watch it drive\n  \
             shoal run fleet.toml --mode lockstep --record run.mcap\n  \
             shoal validate fleet.toml           after a change: is it valid?\n  \
             shoal schema --format text          all keys of scenarios\n",
            planner.display(),
            directory.display()
        ));
    }
    out::data(&format!(
        "{shown} is a scenario of four robots. What comes next:\n  shoal run {shown} --view       watch it drive\n  \
         shoal validate {shown}         after a change: is it valid?\n  shoal run {shown} --mode single --record run.mcap\n  \
         shoal planners                      other planners for it\n  shoal schema --format text          all keys of scenarios\n"
    ))
}
