//! Whether somebody still looks after a fleet.

use crate::maker::{MAKER, Maker};
use crate::{Address, BusError, Result};
use rustix::fs::{CWD, FlockOperation, Mode, OFlags, RenameFlags, flock, open, renameat_with};
use rustix::io::Errno;
use std::os::fd::OwnedFd;
use std::os::unix::fs::MetadataExt;

/// Held by the daemon and by the guardian for as long as they live: a shared `flock`, which the kernel takes back
/// from whoever dies. A fleet whose lease nobody holds is abandoned, and may be removed by anybody of this user.
#[derive(Debug)]
pub struct Lease {
    _held: OwnedFd,
    _root: Option<OwnedFd>,
}

impl Lease {
    /// Takes the lease. The descriptor is closed on exec: children do not hold it by accident.
    ///
    /// # Errors
    /// When the file cannot be made or locked.
    pub fn take(address: &Address) -> Result<Lease> {
        let path = address.file("lease");
        let failed = |e: Errno| BusError::io(&path, "take the lease", e);
        let flags = OFlags::RDWR | OFlags::CLOEXEC | OFlags::NOFOLLOW;
        loop {
            match open(&path, flags, Mode::empty()) {
                Ok(file) => {
                    // Blocks only while somebody tests the lease, which takes microseconds.
                    rustix::io::retry_on_intr(|| flock(&file, FlockOperation::LockShared)).map_err(failed)?;
                    return Ok(Lease { _held: file, _root: hold_root(address).map_err(failed)? });
                }
                Err(Errno::NOENT) => {}
                Err(e) => return Err(failed(e)),
            }
            // The first one: the file gets its name only when it is locked, so that nobody ever finds a new fleet's
            // lease free.
            let draft = address.file(&format!(".lease.{}", rustix::process::getpid().as_raw_nonzero()));
            let file = open(&draft, flags | OFlags::CREATE, Mode::RUSR | Mode::WUSR).map_err(failed)?;
            flock(&file, FlockOperation::NonBlockingLockShared).map_err(failed)?;
            let root = hold_root(address).map_err(failed)?;
            match renameat_with(CWD, &draft, CWD, &path, RenameFlags::NOREPLACE) {
                Ok(()) => {
                    // From here on the lease tells whether the fleet is looked after.
                    let _ = rustix::fs::unlink(address.file(MAKER));
                    return Ok(Lease { _held: file, _root: root });
                }
                Err(Errno::EXIST) => rustix::fs::unlink(&draft).map_err(failed)?,
                Err(e) => return Err(failed(e)),
            }
        }
    }

    /// Whether nobody holds the lease of this fleet. A fleet that is not there is not abandoned, it is gone.
    ///
    /// # Errors
    /// When the file cannot be opened or locked.
    pub fn is_abandoned(address: &Address) -> Result<bool> {
        Ok(Lease::seize(address)?.is_some())
    }

    /// The exclusive lease of an abandoned fleet, for the one who removes it; `None` if somebody holds it, or if there
    /// is no fleet. A root whose maker died before it took the lease has none to give, and is abandoned all the same.
    pub(crate) fn seize(address: &Address) -> Result<Option<Option<Lease>>> {
        let path = address.file("lease");
        let file = match open(&path, OFlags::RDWR | OFlags::CLOEXEC | OFlags::NOFOLLOW, Mode::empty()) {
            Ok(file) => file,
            Err(Errno::NOENT) => {
                let Ok(meta) = std::fs::symlink_metadata(address.root()) else { return Ok(None) };
                // A root that others may look into is none of ours: iceoryx2 made it anew for a process that came late.
                let ghost = meta.mode() & 0o077 != 0;
                let made = || Maker::of(address.root()).is_some_and(Maker::may_live);
                return Ok((ghost || !made() && !is_root_held(address)).then_some(None));
            }
            Err(e) => return Err(BusError::io(&path, "test the lease", e)),
        };
        match rustix::io::retry_on_intr(|| flock(&file, FlockOperation::NonBlockingLockExclusive)) {
            Ok(()) => Ok(Some(Some(Lease { _held: file, _root: None }))),
            Err(Errno::WOULDBLOCK) => Ok(None),
            Err(e) => Err(BusError::io(&path, "test the lease", e)),
        }
    }
}

