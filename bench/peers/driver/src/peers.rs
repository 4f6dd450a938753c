//! Who is compared, and how each is started.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The version of dora's command line; that of `dora-node-api` in `dora/Cargo.toml` is the same.
pub(crate) const DORA: &str = "1.1.0";
/// Name of dora's dataflow in the directory of a run.
const DATAFLOW: &str = "dataflow.yml";

/// What runs beside the robots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Beside {
    /// Nothing.
    Nobody,
    /// A process that owns the fleet, ready when it has made this file.
    Hub(&'static str),
    /// dora's daemon, which starts the robots.
    Dora,
}

/// One transport.
#[derive(Debug)]
pub(crate) struct Peer {
    pub(crate) name: &'static str,
    /// The package and the executable.
    pub(crate) package: &'static str,
    /// The crate that carries the poses, for its version.
    pub(crate) carrier: Option<&'static str>,
    pub(crate) option: Option<&'static str>,
    pub(crate) beside: Beside,
    /// How a robot comes by the others' poses.
    pub(crate) receives: &'static str,
}

const LOOKS: &str = "looks when it uses a pose, there is nothing to wait on";
const BLOCKS: &str = "a thread blocks until a pose comes";

/// All of them; shoal first.
pub(crate) const PEERS: [Peer; 6] = [
    Peer {
        name: "shoal",
        package: "peer-shoal",
        carrier: Some("shoal-bus"),
        option: None,
        beside: Beside::Hub("address"),
        receives: LOOKS,
    },
    Peer {
        name: "iceoryx2",
        package: "peer-iceoryx2",
        carrier: Some("iceoryx2"),
        option: None,
        beside: Beside::Nobody,
        receives: LOOKS,
    },
    Peer {
        name: "datagram",
        package: "peer-datagram",
        carrier: None,
        option: None,
        beside: Beside::Nobody,
        receives: BLOCKS,
    },
    Peer {
        name: "zenoh",
        package: "peer-zenoh",
        carrier: Some("zenoh"),
        option: None,
        beside: Beside::Nobody,
        receives: "its threads block until poses come",
    },
    Peer {
        name: "zenoh-shm",
        package: "peer-zenoh",
        carrier: Some("zenoh"),
        option: Some("shm"),
        beside: Beside::Nobody,
        receives: "its threads block until poses come",
    },
    Peer {
        name: "dora",
        package: "peer-dora",
        carrier: Some("dora-node-api"),
        option: None,
        beside: Beside::Dora,
        receives: BLOCKS,
    },
];

/// A peer by its name.
pub(crate) fn of(name: &str) -> Option<&'static Peer> {
    PEERS.iter().find(|peer| peer.name == name)
}

impl Peer {
    /// What carries the poses, with its version.
    pub(crate) fn version(&self) -> String {
        let Some(carrier) = self.carrier else { return "the kernel's".into() };
        let lock = include_str!("../../Cargo.lock");
        let entry = lock.split("[[package]]").find(|entry| entry.contains(&format!("name = \"{carrier}\"\n")));
        let version = entry.and_then(|entry| entry.split("version = \"").nth(1)?.split('"').next());
        format!("{carrier} {}", version.unwrap_or("of no known version"))
    }

    /// The words after the executable's name.
    fn words(&self, robot: usize, robots: usize, directory: &Path) -> Vec<String> {
        let mut words = vec![robot.to_string(), robots.to_string(), directory.display().to_string()];
        words.extend(self.option.map(str::to_owned));
        words
    }

    /// What is started beside the robots, or what starts them.
    pub(crate) fn beside_command(&self, tools: &Tools, directory: &Path) -> Option<Command> {
        match self.beside {
            Beside::Nobody => None,
            Beside::Hub(_) => {
                let mut command = Command::new(tools.executable(self));
                command.arg("hub").arg(directory);
                Some(command)
            }
            Beside::Dora => {
                let mut command = Command::new(tools.dora());
                command.args(["run", "--log-level", "warn"]).arg(directory.join(DATAFLOW)).current_dir(directory);
                Some(command)
            }
        }
    }

    /// What starts a robot; `None` where somebody else does.
    pub(crate) fn robot_command(
        &self,
        tools: &Tools,
        robot: usize,
        robots: usize,
        directory: &Path,
    ) -> Option<Command> {
        if self.beside == Beside::Dora {
            return None;
        }
        let mut command = Command::new(tools.executable(self));
        command.args(self.words(robot, robots, directory));
        Some(command)
    }

    /// Writes what the peer needs before it starts.
    pub(crate) fn write_files(&self, tools: &Tools, robots: usize, directory: &Path) -> std::io::Result<()> {
        if self.beside != Beside::Dora {
            return Ok(());
        }
        let mut text = String::from("nodes:\n");
        for robot in 0..robots {
            let executable = tools.executable(self);
            let words = self.words(robot, robots, directory).join(" ");
            text += &format!("  - id: robot-{robot}\n    path: {}\n    args: {words}\n", executable.display());
            text += "    inputs:\n";
            for other in (0..robots).filter(|other| *other != robot) {
                text += &format!("      pose-{other}: {{ source: robot-{other}/pose, queue_size: 1 }}\n");
            }
            text += "    outputs: [pose]\n";
        }
        std::fs::write(directory.join(DATAFLOW), text)
    }

    /// How it is started, for people.
    pub(crate) fn command_lines(&self, tools: &Tools) -> Vec<String> {
        let line = |command: Command| {
            let name = Path::new(command.get_program()).file_name().unwrap_or_default().to_string_lossy().into_owned();
            let words = command.get_args().map(|word| word.to_string_lossy().into_owned());
            std::iter::once(name).chain(words).collect::<Vec<_>>().join(" ")
        };
        let directory = Path::new("DIR");
        let robot = self.robot_command(tools, 0, 0, directory).map(line).map(|line| line.replacen("0 0", "I N", 1));
        self.beside_command(tools, directory).map(line).into_iter().chain(robot).collect()
    }
}

/// Where the built things are.
#[derive(Debug)]
pub(crate) struct Tools {
    /// Directory of the executables.
    pub(crate) executables: PathBuf,
}

impl Tools {
    fn executable(&self, peer: &Peer) -> PathBuf {
        self.executables.join(peer.package)
    }

    /// dora's Python environment.
    pub(crate) fn venv(&self) -> PathBuf {
        self.executables.join("dora-venv")
    }

    /// dora's command line.
    pub(crate) fn dora(&self) -> PathBuf {
        self.venv().join("bin/dora")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_carrier_has_a_version() {
        for peer in &PEERS {
            assert!(!peer.version().contains("no known"), "{}: {}", peer.name, peer.version());
        }
    }

    #[test]
    fn the_command_line_of_dora_has_the_version_of_its_crate() {
        assert_eq!(of("dora").unwrap().version(), format!("dora-node-api {DORA}"));
    }
}
