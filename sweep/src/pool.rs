//! The runs of a sweep over several threads.

use crate::error::Error;
use crate::execute::{self, Execute};
use crate::plan::Plan;
use crate::record::Record;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

/// How often `told` is called while no run ends.
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// Executes the runs `to_do` of a plan on `jobs` threads. Each record goes to `keep`, in this thread and in the order in
/// which the runs end; `told` is called at least every 100 ms. Runs that are under way when `is_ending` says so are broken
/// off. The first error of a run or of `keep` ends the others.
///
/// # Errors
/// That error.
pub fn run(
    plan: &Plan,
    to_do: &[usize],
    jobs: usize,
    execute: &Execute<'_>,
    is_ending: &(dyn Fn() -> bool + Sync),
    keep: &mut dyn FnMut(Record) -> Result<(), Error>,
    told: &mut dyn FnMut(),
) -> Result<(), Error> {
    let (next, failed) = (AtomicUsize::new(0), AtomicBool::new(false));
    let goes_on = || !failed.load(SeqCst) && !is_ending();
    // Bounded, so that a slow disk slows the threads down and does not fill the memory.
    let (sender, receiver) = mpsc::sync_channel::<Result<Record, Error>>(jobs.max(1));
    thread::scope(|scope| {
        for _ in 0..jobs.clamp(1, to_do.len().max(1)) {
            let (sender, next, goes_on) = (sender.clone(), &next, &goes_on);
            scope.spawn(move || {
                while goes_on()
                    && let Some(index) = to_do.get(next.fetch_add(1, SeqCst))
                {
                    let scenario = execute::scenario(plan, *index);
                    match scenario.and_then(|scenario| execute(&plan.run(*index), scenario, &goes_on)) {
                        // The receiver listens until all senders are gone.
                        Ok(Some(record)) => sender.send(Ok(record)).expect("a receiver"),
                        Ok(None) => return,
                        Err(error) => return sender.send(Err(error)).expect("a receiver"),
                    }
                }
            });
        }
        drop(sender);
        let mut result = Ok(());
        loop {
            match receiver.recv_timeout(LOOK_EVERY) {
                // What has ended after a failure is kept as well.
                Ok(ended) => {
                    if let Err(error) = ended.and_then(&mut *keep) {
                        failed.store(true, SeqCst);
                        result = result.and(Err(error));
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return result,
            }
            told();
        }
    })
}
