//! Signals as something to look at: what arrived since the last look, and a file descriptor to sleep on.

use signal_hook::consts::{SIGCHLD, SIGHUP, SIGINT, SIGTERM};
use std::io::{self, Read};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

/// The signals that the daemon minds.
pub struct Signals {
    bell: UnixStream,
    interrupts: Arc<AtomicUsize>,
    seen: usize,
}

impl Signals {
    /// From here on SIGINT, SIGTERM and SIGHUP are counted, and they and SIGCHLD wake whoever sleeps on the descriptor.
    ///
    /// # Errors
    /// When a handler cannot be installed.
    pub fn install() -> io::Result<Signals> {
        let (bell, ringer) = UnixStream::pair()?;
        bell.set_nonblocking(true)?;
        ringer.set_nonblocking(true)?;
        let interrupts = Arc::new(AtomicUsize::new(0));
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            // The count comes first: whoever is woken by the bell finds it.
            let count = Arc::clone(&interrupts);
            // SAFETY: the handler only increments an atomic, which is async-signal-safe.
            unsafe { signal_hook::low_level::register(signal, move || _ = count.fetch_add(1, SeqCst)) }?;
            signal_hook::low_level::pipe::register(signal, ringer.try_clone()?)?;
        }
        signal_hook::low_level::pipe::register(SIGCHLD, ringer)?;
        Ok(Signals { bell, interrupts, seen: 0 })
    }

    /// How often somebody asked for the end since the last call. Empties the descriptor.
    pub fn take_interrupts(&mut self) -> usize {
        let mut bytes = [0; 64];
        while matches!(self.bell.read(&mut bytes), Ok(read) if read > 0) {}
        let now = self.interrupts.load(SeqCst);
        let new = now - self.seen;
        self.seen = now;
        new
    }
}

impl AsFd for Signals {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.bell.as_fd()
    }
}
