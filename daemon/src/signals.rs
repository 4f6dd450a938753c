//! Signals as something to look at: what arrived since the last look, and a file descriptor to sleep on.

use crate::coordinator::is_same_request;
use crate::error::{Error, Kind};
use bus::clock;
use libc::{SIG_DFL, SIG_IGN, sigaction, sigset_t};
use signal_hook::consts::{SIGCHLD, SIGHUP, SIGINT, SIGTERM};
use std::ffi::c_int;
use std::io;
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, BorrowedFd, FromRawFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU64, Ordering::SeqCst};
use std::time::Duration;

/// The signals that ask for the end.
pub const ENDINGS: [i32; 3] = [SIGINT, SIGTERM, SIGHUP];

/// This process has minded one of [`ENDINGS`]: what they do by default is not what people expect of it any more.
static MINDED: AtomicBool = AtomicBool::new(false);
/// A fleet of this process has been asked to end: [`Interrupted`] knows of that while the fleet still runs.
static ASKED: AtomicBool = AtomicBool::new(false);

/// In place of the time of the first signal: none has come.
const NEVER: u64 = 0;

/// Those that were not ignored when this process was started. One that was (SIGHUP under `nohup`, SIGINT of a shell's
/// background job) is not for us: it stays ignored.
fn minded() -> Vec<i32> {
    MINDED.store(true, SeqCst);
    ENDINGS.into_iter().filter(|signal| disposition(*signal).sa_sigaction != SIG_IGN).collect()
}

/// What this process does with a signal.
fn disposition(signal: i32) -> sigaction {
    let mut now = MaybeUninit::<sigaction>::zeroed();
    // SAFETY: asks only; the number is that of a real signal, so the kernel fills in the structure, which may be all zero.
    unsafe {
        sigaction(signal, std::ptr::null(), now.as_mut_ptr());
        now.assume_init()
    }
}

fn set_disposition(signal: i32, to: &sigaction) {
    // SAFETY: `to` is what the kernel gave, or is made here from a constant or an async-signal-safe function.
    unsafe { sigaction(signal, to, std::ptr::null_mut()) };
}

/// A disposition without flags: `SIG_IGN`, `SIG_DFL`, or the address of a handler.
fn plain(handler: libc::sighandler_t) -> sigaction {
    // SAFETY: a structure of integers and a set that is empty when it is zero.
    let mut plain: sigaction = unsafe { std::mem::zeroed() };
    plain.sa_sigaction = handler;
    plain
}

fn set_of(signals: &[i32]) -> sigset_t {
    let mut set = MaybeUninit::<sigset_t>::uninit();
    // SAFETY: sigemptyset initialises the set, the rest changes it; the numbers are those of real signals.
    unsafe {
        libc::sigemptyset(set.as_mut_ptr());
        for signal in signals {
            libc::sigaddset(set.as_mut_ptr(), *signal);
        }
        set.assume_init()
    }
}

/// Holds signals back; those that were held back before.
fn hold(set: &sigset_t) -> sigset_t {
    let mut before = MaybeUninit::<sigset_t>::uninit();
    // SAFETY: `set` is initialised, and the call fills `before` in.
    unsafe {
        libc::pthread_sigmask(libc::SIG_BLOCK, set, before.as_mut_ptr());
        before.assume_init()
    }
}

fn let_go(before: &sigset_t) {
    // SAFETY: a set that `hold` gave.
    unsafe { libc::pthread_sigmask(libc::SIG_SETMASK, before, std::ptr::null_mut()) };
}

/// Starts a process that hears of the end of its children: what this one holds back, a child inherits, and a shell that does not
/// hear of SIGCHLD waits for its children for ever. (A hook between fork and exec would have the C library try a shell where the
/// kernel refuses a file.)
pub(crate) fn with_children_heard<T>(start: impl FnOnce() -> T) -> T {
    let mut before = MaybeUninit::<sigset_t>::uninit();
    // SAFETY: the set is initialised, and the call fills `before` in.
    let before = unsafe {
        libc::pthread_sigmask(libc::SIG_UNBLOCK, &set_of(&[SIGCHLD]), before.as_mut_ptr());
        before.assume_init()
    };
    let started = start();
    let_go(&before);
    // The end of a child that was told of meanwhile is lost, because this process ignores it: so it looks once more.
    // SAFETY: asks for the number of this process, which exists.
    unsafe { libc::kill(libc::getpid(), SIGCHLD) };
    started
}

/// Installs handlers for [`ENDINGS`] while these signals wait. Between the kernel's learning of a new handler and the
/// handler's learning what to do, a signal would be swallowed.
pub fn held_back<T>(install: impl FnOnce() -> T) -> T {
    let before = hold(&set_of(&ENDINGS));
    let result = install();
    let_go(&before);
    result
}

/// The signals that the daemon minds. They are held back and read from a descriptor, so that nothing interrupts it.
///
/// They are *ignored* as well, which changes nothing here, because a signal that is held back waits all the same, but is
/// what children inherit: a process of the fleet does not end of a signal that asks the whole fleet to end (as service
/// managers send it to every process at once), from its first instruction on, and without a detour at its start.
pub struct Signals {
    waiting: OwnedFd,
    asked: bool,
    hung_up: bool,
    /// The last one that was taken.
    last: Option<i32>,
    dispositions: Vec<(i32, sigaction)>,
    held: sigset_t,
}