/// Takes a shared lock on the directory as well: if the files in it are removed, the lease among them, the lock still says
/// that the fleet is looked after. A directory that is gone needs no lock.
fn hold_root(address: &Address) -> std::result::Result<Option<OwnedFd>, Errno> {
    let root = match open_root(address) {
        Err(Errno::NOENT) => return Ok(None),
        root => root?,
    };
    // Blocks only while another process tests the lock, which takes microseconds.
    rustix::io::retry_on_intr(|| flock(&root, FlockOperation::LockShared))?;
    Ok(Some(root))
}

/// Whether a process holds the directory of this fleet.
fn is_root_held(address: &Address) -> bool {
    let Ok(root) = open_root(address) else { return false };
    rustix::io::retry_on_intr(|| flock(&root, FlockOperation::NonBlockingLockExclusive)) == Err(Errno::WOULDBLOCK)
}

fn open_root(address: &Address) -> std::result::Result<OwnedFd, Errno> {
    let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::CLOEXEC | OFlags::NOFOLLOW;
    open(address.root(), flags, Mode::empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fleet_is_abandoned_when_the_last_lease_is_gone() {
        let address = Address::create().unwrap();
        assert!(!Lease::is_abandoned(&address).unwrap(), "just being made");
        let daemon = Lease::take(&address).unwrap();
        let guardian = Lease::take(&address).unwrap();
        assert!(!Lease::is_abandoned(&address).unwrap());
        drop(daemon);
        assert!(!Lease::is_abandoned(&address).unwrap());
        drop(guardian);
        // Any shoal command on this machine may look at a free lease for a moment, or clean the fleet away.
        let start_ns = crate::clock::now_ns();
        while !Lease::is_abandoned(&address).unwrap() && address.root().exists() {
            assert!(crate::clock::now_ns() < start_ns + 10_000_000_000, "the lease is still held by somebody");
            crate::clock::sleep_until_ns(crate::clock::now_ns() + 1_000_000);
        }
        crate::clean::sweep(&address);
        assert!(!Lease::is_abandoned(&address).unwrap(), "gone");
    }

    #[test]
    fn a_fleet_whose_files_were_removed_is_not_abandoned_while_somebody_holds_it() {
        let address = Address::create().unwrap();
        let daemon = Lease::take(&address).unwrap();
        std::fs::remove_file(address.file("lease")).unwrap();
        assert!(!Lease::is_abandoned(&address).unwrap());
        drop(daemon);
        // Any shoal command on this machine may clean it away from here on.
        assert!(Lease::is_abandoned(&address).unwrap() || !address.root().exists());
        crate::clean::sweep(&address);
    }

    #[test]
    fn a_root_without_a_lease_is_abandoned_when_its_maker_is_dead() {
        let address = Address::create().unwrap();
        // Its age does not matter, nor does what a clock says of it.
        let touched = rustix::fs::Timespec { tv_sec: 1, tv_nsec: 0 };
        let times = rustix::fs::Timestamps { last_access: touched, last_modification: touched };
        rustix::fs::utimensat(CWD, address.root(), &times, rustix::fs::AtFlags::empty()).unwrap();
        assert!(!Lease::is_abandoned(&address).unwrap());
        std::fs::remove_file(address.file(MAKER)).unwrap();
        let dead = Maker::this().to_string().replacen(&std::process::id().to_string(), "4194305", 1);
        std::os::unix::fs::symlink(dead, address.file(MAKER)).unwrap();
        // Any shoal command on this machine may clean it away from here on.
        assert!(Lease::is_abandoned(&address).unwrap() || !address.root().exists());
        crate::clean::sweep(&address);
    }
}
