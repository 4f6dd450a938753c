//! Executables that robots name as their agents: one rule from the check to the start.
//!
//! `agent` is a path, relative to where shoal is started, and never looked up in PATH. It is made absolute once, before
//! anything starts, and what was checked is what runs.

use crate::error::{Error, Kind};
use model::Scenario;
use std::collections::BTreeMap;
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

/// The executables of a scenario, by the name that it gives them.
#[derive(Clone, Debug, Default)]
pub struct Executables(BTreeMap<String, PathBuf>);

impl Executables {
    /// Finds every executable that a robot names, before anything is started.
    ///
    /// # Errors
    /// Names the robot and the file.
    pub fn find(scenario: &Scenario) -> Result<Executables, Error> {
        let mut found = BTreeMap::new();
        for robot in &scenario.robots {
            if let Some(name) = &robot.agent {
                let path = find(name).map_err(|problem| {
                    Error::new(Kind::Agent, format!("robot `{}`: agent `{name}`: {problem}", robot.id)).hint(
                        "`agent` is the path of an executable, relative to where shoal is started; PATH is not searched",
                    )
                })?;
                found.insert(name.clone(), path);
            }
        }
        Ok(Executables(found))
    }

    /// Whether every robot is driven by shoal's own agent.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The executable of this name. Robots that are added to a fleet have agents of its robots.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.get(name).cloned().unwrap_or_else(|| PathBuf::from(name))
    }
}

fn find(name: &str) -> Result<PathBuf, String> {
    let path = std::path::absolute(name).map_err(|error| error.to_string())?;
    match std::fs::metadata(&path) {
        Err(error) => Err(error.to_string()),
        Ok(file) if file.is_dir() => Err("it is a directory".to_owned()),
        Ok(file) if file.permissions().mode() & 0o111 == 0 => Err("it is not executable".to_owned()),
        Ok(_) => Ok(path),
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
