//! A fleet's address for one bench, and what happens between two periods: another processor writes, this one forgets.

use bus::{Address, Lease, Node, clean};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use std::hint::black_box;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// An address of one's own, removed at the end. Declare it before whatever lives in it.
pub(crate) struct Home {
    pub(crate) address: Address,
    _lease: Lease,
}

impl Home {
    pub(crate) fn new() -> Home {
        let address = Address::create().unwrap();
        let lease = Lease::take(&address).unwrap();
        Home { address, _lease: lease }
    }

    pub(crate) fn node(&self, name: &str) -> Node {
        Node::new(&self.address, name).unwrap()
    }
}

impl Drop for Home {
    fn drop(&mut self) {
        clean::sweep(&self.address);
    }
}

/// A thread on another processor (if there is one) that works when it is told to.
pub(crate) struct Other {
    told: Option<SyncSender<u64>>,
    done: Receiver<()>,
    thread: Option<JoinHandle<()>>,
}

impl Other {
    /// `make` is called in the thread, and what it makes does the work: it is given the tick.
    pub(crate) fn new<Work: FnMut(u64)>(make: impl FnOnce() -> Work + Send + 'static) -> Other {
        let (told, orders) = sync_channel::<u64>(1);
        let (say_done, done) = sync_channel(1);
        stay_on(0);
        let thread = std::thread::spawn(move || {
            stay_on(1);
            let mut work = make();
            say_done.send(()).expect("the bench waits");
            for tick in orders {
                work(tick);
                if say_done.send(()).is_err() {
                    return;
                }
            }
        });
        done.recv().expect("the thread is ready");
        Other { told: Some(told), done, thread: Some(thread) }
    }

    /// Has the work of this tick begun.
    pub(crate) fn begin(&self, tick: u64) {
        self.told.as_ref().expect("it has not been dropped").send(tick).expect("the thread lives");
    }

    /// Has the work of this tick done.
    pub(crate) fn work(&self, tick: u64) {
        self.begin(tick);
        self.done.recv().expect("the thread lives");
    }
}

impl Drop for Other {
    fn drop(&mut self) {
        self.told = None;
        let ended = self.thread.take().map(JoinHandle::join);
        assert!(std::thread::panicking() || matches!(ended, Some(Ok(()))), "the other thread has failed");
    }
}

/// Keeps this thread on the first or second of the processors that this process may use. Where that is refused, or where
/// there is one only, both threads stay where they are.
fn stay_on(place: usize) {
    let Ok(allowed) = sched_getaffinity(None) else { return };
    static ALLOWED: std::sync::OnceLock<CpuSet> = std::sync::OnceLock::new();
    let allowed = ALLOWED.get_or_init(|| allowed);
    if let Some(processor) = (0..CpuSet::MAX_CPU).filter(|cpu| allowed.is_set(*cpu)).nth(place) {
        let mut only = CpuSet::new();
        only.set(processor);
        let _ = sched_setaffinity(None, &only);
    }
}

/// What lies between two periods of a robot: its processor forgets.
pub(crate) struct Period {
    memory: Vec<u8>,
}

impl Period {
    pub(crate) fn new() -> Period {
        // More than a processor's own cache, in more pages than its translation buffer has places.
        Period { memory: vec![1; 16 << 20] }
    }

    pub(crate) fn pass(&self) {
        black_box(self.memory.iter().step_by(64).fold(0_u64, |sum, byte| sum + u64::from(*byte)));
        std::thread::sleep(Duration::from_millis(2));
    }
}