impl Signals {
    /// From here on SIGINT, SIGTERM and SIGHUP are counted, and they and SIGCHLD wake whoever sleeps on the descriptor.
    /// All threads that there are must have been started later.
    ///
    /// # Errors
    /// When there is no descriptor for it.
    pub fn install() -> io::Result<Signals> {
        let minded = minded();
        let set = set_of(&[&minded[..], &[SIGCHLD]].concat());
        // SAFETY: the set is initialised; -1 asks for a new descriptor.
        let waiting = unsafe { libc::signalfd(-1, &raw const set, libc::SFD_NONBLOCK | libc::SFD_CLOEXEC) };
        if waiting < 0 {
            return Err(io::Error::last_os_error());
        }
        // SAFETY: it has just been made, and nothing else refers to it.
        let waiting = unsafe { OwnedFd::from_raw_fd(waiting) };
        let held = hold(&set);
        let dispositions = minded.iter().map(|signal| (*signal, disposition(*signal))).collect();
        minded.iter().for_each(|signal| set_disposition(*signal, &plain(SIG_IGN)));
        // The parent of this process may have ignored SIGCHLD; then the endings of our children would be lost.
        set_disposition(SIGCHLD, &plain(SIG_DFL));
        Ok(Signals { waiting, asked: false, hung_up: false, last: None, dispositions, held })
    }

    /// Requests for the end since the last call. Empties the descriptor. A terminal that is gone asks
    /// once, though its shell and the kernel both say so.
    pub fn take_interrupts(&mut self) -> usize {
        let mut count = 0;
        let mut info = [0_u8; size_of::<libc::signalfd_siginfo>()];
        while matches!(rustix::io::read(&self.waiting, &mut info), Ok(read) if read == info.len()) {
            let number = u32::from_ne_bytes([info[0], info[1], info[2], info[3]]) as i32;
            if number == SIGCHLD {
                continue;
            }
            self.hung_up |= number == SIGHUP;
            if number != SIGHUP || !self.asked {
                count += 1;
            }
            (self.asked, self.last) = (true, Some(number));
            ASKED.store(true, SeqCst);
        }
        count
    }
}

/// A process may run one fleet after another.
impl Drop for Signals {
    fn drop(&mut self) {
        let _ = self.take_interrupts();
        for (signal, before) in &self.dispositions {
            // The terminal goes once: its signal may still come from a second one who tells.
            if !(self.hung_up && *signal == SIGHUP) {
                set_disposition(*signal, before);
            }
        }
        let_go(&self.held);
        // The handler that was there before is called as well.
        let handled = |number: &i32| ![SIG_DFL, SIG_IGN].contains(&disposition(*number).sa_sigaction);
        if let Some(number) = self.last.filter(handled) {
            let _ = signal_hook::low_level::raise(number);
        }
    }
}

impl AsFd for Signals {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.waiting.as_fd()
    }
}

/// For work in this process alone: the first signal that asks for the end is noticed, the second ends the process, unless
/// it comes right after the first.
pub struct Interrupted(Arc<AtomicU64>);

impl Interrupted {
    /// From here on. The second signal ends the process with `code`.
    ///
    /// # Errors
    /// When a handler cannot be installed.
    pub fn watch(code: i32) -> Result<Interrupted, Error> {
        let first_ns = Arc::new(AtomicU64::new(NEVER));
        held_back(|| {
            minded().into_iter().try_for_each(|signal| {
                let first_ns = Arc::clone(&first_ns);
                let action = move || {
                    let now_ns = clock::now_ns();
                    // The first signal leaves its time; a later one finds it.
                    if let Err(first_ns) = first_ns.compare_exchange(NEVER, now_ns, SeqCst, SeqCst)
                        && !is_same_request(Duration::from_nanos(first_ns), Duration::from_nanos(now_ns))
                    {
                        signal_hook::low_level::exit(code);
                    }
                };
                // SAFETY: an atomic, a look at the clock and `_exit` may be done in a handler.
                unsafe { signal_hook::low_level::register(signal, action) }.map(drop)
            })
        })
        .map_err(|error| Error::new(Kind::Process, format!("signals: cannot install handlers: {error}")))?;
        Ok(Interrupted(first_ns))
    }

    /// Whether the end has been asked for, by a signal to this process or to a fleet that it runs.
    pub fn yes(&self) -> bool {
        self.0.load(SeqCst) != NEVER || ASKED.load(SeqCst)
    }
}

/// Does something that may wait for a reader for ever, after everything else is done: a signal that asks for the end ends
/// the process immediately, with `code`. Where no signal has been minded before, they do what they always do.
pub fn ending_at_once<T>(code: i32, work: impl FnOnce() -> T) -> T {
    static CODE: AtomicI32 = AtomicI32::new(0);
    extern "C" fn end(_: c_int) {
        // SAFETY: ends the process, which is async-signal-safe.
        unsafe { libc::_exit(CODE.load(SeqCst)) }
    }
    CODE.store(code, SeqCst);
    if !MINDED.load(SeqCst) {
        return work();
    }
    let handler = end as extern "C" fn(c_int);
    let before: Vec<(i32, sigaction)> = minded().into_iter().map(|signal| (signal, disposition(signal))).collect();
    before.iter().for_each(|(signal, _)| set_disposition(*signal, &plain(handler as libc::sighandler_t)));
    let result = work();
    before.iter().for_each(|(signal, before)| set_disposition(*signal, before));
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_to_a_fleet_is_known_while_the_fleet_runs() {
        // These tests may run with it ignored.
        set_disposition(SIGTERM, &plain(SIG_DFL));
        let interrupted = Interrupted::watch(1).unwrap();
        let mut fleet = Signals::install().unwrap();
        assert!(!interrupted.yes());
        // To this thread alone.
        signal_hook::low_level::raise(SIGTERM).unwrap();
        assert_eq!(interrupted.0.load(SeqCst), NEVER, "it is held back");
        assert_eq!(fleet.take_interrupts(), 1);
        assert!(interrupted.yes());
        assert_eq!(fleet.take_interrupts(), 0);
    }
}
