//! A descriptor to sleep on: a named pipe in the root of the fleet.
//!
//! iceoryx2's events would do the same, but in 0.10.0 their "already notified" flag can lose a wake-up for good when
//! several notify one listener. A pipe is level-triggered, and stays readable until it is drained.

use crate::{Address, BusError, Result};
use rustix::fs::{CWD, FileType, Mode, OFlags};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};

pub(crate) struct Bell {
    pipe: OwnedFd,
}

impl Bell {
    pub(crate) fn create(address: &Address, name: &str) -> Result<()> {
        let path = address.file(name);
        match rustix::fs::mknodat(CWD, &path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0) {
            Ok(()) | Err(rustix::io::Errno::EXIST) => Ok(()),
            Err(e) => Err(BusError::io(&path, "make a named pipe", e)),
        }
    }

    /// Both ends open it for reading and writing, so that opening does not wait for the other end, and ringing does
    /// not fail without it.
    pub(crate) fn open(address: &Address, name: &str) -> Result<Bell> {
        let path = address.file(name);
        let flags = OFlags::RDWR | OFlags::NONBLOCK | OFlags::CLOEXEC | OFlags::NOFOLLOW;
        let pipe =
            rustix::fs::open(&path, flags, Mode::empty()).map_err(|e| BusError::io(&path, "open a named pipe", e))?;
        Ok(Bell { pipe })
    }

    /// Makes the descriptor readable. A pipe that is full is readable already, so an error says nothing.
    pub(crate) fn ring(&self) {
        let _ = rustix::io::write(&self.pipe, &[0]);
    }

    /// Makes it unreadable until the next ring. What was rung for is to be looked at *after* this.
    pub(crate) fn drain(&self) {
        let mut bytes = [0_u8; 4096];
        // A pipe holds 64 KiB; the bound is for a neighbour that never stops ringing.
        for _ in 0..32 {
            if !matches!(rustix::io::read(&self.pipe, &mut bytes), Ok(n) if n == bytes.len()) {
                return;
            }
        }
    }
}

impl AsFd for Bell {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.pipe.as_fd()
    }
}
