//! The thread that looks at the fleet: a stopped daemon holds up this thread only.

use bus::{Address, OperatorClient};
use protocol::operator_to_daemon::{Reply, Request};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use watch::{Fleet, Frame, Live, Vitals, WatchError};

/// A look at where everything is this often.
const FRAME_EVERY: Duration = Duration::from_millis(100);
/// A look at how everybody does this often.
const VITALS_EVERY: Duration = Duration::from_millis(1000);
/// The first two of them are closer: shares of processors are measured between two.
const FIRST_AFTER: Duration = Duration::from_millis(300);
/// What an operator asks for takes the daemon this long at most: it waits for the world.
const PATIENCE: Duration = Duration::from_secs(5);
/// The end of the thread is waited for no longer. It may wait for a daemon.
const FAREWELL: Duration = Duration::from_millis(1500);

/// What has been seen and not taken yet.
#[derive(Default)]
pub(crate) struct News {
    /// The fleet, if it is another one than before: robots were added.
    pub(crate) fleet: Option<Fleet>,
    pub(crate) frame: Option<Frame>,
    pub(crate) vitals: Option<Vitals>,
    /// Why nothing is seen.
    pub(crate) blind: Option<String>,
    /// What operators' requests came to.
    pub(crate) replies: Vec<Result<Reply, String>>,
    /// The fleet has ended.
    pub(crate) is_over: bool,
}

impl News {
    /// Whether there is anything.
    pub(crate) fn is_some(&self) -> bool {
        let News { fleet, frame, vitals, blind, replies, is_over } = self;
        fleet.is_some() || frame.is_some() || vitals.is_some() || blind.is_some() || !replies.is_empty() || *is_over
    }

    /// What was measured later takes the place of what was measured before; what happened is kept.
    fn add_vitals(&mut self, mut vitals: Vitals) {
        if let Some(before) = self.vitals.take() {
            vitals.events.splice(0..0, before.events);
        }
        self.vitals = Some(vitals);
    }
}

/// Eyes on a fleet.
pub(crate) struct Eyes {
    address: Address,
    news: Arc<Mutex<News>>,
    enough: Arc<AtomicBool>,
    /// A request waits for the daemon's answer.
    asking: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Eyes {
    /// Looks at it from now on.
    #[expect(clippy::disallowed_methods, reason = "the screen does not wait for the fleet")]
    pub(crate) fn open(address: &Address, name: Option<&str>) -> Result<Eyes, WatchError> {
        let news = Arc::new(Mutex::new(News::default()));
        let enough = Arc::new(AtomicBool::new(false));
        // Here, so that what is wrong with the fleet is known at once.
        let fleet = Live::open(address, name)?.fleet().clone();
        lock(&news).fleet = Some(fleet);
        let (of_thread, until) = (Arc::clone(&news), Arc::clone(&enough));
        let (root, name) = (address.clone(), name.map(str::to_owned));
        let thread = std::thread::spawn(move || look(&root, name.as_deref(), &of_thread, &until));
        Ok(Eyes { address: address.clone(), news, enough, asking: Arc::default(), thread: Some(thread) })
    }

    /// What is new since the last call.
    pub(crate) fn take(&self) -> News {
        std::mem::take(&mut *lock(&self.news))
    }

    /// Asks the daemon; false if it has not answered the request before.
    #[expect(clippy::disallowed_methods, reason = "the screen does not wait for the daemon")]
    pub(crate) fn ask(&self, request: &Request) -> bool {
        if self.asking.swap(true, Relaxed) {
            return false;
        }
        let request = request.clone();
        let (address, news, asking) = (self.address.clone(), Arc::clone(&self.news), Arc::clone(&self.asking));
        std::thread::spawn(move || {
            let reply = OperatorClient::new(&address).ask(&request, PATIENCE).map_err(|error| error.to_string());
            lock(&news).replies.push(reply);
            asking.store(false, Relaxed);
        });
        true
    }
}

impl Drop for Eyes {
    fn drop(&mut self) {
        self.enough.store(true, Relaxed);
        let Some(thread) = self.thread.take() else { return };
        let began = now();
        while !thread.is_finished() && now() - began < FAREWELL {
            thread.thread().unpark();
            rest(Duration::from_millis(10));
        }
    }
}

fn lock(news: &Mutex<News>) -> std::sync::MutexGuard<'_, News> {
    news.lock().unwrap_or_else(PoisonError::into_inner)
}

fn look(address: &Address, name: Option<&str>, news: &Mutex<News>, enough: &AtomicBool) {
    let mut live = match Live::open(address, name) {
        Ok(live) => live,
        Err(error) => return lock(news).blind = Some(error.to_string()),
    };
    let (mut revision, mut looks, mut vitals_at) = (live.revision(), 0, now());
    while !enough.load(Relaxed) {
        if live.is_over() {
            return lock(news).is_over = true;
        }
        let began = now();
        if began >= vitals_at {
            vitals_at = began + if looks == 0 { FIRST_AFTER } else { VITALS_EVERY };
            looks += 1;
            match live.vitals() {
                Ok(vitals) => lock(news).add_vitals(vitals),
                Err(error) => lock(news).blind = Some(error.to_string()),
            }
        }
        match live.frame() {
            Ok(Some(frame)) => lock(news).frame = Some(frame),
            Ok(None) => {}
            Err(error) => lock(news).blind = Some(error.to_string()),
        }
        if live.revision() != revision {
            revision = live.revision();
            lock(news).fleet = Some(live.fleet().clone());
        }
        std::thread::park_timeout(FRAME_EVERY.saturating_sub(now() - began).max(Duration::from_millis(20)));
    }
}

/// One look that is enough for a screen: what is measured is of a second.
///
/// # Errors
/// When the fleet is gone, or its files are from another build.
pub(crate) fn once(address: &Address, name: Option<&str>) -> Result<(Fleet, Option<Frame>, Vitals), WatchError> {
    let mut live = Live::open(address, name)?;
    let first = live.vitals()?;
    let (mut frame, until) = (None, now() + VITALS_EVERY);
    while now() < until && !live.is_over() {
        frame = live.frame()?.or(frame);
        rest(Duration::from_millis(50));
    }
    let mut vitals = live.vitals()?;
    vitals.events.splice(0..0, first.events);
    Ok((live.fleet().clone(), frame, vitals))
}

#[expect(clippy::disallowed_methods, reason = "people look at a fleet in real time")]
pub(crate) fn now() -> Instant {
    Instant::now()
}

#[expect(clippy::disallowed_methods, reason = "between two looks")]
fn rest(time: Duration) {
    std::thread::sleep(time);
}
