//! Which processes look after a fleet that is left running, and whether they live: its daemon, and its world.
//!
//! Such a fleet outlives its daemon. A file says which process that is: number, start time and pid namespace, so that
//! a number that was given to another process deceives nobody. The daemon holds a lock on it as well, which the kernel lets
//! go of when the process ends, however it ends: there is one daemon at a time, and a new one can take over.

use crate::clean::STATE_FILE;
use crate::maker::Maker;
use crate::{Address, BusError, Result};
use rustix::fs::{FlockOperation, Mode, OFlags, flock, ftruncate, open};
use rustix::io::Errno;
use std::os::fd::OwnedFd;
use std::time::Duration;

/// The daemon's file.
const DAEMON: &str = "daemon.pid";
/// The world's file.
const WORLD: &str = "world.pid";

/// The file in the root of a fleet that says for how long it may be without a daemon, s.
pub const ORPHAN_LIMIT_FILE: &str = "orphan_limit_s";

/// The daemon's place at a fleet, taken.
#[derive(Debug)]
pub struct Helm {
    held: OwnedFd,
}

/// The daemon of a fleet, as its file says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Helmsman {
    process: Maker,
    /// Version of everything that the processes of its fleet share.
    pub fleet_version: u32,
    /// Version of its executable.
    pub build: String,
}

impl Helm {
    /// Becomes the daemon of a fleet. `None` if the fleet has one.
    ///
    /// # Errors
    /// When the file cannot be made or locked.
    pub fn take(address: &Address) -> Result<Option<Helm>> {
        let path = address.file(DAEMON);
        let failed = |errno: Errno| BusError::io(&path, "become the daemon of the fleet", errno);
        let flags = OFlags::RDWR | OFlags::CREATE | OFlags::CLOEXEC | OFlags::NOFOLLOW;
        let file = open(&path, flags, Mode::RUSR | Mode::WUSR).map_err(failed)?;
        match flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => {}
            Err(Errno::WOULDBLOCK) => return Ok(None),
            Err(errno) => return Err(failed(errno)),
        }
        Ok(Some(Helm { held: file }))
    }

    /// Writes who has the place: this process, in these versions.
    ///
    /// # Errors
    /// When there is no room.
    pub fn sign(&self, address: &Address, fleet_version: u32, build: &str) -> Result<()> {
        let text = format!("{} {fleet_version} {build}\n", Maker::this());
        let failed = |errno: Errno| BusError::io(&address.file(DAEMON), "become the daemon of the fleet", errno);
        ftruncate(&self.held, 0).map_err(failed)?;
        rustix::io::pwrite(&self.held, text.as_bytes(), 0).map_err(failed)?;
        Ok(())
    }
}

impl Helmsman {
    /// Who is, or was, the daemon of a fleet that is left running.
    pub fn of(address: &Address) -> Option<Helmsman> {
        let text = read(address, DAEMON)?;
        let mut words = text.split_ascii_whitespace();
        let (process, fleet_version) = (words.next()?.parse().ok()?, words.next()?.parse().ok()?);
        Some(Helmsman { process, fleet_version, build: words.next().unwrap_or_default().to_owned() })
    }

    /// Its process.
    pub fn pid(&self) -> u32 {
        self.process.pid()
    }

    /// Whether it lives.
    pub fn lives(&self) -> bool {
        self.process.may_live()
    }
}

/// Whether a fleet is one that is left running: it does not end with its daemon.
pub fn is_left_running(address: &Address) -> bool {
    address.file(STATE_FILE).exists()
}

/// Says that this process is the world of a fleet that is left running.
///
/// # Errors
/// When there is no room for it.
pub fn sign_world(address: &Address) -> Result<()> {
    let path = address.file(WORLD);
    let draft = address.file(&format!("{WORLD}.draft"));
    #[expect(clippy::disallowed_methods, reason = "a process leaves its name in the root of the fleet, once")]
    std::fs::write(&draft, Maker::this().to_string())
        .and_then(|()| std::fs::rename(&draft, &path))
        .map_err(|error| BusError::io(&path, "say which process is the world", error))
}

/// The process that is the world of a fleet that is left running, if it lives.
pub fn living_world(address: &Address) -> Option<u32> {
    let process: Maker = read(address, WORLD)?.parse().ok()?;
    process.may_live().then(|| process.pid())
}

/// How long a fleet may be without a daemon; `None`: for ever.
pub fn orphan_limit(address: &Address) -> Option<Duration> {
    let seconds = read(address, ORPHAN_LIMIT_FILE)?.trim().parse().ok()?;
    Duration::try_from_secs_f64(seconds).ok()
}

fn read(address: &Address, name: &str) -> Option<String> {
    #[expect(clippy::disallowed_methods, reason = "processes leave their names in the root of the fleet")]
    std::fs::read_to_string(address.file(name)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fleet_has_one_daemon_at_a_time_and_says_which() {
        let address = Address::create().unwrap();
        assert_eq!((Helmsman::of(&address), living_world(&address)), (None, None));
        let helm = Helm::take(&address).unwrap().unwrap();
        helm.sign(&address, 3, "0.2.0").unwrap();
        assert!(Helm::take(&address).unwrap().is_none(), "a second one");
        let of = Helmsman::of(&address).unwrap();
        assert_eq!((of.pid(), of.fleet_version, of.build.as_str()), (std::process::id(), 3, "0.2.0"));
        assert!(of.lives());
        drop(helm);
        let helm = Helm::take(&address).unwrap().expect("the first one is gone");
        helm.sign(&address, 30, "1").unwrap();
        assert_eq!(Helmsman::of(&address).unwrap().build, "1", "nothing is left of what was there");
        sign_world(&address).unwrap();
        assert_eq!(living_world(&address), Some(std::process::id()));
        assert!(!is_left_running(&address));
        crate::clean::sweep(&address);
    }

    #[test]
    #[expect(clippy::disallowed_methods, reason = "the test writes what another process would")]
    fn a_number_that_was_given_to_another_process_deceives_nobody() {
        let address = Address::create().unwrap();
        let this = Maker::this().to_string();
        let (pid, rest) = this.split_once('-').unwrap();
        let (start, namespace) = rest.split_once('-').unwrap();
        let older: u64 = start.parse::<u64>().unwrap() - 1;
        for (text, lives) in [(this.clone(), true), (format!("{pid}-{older}-{namespace}"), false)] {
            std::fs::write(address.file(DAEMON), format!("{text} 1 0\n")).unwrap();
            std::fs::write(address.file(WORLD), &text).unwrap();
            assert_eq!(Helmsman::of(&address).unwrap().lives(), lives);
            assert_eq!(living_world(&address).is_some(), lives);
        }
        crate::clean::sweep(&address);
    }
}
