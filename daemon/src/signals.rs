//! Signals as something to look at: what arrived since the last look, and a file descriptor to sleep on.

use crate::exit::Failure;
use signal_hook::SigId;
use signal_hook::consts::{SIGCHLD, SIGHUP, SIGINT, SIGTERM};
use std::io::{self, Read};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst};

/// The signals that ask for the end.
pub const ENDINGS: [i32; 3] = [SIGINT, SIGTERM, SIGHUP];

/// Installs handlers for [`ENDINGS`] while these signals wait. Between the kernel's learning of a new handler and the
/// handler's learning what to do, a signal would be swallowed.
pub fn held_back<T>(install: impl FnOnce() -> T) -> T {
    let mut set = MaybeUninit::<libc::sigset_t>::uninit();
    let mut before = MaybeUninit::<libc::sigset_t>::uninit();
    // SAFETY: sigemptyset initialises the set, the rest reads it; the numbers are those of real signals.
    unsafe {
        libc::sigemptyset(set.as_mut_ptr());
        for signal in ENDINGS {
            libc::sigaddset(set.as_mut_ptr(), signal);
        }
        libc::pthread_sigmask(libc::SIG_BLOCK, set.as_ptr(), before.as_mut_ptr());
    }
    let result = install();
    // SAFETY: the call above has filled `before` in.
    unsafe { libc::pthread_sigmask(libc::SIG_SETMASK, before.as_ptr(), std::ptr::null_mut()) };
    result
}

/// The signals that the daemon minds.
pub struct Signals {
    bell: UnixStream,
    interrupts: Arc<AtomicUsize>,
    seen: usize,
    handlers: Vec<SigId>,
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
        let mut signals = Signals { bell, interrupts: Arc::default(), seen: 0, handlers: Vec::new() };
        let Signals { interrupts, handlers, .. } = &mut signals;
        held_back(|| -> io::Result<()> {
            for signal in ENDINGS {
                // The count comes first: whoever is woken by the bell finds it.
                let count = Arc::clone(interrupts);
                // SAFETY: the handler only increments an atomic, which is async-signal-safe.
                let counted =
                    unsafe { signal_hook::low_level::register(signal, move || _ = count.fetch_add(1, SeqCst)) };
                handlers.push(counted?);
                handlers.push(signal_hook::low_level::pipe::register(signal, ringer.try_clone()?)?);
            }
            handlers.push(signal_hook::low_level::pipe::register(SIGCHLD, ringer)?);
            Ok(())
        })?;
        Ok(signals)
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

/// A process may run one fleet after another.
impl Drop for Signals {
    fn drop(&mut self) {
        for handler in self.handlers.drain(..) {
            signal_hook::low_level::unregister(handler);
        }
    }
}

impl AsFd for Signals {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.bell.as_fd()
    }
}

/// For work in this process alone: the first signal that asks for the end is noticed, the second ends the process.
pub struct Interrupted(Arc<AtomicBool>);

impl Interrupted {
    /// From here on.
    ///
    /// # Errors
    /// With exit code 3, when a handler cannot be installed.
    pub fn watch() -> Result<Interrupted, Failure> {
        let flag = Arc::new(AtomicBool::new(false));
        held_back(|| {
            ENDINGS.into_iter().try_for_each(|signal| {
                // The order matters: the second signal finds the flag set by the first, and ends the process.
                signal_hook::flag::register_conditional_shutdown(signal, crate::exit::INTERRUPTED, Arc::clone(&flag))
                    .and_then(|_| signal_hook::flag::register(signal, Arc::clone(&flag)))
                    .map(drop)
            })
        })
        .map_err(|error| Failure::environment(format!("signals: cannot install handlers: {error}")))?;
        Ok(Interrupted(flag))
    }

    /// Whether somebody has asked for the end.
    pub fn yes(&self) -> bool {
        self.0.load(SeqCst)
    }
}
