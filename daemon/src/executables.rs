//! Programs that robots name as their agents: one rule from the check to the start.
//!
//! A path is relative to where shoal is started. The program of a list of words is looked up in PATH if it has no `/`. Either is
//! made absolute once, before anything starts, and what was checked is what runs.

use crate::error::{Error, Kind};
use model::{AgentCommand, Scenario};
use std::collections::BTreeMap;
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

/// The executables of a scenario, by the command that names them.
#[derive(Clone, Debug, Default)]
pub struct Executables(BTreeMap<AgentCommand, PathBuf>);

impl Executables {
    /// Finds every executable that a robot names, before anything is started.
    ///
    /// # Errors
    /// Names the robot and the file.
    pub fn find(scenario: &Scenario) -> Result<Executables, Error> {
        let mut found = BTreeMap::new();
        for robot in &scenario.robots {
            if let Some(command) = robot.agent.as_ref().filter(|command| !found.contains_key(*command)) {
                let path = find(command).map_err(|problem| {
                    let hint = match command {
                        AgentCommand::Path(_) => {
                            "`agent` is the path of an executable, relative to where shoal is started; PATH is not \
                             searched. A program with arguments is a list, as in agent = [\"python3\", \"my.py\"]"
                        }
                        AgentCommand::Words(_) => {
                            "the first word is a program in PATH, or a path with a `/`, relative to where shoal is started"
                        }
                    };
                    Error::new(Kind::Agent, format!("robot `{}`: agent `{command}`: {problem}", robot.id)).hint(hint)
                })?;
                found.insert(command.clone(), path);
            }
        }
        Ok(Executables(found))
    }

    /// Whether every robot is driven by shoal's own agent.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The executable of this command. Robots that are added to a fleet have agents of its robots.
    pub fn path(&self, command: &AgentCommand) -> PathBuf {
        self.0.get(command).cloned().unwrap_or_else(|| PathBuf::from(command.program()))
    }
}

fn find(command: &AgentCommand) -> Result<PathBuf, String> {
    let program = command.program();
    if !command.searches_path() {
        let path = std::path::absolute(program).map_err(|error| error.to_string())?;
        return executable(&path).map(|()| path);
    }
    let search = std::env::var_os("PATH").unwrap_or_default();
    let mut problem = format!("`{program}` is not in PATH");
    for folder in std::env::split_paths(&search) {
        let Ok(path) = std::path::absolute(folder.join(program)) else { continue };
        match executable(&path) {
            Ok(()) => return Ok(path),
            Err(why) if path.exists() => problem = format!("`{}`: {why}", path.display()),
            Err(_) => {}
        }
    }
    Err(problem)
}

fn executable(path: &Path) -> Result<(), String> {
    match std::fs::metadata(path) {
        Err(error) => Err(error.to_string()),
        Ok(file) if file.is_dir() => Err("it is a directory".to_owned()),
        Ok(file) if file.permissions().mode() & 0o111 == 0 => Err("it is not executable".to_owned()),
        Ok(_) => Ok(()),
    }
}

/// Why a program could not be started: in the kernel's words, and what they mean here.
pub(crate) fn cannot_start(program: &Path, error: &io::Error) -> String {
    let meaning = match error.raw_os_error() {
        Some(libc::ENOENT) if program.exists() => " (is the interpreter in its first line there?)",
        Some(libc::ENOEXEC) => " (is it built for this machine? a script begins with `#!`)",
        Some(libc::EAGAIN) => " (the limit on processes is reached: `ulimit -u`, or `--pids-limit` of a container)",
        _ => "",
    };
    format!("cannot start `{}`: {error}{meaning}", program.display())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_program_of_a_list_is_looked_up_in_path_and_a_path_is_not() {
        let words = |words: &[&str]| AgentCommand::Words(words.iter().map(|word| (*word).to_owned()).collect());
        let found = find(&words(&["sh", "my.sh"])).unwrap();
        assert!(found.is_absolute() && found.ends_with("sh"), "{found:?}");
        assert_eq!(find(&words(&["/bin/sh"])), Ok(PathBuf::from("/bin/sh")));
        assert_eq!(find(&words(&["no-such-program"])), Err("`no-such-program` is not in PATH".to_owned()));
        assert!(find(&words(&["./sh"])).unwrap_err().contains("No such file"));
        assert!(find(&AgentCommand::Path("sh".to_owned())).unwrap_err().contains("No such file"));
        assert_eq!(find(&words(&["/"])), Err("it is a directory".to_owned()));
    }

    #[test]
    fn what_the_kernel_refuses_is_said_in_its_words() {
        let check = |program: &str, errno: i32, expected: &str| {
            let text = cannot_start(Path::new(program), &io::Error::from_raw_os_error(errno));
            assert!(text.starts_with(&format!("cannot start `{program}`: ")) && text.contains(expected), "{text}");
        };
        check("/proc/self/exe", libc::ENOENT, "No such file or directory (os error 2) (is the interpreter");
        check("/no/such/file", libc::ENOENT, "No such file or directory (os error 2)");
        check("own", libc::ENOEXEC, "Exec format error (os error 8) (is it built for this machine?");
        check("own", libc::EAGAIN, "(os error 11) (the limit on processes is reached: `ulimit -u`");
        check("own", libc::ENOMEM, "Cannot allocate memory (os error 12)");
    }
}
